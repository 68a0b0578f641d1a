//! Points with areas over a part of two quadrilaterals, which integrate the shape functions of both.
//!
//! A uniform traction on such points gives the nodes of both sides exactly the forces of a uniform
//! stress. The areas $a$ of a rule that is nearly right become $a (1 + C^T λ)$, with the shape functions
//! $C$ of both sides: the least relative change after which $C a$ are their integrals.

use nalgebra::{SMatrix, SVector};

use super::overlap::{Point, Vertex, bilinear, weights};

type Quad = [Point; 4];
type Shapes = SVector<f64, 8>;

/// Point over both quadrilaterals.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct OverlapPoint {
    /// Position in the plane `[m]`.
    pub at: Point,
    /// Bilinear coordinates in each quadrilateral.
    pub on: [Point; 2],
    /// Share of the area `[m²]`.
    pub area: f64,
}

/// Bounds of the factors of the areas of a rule.
const FACTORS: [f64; 2] = [0.2, 5.0];
/// Largest error of an integral relative to the area: corners may lie outside of a quadrilateral by the
/// tolerance with which it is cut.
const EXACT: f64 = 1e-9;
/// Eigenvalue relative to the largest below which an equation follows from others: both sides have the
/// same area and centre.
const DEPENDENT: f64 = 1e-10;
/// Points of Gauss's rule on [−1, 1] above 0, and their weights.
const GAUSS: [Point; 4] = [
    [0.183_434_642_495_649_8, 0.362_683_783_378_362],
    [0.525_532_409_916_329, 0.313_706_645_877_887_27],
    [0.796_666_477_413_626_7, 0.222_381_034_453_374_48],
    [0.960_289_856_497_536_3, 0.101_228_536_290_376_26],
];

/// Points of a convex part of two quadrilaterals, its corners first. `on` of the corners are their
/// coordinates in the first one. The fewest points are taken that have positive areas.
pub fn exact_areas(corners: &[Vertex], quads: [&Quad; 2]) -> Vec<OverlapPoint> {
    let corners: Vec<OverlapPoint> = corners
        .iter()
        .map(|corner| OverlapPoint {
            at: corner.at,
            on: [corner.on, inside(quads[1], corner.at)],
            area: 0.0,
        })
        .collect();
    let fan = Fan::new(corners, quads);
    let exact = fan.integrals(quads);
    let rules = [Fan::corners_and_centre, Fan::with_middles, Fan::refined];
    // A triangle has more integrals than the first rule has points.
    let first = usize::from(fan.corners.len() == 3);
    let fitted = rules[first..].iter().find_map(|rule| fit(rule(&fan, quads), &exact));
    fitted.unwrap_or_else(|| fan.refined(quads))
}

/// Bilinear coordinates of a point of a quadrilateral.
fn inside(quad: &Quad, at: Point) -> Point {
    bilinear(quad, at).map(|x| x.clamp(0.0, 1.0))
}

fn shapes(on: [Point; 2]) -> Shapes {
    let [a, b] = on.map(weights);
    Shapes::from_fn(|k, _| if k < 4 { a[k] } else { b[k - 4] })
}

/// Points with areas so that their sums are the exact integrals; `None` if an area would change too
/// much or an integral is missed.
fn fit(mut points: Vec<OverlapPoint>, exact: &Shapes) -> Option<Vec<OverlapPoint>> {
    let area: f64 = exact.rows(0, 4).sum();
    let rule: Vec<f64> = points.iter().map(|point| point.area).collect();
    let all: Vec<Shapes> = points.iter().map(|point| shapes(point.on)).collect();
    let mut products = SMatrix::<f64, 8, 8>::zeros();
    all.iter().zip(&rule).for_each(|(c, a)| products += *a * c * c.transpose());
    let eigen = products.symmetric_eigen();
    let least = DEPENDENT * eigen.eigenvalues.amax();
    let inverse = eigen.eigenvalues.map(|value| if value > least { 1.0 / value } else { 0.0 });
    let missing = |points: &[OverlapPoint]| -> Shapes {
        all.iter().zip(points).fold(*exact, |rest, (c, point)| rest - c * point.area)
    };
    // The second turn removes the rounding of the first.
    for _ in 0..2 {
        let along = eigen.eigenvectors.tr_mul(&missing(&points));
        let multipliers = eigen.eigenvectors * along.component_mul(&inverse);
        for ((point, c), a) in points.iter_mut().zip(&all).zip(&rule) {
            point.area += a * c.dot(&multipliers);
        }
    }
    let within =
        |(point, a): (&OverlapPoint, &f64)| (FACTORS[0] * a..=FACTORS[1] * a).contains(&point.area);
    let is_exact = missing(&points).amax() <= EXACT * area;
    (is_exact && points.iter().zip(&rule).all(within)).then_some(points)
}

