//! Voronoi cells. Exact values come from distances to all seeds and from lattices of seeds.

use std::collections::BTreeSet;

use ddem_cut::{CellComplex, CutCount, RandomStream, voronoi_seeds};
use nalgebra::Vector3;

use crate::shared::{any_vector, assert_all_matched, assert_sound, cube, cut_all, plane, vector};

fn divide(rock: &mut CellComplex, seeds: &[Vector3<f64>]) -> CutCount {
    let allowed = rock.select(|_, _| true);
    rock.cut_voronoi(seeds, 3, false, &allowed)
}

fn unit_seeds(number: usize, least: f64, seed: u64) -> Vec<Vector3<f64>> {
    voronoi_seeds([Vector3::zeros(), Vector3::repeat(1.0)], number, least, seed, 0)
}

/// Asserts that all points of each cell are nearest to one seed, and returns these seeds.
fn owners(rock: &CellComplex, seeds: &[Vector3<f64>]) -> Vec<usize> {
    let nearest = |x: &Vector3<f64>| {
        let all = seeds.iter().map(|seed| (seed - x).norm()).enumerate();
        all.min_by(|a, b| a.1.total_cmp(&b.1)).unwrap()
    };
    let owner = |cell: usize| {
        let (seed, _) = nearest(&rock.centroid(cell));
        for corner in rock.cells()[cell].vertices() {
            let x = &rock.points()[corner as usize];
            let farther = (seeds[seed] - x).norm() - nearest(x).1;
            assert!(farther <= 1e-6, "cell {cell} of seed {seed}: {farther:e}");
        }
        seed
    };
    (0..rock.cells().len()).map(owner).collect()
}

#[test]
fn each_random_seed_has_one_cell() {
    for (number, seed) in [(2, 1), (9, 2), (60, 3), (700, 4)] {
        let seeds = unit_seeds(number, 0.0, seed);
        let mut rock = cube(1.0);
        let count = divide(&mut rock, &seeds);
        assert_eq!((count.divisions, count.too_many), (number - 1, false));
        assert_sound(&rock, 1.0);
        assert_all_matched(&rock);
        let owners: BTreeSet<usize> = owners(&rock, &seeds).into_iter().collect();
        assert_eq!(owners.len(), number);
        assert_eq!(rock.cells().len(), number);
    }
}

#[test]
fn cells_that_were_cut_before_have_parts_that_match() {
    let mut numbers = RandomStream::new(5, 0);
    let mut rock = cube(1.0);
    let planes: Vec<_> = (0..6)
        .map(|_| {
            plane(any_vector(&mut numbers), Vector3::repeat(0.5) + any_vector(&mut numbers) * 0.3)
        })
        .collect();
    cut_all(&mut rock, &planes);
    let before = rock.cells().len();
    let seeds = unit_seeds(80, 0.0, 6);
    divide(&mut rock, &seeds);
    assert!(rock.cells().len() > before + 80);
    assert_sound(&rock, 1.0);
    assert_all_matched(&rock);
    owners(&rock, &seeds);
    // Later planes find the new cells.
    assert!(cut_all(&mut rock, &[plane(Vector3::new(0.3, 0.5, 1.0), Vector3::repeat(0.5))]) > 20);
    assert_sound(&rock, 1.0);
    assert_all_matched(&rock);
}

#[test]
fn cells_that_are_not_allowed_stay() {
    let mut rock = cube(1.0);
    cut_all(&mut rock, &[plane(Vector3::z(), Vector3::repeat(0.5))]);
    let lower = rock.select(|cell, _| cell == 0);
    let seeds = unit_seeds(30, 0.0, 7);
    rock.cut_voronoi(&seeds, 1, false, &lower);
    assert_sound(&rock, 1.0);
    let of_half = |cell: &usize| rock.properties(*cell).volume == 0.5;
    assert_eq!((0..rock.cells().len()).filter(of_half).count(), 1);
}

#[test]
fn seeds_of_a_cubic_lattice_have_cubes() {
    let n = 5;
    let at = |i: usize| (i as f64 + 0.5) / n as f64;
    let seeds: Vec<_> =
        (0..n * n * n).map(|i| vector([at(i % n), at(i / n % n), at(i / n / n)])).collect();
    let mut rock = cube(1.0);
    divide(&mut rock, &seeds);
    assert_sound(&rock, 1.0);
    assert_all_matched(&rock);
    for (number, cell) in rock.cells().iter().enumerate() {
        assert_eq!((cell.faces.len(), cell.vertices().len()), (6, 8));
        assert!((rock.properties(number).volume - 0.008).abs() < 1e-12);
    }
}

#[test]
fn seeds_of_a_body_centred_lattice_have_truncated_octahedra() {
    let mut seeds = Vec::new();
    for i in 0..64_usize {
        let corner = vector([i % 4, i / 4 % 4, i / 16].map(|at| at as f64));
        seeds.extend([corner, corner + Vector3::repeat(0.5)]);
    }
    let mut rock = cube(3.5);
    divide(&mut rock, &seeds);
    assert_sound(&rock, 3.5_f64.powi(3));
    assert_all_matched(&rock);
    let inner: Vec<usize> = (0..rock.cells().len())
        .filter(|&cell| {
            let middle = rock.centroid(cell);
            middle.iter().all(|at| (0.9..2.6).contains(at))
        })
        .collect();
    // Two of each four corners along an axis, and two middles between them beside the rim.
    assert!(inner.len() >= 16, "{}", inner.len());
    for cell in inner {
        let own = &rock.cells()[cell];
        assert_eq!((own.faces.len(), own.vertices().len()), (14, 24));
        assert!((rock.properties(cell).volume - 0.5).abs() < 1e-12);
    }
}

#[test]
fn few_seeds_change_nothing() {
    for number in [0, 1] {
        let mut rock = cube(1.0);
        assert_eq!(divide(&mut rock, &unit_seeds(number, 0.0, 1)), CutCount::default());
        assert_eq!(rock.cells().len(), 1);
    }
}

#[test]
fn seeds_keep_their_distance() {
    let seeds = unit_seeds(100, 0.12, 8);
    assert_eq!(seeds.len(), 100);
    let pairs = seeds.iter().enumerate().flat_map(|(i, a)| seeds[..i].iter().map(move |b| (a, b)));
    assert!(pairs.map(|(a, b)| (a - b).norm()).fold(f64::INFINITY, f64::min) >= 0.12);
    // Balls of half that distance fill less than the box around them.
    assert!(unit_seeds(100_000, 0.5, 8).len() < 30);
}
