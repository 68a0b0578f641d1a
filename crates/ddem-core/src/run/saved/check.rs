//! Checks of a restored state, so that arbitrary bytes cannot index beyond an array.

use super::{RestoreError, RunState};
use crate::model::Model;
use crate::model::conditions::AppliedForces;
use crate::state::{Peaks, State};
use ddem_joint::broken::BrokenJoints;
use ddem_joint::contact::{
    CombinedSurface, ContactPoint, Contacts, JointStatus, NearPair, Patch, ReleasedJoint,
};
use ddem_joint::point::JointPoint;
use ddem_mechanics::law::{PointState, SpringStiffness};
use ddem_mechanics::math::lanes::Lanes;
use ddem_mechanics::rigid::Pose;
use ddem_mesh::SurfacePoint;
use ddem_mesh::assembly::NO_TABLE;

/// Largest valid number of steps, more than any run takes.
const MOST_STEPS: u64 = 1 << 53;

type Checked = Result<(), RestoreError>;

pub(super) fn expect(sound: bool, what: &str) -> Checked {
    if sound { Ok(()) } else { Err(RestoreError::Damaged { what: what.to_owned() }) }
}

/// Checks the stages of a state with the model at its start.
pub(super) fn stages(model: &Model, state: &State, run: &RunState) -> Checked {
    let &State { stage, stage_entry, .. } = state;
    let runs = stage < model.n_stages();
    expect(runs && state.stage_starts.len() == stage + 1, "the model has no such stage")?;
    let stage_entry = stage_entry.map(|entry| [Some(entry.from_stage), Some(entry.first)]);
    let relaxation = run.relaxation.as_ref().map(|state| [Some(state.from_stage), state.driven]);
    let mut known = stage_entry.into_iter().chain(relaxation).flatten().flatten();
    expect(known.all(|known| known <= stage + 1), "invalid previous stage")?;
    let released = state.released.keys().copied();
    expect(released.eq(model.fading(0, stage)), "invalid removed blocks")
}

/// Checks times and counts.
pub(super) fn run(model: &Model, state: &State, run: &RunState) -> Checked {
    let steps = state.steps;
    let times = [state.time, state.before, run.time_step, run.initial_energy];
    let finite = times.iter().all(|x| x.is_finite()) && state.before >= 0.0;
    let moves = run.time_step > 0.0 || !run.started;
    let critical = run.critical_steps.iter().flatten().all(|&step| step > 0.0);
    expect(finite && state.time >= 0.0 && moves && critical, "invalid times")?;
    let counts = steps <= MOST_STEPS && state.origin.1 <= steps && state.watch.is_valid(steps);
    expect(counts, "invalid step counts")?;
    let failed = state.failed.iter().all(|&failed| failed <= model.n_pairs() as u64);
    expect(failed, "more failed pairs than the model has")?;
    let Some(state) = &run.relaxation else { return Ok(()) };
    let n = model.conditions.n_factors();
    let factors = [&state.from, &state.to].iter().all(|factors| factors.len() == n);
    let parts = (1..=state.increments).contains(&state.increment);
    let counts = state.since_restart.max(state.rounded) <= MOST_STEPS;
    expect(factors && parts && counts, "invalid relaxation")
}

/// Checks all arrays. Displacements and velocities may have any value, so that a diverged run can
/// be examined.
pub(super) fn state(model: &Model, state: &State) -> Checked {
    let State { u, v, applied, locked_reactions, released, .. } = state;
    let n = 3 * model.packs.nodes;
    expect([u.len(), v.len()] == [n, n], "wrong number of nodes")?;
    let factors = state.load_factors.len() == model.conditions.n_factors();
    expect(factors, "wrong number of load factors")?;
    let known = |forces: &AppliedForces| {
        forces.keys().next_back().is_none_or(|&at| (at as usize) < model.n_nodes())
    };
    let fades =
        released.values().all(|fading| fading.start_time.is_finite() && known(&fading.forces));
    expect(
        known(applied) && known(locked_reactions) && fades,
        "forces on nodes that do not exist",
    )?;
    let columns = state.columns.len() == model.boundaries.column_nodes();
    let gas = state.gas_surfaces.len() == model.conditions.n_gas_surfaces();
    expect(columns && gas, "wrong number of free-field columns or charges")?;
    peaks(model, &state.peaks)?;
    let diverged = !u.iter().chain(v).all(|lanes| lanes.0.iter().all(|x| x.is_finite()));
    let mut poses = state.poses.iter().flatten();
    let rigid = state.poses.len() == model.packs.rigid;
    expect(rigid && poses.all(|pose| diverged || is_sound(pose)), "invalid pose of a rigid block")?;
    broken_joints(model, &state.broken_joints)?;
    contacts(model, &state.contacts, diverged)?;
    bonds(model, &state.contacts)
}

