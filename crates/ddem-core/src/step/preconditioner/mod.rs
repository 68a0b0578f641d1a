//! Fictitious masses of relaxation, coupled across the gaps (§7).
//!
//! The nodes that face each other across one, two or three gaps form a cluster of 2, 4 or 8 nodes.
//! Thin and therefore stiff elements hold it together. The mass of a cluster is its own submatrix
//! of the stiffness, one component at a time. It is scaled so that Δt = 1 is stable for the whole
//! model. The number of steps then does not depend on the joint thickness. A node inside a block is
//! a cluster of one.

mod bond_springs;
mod cells;
mod contact_masses;
mod coupling;
mod rigid;
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

use bond_springs::BondSprings;
use cells::{bond_bounds, is_part_of};
pub(crate) use contact_masses::ContactMasses;
use coupling::{across, inverse_row};
use rigid::RigidMasses;
use smooth::SmoothMotions;
use springs::{SpringSum, patches_of_bodies};
pub(crate) use turning::has_rotated;

/// Partner of a node across the directions of `part`, bits 1 = x, 2 = y, 4 = z.
#[derive(Clone, Copy, Debug)]
pub(super) struct Partner {
    /// Directions that are crossed.
    part: usize,
    /// Index of the partner's block in [`Preconditioner::beside`].
    beside: usize,
    /// Local node number in the partner's block.
    local: usize,
}

/// Rows of the inverse masses of a pack's nodes.
#[derive(Clone, Debug, Default)]
pub(super) struct InverseMassRows {
    /// First row of each node, shape `(nodes + 1)`.
    pub(super) start: Vec<u32>,
    /// Partners of each row; the first row of a node is its own.
    pub(super) partner: Vec<Partner>,
    /// Three components per row `[m/N]`.
    pub(super) rows: Vec<Lanes>,
    /// Weight of the rotation of each row's block in the mean rotation of its cluster.
    rotation_weights: Vec<Lanes>,
}

/// State of a running relaxation.
#[derive(Clone, Debug)]
pub(crate) struct Relaxation {
    pub(crate) progress: RelaxationProgress,
    pub(crate) preconditioner: Preconditioner,
}

/// Marker for a pack of rigid blocks.
const NO_CLASS: u32 = u32::MAX;
/// Number of packs whose masses are computed together.
const TOGETHER: usize = 1024;

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

/// Inverse masses of all packs; equal ones are stored once.
#[derive(Clone, Debug, Default)]
pub(crate) struct Preconditioner {
    pub(super) classes: Vec<InverseMassRows>,
    pub(super) of_pack: Vec<u32>,
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
    smooth: Option<SmoothMotions>,
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
        let mut known: HashMap<Vec<u64>, u32> = HashMap::new();
        let packs = &model.packs.packs;
        preconditioner.of_pack = vec![NO_CLASS; packs.len()];
        let deformable: Vec<usize> = (0..packs.len()).filter(|&pack| !packs[pack].rigid).collect();
        for packs in deformable.chunks(TOGETHER) {
            if stop() {
                return Err(RunError::Stopped);
            }
            // Equal masses are dropped after each group of packs, so that memory stays small.
            let made = packs.par_iter().map(|&pack| InverseMassRows::new(around, pack));
            for (mass, &pack) in made.collect::<Result<Vec<_>, _>>()?.into_iter().zip(packs) {
                preconditioner.of_pack[pack] = preconditioner.class(mass, &mut known);
            }
        }
        let patches = patches_of_bodies(model);
        (preconditioner.rigid, preconditioner.springs) = RigidMasses::new(around, &patches);
        preconditioner.bonds = BondSprings::new(model, &preconditioner.rigid, &patches);
        preconditioner.contact_masses = contact_masses;
        preconditioner.find_smooth_motions(model, held);
        if patches.is_empty() {
            // Contacts are added to the masses of cells alone.
            preconditioner.springs = Vec::new();
        }
        Ok(preconditioner)
    }

    /// Number of the class of some masses; `known` holds those so far.
    fn class(&mut self, mass: InverseMassRows, known: &mut HashMap<Vec<u64>, u32>) -> u32 {
        let parts = mass.partner.iter().map(|p| p.part as u64);
        let numbers = mass.rows.iter().flat_map(|row| row.0.map(f64::to_bits));
        let key = parts.chain(numbers).collect();
        let classes = &mut self.classes;
        *known.entry(key).or_insert_with(|| {
            classes.push(mass);
            classes.len() as u32 - 1
        })
    }

    /// True if the masses contain smooth motions of many blocks.
    pub(crate) fn is_smooth(&self) -> bool {
        self.smooth.is_some()
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
        for row in self.classes.iter_mut().flat_map(|class| &mut class.rows) {
            row.0.iter_mut().for_each(|x| *x *= factor);
        }
        self.rigid.scale(factor);
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
    // Conversion of corners with x fastest to VTK order.
    const VTK: [usize; 8] = [0, 1, 3, 2, 4, 5, 7, 6];
    let dense = element.modal.dense();
    std::array::from_fn(|a| {
        std::array::from_fn(|r| [0, 1, 2].map(|c| dense[(3 * VTK[a] + c, 3 * VTK[a ^ r] + c)]))
    })
}

