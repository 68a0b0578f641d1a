//! Pairs of points fixed to their nodes or to their rigid bodies.
//!
//! The points of a patch keep their places until the patch is remade. Each pair has the slots of its
//! nodes, or its arms on rigid bodies, and its vector at rest, so that a step reads no geometry.

use super::{Configuration, ContactBlock, ContactPoint, Patch};
use ddem_mechanics::collide::weights;
use ddem_mechanics::math::lanes::{LANES, Lanes};
use ddem_mechanics::rigid::{LinearField, SpatialVector, minus_identity};
use ddem_mesh::{SurfacePoint, Vec3};

/// Stands for the other slots of a point that lies on a node.
const NO_SLOT: u32 = u32::MAX;

/// One side of a pair.
#[derive(Clone, Copy, Debug, PartialEq)]
enum FixedPoint {
    /// Point of an element of a deformable block.
    Element {
        /// Nodes: the index of the x component in a nodal field times [`LANES`], plus the lane.
        slots: [u32; 4],
        /// Coordinates in the element.
        on: [f64; 2],
    },
    /// Point of a rigid body: the vector from the first node of the patch's block at rest `[m]`.
    Rigid(Vec3),
}

impl FixedPoint {
    /// Point of a patch whose body on this side begins with block `first`, given its coordinates in the
    /// element. Also returns the vector to it from the first node of that block at rest `[m]`.
    fn new(
        blocks: &[ContactBlock],
        first: u32,
        point: &SurfacePoint,
        on: [f64; 2],
    ) -> (Self, Vec3) {
        let contact_block = &blocks[point.block(first)];
        let (nodes, weights) = (contact_block.nodes_around(point), weights(on));
        let each = nodes.iter().zip(weights);
        // Relative to a node, so that weights of positions far from the origin lose no digits.
        let own: Vec3 = each.map(|(&node, weight)| contact_block.rest_arm(node) * weight).sum();
        let arm = contact_block.rest_node(0) - blocks[first as usize].rest_node(0) + own;
        if contact_block.rigid {
            return (Self::Rigid(arm), arm);
        }
        let slot = |node: usize| (contact_block.index(node) * LANES + contact_block.lane) as u32;
        let slots = match weights.iter().position(|weight| *weight == 1.0) {
            Some(k) => [slot(nodes[k]), NO_SLOT, NO_SLOT, NO_SLOT],
            None => nodes.map(slot),
        };
        (Self::Element { slots, on }, arm)
    }

    /// Displacement `[m]`, given the displacements of all nodes and the motion of its rigid body.
    #[inline(always)]
    fn displacement(&self, u: &[Lanes], motion: &LinearField) -> Vec3 {
        let of = |at: usize, lane: usize| {
            let node = &u[at..at + 3];
            Vec3::new(node[0].0[lane], node[1].0[lane], node[2].0[lane])
        };
        match self {
            // Most points lie on a node.
            Self::Element { slots: [slot, NO_SLOT, ..], .. } => {
                of(*slot as usize / LANES, *slot as usize % LANES)
            }
            Self::Element { slots, on } => nodes(slots, on)
                .fold(Vec3::zeros(), |sum, (at, lane, weight)| sum + of(at, lane) * weight),
            Self::Rigid(arm) => motion.at(arm),
        }
    }

    /// Adds a force on it to the wrench on its rigid body.
    #[inline(always)]
    fn add_to(&self, motion: &LinearField, force: Vec3, wrench: &mut SpatialVector) {
        if let Self::Rigid(arm) = self {
            wrench.linear += force;
            wrench.angular += (arm + motion.gradient * arm).cross(&force);
        }
    }
}

/// Slots of nodes in a nodal field: index of the x component, lane and weight.
#[inline(always)]
fn nodes(slots: &[u32; 4], on: &[f64; 2]) -> impl Iterator<Item = (usize, usize, f64)> + use<> {
    let (count, weights) = match slots[1] == NO_SLOT {
        true => (1, [1.0; 4]),
        false => (4, weights(*on)),
    };
    let each = (*slots).into_iter().zip(weights).take(count);
    each.map(|(slot, weight)| (slot as usize / LANES, slot as usize % LANES, weight))
}

/// Share of a node in a force.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct NodalShare {
    pub(super) weight: f64,
    /// Index of the x component of the node in a nodal field times [`LANES`], plus the lane.
    pub(super) slot: u32,
    /// Number of the force.
    pub(super) force: u32,
}

/// Forces of the points of a patch as they are computed, and their sums.
pub(super) struct PointForces<'a> {
    /// Forces on side a `[N]`, then the couples on both blocks `[N m]`; empty unless nodes collect them.
    each: &'a mut [Vec3],
    couple: Vec3,
    wrenches: [SpatialVector; 2],
}

impl<'a> PointForces<'a> {
    pub(super) fn new(each: &'a mut [Vec3]) -> Self {
        Self { each, couple: Vec3::zeros(), wrenches: Default::default() }
    }

