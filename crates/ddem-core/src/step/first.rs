//! First pass: from displacements to forces, over bodies and joints.

use std::ops::Range;

use fearless_simd::{Simd, dispatch};
use fearless_simd_macros::simd;

use crate::force::body::body;
use crate::force::joint::{cell_energy, joint};
use crate::model::Model;
use crate::state::pass::{Input, Output, Viscous, Workspace};
use crate::step::scratch::{Forces, Scratch};
use ddem_joint::breaks::{Breaks, Broken};
use ddem_joint::contact::{Contacts, Ground, Placing, Surfaces, find, let_go};
use ddem_joint::kinematics::Moved;
use ddem_joint::losses::{Losses, Lost};
use ddem_joint::point::Look;
use ddem_mechanics::element::corotation::Frame;
use ddem_mechanics::math::exact::Exact;
use ddem_mechanics::math::lanes::{LANES, Lanes};
use ddem_mesh::assembly::NO_TABLE;
use ddem_mesh::pack::JointLattice;
use ddem_mesh::parallel::{node_start, share_start, spread};

/// What the first pass looks at.
#[derive(Clone, Copy)]
pub(crate) struct Pass<'a> {
    pub(crate) model: &'a Model,
    /// Displacements `[m]`.
    pub(crate) u: &'a [Lanes],
    /// Pairs fail whose traction, divided by this, is still beyond their strength; `None`: none.
    pub(crate) failing: Option<f64>,
    /// Whether joints that have turned let go.
    pub(crate) turning: bool,
    /// As in [`Look`].
    pub(crate) relaxing: bool,
    pub(crate) undamped: bool,
    /// Whether a step in which pairs fail is not taken: contacts stay as they are then.
    pub(crate) waits: bool,
    /// Present time `[s]`.
    pub(crate) time: f64,
    /// Velocities of the last half step and its time step, if there was one.
    pub(crate) last: Option<(&'a [Lanes], f64)>,
    /// Velocities and the time step that they are of, for the way of the last step.
    pub(crate) way: (&'a [Lanes], f64),
    /// Damping of the bodies, if any has it.
    pub(crate) viscous: Option<Viscous<'a>>,
    /// Bodies by pack and lane that have supports.
    pub(crate) held: &'a [[bool; LANES]],
    /// Without the rotations of the blocks, whatever the kinematics.
    pub(crate) linear: bool,
    pub(crate) energies: bool,
}

impl<'a> Pass<'a> {
    /// The linear model, in which nothing fails.
    pub(crate) fn linear(model: &'a Model, u: &'a [Lanes]) -> Self {
        Self {
            model,
            u,
            failing: None,
            turning: false,
            relaxing: false,
            undamped: false,
            waits: false,
            time: 0.0,
            last: None,
            way: (u, 0.0),
            viscous: None,
            held: &[],
            linear: true,
            energies: false,
        }
    }

    /// How pairs are looked at.
    fn look(&self) -> Look<'a> {
        let Self { model, failing, turning, relaxing, undamped, time, .. } = *self;
        let time_step = self.last.map(|_| self.way.1);
        Look { failing, turning, relaxing, undamped, time, time_step, laws: &model.laws }
    }
}

/// First pass: `f ← −K u` of the bodies, eq. (8), and of the joints, eq. (11) and §5, in each
/// block's frame. Pairs fail, springs slip.
pub(crate) fn forces(
    pass: Pass<'_>,
    breaks: &mut Breaks,
    contacts: Option<&mut Contacts>,
    scratch: &mut Scratch,
) -> Losses {
    let level = scratch.level;
    let model = pass.model;
    let mut contacts = contacts.zip(model.contact.as_ref());
    let released = match &mut contacts {
        Some((contacts, surfaces)) => {
            let (ground, placing) = meeting(pass, surfaces, &scratch.frames);
            let_go(ground, placing, breaks, contacts)
        }
        None => Losses::default(),
    };
    let (fields, frames, runs) = scratch.forces(breaks, pass.energies, pass.viscous.is_some());
    let input = input(pass, frames);
    spread(&model.packs, runs, fields, &|run, fields: Forces<'_>| {
        dispatch!(level, simd => run_forces(simd, input, &run, fields));
    });
    let mut losses = Lost::from_iter(&scratch.losses).total();
    if let Some((contacts, surfaces)) = contacts.as_ref().filter(|_| pass.waits) {
        let (ground, placing) = meeting(pass, surfaces, &scratch.frames);
        let failing = contacts.failing(&placing, ground.look);
        losses.failed = [0, 1].map(|mode| losses.failed[mode] + failing[mode]);
    }
    if losses.failed != [0; 2] {
        if pass.waits {
            // A step that is not taken leaves contacts as they are.
            return losses;
        }
        losses.fracture += remove_cells(pass, breaks, scratch);
    }
    if let Some((contacts, surfaces)) = contacts {
        // How far joints have moved: where no contacts are looked for they keep their pairs.
        if surfaces.search {
            contacts.look(model.places(), &model.laws, breaks);
        }
        let (ground, placing) = meeting(pass, surfaces, &scratch.frames);
        losses.add(&find(ground, placing, contacts));
        losses.add(&released);
    }
    losses
}

