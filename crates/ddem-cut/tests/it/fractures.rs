//! Fractures of finite size: which cells they cut, networks of discs, and bridges of rock.

use std::f64::consts::PI;
use std::time::Instant;

use ddem_cut::{
    CellComplex, Compass, DiscCount, DiscSize, Fracture, FractureNetwork, PlaneSource,
    RandomStream, TOUCHED,
};
use nalgebra::Vector3;

use crate::shared::{
    assert_all_matched, assert_sound, assert_tiles, brick, cube, cut_all, plane, vector,
};

fn disc(centre: [f64; 3], normal: [f64; 3], radius: f64) -> Fracture {
    Fracture::disc(vector(centre), vector(normal), radius, 0, false).unwrap()
}

fn cut(rock: &mut CellComplex, fractures: &[Fracture]) -> usize {
    rock.cut_fractures(fractures, rock.select(|_, _| true)).divisions
}

#[test]
fn a_disc_cuts_a_cell_whole_or_not_at_all() {
    // The section of the cube has an area of 1.
    for (share, divisions) in [(1.01, 1), (0.99, 0)] {
        let mut rock = cube(1.0);
        let radius = libm::sqrt(share * TOUCHED / PI);
        assert_eq!(cut(&mut rock, &[disc([0.5, 0.5, 0.3], [0.0, 0.0, 1.0], radius)]), divisions);
    }
    let mut rock = cube(1.0);
    // Half of the disc lies outside.
    assert_eq!(cut(&mut rock, &[disc([0.0, 0.5, 0.3], [0.0, 0.0, 2.0], 0.25)]), 1);
    assert_sound(&rock, 1.0);
    let face = rock.common_faces()[0];
    assert!(rock.covers(face.plane, &vector([0.2, 0.5, 0.3])));
    assert!(!rock.covers(face.plane, &vector([0.3, 0.5, 0.3])));
    assert_eq!(rock.fracture(face.plane).unwrap().radius, 0.25);
    let outside = [disc([3.0, 0.5, 0.3], [0.0, 0.0, 1.0], 1.0), disc([0.5; 3], [1.0; 3], 0.01)];
    assert_eq!(cut(&mut rock, &outside), 0);
}

#[test]
fn discs_end_in_the_cell_that_they_reach() {
    // Four cells in a row; the disc reaches over two of them and 0.1 into the third.
    let mut rock = brick([0.0; 3], [4.0, 1.0, 1.0]);
    let across: Vec<_> =
        [1.0, 2.0, 3.0].map(|x| plane(Vector3::x(), vector([x, 0.0, 0.0]))).to_vec();
    cut_all(&mut rock, &across);
    assert_eq!(cut(&mut rock, &[disc([0.0, 0.5, 0.5], [0.0, 0.0, 1.0], 2.1)]), 3);
    assert_sound(&rock, 4.0);
    // A face of the last cell lies against two faces.
    assert!(rock.common_faces().iter().any(|face| !face.matches));
    // The largest goes first: a small one in its plane then finds nothing to cut.
    let mut rock = cube(1.0);
    let both =
        [disc([0.5; 3], [0.0, 0.0, 1.0], 0.2), disc([0.5, 0.5, 0.5 - 1e-12], [0.0, 0.0, 1.0], 0.4)];
    assert_eq!(cut(&mut rock, &both), 1);
    assert_eq!(rock.fracture(rock.common_faces()[0].plane).unwrap().radius, 0.4);
}

#[test]
fn polygons_are_plane_and_convex() {
    let square = [[0.2, 0.2, 0.5], [0.8, 0.2, 0.5], [0.8, 0.8, 0.5], [0.2, 0.8, 0.5]].map(vector);
    let polygon = |corners: &[Vector3<f64>]| Fracture::polygon(corners, 0, false);
    let one = polygon(&square).unwrap();
    assert!(
        (one.area() - 0.36).abs() < 1e-15 && (one.radius - libm::sqrt(0.36 / PI)).abs() < 1e-15
    );
    assert!(one.contains(&vector([0.2, 0.5, 0.5])) && !one.contains(&vector([0.1, 0.5, 0.5])));
    let turned: Vec<_> = square.iter().rev().copied().collect();
    assert!(polygon(&turned).unwrap().contains(&vector([0.5; 3])));
    let mut rock = cube(1.0);
    assert_eq!(cut(&mut rock, &[one]), 1);
    let [a, b, c, d] = square;
    for (corners, message) in [
        (vec![a, b], "the outline encloses no area"),
        (vec![a, b, b + (b - a)], "the outline encloses no area"),
        (vec![a, b, c + Vector3::z() * 0.1, d], "the corners of face 0 do not lie in one plane"),
        (vec![a, b, vector([0.5, 0.4, 0.5]), c, d], "two sides of the outline cross or touch"),
    ] {
        let error = polygon(&corners).unwrap_err().to_string();
        assert!(error.starts_with(message), "{error}");
    }
}

fn network(count: DiscCount, size: DiscSize, fisher: Option<f64>) -> FractureNetwork {
    FractureNetwork { count, size, normal: Compass::default().normal(70.0, 200.0), fisher }
}