    /// Adds the force on side a of the pair with a number, whose sides are `relative_position` apart.
    #[inline(always)]
    pub(super) fn add(
        &mut self,
        number: usize,
        pair: &FixedPair,
        motions: &[LinearField; 2],
        relative_position: &Vec3,
        force: Vec3,
    ) {
        self.couple += relative_position.cross(&force);
        pair.points[0].add_to(&motions[0], force, &mut self.wrenches[0]);
        pair.points[1].add_to(&motions[1], -force, &mut self.wrenches[1]);
        debug_assert!(self.each.is_empty() || number + 2 < self.each.len());
        if let Some(own) = self.each.get_mut(number) {
            *own = force;
        }
    }
}

/// A pair that keeps its place on both sides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct FixedPair {
    points: [FixedPoint; 2],
    /// Vector from side a to side b at rest `[m]`.
    rest: Vec3,
}

impl FixedPair {
    /// Pair of a patch of two bodies, given its coordinates in the elements of both sides.
    fn new(
        blocks: &[ContactBlock],
        bodies: [u32; 2],
        point: &ContactPoint,
        on: [[f64; 2]; 2],
    ) -> Self {
        let of = |side: usize| FixedPoint::new(blocks, bodies[side], &point.points[side], on[side]);
        let [(a, arm_a), (b, arm_b)] = [of(0), of(1)];
        let [from_a, from_b] = bodies.map(|body| blocks[body as usize].rest_node(0));
        Self { points: [a, b], rest: (from_b - from_a) + (arm_b - arm_a) }
    }

    /// Vector from side a to side b `[m]`.
    #[inline(always)]
    pub(super) fn relative_position(&self, u: &[Lanes], motions: &[LinearField; 2]) -> Vec3 {
        let [a, b] = &self.points;
        self.rest + (b.displacement(u, &motions[1]) - a.displacement(u, &motions[0]))
    }
}

impl Configuration<'_> {
    /// Displacement of a rigid body, as a field from the first node of its first block `[m]`.
    fn rigid_motion(&self, block: u32) -> LinearField {
        let contact_block = &self.blocks[block as usize];
        let Some(turn) = self.turn(contact_block) else { return LinearField::default() };
        let value = contact_block.value(self.u, [0; 3]);
        LinearField { value, gradient: minus_identity(&turn) }
    }
}

impl Patch {
    /// Fixes its points to their nodes or rigid bodies, given their coordinates in the elements of both
    /// sides.
    pub(super) fn fix_at(&mut self, blocks: &[ContactBlock], on: &[[[f64; 2]; 2]]) {
        let pair = |(point, on): (&ContactPoint, &[[f64; 2]; 2])| {
            FixedPair::new(blocks, self.blocks, point, *on)
        };
        debug_assert_eq!(self.points.len(), on.len());
        self.fixed = self.points.iter().zip(on).map(pair).collect();
    }

    /// Fixes the points of a contact.
    pub(super) fn fix(&mut self, blocks: &[ContactBlock]) {
        let on = |point: &ContactPoint| point.points.map(|point| point.on.map(f64::from));
        let on: Vec<_> = self.points.iter().map(on).collect();
        self.fix_at(blocks, &on);
    }

    /// Removes all points; a patch without points is dropped.
    pub fn clear(&mut self) {
        (self.points, self.fixed) = Default::default();
    }

    /// Displacements of its rigid bodies; zero for deformable ones.
    #[inline]
    pub(super) fn rigid_motions(&self, configuration: &Configuration<'_>) -> [LinearField; 2] {
        [0, 1].map(|side| match self.fixed.first().map(|pair| &pair.points[side]) {
            Some(FixedPoint::Rigid(_)) => configuration.rigid_motion(self.blocks[side]),
            _ => LinearField::default(),
        })
    }

    /// Vectors between the sides of its pairs `[m]`.
    pub(super) fn relative_positions(&self, configuration: &Configuration<'_>) -> Vec<Vec3> {
        let motions = self.rigid_motions(configuration);
        let of = |pair: &FixedPair| pair.relative_position(configuration.u, &motions);
        self.fixed.iter().map(of).collect()
    }

    /// True for a joint whose forces go to nodes of a deformable block on a side.
    pub(super) fn is_on_nodes(&self, side: usize) -> bool {
        let of = |pair: &FixedPair| matches!(pair.points[side], FixedPoint::Element { .. });
        self.bond.is_some() && self.fixed.first().is_some_and(of)
    }

