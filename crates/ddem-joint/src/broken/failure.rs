//! Failure of the pairs of one joint lattice, and the springs that then replace its elements.

use fearless_simd::Simd;
use nalgebra::Vector3;

use super::BrokenLattice;
use super::springs::at;
use crate::losses::Losses;
use crate::pair_kinematics::lane_axes;
use crate::point::{
    JointCheck, JointPoint, PairContext, PairFailure, components, elastic_traction, vector,
};
use ddem_mechanics::law::{FailureMode, JointLaw};
use ddem_mechanics::math::lanes::{
    LANES, Lanes, add, dot, load, load_at, scale, splat, sub, transposed_times, zero,
};
use ddem_mesh::NO_JOINT;
use ddem_mesh::joint_sections::{FaceLattice, JointSection};
use ddem_mesh::numbering::NodePair;

/// Check of the bonded pairs of a joint lattice for failure.
#[derive(Clone, Copy)]
pub struct LatticeCheck<'a> {
    /// Pairs and section of the lattice.
    pub face: FaceLattice<'a>,
    /// Context of the pairs.
    pub context: PairContext<'a>,
    /// Divisors of the tractions of each lane.
    pub divisors: Lanes,
    /// Forces `K u` of the elements on their nodes `[N]`, if there are elements.
    pub g: Option<&'a [Lanes]>,
    /// Displacements of the pairs, side b relative to side a, along the joint's axes `[m]`; empty if
    /// the lattice has no springs.
    pub relative: &'a [Lanes],
}

/// Tractions of the pairs of a joint lattice, pair by pair and lane by lane.
#[derive(Debug, Default)]
pub struct PairTractions {
    /// Normal tractions, tension positive `[Pa]`.
    normal: Vec<f64>,
    /// Squares of the shear tractions `[Pa²]`.
    shear_squared: Vec<f64>,
}

impl PairTractions {
    /// True if any bonded pair fails under the forces of elements and springs; all pairs are checked
    /// at once.
    #[inline(always)]
    pub fn any_failure<S: Simd>(
        &mut self,
        simd: S,
        check: LatticeCheck<'_>,
        broken: Option<&BrokenLattice>,
    ) -> bool {
        let LatticeCheck { face: FaceLattice { node_pairs, section }, context, divisors, .. } =
            check;
        if section.laws.iter().all(|&law| context.law(law).is_none()) {
            return false;
        }
        let n = LANES * node_pairs.len();
        let Self { normal: normals, shear_squared: shears } = self;
        normals.resize(n.max(normals.len()), 0.0);
        shears.resize(n.max(shears.len()), 0.0);
        let axes = lane_axes(simd, section);
        let direction = axes.map(|row| row[0]);
        let any_failed = broken.is_some_and(BrokenLattice::has_any_failed);
        let divisor = divisors.load(simd);
        let half = splat(simd, 0.5) / divisor;
        let per_quarter = section.per_quarter.load(simd);
        let stiffness = section.stiffnesses().map(|k| k.load(simd));
        let targets =
            normals.as_chunks_mut::<LANES>().0.iter_mut().zip(shears.as_chunks_mut::<LANES>().0);
        for (p, (node_pair, (normal, shear))) in node_pairs.iter().zip(targets).enumerate() {
            let [a, b] = node_pair.sides;
            let inverse_count = node_pair.inverse_count();
            let mut traction = zero(simd);
            if let Some(g) = check.g {
                let difference = sub(load_at(simd, g, 3 * b), load_at(simd, g, 3 * a));
                traction = scale(difference, per_quarter * half * inverse_count);
            }
            let Some(broken) = broken else {
                let along = dot(traction, direction);
                let across = sub(traction, scale(direction, along));
                *normal = Lanes::from(along).0;
                *shear = Lanes::from(dot(across, across)).0;
                continue;
            };
            let springs = &broken.points.springs[p];
            let own = sub(load_at(simd, check.relative, 3 * p), load(simd, &springs.origin));
            // Springs act on a part of the area of the pair. Failed pairs count as unloaded.
            let area = springs.area.load(simd) / divisor;
            let springs =
                scale(elastic_traction(stiffness, own), area * per_quarter * inverse_count);
            let traction = match check.g {
                Some(_) => add(transposed_times(&axes, traction), springs),
                None => springs,
            };
            let across = traction[1] * traction[1] + traction[2] * traction[2];
            (*normal, *shear) = (Lanes::from(traction[0]).0, Lanes::from(across).0);
            if any_failed {
                let modes = &broken.points.modes[p];
                for lane in (0..LANES).filter(|&lane| modes[lane].is_some()) {
                    (normal[lane], shear[lane]) = (0.0, 0.0);
                }
            }
        }
        self.exceed(section, context, n)
    }

