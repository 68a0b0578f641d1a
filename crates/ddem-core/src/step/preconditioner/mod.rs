//! Fictitious masses of relaxation, coupled across the gaps (§7).
//!
//! The nodes that face each other across one, two or three gaps form a cluster of 2, 4 or 8 nodes.
//! Thin and therefore stiff elements hold it together. The mass of a cluster is its own submatrix
//! of the stiffness, one component at a time. It is scaled so that Δt = 1 is stable for the whole
//! model. The number of steps then does not depend on the joint thickness. A node inside a block is
//! a cluster of one.

mod bond_points;
mod bond_springs;
mod cell_masses;
mod cell_motions;
mod cells;
mod contact_masses;
mod coupling;
mod rigid;
mod rows;
mod smooth;
mod springs;
mod turning;

use std::collections::HashMap;

use fearless_simd::{Select, Simd};
use fearless_simd_macros::simd;
use rayon::prelude::*;

use crate::error::RunError;
use crate::model::Model;
use crate::state::RelaxationProgress;
use ddem_joint::contact::ContactModel;
use ddem_mechanics::element::corotation::Frame;
use ddem_mechanics::math::lanes::{LANES, Lanes, Vector, load_at, splat, store_at, zero};
use ddem_mechanics::rigid::Pose;
use ddem_mesh::assembly::Element;
use ddem_mesh::pack::{Neighbours, Packs};

pub(crate) use bond_points::BondPoints;
use bond_springs::BondSprings;
use cell_motions::CellMotions;
use cells::{bond_bounds, is_part_of};
pub(crate) use contact_masses::ContactMasses;
use rigid::RigidMasses;
use rows::{InverseMassRows, NodeMasses, Partner};
use smooth::SmoothMotions;
use springs::{SpringSum, patches_of};
pub(crate) use turning::has_rotated;

/// State of a running relaxation.
#[derive(Clone, Debug)]
pub(crate) struct Relaxation {
    pub(crate) progress: RelaxationProgress,
    pub(crate) preconditioner: Preconditioner,
}

/// Corners with x fastest in VTK's order, and back.
const VTK: [usize; 8] = [0, 1, 3, 2, 4, 5, 7, 6];

/// Coupling `K[(a, c), (a ^ r, c)]` of one element, by corner a, partner bits r, component c.
type Coupling = [[[f64; 3]; 8]; 8];

/// Input for the masses of a node or block.
#[derive(Clone, Copy)]
struct MassContext<'a> {
    model: &'a Model,
    couplings: &'a [Coupling],
    /// Held degrees of freedom, by node.
    held: &'a HashMap<u32, [bool; 3]>,
    /// Upper bounds of the stiffness of the joints at each node of parts of cells `[N/m]`; empty
    /// without such joints.
    bonds: &'a [f64],
    /// Contact data, if blocks may meet.
    contact_model: Option<&'a ContactModel>,
    contact_masses: &'a ContactMasses,
}

/// Inverse masses of a model.
#[derive(Clone, Debug, Default)]
pub(crate) struct Preconditioner {
    nodes: NodeMasses,
    /// Masses of rigid bodies, and their motions; [`respond`](Self::respond) computes them.
    rigid: RigidMasses,
    /// Springs around each rigid body.
    springs: Vec<SpringSum>,
    /// Factor of the masses of rigid bodies.
    factor: f64,
    /// Joints between rigid cells.
    bonds: BondSprings,
    pub(crate) contact_masses: ContactMasses,
    /// Largest eigenvalue of `M⁻¹K` before the masses were scaled, without contacts.
    pub(crate) largest: f64,
    /// Blocks around those of each pack, by an index with one base-3 digit per direction (0: the
    /// same cell, 1: the one above, 2: the one below).
    beside: Vec<[Neighbours; 27]>,
    /// Frames of the packs, if masses rotate with them.
    pub(crate) frames: Vec<Frame>,
    /// Smooth motions of many blocks, unless blocks meet that are not joined.
    smooth: Vec<SmoothMotions>,
    /// Deformable cells as rigid bodies.
    cells: CellMotions,
}

