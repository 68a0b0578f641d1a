//! Tests of the curves of the laws against their definitions.

use nalgebra::Vector2;

use super::points::Points;
use super::springs::PointSprings;
use super::*;

const STIFFNESS: SpringStiffness = SpringStiffness { normal: 4e9, shear: 1.5e9 };

fn coulomb(energy: Option<[f64; 2]>) -> MohrCoulomb {
    MohrCoulomb {
        cohesion: 2e6,
        tan_friction: tan(35.0),
        tension: 1e6,
        residual_cohesion: 0.3e6,
        tan_residual_friction: tan(25.0),
        tan_dilation: tan(7.0),
        softening: energy
            .map(|[opening, sliding]| Softening { opening: 2.0 * opening / 1e6, sliding }),
    }
}

fn tan(degrees: f64) -> f64 {
    degrees.to_radians().tan()
}

/// Response of the springs of one point.
fn respond<L: JointLaw + ?Sized>(
    law: &L,
    stiffness: SpringStiffness,
    JointDisplacement { normal, shear }: JointDisplacement,
    state: &mut PointState,
) -> PointLoss {
    let mut points = Points::one(state);
    let displacement = [normal, shear.x, shear.y];
    let loss = super::response::respond(law, stiffness.components(), displacement, &mut points);
    points.store(state);
    loss.into()
}

/// Moves a point that has just reached its peak along a path and adds up its losses.
fn lead(
    law: &dyn JointLaw,
    path: impl Iterator<Item = JointDisplacement>,
    start: PointState,
) -> (PointState, PointLoss) {
    let (mut state, mut sum) = (start, PointLoss::default());
    for displacement in path {
        let loss = respond(law, STIFFNESS, displacement, &mut state);
        sum.friction += loss.friction;
        sum.fracture += loss.fracture;
    }
    (state, sum)
}

fn at(normal: f64, shear: f64) -> JointDisplacement {
    JointDisplacement { normal, shear: Vector2::new(0.6, 0.8) * shear }
}

#[test]
fn strength_that_stays_sheds_no_load() {
    let sheds = |[cohesion, residual_cohesion]: [f64; 2], tension: f64, residual: f64| {
        let [tan_friction, tan_residual_friction] = [35.0, residual].map(tan);
        let law = MohrCoulomb {
            cohesion,
            residual_cohesion,
            tension,
            tan_friction,
            tan_residual_friction,
            ..MohrCoulomb::default()
        };
        let reduced = ReducedLaw { law: Arc::new(law), factor: 1.3 };
        assert_eq!(reduced.sheds_load(), law.sheds_load());
        law.sheds_load()
    };
    assert!(!sheds([0.0; 2], 0.0, 35.0) && !sheds([1e3; 2], 0.0, 35.0));
    assert!(sheds([1e3, 0.0], 0.0, 35.0) && sheds([1e3, 500.0], 0.0, 35.0));
    assert!(sheds([0.0; 2], 1e3, 35.0) && sheds([0.0; 2], 0.0, 30.0));
}

#[test]
fn bonded_point_fails_at_its_strength() {
    let law = coulomb(None);
    assert_eq!(law.failure(0.999e6, 0.0), None);
    assert_eq!(law.failure(1.001e6, 0.0), Some(FailureMode::Tension));
    let peak = 2e6 + 3e6 * tan(35.0);
    assert_eq!(law.failure(-3e6, 0.9999 * peak), None);
    assert_eq!(law.failure(-3e6, 1.0001 * peak), Some(FailureMode::Shear));
    // Pure tension: shear of the size of rounding decides nothing.
    let bare = MohrCoulomb { tension: 1e6, ..MohrCoulomb::default() };
    assert_eq!(bare.failure(0.999e6, 1e-5), None);
    assert!(!bare.any_failure(&[0.999e6], &[1e-10]));
    assert_eq!(bare.failure(1.001e6, 1e-5), Some(FailureMode::Tension));
    assert_eq!(bare.failure(0.5e6, 1.0), Some(FailureMode::Shear));
    let overload = law.overload(2.5e6, 0.0);
    assert!((overload - 2.5).abs() < 3e-3, "{overload}");
    assert!(law.any_failure(&[0.0, 0.0], &[0.0, 2.1e6 * 2.1e6]));
    assert!(!law.any_failure(&[0.0, 0.9e6], &[1.9e6 * 1.9e6, 0.0]));
}

