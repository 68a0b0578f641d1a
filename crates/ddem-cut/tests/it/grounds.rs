//! Cuts by grounds: simplified surfaces, columns below their pieces, and exact volumes.

use ddem_cut::{CellComplex, Ground, HeightField, PlaneSource, RandomStream};
use nalgebra::Vector3;

use crate::shared::{assert_sound, brick, cut_all, plane, vector, volume};

const SIZE: f64 = 20.0;

/// Distance within which points of grounds are one `[m]`.
const SAME: f64 = 1e-6;

fn rectangle() -> [Vector3<f64>; 2] {
    [vector([0.0; 3]), vector([SIZE, SIZE, 12.0])]
}

/// Ground over a grid of `n` by `n` squares.
fn grid(n: usize, height: impl Fn(f64, f64) -> f64) -> HeightField {
    let axis: Vec<f64> = (0..=n).map(|i| SIZE * i as f64 / n as f64).collect();
    let places = axis.iter().flat_map(|&y| axis.iter().map(move |&x| (x, y)));
    let z: Vec<f64> = places.map(|(x, y)| height(x, y)).collect();
    HeightField::of_grid([&axis, &axis], &z, 0.0, rectangle())
}

/// Valley with noise.
fn rough(n: usize, seed: u64, noise: f64) -> HeightField {
    let mut numbers = RandomStream::new(seed, 0);
    let count = (n + 1) * (n + 1);
    let all: Vec<f64> = (0..count).map(|_| noise * (2.0 * numbers.uniform() - 1.0)).collect();
    let place = |at: f64| (at / SIZE * n as f64).round() as usize;
    grid(n, |x, y| {
        let valley = 7.0 + 0.02 * (x - 10.0) * (x - 10.0) + 0.1 * y;
        valley + all[place(x) + (n + 1) * place(y)]
    })
}

/// Box with a set of joints that dips.
fn jointed() -> CellComplex {
    let mut rock = brick([0.0; 3], [SIZE, SIZE, 12.0]);
    let through = |i: i32| vector([10.0, 10.0, 6.0 + 2.5 * f64::from(i)]);
    let set: Vec<_> = (-8..9).map(|i| plane(vector([0.5, 0.2, 0.8]), through(i))).collect();
    cut_all(&mut rock, &set);
    rock
}

fn ground(field: HeightField, slack: f64) -> Ground {
    Ground::new(field, 3, true, [SAME, slack])
}

fn cut(rock: &mut CellComplex, ground: &Ground) -> usize {
    rock.cut_ground(ground, &rock.select(|_, _| true)).divisions
}

/// Cells whose centroids are below a ground.
fn below(rock: &CellComplex, ground: &Ground) -> Vec<usize> {
    let is_below = |&cell: &usize| {
        let x = rock.centroid(cell);
        x.z < ground.height(&x).unwrap()
    };
    (0..rock.cells().len()).filter(is_below).collect()
}

fn volume_below(rock: &CellComplex, ground: &Ground) -> f64 {
    below(rock, ground).into_iter().map(|cell| rock.properties(cell).volume).sum()
}

/// Volume below, number of pieces, and number of cells after the cut of one box.
fn of_box(field: &HeightField) -> (f64, usize, usize) {
    let ground = ground(field.simplified(1e-3), 1e-4);
    let mut rock = brick([0.0; 3], [SIZE, SIZE, 12.0]);
    cut(&mut rock, &ground);
    assert_sound(&rock, SIZE * SIZE * 12.0);
    (volume_below(&rock, &ground), ground.n_pieces(), rock.cells().len())
}

#[test]
fn plane_pieces_are_found_exactly() {
    let near = |(volume, pieces, cells): (f64, usize, usize), wanted: (f64, usize, usize)| {
        assert!((volume - wanted.0).abs() < 1e-9, "{volume} instead of {}", wanted.0);
        assert_eq!((pieces, cells), (wanted.1, wanted.2));
    };
    // A plane, of which the box has one section.
    near(of_box(&grid(20, |x, y| 2.0 + 0.2 * x + 0.15 * y)), (400.0 * 5.5, 1, 2));
    // Ridges along the grid and along its diagonal: two planes.
    let ridge = grid(20, |x, _| 8.0 - 0.4 * (x - 12.0).abs());
    let mean = 8.0 - 0.4 * (0.5 * (144.0 + 64.0)) / SIZE;
    near(of_box(&ridge), (400.0 * mean, 2, 4));
    let diagonal = grid(20, |x, y| 9.0 - 0.3 * (x - y).abs());
    near(of_box(&diagonal), (400.0 * (9.0 - 0.3 * SIZE / 3.0), 2, 4));
    // A pyramid over the box, and one with level ground around it.
    let pyramid = |x: f64, y: f64| (x - 10.0).abs().max((y - 10.0).abs());
    let whole = grid(20, |x, y| 11.0 - 0.5 * pyramid(x, y));
    near(of_box(&whole), (400.0 * 6.0 + 400.0 * 5.0 / 3.0, 4, 8));
    let (volume, pieces, _) = of_box(&grid(20, |x, y| 3.0 + (6.0 - pyramid(x, y)).max(0.0)));
    assert!((volume - (400.0 * 3.0 + 144.0 * 6.0 / 3.0)).abs() < 1e-9, "{volume}");
    assert_eq!(pieces, 5);
}

