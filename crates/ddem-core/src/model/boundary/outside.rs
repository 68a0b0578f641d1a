//! The boundaries that are in force in one stage, sorted by pack.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use super::{Border, Borders, Column, Made, Moving, Push, Resistance};
use crate::model::conditions::{Active, Applied, Conditions, starts};
use ddem_mesh::slot::NodeSlot;
use ddem_mesh::{BlockFace, Vec3};

/// No fix.
const FREE: u32 = u32::MAX;

/// All dashpots of one node.
#[derive(Clone, Debug)]
pub(crate) struct Dashpot {
    /// Place of the x component in a nodal field.
    pub(crate) at: u32,
    pub(crate) lane: u8,
    node: u32,
    /// `[N s/m]`.
    pub(crate) resistance: Resistance,
    /// The fix that holds each axis, or [`FREE`].
    held: [u32; 3],
    /// What acts whatever moves: the answer of supports that were here before `[N]`.
    kept: Vec3,
}

impl Dashpot {
    /// The fix that holds an axis.
    pub(crate) fn held(&self, axis: usize) -> Option<usize> {
        (self.held[axis] != FREE).then_some(self.held[axis] as usize)
    }
}

/// A wave that comes in at a node: force at factor 1 `[N]`.
#[derive(Clone, Debug)]
struct Wave {
    dashpot: usize,
    border: usize,
    force: Vec3,
}

/// What stands under a column.
#[derive(Clone, Debug, Default)]
pub(super) struct Foot {
    /// Dashpots below it `[Pa s/m]`, x, y and z.
    pub(super) impedance: Vec3,
    /// Traction of waves at factor 1 `[Pa]`, by boundary.
    pub(super) waves: Vec<(usize, Vec3)>,
}

/// A column that stands in a stage.
#[derive(Clone, Debug)]
pub(crate) struct Standing {
    pub(crate) border: usize,
    pub(crate) column: usize,
    pub(super) foot: Foot,
    /// The fix that holds each axis of each of its nodes.
    pub(super) held: Vec<[Option<usize>; 3]>,
    /// Levels at and beside blocks that have been taken out.
    pub(super) dug: Vec<bool>,
}

/// What is in force in one stage.
#[derive(Clone, Debug, Default)]
pub(crate) struct Outside {
    pub(crate) dashpots: Vec<Dashpot>,
    start: Vec<u32>,
    waves: Vec<Wave>,
    pub(crate) standing: Vec<Standing>,
    /// Sides of the boundaries with columns: boundary, number there, dashpot.
    sides: Vec<[usize; 3]>,
    /// Dashpot of each node.
    by_node: BTreeMap<u32, usize>,
}

/// Nodes of a boundary that are held in all directions: those of blocks all of whose nodes on it are.
#[derive(Clone, Debug, Default)]
pub(crate) struct Clamped {
    pub(crate) nodes: usize,
    pub(crate) count: usize,
    pub(crate) first: Option<u32>,
    /// Which hold them.
    pub(crate) fixes: BTreeSet<usize>,
}

impl Outside {
    pub(crate) fn new(
        borders: &Borders,
        made: Made<'_>,
        conditions: &Conditions,
        stage: usize,
        active: &Active,
        kept: &Applied,
    ) -> Self {
        let here = || borders.list.iter().enumerate().filter(|(_, b)| b.period.has(stage));
        let mut sums: BTreeMap<u32, Resistance> = BTreeMap::new();
        // What has been taken out answers nothing.
        let there = |node: u32| !made.geometry.is_gone(made.geometry.block_of(node as usize));
        let dashpots = here().flat_map(|(_, border)| &border.dashpots);
        for (node, resistance) in dashpots.filter(|(node, _)| there(*node)) {
            *sums.entry(*node).or_insert_with(Resistance::zeros) += resistance;
        }
        let mut dashpots: Vec<(usize, Dashpot)> = Vec::with_capacity(sums.len());
        for (node, resistance) in sums {
            let slot = made.packs.node_slot(made.geometry, node as usize);
            let NodeSlot { pack, at, lane } = slot;
            let held = held(active, slot).map(|fix| fix.unwrap_or(FREE));
            let kept = kept.get(&node).copied().unwrap_or_default().into();
            dashpots.push((pack, Dashpot { at, lane, node, resistance, held, kept }));
        }
        dashpots.sort_by_key(|(pack, d)| (*pack, d.at, d.lane));
        let mut outside = Self {
            start: starts(made.packs.packs.len(), dashpots.iter().map(|d| d.0)),
            by_node: dashpots.iter().enumerate().map(|(i, (_, d))| (d.node, i)).collect(),
            dashpots: dashpots.into_iter().map(|d| d.1).collect(),
            ..Self::default()
        };
        for (index, border) in here() {
            let Some(wave) = border.wave else { continue };
            for (node, resistance) in &border.dashpots {
                let Some(&dashpot) = outside.by_node.get(node) else { continue };
                let force = 2.0 * (resistance * wave);
                outside.waves.push(Wave { dashpot, border: index, force });
            }
        }
        for (index, border) in here() {
            for (column, standing) in border.columns.iter().enumerate() {
                outside.standing.push(Standing {
                    border: index,
                    column,
                    foot: foot(borders, stage, standing),
                    held: standing.held(made, conditions, stage, active),
                    dug: standing.dug(made),
                });
            }
            let sides = if border.columns.is_empty() { &[][..] } else { &border.sides };
            for (number, side) in sides.iter().enumerate() {
                let dashpot = outside.by_node.get(&side.node);
                outside.sides.extend(dashpot.map(|&dashpot| [index, number, dashpot]));
            }
        }
        outside
    }