    /// True if any of the first `n` tractions exceeds the strength of its joint.
    fn exceed(&self, section: &JointSection, context: PairContext<'_>, n: usize) -> bool {
        let (normals, shears) = (&self.normal[..n], &self.shear_squared[..n]);
        let law = |lane: usize| context.law(section.laws[lane]);
        // Most packs have one joint in all lanes. Then one law checks all pairs at once.
        let first = section.laws.iter().position(|&law| law != NO_JOINT).unwrap_or(0);
        if section.laws.iter().all(|law| [section.laws[first], NO_JOINT].contains(law)) {
            return law(first).is_some_and(|law| law.any_failure(normals, shears));
        }
        let fails =
            |law: &dyn JointLaw, at: usize| law.any_failure(&normals[at..=at], &shears[at..=at]);
        let points = |lane: usize| (lane..n).step_by(LANES);
        (0..LANES).any(|lane| law(lane).is_some_and(|law| points(lane).any(|at| fails(law, at))))
    }
}

impl BrokenLattice {
    /// Fails the overloaded bonded pairs under the forces of elements and springs. Removes the
    /// elements that hold a failed pair. Returns true if any pair failed.
    #[inline(always)]
    pub fn fail<S: Simd>(
        &mut self,
        simd: S,
        check: LatticeCheck<'_>,
        tractions: &mut PairTractions,
        losses: &mut Losses,
    ) -> bool {
        if !self.bonded {
            return false;
        }
        let overloaded = tractions.any_failure(simd, check, Some(self));
        let has_rotated: [bool; LANES] = std::array::from_fn(|lane| {
            check.context.releases_rotated_joints && self.has_rotated(check.face.section, lane)
        });
        if !overloaded && has_rotated == [false; LANES] {
            return false;
        }
        self.fail_each(check, has_rotated, losses)
    }

    /// Fails the overloaded bonded pairs one by one, and all bonded pairs of joints that have rotated.
    fn fail_each(
        &mut self,
        check: LatticeCheck<'_>,
        has_rotated: [bool; LANES],
        losses: &mut Losses,
    ) -> bool {
        let LatticeCheck { face, context, divisors, g, relative } = check;
        let FaceLattice { node_pairs, section } = face;
        let before = self.newly_failed.len();
        self.bonded = false;
        for (p, node_pair) in node_pairs.iter().enumerate() {
            for (lane, has_rotated) in has_rotated.into_iter().enumerate() {
                let mut point = self.points.get(p, lane);
                let law = context.law(section.laws[lane]);
                let Some(law) = law.filter(|_| point.failure.is_none()) else { continue };
                let area = section.quarter.0[lane] * node_pair.elements().len() as f64;
                let elements =
                    g.map_or_else(Vector3::zeros, |g| element_force(g, section, node_pair, lane));
                let force = elements + elastic_force(&point, section, lane, at(relative, p, lane));
                let check = JointCheck { divisor: Some(divisors.0[lane]), has_rotated };
                if !point.fail(law, check, components(force / area), context.time, losses) {
                    self.bonded = true;
                    continue;
                }
                self.points.set(p, lane, &point);
                self.set_failed(node_pairs, p, lane);
            }
        }
        self.newly_failed.len() > before
    }

    /// Marks a pair as failed and removes the elements that hold it.
    pub fn set_failed(&mut self, node_pairs: &[NodePair], p: usize, lane: usize) {
        self.newly_failed.push((p as u32, lane as u8));
        self.failed[lane] += 1;
        node_pairs[p].elements().for_each(|e| self.alive[e].0[lane] = 0.0);
    }

    /// Marks the bonded pairs of a lane as failed in shear. Returns their number.
    pub fn fail_bonded(&mut self, lane: usize, time: f64) -> u64 {
        let mut failed = 0;
        let failure = Some(PairFailure { mode: FailureMode::Shear, time });
        for pair in 0..self.points.len() {
            if self.points.modes[pair][lane].is_none() {
                self.points.change(pair, lane, |point| point.failure = failure);
                failed += 1;
            }
        }
        self.failed[lane] += failed;
        u64::from(failed)
    }