#[test]
fn pure_opening_takes_its_fracture_energy() {
    for energy in [200.0, 1000.0] {
        let law = coulomb(Some([energy, 5000.0]));
        let (elastic, last) = (1e6 / STIFFNESS.normal, 2.0 * energy / 1e6);
        let start = PointState {
            gap: elastic,
            traction: Traction { normal: 1e6, shear: Vector2::zeros() },
            ..PointState::default()
        };
        // The path includes a way back: unloading loses nothing.
        let path = (0..=1000).map(|i| f64::from(i) / 1000.0);
        let path = path
            .clone()
            .take(400)
            .chain((100..400).rev().map(|i| f64::from(i) / 1000.0))
            .chain(path.skip(100));
        let path = path.map(|x| at(elastic + x * (last - elastic), 0.0));
        let (state, loss) = lead(&law, path, start);
        assert!((loss.fracture / energy - 1.0).abs() < 1e-9, "{loss:?}");
        // Parted faces have lost their residual cohesion as well.
        assert_eq!((loss.friction, state.traction.normal, state.damage), (0.0, 0.0, 2.0));
    }
}

#[test]
fn pure_sliding_takes_its_fracture_energy_above_the_residual() {
    let law = coulomb(Some([200.0, 3000.0]));
    let law = MohrCoulomb { tan_dilation: 0.0, ..law };
    let elastic = 2e6 / STIFFNESS.shear;
    let start = PointState {
        traction: Traction { normal: 0.0, shear: at(0.0, 2e6).shear },
        ..PointState::default()
    };
    let path = (1..=4000).map(|i| at(0.0, elastic + f64::from(i) * 2e-6));
    let (state, loss) = lead(&law, path, start);
    assert_eq!(state.damage, 1.0);
    assert!((loss.fracture / 3000.0 - 1.0).abs() < 1e-3, "{loss:?}");
    let friction = 0.3e6 * state.slip.norm();
    assert!((loss.friction / friction - 1.0).abs() < 1e-9, "{loss:?}");
    assert!((state.traction.shear.norm() / 0.3e6 - 1.0).abs() < 1e-12);
}

/// The loss includes friction that falls: G_II under any pressure that the springs can hold.
#[test]
fn sliding_under_pressure_takes_its_fracture_energy() {
    for (pressure, softens) in [(0.5e6, true), (2e6, true), (40e6, false)] {
        let law = MohrCoulomb { tan_dilation: 0.0, ..coulomb(Some([200.0, 3000.0])) };
        let [peak, residual] = [law.peak(-pressure), law.residual(-pressure)];
        assert_eq!((peak - residual).powi(2) / (2.0 * STIFFNESS.shear) < 3000.0, softens);
        let gap = -pressure / STIFFNESS.normal;
        let start = PointState {
            gap,
            traction: Traction { normal: -pressure, shear: at(0.0, peak).shear },
            ..PointState::default()
        };
        let elastic = peak / STIFFNESS.shear;
        let path = (1..=4000).map(|i| at(gap, elastic + f64::from(i) * 2e-6));
        let (state, loss) = lead(&law, path, start);
        let exact =
            if softens { 3000.0 } else { (peak - residual).powi(2) / (2.0 * STIFFNESS.shear) };
        assert_eq!(state.damage, 1.0);
        assert!((loss.fracture / exact - 1.0).abs() < 2e-3, "{pressure} {loss:?} {exact}");
    }
}

/// A point that has slid keeps its residual cohesion. One that has opened has friction only when it
/// closes again, until an equilibrium in which it is closed.
#[test]
fn separated_faces_have_no_cohesion_until_equilibrium() {
    let law = MohrCoulomb { tan_dilation: 0.0, ..coulomb(None) };
    let friction = 4e6 * tan(25.0);
    let pressed = -4e6 / STIFFNESS.normal;
    let slides = |i: i32| at(pressed, f64::from(i) * 1e-5);
    for open_at_equilibrium in [false, true] {
        let mut state = PointState::default();
        let mut shear_at = |displacement: JointDisplacement| {
            respond(&law, STIFFNESS, displacement, &mut state);
            state.traction.shear.norm()
        };
        let slid = (1..=1000).map(slides).map(&mut shear_at).fold(0.0, |_, shear| shear);
        assert!((slid / (0.3e6 + friction) - 1.0).abs() < 1e-12, "{slid}");
        assert_eq!(shear_at(at(1e-6, 0.01)), 0.0);
        if open_at_equilibrium {
            state.damage = damage_at_equilibrium(state.damage, state.gap);
        }
        let mut shear_at = |displacement: JointDisplacement| {
            respond(&law, STIFFNESS, displacement, &mut state);
            state.traction.shear.norm()
        };
        let closed = (1001..=2000).map(slides).map(&mut shear_at).fold(0.0, |_, shear| shear);
        assert!((closed / friction - 1.0).abs() < 1e-12, "{closed}");
        state.damage = damage_at_equilibrium(state.damage, state.gap);
        state.set_equilibrium();
        respond(&law, STIFFNESS, slides(3000), &mut state);
        let shear = state.traction.shear.norm();
        assert!((shear / (0.3e6 + friction) - 1.0).abs() < 1e-12, "{shear}");
    }
}

