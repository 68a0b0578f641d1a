//! First pass of a step: forces of blocks and joints from displacements.

use std::ops::Range;

use fearless_simd::{Level, Simd, dispatch};
use fearless_simd_macros::simd;

use crate::force::block::block;
use crate::force::joint::{cell_energy, joint};
use crate::force::neighbour_forces::clear;
use crate::model::Model;
use crate::state::pass::{Input, Viscous, Workspace};
use crate::state::profile::Phase;
use crate::step::scratch::{FirstPassPack, NeighbourForcesMut, PackForces, PackJoints, Scratch};
use ddem_joint::broken::{BrokenJoints, BrokenLattice};
use ddem_joint::contact::{
    Configuration, ContactModel, Contacts, SearchContext, find, release_due_joints,
};
use ddem_joint::kinematics::NodePositions;
use ddem_joint::losses::{LossSums, Losses};
use ddem_joint::point::{FailureCheck, PairContext};
use ddem_mechanics::element::corotation::Frame;
use ddem_mechanics::math::exact::ExactSum;
use ddem_mechanics::math::lanes::{LANES, Lanes};
use ddem_mechanics::rigid::Pose;
use ddem_mesh::assembly::NO_TABLE;
use ddem_mesh::pack::JointLattice;
use ddem_mesh::parallel::spread;

/// Fields of the first pass, of a run of packs.
pub(super) type FirstPassFields<'a> = (PackForces<'a>, (PackJoints<'a>, NeighbourForcesMut<'a>));

/// Input of the first pass.
#[derive(Clone, Copy)]
pub(crate) struct FirstPass<'a> {
    pub(crate) model: &'a Model,
    /// Pack with which the displacements, velocities and frames begin.
    pub(crate) first: usize,
    /// Displacements `[m]`.
    pub(crate) u: &'a [Lanes],
    /// Poses of the rigid blocks, by rigid pack; empty in passes without contacts.
    pub(crate) poses: &'a [[Pose; LANES]],
    /// Check of the bonded pairs for failure.
    pub(crate) failure_check: FailureCheck<'a>,
    /// True if joints that have rotated release their bonded pairs.
    pub(crate) releases_rotated_joints: bool,
    /// True if slip continues from the last equilibrium. [`PairContext`] has this flag and
    /// `undamped`.
    pub(crate) relaxing: bool,
    pub(crate) undamped: bool,
    /// True if a step with new failures is discarded; contacts then stay unchanged.
    pub(crate) waits: bool,
    /// Present time `[s]`.
    pub(crate) time: f64,
    /// Velocities of the last half step and its time step, if there was one.
    pub(crate) last: Option<(&'a [Lanes], f64)>,
    /// Velocities and their time step, for the displacement increments of the last step.
    pub(crate) du: (&'a [Lanes], f64),
    /// Stiffness damping of the blocks, if in use.
    pub(crate) viscous: Option<Viscous<'a>>,
    /// True for blocks that supports hold along all axes, by pack and lane.
    pub(crate) held: &'a [[bool; LANES]],
    /// True if rotations of the blocks and in-situ stress are ignored, in any kinematics.
    pub(crate) linear: bool,
    pub(crate) energies: bool,
}

impl<'a> FirstPass<'a> {
    /// First pass of the linear model, in which nothing fails.
    pub(crate) fn linear(model: &'a Model, u: &'a [Lanes]) -> Self {
        Self {
            model,
            first: 0,
            u,
            poses: &[],
            failure_check: FailureCheck::None,
            releases_rotated_joints: false,
            relaxing: false,
            undamped: false,
            waits: false,
            time: 0.0,
            last: None,
            du: (u, 0.0),
            viscous: None,
            held: &[],
            linear: true,
            energies: false,
        }
    }

    /// Context of the pairs.
    fn pair_context(&self) -> PairContext<'a> {
        let Self {
            model, failure_check, releases_rotated_joints, relaxing, undamped, time, ..
        } = *self;
        let time_step = self.last.map(|_| self.du.1);
        PairContext {
            failure_check,
            releases_rotated_joints,
            relaxing,
            undamped,
            time,
            time_step,
            laws: &model.laws,
        }
    }
}

/// Runs the first pass: `f ← −K u` of the blocks, eq. (8), and of the joints, eq. (11) and §5, in
/// the frame of each block. Pairs fail and springs slip. Returns the losses.
pub(crate) fn forces(
    pass: FirstPass<'_>,
    broken_joints: &mut BrokenJoints,
    contacts: Option<&mut Contacts>,
    scratch: &mut Scratch,
) -> Losses {
    let level = scratch.level;
    let model = pass.model;
    let mut contacts = contacts.zip(model.contact.as_ref());
    let span = scratch.profiler.begin();
    let released = match &mut contacts {
        Some((contacts, contact_model)) => {
            let (search, configuration) =
                search_context(pass, contact_model, &scratch.frames, level);
            release_due_joints(search, configuration, broken_joints, contacts)
        }
        None => Losses::default(),
    };
    scratch.profiler.end(span, Phase::Contacts);
    let span = scratch.profiler.begin();
    let (fields, frames, runs) =
        scratch.forces(broken_joints, pass.energies, pass.viscous.is_some());
    let input = input(pass, frames);
    spread(&model.packs, runs, fields, &|run, mut fields: FirstPassFields<'_>| {
        dispatch!(level, simd => run_forces(simd, &input, run, &mut fields));
    });
    let mut losses = LossSums::from_iter(&scratch.losses).total();
    scratch.end_tasks(span);
    if let Some((contacts, contact_model)) = &mut contacts {
        let span = scratch.profiler.begin();
        let (search, configuration) = search_context(pass, contact_model, &scratch.frames, level);
        contacts.update_holding(search, &configuration);
        if pass.waits {
            let failing = contacts.failing(&configuration, search.context);
            losses.failed = [0, 1].map(|mode| losses.failed[mode] + failing[mode]);
        }
        scratch.profiler.end(span, Phase::Contacts);
    }
    if losses.failed != [0; 2] {
        if pass.waits {
            // A step that is not taken leaves the history of contacts unchanged.
            return losses;
        }
        losses.fracture += remove_cells(pass, broken_joints, scratch);
    }
    if let Some((contacts, contact_model)) = contacts {
        let span = scratch.profiler.begin();
        // Without a search for contacts joints keep their pairs and need no status.
        if contact_model.search {
            contacts.update_statuses(model.joint_lookup(), &model.laws, broken_joints);
        }
        let (search, configuration) = search_context(pass, contact_model, &scratch.frames, level);
        losses.add(&find(search, configuration, contacts));
        losses.add(&released);
        scratch.profiler.end(span, Phase::Contacts);
    }
    losses
}

