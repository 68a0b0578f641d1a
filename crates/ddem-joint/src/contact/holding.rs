//! Nonconforming joints in which all pairs hold: elastic springs without history.
//!
//! The points of such a joint never move to other nodes. Each pair keeps the slots of its nodes and its
//! vector at rest, so that a step reads no geometry.

use rayon::prelude::*;

use super::{BondedPatch, Configuration, ContactBlock, ContactPoint, Contacts, Patch};
use crate::point::{JointCheck, PairContext, elastic};
use ddem_mechanics::collide::weights;
use ddem_mechanics::math::lanes::{LANES, Lanes};
use ddem_mesh::{SurfacePoint, Vec3};

/// Patches per parallel task.
const TOGETHER: usize = 64;
/// Pairs that are checked for failure at once.
const AT_ONCE: usize = 16;
/// Stands for the other slots of a point that lies on a node.
const NO_SLOT: u32 = u32::MAX;

/// One side of a pair that never moves to other nodes.
#[derive(Clone, Copy, Debug, PartialEq)]
struct FixedPoint {
    /// Nodes: the index of the x component in a nodal field times [`LANES`], plus the lane.
    slots: [u32; 4],
    /// Coordinates in the element of the face.
    on: [f64; 2],
}

impl FixedPoint {
    /// Point with its coordinates in the element, and its position at rest `[m]`.
    fn new(contact_block: &ContactBlock, point: &SurfacePoint, on: [f64; 2]) -> (Self, Vec3) {
        let (nodes, weights) = (contact_block.nodes_around(point), weights(on));
        let slot = |node: usize| (contact_block.index(node) * LANES + contact_block.lane) as u32;
        let slots = match weights.iter().position(|weight| *weight == 1.0) {
            Some(k) => [slot(nodes[k]), NO_SLOT, NO_SLOT, NO_SLOT],
            None => nodes.map(slot),
        };
        let each = nodes.iter().zip(weights);
        let rest = each.map(|(&node, weight)| contact_block.rest_node(node) * weight).sum();
        (Self { slots, on }, rest)
    }

    /// Slots of its nodes and their weights.
    #[inline(always)]
    fn nodes(&self) -> impl Iterator<Item = (usize, usize, f64)> + use<> {
        let on_node = self.slots[1] == NO_SLOT;
        let (count, weights) = match on_node {
            true => (1, [1.0; 4]),
            false => (4, weights(self.on)),
        };
        let each = self.slots.into_iter().zip(weights).take(count);
        each.map(|(slot, weight)| (slot as usize / LANES, slot as usize % LANES, weight))
    }

    /// Value of a nodal field.
    #[inline(always)]
    fn value(&self, field: &[Lanes]) -> Vec3 {
        self.nodes().fold(Vec3::zeros(), |sum, (at, lane, weight)| {
            let node = &field[at..at + 3];
            sum + Vec3::new(node[0].0[lane], node[1].0[lane], node[2].0[lane]) * weight
        })
    }
}

/// A pair that never moves to other nodes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct FixedPair {
    points: [FixedPoint; 2],
    /// Vector from side a to side b at rest `[m]`.
    rest: Vec3,
}

impl FixedPair {
    /// Vector from side a to side b `[m]`.
    #[inline(always)]
    fn relative_position(&self, u: &[Lanes]) -> Vec3 {
        let [a, b] = &self.points;
        self.rest + (b.value(u) - a.value(u))
    }
}

impl Contacts {
    /// Fixes the joints of a restored state to the nodes of the model's.
    pub fn fix(&mut self, bonded_patches: &[BondedPatch]) {
        let of =
            |blocks: [u32; 2]| bonded_patches.binary_search_by_key(&blocks, |b| b.patch.blocks);
        for patch in self.patches.iter_mut().filter(|patch| patch.bond.is_some()) {
            patch.fixed =
                of(patch.blocks).ok().and_then(|at| bonded_patches[at].patch.fixed.clone());
        }
    }