#[test]
fn sliding_has_residual_strength_and_dilates() {
    let law = coulomb(None);
    let start = PointState::default();
    let path = (1..=3000).map(|i| at(-1e-3, f64::from(i) * 1e-6));
    let (state, loss) = lead(&law, path, start);
    let slip = state.slip.norm();
    assert!((state.dilation / (slip * tan(7.0)) - 1.0).abs() < 1e-12);
    let pressure = -state.traction.normal;
    assert!((state.traction.shear.norm() / (0.3e6 + pressure * tan(25.0)) - 1.0).abs() < 1e-12);
    // No energy is created: the work is stored or lost.
    let work = loss.friction + loss.fracture;
    assert!(work > 0.0 && state.stored(STIFFNESS.shear) > 0.0);
}

#[test]
fn open_point_carries_nothing_and_resets_stick() {
    let law = coulomb(None);
    let (state, _) =
        lead(&law, [at(-1e-4, 1e-4), at(1e-5, 2e-3)].into_iter(), PointState::default());
    assert_eq!(state.traction, Traction::default());
    // Closed again at the same place, it carries no shear at first.
    let (state, _) = lead(&law, [at(-1e-4, 2e-3)].into_iter(), state);
    assert!(state.traction.normal < 0.0);
    assert!(state.traction.shear.norm() < 1e-6);
}

#[test]
fn barton_strength_follows_its_curve() {
    let law =
        Barton { jrc: 9.0, jcs: 80e6, residual_friction: 28.0, tension: 0.0, tan_dilation: 0.0 };
    for stress in [0.5e6, 2e6, 10e6] {
        let exact = stress * tan(28.0 + 9.0 * (80e6_f64 / stress).log10());
        assert!((law.peak(-stress) / exact - 1.0).abs() < 1e-14);
        assert!((law.residual(-stress) / (stress * tan(28.0)) - 1.0).abs() < 1e-14);
    }
    assert!((law.peak(-1.0) / tan(70.0) - 1.0).abs() < 1e-14, "no steeper than 70°");
    assert!((law.peak(-500e6) / (500e6 * tan(28.0)) - 1.0).abs() < 1e-14, "no roughness left");
    assert_eq!(law.peak(0.0), 0.0);
}

/// A mass falls on a face and bounces off. Averaged over the possible phases of the steps it
/// neither gains nor loses energy, and the scatter fades with the step.
#[test]
fn bouncing_mass_keeps_energy_on_average() {
    let law = MohrCoulomb::default();
    let omega = STIFFNESS.normal.sqrt();
    for (step, most, mean) in [(0.3, 1e-2, 3e-3), (0.1, 2e-4, 5e-5)] {
        let (time_step, bounces) = (step / omega, 200);
        let (mut sum, mut worst) = (0.0, 0.0_f64);
        for phase in 0..bounces {
            let (mut v, mut gap) =
                (-1.0, time_step * (1.0 + f64::from(phase) / f64::from(bounces)));
            let mut state =
                PointState { damage: 1.0, gap: gap + time_step, ..PointState::default() };
            let mut loss = 0.0;
            while gap <= 3.0 * time_step {
                loss += respond(&law, STIFFNESS, at(gap, 0.0), &mut state).contact;
                v -= time_step * state.traction.normal;
                gap += time_step * v;
            }
            let gain = v * v - 1.0;
            assert!((gain + 2.0 * loss).abs() < 1e-12, "booked: {gain} {loss}");
            (sum, worst) = (sum + gain / f64::from(bounces), worst.max(gain.abs()));
        }
        assert!(sum.abs() < mean && worst < most, "{sum} {worst}");
    }
}

/// A mass that bounces on a face never returns faster than it came, for any step. With short steps
/// it loses almost nothing.
#[test]
fn bouncing_mass_never_gains_speed() {
    let law = MohrCoulomb::default();
    let omega = STIFFNESS.normal.sqrt();
    for (step, most) in [(1.8, 1.0), (1.0, 0.5), (0.3, 0.02), (0.03, 1e-4)] {
        let (time_step, bounces) = (step / omega, 100);
        for phase in 0..bounces {
            let springs = PointSprings::new(STIFFNESS, 0.0, Some(time_step));
            let part = f64::from(phase) / f64::from(bounces);
            let (mut v, mut gap) = (-1.0, time_step * (1.0 + part));
            let mut state =
                PointState { damage: 1.0, gap: gap + time_step, ..PointState::default() };
            for _ in 0..(20.0 + 5.0 / step) as usize {
                springs.update(&law, at(gap, 0.0), &mut state);
                v -= time_step * state.total_traction().normal;
                gap += time_step * v;
            }
            assert!(gap > 0.0 && v * v < 1.0 + 1e-12, "{step} {phase}: {v}");
            assert!(v * v > 1.0 - most, "{step} {phase}: {v}");
        }
    }
}