/// §9: where blocks may meet.
fn meeting<'a>(
    pass: Pass<'a>,
    surfaces: &'a Surfaces,
    frames: &'a [Frame],
) -> (Ground<'a>, Placing<'a>) {
    let look = pass.look();
    let ground = Ground { places: pass.model.places(), surfaces, held: pass.held, look };
    let small = !pass.model.corotational();
    let start = pass.last.is_none();
    let blocks = &surfaces.blocks;
    (ground, Placing { blocks, u: pass.u, frames, small, last: pass.way, start })
}

pub(crate) fn input<'a>(pass: Pass<'a>, frames: &'a [Frame]) -> Input<'a> {
    let Pass { model, u, last, viscous, held, linear, .. } = pass;
    let frames = (model.corotational() && !linear).then_some(frames);
    Input {
        moved: Moved { packs: &model.packs, u, frames },
        assembly: &model.assembly,
        seams: &model.seams,
        in_situ: model.in_situ.as_ref().filter(|_| !linear),
        look: pass.look(),
        last,
        viscous,
        held,
    }
}

/// Takes out the strips and corners around pairs that have just failed: from the next pass on.
/// Returns the energy that was in them `[J]`.
fn remove_cells(pass: Pass<'_>, breaks: &mut Breaks, scratch: &mut Scratch) -> f64 {
    let Model { packs, assembly, .. } = pass.model;
    let cells = breaks.touched(packs, assembly);
    let mut work = Workspace::default();
    let mut lost = Exact::default();
    for cells in cells.chunk_by(|a, b| a.lattice == b.lattice) {
        let at = cells[0].lattice;
        let input = input(pass, &scratch.frames);
        let mut energy = |breaks: &Breaks| {
            dispatch!(scratch.level, simd => {
                cell_energy(simd, input, at, breaks.get(at.pack, at.offset), &mut work)
            })
        };
        lost.add(energy(breaks));
        breaks.remove(packs, assembly, cells);
        lost.add(-energy(breaks));
    }
    lost.value()
}

/// `f ← −K u` of the bodies and joints, added up at the nodes, without loads or supports.
pub(crate) fn internal_forces(pass: Pass<'_>, breaks: &mut Breaks, scratch: &mut Scratch) {
    forces(pass, breaks, None, scratch);
    scratch.collect(pass.model, &[], pass.linear);
}

#[simd]
fn run_forces<S: Simd>(simd: S, input: Input<'_>, run: &Range<usize>, fields: Forces<'_>) {
    let packs = input.moved.packs;
    let (first_node, first_share) = (node_start(packs, run.start), share_start(packs, run.start));
    for pack in run.clone() {
        let nodes = node_start(packs, pack) - first_node..node_start(packs, pack + 1) - first_node;
        let shares =
            share_start(packs, pack) - first_share..share_start(packs, pack + 1) - first_share;
        let mut out = Output {
            viscous: fields.viscous.get_mut(nodes.clone()),
            f: &mut fields.f[nodes],
            shares: &mut fields.shares[shares],
            torque: &mut fields.torques[pack - run.start],
            energy: fields.energies.get_mut(pack - run.start).map(|energy| {
                *energy = [Lanes::ZERO; 2];
                energy
            }),
            losses: &mut fields.losses[pack - run.start],
        };
        out.shares.fill(Lanes::ZERO);
        *out.losses = Losses::default();
        let work = &mut fields.workspaces[0].elements;
        body(simd, input, pack, &mut out, work);
        let breaks = &mut fields.breaks[pack - run.start];
        let tables = input.assembly.pack_tables[pack];
        for offset in 1..8 {
            let mut broken = breaks.as_mut().and_then(|lattices| lattices[offset].take());
            if broken.as_ref().map_or(tables[offset] != NO_TABLE, Broken::acts) {
                joint(simd, input, JointLattice { pack, offset }, &mut broken, &mut out, work);
            }
            if broken.is_some() {
                breaks.get_or_insert_with(Box::default)[offset] = broken;
            }
        }
    }
}