fn peaks(model: &Model, peaks: &Peaks) -> Checked {
    let [nodes, blocks] =
        if model.properties.peaks { [model.packs.nodes, model.n_blocks()] } else { [0; 2] };
    let elements = (0..blocks).map(|block| model.geometry.topology(block).elements());
    let matches = peaks.speeds.len() == nodes && peaks.stresses.iter().map(Vec::len).eq(elements);
    expect(matches, "wrong number of peaks")
}

/// True if the numbers form a pose, which they need not in a diverged run.
fn is_sound(pose: &Pose) -> bool {
    let Pose { shift, turn, velocity, momentum } = pose;
    let turns = (turn.coords.norm_squared() - 1.0).abs() < 1e-9;
    turns && [shift, velocity, momentum].iter().all(|v| v.iter().all(|x| x.is_finite()))
}

/// Checks that broken joints are lattices of the model.
fn broken_joints(model: &Model, broken_joints: &BrokenJoints) -> Checked {
    let packs = &model.packs;
    expect(broken_joints.packs.len() == packs.packs.len(), "wrong number of joints")?;
    for (index, lattices) in broken_joints.packs.iter().enumerate() {
        let numbering = packs.numbering_of(&packs.packs[index]);
        for (offset, broken) in lattices.iter().flat_map(|lattices| lattices.iter().enumerate()) {
            let Some(broken) = broken else { continue };
            let d = offset.is_power_of_two().then(|| offset.trailing_zeros() as usize);
            let section = d.is_some_and(|d| model.sections.get(index, d).is_some());
            let exists = section || model.assembly.pack_tables[index][offset] != NO_TABLE;
            let pairs = d.map_or(0, |d| numbering.pairs[d].len());
            let matches =
                offset > 0 && broken.is_consistent(numbering.dims(offset).iter().product(), pairs);
            expect(exists && matches, "failed joints that do not exist")?;
        }
    }
    Ok(())
}

/// Checks that contacts and near pairs have two blocks each, in order.
fn contacts(model: &Model, contacts: &Contacts, diverged: bool) -> Checked {
    let (n, start) = (model.n_blocks(), model.contacts());
    let sizes = |contacts: &Contacts| [contacts.joints.len(), contacts.travel.len()];
    let same = sizes(contacts) == sizes(&start) && contacts.bodies == start.bodies;
    expect(same, "contacts of another number of blocks")?;
    let Contacts { patches, near, travel, .. } = contacts;
    let none = patches.is_empty() && near.is_empty();
    expect(none || model.contact.is_some(), "contacts in a model without contact")?;
    let two = |&[a, b]: &[u32; 2]| a < b && (b as usize) < n;
    let met = patches.iter().map(|patch| &patch.blocks).all(two)
        && patches.is_sorted_by(|a, b| a.blocks < b.blocks);
    let may_meet = near.iter().map(|near| &near.blocks).all(two)
        && near.is_sorted_by(|a, b| a.blocks < b.blocks)
        && near.iter().all(|near| contacts.patch_index(near.blocks).is_err());
    expect(met && may_meet, "contacts of blocks that do not exist")?;
    let finite = |Lanes(lanes): &Lanes| lanes.iter().all(|x| x.is_finite());
    let finite_travel = travel.iter().all(finite)
        && near.iter().all(|NearPair { next_check, .. }| next_check.is_finite());
    expect(diverged || finite_travel, "invalid travel of blocks")?;
    let sound = patches.iter().all(|patch| diverged || is_finite(patch));
    expect(sound && patches.iter().all(|patch| is_on(model, patch, diverged)), "invalid contacts")
}