/// A plane ground cuts jointed rock as a plane does.
#[test]
fn plane_ground_is_a_plane() {
    let ground = ground(grid(7, |x, y| 4.0 + 0.1 * x + 0.2 * y).simplified(0.1), 0.02);
    let (mut rock, mut other) = (jointed(), jointed());
    let divisions = cut(&mut rock, &ground);
    let flat = plane(vector([-0.1, -0.2, 1.0]), vector([0.0, 0.0, 4.0]));
    assert_eq!(divisions, cut_all(&mut other, &[flat]));
    assert_sound(&rock, SIZE * SIZE * 12.0);
    let volumes = |rock: &CellComplex| {
        let mut all: Vec<f64> =
            (0..rock.cells().len()).map(|cell| rock.properties(cell).volume).collect();
        all.sort_by(f64::total_cmp);
        all
    };
    for (a, b) in volumes(&rock).into_iter().zip(volumes(&other)) {
        assert!((a - b).abs() < 1e-9, "{a} {b}");
    }
    let vertical = |normal: &Vector3<f64>| normal.z.abs() < 1e-9;
    let of_cut = rock.planes().iter().filter(|of| of.source == PlaneSource::Cut(3));
    assert!(of_cut.clone().count() == 1 && of_cut.clone().all(|of| !vertical(&of.normal)));
}

#[test]
fn simplified_ground_keeps_its_tolerance() {
    for (seed, noise, tolerance) in [(1, 0.05, 0.05), (2, 0.1, 0.15), (3, 0.3, 0.1), (4, 0.3, 1.0)]
    {
        let given = rough(20, seed, noise);
        let simple = given.simplified(tolerance);
        assert!(simple.triangles.len() < given.triangles.len());
        let ground = ground(simple, 0.0);
        for x in &given.points {
            let error = (ground.height(x).unwrap() - x.z).abs();
            assert!(error <= tolerance * (1.0 + 1e-9), "{error} at {x:?}");
        }
    }
}

/// Without slack the cells below have the volume below the ground; creases tie their columns.
#[test]
fn random_grounds_keep_their_volume() {
    for seed in 0..6 {
        let ground = ground(rough(12, seed, 0.3).simplified(0.1), 0.0);
        let mut rock = jointed();
        assert!(cut(&mut rock, &ground) > 50);
        assert_sound(&rock, SIZE * SIZE * 12.0);
        let (volume, exact) = (volume_below(&rock, &ground), ground.field().volume());
        assert!((volume - exact).abs() <= 1e-9 * exact, "{volume} {exact}");
        for face in rock.common_faces() {
            let plane = rock.planes()[face.plane as usize];
            assert!(face.matches || !plane.joined, "{face:?}");
            assert_eq!(plane.joined, plane.source == PlaneSource::Cut(3));
        }
        // The same bits again.
        let mut again = jointed();
        cut(&mut again, &ground);
        assert_eq!((again.points(), again.cells()), (rock.points(), rock.cells()));
    }
}

/// Share of inertia that the cells below a ground would get to be as wide as 0.4 m.
fn added(rock: &CellComplex, ground: &Ground) -> f64 {
    let sums = below(rock, ground).into_iter().map(|cell| {
        let of = rock.properties(cell);
        [of.volume, of.volume * ((0.4 / of.width).powi(2).max(1.0) - 1.0)]
    });
    let [all, added] = sums.fold([0.0; 2], |sum, of| [sum[0] + of[0], sum[1] + of[1]]);
    added / all
}

/// With slack there are fewer cells, and they get little inertia.
#[test]
fn slack_makes_fewer_cells() {
    for seed in 0..4 {
        let simple = rough(20, seed, 0.1).simplified(0.1);
        let slack = 0.04;
        let [exact, close] = [0.0, slack].map(|slack| ground(simple.clone(), slack));
        let (mut first, mut rock) = (jointed(), jointed());
        assert!(cut(&mut rock, &close) < cut(&mut first, &exact));
        assert_sound(&rock, SIZE * SIZE * 12.0);
        let off = (volume_below(&rock, &close) - close.field().volume()).abs();
        assert!(off < 0.1 * slack * SIZE * SIZE, "{off}");
        let share = added(&rock, &close);
        assert!(share < 0.01, "{share}");
    }
}

/// Numbers of the corners of triangles.
fn numbered(corners: &[[[f64; 3]; 3]]) -> (Vec<Vector3<f64>>, Vec<[u32; 3]>) {
    let points: Vec<Vector3<f64>> = corners.iter().flatten().map(|x| vector(*x)).collect();
    let mut first: Vec<Vector3<f64>> = Vec::new();
    let mut number = |x: &Vector3<f64>| {
        first.iter().position(|known| known == x).unwrap_or_else(|| {
            first.push(*x);
            first.len() - 1
        }) as u32
    };
    let numbers: Vec<u32> = points.iter().map(&mut number).collect();
    (first, numbers.chunks(3).map(|three| [three[0], three[1], three[2]]).collect())
}

