//! Joint sets: positions, scatter and spacing of their planes.

use ddem_cut::{CellComplex, Compass, JointSet, Polyhedron, RandomStream, Spacing, expected_cells};
use nalgebra::Vector3;

use crate::shared::{assert_all_matched, assert_sound, vector};

fn set(dip: f64, direction: f64, spacing: Spacing) -> JointSet {
    let normal = Compass::default().normal(dip, direction);
    JointSet { normal, fisher: None, spacing, origin: Vector3::zeros() }
}

fn corners(size: f64) -> Vec<Vector3<f64>> {
    Polyhedron::brick(Vector3::repeat(-size), Vector3::repeat(size)).unwrap().points
}

#[test]
fn planes_dip_in_their_direction() {
    // Down the dip of 30° to the east, the plane falls by tan 30°.
    let normal = Compass::default().normal(30.0, 90.0);
    let down = vector([libm::cos(30_f64.to_radians()), 0.0, -libm::sin(30_f64.to_radians())]);
    assert!(normal.dot(&down).abs() < 1e-16 && normal.z > 0.0 && normal.x > 0.0);
    // With north along x, east is −y.
    let compass = Compass::new(Vector3::new(2.0, 0.0, 5.0)).unwrap();
    assert!((compass.normal(90.0, 90.0) + Vector3::y()).norm() < 1e-16);
    assert!((compass.normal(90.0, 0.0) - Vector3::x()).norm() < 1e-16);
    assert_eq!(Compass::new(Vector3::z()), None);
}

#[test]
fn planes_of_a_constant_spacing_pass_through_the_origin_and_its_multiples() {
    let mut set = set(0.0, 0.0, Spacing::Constant(0.75));
    set.origin = vector([5.0, 3.0, 0.25]);
    let planes = set.planes(&corners(2.0), 0, 0, false);
    let heights: Vec<f64> = planes.iter().map(|plane| plane.offset).collect();
    assert_eq!(heights, [-2.0, -1.25, -0.5, 0.25, 1.0, 1.75]);
}

/// Exponential distances: planes are at random positions. Their number in a length has the mean and
/// the variance of Poisson's law, also in the middle, at the origin.
#[test]
fn exponential_spacings_are_stationary() {
    for least in [0.0, 0.6] {
        let set = set(0.0, 0.0, Spacing::Exponential { mean: 1.5, least });
        let n = 4000;
        let count = |size: f64| {
            let of = |seed| set.planes(&corners(size), seed, 3, false).len() as f64;
            let all: Vec<f64> = (0..n).map(of).collect();
            let mean = all.iter().sum::<f64>() / n as f64;
            let variance = all.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n as f64;
            (mean, variance)
        };
        for size in [0.1, 1.0, 6.0] {
            let ((mean, variance), expected) = (count(size), 2.0 * size / 1.5);
            // No law has a wider scatter than Poisson's here.
            let error = 4.0 * (expected / n as f64).sqrt();
            assert!((mean - expected).abs() < error, "{least}, {size}: {mean} for {expected}");
            let wide = variance / expected - 1.0;
            assert!(if least > 0.0 { wide < 0.0 } else { wide.abs() < 0.1 }, "{least}: {wide}");
        }
    }
}

#[test]
fn a_far_origin_changes_nothing() {
    let at = |z: f64| {
        let mut set = set(0.0, 0.0, Spacing::Constant(0.75));
        set.origin.z = z;
        let planes = set.planes(&corners(2.0), 0, 0, false);
        let near = set.expected(&corners(2.0));
        (planes.iter().map(|plane| plane.offset).collect::<Vec<_>>(), near)
    };
    let ((near, expected), (far, same)) = (at(0.25), at(0.25 + 0.75 * 1e5));
    assert_eq!(near.len(), far.len());
    assert!(near.iter().zip(&far).all(|(a, b)| (a - b).abs() < 1e-9));
    assert!((expected - same).abs() < 1e-9 && (expected - near.len() as f64).abs() <= 1.0);
    let even = JointSet {
        spacing: Spacing::Even { mean: 0.75, spread: 0.7 },
        origin: vector([0.0, 0.0, -7.5e4]),
        ..set(0.0, 0.0, Spacing::Constant(1.0))
    };
    assert!((even.from_origin(&corners(2.0)) - 75002.0 / 0.75).abs() < 1e-6);
    let n = 400;
    let of = |seed| even.planes(&corners(2.0), seed, 0, false).len() as f64;
    let mean = (0..n).map(of).sum::<f64>() / n as f64;
    assert!((mean - 4.0 / 0.75).abs() < 0.3, "{mean}");
}