impl Preconditioner {
    /// Inverse masses of a model. Held degrees of freedom have none.
    pub(crate) fn new(
        model: &Model,
        held: &HashMap<u32, [bool; 3]>,
        contact_masses: ContactMasses,
        stop: &dyn Fn() -> bool,
    ) -> Result<Self, RunError> {
        let couplings: Vec<Coupling> = model.assembly.elements.iter().map(coupling).collect();
        let contact_model = model.contact.as_ref().filter(|_| contact_masses.exist());
        let has_springs = |block: usize| {
            !model.geometry.is_rigid(block) || is_part_of(model, &contact_masses.cells, block)
        };
        let bonds = bond_bounds(model, &contact_masses, &has_springs);
        let around = MassContext {
            model,
            couplings: &couplings,
            held,
            bonds: &bonds,
            contact_model,
            contact_masses: &contact_masses,
        };
        let packs = 0..model.packs.packs.len();
        let beside = packs.into_par_iter().map(|pack| beside(model, pack)).collect();
        let mut preconditioner = Self { beside, factor: 1.0, ..Self::default() };
        preconditioner.nodes = NodeMasses::new(around, stop)?;
        let patches = patches_of(model, &model.assembly.bodies);
        (preconditioner.rigid, preconditioner.springs) = RigidMasses::new(around, &patches);
        preconditioner.bonds = BondSprings::new(model, &preconditioner.rigid, &patches);
        preconditioner.cells = CellMotions::new(around);
        preconditioner.contact_masses = contact_masses;
        preconditioner.find_smooth_motions(model, held);
        if patches.is_empty() && preconditioner.cells.is_empty() {
            // Contacts are added to the masses of cells alone.
            preconditioner.springs = Vec::new();
        }
        Ok(preconditioner)
    }

    /// True if the masses contain smooth motions of many blocks.
    pub(crate) fn is_smooth(&self) -> bool {
        !self.smooth.is_empty()
    }

    /// Sets displacements of rigid cells that favour no mode.
    pub(crate) fn start_bonds(&self, model: &Model, x: &mut [Lanes]) {
        self.bonds.start(model, &self.rigid, x);
    }

    /// Sets the forces `f` of the joints between rigid cells at the displacements `x`.
    pub(crate) fn set_bond_forces(&self, model: &Model, x: &[Lanes], f: &mut [Lanes]) {
        self.bonds.set_forces(model, x, f);
    }

    /// Scales the masses so that the largest eigenvalue is at most `limit`, given that without
    /// contacts. Contacts are at most as stiff as their part of the masses, and add to the other
    /// stiffness.
    pub(crate) fn scale_to(&mut self, limit: f64, largest: f64) {
        self.largest = largest;
        self.scale(limit / (largest + if self.contact_masses.exist() { 1.0 } else { 0.0 }));
    }

    /// Multiplies all inverse masses by a factor.
    fn scale(&mut self, factor: f64) {
        self.factor *= factor;
        self.nodes.scale(factor);
        self.rigid.scale(factor);
        self.cells.scale(factor);
        self.smooth.iter_mut().for_each(|smooth| smooth.scale(factor));
    }

