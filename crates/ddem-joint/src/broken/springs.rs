//! Springs of the pairs of one joint lattice, and their forces.

use fearless_simd::{Select, Simd, SimdBase, f64x4, mask64x4};
use nalgebra::{Matrix3, Vector3};

use super::failed_springs::FailedSprings;
use super::{BrokenLattice, LatticePoints};
use crate::losses::Losses;
use crate::point::{JointPoint, PairContext, components, vector};
use ddem_mechanics::law::Traction;
use ddem_mechanics::math::lanes::{
    LANES, Lanes, Matrix, Vector, add, load, load_at, scale, splat, store_at, sub, times,
    transposed_times, zero,
};
use ddem_mesh::joint_sections::{FaceLattice, JointSection};
use ddem_mesh::numbering::NodePair;

/// Forces of the springs of a joint lattice.
#[derive(Clone, Copy, Debug, Default)]
pub struct SpringForces {
    /// Force on side a, from side b, in the joint's frame `[N]`.
    pub force: [Lanes; 3],
    /// `Σ s × F` of the slips, in the joint's frame `[N m]`.
    pub couple: [Lanes; 3],
    /// Energy in the springs `[J]`.
    pub stored: Lanes,
    /// 1 where the springs rotate with the ground block, 0 where they rotate with both blocks.
    pub grounded: Lanes,
}

/// Motion of both sides of a joint lattice.
#[derive(Clone, Copy)]
pub struct SideDisplacements<'a> {
    /// Displacements of the nodes in the joint's frame `[m]`.
    pub local: &'a [Lanes],
    /// Displacement increments of the nodes in the last step `[m]`; only if pairs have just failed.
    pub du: Option<&'a [Lanes]>,
    /// Ground block's frame for each lane whose springs rotate with it.
    pub grounds: &'a [Option<GroundFrame>; LANES],
}

/// Frame of the ground block with which the springs of a lane rotate, relative to the joint's mean
/// frame.
#[derive(Clone, Copy, Debug)]
pub struct GroundFrame {
    /// Axes of the springs, as columns, in the mean frame.
    axes: Matrix3<f64>,
    /// Rotation from openings along the joint's axes to openings along the springs' axes.
    opening_rotation: Matrix3<f64>,
    /// Opening that the rotation of the gap causes, along the springs' axes `[m]`.
    shift: Vector3<f64>,
}

impl GroundFrame {
    /// Frame of a ground block whose rotation relative to the mean frame is `rotation`.
    pub fn new(rotation: &Matrix3<f64>, section: &JointSection, lane: usize) -> Self {
        let axes = rotation * section.axes;
        let gap = lane_of(section.gap(), lane);
        let shift = axes.tr_mul(&gap) - section.axes.tr_mul(&gap);
        Self { axes, opening_rotation: axes.tr_mul(&section.axes), shift }
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

    /// Adds the spring forces to `g`, the forces `K u` of the elements that are left. The bonded
    /// pairs of all lanes are computed at once, and so are the failed ones. One by one remain pairs
    /// that have just failed and those whose springs rotate with the ground.
    #[inline(always)]
    pub fn add_spring_forces<S: Simd>(
        &mut self,
        simd: S,
        face: FaceLattice<'_>,
        context: PairContext<'_>,
        sides: SideDisplacements<'_>,
        g: &mut [Lanes],
        losses: &mut Losses,
    ) -> SpringForces {
        let (section, grounds) = (face.section, sides.grounds);
        let grounded = Lanes(grounds.map(|ground| f64::from(u8::from(ground.is_some()))));
        let mut pull = SpringForces { grounded, ..SpringForces::default() };
        let axes = lane_axes(simd, section);
        let elastic_springs = ElasticSprings::new(simd, section, &axes);
        let any_failed = self.has_any_failed();
        let has_law = section.laws.map(|number| context.law(number).is_some());
        let mut failed_springs = any_failed.then(|| FailedSprings::new(simd, face, context, &axes));
        for (p, node_pair) in face.node_pairs.iter().enumerate() {
            let [a, b] = node_pair.sides;
            let difference =
                sub(load_at(simd, sides.local, 3 * b), load_at(simd, sides.local, 3 * a));
            let relative_displacement = transposed_times(&axes, difference);
            let [bonded, failed, single] = self.kinds(p, has_law, sides);
            if bonded != [false; LANES] {
                let springs = &elastic_springs;
                let bonded = LanesOf { points: &mut self.points, pair: p, lanes: bonded };
                let force = springs.force(simd, bonded, relative_displacement, &mut pull);
                add_forces(simd, g, [a, b], force);
            }
            if let Some(springs) = &mut failed_springs
                && failed != [false; LANES]
            {
                let failed = LanesOf { points: &mut self.points, pair: p, lanes: failed };
                let force = springs.force(simd, failed, relative_displacement, &mut pull);
                add_forces(simd, g, [a, b], force);
            }
            let relative_displacement = relative_displacement.map(Lanes::from);
            for lane in (0..LANES).filter(|&lane| single[lane]) {
                let new = self.newly_failed.contains(&(p as u32, lane as u8));
                let du = sides.du.filter(|_| new);
                let pair = SinglePair {
                    section,
                    lane,
                    sides: [a, b],
                    relative_displacement: lane_of(&relative_displacement, lane),
                    du: du.map(|du| across(du, section, node_pair, lane)),
                };
                let ground = grounds[lane].as_ref();
                self.points.change(p, lane, |point| {
                    pair.add(context, point, ground, g, losses, &mut pull);
                });
            }
        }
        if let Some(springs) = failed_springs {
            losses.add_point(1.0, springs.loss());
            self.moved = springs.moved();
            self.find_motions_of_others(has_law, sides);
        }
        pull
    }
}

impl BrokenLattice {
    /// Finds the motion in lanes with failed pairs that were not computed four at a time: those that
    /// must be computed on their own, and those that failed under a law of an earlier stage.
    fn find_motions_of_others(&mut self, has_law: [bool; LANES], sides: SideDisplacements<'_>) {
        let mut others: [bool; LANES] =
            std::array::from_fn(|lane| !has_law[lane] || sides.grounds[lane].is_some());
        if sides.du.is_some() {
            self.newly_failed.iter().for_each(|&(_, lane)| others[usize::from(lane)] = true);
        }
        for (lane, other) in others.into_iter().enumerate() {
            if other && self.has_failed(lane) {
                self.find_motion(lane);
            }
        }
    }