/// Part of both quadrilaterals, divided into a triangle for each side.
struct Fan {
    corners: Vec<OverlapPoint>,
    centre: OverlapPoint,
    /// Areas of the triangles of the centre, a corner and the next one `[m²]`.
    areas: Vec<f64>,
}

impl Fan {
    fn new(corners: Vec<OverlapPoint>, quads: [&Quad; 2]) -> Self {
        let n = corners.len() as f64;
        let mean = [0, 1].map(|k| corners.iter().map(|corner| corner.at[k]).sum::<f64>() / n);
        let about = |at: Point| [at[0] - mean[0], at[1] - mean[1]];
        let next = |k: usize| corners[(k + 1) % corners.len()].at;
        let (mut moment, mut sum) = ([0.0; 2], 0.0);
        for (k, corner) in corners.iter().enumerate() {
            let (a, b) = (about(corner.at), about(next(k)));
            let area = 0.5 * (a[0] * b[1] - a[1] * b[0]);
            (0..2).for_each(|c| moment[c] += area * (a[c] + b[c]) / 3.0);
            sum += area;
        }
        let offset = moment.map(|part| if sum == 0.0 { 0.0 } else { part / sum });
        let centre = point_at(quads, [mean[0] + offset[0], mean[1] + offset[1]]);
        let areas = corners.iter().enumerate().map(|(k, corner)| {
            let [a, b] = [corner.at, next(k)].map(|at| [0, 1].map(|c| at[c] - centre.at[c]));
            0.5 * (a[0] * b[1] - a[1] * b[0]).abs()
        });
        let areas = areas.collect();
        Self { corners, centre, areas }
    }

    /// Integrals of the shape functions of both quadrilaterals `[m²]`.
    fn integrals(&self, quads: [&Quad; 2]) -> Shapes {
        let corners = |k: usize| self.corners.iter().map(move |corner| (corner.at, corner.on[k]));
        let [a, b] = [0, 1].map(|k| integrals(corners(k), quads[k]));
        Shapes::from_fn(|k, _| if k < 4 { a[k] } else { b[k - 4] })
    }

    /// Centre, corner and next corner of each triangle, and its area.
    fn triangles(&self) -> impl Iterator<Item = ([Point; 3], f64)> {
        let n = self.corners.len();
        let each = move |(k, &area): (usize, &f64)| {
            ([self.centre.at, self.corners[k].at, self.corners[(k + 1) % n].at], area)
        };
        self.areas.iter().enumerate().map(each)
    }

    /// Corners with a part of the areas of the two triangles at each, and points with a part of their
    /// area inside.
    fn points(
        &self,
        at_corner: f64,
        inner: impl Iterator<Item = OverlapPoint>,
    ) -> Vec<OverlapPoint> {
        let n = self.corners.len();
        let corner = |k: usize| OverlapPoint {
            area: at_corner * (self.areas[k] + self.areas[(k + n - 1) % n]),
            ..self.corners[k]
        };
        (0..n).map(corner).chain(inner).collect()
    }

    fn sum(&self) -> f64 {
        self.areas.iter().sum()
    }

    /// Rule that is exact for quadratic functions in a parallelogram.
    fn corners_and_centre(&self, _: [&Quad; 2]) -> Vec<OverlapPoint> {
        let centre = OverlapPoint { area: self.sum() * 2.0 / 3.0, ..self.centre };
        self.points(1.0 / 6.0, [centre].into_iter())
    }

