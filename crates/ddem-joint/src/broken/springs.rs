//! Springs of the pairs of one joint lattice, and their forces.

use fearless_simd::{Select, Simd, SimdBase, SimdMask, f64x4, mask64x4};
use nalgebra::{Matrix3, Vector3};

use super::failed_springs::FailedSprings;
use super::{BrokenLattice, LatticePoints};
use crate::losses::Losses;
use crate::point::{JointPoint, PairContext, components, elastic_traction, vector};
use ddem_mechanics::law::Traction;
use ddem_mechanics::math::lanes::{
    LANES, Lanes, Vector, add, cross, load, load_at, mask_of, scale, splat, store_at, sub, zero,
};
use ddem_mesh::joint_sections::JointSection;

/// Sums over the springs of a joint lattice, along the joint's axes.
#[derive(Clone, Copy, Debug, Default)]
pub struct SpringForces {
    /// Force on side a, from side b `[N]`.
    pub force: [Lanes; 3],
    /// `Σ δ × F` of the relative displacements `[N m]`.
    pub torque: [Lanes; 3],
    /// `Σ s × F` of the slips `[N m]`.
    pub couple: [Lanes; 3],
    /// Energy in the springs `[J]`.
    pub stored: Lanes,
    /// 1 where the springs rotate with the ground block, 0 where they rotate with both blocks.
    pub grounded: Lanes,
}

/// Motion of the pairs of a joint lattice, along the joint's axes.
#[derive(Clone, Copy)]
pub struct LatticeMotion<'a> {
    /// Displacements of sides b relative to sides a `[m]`.
    pub relative: &'a [Lanes],
    /// Increments of these displacements in the last step `[m]`; only if pairs have just failed.
    pub du: Option<&'a [Lanes]>,
    /// Ground block's frame for each lane whose springs rotate with it.
    pub grounds: &'a [Option<GroundFrame>; LANES],
}

/// Frame of the ground block with which the springs of a lane rotate, relative to the joint's mean
/// frame.
#[derive(Clone, Copy, Debug)]
pub struct GroundFrame {
    /// Rotation from vectors along the joint's axes to vectors along the springs' axes.
    rotation: Matrix3<f64>,
    /// Opening that the rotation of the gap causes, along the springs' axes `[m]`.
    shift: Vector3<f64>,
}

impl GroundFrame {
    /// Frame of a ground block whose rotation relative to the mean frame is `rotation`.
    pub fn new(rotation: &Matrix3<f64>, section: &JointSection, lane: usize) -> Self {
        let axes = rotation * section.axes;
        let gap = lane_of(section.gap(), lane);
        let shift = axes.tr_mul(&gap) - section.axes.tr_mul(&gap);
        Self { rotation: axes.tr_mul(&section.axes), shift }
    }
}

impl BrokenLattice {
    /// Sets the tractions of a lane's springs at zero displacement, along the joint's axes.
    pub fn preload(&mut self, section: &JointSection, lane: usize, tractions: &[Vector3<f64>]) {
        let k = section.stiffness(lane);
        for (springs, &traction) in self.points.springs.iter_mut().zip(tractions) {
            let traction = components(traction);
            let elastic = vector(traction.normal / k.normal, traction.shear / k.shear);
            (0..3).for_each(|c| springs.origin[c].0[lane] = -elastic[c]);
        }
    }