/// A dashpot takes energy on the way in and on the way out. It returns at most what it took before,
/// and the balance of the bouncing mass includes all of it.
#[test]
fn dashpot_returns_no_more_than_it_took() {
    let law = MohrCoulomb::default();
    let omega = STIFFNESS.normal.sqrt();
    for (step, ratio) in [(1.0, 0.2), (0.3, 0.2), (0.3, 1.0), (0.03, 0.5)] {
        let time_step = step / omega;
        let springs = PointSprings::new(STIFFNESS, 2.0 * ratio * omega, Some(time_step));
        let (mut v, mut gap, mut dissipated) = (-1.0, time_step * 1.5, 0.0);
        let mut state = PointState { damage: 1.0, gap: gap + time_step, ..PointState::default() };
        for _ in 0..(20.0 + 10.0 / step) as usize {
            let damping = springs.update(&law, at(gap, 0.0), &mut state).damping;
            dissipated += damping;
            assert!(dissipated >= 0.0, "{step} {ratio}: {dissipated}");
            v -= time_step * state.total_traction().normal;
            gap += time_step * v;
        }
        // The missing energy has been taken by the dashpot or is still its energy excess.
        let left = 0.5 * v * v + dissipated + state.energy_excess;
        assert!(gap > 0.0 && (left - 0.5).abs() < 1e-12, "{step} {ratio}: {left} {gap}");
    }
}

/// In relaxation the result is that of the direct path from the last equilibrium, however far the
/// motion overshot. (Only faces that parted on the way have lost their residual cohesion.)
#[test]
fn relaxation_forgets_overshoot() {
    for law in [coulomb(None), coulomb(Some([800.0, 5000.0]))] {
        let law = MohrCoulomb { residual_cohesion: 0.0, ..law };
        let bonded = PointState::default();
        let slides = PointState { damage: 1.0, gap: -1e-3, ..PointState::default() };
        for mut equilibrium in [bonded, slides] {
            equilibrium.set_equilibrium();
            // The gap includes the dilation one step later; the remaining error falls to about a
            // quarter in each step.
            let there = [at(-1e-3, 3e-3); 60];
            let astray = [at(-0.5e-3, 9e-3), at(2e-3, 1e-3), at(-2e-3, -4e-3)];
            let (straight, _) = lead(&law, there.into_iter(), equilibrium);
            let (back, _) = lead(&law, astray.into_iter().chain(there), equilibrium);
            let off = (straight.traction.shear - back.traction.shear).norm();
            assert!(off < 1e-12 * straight.traction.shear.norm(), "{straight:?} {back:?}");
            assert!((straight.traction.normal / back.traction.normal - 1.0).abs() < 1e-12);
            assert!((straight.slip - back.slip).norm() <= 1e-12 * straight.slip.norm());
            assert!((straight.damage - back.damage).abs() < 1e-12);
            assert!((straight.dilation - back.dilation).abs() <= 1e-12 * straight.dilation);
        }
    }
}

/// A point that was open sticks where it closes on the path, not at its old position.
#[test]
fn open_point_sticks_where_it_closes() {
    let law =
        MohrCoulomb { tan_friction: 9.0, tan_residual_friction: 9.0, ..MohrCoulomb::default() };
    let mut state = PointState { damage: 1.0, gap: 1e-3, ..PointState::default() };
    state.set_equilibrium();
    respond(&law, STIFFNESS, at(-1e-3, 4e-4), &mut state);
    let half = STIFFNESS.shear * 2e-4;
    assert!((state.traction.shear.norm() / half - 1.0).abs() < 1e-12, "{state:?}");
}

/// Squares of displacement increments may underflow where cubes touch exactly.
#[test]
fn tiny_increments_keep_tractions_finite() {
    let springs = PointSprings::new(STIFFNESS, 0.0, Some(1e-4));
    let mut state = PointState { damage: 1.0, ..PointState::default() };
    for gap in [-3e-170, -2e-170, -1e-170] {
        springs.update(&coulomb(None), at(gap, 0.0), &mut state);
        assert!(state.total_traction().normal.is_finite());
    }
}