    /// Rule with the middles of the sides, Simpson's in a parallelogram.
    fn with_middles(&self, quads: [&Quad; 2]) -> Vec<OverlapPoint> {
        let centre = OverlapPoint { area: self.sum() * 4.0 / 9.0, ..self.centre };
        let middles = self.triangles().map(|(triangle, area)| OverlapPoint {
            area: area * 4.0 / 9.0,
            ..point_at(quads, mixed(&triangle, [0.0, 0.5, 0.5]))
        });
        self.points(1.0 / 18.0, [centre].into_iter().chain(middles))
    }

    /// Rule that is exact for cubic functions in each triangle.
    fn refined(&self, quads: [&Quad; 2]) -> Vec<OverlapPoint> {
        let centre = OverlapPoint { area: self.sum() / 20.0, ..self.centre };
        let n = self.corners.len();
        let inner = self.triangles().enumerate().flat_map(|(k, (triangle, area))| {
            let point = |part: [f64; 3], area: f64| OverlapPoint {
                area,
                ..point_at(quads, mixed(&triangle, part))
            };
            // The middle between the centre and a corner belongs to two triangles.
            let both = area + self.areas[(k + n - 1) % n];
            [
                point([0.0, 0.5, 0.5], area * 2.0 / 15.0),
                point([0.5, 0.5, 0.0], both * 2.0 / 15.0),
                point([1.0 / 3.0; 3], area * 9.0 / 20.0),
            ]
        });
        self.points(1.0 / 20.0, [centre].into_iter().chain(inner))
    }
}

/// Integrals of the shape functions of a quadrilateral over a polygon inside `[m²]`: by Green's theorem
/// in the coordinates ξ and η. A side of the polygon is a hyperbola there, A + B ξ + C η + D ξ η = 0.
fn integrals(corners: impl Iterator<Item = (Point, Point)> + Clone, quad: &Quad) -> [f64; 4] {
    let [a, b, c, d] = *quad;
    let minus = |a: Point, b: Point| [a[0] - b[0], a[1] - b[1]];
    let cross = |a: Point, b: Point| a[0] * b[1] - a[1] * b[0];
    // x = a + e ξ + f η + g ξ η
    let (e, f) = (minus(b, a), minus(d, a));
    let g = minus(minus(c, b), f);
    let [j0, j1, j2] = [cross(e, f), cross(e, g), cross(g, f)];
    let mut sums = [0.0; 4];
    let sides = corners.clone().zip(corners.clone().skip(1).chain(corners.take(1)));
    for ((from, on), (to, end)) in sides {
        let side = minus(to, from);
        let [a0, b0, c0, d0] = [minus(a, from), e, f, g].map(|of| cross(side, of));
        let [dx, dy] = minus(end, on);
        for [part, weight] in gauss() {
            // Along the coordinate that changes more.
            let (x, y, dy) = if dy.abs() >= dx.abs() {
                let y = on[1] + part * dy;
                (-(a0 + c0 * y) / (b0 + d0 * y), y, dy)
            } else {
                let x = on[0] + part * dx;
                let below = c0 + d0 * x;
                (x, -(a0 + b0 * x) / below, (a0 * d0 - b0 * c0) / (below * below) * dx)
            };
            // Integrals of J and ξ J along ξ.
            let one = x * (j0 + j1 * x / 2.0 + j2 * y);
            let first = x * x * (j0 / 2.0 + j1 * x / 3.0 + j2 * y / 2.0);
            for (sum, value) in sums.iter_mut().zip([one, first, y * one, y * first]) {
                *sum += weight * dy * value;
            }
        }
    }
    // Of 1, ξ, η and ξ η. The polygon may run either way around.
    let [one, x, y, xy] = sums.map(|sum| sum * sums[0].signum());
    [one - x - y + xy, x - xy, xy, y - xy]
}

/// Points from 0 to 1 and weights: Gauss's rule with eight points, in each half.
fn gauss() -> impl Iterator<Item = Point> {
    let half = GAUSS.iter().flat_map(|&[x, w]| [[-x, w], [x, w]]);
    half.flat_map(|[x, w]| [0.25, 0.75].map(|middle| [middle + 0.25 * x, 0.25 * w]))
}

/// Point of a triangle at barycentric coordinates.
fn mixed(triangle: &[Point; 3], part: [f64; 3]) -> Point {
    [0, 1].map(|c| (0..3).map(|k| part[k] * triangle[k][c]).sum())
}