    /// Lanes in which a pair is bonded, has failed, or must be computed on its own.
    #[inline(always)]
    fn kinds(
        &self,
        pair: usize,
        has_law: [bool; LANES],
        sides: SideDisplacements<'_>,
    ) -> [[bool; LANES]; 3] {
        let area = self.points.springs[pair].area;
        let modes = if self.has_any_failed() { self.points.modes[pair] } else { [None; LANES] };
        let mut kinds = [[false; LANES]; 3];
        for lane in (0..LANES).filter(|&lane| area.0[lane] != 0.0) {
            let new = sides.du.is_some() && self.newly_failed.contains(&(pair as u32, lane as u8));
            let alone = new || sides.grounds[lane].is_some();
            let slides = has_law[lane] && modes[lane].is_some();
            kinds[0][lane] = !alone && !slides;
            kinds[1][lane] = !alone && slides;
            kinds[2][lane] = alone;
        }
        kinds
    }
}

/// Adds forces on sides a to the forces `K u` of two nodes.
#[inline(always)]
fn add_forces<S: Simd>(simd: S, g: &mut [Lanes], [a, b]: [usize; 2], force: Vector<S>) {
    store_at(g, 3 * a, sub(load_at(simd, g, 3 * a), force));
    store_at(g, 3 * b, add(load_at(simd, g, 3 * b), force));
}

/// Some lanes of a pair.
pub(super) struct LanesOf<'a> {
    pub(super) points: &'a mut LatticePoints,
    pub(super) pair: usize,
    pub(super) lanes: [bool; LANES],
}

impl LanesOf<'_> {
    /// Mask of the lanes.
    #[inline(always)]
    pub(super) fn mask<S: Simd>(&self, simd: S) -> mask64x4<S> {
        let lanes = Lanes(self.lanes.map(|lane| f64::from(u8::from(lane))));
        lanes.load(simd).simd_gt(splat(simd, 0.0))
    }
}

/// Springs of the bonded pairs of a joint section, four side by side.
struct ElasticSprings<'a, S: Simd> {
    axes: &'a Matrix<S>,
    /// Normal and shear stiffness `[Pa/m]`.
    stiffness: [f64x4<S>; 2],
    /// Half the compliance in shear `[m/Pa]`; 0 without a joint.
    half_compliance: f64x4<S>,
}

impl<'a, S: Simd> ElasticSprings<'a, S> {
    #[inline(always)]
    fn new(simd: S, section: &JointSection, axes: &'a Matrix<S>) -> Self {
        let [normal, shear] = section.stiffnesses();
        let compliance = shear.0.map(|k| if k > 0.0 { 0.5 / k } else { 0.0 });
        let stiffness = [normal.load(simd), shear.load(simd)];
        Self { axes, stiffness, half_compliance: Lanes(compliance).load(simd) }
    }