impl InverseMassRows {
    fn new(around: MassContext<'_>, index: usize) -> Result<Self, RunError> {
        let model = around.model;
        let pack = &model.packs.packs[index];
        let n = model.packs.numbering_of(pack).divisions;
        let mut mass = Self { start: vec![0], ..Self::default() };
        let steps =
            (0..=n).flat_map(|k| (0..=n).flat_map(move |j| (0..=n).map(move |i| [i, j, k])));
        for at in steps {
            let mut rows = [[[0.0; 3]; 8]; LANES];
            for (row, &block) in rows.iter_mut().zip(&pack.blocks).take(pack.filled) {
                *row = inverse_row(around, block as usize, at)?;
            }
            let first = mass.partner.len();
            for part in 0..8 {
                let used = rows.iter().any(|row| row[part] != [0.0; 3]);
                if part != 0 && !used {
                    continue;
                }
                let crossed = (0..3).filter(|d| part >> d & 1 == 1);
                let beside = crossed.map(|d| POWERS[d] * if at[d] == n { 1 } else { 2 }).sum();
                let there = across(at, part, n);
                let local = there[0] + (n + 1) * (there[1] + (n + 1) * there[2]);
                mass.partner.push(Partner { part, beside, local });
                mass.rows.extend((0..3).map(|c| Lanes(rows.map(|row| row[part][c]))));
            }
            debug_assert!(first < mass.partner.len());
            mass.start.push(mass.partner.len() as u32);
        }
        mass.share_rotations();
        Ok(mass)
    }
}

/// Computes `M⁻¹ F` at the nodes of a pack. `f` holds the forces of all nodes, and `poses` those of
/// its blocks if they are rigid and have rotated. [`Preconditioner::respond`] comes before.
#[simd]
pub(super) fn accelerations<S: Simd>(
    simd: S,
    model: &Model,
    poses: Option<&[Pose; LANES]>,
    preconditioner: &Preconditioner,
    index: usize,
    f: &[Lanes],
    out: &mut [Lanes],
) {
    let packs = &model.packs;
    let pack = &packs.packs[index];
    if pack.rigid {
        rigid::accelerations(simd, model, poses, &preconditioner.rigid, index, out);
        return;
    }
    if preconditioner.frames.is_empty() {
        cluster_accelerations(simd, packs, preconditioner, index, f, out);
    } else {
        let frames = &preconditioner.frames;
        turning::accelerations(simd, model, frames, preconditioner, index, f, out);
    }
    if let Some(smooth) = &preconditioner.smooth {
        let class = &preconditioner.classes[preconditioner.of_pack[index] as usize];
        let n = packs.numbering_of(pack).divisions;
        smooth.add(simd, class, index, n, out);
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
    let class = &preconditioner.classes[preconditioner.of_pack[index] as usize];
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