fn point_at(quads: [&Quad; 2], at: Point) -> OverlapPoint {
    OverlapPoint { at, on: quads.map(|quad| inside(quad, at)), area: 0.0 }
}

#[cfg(test)]
mod tests {
    use super::super::overlap::overlap;
    use super::*;

    /// Pseudo-random numbers in [0, 1).
    fn numbers() -> impl FnMut() -> f64 {
        let mut state = 1_u64;
        move || {
            state =
                state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963);
            (state >> 11) as f64 / (1_u64 << 53) as f64
        }
    }

    /// Quadrilateral whose corners deviate by at most `part` of its size from those of a square.
    fn kite(next: &mut impl FnMut() -> f64, part: f64) -> Quad {
        let place = [next(), next()];
        [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]
            .map(|at| [0, 1].map(|c| at[c] + place[c] * 0.5 + part * (next() - 0.5)))
    }

    /// Part of a random triangle at one of its corners, as faces of cells are divided.
    fn part_of_triangle(next: &mut impl FnMut() -> f64) -> Quad {
        let [a, b, c] = [0; 3].map(|_| [next(), next()]);
        let mean =
            |of: &[Point]| [0, 1].map(|k| of.iter().map(|x| x[k]).sum::<f64>() / of.len() as f64);
        [a, mean(&[a, b]), mean(&[a, b, c]), mean(&[a, c])]
    }

    #[test]
    fn sums_are_the_areas_of_a_whole_quadrilateral() {
        let mut next = numbers();
        for _ in 0..200 {
            let quad = kite(&mut next, 0.4);
            let parts = overlap(&quad, &quad);
            let points = exact_areas(parts.as_slice(), [&quad, &quad]);
            // Two Gauss points along each side integrate the bilinear functions exactly.
            let g = 0.5 / 3.0_f64.sqrt();
            let mut exact = [0.0; 4];
            for on in
                [[0.5 - g, 0.5 - g], [0.5 + g, 0.5 - g], [0.5 + g, 0.5 + g], [0.5 - g, 0.5 + g]]
            {
                let along = |k: usize, [a, b]: [usize; 2], [c, d]: [usize; 2], at: f64| {
                    (quad[b][k] - quad[a][k]) * (1.0 - at) + (quad[d][k] - quad[c][k]) * at
                };
                let x = [0, 1].map(|k| along(k, [0, 1], [3, 2], on[1]));
                let y = [0, 1].map(|k| along(k, [0, 3], [1, 2], on[0]));
                let area = 0.25 * (x[0] * y[1] - x[1] * y[0]);
                weights(on).iter().zip(&mut exact).for_each(|(n, sum)| *sum += n * area);
            }
            for side in 0..2 {
                let sum = |node: usize| -> f64 {
                    points.iter().map(|point| weights(point.on[side])[node] * point.area).sum()
                };
                for (node, exact) in exact.iter().enumerate() {
                    assert!((sum(node) - exact).abs() < 1e-13, "{node}: {} {exact}", sum(node));
                }
            }
        }
    }

    #[test]
    fn few_points_with_positive_areas_are_exact_on_parts() {
        let mut next = numbers();
        let (mut all, mut corners) = (0, 0);
        for turn in 0..1000 {
            let quads = [0; 2].map(|_| match turn % 2 {
                0 => kite(&mut next, 0.4),
                _ => part_of_triangle(&mut next),
            });
            let part = overlap(&quads[0], &quads[1]);
            if part.as_slice().len() < 3 {
                continue;
            }
            let both = [&quads[0], &quads[1]];
            let points = exact_areas(part.as_slice(), both);
            let fan = Fan::new(points[..part.as_slice().len()].to_vec(), both);
            let exact = fan.integrals(both);
            let rest = points.iter().fold(exact, |rest, p| rest - shapes(p.on) * p.area);
            assert!(rest.amax() < 1e-9 * fan.sum(), "{turn} {rest} {quads:?} {points:?}");
            assert!(points.iter().all(|point| point.area > 0.0), "{points:?}");
            (all, corners) = (all + points.len(), corners + part.as_slice().len());
        }
        // Most have their corners and their centre.
        assert!(all < 2 * corners, "{all} {corners}");
    }
}
