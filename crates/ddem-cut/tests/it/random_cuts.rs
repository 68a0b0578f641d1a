//! Cuts by any planes, through existing points, nearly through them, and of parts of the rock.

use ddem_cut::{CellComplex, CutPlane, RandomStream};
use nalgebra::Vector3;
use proptest::prelude::*;

use crate::shared::{any_vector, assert_all_matched, assert_tiles, cube, cut_all, plane};

/// Plane with a random normal, or through one, two or three points of the rock, moved by noise.
fn any_plane(rock: &CellComplex, numbers: &mut RandomStream, noise: f64) -> Option<CutPlane> {
    let n = rock.points().len() as f64;
    let [a, b, c] = [(); 3].map(|()| rock.points()[(numbers.uniform() * n) as usize]);
    let [p, q, r] = [(); 3].map(|()| any_vector(numbers));
    let moved = a + r * noise;
    match (numbers.uniform() * 4.0) as usize {
        0 => CutPlane::new(p, q / 2.0 + Vector3::repeat(0.5), 0, false),
        1 => CutPlane::new(p, moved, 0, false),
        2 => CutPlane::through([moved, b + p * noise, q], 0, false),
        _ => CutPlane::through([moved, b + p * noise, c + q * noise], 0, false),
    }
}

/// Cuts a cube; returns the number of divisions and of cells that rounding errors kept whole.
fn check(seed: u64, noise: f64, n: usize) -> (usize, usize) {
    let mut numbers = RandomStream::new(seed, 7);
    let mut rock = cube(1.0);
    let mut divisions = 0;
    for _ in 0..n {
        if let Some(plane) = any_plane(&rock, &mut numbers, noise) {
            divisions += cut_all(&mut rock, &[plane]);
        }
    }
    assert_tiles(&rock, 1.0);
    // Only planes that miss points by about the tolerance may leave faces that no plane divides.
    assert!(rock.n_uncut() == 0 || (1e-8..1e-5).contains(&noise), "{}", rock.n_uncut());
    if rock.n_uncut() == 0 {
        assert_all_matched(&rock);
    }
    (divisions, rock.n_uncut())
}

/// Sizes of noise, on both sides of the tolerance of 1.7e-7.
const NOISE: [f64; 8] = [0.0, 1e-16, 1e-13, 1e-10, 3e-8, 1e-7, 1e-6, 1e-3];

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..Default::default() })]

    #[test]
    fn any_cuts_leave_polyhedra_that_tile_the_cube(seed: u64, noise in 0..NOISE.len(), n in 1_usize..14) {
        check(seed, NOISE[noise], n);
    }

    #[test]
    fn cuts_of_some_cells_leave_polyhedra_that_tile_the_cube(seed: u64, n in 1_usize..16) {
        let mut numbers = RandomStream::new(seed, 8);
        let mut rock = cube(1.0);
        for _ in 0..n {
            let Some(plane) = any_plane(&rock, &mut numbers, 0.0) else { continue };
            let side = any_vector(&mut numbers);
            let half = Vector3::repeat(0.5);
            let allowed = rock.select(|cell, _| side.dot(&(rock.centroid(cell) - half)) > 0.0);
            let chosen: Vec<usize> = (0..allowed.len()).filter(|&cell| !allowed[cell]).collect();
            let before: Vec<_> = chosen.iter().map(|&cell| rock.cells()[cell].clone()).collect();
            rock.cut(&[plane], allowed);
            for (cell, old) in chosen.into_iter().zip(before) {
                prop_assert_eq!(&rock.cells()[cell], &old);
            }
        }
        assert_tiles(&rock, 1.0);
    }
}

#[test]
fn a_cut_touches_only_the_cells_on_both_sides_of_its_plane() {
    let mut rock = cube(1.0);
    cut_all(&mut rock, &[plane(Vector3::x(), Vector3::repeat(0.5))]);
    let low = rock.select(|cell, _| rock.centroid(cell).x < 0.5);
    let count = rock.cut(&[plane(Vector3::z(), Vector3::repeat(0.5))], low);
    assert_eq!((count.divisions, rock.cells().len()), (1, 3));
    // The face of the whole cell meets two faces, and matches neither.
    let matches: Vec<bool> = rock.common_faces().iter().map(|face| face.matches).collect();
    assert_eq!(matches, [false, true, false]);
}

#[test]
#[ignore = "a million cuts"]
fn a_million_cuts_leave_polyhedra() {
    let (mut divisions, mut uncut, mut seed) = (0, 0, 0);
    while divisions < 1_000_000 {
        let (more, whole) = check(seed, NOISE[(seed % 8) as usize], 4 + (seed % 13) as usize);
        divisions += more;
        uncut += whole;
        seed += 1;
    }
    assert!(uncut * 5_000 < divisions, "{uncut}");
    println!("{divisions} divisions in {seed} cubes, {uncut} cells kept whole");
}
