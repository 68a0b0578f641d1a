//! Springs of the pairs of one joint lattice, and their forces.

use fearless_simd::{Simd, f64x4};
use nalgebra::{Matrix3, Vector3};

use super::BrokenLattice;
use crate::losses::Losses;
use crate::point::{JointPoint, PairContext, components, vector};
use ddem_mechanics::law::Traction;
use ddem_mechanics::law::response::stored;
use ddem_mechanics::math::lanes::{
    LANES, Lanes, Matrix, Vector, add, load, load_at, scale, splat, store_at, sub, times,
    transposed_times,
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
        for (points, &traction) in self.points.iter_mut().zip(tractions) {
            let traction = components(traction);
            points[lane].origin = -vector(traction.normal / k.normal, traction.shear / k.shear);
        }
    }

    /// Adds the spring forces to `g`, the forces `K u` of the elements that are left. The bonded
    /// pairs of all lanes are computed at once.
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
        let springs = ElasticSprings::new(simd, section, &axes);
        for (p, node_pair) in face.node_pairs.iter().enumerate() {
            let points = &mut self.points[p];
            let [a, b] = node_pair.sides;
            let difference =
                sub(load_at(simd, sides.local, 3 * b), load_at(simd, sides.local, 3 * a));
            let relative_displacement = transposed_times(&axes, difference);
            let acts = points.each_ref().map(|point| point.area != 0.0);
            let bonded = points.each_ref().map(|point| point.failure.is_none());
            let elastic: [bool; LANES] =
                std::array::from_fn(|lane| acts[lane] && bonded[lane] && grounds[lane].is_none());
            if elastic != [false; LANES] {
                let force = springs.force(simd, points, elastic, relative_displacement, &mut pull);
                store_at(g, 3 * a, sub(load_at(simd, g, 3 * a), force));
                store_at(g, 3 * b, add(load_at(simd, g, 3 * b), force));
            }
            let relative_displacement = relative_displacement.map(Lanes::from);
            for lane in (0..LANES).filter(|&lane| acts[lane] && !elastic[lane]) {
                let just_failed =
                    sides.du.filter(|_| self.newly_failed.contains(&(p as u32, lane as u8)));
                let du = just_failed.map(|du| across(du, section, node_pair, lane));
                let point = &mut points[lane];
                let pair = FailedPair {
                    section,
                    lane,
                    sides: [a, b],
                    relative_displacement: lane_of(&relative_displacement, lane),
                    du,
                };
                pair.add(context, point, grounds[lane].as_ref(), g, losses, &mut pull);
            }
        }
        pull
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

    /// Updates the points of a pair in the `elastic` lanes. Returns their forces on side a `[N]`, 0
    /// in the other lanes.
    #[inline(always)]
    fn force(
        &self,
        simd: S,
        points: &mut [JointPoint; LANES],
        elastic: [bool; LANES],
        relative_displacement: Vector<S>,
        pull: &mut SpringForces,
    ) -> Vector<S> {
        let own = sub(relative_displacement, origins(simd, points));
        let traction = elastic_traction(self.stiffness, own);
        let area = |lane: usize| if elastic[lane] { points[lane].area } else { 0.0 };
        let area = Lanes(std::array::from_fn(area)).load(simd);
        let force = scale(times(self.axes, traction), area);
        pull.force = add(load(simd, &pull.force), force).map(Lanes::from);
        let shear = traction[1] * traction[1] + traction[2] * traction[2];
        let stored = traction[0] * own[0] * 0.5 + shear * self.half_compliance;
        pull.stored = Lanes::from(pull.stored.load(simd) + area * stored);
        let (gap, traction) = (Lanes::from(own[0]), traction.map(Lanes::from));
        for lane in (0..LANES).filter(|&lane| elastic[lane]) {
            let state = &mut points[lane].state;
            (state.traction, state.gap) = (components(lane_of(&traction, lane)), gap.0[lane]);
        }
        force
    }
}

/// Failed pair of one lane, or one whose springs rotate with the ground.
struct FailedPair<'a> {
    section: &'a JointSection,
    lane: usize,
    /// Nodes on sides a and b.
    sides: [usize; 2],
    /// Displacement of side b relative to side a, along the joint's axes `[m]`.
    relative_displacement: Vector3<f64>,
    /// Increment of that displacement in the last step, if the pair has just failed `[m]`.
    du: Option<Vector3<f64>>,
}

impl FailedPair<'_> {
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
        pull.stored.0[lane] += area * stored(section.stiffness(lane), &point.state);
    }
}

/// Axes of a joint in all lanes, as columns.
#[inline(always)]
pub(super) fn lane_axes<S: Simd>(simd: S, section: &JointSection) -> Matrix<S> {
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| splat(simd, section.axes[(i, j)])))
}

/// Origins of four points `[m]`.
#[inline(always)]
pub(super) fn origins<S: Simd>(simd: S, points: &[JointPoint; LANES]) -> Vector<S> {
    [0, 1, 2].map(|c| Lanes(points.each_ref().map(|point| point.origin[c])).load(simd))
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