    /// Writes the forces of the springs on sides a, along the joint's axes, to `forces`, and returns
    /// their sums. The bonded pairs of all lanes are computed at once, and so are the failed ones.
    /// Pairs that have just failed, and those whose springs rotate with the ground, are computed one
    /// by one.
    #[inline(always)]
    pub fn spring_forces<S: Simd>(
        &mut self,
        simd: S,
        section: &JointSection,
        context: PairContext<'_>,
        motion: LatticeMotion<'_>,
        forces: &mut [Lanes],
        losses: &mut Losses,
    ) -> SpringForces {
        let grounds = motion.grounds;
        let grounded = Lanes(grounds.map(|ground| f64::from(u8::from(ground.is_some()))));
        let mut sums = SpringForces { grounded, ..SpringForces::default() };
        let elastic_springs = ElasticSprings::new(simd, section);
        let has_law = section.laws.map(|number| context.law(number).is_some());
        let mut failed_springs =
            self.has_any_failed().then(|| FailedSprings::new(simd, section, context));
        let (law_mask, ground_mask) =
            (mask_of(simd, has_law), mask_of(simd, grounds.map(|ground| ground.is_some())));
        let alone = motion.du.is_some() || ground_mask.any_true();
        let mut stored = splat(simd, 0.0);
        for p in 0..self.points.len() {
            let relative = load_at(simd, motion.relative, 3 * p);
            let acts = self.points.springs[p].area.load(simd).simd_gt(splat(simd, 0.0));
            let mut bonded = acts;
            if alone {
                bonded &= !(ground_mask | self.new_lanes(simd, p, motion));
            }
            let mut force = zero(simd);
            if let Some(springs) = &mut failed_springs {
                let slides = mask_of(simd, self.points.modes[p].map(|mode| mode.is_some()));
                let failed = bonded & law_mask & slides;
                bonded &= !failed;
                if failed.any_true() {
                    let failed = LanesOf { points: &mut self.points, pair: p, mask: failed };
                    force = springs.force(simd, failed, relative);
                }
            }
            if bonded.any_true() {
                let bonded = LanesOf { points: &mut self.points, pair: p, mask: bonded };
                let (more, energy) = elastic_springs.force(simd, bonded, relative);
                (force, stored) = (add(force, more), stored + energy);
            }
            store_at(forces, 3 * p, force);
        }
        if alone {
            self.set_single_forces(section, context, motion, forces, losses, &mut sums);
        }
        sums.stored = Lanes::from(sums.stored.load(simd) + stored);
        if let Some(springs) = failed_springs {
            springs.add_sums(simd, &mut sums);
            losses.add_point(1.0, springs.loss());
            self.moved = springs.moved();
            self.find_motions_of_others(has_law, motion);
        }
        sums.add_forces(simd, motion.relative, forces);
        sums
    }

    /// Sets the forces of pairs that are computed one by one, and adds to sums.
    fn set_single_forces(
        &mut self,
        section: &JointSection,
        context: PairContext<'_>,
        motion: LatticeMotion<'_>,
        forces: &mut [Lanes],
        losses: &mut Losses,
        sums: &mut SpringForces,
    ) {
        for (p, forces) in forces.chunks_exact_mut(3).enumerate() {
            for (lane, ground) in motion.grounds.iter().enumerate() {
                let du = motion.du.filter(|_| self.newly_failed.contains(&(p as u32, lane as u8)));
                let single = du.is_some() || ground.is_some();
                if !single || self.points.springs[p].area.0[lane] == 0.0 {
                    continue;
                }
                let pair = SinglePair {
                    section,
                    lane,
                    relative_displacement: at(motion.relative, p, lane),
                    du: du.map(|du| at(du, p, lane)),
                    ground: ground.as_ref(),
                };
                self.points.change(p, lane, |point| {
                    pair.set_force(context, point, forces, losses, sums);
                });
            }
        }
    }

    /// Finds the motion in lanes with failed pairs that were not computed four at a time: those that
    /// must be computed on their own, and those that failed under a law of an earlier stage.
    fn find_motions_of_others(&mut self, has_law: [bool; LANES], motion: LatticeMotion<'_>) {
        let mut others: [bool; LANES] =
            std::array::from_fn(|lane| !has_law[lane] || motion.grounds[lane].is_some());
        if motion.du.is_some() {
            self.newly_failed.iter().for_each(|&(_, lane)| others[usize::from(lane)] = true);
        }
        for (lane, other) in others.into_iter().enumerate() {
            if other && self.has_failed(lane) {
                self.find_motion(lane);
            }
        }
    }

    /// Lanes in which a pair has just failed.
    #[inline(always)]
    fn new_lanes<S: Simd>(&self, simd: S, pair: usize, motion: LatticeMotion<'_>) -> mask64x4<S> {
        let new =
            |lane: u8| motion.du.is_some() && self.newly_failed.contains(&(pair as u32, lane));
        mask_of(simd, [new(0), new(1), new(2), new(3)])
    }
}

impl SpringForces {
    /// Adds the forces of all pairs and their torques.
    #[inline(always)]
    fn add_forces<S: Simd>(&mut self, simd: S, relative: &[Lanes], forces: &[Lanes]) {
        let (mut sum, mut torque) = (zero(simd), zero(simd));
        for (relative, force) in relative.as_chunks::<3>().0.iter().zip(forces.as_chunks::<3>().0) {
            let force = load(simd, force);
            sum = add(sum, force);
            torque = add(torque, cross(load(simd, relative), force));
        }
        (self.force, self.torque) = (sum.map(Lanes::from), torque.map(Lanes::from));
    }
}