    /// Transfers the forces of removed elements to springs without a jump at any pair.
    pub fn transfer_to_springs(
        &mut self,
        FaceLattice { node_pairs, section }: FaceLattice<'_>,
        relative: &[Lanes],
        removal: ElementRemoval<'_>,
        losses: &mut Losses,
    ) {
        let ElementRemoval { local, du, forces } = removal;
        losses.fracture += lost(local, forces);
        let old: Vec<Lanes> = self.points.springs.iter().map(|springs| springs.area).collect();
        self.update_areas(node_pairs, section);
        for (p, (node_pair, old)) in node_pairs.iter().zip(old).enumerate() {
            for (lane, old) in old.0.into_iter().enumerate() {
                if self.points.springs[p].area.0[lane] == old {
                    continue;
                }
                let mut point = self.points.get(p, lane);
                let before = JointPoint { area: old, ..point };
                let displacement = at(relative, p, lane);
                let springs = elastic_force(&before, section, lane, displacement);
                let removed = forces.map(|g| element_force(g, section, node_pair, lane));
                let force = springs + removed[0] - removed[1];
                losses.fracture += energy(section, lane, springs, old);
                losses.fracture -= energy(section, lane, force, point.area);
                let k = section.stiffness(lane);
                let traction = components(force / point.area);
                let elastic = vector(traction.normal / k.normal, traction.shear / k.shear);
                point.origin = displacement - elastic;
                self.points.set(p, lane, &point);
                // The part of the forces that is equal at both nodes vanishes before it does its
                // half of the work over the last displacement increment.
                let [a, b] = node_pair.sides;
                let alike =
                    [a, b].map(|node| at(forces[0], node, lane) - at(forces[1], node, lane));
                let increments = at(du, a, lane) + at(du, b, lane);
                losses.fracture -= 0.25 * (alike[0] + alike[1]).dot(&increments);
            }
        }
    }

    /// Starts the law of the pairs that have just failed at their tractions.
    pub fn begin_failed(&mut self, section: &JointSection, relative: &[Lanes]) {
        for &(p, lane) in &self.newly_failed {
            let (p, lane) = (p as usize, usize::from(lane));
            self.points.change(p, lane, |point| {
                let force = elastic_force(point, section, lane, at(relative, p, lane));
                let traction = components(force / point.area);
                point.begin(traction, traction.normal / section.stiffness(lane).normal);
            });
        }
    }
}

/// Removal of elements of a joint lattice, in the joint's frame.
#[derive(Clone, Copy)]
pub struct ElementRemoval<'a> {
    /// Displacements of the nodes `[m]`.
    pub local: &'a [Lanes],
    /// Displacement increments of the nodes in the last step `[m]`.
    pub du: &'a [Lanes],
    /// Forces `K u` on the nodes before and after the removal `[N]`.
    pub forces: [&'a [Lanes]; 2],
}

/// Force of the springs of a bonded pair on side a, at a relative displacement, along the joint's
/// own axes `[N]`.
fn elastic_force(
    point: &JointPoint,
    section: &JointSection,
    lane: usize,
    relative_displacement: Vector3<f64>,
) -> Vector3<f64> {
    if point.area == 0.0 {
        return Vector3::zeros();
    }
    let elastic = point.elastic(section.stiffness(lane), relative_displacement);
    vector(elastic.normal, elastic.shear) * point.area
}

/// Energy of springs that carry a force over an area `[J]`.
fn energy(section: &JointSection, lane: usize, force: Vector3<f64>, area: f64) -> f64 {
    if area == 0.0 {
        return 0.0;
    }
    let force = components(force);
    let k = section.stiffness(lane);
    let both = force.normal * force.normal / k.normal + force.shear.norm_squared() / k.shear;
    0.5 * both / area
}

/// Energy that the elements of a lattice lose from one state to the other `[J]`.
fn lost(local: &[Lanes], [before, after]: [&[Lanes]; 2]) -> f64 {
    let mut sum = 0.0;
    for ((u, before), after) in local.iter().zip(before).zip(after) {
        sum += Lanes(std::array::from_fn(|l| 0.5 * u.0[l] * (before.0[l] - after.0[l]))).sum();
    }
    sum
}

/// Half the difference of the element forces at the two nodes (M1), along the joint's axes `[N]`.
fn element_force(
    g: &[Lanes],
    section: &JointSection,
    node_pair: &NodePair,
    lane: usize,
) -> Vector3<f64> {
    let [a, b] = node_pair.sides.map(|node| at(g, node, lane));
    section.axes.tr_mul(&(b - a)) * 0.5
}
