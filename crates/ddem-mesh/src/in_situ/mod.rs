//! In-situ stress of blocks and joints (§12).
//!
//! A stress `σ⁰(X)`, linear in the reference position, is part of the stress of an element,
//! `σ = R (σ⁰ + C:ε) Rᵀ`. Its nodal forces `∫ Bᵀσ⁰ dV` are exact for linear stress. They are
//! constant in the frame of the block and are therefore added to `K ũ` before the rotation. The
//! energy is that of the whole stress, `½ ∫ σ:C⁻¹:σ dV = ½ ũ·Kũ + ũ·∫Bᵀσ⁰ dV + ½ ∫ σ⁰:C⁻¹:σ⁰ dV`.

mod stress;

use std::collections::HashMap;

use fearless_simd::{Simd, f64x4};

use crate::NO_JOINT;
use crate::assembly::{Assembly, NO_TABLE};
use crate::joint_sections::JointSection;
use crate::pack::{Pack, Packs};
use crate::{Geometry, Vec3};
use ddem_mechanics::element::Elastic;
use ddem_mechanics::math::lanes::{Lanes, splat};

pub use stress::Stress;
pub use stress::{QuadIntegral, between, over_quads};

/// Nodal forces and energy of the in-situ stress in one lattice of elements of a pack.
#[derive(Debug)]
struct InitialForces {
    /// Nodal forces `∫ Bᵀσ⁰ dV` `[N]`.
    forces: Vec<Lanes>,
    /// Energy `½ ∫ σ⁰:C⁻¹:σ⁰ dV` `[J]`.
    energy: Lanes,
    /// Forces and energy of each element, for joints, whose elements can fail.
    elements: Vec<([[Lanes; 3]; 8], Lanes)>,
}

/// Marker for a lattice without in-situ stress.
const NO_FIELD: u32 = u32::MAX;

/// In-situ stress in all blocks and joints; equal lattices share their data.
#[derive(Debug)]
pub struct InSitu {
    blocks: Vec<Option<Stress>>,
    fields: Vec<InitialForces>,
    of_pack: Vec<[u32; 8]>,
}

/// Lattice of elements that carries an in-situ stress.
#[derive(Clone, Copy, Debug)]
pub struct InSituLattice<'a> {
    field: &'a InitialForces,
    dims: [usize; 3],
}

impl InSitu {
    /// In-situ stress of a model; `None` if no block has one.
    pub fn new(
        blocks: Vec<Option<Stress>>,
        geometry: &Geometry,
        packs: &Packs,
        assembly: &Assembly,
    ) -> Option<Self> {
        blocks.iter().find(|stress| stress.is_some())?;
        let mut in_situ = Self { blocks, fields: Vec::new(), of_pack: Vec::new() };
        let mut known = HashMap::new();
        for index in 0..packs.packs.len() {
            let of_pack = std::array::from_fn(|offset| {
                let Some(field) = in_situ.field(geometry, packs, assembly, index, offset) else {
                    return NO_FIELD;
                };
                let fields = &mut in_situ.fields;
                *known.entry(field.key()).or_insert_with(|| {
                    fields.push(field);
                    fields.len() as u32 - 1
                })
            });
            in_situ.of_pack.push(of_pack);
        }
        Some(in_situ)
    }

    /// In-situ stress of each block that has not been removed.
    pub fn without(self, geometry: &Geometry) -> Vec<Option<Stress>> {
        let of_block = |(block, stress): (usize, Option<Stress>)| {
            stress.filter(|_| !geometry.is_removed(block))
        };
        self.blocks.into_iter().enumerate().map(of_block).collect()
    }

    /// In-situ stress of a block, if it has one.
    pub fn of(&self, block: usize) -> Option<Stress> {
        self.blocks[block]
    }

