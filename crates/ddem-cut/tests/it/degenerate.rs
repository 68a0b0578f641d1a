//! Planes through edges and vertices, exactly and nearly.

use ddem_cut::{CellComplex, CutPlane, RandomStream};
use nalgebra::Vector3;

use crate::shared::{
    any_vector, assert_all_matched, assert_sound, assert_tiles, cube, cut_all, plane, vector,
};

/// Planes of one normal at whole multiples of its length.
fn family(normal: [f64; 3], levels: std::ops::Range<i32>) -> Vec<CutPlane> {
    let normal = vector(normal);
    let square = normal.norm_squared();
    levels.map(|level| plane(normal, normal * (f64::from(level) / square))).collect()
}

/// Cube of 4 m, cut to 64 cubes.
fn lattice() -> CellComplex {
    let mut rock = cube(4.0);
    for axis in [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]] {
        cut_all(&mut rock, &family(axis, 1..4));
    }
    assert_eq!(rock.cells().len(), 64);
    rock
}

#[test]
fn planes_through_edges_halve_cubes() {
    let mut rock = lattice();
    cut_all(&mut rock, &family([1.0, 1.0, 0.0], 1..8));
    assert_eq!(rock.cells().len(), 128);
    assert!(rock.cells().iter().all(|cell| cell.faces.len() == 5));
    assert_sound(&rock, 64.0);
    assert_all_matched(&rock);
    // No plane makes a new point: it passes through those of the lattice.
    assert_eq!(rock.points().len(), 125);
}

#[test]
fn planes_through_vertices_make_tetrahedra_and_octahedra() {
    let mut rock = lattice();
    cut_all(&mut rock, &family([1.0, 1.0, 1.0], 1..12));
    assert_eq!(rock.cells().len(), 192);
    let with = |n: usize| rock.cells().iter().filter(|cell| cell.faces.len() == n).count();
    assert_eq!((with(4), with(8)), (128, 64));
    assert_sound(&rock, 64.0);
    assert_all_matched(&rock);
    assert_eq!(rock.points().len(), 125);
    for cell in 0..192 {
        let expected = if rock.cells()[cell].faces.len() == 4 { 1.0 / 6.0 } else { 2.0 / 3.0 };
        assert!((rock.properties(cell).volume - expected).abs() < 1e-14);
    }
}

#[test]
fn all_diagonal_planes_together_fit() {
    let mut rock = lattice();
    for normal in [[1.0, 1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 1.0], [1.0, 1.0, -1.0]] {
        cut_all(&mut rock, &family(normal, -4..12));
    }
    assert_sound(&rock, 64.0);
    assert_all_matched(&rock);
}

#[test]
fn noise_below_the_tolerance_changes_no_cell() {
    let mut numbers = RandomStream::new(1, 0);
    for size in [1e-13, 1e-10] {
        let mut rock = lattice();
        for (normal, levels) in [([1.0, 1.0, 0.0], 1..8), ([1.0, 1.0, 1.0], 1..12)] {
            let mut planes = family(normal, levels);
            for plane in &mut planes {
                plane.offset += size * (2.0 * numbers.uniform() - 1.0);
                let tilted = plane.normal + any_vector(&mut numbers) * (size / 10.0);
                plane.normal = tilted / tilted.norm();
            }
            cut_all(&mut rock, &planes);
        }
        let mut exact = lattice();
        cut_all(&mut exact, &family([1.0, 1.0, 0.0], 1..8));
        cut_all(&mut exact, &family([1.0, 1.0, 1.0], 1..12));
        assert_eq!(rock.cells().len(), exact.cells().len());
        assert_eq!(rock.points().len(), exact.points().len());
        assert_sound(&rock, 64.0);
        assert_all_matched(&rock);
    }
}

#[test]
fn noise_around_the_tolerance_leaves_valid_cells() {
    for seed in 0..20 {
        let mut numbers = RandomStream::new(seed, 0);
        let mut rock = lattice();
        let tolerance = rock.tolerance();
        for normal in [[1.0, 1.0, 0.0], [1.0, 1.0, 1.0], [1.0, -1.0, 0.0]] {
            let mut planes = family(normal, -4..12);
            for plane in &mut planes {
                plane.offset += 3.0 * tolerance * (2.0 * numbers.uniform() - 1.0);
                let tilted = plane.normal + any_vector(&mut numbers) * tolerance;
                plane.normal = tilted / tilted.norm();
            }
            cut_all(&mut rock, &planes);
        }
        assert!(rock.n_uncut() * 100 < rock.cells().len(), "{seed}: {}", rock.n_uncut());
        assert_tiles(&rock, 64.0);
    }
}

#[test]
fn planes_nearer_than_the_tolerance_cut_once() {
    for (apart, cells) in [(0.0, 2), (0.5, 2), (0.99, 2), (1.1, 3), (2.0, 3), (100.0, 3)] {
        for normal in [[0.0, 0.0, 1.0], [0.3, 0.2, 0.9], [1.0, 1.0, 1.0]] {
            let mut rock = cube(1.0);
            let first = plane(vector(normal), Vector3::repeat(0.5));
            let second = CutPlane { offset: first.offset + apart * rock.tolerance(), ..first };
            cut_all(&mut rock, &[first]);
            cut_all(&mut rock, &[second]);
            assert_eq!(rock.cells().len(), cells, "{apart} of the tolerance, {normal:?}");
            assert_sound(&rock, 1.0);
            assert_all_matched(&rock);
        }
    }
}

#[test]
fn eight_planes_through_a_vertex_of_the_lattice() {
    let mut numbers = RandomStream::new(5, 0);
    let planes: Vec<_> =
        (0..8).map(|_| plane(any_vector(&mut numbers), vector([2.0; 3]))).collect();
    let mut rock = cube(4.0);
    cut_all(&mut rock, &planes);
    assert_eq!(rock.cells().len(), 8 * 8 - 8 + 2);
    assert_sound(&rock, 64.0);
    assert_all_matched(&rock);
    let mut rock = lattice();
    cut_all(&mut rock, &planes);
    // Together with the three planes of the lattice through this vertex.
    let around = |cell: &ddem_cut::ConvexCell| {
        cell.vertices()
            .iter()
            .any(|&v| (rock.points()[v as usize] - vector([2.0; 3])).norm() < 1e-9)
    };
    assert_eq!(rock.cells().iter().filter(|cell| around(cell)).count(), 11 * 11 - 11 + 2);
    assert_sound(&rock, 64.0);
    assert_all_matched(&rock);
}

#[test]
fn planes_along_faces_cut_nothing() {
    let mut rock = cube(1.0);
    for axis in 0..3 {
        for at in [0.0, 1.0, 5e-8, -5e-8, 2.0] {
            let along = plane(Vector3::ith(axis, 1.0), Vector3::repeat(at));
            assert_eq!(cut_all(&mut rock, &[along]), 0);
        }
    }
    assert_eq!(rock.cells().len(), 1);
}
