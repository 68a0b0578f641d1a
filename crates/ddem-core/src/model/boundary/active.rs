//! Boundaries in force in one stage, sorted by pack.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use super::{
    Boundaries, BoundaryForce, Column, ColumnMotion, ModelBoundary, Resistance, StageGeometry,
};
use crate::model::conditions::{ActiveConditions, AppliedForces, Conditions, starts};
use ddem_mesh::slot::NodeSlot;
use ddem_mesh::{BlockFace, Vec3};

/// Mark of an axis that no fix holds.
const FREE: u32 = u32::MAX;

/// Sum of the dashpots of one node, and of the nodes tied to it.
#[derive(Clone, Debug)]
pub(crate) struct Dashpot {
    /// Place of the x component in a nodal field.
    pub(crate) at: u32,
    pub(crate) lane: u8,
    node: u32,
    /// Damping matrix `[N s/m]`.
    pub(crate) resistance: Resistance,
    /// Part of the force in the sums over the tied nodes; 1 without ties.
    pub(crate) share: f64,
    /// Number of the fix that holds each axis, or [`FREE`].
    held: [u32; 3],
    /// Constant force that replaces the last reaction of an ended support `[N]`.
    locked_reactions: Vec3,
}

impl Dashpot {
    /// Number of the fix that holds an axis.
    pub(crate) fn held(&self, axis: usize) -> Option<usize> {
        (self.held[axis] != FREE).then_some(self.held[axis] as usize)
    }
}

/// Incoming wave at a node: force at factor 1 `[N]`.
#[derive(Clone, Debug)]
struct NodeWave {
    dashpot: usize,
    boundary: usize,
    force: Vec3,
}

/// Base of a column.
#[derive(Clone, Debug, Default)]
pub(super) struct ColumnBase {
    /// Dashpots below the column `[Pa s/m]`, x, y and z.
    pub(super) impedance: Vec3,
    /// Traction of waves at factor 1 `[Pa]`, by boundary.
    pub(super) waves: Vec<(usize, Vec3)>,
}

/// A column in force in a stage.
#[derive(Clone, Debug)]
pub(crate) struct ActiveColumn {
    pub(crate) boundary: usize,
    pub(crate) column: usize,
    pub(super) base: ColumnBase,
    /// Number of the fix that holds each axis of each of its nodes.
    pub(super) held: Vec<[Option<usize>; 3]>,
    /// True for levels at removed blocks and at their neighbours.
    pub(super) excavated: Vec<bool>,
}

/// Boundaries in force in one stage.
#[derive(Clone, Debug, Default)]
pub(crate) struct ActiveBoundaries {
    pub(crate) dashpots: Vec<Dashpot>,
    start: Vec<u32>,
    waves: Vec<NodeWave>,
    pub(crate) columns: Vec<ActiveColumn>,
    /// Side nodes of boundaries with columns: boundary, number of the side node there, dashpot.
    sides: Vec<[usize; 3]>,
    /// Dashpot of each node.
    by_node: BTreeMap<u32, usize>,
}

/// Nodes of a boundary that are held in all directions. A block counts if all its nodes on the
/// boundary are held.
#[derive(Clone, Debug, Default)]
pub(crate) struct HeldNodes {
    pub(crate) nodes: usize,
    pub(crate) count: usize,
    pub(crate) first: Option<u32>,
    /// Fixes that hold them.
    pub(crate) fixes: BTreeSet<usize>,
}

