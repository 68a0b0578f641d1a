//! Pairs of a patch, four side by side. They are stored one by one, because contacts make and drop
//! them; their springs are computed for four at once.

use fearless_simd::{Simd, f64x4};
use nalgebra::{Matrix3, Vector2};

use super::fixed::FixedPair;
use super::{Configuration, ContactPoint};
use crate::point::elastic_traction;
use ddem_mechanics::law::points::Points;
use ddem_mechanics::law::springs::PointSprings;
use ddem_mechanics::law::strengths::LaneLaws;
use ddem_mechanics::law::{PointLoss, Traction};
use ddem_mechanics::math::lanes::{
    LANES, Lanes, Matrix, Vector, mask_of, scale, splat_matrix, sub, times, transposed_times,
};
use ddem_mechanics::math::number::Number;
use ddem_mechanics::rigid::LinearField;
use ddem_mesh::Vec3;

/// Axes of a patch, along which its pairs act.
#[derive(Clone, Copy)]
pub(super) struct PairAxes<S: Simd>(Matrix<S>);

impl<S: Simd> PairAxes<S> {
    /// Axes from their columns in space.
    #[inline(always)]
    pub(super) fn new(simd: S, columns: &Matrix3<f64>) -> Self {
        Self(splat_matrix(simd, columns))
    }

    /// Components of four vectors along the axes.
    #[inline(always)]
    pub(super) fn along(&self, simd: S, vectors: &[Vec3; LANES]) -> Vector<S> {
        transposed_times(&self.0, side_by_side(simd, vectors))
    }

    /// Forces of points with tractions along the axes `[Pa]` and areas `[m²]`, one by one `[N]`.
    #[inline(always)]
    pub(super) fn forces(&self, traction: Vector<S>, area: f64x4<S>) -> [Vec3; LANES] {
        let [x, y, z] = scale(times(&self.0, traction), area);
        let (x, y, z) = (Lanes::from(x), Lanes::from(y), Lanes::from(z));
        each(|lane| Vec3::new(x.0[lane], y.0[lane], z.0[lane]))
    }
}

/// Four vectors in registers.
#[inline(always)]
fn side_by_side<S: Simd>(simd: S, vectors: &[Vec3; LANES]) -> Vector<S> {
    let x = Lanes(each(|lane| vectors[lane].x)).load(simd);
    let y = Lanes(each(|lane| vectors[lane].y)).load(simd);
    let z = Lanes(each(|lane| vectors[lane].z)).load(simd);
    [x, y, z]
}

/// One item for each lane. The compiler does not always inline `map`.
#[inline(always)]
fn each<T>(of: impl Fn(usize) -> T) -> [T; LANES] {
    [of(0), of(1), of(2), of(3)]
}

/// First four items of a list. If it has fewer, `own` gets them, and the last one again for each that is
/// missing.
#[inline(always)]
pub(super) fn first_four<'a, T: Copy>(
    list: &'a [T],
    own: &'a mut Option<[T; LANES]>,
) -> &'a [T; LANES] {
    list.first_chunk().unwrap_or_else(|| own.insert(padded(list)))
}

/// [`first_four`], to be changed.
#[inline(always)]
pub(super) fn first_four_mut<'a, T: Copy>(
    list: &'a mut [T],
    own: &'a mut Option<[T; LANES]>,
) -> &'a mut [T; LANES] {
    let (fours, rest) = list.as_chunks_mut();
    match fours.first_mut() {
        Some(four) => four,
        None => own.insert(padded(rest)),
    }
}

fn padded<T: Copy>(list: &[T]) -> [T; LANES] {
    let last = list.len() - 1;
    each(|lane| list[lane.min(last)])
}

/// Vectors between the sides of four pairs `[m]`.
#[inline(always)]
pub(super) fn relative_positions(
    fixed: &[FixedPair; LANES],
    configuration: &Configuration<'_>,
    motions: &[LinearField; 2],
) -> [Vec3; LANES] {
    let [a, b, c, d] = fixed;
    let u = configuration.u;
    [
        a.relative_position(u, motions),
        b.relative_position(u, motions),
        c.relative_position(u, motions),
        d.relative_position(u, motions),
    ]
}

