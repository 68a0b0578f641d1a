use std::f64::consts::SQRT_2;

use super::{Point, bilinear, overlap, weights};
use crate::collide::tests::{SplitMix, close};

const SQUARE: [Point; 4] = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];

/// Convex quadrilateral of about unit size.
fn any_quad(numbers: &mut SplitMix) -> [Point; 4] {
    let (sine, cosine) = numbers.within(4.0).sin_cos();
    let (centre, aspect) = ([numbers.within(0.7), numbers.within(0.7)], 0.3 + numbers.next());
    let quad = [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]].map(|[x, y]| {
        let (x, y) = (x + numbers.within(0.12), (y + numbers.within(0.12)) * aspect);
        [centre[0] + cosine * x - sine * y, centre[1] + sine * x + cosine * y]
    });
    if numbers.next() < 0.5 { quad } else { [quad[0], quad[3], quad[2], quad[1]] }
}

fn moved(quad: &[Point; 4], by: Point) -> [Point; 4] {
    quad.map(|[x, y]| [x + by[0], y + by[1]])
}

#[test]
fn overlaps_match_hand_calculation() {
    // A square rotated by 45° gives a regular octagon.
    let diamond = [[SQRT_2, 0.0], [0.0, SQRT_2], [-SQRT_2, 0.0], [0.0, -SQRT_2]];
    let octagon = overlap(&SQUARE, &diamond);
    assert_eq!(octagon.as_slice().len(), 8);
    let area = 8.0 * (SQRT_2 - 1.0);
    assert!(close(octagon.area(), area));
    assert!(octagon.as_slice().iter().all(|vertex| close(vertex.area, area / 8.0)));

    for (by, area) in [
        ([0.0, 0.0], 4.0),
        ([1.0, 0.0], 2.0),
        ([1.5, -1.0], 0.5),
        ([1e-11, -1e-11], 4.0),
        ([2.0, 0.0], 0.0),
        ([2.0, 2.0], 0.0),
        ([0.0, 3.0], 0.0),
    ] {
        let outline = moved(&SQUARE, by);
        let reversed = [outline[3], outline[2], outline[1], outline[0]];
        for outline in [outline, reversed] {
            let part = overlap(&SQUARE, &outline);
            assert!((part.area() - area).abs() < 1e-10, "{by:?}: {part:?}");
            assert_eq!(part.as_slice().len(), if area > 0.0 { 4 } else { 0 });
            assert!(part.as_slice().iter().all(|v| (v.area - area / 4.0).abs() < 1e-10));
        }
    }

    // An outline inside the quadrilateral: its corners, and their bilinear coordinates.
    let within = overlap(&SQUARE, &[[0.0, 0.0], [0.5, 0.0], [0.5, 0.5], [0.0, 0.5]]);
    assert!(close(within.area(), 0.25));
    for vertex in within.as_slice() {
        assert!((0..2).all(|i| close(vertex.on[i], 0.5 * (vertex.at[i] + 1.0))));
    }
    // A corner that extends over the edge gives a triangle.
    let triangle = overlap(&diamond, &moved(&SQUARE, [2.0, 0.0]));
    assert!(close(triangle.area(), (SQRT_2 - 1.0).powi(2)));
    assert_eq!(triangle.as_slice().len(), 3);
}

#[test]
fn degenerate_quadrilaterals_have_no_area() {
    let line = [[-1.0, -1.0], [1.0, 1.0], [1.0, 1.0], [-1.0, -1.0]];
    for none in [[[0.1, 0.2]; 4], line, [[f64::NAN; 2]; 4], [[1e300, -1e300]; 4]] {
        assert_eq!(overlap(&none, &SQUARE).as_slice().len(), 0);
        assert_eq!(overlap(&SQUARE, &none).as_slice().len(), 0);
        let on = bilinear(&none, [0.3, 0.1]);
        assert!(on.iter().all(|x| (-0.5..=1.5).contains(x)), "{on:?}");
    }
    // A triangle is a quadrilateral with two coincident corners.
    let triangle = [[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, 1.0]];
    assert!(close(overlap(&triangle, &SQUARE).area(), 2.0));
    assert!(close(overlap(&SQUARE, &triangle).area(), 2.0));
    // Nonconvex or self-crossing quadrilaterals may give any result, but no panic and no negative
    // area.
    let mut numbers = SplitMix(3);
    for _ in 0..10_000 {
        let mut wild = || [0; 4].map(|_| [numbers.within(1.0), numbers.within(1.0)]);
        let part = overlap(&wild(), &wild());
        assert!(part.as_slice().iter().all(|v| v.area >= 0.0 && v.on.iter().all(|x| *x >= 0.0)));
    }
}

fn point(quad: &[Point; 4], on: [f64; 2]) -> Point {
    let weights = weights(on);
    [0, 1].map(|i| (0..4).map(|k| weights[k] * quad[k][i]).sum())
}

fn inside(quad: &[Point; 4], at: Point) -> bool {
    let turn = |k: usize| {
        let (p, q) = (quad[k], quad[(k + 1) % 4]);
        (q[0] - p[0]) * (at[1] - p[1]) - (q[1] - p[1]) * (at[0] - p[0])
    };
    (0..4).all(|k| turn(k) >= 0.0) || (0..4).all(|k| turn(k) <= 0.0)
}

