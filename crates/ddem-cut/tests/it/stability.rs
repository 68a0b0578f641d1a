//! Block theory: wedges in closed form, and random blocks against all directions.

use ddem_cut::{Compass, FirstMotion, JointFace, RandomStream, merged_faces};
use nalgebra::Vector3;
use proptest::prelude::*;

use crate::shared::{any_vector, vector};
use crate::wedges::{WedgePlanes, wedge};

fn face(normal: Vector3<f64>, area: f64, cohesion: f64, friction: f64) -> JointFace {
    let tan_friction = libm::tan(friction.to_radians());
    JointFace { normal, area, cohesion, tan_friction }
}

/// Motion of a wedge of 2600 kg/m³, its factors of safety for friction alone and with a cohesion,
/// plunge and trend `[degrees]`, and normal forces relative to the weight.
struct WedgeResult {
    factors: [f64; 2],
    plunge: f64,
    trend: f64,
    pressed: [f64; 2],
}

fn slide(orientations: WedgePlanes, height: f64, cohesion: f64) -> WedgeResult {
    let (volume, areas) = wedge(orientations, height);
    let normals = orientations.map(|[dip, direction]| Compass::default().normal(dip, direction));
    let faces =
        |cohesion: f64| [0, 1].map(|side| face(-normals[side], areas[side], cohesion, 30.0));
    let weight = volume * 2600.0 * 9.81;
    let motion = FirstMotion::new(&(-Vector3::z() * weight), &faces(0.0)).unwrap();
    let [Some((0, a)), Some((1, b))] = motion.on else { panic!("{motion:?}") };
    let [plunge, trend] = Compass::default().plunge_trend(&motion.direction);
    let factors = [0.0, cohesion].map(|cohesion| motion.factor(&faces(cohesion)));
    WedgeResult { factors, plunge, trend, pressed: [a / weight, b / weight] }
}

/// Values of an independent vector solution, with as many digits as it has.
#[test]
fn wedges_slide_as_in_closed_form() {
    let ten = slide([[40.0, 130.0], [60.0, 220.0], [70.0, 156.0]], 10.0, 20e3);
    for (found, exact) in [
        (ten.plunge, 37.058_30),
        (ten.trend, 155.848_07),
        (ten.pressed[0], 0.673_312),
        (ten.pressed[1], 0.242_106),
        (ten.factors[0], 0.877_022),
        (ten.factors[1], 1.651_201),
    ] {
        assert!((found - exact).abs() < 5.1e-6, "{found} instead of {exact}");
    }
    let critical = 30_f64.to_radians().tan() / ten.factors[0];
    assert!((critical.atan().to_degrees() - 33.357_22).abs() < 5.1e-6);
    let thirty = slide([[45.0, 105.0], [70.0, 235.0], [65.0, 185.0]], 30.0, 50e3);
    assert!((thirty.plunge - 31.196_51).abs() < 5.1e-6, "{}", thirty.plunge);
    assert!((thirty.factors[1] - 2.486_595).abs() < 1e-6, "{}", thirty.factors[1]);
}

/// Three planes that dip at 60° around an edge of rock above: without them the block falls.
#[test]
fn blocks_fall_slide_or_stay() {
    let down = -Vector3::z() * 1e4;
    let roof = [30.0, 150.0, 270.0].map(|direction| {
        // The outward normals of a wedge in the roof point up.
        face(Compass::default().normal(60.0, direction), 1.0, 1e5, 30.0)
    });
    let falls = FirstMotion::new(&down, &roof).unwrap();
    assert_eq!((falls.on, falls.factor(&roof)), ([None, None], 0.0));
    assert!((falls.direction + Vector3::z()).norm() < 1e-15);
    // In the floor they hold it.
    let floor = roof.map(|of| JointFace { normal: -of.normal, ..of });
    assert_eq!(FirstMotion::new(&down, &floor), None);
    // On a plane of 50°: F = c A / (W sin 50°) + tan φ / tan 50°.
    let plane = [face(-Compass::default().normal(50.0, 90.0), 2.0, 1e3, 20.0)];
    let slides = FirstMotion::new(&down, &plane).unwrap();
    let dip = 50_f64.to_radians();
    let exact = 2e3 / (1e4 * libm::sin(dip)) + libm::tan(20_f64.to_radians()) / libm::tan(dip);
    assert!((slides.factor(&plane) - exact).abs() < 1e-14);
    let [plunge, trend] = Compass::default().plunge_trend(&slides.direction);
    assert!((plunge - 50.0).abs() < 1e-12 && (trend - 90.0).abs() < 1e-12);
    // Level ground holds, and so does a block without weight.
    assert_eq!(FirstMotion::new(&down, &[face(-Vector3::z(), 1.0, 0.0, 0.0)]), None);
    assert_eq!(FirstMotion::new(&Vector3::zeros(), &plane), None);
}

#[test]
fn faces_in_one_direction_share_the_load_by_area() {
    let normal = -Compass::default().normal(40.0, 0.0);
    let faces = [
        face(normal, 1.0, 100.0, 0.0),
        face(vector([1.0, 0.0, 0.0]), 5.0, 7.0, 10.0),
        face(normal, 3.0, 0.0, 45.0),
        face(normal, 0.0, 9.0, 9.0),
    ];
    let merged = merged_faces(&faces);
    assert_eq!((merged.len(), merged[0].area, merged[0].cohesion), (2, 4.0, 25.0));
    assert!((merged[0].tan_friction - 0.75).abs() < 1e-15);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    /// No free direction goes more along the force than that of the motion, and without a motion
    /// none goes along it at all.
    #[test]
    fn the_motion_is_the_best_free_direction(seed in 0_u64..1_000_000, n in 1_usize..7) {
        let mut numbers = RandomStream::new(seed, 0);
        let faces: Vec<JointFace> =
            (0..n).map(|_| face(any_vector(&mut numbers).normalize(), 1.0, 0.0, 30.0)).collect();
        let force = any_vector(&mut numbers).normalize();
        let motion = FirstMotion::new(&force, &faces);
        let most = motion.map_or(0.0, |motion| motion.driving);
        if let Some(motion) = motion {
            prop_assert!(most > 0.0);
            for face in &faces {
                prop_assert!(motion.direction.dot(&face.normal) < 1e-8);
            }
            // The force is balanced by the pressed faces, all but the part that drives.
            let presses = motion.on.into_iter().flatten();
            let held = presses.fold(Vector3::zeros(), |sum, (k, n)| sum + faces[k].normal * n);
            prop_assert!((force - held - motion.direction * most).norm() < 1e-8);
        }
        let is_free = |s: &Vector3<f64>| faces.iter().all(|face| s.dot(&face.normal) <= 0.0);
        for _ in 0..2000 {
            let s = any_vector(&mut numbers).normalize();
            prop_assert!(!is_free(&s) || s.dot(&force) <= most + 1e-9, "{s} {motion:?}");
        }
        // Directions around the best one come nearest to it.
        let near = motion.map_or(force, |motion| motion.direction);
        for k in 0..2000 {
            let s = (near + any_vector(&mut numbers) * libm::pow(0.5, f64::from(k % 20))).normalize();
            prop_assert!(!is_free(&s) || s.dot(&force) <= most + 1e-9, "{s} {motion:?}");
        }
    }
}