const BOX: [[f64; 3]; 2] = [[0.0, 0.0, 0.0], [10.0, 8.0, 6.0]];

/// Mean of a quantity over seeds, and its standard error.
fn over_seeds(of: impl Fn(u64) -> f64) -> (f64, f64) {
    let all: Vec<f64> = (0..32).map(of).collect();
    let mean = all.iter().sum::<f64>() / 32.0;
    let variance = all.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / 31.0;
    (mean, libm::sqrt(variance / 32.0))
}

/// The area of discs within the box is P32 times its volume on average.
#[test]
fn networks_have_their_intensity() {
    let [low, high] = BOX.map(vector);
    let sides = [0, 1, 2].map(|k| {
        let axis = Vector3::ith(k, 1.0);
        [(axis, high[k]), (-axis, -low[k])]
    });
    let sides = sides.concat();
    for size in [
        DiscSize::Constant(0.8),
        DiscSize::Power { exponent: 3.5, from: 0.5, to: 3.0 },
        DiscSize::Power { exponent: 1.0, from: 0.5, to: 1.5 },
    ] {
        let network = network(DiscCount::Intensity(0.6), size, Some(20.0));
        let (mean, error) = over_seeds(|seed| {
            let all = network.fractures([low, high], seed, 1, false);
            let area: f64 = all.iter().map(|fracture| fracture.area_within(&sides)).sum();
            area / (10.0 * 8.0 * 6.0)
        });
        assert!((mean - 0.6).abs() < 4.0 * error, "{size:?}: {mean} ± {error}");
        assert!(error < 0.03, "{size:?}: {error}");
    }
    let number = network(DiscCount::Number(17), DiscSize::Constant(3.0), None);
    let all = number.fractures([low, high], 1, 1, true);
    assert_eq!(all.len(), 17);
    assert!(all.iter().all(|of| (0..3).all(|k| low[k] <= of.centre[k] && of.centre[k] <= high[k])));
    assert!(
        all.iter().all(|of| of.plane.joined && (of.plane.normal - number.normal).norm() < 1e-15)
    );
    assert!((all[0].area() - PI * 9.0).abs() < 1e-12);
}

#[test]
fn radii_have_the_moments_of_their_power_law() {
    // ∫ r² r⁻ᵃ / ∫ r⁻ᵃ from 2 to 20, by hand.
    let (root, log) = (libm::sqrt(0.1), libm::log(10.0));
    for (exponent, exact) in [
        (3.5, 4.0 * 5.0 * (1.0 - root) / (1.0 - root.powi(5))),
        (1.0, (400.0 - 4.0) / 2.0 / log),
        (3.0, 4.0 * log * 2.0 / (1.0 - 0.01)),
        (0.0, (8000.0 - 8.0) / 3.0 / 18.0),
    ] {
        let size = DiscSize::Power { exponent, from: 2.0, to: 20.0 };
        assert!((size.mean_square() / exact - 1.0).abs() < 1e-13, "{exponent}");
        let (mean, error) = over_seeds(|seed| {
            let mut numbers = RandomStream::new(seed, 0);
            (0..2000).map(|_| size.draw(&mut numbers).powi(2)).sum::<f64>() / 2000.0
        });
        assert!((mean - exact).abs() < 4.0 * error && error < 0.03 * exact, "{exponent}: {mean}");
    }
}

#[test]
fn normals_of_networks_have_the_resultant_of_their_distribution() {
    let network = network(DiscCount::Number(500), DiscSize::Constant(1.0), Some(20.0));
    let (mean, error) = over_seeds(|seed| {
        let all = network.fractures(BOX.map(vector), seed, 0, false);
        all.iter().map(|of| of.plane.normal).sum::<Vector3<f64>>().norm() / 500.0
    });
    let exact = 1.0 / libm::tanh(20.0) - 0.05;
    // The length of a sum is longer than its part along the mean, by about 1/(2κn).
    assert!((mean - exact).abs() < 4.0 * error + 1e-4 && error < 1e-3, "{mean} {exact} {error}");
}

#[test]
fn poisson_numbers_have_their_mean_and_variance() {
    let mut numbers = RandomStream::new(3, 0);
    for expected in [0.0, 0.7, 40.0] {
        let all: Vec<f64> = (0..20_000).map(|_| numbers.poisson(expected) as f64).collect();
        let mean = all.iter().sum::<f64>() / 2e4;
        let variance = all.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / 2e4;
        assert!((mean - expected).abs() <= 4.0 * libm::sqrt(expected / 2e4), "{mean}");
        assert!((variance - expected).abs() <= 0.06 * expected, "{variance}");
    }
}