    /// Shares of the nodes on a side in the forces of its points on side a, which are numbered from `first` on.
    pub(super) fn nodal_shares(
        &self,
        side: usize,
        first: u32,
    ) -> impl Iterator<Item = NodalShare> + '_ {
        let sign = if side == 0 { 1.0 } else { -1.0 };
        (first..).zip(&*self.fixed).flat_map(move |(force, pair)| {
            let nodes = match &pair.points[side] {
                FixedPoint::Element { slots, on } => Some(nodes(slots, on)),
                FixedPoint::Rigid(_) => None,
            };
            let share = move |(at, lane, weight): (usize, usize, f64)| NodalShare {
                weight: sign * weight,
                slot: (at * LANES + lane) as u32,
                force,
            };
            nodes.into_iter().flatten().map(share)
        })
    }

    /// Sets the sums over its points.
    #[inline]
    pub(super) fn set_forces(&mut self, forces: PointForces<'_>) {
        (self.couple, self.wrenches) = (forces.couple, forces.wrenches);
        if let Some(couples) = forces.each.last_chunk_mut() {
            *couples = self.couples();
        }
    }

    /// Couples on bodies a and b `[N m]`: that on the reference block.
    pub(super) fn couples(&self) -> [Vec3; 2] {
        [0, 1].map(|side| if self.reference == side { self.couple } else { Vec3::zeros() })
    }

    /// Adds the forces of its points on a block to those of its pack, `f`, and to the torque on the block.
    /// The block is of body a (side 0) or b (side 1).
    #[inline]
    pub(super) fn add_forces(
        &self,
        side: usize,
        block: usize,
        on: &ContactBlock,
        f: &mut [Lanes],
        torque: &mut [Lanes; 3],
    ) {
        let is_first = self.blocks[side] as usize == block;
        if on.rigid {
            if is_first {
                self.add_wrench(side, on.lane, f, torque);
            }
        } else if self.has_points_on(side, block) {
            self.add_nodal_forces(side, block, on, f);
        }
        if usize::from(self.reference) == side && is_first {
            (0..3).for_each(|c| torque[c].0[on.lane] += self.couple[c]);
        }
    }

    /// Adds the wrench on a rigid body: the force at the first node of its block, and its torque about
    /// that node.
    fn add_wrench(&self, side: usize, lane: usize, f: &mut [Lanes], torque: &mut [Lanes; 3]) {
        let SpatialVector { linear, angular } = self.wrenches[side];
        for c in 0..3 {
            f[c].0[lane] += linear[c];
            torque[c].0[lane] += angular[c];
        }
    }

    /// Adds the forces of the points on a deformable block.
    fn add_nodal_forces(&self, side: usize, block: usize, on: &ContactBlock, f: &mut [Lanes]) {
        let (axes, sign) = (self.frame(), if side == 0 { 1.0 } else { -1.0 });
        let (first, start) = (self.blocks[side], on.pack_start());
        for (point, fixed) in self.points.iter().zip(&*self.fixed) {
            let is_own = point.points[side].block(first) == block;
            let FixedPoint::Element { slots, on } = &fixed.points[side] else { continue };
            if !is_own || !self.may_carry_force(point) {
                continue;
            }
            let force = Self::force_along(&axes, point) * sign;
            for (at, lane, weight) in nodes(slots, on) {
                let node = &mut f[at - start..at - start + 3];
                (0..3).for_each(|c| node[c].0[lane] += weight * force[c]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::joint_forces::{JointForces, PatchRun};
    use super::super::{Bond, JointStatus};
    use super::*;

    /// The couple of a joint goes to its reference block, also once that has changed.
    #[test]
    fn couples_follow_the_reference_block() {
        let on =
            |slot| FixedPoint::Element { slots: [slot, NO_SLOT, NO_SLOT, NO_SLOT], on: [0.0; 2] };
        let pair = FixedPair { points: [on(0), on(1)], rest: Vec3::zeros() };
        let mut patches = [Patch {
            blocks: [0, 1],
            bond: Some(Bond { joint: 0, law: 0, status: JointStatus::InPlace }),
            points: [ContactPoint::default()].into(),
            fixed: [pair].into(),
            ..Patch::default()
        }];
        let mut joint_forces = JointForces::default();
        joint_forces.renew(&patches, 2);
        for reference in [0, 1] {
            let runs = joint_forces.runs(&mut patches, 1);
            for (patch, forces) in runs.into_iter().flat_map(PatchRun::each) {
                patch.reference = reference;
                let mut sums = PointForces::new(forces);
                sums.add(0, &pair, &Default::default(), &Vec3::z(), 2.0 * Vec3::x());
                patch.set_forces(sums);
            }
            for (block, force) in [2.0, -2.0].into_iter().enumerate() {
                let (mut f, mut torque) = ([Lanes::ZERO; 3], [Lanes::ZERO; 3]);
                joint_forces.add_to(block, [0, block], &mut f, &mut torque);
                assert_eq!(f[0].0[block], force);
                let couple = if block == usize::from(reference) { 2.0 } else { 0.0 };
                assert_eq!(torque.map(|component| component.0[block]), [0.0, couple, 0.0]);
            }
        }
    }
}