/// Data of the contact search, and the configuration of the blocks (§9).
fn search_context<'a>(
    pass: FirstPass<'a>,
    contact_model: &'a ContactModel,
    frames: &'a [Frame],
    level: Level,
) -> (SearchContext<'a>, Configuration<'a>) {
    let context = pass.pair_context();
    let search = SearchContext {
        joints: pass.model.joint_lookup(),
        contact_model,
        held: pass.held,
        context,
        level,
    };
    let small = !pass.model.corotational();
    let start = pass.last.is_none();
    let blocks = &contact_model.blocks;
    let FirstPass { u, poses, du, .. } = pass;
    (search, Configuration { blocks, u, poses, frames, small, last: du, start })
}

pub(crate) fn input<'a>(pass: FirstPass<'a>, frames: &'a [Frame]) -> Input<'a> {
    let FirstPass { model, first, u, last, viscous, held, linear, .. } = pass;
    let frames = (model.corotational() && !linear).then_some(frames);
    Input {
        moved: NodePositions { packs: &model.packs, first, u, frames },
        assembly: &model.assembly,
        sections: &model.sections,
        in_situ: model.in_situ.as_ref().filter(|_| !linear),
        pair_context: pass.pair_context(),
        last,
        viscous,
        held,
    }
}

/// Removes the strips and corners around pairs that have just failed, from the next pass on.
/// Returns the energy that they held `[J]`.
fn remove_cells(
    pass: FirstPass<'_>,
    broken_joints: &mut BrokenJoints,
    scratch: &mut Scratch,
) -> f64 {
    let Model { packs, assembly, .. } = pass.model;
    let cells = broken_joints.strips_around_failures(packs, assembly);
    let mut work = Workspace::default();
    let mut lost = ExactSum::default();
    for cells in cells.chunk_by(|a, b| a.lattice == b.lattice) {
        let at = cells[0].lattice;
        let input = input(pass, &scratch.frames);
        let mut energy = |broken_joints: &BrokenJoints| {
            dispatch!(scratch.level, simd => {
                cell_energy(simd, &input, at, broken_joints.get(at.pack, at.offset), &mut work)
            })
        };
        lost.add(energy(broken_joints));
        broken_joints.remove(packs, assembly, cells);
        lost.add(-energy(broken_joints));
    }
    lost.value()
}

/// Computes `f ← −K u` of the blocks and joints, summed at the nodes, without loads or supports.
pub(crate) fn internal_forces(
    pass: FirstPass<'_>,
    broken_joints: &mut BrokenJoints,
    scratch: &mut Scratch,
) {
    forces(pass, broken_joints, None, scratch);
    scratch.collect(pass.model, &[], pass.linear);
}

/// Computes the forces of some packs.
#[simd]
pub(super) fn run_forces<S: Simd>(
    simd: S,
    input: &Input<'_>,
    run: Range<usize>,
    (forces, (joints, on_neighbours)): &mut FirstPassFields<'_>,
) {
    forces.workspaces[0].elements.stopwatch.start();
    for index in run {
        let pack = joints.pack(forces, on_neighbours, input.moved.packs, index);
        pack_forces(simd, input, index, pack);
    }
}

/// Computes the forces of one pack: of its blocks, then of its joints.
#[simd]
pub(super) fn pack_forces<S: Simd>(
    simd: S,
    input: &Input<'_>,
    pack: usize,
    FirstPassPack { mut out, broken_joints, work }: FirstPassPack<'_>,
) {
    let packs = input.moved.packs;
    if let Some(energy) = &mut out.energy {
        **energy = [Lanes::ZERO; 2];
    }
    *out.losses = Losses::default();
    block(simd, input, pack, &mut out, work);
    work.stopwatch.lap(Phase::Blocks);
    let tables = input.assembly.pack_tables[pack];
    for offset in 1..8 {
        let mut first = None;
        let broken = match broken_joints {
            Some(lattices) => &mut lattices[offset],
            None => &mut first,
        };
        if broken.as_deref().map_or(tables[offset] != NO_TABLE, BrokenLattice::acts) {
            joint(simd, input, JointLattice { pack, offset }, broken, &mut out, work);
        } else if input.assembly.loaded_neighbours[offset]
            && !packs.packs[pack].upper[offset].is_none()
        {
            clear(packs.numbering_of(&packs.packs[pack]), offset, out.neighbour_forces);
        }
        if first.is_some() {
            broken_joints.get_or_insert_with(Box::default)[offset] = first;
        }
    }
    work.stopwatch.lap(Phase::Joints);
}