/// Vectors from the origins of four points to sides b, from those between the sides, along the axes
/// `[m]`.
#[inline(always)]
pub(super) fn from_origins<S: Simd>(
    simd: S,
    points: &[ContactPoint; LANES],
    relative: Vector<S>,
) -> Vector<S> {
    let [a, b, c, d] = points;
    let origins = [a.pair.origin, b.pair.origin, c.pair.origin, d.pair.origin];
    sub(relative, side_by_side(simd, &origins))
}

/// Areas of four points `[m²]`.
#[inline(always)]
pub(super) fn areas<S: Simd>(simd: S, points: &[ContactPoint; LANES]) -> f64x4<S> {
    let [a, b, c, d] = points;
    Lanes([a.pair.area, b.pair.area, c.pair.area, d.pair.area]).load(simd)
}

/// Tractions `[Pa]`, and openings `[m]`, of four elastic points.
pub(super) struct ElasticLanes {
    traction: [Lanes; 3],
    gap: Lanes,
}

impl ElasticLanes {
    /// Tractions and vectors from the origins, in memory.
    #[inline(always)]
    pub(super) fn new<S: Simd>(traction: Vector<S>, own: Vector<S>) -> Self {
        let [normal, s, t] = traction;
        let traction = [Lanes::from(normal), Lanes::from(s), Lanes::from(t)];
        Self { traction, gap: Lanes::from(own[0]) }
    }

    /// Traction `[Pa]` and opening `[m]` in a lane.
    #[inline(always)]
    pub(super) fn of(&self, lane: usize) -> (Traction, f64) {
        let [normal, s, t] = &self.traction;
        let shear = Vector2::new(s.0[lane], t.0[lane]);
        (Traction { normal: normal.0[lane], shear }, self.gap(lane))
    }

    /// Opening in a lane `[m]`.
    #[inline(always)]
    pub(super) fn gap(&self, lane: usize) -> f64 {
        self.gap.0[lane]
    }
}

/// Springs of the pairs of a patch.
pub(super) struct FourSprings<'a, S: Simd> {
    springs: PointSprings<f64x4<S>>,
    /// Strengths of their law.
    law: &'a LaneLaws<'a, S>,
}

/// Tractions of four points along the axes `[Pa]`, and their losses.
pub(super) struct FourResponses<S: Simd> {
    pub(super) traction: Vector<S>,
    pub(super) losses: [PointLoss; LANES],
}

impl<'a, S: Simd> FourSprings<'a, S> {
    #[inline(always)]
    pub(super) fn new(simd: S, springs: &PointSprings, law: &'a LaneLaws<'a, S>) -> Self {
        Self { springs: springs.four(simd), law }
    }

    /// Tractions of elastic points for the vectors from their origins `[Pa]`.
    #[inline(always)]
    pub(super) fn elastic(&self, own: Vector<S>) -> Vector<S> {
        elastic_traction(self.springs.stiffness, own)
    }

    /// Updates the points that slide, in some lanes, for the vectors from their origins `[m]`. The
    /// tractions in other lanes are those given.
    #[inline(always)]
    pub(super) fn slide(
        &self,
        simd: S,
        points: &mut [ContactPoint; LANES],
        slides: [bool; LANES],
        own: Vector<S>,
        others: Vector<S>,
    ) -> FourResponses<S> {
        let mut losses = [PointLoss::default(); LANES];
        if slides == [false; LANES] {
            return FourResponses { traction: others, losses };
        }
        let [a, b, c, d] = &*points;
        let states = [&a.pair.state, &b.pair.state, &c.pair.state, &d.pair.state];
        let mut state = Points::four(simd, states);
        let lost = self.springs.update_points(self.law, own, &mut state).each();
        let kept = state.in_memory();
        for lane in 0..LANES {
            if slides[lane] {
                kept.store(lane, &mut points[lane].pair.state);
                losses[lane] = lost[lane];
            }
        }
        let mask = mask_of(simd, slides);
        let [normal, s, t] = state.total_traction();
        let traction = [
            f64x4::select(mask, normal, others[0]),
            f64x4::select(mask, s, others[1]),
            f64x4::select(mask, t, others[2]),
        ];
        FourResponses { traction, losses }
    }
}