#[test]
fn only_grounds_are_height_fields() {
    let field = |corners: &[[[f64; 3]; 3]]| {
        let (points, triangles) = numbered(corners);
        HeightField::new(&points, &triangles)
    };
    let [a, b, c, d] = [[0.0, 0.0, 0.0], [1.0, 0.0, 1.0], [1.0, 1.0, 0.0], [0.0, 1.0, 2.0]];
    // In any orientation; a triangle without area does not count.
    let two = field(&[[a, c, b], [a, c, d], [a, b, b]]).unwrap();
    assert_eq!(two.triangles.len(), 2);
    assert_eq!(field(&[]), None);
    // Closed, folded, upright, and one above the other.
    assert_eq!(field(&[[a, b, c], [a, c, d], [a, d, b], [b, d, c]]), None);
    assert_eq!(field(&[[a, b, c], [a, b, [0.9, 0.5, 3.0]]]), None);
    assert_eq!(field(&[[a, b, [0.5, 0.0, 4.0]]]), None);
    let high = [a, b, c].map(|[x, y, z]| [x + 0.1, y + 0.05, z + 5.0]);
    assert_eq!(field(&[[a, b, c], high]), None);
}

#[test]
fn grids_have_rims_and_gaps() {
    let (x, y) = ([1.0, 2.0, 4.0], [1.0, 3.0]);
    let z = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0];
    let field = |z: &[f64], rim: f64| {
        Ground::new(HeightField::of_grid([&x, &y], z, rim, rectangle()), 0, true, [0.0; 2])
    };
    let at = |of: &Ground, x: f64, y: f64| of.height(&vector([x, y, 0.0]));
    let exact = field(&z, 0.0);
    assert_eq!(at(&exact, 4.0, 3.0), Some(6.0));
    assert_eq!((at(&exact, 0.5, 1.0), at(&exact, 2.0, 3.1)), (None, None));
    let wide = field(&z, 0.5);
    assert_eq!((at(&wide, 0.5, 0.5), at(&wide, 4.5, 3.5)), (Some(1.0), Some(6.0)));
    let gap = field(&[1.0, 2.0, 3.0, 4.0, 5.0, f64::NAN], 0.0);
    assert_eq!((at(&gap, 1.5, 2.0).is_some(), at(&gap, 3.0, 2.0)), (true, None));
    // Squares beyond the rectangle are left out.
    let part = [vector([0.0; 3]), vector([1.5, 9.0, 0.0])];
    assert_eq!(HeightField::of_grid([&x, &y], &z, 0.0, part).triangles.len(), 2);
}

#[test]
fn uncovered_rock_is_found() {
    let rock = brick([2.0; 3], [8.0; 3]);
    let all = rock.select(|_, _| true);
    let of = |[low, high]: [f64; 2], hole: bool| {
        let axis = [low, 4.0, 6.0, high];
        let mut z = [5.0; 16];
        if hole {
            z[5] = f64::NAN;
        }
        let field = HeightField::of_grid([&axis, &axis], &z, 0.0, rectangle());
        Ground::new(field, 0, true, [0.0; 2])
    };
    assert_eq!(rock.uncovered(&of([2.0, 8.0], false), &all), None);
    assert_eq!(rock.uncovered(&of([2.0, 7.0], false), &all).map(|x| x.xy().max()), Some(8.0));
    let [x, y] = rock.uncovered(&of([2.0, 8.0], true), &all).map(|x| [x.x, x.y]).unwrap();
    assert!((2.0..=6.0).contains(&x) && (2.0..=6.0).contains(&y));
    assert_eq!(rock.uncovered(&of([2.0, 7.0], false), &[false]), None);
}

#[test]
fn parts_over_a_rectangle_have_its_sides() {
    let field = rough(9, 7, 0.4);
    let rectangle = [vector([3.3, 2.1, 0.0]), vector([11.7, 20.0, 0.0])];
    let part = field.within(rectangle);
    let area: f64 = part
        .triangles
        .iter()
        .map(|of| {
            let [a, b, c] = of.map(|corner| part.points[corner as usize].xy());
            (b - a).perp(&(c - a)) / 2.0
        })
        .sum();
    assert!((area - 8.4 * 17.9).abs() < 1e-9, "{area}");
    let whole = Ground::new(field, 0, true, [0.0; 2]);
    for x in &part.points {
        assert!((whole.height(x).unwrap() - x.z).abs() < 1e-9);
    }
    let mut rock = brick([3.3, 2.1, 0.0], [11.7, 20.0, 12.0]);
    let ground = Ground::new(part.simplified(1e-6), 0, true, [SAME, 0.0]);
    cut(&mut rock, &ground);
    assert!((volume_below(&rock, &ground) - part.volume()).abs() < 1e-9 * volume(&rock));
}