    /// In-situ stress in the blocks (0) or a joint lattice of a pack.
    #[inline(always)]
    pub fn initial_stress(
        &self,
        packs: &Packs,
        pack: usize,
        offset: usize,
    ) -> Option<InSituLattice<'_>> {
        let field = self.fields.get(self.of_pack[pack][offset] as usize)?;
        Some(InSituLattice { field, dims: packs.numbering_of(&packs.packs[pack]).dims(offset) })
    }

    /// Memory in use `[bytes]`.
    pub fn bytes(&self) -> usize {
        let of = |field: &InitialForces| {
            field.forces.len() * size_of::<Lanes>() + size_of_val(&field.elements[..])
        };
        size_of_val(&self.blocks[..])
            + size_of_val(&self.of_pack[..])
            + self.fields.iter().map(of).sum::<usize>()
    }

    /// In-situ stress of a block, or of a joint lattice as the mean of the surrounding blocks.
    fn around(&self, geometry: &Geometry, block: usize, offset: usize) -> Option<Stress> {
        let parts = (0..8).filter(|part| part & !offset == 0);
        let step = |part: usize| [0, 1, 2].map(|d| i32::from(part & (1 << d) != 0));
        let blocks = parts.filter_map(|part| geometry.neighbour(block, step(part)));
        Stress::mean(&blocks.map(|block| self.blocks[block]).collect::<Vec<_>>())
    }

    fn field(
        &self,
        geometry: &Geometry,
        packs: &Packs,
        assembly: &Assembly,
        index: usize,
        offset: usize,
    ) -> Option<InitialForces> {
        let table = assembly.pack_tables[index][offset];
        let pack = &packs.packs[index];
        // Rigid blocks carry it in their joints, which are springs.
        if table == NO_TABLE || pack.rigid {
            return None;
        }
        let numbering = packs.numbering_of(pack);
        let dims = numbering.dims(offset);
        let nodes = if offset == 0 { numbering.nodes } else { numbering.joints[offset].len() };
        let mut field = InitialForces {
            forces: vec![Lanes::ZERO; 3 * nodes],
            energy: Lanes::ZERO,
            elements: vec![],
        };
        let mut any = false;
        if offset != 0 {
            field.elements.resize(dims.iter().product(), Default::default());
        }
        for lane in 0..pack.filled {
            let element = assembly.tables[table as usize].elements[lane];
            let block = pack.blocks[lane] as usize;
            let stress = self.around(geometry, block, offset).filter(|_| element.is_some());
            let (Some(stress), Some(element)) = (stress, element) else { continue };
            any = true;
            if geometry.part(block).is_some() {
                field.fill_part(geometry, block, lane, &stress, element_of(assembly, element));
                continue;
            }
            let element = &assembly.elements[element as usize];
            let nodes = positions(geometry, packs, pack, lane, offset);
            field.fill(lane, dims, &nodes, |centre| stress.element_forces(centre, element));
        }
        any.then_some(field)
    }

    /// Initial tractions of the pairs of a spring joint along the joint's axes `[Pa]`, from the
    /// mean stress of its two blocks.
    pub fn tractions(
        &self,
        geometry: &Geometry,
        packs: &Packs,
        index: usize,
        section: &JointSection,
        lane: usize,
    ) -> Vec<Vec3> {
        let d = section.direction();
        let pack = &packs.packs[index];
        let block = pack.blocks[lane] as usize;
        let node_pairs = &packs.numbering_of(pack).pairs[d];
        let mut tractions = vec![Vec3::zeros(); node_pairs.len()];
        let stress =
            self.around(geometry, block, 1 << d).filter(|_| section.joints[lane] != NO_JOINT);
        let Some(stress) = stress else { return tractions };
        let nodes = positions(geometry, packs, pack, lane, 1 << d);
        let dims = packs.numbering_of(pack).dims(1 << d);
        let mut corners = vec![Vec::with_capacity(4); dims.iter().product()];
        for node_pair in node_pairs {
            let middle = (nodes[node_pair.sides[0]] + nodes[node_pair.sides[1]]) * 0.5;
            node_pair.elements().for_each(|e| corners[e].push(middle));
        }
        let normal: Vec3 = section.axes.column(0).into();
        for (node_pair, traction) in node_pairs.iter().zip(&mut tractions) {
            let middle = (nodes[node_pair.sides[0]] + nodes[node_pair.sides[1]]) * 0.5;
            for e in node_pair.elements() {
                let centre = corners[e].iter().sum::<Vec3>() / 4.0;
                // ∫ N σ dA is a quarter of the element's area times σ at a third of the way from
                // its centre to the pair.
                let point = centre + (middle - centre) / 3.0;
                *traction +=
                    section.axes.tr_mul(&(stress.at(&point) * normal)) * node_pair.inverse_count();
            }
        }
        tractions
    }
}

fn element_of(assembly: &Assembly, element: u32) -> &Elastic {
    &assembly.elements[element as usize].elastic
}

/// Reference positions of the nodes of a lattice of elements in one lane, x fastest.
fn positions(
    geometry: &Geometry,
    packs: &Packs,
    pack: &Pack,
    lane: usize,
    offset: usize,
) -> Vec<Vec3> {
    let block = pack.blocks[lane] as usize;
    let numbering = packs.numbering_of(pack);
    let n = numbering.divisions + 1;
    let at = |block: usize, local: usize| {
        geometry.position(block, [local % n, local / n % n, local / (n * n)])
    };
    if offset == 0 {
        return (0..numbering.nodes).map(|local| at(block, local)).collect();
    }
    let nodes = numbering.joints[offset].iter();
    let block_of = |part: usize| {
        let step = [0, 1, 2].map(|d| i32::from(part & (1 << d) != 0));
        geometry.neighbour(block, step).unwrap_or(block)
    };
    nodes.map(|node| at(block_of(node.offset), node.local)).collect()
}