#[test]
fn random_overlaps_are_symmetric_and_consistent() {
    let mut numbers = SplitMix(4);
    let mut counts = [0; 9];
    for case in 0..20_000 {
        let (quad, outline) = (any_quad(&mut numbers), any_quad(&mut numbers));
        let part = overlap(&quad, &outline);
        counts[part.as_slice().len()] += 1;
        assert!((part.area() - overlap(&outline, &quad).area()).abs() < 1e-9);
        for vertex in part.as_slice() {
            let at = point(&quad, vertex.on);
            assert!(
                (0..2).all(|i| (at[i] - vertex.at[i]).abs() < 1e-9),
                "{case} {vertex:?} {at:?}"
            );
            assert!(vertex.on.iter().all(|x| (0.0..=1.0).contains(x)));
        }
        if case < 40 {
            check_moments(&quad, &outline);
        }
    }
    assert!(counts[0] > 100 && counts[3..].iter().all(|&count| count > 20), "{counts:?}");
}

/// Checks area and first moments against those of a fine grid of points.
fn check_moments(quad: &[Point; 4], outline: &[Point; 4]) {
    let (n, part) = (1000, overlap(quad, outline));
    let step = 4.0 / n as f64;
    let mut exact = [0.0; 3];
    for k in 0..n * n {
        let at = [(k % n) as f64, (k / n) as f64].map(|i| (i + 0.5) * step - 2.0);
        if inside(quad, at) && inside(outline, at) {
            let moments = [1.0, at[0], at[1]];
            (0..3).for_each(|i| exact[i] += step * step * moments[i]);
        }
    }
    for (i, exact) in exact.into_iter().enumerate() {
        let sum = |at: Point| [1.0, at[0], at[1]][i];
        let sum: f64 = part.as_slice().iter().map(|v| v.area * sum(v.at)).sum();
        assert!((sum - exact).abs() < 2e-3, "{i}: {sum} {exact} {part:?}");
    }
}

/// Sums of linear functions equal those from the formulas for area and centroid of the polygon.
#[test]
fn areas_are_exact_for_linear_functions() {
    let mut numbers = SplitMix(5);
    for _ in 0..5000 {
        let part = overlap(&any_quad(&mut numbers), &any_quad(&mut numbers));
        let vertices = part.as_slice();
        let mut exact = [0.0; 3];
        for (k, v) in vertices.iter().enumerate() {
            let (p, q) = (v.at, vertices[(k + 1) % vertices.len()].at);
            let turn = p[0] * q[1] - p[1] * q[0];
            let moments = [turn / 2.0, turn * (p[0] + q[0]) / 6.0, turn * (p[1] + q[1]) / 6.0];
            (0..3).for_each(|i| exact[i] += moments[i]);
        }
        let sums = vertices.iter().fold([0.0; 3], |sums, v| {
            [sums[0] + v.area, sums[1] + v.area * v.at[0], sums[2] + v.area * v.at[1]]
        });
        let sense = f64::signum(exact[0]);
        assert!((0..3).all(|i| (sums[i] - sense * exact[i]).abs() < 1e-13), "{sums:?} {exact:?}");
    }
}

/// The area of each corner changes no faster than the outline moves, even if vertices appear,
/// vanish or merge.
#[test]
fn corner_shares_are_continuous() {
    let shares = |outline: &[Point; 4]| {
        let mut shares = [0.0; 4];
        for vertex in overlap(&SQUARE, outline).as_slice() {
            let weights = weights(vertex.on);
            (0..4).for_each(|k| shares[k] += weights[k] * vertex.area);
        }
        shares
    };
    let turned = |[x, y]: Point, angle: f64| {
        let (sine, cosine) = angle.sin_cos();
        [cosine * x - sine * y, sine * x + cosine * y]
    };
    let step = 1e-5;
    for start in [[-0.05, -0.05], [-0.05, 0.0], [1.95, 0.3], [1.95, 1.95]] {
        for turn in [0.0, 0.1, 1.0] {
            let outline = |k: usize| {
                let by = step * k as f64;
                let square = SQUARE.map(|corner| turned(corner, turn * (by - 0.05)));
                moved(&square, [start[0] + by, start[1] + 0.7 * by])
            };
            let mut last = shares(&outline(0));
            for k in 1..10_000 {
                let now = shares(&outline(k));
                assert!((0..4).all(|i| (now[i] - last[i]).abs() < 4.0 * step), "{start:?} {k}");
                last = now;
            }
        }
    }
}

#[test]
fn bilinear_coordinates_are_recovered() {
    assert_eq!(weights([0.0, 1.0]), [0.0, 0.0, 0.0, 1.0]);
    let mut numbers = SplitMix(6);
    for _ in 0..5000 {
        let quad = any_quad(&mut numbers);
        let on = [numbers.next() * 1.2 - 0.1, numbers.next() * 1.2 - 0.1];
        let found = bilinear(&quad, point(&quad, on));
        assert!((0..2).all(|i| (found[i] - on[i]).abs() < 1e-10), "{quad:?} {on:?} {found:?}");
    }
    assert_eq!(bilinear(&SQUARE, [100.0, -100.0]), [1.5, -0.5]);
    assert_eq!(bilinear(&SQUARE, [0.5, -0.5]), [0.75, 0.25]);
}
