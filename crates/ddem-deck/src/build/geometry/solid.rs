//! Test for points inside a closed surface of triangles.
//!
//! The test counts the crossings of the surface above a point along a vertical line. The point is
//! inside if the line crosses the surface more often in one direction than in the other. The
//! decision whether the line meets a triangle is made edge by edge. Two triangles with a common
//! edge make the same decision, so a line through an edge or a corner is counted once.

use crate::schema::SurfaceMesh;
use ddem_core::problem::{Vec3, bounds_of};

/// Closed surface, with its triangles sorted into columns of a grid over x and y.
#[derive(Clone, Debug)]
pub(in crate::build) struct Solid {
    points: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    /// True if all triangles are oriented to the same side.
    one_way: bool,
    bounds: [Vec3; 2],
    /// Distance within which a point counts as on the surface and so as inside `[m]`.
    clear: f64,
    columns: [usize; 2],
    /// Triangles over each column, x fastest.
    over: Vec<Vec<u32>>,
}

impl Solid {
    pub(in crate::build) fn new(mesh: &SurfaceMesh, clear: f64) -> Self {
        let points: Vec<Vec3> = mesh.points.iter().copied().map(Vec3::from).collect();
        let along = ((mesh.triangles.len() as f64).sqrt().ceil() as usize).max(1);
        let mut solid = Self {
            bounds: bounds_of(&points),
            points,
            triangles: mesh.triangles.clone(),
            one_way: mesh.is_turned_one_way(),
            clear,
            columns: [along; 2],
            over: vec![Vec::new(); along * along],
        };
        for index in 0..solid.triangles.len() {
            let [low, high] = bounds_of(&solid.corners(index));
            let from = solid.column(&low.add_scalar(-clear));
            let to = solid.column(&high.add_scalar(clear));
            for (i, j) in (from[1]..=to[1]).flat_map(|j| (from[0]..=to[0]).map(move |i| (i, j))) {
                solid.over[i + along * j].push(index as u32);
            }
        }
        solid
    }

    fn corners(&self, triangle: usize) -> [Vec3; 3] {
        self.triangles[triangle].map(|corner| self.points[corner as usize])
    }

    /// Column in which a point lies, or the nearest column.
    fn column(&self, x: &Vec3) -> [usize; 2] {
        let [low, high] = &self.bounds;
        [0, 1].map(|k| {
            let part = (x[k] - low[k]) / (high[k] - low[k]);
            // A flat surface gives NaN, which becomes column 0.
            (part * self.columns[k] as f64).clamp(0.0, self.columns[k] as f64 - 1.0) as usize
        })
    }

    /// Distance of a point from the box around the surface `[m]`, 0 inside.
    pub(super) fn outside_box(&self, x: &Vec3) -> f64 {
        let [low, high] = &self.bounds;
        (low - x).sup(&(x - high)).sup(&Vec3::zeros()).norm()
    }

    /// Corners of the box around the surface.
    pub(super) fn bounds(&self) -> [Vec3; 2] {
        self.bounds
    }

    /// True if a point is inside the surface or on it.
    pub(in crate::build) fn contains(&self, x: &Vec3) -> bool {
        if self.outside_box(x) > self.clear {
            return false;
        }
        let [i, j] = self.column(x);
        let near = &self.over[i + self.columns[0] * j];
        let on = |&index: &u32| self.is_on(index as usize, x);
        if near.iter().any(on) {
            return true;
        }
        let above: i64 = near.iter().map(|&index| self.crossed_above(index as usize, x)).sum();
        // If triangles are oriented to both sides, only odd and even counts differ reliably.
        if self.one_way { above != 0 } else { above % 2 != 0 }
    }

    fn is_on(&self, triangle: usize, x: &Vec3) -> bool {
        let corners = self.corners(triangle);
        let [low, high] = bounds_of(&corners);
        (0..3).all(|k| x[k] >= low[k] - self.clear && x[k] <= high[k] + self.clear)
            && (nearest(&corners, x) - x).norm() <= self.clear
    }

    /// 1 or −1, by the orientation of a triangle, if the vertical line upwards from a point meets
    /// it; otherwise 0.
    fn crossed_above(&self, triangle: usize, x: &Vec3) -> i64 {
        let numbers = self.triangles[triangle];
        let turns: i64 = (0..3).map(|k| self.passes(numbers[k], numbers[(k + 1) % 3], x)).sum();
        if turns == 0 {
            return 0;
        }
        let [a, b, c] = self.corners(triangle);
        let normal = (b - a).cross(&(c - a));
        let height = a.z - (normal.x * (x.x - a.x) + normal.y * (x.y - a.y)) / normal.z;
        let (least, most) = (a.z.min(b.z).min(c.z), a.z.max(b.z).max(c.z));
        // For a triangle seen edge-on from above the quotient is not a height.
        let height = if height.is_nan() { least } else { height.clamp(least, most) };
        if height > x.z { turns } else { 0 }
    }

    /// 1 or −1, by the edge's direction along y, if an edge passes a point on the side of larger x;
    /// otherwise 0. The arithmetic is the same for both directions of the edge.
    fn passes(&self, from: u32, to: u32, x: &Vec3) -> i64 {
        let (a, b) = (&self.points[from.min(to) as usize], &self.points[from.max(to) as usize]);
        let (low, high) = (a.y > x.y, b.y > x.y);
        if low == high || x.x >= a.x + (x.y - a.y) / (b.y - a.y) * (b.x - a.x) {
            return 0;
        }
        if (from < to) == high { 1 } else { -1 }
    }