impl ActiveBoundaries {
    pub(crate) fn new(
        boundaries: &Boundaries,
        geometries: StageGeometry<'_>,
        conditions: &Conditions,
        stage: usize,
        active: &ActiveConditions,
        locked_reactions: &AppliedForces,
    ) -> Self {
        let here = || boundaries.list.iter().enumerate().filter(|(_, b)| b.in_force.has(stage));
        let resistances = here().flat_map(|(_, boundary)| &boundary.dashpots);
        let mut dashpots = dashpots(geometries, resistances, active, locked_reactions);
        dashpots.sort_by_key(|(pack, d)| (*pack, d.at, d.lane));
        let mut in_force = Self {
            start: starts(geometries.packs.packs.len(), dashpots.iter().map(|d| d.0)),
            by_node: dashpots.iter().enumerate().map(|(i, (_, d))| (d.node, i)).collect(),
            dashpots: dashpots.into_iter().map(|d| d.1).collect(),
            ..Self::default()
        };
        for (index, boundary) in here() {
            let Some(wave) = boundary.wave else { continue };
            let own = boundary.dashpots.iter().filter(|(_, r)| *r != Resistance::zeros());
            for (node, resistance) in own {
                for copy in geometries.copies(*node) {
                    let Some(&dashpot) = in_force.by_node.get(&copy) else { continue };
                    let force = 2.0 * in_force.dashpots[dashpot].share * (resistance * wave);
                    in_force.waves.push(NodeWave { dashpot, boundary: index, force });
                }
            }
        }
        for (index, boundary) in here() {
            for (number, column) in boundary.columns.iter().enumerate() {
                in_force.columns.push(ActiveColumn {
                    boundary: index,
                    column: number,
                    base: base(boundaries, stage, column),
                    held: column.held(geometries, conditions, stage, active),
                    excavated: column.excavated(geometries),
                });
            }
            let sides = if boundary.columns.is_empty() { &[][..] } else { &boundary.sides };
            for (number, side) in sides.iter().enumerate() {
                let dashpot = in_force.by_node.get(&side.node);
                in_force.sides.extend(dashpot.map(|&dashpot| [index, number, dashpot]));
            }
        }
        in_force
    }

    /// Index range of the dashpots of a pack.
    pub(crate) fn of(&self, pack: usize) -> Range<usize> {
        self.first(pack)..self.first(pack + 1)
    }

    /// Index of the first dashpot of a pack; `pack` may be one past the last.
    pub(crate) fn first(&self, pack: usize) -> usize {
        self.start.get(pack).map_or(0, |&start| start as usize)
    }

    /// Boundary forces at rest: the locked reactions.
    pub(crate) fn locked_reactions(&self) -> impl Iterator<Item = BoundaryForce> {
        let force = |dashpot: &Dashpot| BoundaryForce {
            force: dashpot.locked_reactions,
            wave: Vec3::zeros(),
        };
        self.dashpots.iter().map(force)
    }

    /// Writes the boundary forces in motion, from the factors of the waves and the motion of the
    /// columns.
    pub(crate) fn forces(
        &self,
        boundaries: &Boundaries,
        factors: &[f64],
        columns: &ColumnMotion,
        boundary_forces: &mut Vec<BoundaryForce>,
    ) {
        boundary_forces.clear();
        boundary_forces.extend(self.locked_reactions());
        for wave in &self.waves {
            boundary_forces[wave.dashpot].wave += wave.force * factors[wave.boundary];
        }
        for &[boundary, side, dashpot] in &self.sides {
            let force = columns.force_on(&boundaries.list[boundary].sides[side]);
            let sum = &mut boundary_forces[dashpot];
            sum.force += force.force;
            sum.wave += force.wave;
        }
    }

    pub(crate) fn held_nodes(
        &self,
        geometries: StageGeometry<'_>,
        boundary: &ModelBoundary,
    ) -> HeldNodes {
        let mut blocks: BTreeMap<usize, BTreeSet<u32>> = BTreeMap::new();
        let exists = |node: &u32| self.by_node.contains_key(node);
        for (node, _) in boundary.dashpots.iter().filter(|(node, _)| exists(node)) {
            let block = geometries.now.block_of(*node as usize);
            blocks.entry(block).or_default().insert(*node);
        }
        let fixes = |node: &u32| {
            let dashpot = &self.dashpots[self.by_node[node]];
            let [x, y, z] = [0, 1, 2].map(|axis| dashpot.held(axis));
            Some([x?, y?, z?])
        };
        let mut held_nodes = HeldNodes::default();
        for nodes in blocks.values() {
            held_nodes.nodes += nodes.len();
            let held: Option<Vec<[usize; 3]>> = nodes.iter().map(fixes).collect();
            if let Some(held) = held {
                held_nodes.count += nodes.len();
                held_nodes.first = held_nodes.first.or(nodes.first().copied());
                held_nodes.fixes.extend(held.into_iter().flatten());
            }
        }
        held_nodes
    }