#[test]
fn planes_do_not_depend_on_the_body() {
    let mut set = set(40.0, 130.0, Spacing::Even { mean: 0.5, spread: 0.2 });
    set.fisher = Some(80.0);
    let small = set.planes(&corners(1.0), 7, 2, false);
    let large = set.planes(&corners(3.0), 7, 2, false);
    assert!(small.len() > 4 && large.len() > small.len());
    assert!(small.iter().all(|plane| large.contains(plane)));
    let others = [set.planes(&corners(1.0), 8, 2, false), set.planes(&corners(1.0), 7, 3, false)];
    assert!(
        others.iter().all(|other| other.iter().filter(|plane| small.contains(plane)).count() == 0)
    );
}

#[test]
fn fisher_normals_have_the_resultant_of_their_distribution() {
    for concentration in [2.0, 20.0, 400.0] {
        let mut numbers = RandomStream::new(4, 0);
        let mean = vector([0.6, 0.0, 0.8]);
        let n = 40_000;
        let sum = (0..n)
            .map(|_| numbers.fisher(&mean, concentration))
            .fold(Vector3::zeros(), |sum, normal| sum + normal);
        // The mean resultant is coth κ − 1/κ, its error about 1/√n of the scatter.
        let expected = 1.0 / libm::tanh(concentration) - 1.0 / concentration;
        let error = 4.0 * (1.0 - expected) / f64::from(n).sqrt();
        assert!((mean.dot(&sum) / f64::from(n) - expected).abs() < error, "{concentration}");
        let aside = (sum - mean * mean.dot(&sum)).norm() / f64::from(n);
        assert!(aside < 4.0 / (f64::from(n) * concentration).sqrt(), "{concentration}: {aside}");
    }
}

/// Mean and standard deviation of distances.
fn moments(spacing: &Spacing) -> (f64, f64, f64) {
    let mut numbers = RandomStream::new(9, 0);
    let all: Vec<f64> = (0..200_000).map(|_| spacing.draw(&mut numbers)).collect();
    let mean = all.iter().sum::<f64>() / all.len() as f64;
    let variance = all.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / all.len() as f64;
    (mean, variance.sqrt(), all.iter().copied().fold(f64::INFINITY, f64::min))
}

#[test]
fn spacings_have_the_moments_of_their_laws() {
    let root = 3.0_f64.sqrt();
    for (spacing, deviation, least) in [
        (Spacing::Constant(2.0), 0.0, 2.0),
        (Spacing::Even { mean: 2.0, spread: 0.6 }, 0.6 / root, 1.4),
        (Spacing::Exponential { mean: 2.0, least: 0.0 }, 2.0, 0.0),
        (Spacing::Exponential { mean: 2.0, least: 0.5 }, 1.5, 0.5),
        (Spacing::Lognormal { mean: 2.0, deviation: 0.8, least: 0.0 }, 0.8, 0.0),
        (Spacing::Lognormal { mean: 2.0, deviation: 0.8, least: 0.5 }, 0.8, 0.5),
    ] {
        let (mean, spread, shortest) = moments(&spacing);
        assert!((mean - 2.0).abs() < 0.015, "{spacing:?}: mean {mean}");
        assert!((spread - deviation).abs() < 0.02, "{spacing:?}: deviation {spread}");
        assert!(shortest >= least, "{spacing:?}: {shortest}");
        assert!((spacing.mean() - 2.0).abs() < 1e-15);
    }
}

