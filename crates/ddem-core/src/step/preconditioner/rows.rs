//! Inverse masses of nodes, row by row.

use std::collections::{BTreeSet, HashMap};

use fearless_simd::{Select, Simd, SimdBase};
use rayon::prelude::*;

use super::coupling::{across, inverse_row};
use super::{MassContext, POWERS};
use crate::error::RunError;
use crate::model::Model;
use ddem_mechanics::math::lanes::{LANES, Lanes, Vector, load_at, splat};

/// Marker for a pack of rigid blocks.
const NO_CLASS: u32 = u32::MAX;
/// Number of packs whose masses are computed together.
const TOGETHER: usize = 1024;

/// Partner of a node across the directions of `part`, bits 1 = x, 2 = y, 4 = z.
#[derive(Clone, Copy, Debug)]
pub(super) struct Partner {
    /// Directions that are crossed.
    pub(super) part: usize,
    /// Index of the partner's block in `Preconditioner::beside`.
    pub(super) beside: usize,
    /// Local node number in the partner's block.
    pub(super) local: usize,
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
    pub(super) rotation_weights: Vec<Lanes>,
}

/// Inverse masses of the nodes of all packs; equal ones are stored once.
#[derive(Clone, Debug, Default)]
pub(super) struct NodeMasses {
    classes: Vec<InverseMassRows>,
    of_pack: Vec<u32>,
    /// Number of classes that packs may share; each of the others belongs to one pack.
    shared: usize,
}

impl NodeMasses {
    pub(super) fn new(around: MassContext<'_>, stop: &dyn Fn() -> bool) -> Result<Self, RunError> {
        let mut known: HashMap<Vec<u64>, u32> = HashMap::new();
        let model = around.model;
        let packs = &model.packs.packs;
        let mut masses = Self { of_pack: vec![NO_CLASS; packs.len()], ..Self::default() };
        let deformable: Vec<usize> = (0..packs.len()).filter(|&pack| !packs[pack].rigid).collect();
        for packs in deformable.chunks(TOGETHER) {
            if stop() {
                return Err(RunError::Stopped);
            }
            // Equal masses are dropped after each group of packs, so that memory stays small.
            let made = packs.par_iter().map(|&pack| InverseMassRows::new(around, pack));
            for (mass, &pack) in made.collect::<Result<Vec<_>, _>>()?.into_iter().zip(packs) {
                let is_cell =
                    model.geometry.part(model.packs.packs[pack].blocks[0] as usize).is_some();
                masses.of_pack[pack] = masses.class(mass, is_cell, &mut known);
            }
        }
        masses.shared = masses.classes.len();
        Ok(masses)
    }

    /// Renews the masses of some packs of cells and multiplies them by a factor.
    pub(super) fn renew(
        &mut self,
        around: MassContext<'_>,
        packs: &[usize],
        factor: f64,
    ) -> Result<(), RunError> {
        let made = packs.par_iter().map(|&pack| InverseMassRows::new(around, pack));
        for (mut mass, &pack) in made.collect::<Result<Vec<_>, _>>()?.into_iter().zip(packs) {
            mass.scale(factor);
            match self.of_pack[pack] as usize {
                own if own >= self.shared => self.classes[own] = mass,
                _ => {
                    self.of_pack[pack] = self.classes.len() as u32;
                    self.classes.push(mass);
                }
            }
        }
        Ok(())
    }

    /// Number of the class of some masses; `known` holds those so far.
    fn class(
        &mut self,
        mass: InverseMassRows,
        is_cell: bool,
        known: &mut HashMap<Vec<u64>, u32>,
    ) -> u32 {
        let parts = mass.partner.iter().map(|p| p.part as u64);
        let numbers = mass.rows.iter().flat_map(|row| row.0.map(f64::to_bits));
        let key = std::iter::once(u64::from(is_cell)).chain(parts).chain(numbers).collect();
        let classes = &mut self.classes;
        *known.entry(key).or_insert_with(|| {
            classes.push(mass);
            classes.len() as u32 - 1
        })
    }

    /// Inverse masses of the nodes of a pack of deformable blocks.
    #[inline]
    pub(super) fn of(&self, pack: usize) -> &InverseMassRows {
        &self.classes[self.of_pack[pack] as usize]
    }

    /// Gives all free components of the nodes of cells the largest mass among them, which then suffices
    /// at any rotation of the stiffness. Nodes that supports hold along some axes hardly rotate.
    pub(super) fn equalize_cells(&mut self, model: &Model) {
        let packs = model.packs.packs.iter().zip(&self.of_pack);
        let of_cells = packs.filter(|(pack, class)| {
            **class != NO_CLASS && model.geometry.part(pack.blocks[0] as usize).is_some()
        });
        let classes: BTreeSet<u32> = of_cells.map(|(_, class)| *class).collect();
        for class in classes {
            for node in self.classes[class as usize].rows.as_chunks_mut::<3>().0 {
                for lane in 0..LANES {
                    let free = node.iter().map(|row| row.0[lane]).filter(|inverse| *inverse > 0.0);
                    let least = free.fold(f64::INFINITY, f64::min);
                    node.iter_mut().for_each(|row| row.0[lane] = row.0[lane].min(least));
                }
            }
        }
    }

    /// Multiplies all inverse masses by a factor.
    pub(super) fn scale(&mut self, factor: f64) {
        self.classes.iter_mut().for_each(|class| class.scale(factor));
    }
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

    fn scale(&mut self, factor: f64) {
        self.rows.iter_mut().flat_map(|row| &mut row.0).for_each(|x| *x *= factor);
    }

    /// Components of a vector along the free degrees of freedom of a node.
    #[inline(always)]
    pub(super) fn free<S: Simd>(&self, simd: S, node: usize, v: Vector<S>) -> Vector<S> {
        let [x, y, z] = load_at(simd, &self.rows, 3 * self.start[node] as usize);
        let none = splat(simd, 0.0);
        [
            x.simd_gt(none).select(v[0], none),
            y.simd_gt(none).select(v[1], none),
            z.simd_gt(none).select(v[2], none),
        ]
    }
}