    /// Places of the dashpots of a pack.
    pub(crate) fn of(&self, pack: usize) -> Range<usize> {
        self.first(pack)..self.first(pack + 1)
    }

    /// Place of the first dashpot of a pack; one past the last pack is allowed.
    pub(crate) fn first(&self, pack: usize) -> usize {
        self.start.get(pack).map_or(0, |&start| start as usize)
    }

    /// What acts on the nodes where nothing moves.
    pub(crate) fn kept(&self) -> impl Iterator<Item = Push> {
        let kept = |dashpot: &Dashpot| Push { force: dashpot.kept, wave: Vec3::zeros() };
        self.dashpots.iter().map(kept)
    }

    /// The same in motion, with the factors of waves and columns as they move.
    pub(crate) fn push(
        &self,
        borders: &Borders,
        factors: &[f64],
        columns: &Moving,
        pushes: &mut Vec<Push>,
    ) {
        pushes.clear();
        pushes.extend(self.kept());
        for wave in &self.waves {
            pushes[wave.dashpot].wave += wave.force * factors[wave.border];
        }
        for &[border, side, dashpot] in &self.sides {
            let push = columns.push(&borders.list[border].sides[side]);
            let sum = &mut pushes[dashpot];
            sum.force += push.force;
            sum.wave += push.wave;
        }
    }

    pub(crate) fn clamped(&self, made: Made<'_>, border: &Border) -> Clamped {
        let mut blocks: BTreeMap<usize, BTreeSet<u32>> = BTreeMap::new();
        let there = |node: &u32| self.by_node.contains_key(node);
        for (node, _) in border.dashpots.iter().filter(|(node, _)| there(node)) {
            let block = made.geometry.block_of(*node as usize);
            blocks.entry(block).or_default().insert(*node);
        }
        let fixes = |node: &u32| {
            let dashpot = &self.dashpots[self.by_node[node]];
            let [x, y, z] = [0, 1, 2].map(|axis| dashpot.held(axis));
            Some([x?, y?, z?])
        };
        let mut clamped = Clamped::default();
        for nodes in blocks.values() {
            clamped.nodes += nodes.len();
            let held: Option<Vec<[usize; 3]>> = nodes.iter().map(fixes).collect();
            if let Some(held) = held {
                clamped.count += nodes.len();
                clamped.first = clamped.first.or(nodes.first().copied());
                clamped.fixes.extend(held.into_iter().flatten());
            }
        }
        clamped
    }

    /// The axis along which all nodes of a boundary are held that looks along it, and a fix that does so.
    pub(crate) fn held_across(&self, made: Made<'_>, border: &Border) -> Option<(usize, usize)> {
        let along = |(surface, _): &(BlockFace, [f64; 2])| {
            let normal = surface.outward(made.geometry);
            (0..3).find(|&axis| normal[axis].abs() > 1.0 - 1e-9)
        };
        let axis = border.faces.first().and_then(along)?;
        let nodes = border.dashpots.iter().filter_map(|(node, _)| self.by_node.get(node));
        let fixes: Option<Vec<usize>> = nodes.map(|&at| self.dashpots[at].held(axis)).collect();
        let straight = border.faces.iter().all(|face| along(face) == Some(axis));
        let first = fixes?.first().copied()?;
        straight.then_some((axis, first))
    }

    /// A column of a boundary that stands on nothing.
    pub(crate) fn floating<'a>(&self, index: usize, border: &'a Border) -> Option<&'a Column> {
        let floats = |standing: &&Standing| {
            let foot = &standing.foot;
            standing.border == index
                && foot.impedance == Vec3::zeros()
                && standing.held[0].iter().all(Option::is_none)
        };
        self.standing.iter().find(floats).map(|standing| &border.columns[standing.column])
    }
}

/// The fixes that hold the axes of a node.
pub(super) fn held(active: &Active, slot: NodeSlot) -> [Option<u32>; 3] {
    [0, 1, 2].map(|axis| Some(active.supports[active.support_at(slot, axis)?].fix))
}

/// Dashpots and waves below a column: those of the faces below its lowest node, which look down.
fn foot(borders: &Borders, stage: usize, column: &Column) -> Foot {
    let mut foot = Foot::default();
    for (index, border) in borders.list.iter().enumerate() {
        if border.period.has(stage) && border.under.contains(&column.nodes[0]) {
            foot.impedance = column.impedance;
            if let Some(wave) = border.wave {
                let traction = 2.0 * column.impedance.component_mul(&wave);
                foot.waves.push((index, traction));
            }
        }
    }
    foot
}