/// True if a patch is on faces of its blocks. Its positions there are not checked in a diverged
/// run.
fn is_on(model: &Model, patch: &Patch, diverged: bool) -> bool {
    let CombinedSurface {
        thickness,
        stiffness: SpringStiffness { normal, shear },
        friction,
        dashpot,
    } = patch.surface;
    let sizes = [f64::from(patch.limit), normal, shear].iter().all(|&size| size > 0.0);
    let rest = [thickness, dashpot, patch.energy_reserve].iter().all(|&x| x >= 0.0)
        && friction.is_sound(&model.laws);
    let on = |(&first, point): (&u32, &SurfacePoint)| {
        let SurfacePoint { part: _, face, element, on } = point;
        let block = point.block(first);
        if block >= model.n_blocks() || *face >= 6 {
            return false;
        }
        let n = model.geometry.topology(block).divisions();
        element.iter().all(|&i| usize::from(i) < n)
            && (diverged || on.iter().all(|on| (0.0..=1.0).contains(on)))
    };
    let point = |point: &ContactPoint| {
        patch.blocks.iter().zip(&point.points).all(on) && (diverged || point.pair.area >= 0.0)
    };
    sizes && rest && patch.reference < 2 && patch.points.iter().all(point)
}

/// True if all numbers of a patch are finite and its axes are unit vectors.
fn is_finite(patch: &Patch) -> bool {
    let CombinedSurface {
        thickness, stiffness: SpringStiffness { normal, shear }, dashpot, ..
    } = patch.surface;
    let other_axes = patch.axes_in_other.map(|axis| axis.map(f64::from));
    let axes = patch.axes.iter().chain(&other_axes);
    let of_surface = [thickness, normal, shear, dashpot];
    let numbers = patch.relative_position.iter().chain(&of_surface);
    let point = |&ContactPoint {
                     pair: JointPoint { area, origin, state, .. }, slip_path, ..
                 }: &_| {
        let PointState {
            slip,
            dilation,
            applied_dilation,
            damage,
            gap,
            traction,
            added_tractions,
            energy_excess,
            equilibrium,
        } = state;
        let held = [
            area,
            slip.x,
            slip.y,
            gap,
            energy_excess,
            slip_path,
            traction.normal,
            damage,
            applied_dilation,
        ];
        let more =
            [traction.shear.x, traction.shear.y, dilation, added_tractions[0], added_tractions[1]];
        let equilibrium = equilibrium.map(|s| [s.slip.x, s.slip.y, s.dilation, s.damage, s.gap]);
        let all = held.iter().chain(&more).chain(&origin).chain(equilibrium.iter().flatten());
        all.into_iter().all(|x| x.is_finite())
    };
    axes.into_iter().all(|axis| (axis.norm_squared() - 1.0).abs() <= 1e-6)
        && numbers.chain([&f64::from(patch.limit), &patch.energy_reserve]).all(|x| x.is_finite())
        && patch.points.iter().all(point)
}

/// Checks that nonconforming joints have as many points as at the start, or have ended.
fn bonds(model: &Model, contacts: &Contacts) -> Checked {
    let held = contacts.patches.iter().filter_map(|patch| {
        let bond = patch.bond?;
        Some((patch.blocks, bond, patch.points.len(), bond.status < JointStatus::Pending))
    });
    let ended = contacts.ended.iter().map(|&ReleasedJoint { blocks, bond, ref pairs }| {
        (blocks, bond, pairs.len(), bond.status == JointStatus::Released)
    });
    let mut bonds: Vec<_> = held.chain(ended).collect();
    bonds.sort_by_key(|(blocks, ..)| *blocks);
    let sorted = contacts.ended.is_sorted_by(|a, b| a.blocks < b.blocks);
    let same = bonds.len() == model.bonded_patches.len()
        && bonds.iter().zip(&model.bonded_patches).all(
            |((blocks, bond, pairs, matches), bonded_patches)| {
                let pairs = *pairs == bonded_patches.patch.points.len();
                let joint = usize::from(bond.joint) < model.properties.joints.len();
                *matches && pairs && joint && *blocks == bonded_patches.patch.blocks
            },
        );
    expect(sorted && same, "nonconforming joints of another model")
}