    /// Updates the joints in which all pairs hold, and marks those that still do.
    pub fn update_holding(&mut self, configuration: &Configuration<'_>, context: PairContext<'_>) {
        let patches = self.patches.par_iter_mut().with_min_len(TOGETHER);
        patches.for_each(|patch| patch.holds = patch.update_holding(configuration, context));
    }
}

impl Patch {
    /// Fixes the points of a nonconforming joint to their nodes, given their coordinates in the elements
    /// of both sides.
    pub(super) fn fix(&mut self, configuration: &Configuration<'_>, on: &[[[f64; 2]; 2]]) {
        let blocks = self.blocks.map(|block| &configuration.blocks[block as usize]);
        let pair = |(point, on): (&ContactPoint, &[[f64; 2]; 2])| {
            let of = |side: usize| FixedPoint::new(blocks[side], &point.points[side], on[side]);
            let [(a, rest_a), (b, rest_b)] = [of(0), of(1)];
            FixedPair { points: [a, b], rest: rest_b - rest_a }
        };
        self.fixed = Some(self.points.iter().zip(on).map(pair).collect());
    }

    /// Vector between the sides of one of its pairs `[m]`.
    #[inline(always)]
    pub(super) fn relative_position(&self, configuration: &Configuration<'_>, pair: usize) -> Vec3 {
        match &self.fixed {
            Some(fixed) => fixed[pair].relative_position(configuration.u),
            None => configuration.relative_position(self.blocks, &self.points[pair].points),
        }
    }

    /// Updates the tractions of a joint if all its pairs hold. Returns true if they still do.
    fn update_holding(
        &mut self,
        configuration: &Configuration<'_>,
        context: PairContext<'_>,
    ) -> bool {
        let Some(bond) = self.bond else { return false };
        if self.pairs().any(|pair| pair.failure.is_some()) {
            return false;
        }
        let law = context.law(bond.law);
        let JointCheck { divisor, .. } = self.check(configuration, context);
        let check = law.zip(divisor);
        self.update_axes(configuration);
        let axes = self.frame();
        let stiffness = self.surface.stiffness;
        let Self { fixed: Some(fixed), points, .. } = self else { return false };
        let mut couple = Vec3::zeros();
        let mut failed = false;
        for (points, fixed) in points.chunks_mut(AT_ONCE).zip(fixed.chunks(AT_ONCE)) {
            let (mut normal, mut shear_squared) = ([0.0; AT_ONCE], [0.0; AT_ONCE]);
            for (i, (point, fixed)) in points.iter_mut().zip(fixed).enumerate() {
                let relative_position = fixed.relative_position(configuration.u);
                let own = axes.tr_mul(&relative_position) - point.pair.origin;
                let traction = elastic(stiffness, own);
                (point.pair.state.traction, point.pair.state.gap) = (traction, own.x);
                couple += relative_position.cross(&Self::force_along(&axes, point));
                if let Some((_, divisor)) = check {
                    normal[i] = traction.normal / divisor;
                    shear_squared[i] = (traction.shear / divisor).norm_squared();
                }
            }
            if let Some((law, _)) = check {
                failed |= law.any_failure(&normal[..points.len()], &shear_squared[..points.len()]);
            }
        }
        self.couple = couple;
        !failed
    }

    /// Adds the forces of its pairs on one side to those of the block's pack, with whose index `first` in
    /// a nodal field `f` begins.
    pub(super) fn add_fixed(
        &self,
        fixed: &[FixedPair],
        side: usize,
        first: usize,
        f: &mut [Lanes],
    ) {
        let (axes, sign) = (self.frame(), if side == 0 { 1.0 } else { -1.0 });
        for (point, fixed) in self.points.iter().zip(fixed) {
            let force = Self::force_along(&axes, point) * sign;
            for (at, lane, weight) in fixed.points[side].nodes() {
                let node = &mut f[at - first..at - first + 3];
                (0..3).for_each(|c| node[c].0[lane] += weight * force[c]);
            }
        }
    }
}