    /// Forces on the partners of the nodes `node` of a pack `[N]`; zero in lanes without one.
    #[inline(always)]
    fn forces_on<S: Simd>(
        &self,
        simd: S,
        packs: &Packs,
        index: usize,
        node: usize,
        partner: &Partner,
        f: &[Lanes],
    ) -> Vector<S> {
        let Partner { part, beside, local } = *partner;
        if part == 0 {
            return load_at(simd, f, 3 * (packs.packs[index].start + node));
        }
        let blocks = &self.beside[index][beside];
        let at = |pack: usize| 3 * (packs.packs[pack].start + local);
        let Some(run) = blocks.in_order() else {
            let mut forces = [Lanes::ZERO; 3];
            for lane in 0..LANES {
                let Some((pack, there)) = blocks.at(lane) else { continue };
                for c in 0..3 {
                    forces[c].0[lane] = f[at(pack) + c].0[there];
                }
            }
            return load_at(simd, &forces, 0);
        };
        let [low, high] = run.packs().map(at);
        let mut forces = run.vectors(load_at(simd, f, low), load_at(simd, f, high));
        if run.present != [true; LANES] {
            let present = run.mask(simd);
            for force in &mut forces {
                *force = present.select(*force, splat(simd, 0.0));
            }
        }
        forces
    }
}

/// Indices of the cells above in [`Preconditioner::beside`], by direction.
const POWERS: [usize; 3] = [1, 3, 9];

/// Blocks around those of a pack, as in [`Preconditioner::beside`].
fn beside(model: &Model, pack: usize) -> [Neighbours; 27] {
    std::array::from_fn(|number| {
        let step = POWERS.map(|power| [0, 1, -1][number / power % 3]);
        model.packs.neighbours(&model.geometry, &model.packs.packs[pack], step)
    })
}

fn coupling(element: &Element) -> Coupling {
    let dense = element.modal.dense();
    std::array::from_fn(|a| {
        std::array::from_fn(|r| [0, 1, 2].map(|c| dense[(3 * VTK[a] + c, 3 * VTK[a ^ r] + c)]))
    })
}

/// Present positions of a pack; the default is at rest.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Present<'a> {
    /// Poses of its blocks if they are rigid and have rotated.
    pub(super) poses: Option<&'a [Pose; LANES]>,
    /// Displacements of its nodes, if its blocks may have rotated.
    pub(super) u: Option<&'a [Lanes]>,
}

/// Computes `M⁻¹ F` at the nodes of a pack. `f` holds the forces of all nodes.
/// [`Preconditioner::respond`] comes before.
#[simd]
pub(super) fn accelerations<S: Simd>(
    simd: S,
    model: &Model,
    at: Present<'_>,
    preconditioner: &Preconditioner,
    index: usize,
    f: &[Lanes],
    out: &mut [Lanes],
) {
    let packs = &model.packs;
    let pack = &packs.packs[index];
    if pack.rigid {
        rigid::accelerations(simd, model, at.poses, &preconditioner.rigid, index, out);
        return;
    }
    let is_cell = model.geometry.part(pack.blocks[0] as usize).is_some();
    if preconditioner.frames.is_empty() || is_cell {
        cluster_accelerations(simd, packs, preconditioner, index, f, out);
    } else {
        let frames = &preconditioner.frames;
        turning::accelerations(simd, model, frames, preconditioner, index, f, out);
    }
    let class = preconditioner.nodes.of(index);
    preconditioner.cells.add_to_nodes(simd, packs, class, index, at.u, out);
    for smooth in &preconditioner.smooth {
        smooth.add(simd, model, class, index, out);
    }
}

/// Computes `C⁻¹ F` at the nodes of a pack of deformable blocks, with the masses C of the clusters.
#[simd]
fn cluster_accelerations<S: Simd>(
    simd: S,
    packs: &Packs,
    preconditioner: &Preconditioner,
    index: usize,
    f: &[Lanes],
    out: &mut [Lanes],
) {
    let class = preconditioner.nodes.of(index);
    for node in 0..out.len() / 3 {
        let mut sum = zero(simd);
        for row in class.start[node] as usize..class.start[node + 1] as usize {
            let partner = &class.partner[row];
            let force = preconditioner.forces_on(simd, packs, index, node, partner, f);
            let inverse = load_at(simd, &class.rows, 3 * row);
            for c in 0..3 {
                sum[c] += inverse[c] * force[c];
            }
        }
        store_at(out, 3 * node, sum);
    }
}