/// Some lanes of a pair.
pub(super) struct LanesOf<'a, S: Simd> {
    pub(super) points: &'a mut LatticePoints,
    pub(super) pair: usize,
    pub(super) mask: mask64x4<S>,
}

/// Springs of the bonded pairs of a joint section, four side by side.
struct ElasticSprings<S: Simd> {
    /// Normal and shear stiffness `[Pa/m]`.
    stiffness: [f64x4<S>; 2],
    /// Half the compliance in shear `[m/Pa]`; 0 without a joint.
    half_compliance: f64x4<S>,
}

impl<S: Simd> ElasticSprings<S> {
    #[inline(always)]
    fn new(simd: S, section: &JointSection) -> Self {
        let [normal, shear] = section.stiffnesses();
        let compliance = shear.0.map(|k| if k > 0.0 { 0.5 / k } else { 0.0 });
        let stiffness = [normal.load(simd), shear.load(simd)];
        Self { stiffness, half_compliance: Lanes(compliance).load(simd) }
    }

    /// Updates the bonded points of a pair. Returns their forces on side a `[N]` and their energy
    /// `[J]`, 0 in other lanes.
    #[inline(always)]
    fn force(
        &self,
        simd: S,
        LanesOf { points, pair, mask }: LanesOf<'_, S>,
        relative_displacement: Vector<S>,
    ) -> (Vector<S>, f64x4<S>) {
        let springs = &mut points.springs[pair];
        let own = sub(relative_displacement, load(simd, &springs.origin));
        let traction = elastic_traction(self.stiffness, own);
        let area = mask.select(springs.area.load(simd), splat(simd, 0.0));
        let shear = traction[1] * traction[1] + traction[2] * traction[2];
        let stored = traction[0] * own[0] * 0.5 + shear * self.half_compliance;
        springs.gap = Lanes::from(mask.select(own[0], springs.gap.load(simd)));
        for (kept, traction) in springs.traction.iter_mut().zip(traction) {
            *kept = Lanes::from(mask.select(traction, kept.load(simd)));
        }
        (scale(traction, area), area * stored)
    }
}

/// Pair of one lane that has just failed, or whose springs rotate with the ground.
struct SinglePair<'a> {
    section: &'a JointSection,
    lane: usize,
    /// Displacement of side b relative to side a, along the joint's axes `[m]`.
    relative_displacement: Vector3<f64>,
    /// Increment of that displacement in the last step, if the pair has just failed `[m]`.
    du: Option<Vector3<f64>>,
    ground: Option<&'a GroundFrame>,
}

impl SinglePair<'_> {
    /// Sets the force of the pair on side a, and adds its couple and its energy to sums.
    fn set_force(
        self,
        context: PairContext<'_>,
        point: &mut JointPoint,
        forces: &mut [Lanes],
        losses: &mut Losses,
        sums: &mut SpringForces,
    ) {
        let Self { section, lane, mut relative_displacement, du, ground } = self;
        if let Some(GroundFrame { rotation, shift }) = ground {
            relative_displacement = rotation * relative_displacement + shift;
        }
        let area = point.area;
        let law = context.law(section.laws[lane]).filter(|_| point.failure.is_some());
        let springs = context.springs(section.stiffness(lane), section.dashpot.0[lane]);
        losses.add_point(area, point.update(law, &springs, relative_displacement, du));
        if context.relaxing && law.is_some() {
            point.set_equilibrium();
        }
        let Traction { normal, shear } = point.state.total_traction();
        let mut force = vector(normal, shear) * area;
        // The ground block takes the whole couple.
        match ground {
            Some(ground) => force = ground.rotation.tr_mul(&force),
            None => {
                let couple = vector(0.0, point.state.slip).cross(&force);
                (0..3).for_each(|c| sums.couple[c].0[lane] += couple[c]);
            }
        }
        (0..3).for_each(|c| forces[c].0[lane] = force[c]);
        sums.stored.0[lane] += area * point.state.stored(section.stiffness(lane).shear);
    }
}

/// Vector `number` of a field, in one lane.
pub(super) fn at(field: &[Lanes], number: usize, lane: usize) -> Vector3<f64> {
    lane_of(&[0, 1, 2].map(|c| field[3 * number + c]), lane)
}

fn lane_of(v: &[Lanes; 3], lane: usize) -> Vector3<f64> {
    Vector3::from(v.map(|c| c.0[lane]))
}
