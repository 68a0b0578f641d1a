use fearless_simd::{Level, Simd, dispatch, f64x4};

use super::super::points::{LastEquilibrium, Loss, Points};
use super::super::springs::PointSprings;
use super::super::{Barton, JointLaw, MohrCoulomb, Softening};
use super::LaneLaws;
use crate::element::hexahedron::tests::Numbers;
use crate::math::lanes::{LANES, Lanes, splat};
use crate::math::number::Number;

const STIFFNESS: [f64; 2] = [4e9, 1.5e9];

fn laws() -> [Box<dyn JointLaw>; 3] {
    let brittle = MohrCoulomb {
        cohesion: 2e6,
        tan_friction: 0.7,
        tension: 1e6,
        residual_cohesion: 0.3e6,
        tan_residual_friction: 0.5,
        tan_dilation: 0.1,
        softening: None,
    };
    let softening = Some(Softening { opening: 1e-3, sliding: 5e3 });
    let barton =
        Barton { jrc: 8.0, jcs: 5e7, residual_friction: 28.0, tension: 0.0, tan_dilation: 0.05 };
    [Box::new(brittle), Box::new(MohrCoulomb { softening, ..brittle }), Box::new(barton)]
}

fn fields<N: Number>(points: &Points<N>) -> [N; 12] {
    let Points { slip: [s, t], shear: [x, y], dilation, damage, gap, normal, .. } = *points;
    let added = [points.dashpot, points.correction];
    [s, t, x, y, dilation, damage, gap, normal, added[0], added[1], points.applied_dilation]
        .into_iter()
        .chain([points.energy_excess])
        .collect::<Vec<_>>()
        .try_into()
        .unwrap_or_else(|_| unreachable!())
}

fn at_rest<N: Number>(zero: N) -> Points<N> {
    Points {
        slip: [zero; 2],
        dilation: zero,
        damage: zero,
        gap: zero,
        applied_dilation: zero,
        normal: zero,
        shear: [zero; 2],
        dashpot: zero,
        correction: zero,
        energy_excess: zero,
        relaxing: zero.exceeds(zero),
        equilibrium: LastEquilibrium { slip: [zero; 2], dilation: zero, damage: zero, gap: zero },
    }
}

/// Stores the present state as equilibrium, or forgets the last one.
fn set_equilibrium<N: Number>(points: &mut Points<N>, relaxing: bool) {
    let Points { slip, dilation, damage, gap, .. } = *points;
    points.equilibrium = LastEquilibrium { slip, dilation, damage, gap };
    points.relaxing = gap.like(f64::from(u8::from(relaxing))).exceeds(gap.like(0.0));
}

fn losses<N: Copy>(loss: &Loss<N>) -> [N; 4] {
    [loss.friction, loss.fracture, loss.contact, loss.damping]
}

fn follow_paths<S: Simd>(simd: S, numbers: [u16; LANES], time_step: Option<f64>) {
    let laws = laws();
    let law = |number: u16| laws.get(usize::from(number)).map(|law| &**law);
    let four_laws = LaneLaws::new(simd, numbers, law);
    let springs = PointSprings { stiffness: STIFFNESS, dashpot: 3e4, time_step };
    let four_springs = PointSprings {
        stiffness: STIFFNESS.map(|k| splat(simd, k)),
        dashpot: splat(simd, springs.dashpot),
        time_step,
    };
    let mut random = Numbers(11);
    let mut four: Points<f64x4<S>> = at_rest(splat(simd, 0.0));
    let mut single = [at_rest(0.0); LANES];
    let mut moved = [[0.0; 3]; LANES];
    for step in 0..400 {
        if step % 50 == 0 {
            let relaxing = time_step == Some(0.0) && step > 0;
            set_equilibrium(&mut four, relaxing);
            single.iter_mut().for_each(|points| set_equilibrium(points, relaxing));
        }
        for lane in &mut moved {
            let far = if step % 7 == 0 { 1e-3 } else { 1e-4 };
            *lane = [random.next() * far, lane[1] + random.next() * far, random.next() * far];
        }
        let displacement = [0, 1, 2].map(|c| Lanes(moved.map(|lane| lane[c])).load(simd));
        let four_losses = four_springs.update_points(&four_laws, displacement, &mut four);
        let found = fields(&four).map(Lanes::from);
        let lost = losses(&four_losses).map(Lanes::from);
        for lane in 0..LANES {
            let Some(law) = law(numbers[lane]) else { continue };
            let loss = springs.update_points(law, moved[lane], &mut single[lane]);
            for (found, one) in found.iter().zip(fields(&single[lane])) {
                assert_eq!(found.0[lane].to_bits(), one.to_bits(), "step {step}, lane {lane}");
            }
            for (found, one) in lost.iter().zip(losses(&loss)) {
                assert_eq!(found.0[lane].to_bits(), one.to_bits(), "step {step}, lane {lane}");
            }
        }
    }
}

/// Four points side by side have the bits of points one by one, with the same law in all lanes, with
/// different ones and with none.
#[test]
fn four_points_respond_as_one_by_one() {
    for numbers in [[0; 4], [1; 4], [2; 4], [0, 1, 2, 9], [1, 9, 1, 1]] {
        for time_step in [Some(1e-4), Some(0.0), None] {
            dispatch!(Level::new(), simd => follow_paths(simd, numbers, time_step));
        }
    }
}