/// Number of a corner of element `[i, j, k]` among the nodes of a lattice.
#[inline(always)]
fn corner_node([nx, ny, _]: [usize; 3], [i, j, k]: [usize; 3], corner: usize) -> usize {
    let [x, y, z] = [i + (corner & 1), j + (corner >> 1 & 1), k + (corner >> 2)];
    x + (nx + 1) * (y + (ny + 1) * z)
}

/// Elements of a lattice, x fastest.
#[inline(always)]
fn cells([nx, ny, nz]: [usize; 3]) -> impl Iterator<Item = [usize; 3]> {
    (0..nz).flat_map(move |k| (0..ny).flat_map(move |j| (0..nx).map(move |i| [i, j, k])))
}

impl InitialForces {
    fn fill(
        &mut self,
        lane: usize,
        dims: [usize; 3],
        nodes: &[Vec3],
        element_forces: impl Fn(&Vec3) -> ([Vec3; 8], f64),
    ) {
        for (e, cell) in cells(dims).enumerate() {
            let corners: [usize; 8] = std::array::from_fn(|c| corner_node(dims, cell, c));
            let centre = corners.iter().map(|&node| nodes[node]).sum::<Vec3>() / 8.0;
            let (forces, energy) = element_forces(&centre);
            self.energy.0[lane] += energy;
            for (corner, (&node, force)) in corners.iter().zip(&forces).enumerate() {
                for c in 0..3 {
                    self.forces[3 * node + c].0[lane] += force[c];
                    if let Some((element, _)) = self.elements.get_mut(e) {
                        element[corner][c].0[lane] = force[c];
                    }
                }
            }
            if let Some((_, own)) = self.elements.get_mut(e) {
                own.0[lane] = energy;
            }
        }
    }

    /// Adds the forces and the energy in the elements of a part.
    fn fill_part(
        &mut self,
        geometry: &Geometry,
        block: usize,
        lane: usize,
        stress: &Stress,
        elastic: &Elastic,
    ) {
        let topology = geometry.topology(block);
        for element in 0..topology.elements() {
            let corners = geometry.element_corners(block, element);
            let (forces, energy) = stress.hexahedron_forces(&corners, elastic);
            self.energy.0[lane] += energy;
            for (node, force) in topology.hex(element).into_iter().zip(&forces) {
                (0..3).for_each(|c| self.forces[3 * node + c].0[lane] += force[c]);
            }
        }
    }

    /// Key for the comparison of lattices; equal lattices have equal keys.
    fn key(&self) -> Vec<u64> {
        let own = self
            .elements
            .iter()
            .flat_map(|(forces, energy)| forces.iter().flatten().chain(std::iter::once(energy)));
        let lanes = self.forces.iter().chain([&self.energy]).chain(own);
        let sizes = [self.forces.len() as u64, self.elements.len() as u64];
        sizes.into_iter().chain(lanes.flat_map(|lanes| lanes.0.map(f64::to_bits))).collect()
    }
}

impl InSituLattice<'_> {
    /// Adds the nodal forces of the remaining elements to `g`.
    #[inline(always)]
    pub fn add<S: Simd>(self, simd: S, alive: Option<&[Lanes]>, g: &mut [Lanes]) {
        let Some(alive) = alive else {
            for (g, force) in g.iter_mut().zip(&self.field.forces) {
                *g = Lanes::from(g.load(simd) + force.load(simd));
            }
            return;
        };
        for ((cell, alive), (forces, _)) in cells(self.dims).zip(alive).zip(&self.field.elements) {
            let alive = alive.load(simd);
            for (corner, force) in forces.iter().enumerate() {
                let node = corner_node(self.dims, cell, corner);
                for (g, force) in g[3 * node..3 * node + 3].iter_mut().zip(force) {
                    *g = Lanes::from(g.load(simd) + force.load(simd) * alive);
                }
            }
        }
    }

    /// Energy of the remaining elements in excess of `½ Σ u·g`, with `g` after [`add`](Self::add)
    /// `[J]`.
    #[inline(always)]
    pub fn energy<S: Simd>(self, simd: S, alive: Option<&[Lanes]>, u: &[Lanes]) -> f64x4<S> {
        let mut work = splat(simd, 0.0);
        let Some(alive) = alive else {
            for (u, force) in u.iter().zip(&self.field.forces) {
                work += u.load(simd) * force.load(simd);
            }
            return work * 0.5 + self.field.energy.load(simd);
        };
        let mut stored = splat(simd, 0.0);
        for ((cell, alive), (forces, own)) in cells(self.dims).zip(alive).zip(&self.field.elements)
        {
            let alive = alive.load(simd);
            stored += own.load(simd) * alive;
            for (corner, force) in forces.iter().enumerate() {
                let node = corner_node(self.dims, cell, corner);
                for (u, force) in u[3 * node..3 * node + 3].iter().zip(force) {
                    work += u.load(simd) * (force.load(simd) * alive);
                }
            }
        }
        work * 0.5 + stored
    }
}