/// Ten by ten columns, cut level with a persistence of 0.7.
#[test]
fn persistence_is_the_share_of_the_cells_that_are_cut() {
    let (columns, persistence) = (100.0, 0.7);
    let spread = libm::sqrt(columns * persistence * (1.0 - persistence));
    for bridges in [false, true] {
        let (mean, _) = over_seeds(|seed| {
            let mut rock = brick([0.0; 3], [10.0, 10.0, 1.0]);
            for axis in [Vector3::x(), Vector3::y()] {
                let planes: Vec<_> = (1..10).map(|at| plane(axis, axis * f64::from(at))).collect();
                cut_all(&mut rock, &planes);
            }
            let level = plane(Vector3::z(), vector([0.0, 0.0, 0.4]));
            let (allowed, numbers) = (rock.select(|_, _| true), RandomStream::new(seed, 0));
            let count =
                rock.cut_persistent(&[level], allowed, persistence, bridges, numbers).divisions;
            assert_sound(&rock, 100.0);
            if !bridges {
                return count as f64;
            }
            assert_eq!(count, 100);
            assert_all_matched(&rock);
            let common = rock.common_faces();
            let of = |source| {
                let is = |face: &&ddem_cut::CommonFace| {
                    let plane = rock.planes()[face.plane as usize];
                    plane.source == source && plane.normal.z == 1.0
                };
                common.iter().filter(is).count()
            };
            assert_eq!(of(PlaneSource::Cut(0)) + of(PlaneSource::Bridge(0)), 100);
            assert_eq!(rock.cuts_of(0).first(), Some(&0));
            of(PlaneSource::Cut(0)) as f64
        });
        assert!((mean - 70.0).abs() < 4.0 * spread / libm::sqrt(32.0), "{bridges}: {mean}");
    }
}

#[test]
fn networks_leave_sound_cells() {
    for seed in 0..5 {
        let size = DiscSize::Power { exponent: 3.0, from: 0.5, to: 4.0 };
        let network = network(DiscCount::Intensity(1.2), size, Some(5.0));
        let mut rock = brick(BOX[0], BOX[1]);
        let divisions = cut(&mut rock, &network.fractures(BOX.map(vector), seed, 0, false));
        assert!(divisions > 100, "{divisions}");
        assert_sound(&rock, 10.0 * 8.0 * 6.0);
    }
}

#[test]
#[ignore = "fifty thousand discs, a time"]
fn fifty_thousand_discs_take_less_than_five_seconds() {
    let mut rock = cube(100.0);
    let bounds = [[0.0; 3], [100.0; 3]].map(vector);
    let size = DiscSize::Power { exponent: 4.0, from: 1.0, to: 30.0 };
    let network = network(DiscCount::Number(50_000), size, Some(5.0));
    let start = Instant::now();
    let divisions = cut(&mut rock, &network.fractures(bounds, 1, 0, false));
    let time = start.elapsed().as_secs_f64();
    println!("50 000 discs: {divisions} divisions in {time:.2} s");
    assert!(time < 5.0);
}

/// The edge between two triangles lies on a plane that has cut before, but for the rounding of files: each
/// triangle cuts the cell on its own side only.
#[test]
fn triangles_do_not_cut_the_cells_that_their_edges_touch() {
    let ridge = 0.5 + 3e-8;
    let corner = |x: f64, y: f64, z: f64| vector([x, y, z]);
    let side = |foot: f64, y: [f64; 2]| {
        let [a, b] = y;
        let corners = [
            [corner(foot, a, 0.3), corner(ridge, a, 0.7), corner(ridge, b, 0.7)],
            [corner(foot, a, 0.3), corner(ridge, b, 0.7), corner(foot, b, 0.3)],
        ];
        corners.map(|three| Fracture::polygon(&three, 1, true).unwrap())
    };
    let mut rock = cube(1.0);
    cut_all(&mut rock, &[plane(vector([1.0, 0.0, 0.0]), vector([0.5; 3]))]);
    let roof = [side(-0.5, [-1.0, 2.0]), side(1.5, [-1.0, 2.0])].concat();
    let allowed = rock.select(|_, _| true);
    rock.cut_surface(&roof, allowed);
    assert_eq!(rock.cells().len(), 4);
    assert_sound(&rock, 1.0);
}

/// Triangles of one flat face, of which files round the corners, make no thin cells between their planes.
#[test]
fn triangles_nearly_in_one_plane_cut_once() {
    for (tilt, cells) in [(0.0, 2), (3.0, 2), (1000.0, 4)] {
        let mut rock = cube(1.0);
        let slope = tilt * rock.tolerance();
        let triangle = |slope: f64| {
            let corner = |x: f64, y: f64| vector([x, y, 0.4 + slope * (x - 0.5)]);
            let corners = [corner(-4.0, -4.0), corner(6.0, -4.0), corner(0.5, 8.0)];
            Fracture::polygon(&corners, 0, true).unwrap()
        };
        rock.cut_surface(&[triangle(0.0), triangle(slope)], vec![true]);
        assert_eq!(rock.cells().len(), cells, "{tilt} of the tolerance");
        let widths = (0..cells).map(|cell| rock.properties(cell).width);
        let thinnest = widths.fold(f64::INFINITY, f64::min);
        assert!(thinnest > 10.0 * rock.tolerance(), "{thinnest}");
        assert_tiles(&rock, 1.0);
    }
}