    /// Updates the bonded points of a pair. Returns their forces on side a `[N]`, 0 in other lanes.
    #[inline(always)]
    fn force(
        &self,
        simd: S,
        bonded: LanesOf<'_>,
        relative_displacement: Vector<S>,
        pull: &mut SpringForces,
    ) -> Vector<S> {
        let mask = bonded.mask(simd);
        let springs = &mut bonded.points.springs[bonded.pair];
        let own = sub(relative_displacement, load(simd, &springs.origin));
        let traction = elastic_traction(self.stiffness, own);
        let area = mask.select(springs.area.load(simd), splat(simd, 0.0));
        let force = scale(times(self.axes, traction), area);
        pull.force = add(load(simd, &pull.force), force).map(Lanes::from);
        let shear = traction[1] * traction[1] + traction[2] * traction[2];
        let stored = traction[0] * own[0] * 0.5 + shear * self.half_compliance;
        pull.stored = Lanes::from(pull.stored.load(simd) + area * stored);
        springs.gap = Lanes::from(mask.select(own[0], springs.gap.load(simd)));
        for (kept, traction) in springs.traction.iter_mut().zip(traction) {
            *kept = Lanes::from(mask.select(traction, kept.load(simd)));
        }
        force
    }
}

/// Pair of one lane that has just failed, or whose springs rotate with the ground.
struct SinglePair<'a> {
    section: &'a JointSection,
    lane: usize,
    /// Nodes on sides a and b.
    sides: [usize; 2],
    /// Displacement of side b relative to side a, along the joint's axes `[m]`.
    relative_displacement: Vector3<f64>,
    /// Increment of that displacement in the last step, if the pair has just failed `[m]`.
    du: Option<Vector3<f64>>,
}

impl SinglePair<'_> {
    /// Adds the forces of the pair to its nodes.
    fn add(
        self,
        context: PairContext<'_>,
        point: &mut JointPoint,
        ground: Option<&GroundFrame>,
        g: &mut [Lanes],
        losses: &mut Losses,
        pull: &mut SpringForces,
    ) {
        let Self { section, lane, sides: [a, b], mut relative_displacement, du } = self;
        if let Some(GroundFrame { opening_rotation, shift, .. }) = ground {
            relative_displacement = opening_rotation * relative_displacement + shift;
        }
        let area = point.area;
        let law = context.law(section.laws[lane]).filter(|_| point.failure.is_some());
        let springs = context.springs(section.stiffness(lane), section.dashpot.0[lane]);
        losses.add_point(area, point.update(law, &springs, relative_displacement, du));
        if context.relaxing && law.is_some() {
            point.set_equilibrium();
        }
        let Traction { normal, shear } = point.state.total_traction();
        let axes = ground.map_or(&section.axes, |ground| &ground.axes);
        let force = axes * vector(normal, shear) * area;
        // The ground block takes the whole couple.
        let couple = match ground {
            Some(_) => Vector3::zeros(),
            None => (axes * vector(0.0, point.state.slip)).cross(&force),
        };
        for c in 0..3 {
            g[3 * a + c].0[lane] -= force[c];
            g[3 * b + c].0[lane] += force[c];
            pull.force[c].0[lane] += force[c];
            pull.couple[c].0[lane] += couple[c];
        }
        pull.stored.0[lane] += area * point.state.stored(section.stiffness(lane).shear);
    }
}

/// Axes of a joint in all lanes, as columns.
#[inline(always)]
pub(super) fn lane_axes<S: Simd>(simd: S, section: &JointSection) -> Matrix<S> {
    // A closure would be compiled without the instruction set.
    let mut axes = [zero(simd); 3];
    for (i, row) in axes.iter_mut().enumerate() {
        for (j, number) in row.iter_mut().enumerate() {
            *number = splat(simd, section.axes[(i, j)]);
        }
    }
    axes
}

/// Elastic tractions for the vectors from the origins `[Pa]`.
#[inline(always)]
pub(super) fn elastic_traction<S: Simd>(
    [normal, shear]: [f64x4<S>; 2],
    own: Vector<S>,
) -> Vector<S> {
    [normal * own[0], shear * own[1], shear * own[2]]
}

/// Displacement of side b relative to side a, along the joint's axes `[m]`.
pub(super) fn across(
    local: &[Lanes],
    section: &JointSection,
    node_pair: &NodePair,
    lane: usize,
) -> Vector3<f64> {
    let [a, b] = node_pair.sides;
    section.axes.tr_mul(&(at(local, b, lane) - at(local, a, lane)))
}

pub(super) fn at(field: &[Lanes], node: usize, lane: usize) -> Vector3<f64> {
    lane_of(&[0, 1, 2].map(|c| field[3 * node + c]), lane)
}

fn lane_of(v: &[Lanes; 3], lane: usize) -> Vector3<f64> {
    Vector3::from(v.map(|c| c.0[lane]))
}