#[cfg(test)]
mod tests {
    use fearless_simd::{Level, dispatch};
    use fearless_simd_macros::simd;

    use super::*;
    use crate::point::{JointPoint, PairFailure};
    use ddem_mechanics::law::{FailureMode, JointLaw, MohrCoulomb, SpringStiffness};

    const STIFFNESS: SpringStiffness = SpringStiffness { normal: 2e9, shear: 1e9 };

    /// Components of relative displacements of four pairs `[m]`, different in each step and pair.
    fn relative(step: usize) -> [Vec3; LANES] {
        each(|lane| {
            let phase = 0.7 * step as f64 + 1.3 * lane as f64;
            Vec3::new(phase.sin() - 0.4, 2.0 * (0.3 * phase).cos(), phase.cos()) * 1e-4
        })
    }

    #[simd]
    fn slide_once<S: Simd>(
        simd: S,
        law: &MohrCoulomb,
        springs: &PointSprings,
        points: &mut [ContactPoint; LANES],
        slides: [bool; LANES],
        step: usize,
    ) -> [PointLoss; LANES] {
        let law = LaneLaws::new(simd, [0; LANES], |_| Some(law as &dyn JointLaw));
        let four_springs = FourSprings::new(simd, springs, &law);
        let own = from_origins(simd, points, side_by_side(simd, &relative(step)));
        four_springs.slide(simd, points, slides, own, own).losses
    }

    /// Four pairs at once have the bits of each of them alone; other pairs do not change.
    #[test]
    fn four_pairs_equal_single_pairs() {
        let law = MohrCoulomb {
            tan_friction: 0.7,
            tan_residual_friction: 0.5,
            cohesion: 1e4,
            ..MohrCoulomb::default()
        };
        let failure = Some(PairFailure { mode: FailureMode::Shear, time: 0.0 });
        let start: [ContactPoint; LANES] = each(|lane| ContactPoint {
            pair: JointPoint {
                area: 0.5,
                origin: Vec3::new(1e-5, 0.0, -2e-5) * lane as f64,
                failure,
                ..JointPoint::default()
            },
            ..ContactPoint::default()
        });
        let slides = [true, true, false, true];
        for time_step in [Some(1e-4), Some(0.0), None] {
            let springs = PointSprings::new(STIFFNESS, 3e4, time_step);
            let (mut four, mut single) = (start, start);
            for step in 0..20 {
                let losses = dispatch!(Level::new(), simd => {
                    slide_once(simd, &law, &springs, &mut four, slides, step)
                });
                for (lane, point) in single.iter_mut().enumerate().filter(|(lane, _)| slides[*lane])
                {
                    let loss = point.pair.update(Some(&law), &springs, relative(step)[lane], None);
                    assert_eq!(loss, losses[lane]);
                    if time_step == Some(0.0) {
                        point.pair.set_equilibrium();
                        four[lane].pair.set_equilibrium();
                    }
                }
                assert_eq!(four, single);
            }
            assert!(single[0].pair.state.slip.norm() > 0.0);
        }
    }

    #[test]
    fn missing_pairs_repeat_the_last_one() {
        let mut own = None;
        assert_eq!(first_four(&[1, 2], &mut own), &[1, 2, 2, 2]);
        assert_eq!(first_four(&[1, 2, 3, 4, 5], &mut None), &[1, 2, 3, 4]);
        let mut list = [1, 2, 3, 4, 5];
        first_four_mut(&mut list, &mut None)[3] = 7;
        assert_eq!(list, [1, 2, 3, 7, 5]);
    }
}