    /// Axis normal to all faces of a boundary, if supports hold all its nodes along it, and one of
    /// these supports.
    pub(crate) fn held_across(
        &self,
        geometries: StageGeometry<'_>,
        boundary: &ModelBoundary,
    ) -> Option<(usize, usize)> {
        let along = |(surface, _): &(BlockFace, [f64; 2])| {
            let normal = surface.outward(geometries.now);
            (0..3).find(|&axis| normal[axis].abs() > 1.0 - 1e-9)
        };
        let axis = boundary.faces.first().and_then(along)?;
        let nodes = boundary.dashpots.iter().filter_map(|(node, _)| self.by_node.get(node));
        let fixes: Option<Vec<usize>> = nodes.map(|&at| self.dashpots[at].held(axis)).collect();
        let straight = boundary.faces.iter().all(|face| along(face) == Some(axis));
        let first = fixes?.first().copied()?;
        straight.then_some((axis, first))
    }

    /// A column of a boundary without dashpots and supports at its base.
    pub(crate) fn floating<'a>(
        &self,
        index: usize,
        boundary: &'a ModelBoundary,
    ) -> Option<&'a Column> {
        let floats = |columns: &&ActiveColumn| {
            let base = &columns.base;
            columns.boundary == index
                && base.impedance == Vec3::zeros()
                && columns.held[0].iter().all(Option::is_none)
        };
        self.columns.iter().find(floats).map(|columns| &boundary.columns[columns.column])
    }
}

impl StageGeometry<'_> {
    /// Existing nodes that are tied to a node, itself included, in increasing order.
    fn copies(&self, node: u32) -> Vec<u32> {
        let exists = |&&copy: &&u32| !self.now.is_removed(self.now.block_of(copy as usize));
        let tied = self.now.ties.with(node);
        // Without ties a node is its own copy.
        let all = if tied.is_empty() { std::slice::from_ref(&node) } else { tied };
        all.iter().filter(exists).copied().collect()
    }
}

/// Dashpots of the nodes that exist, with their packs.
fn dashpots<'a>(
    geometries: StageGeometry<'_>,
    resistances: impl Iterator<Item = &'a (u32, Resistance)>,
    active: &ActiveConditions,
    locked_reactions: &AppliedForces,
) -> Vec<(usize, Dashpot)> {
    let mut sums: BTreeMap<u32, Resistance> = BTreeMap::new();
    for (node, resistance) in resistances {
        *sums.entry(*node).or_insert_with(Resistance::zeros) += resistance;
    }
    let dashpot = |&node: &u32| {
        let copies = geometries.copies(node);
        if !copies.contains(&node) {
            return None;
        }
        let slot = geometries.packs.node_slot(geometries.now, node as usize);
        let NodeSlot { pack, at, lane } = slot;
        let dashpot = Dashpot {
            at,
            lane,
            node,
            resistance: copies.iter().filter_map(|copy| sums.get(copy)).sum(),
            share: 1.0 / copies.len() as f64,
            held: held(active, slot).map(|fix| fix.unwrap_or(FREE)),
            locked_reactions: locked_reactions.get(&node).copied().unwrap_or_default().into(),
        };
        Some((pack, dashpot))
    };
    sums.keys().filter_map(dashpot).collect()
}

/// Numbers of the fixes that hold the axes of a node.
pub(super) fn held(active: &ActiveConditions, slot: NodeSlot) -> [Option<u32>; 3] {
    [0, 1, 2].map(|axis| Some(active.supports[active.support_at(slot, axis)?].fix))
}

/// Dashpots and waves at the base of a column. They belong to boundaries on downward faces at its
/// lowest node.
fn base(boundaries: &Boundaries, stage: usize, column: &Column) -> ColumnBase {
    let mut base = ColumnBase::default();
    for (index, boundary) in boundaries.list.iter().enumerate() {
        if boundary.in_force.has(stage) && boundary.under.contains(&column.nodes[0]) {
            base.impedance = column.impedance;
            if let Some(wave) = boundary.wave {
                let traction = 2.0 * column.impedance.component_mul(&wave);
                base.waves.push((index, traction));
            }
        }
    }
    base
}