    /// Enclosed volume `[m³]`; `None` if triangles are oriented to both sides.
    pub(super) fn volume(&self) -> Option<f64> {
        let origin = self.bounds[0];
        let part = |index: usize| {
            let [a, b, c] = self.corners(index).map(|corner| corner - origin);
            a.dot(&b.cross(&c))
        };
        self.one_way.then(|| (0..self.triangles.len()).map(part).sum::<f64>().abs() / 6.0)
    }
}

/// Point of a triangle that is nearest to `x` (Ericson, Real-Time Collision Detection, 5.1.5).
fn nearest([a, b, c]: &[Vec3; 3], x: &Vec3) -> Vec3 {
    let (ab, ac) = (b - a, c - a);
    let along = |corner: &Vec3| [ab.dot(&(x - corner)), ac.dot(&(x - corner))];
    let ([d1, d2], [d3, d4], [d5, d6]) = (along(a), along(b), along(c));
    if d1 <= 0.0 && d2 <= 0.0 {
        return *a;
    }
    if d3 >= 0.0 && d4 <= d3 {
        return *b;
    }
    if d6 >= 0.0 && d5 <= d6 {
        return *c;
    }
    let (va, vb, vc) = (d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2);
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return a + ab * (d1 / (d1 - d3));
    }
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return a + ac * (d2 / (d2 - d6));
    }
    let (e, f) = (d4 - d3, d5 - d6);
    if va <= 0.0 && e >= 0.0 && f >= 0.0 {
        return b + (c - b) * (e / (e + f));
    }
    a + ab * (vb / (va + vb + vc)) + ac * (vc / (va + vb + vc))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::schema::Triangles;

    /// Box of twelve triangles, counter-clockwise as seen from outside.
    fn cuboid(low: [f64; 3], high: [f64; 3]) -> Vec<[[f64; 3]; 3]> {
        let corner = |k: usize| [0, 1, 2].map(|d| if k >> d & 1 == 1 { high[d] } else { low[d] });
        let quads =
            [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let halves = |[a, b, c, d]: [usize; 4]| [[a, b, c], [a, c, d]];
        quads.into_iter().flat_map(halves).map(|three| three.map(corner)).collect()
    }

    fn solid(triangles: Vec<[[f64; 3]; 3]>) -> Solid {
        Solid::new(&Triangles(triangles).mesh(), 1e-9)
    }

    #[test]
    fn lines_through_edges_and_corners_are_counted_once() {
        // Points directly above and below corners, edges and diagonals of the faces.
        let solid = solid(cuboid([0.0; 3], [2.0; 3]));
        for i in -1..=5 {
            for j in -1..=5 {
                for k in -1..=5 {
                    let x = Vec3::new(f64::from(i), f64::from(j), f64::from(k)) * 0.5;
                    let inside = (0..3).all(|d| (0.0..=2.0).contains(&x[d]));
                    assert_eq!(solid.contains(&x), inside, "{x}");
                }
            }
        }
        assert_eq!(solid.volume(), Some(8.0));
    }

    #[test]
    fn hole_is_outside_and_bodies_may_overlap() {
        let mut hollow = cuboid([0.0; 3], [3.0; 3]);
        hollow.extend(cuboid([1.0; 3], [2.0; 3]).into_iter().map(|[a, b, c]| [a, c, b]));
        let hollow = solid(hollow);
        assert!(!hollow.contains(&Vec3::repeat(1.5)) && hollow.contains(&Vec3::repeat(0.5)));
        assert_eq!(hollow.volume(), Some(26.0));

        let mut two = cuboid([0.0; 3], [2.0; 3]);
        two.extend(cuboid([1.0; 3], [3.0; 3]));
        let two = solid(two);
        assert!([0.5, 1.5, 2.5].iter().all(|&x| two.contains(&Vec3::repeat(x))));
        assert!(!two.contains(&Vec3::new(0.5, 2.5, 1.5)));
    }

    /// Triangles with random orientations still separate inside from outside.
    #[test]
    fn triangle_orientation_does_not_matter() {
        let mut turned = cuboid([0.0; 3], [2.0; 3]);
        turned[3].swap(0, 1);
        let turned = solid(turned);
        assert!(turned.contains(&Vec3::repeat(1.0)) && !turned.contains(&Vec3::new(1.0, 1.0, 3.0)));
        assert_eq!(turned.volume(), None);
    }

    /// Compares a ball of many triangles with the equation of a sphere, except near its facets.
    #[test]
    fn triangulated_ball_matches_sphere() {
        let (n, mut triangles) = (40, Vec::new());
        let at = |i: usize, j: usize| {
            let (a, b) = (i as f64 / n as f64, (j % (2 * n)) as f64 / n as f64);
            let ((sa, ca), (sb, cb)) =
                (libm::sincos(a * std::f64::consts::PI), libm::sincos(b * std::f64::consts::PI));
            if i == 0 || i == n { [0.0, 0.0, ca.round()] } else { [sa * cb, sa * sb, ca] }
        };
        for (i, j) in (0..n).flat_map(|i| (0..2 * n).map(move |j| (i, j))) {
            triangles.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
            triangles.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
        }
        let mesh = Triangles(triangles).mesh();
        assert!(mesh.open_edges().is_empty());
        let ball = Solid::new(&mesh, 1e-9);
        let exact = 4.0 / 3.0 * std::f64::consts::PI;
        assert!((ball.volume().unwrap_or(0.0) / exact - 1.0).abs() < 5e-3);
        for k in 0..8000 {
            let x = Vec3::new((k % 20) as f64, (k / 20 % 20) as f64, (k / 400) as f64);
            let x = x.add_scalar(-9.5) / 8.0;
            if (x.norm() - 1.0).abs() > 0.01 {
                assert_eq!(ball.contains(&x), x.norm() < 1.0, "{x}");
            }
        }
    }
}