#[test]
fn cells_are_expected_as_many_as_there_are() {
    let sets = [
        set(30.0, 80.0, Spacing::Constant(1.0)),
        set(70.0, 200.0, Spacing::Constant(0.9)),
        set(80.0, 320.0, Spacing::Constant(1.2)),
        set(15.0, 10.0, Spacing::Constant(1.5)),
    ];
    let body = Polyhedron::brick(Vector3::repeat(-4.0), Vector3::repeat(4.0)).unwrap();
    let expected = expected_cells(&body, &sets);
    // The mean over positions of the planes.
    let (mut total, n) = (0, 40);
    let mut numbers = RandomStream::new(2, 0);
    for _ in 0..n {
        let mut rock = CellComplex::new(&[vec![body.clone()]]);
        for set in &sets {
            let origin = set.normal * numbers.uniform() * set.spacing.mean();
            let planes = JointSet { origin, ..*set }.planes(&body.points, 0, 0, false);
            rock.cut(&planes, rock.select(|_, _| true));
        }
        total += rock.cells().len();
    }
    let mean = total as f64 / f64::from(n);
    assert!((mean / expected - 1.0).abs() < 0.02, "{mean} instead of {expected}");
}

#[test]
fn scattered_sets_leave_sound_cells() {
    let body = Polyhedron::brick(Vector3::repeat(-2.0), Vector3::repeat(2.0)).unwrap();
    for seed in 0..5 {
        let mut rock = CellComplex::new(&[vec![body.clone()]]);
        for (cut, (dip, direction)) in
            [(30.0, 80.0), (70.0, 200.0), (80.0, 320.0)].into_iter().enumerate()
        {
            let mut set = set(dip, direction, Spacing::Even { mean: 1.0, spread: 0.3 });
            set.fisher = Some(50.0);
            let planes = set.planes(&body.points, seed, cut as u32, false);
            rock.cut(&planes, rock.select(|_, _| true));
        }
        assert!(rock.cells().len() > 80, "{}", rock.cells().len());
        assert_sound(&rock, 64.0);
        assert_all_matched(&rock);
    }
}

/// Sum of the bits of all coordinates, in order.
fn fingerprint(rock: &CellComplex) -> u64 {
    rock.points()
        .iter()
        .flat_map(|x| x.iter().map(|part| part.to_bits()).collect::<Vec<_>>())
        .fold(0, |sum: u64, bits| sum.rotate_left(7) ^ bits)
}

#[test]
fn the_same_seed_gives_the_same_bits() {
    let cells = || {
        let body = Polyhedron::brick(Vector3::repeat(-2.0), Vector3::repeat(2.0)).unwrap();
        let mut set = set(30.0, 80.0, Spacing::Lognormal { mean: 0.7, deviation: 0.3, least: 0.1 });
        set.fisher = Some(30.0);
        let mut rock = CellComplex::new(&[vec![body.clone()]]);
        for cut in 0..3 {
            rock.cut(&set.planes(&body.points, 5, cut, false), rock.select(|_, _| true));
        }
        rock
    };
    let (one, other) = (cells(), std::thread::spawn(cells).join().unwrap());
    assert_eq!(fingerprint(&one), fingerprint(&other));
    assert_eq!(one.cells(), other.cells());
    assert_eq!(one.common_faces(), other.common_faces());
}

#[test]
fn random_numbers_are_those_of_chacha8() {
    // First word of the key stream of ChaCha8 for a key of zeros and stream 0, from eSTREAM.
    let mut numbers = RandomStream::new(0, 0);
    let word = u64::from_le_bytes([0x3e, 0x00, 0xef, 0x2f, 0x89, 0x5f, 0x40, 0xd6]);
    let expected = (word >> 11) as f64 / (1_u64 << 53) as f64;
    assert_eq!(numbers.uniform().to_bits(), expected.to_bits());
}
