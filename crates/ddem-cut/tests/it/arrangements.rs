//! Numbers of cells, counted from the planes alone.

use ddem_cut::{CutPlane, RandomStream};
use nalgebra::{Matrix3, Vector3};

use crate::shared::{
    any_vector, assert_all_matched, assert_sound, brick, cube, cut_all, plane, vector,
};

/// Faces of the unit cube as axes and positions.
const CUBE_FACES: [(usize, f64); 6] = [(0, 0.0), (0, 1.0), (1, 0.0), (1, 1.0), (2, 0.0), (2, 1.0)];

/// Counts of an arrangement of planes in the unit cube.
#[derive(Debug, Default, PartialEq)]
struct ArrangementCounts {
    /// Planes that meet the inside.
    planes: usize,
    /// Lines of two planes that meet the inside.
    lines: usize,
    /// Points of three planes inside.
    points: usize,
    /// Points of planes on edges of the cube.
    on_edges: usize,
}

fn inside(x: &Vector3<f64>) -> bool {
    x.iter().all(|part| (0.0..1.0).contains(part))
}

/// True if a part of the line `point + t direction` lies in the unit cube.
fn line_meets(point: &Vector3<f64>, direction: &Vector3<f64>) -> bool {
    let (mut from, mut to) = (f64::NEG_INFINITY, f64::INFINITY);
    for axis in 0..3 {
        let [a, b] = [0.0, 1.0].map(|face| (face - point[axis]) / direction[axis]);
        from = from.max(a.min(b));
        to = to.min(a.max(b));
    }
    from < to
}

fn meeting_point(planes: [&CutPlane; 3]) -> Option<Vector3<f64>> {
    let normals = Matrix3::from_rows(&planes.map(|plane| plane.normal.transpose()));
    let offsets = Vector3::from(planes.map(|plane| plane.offset));
    normals.lu().solve(&offsets)
}

fn counts(planes: &[CutPlane]) -> ArrangementCounts {
    let mut counts = ArrangementCounts::default();
    for (i, a) in planes.iter().enumerate() {
        let corners = (0..8).map(|c| Vector3::from([c & 1, c >> 1 & 1, c >> 2].map(f64::from)));
        let above = corners.filter(|corner| a.height(corner) > 0.0).count();
        counts.planes += usize::from((1..8).contains(&above));
        for &(axis, at) in &CUBE_FACES[..4] {
            for &(other, there) in CUBE_FACES.iter().filter(|face| face.0 > axis) {
                let rest = 3 - axis - other;
                let along =
                    (a.offset - a.normal[axis] * at - a.normal[other] * there) / a.normal[rest];
                counts.on_edges += usize::from((0.0..1.0).contains(&along));
            }
        }
        for (j, b) in planes.iter().enumerate().skip(i + 1) {
            let direction = a.normal.cross(&b.normal);
            let across = CutPlane::new(direction, Vector3::zeros(), 0, false).unwrap();
            let point = meeting_point([a, b, &across]).unwrap();
            counts.lines += usize::from(line_meets(&point, &direction));
            for c in &planes[j + 1..] {
                let point = meeting_point([a, b, c]);
                counts.points += usize::from(point.is_some_and(|point| inside(&point)));
            }
        }
    }
    counts
}

fn random_planes(seed: u64, n: usize) -> Vec<CutPlane> {
    let mut numbers = RandomStream::new(seed, 0);
    let mut any = || any_vector(&mut numbers);
    (0..n).map(|_| plane(any(), any() / 2.0 + Vector3::repeat(0.5))).collect()
}

fn check_random(seed: u64, n: usize) {
    let planes = random_planes(seed, n);
    let expected = counts(&planes);
    let mut rock = cube(1.0);
    cut_all(&mut rock, &planes);
    let cells = 1 + expected.planes + expected.lines + expected.points;
    assert_eq!(rock.cells().len(), cells, "seed {seed}: {expected:?}");
    let vertices: usize = rock.cells().iter().map(|cell| cell.vertices().len()).sum();
    let ArrangementCounts { lines, points, on_edges, .. } = expected;
    assert_eq!(vertices, 8 + 2 * on_edges + 8 * (lines + points), "seed {seed}");
    for cell in rock.cells() {
        assert_eq!(cell.vertices().len() + cell.faces.len(), cell.n_edges() + 2);
    }
    assert_sound(&rock, 1.0);
    assert_all_matched(&rock);
}

#[test]
fn random_planes_make_the_cells_of_their_points_and_lines() {
    for seed in 0..1000 {
        check_random(seed, 3 + (seed % 8) as usize);
    }
}

#[test]
fn thirty_random_planes_make_the_cells_of_their_points_and_lines() {
    for seed in 0..3 {
        check_random(10_000 + seed, 30);
    }
}

#[test]
fn planes_through_a_point_make_m_squared_minus_m_plus_two_cells() {
    let mut numbers = RandomStream::new(3, 1);
    for m in 1..=12 {
        let point = Vector3::new(0.41, 0.52, 0.47);
        let planes: Vec<_> = (0..m).map(|_| plane(any_vector(&mut numbers), point)).collect();
        let mut rock = cube(1.0);
        cut_all(&mut rock, &planes);
        assert_eq!(rock.cells().len(), m * m - m + 2);
        assert_sound(&rock, 1.0);
        assert_all_matched(&rock);
        // All planes meet in one point that the cells share.
        let near = |x: &&Vector3<f64>| (*x - point).norm() < 1e-12;
        assert!(m < 3 || rock.points().iter().filter(near).count() == 1);
    }
}

#[test]
fn three_sets_along_the_edges_make_a_lattice() {
    let mut rock = brick([-1.0, 2.0, 0.5], [2.0, 4.0, 4.5]);
    let counts = [4, 3, 5];
    let (from, to) = (vector([-1.0, 2.0, 0.5]), vector([2.0, 4.0, 4.5]));
    for (axis, n) in counts.into_iter().enumerate() {
        let at = |i: usize| from + (to - from) * (i as f64 / (n + 1) as f64);
        let planes: Vec<_> = (1..=n).map(|i| plane(Vector3::ith(axis, 1.0), at(i))).collect();
        cut_all(&mut rock, &planes);
    }
    assert_eq!(rock.cells().len(), 5 * 4 * 6);
    assert_sound(&rock, 24.0);
    assert_all_matched(&rock);
    assert_eq!(rock.common_faces().len(), 4 * 4 * 6 + 5 * 3 * 6 + 5 * 4 * 5);
    for cell in 0..rock.cells().len() {
        let properties = rock.properties(cell);
        assert!((properties.volume - 24.0 / 120.0).abs() < 1e-14);
        assert!((properties.width - 0.5).abs() < 1e-14);
        assert_eq!(rock.cells()[cell].faces.len(), 6);
    }
}
