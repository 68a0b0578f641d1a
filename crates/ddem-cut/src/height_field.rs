//! Triangles of a ground, which each vertical line meets at most once.

use std::collections::{BTreeMap, HashMap};

use nalgebra::Vector3;

use crate::buckets::Buckets;

/// Distance relative to the size of a rectangle within which points lie on its sides.
const ON_SIDE: f64 = 1e-6;

/// Part of the square of the longest side of a triangle that its area has at least.
const FLAT: f64 = 1e-9;

/// Triangles of a ground, counter-clockwise seen from above. No two lie above each other.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct HeightField {
    /// Corners `[m]`.
    pub points: Vec<Vector3<f64>>,
    /// Numbers of the corners of each triangle.
    pub triangles: Vec<[u32; 3]>,
}

/// Twice the area of a triangle seen from above `[m²]`, positive if it is counter-clockwise.
pub(crate) fn twice_area([a, b, c]: [&Vector3<f64>; 3]) -> f64 {
    (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x)
}

impl HeightField {
    /// Triangles of an open surface in any orientation; `None` if a vertical line meets it twice, or if
    /// a triangle is vertical. Triangles without area are left out.
    #[must_use]
    pub fn new(points: &[Vector3<f64>], triangles: &[[u32; 3]]) -> Option<Self> {
        let mut field = Self { points: points.to_vec(), triangles: Vec::new() };
        for &[a, b, c] in triangles {
            let corners = [a, b, c].map(|corner| &points[corner as usize]);
            let sides = [corners[1] - corners[0], corners[2] - corners[1], corners[0] - corners[2]];
            let longest = sides.iter().map(Vector3::norm_squared).fold(0.0, f64::max);
            let area = twice_area(corners);
            if sides[0].cross(&sides[1]).norm() <= FLAT * longest {
                continue;
            }
            if area.abs() <= FLAT * longest {
                return None;
            }
            field.triangles.push(if area > 0.0 { [a, b, c] } else { [a, c, b] });
        }
        (!field.triangles.is_empty() && !field.has_folds()).then_some(field)
    }

    /// True if triangles lie above each other.
    fn has_folds(&self) -> bool {
        let mut edges: Vec<[u32; 2]> = self.triangles.iter().flat_map(|&of| sides(of)).collect();
        edges.sort_unstable();
        if edges.windows(2).any(|two| two[0] == two[1]) {
            return true;
        }
        let buckets = Buckets::new(self);
        let middle = |of: &[u32; 3]| self.corners(*of).into_iter().sum::<Vector3<f64>>() / 3.0;
        self.triangles.iter().any(|of| {
            let x = middle(of);
            let above = |&number: &u32| self.inside(number, &x) >= 0.0;
            buckets.at(&x).iter().filter(|number| above(number)).count() > 1
        })
    }

    /// Corners of a triangle `[m]`.
    pub(crate) fn corners(&self, of: [u32; 3]) -> [&Vector3<f64>; 3] {
        of.map(|corner| &self.points[corner as usize])
    }

    /// Least of the three weights of a point in a triangle, seen from above: negative outside.
    pub(crate) fn inside(&self, triangle: u32, x: &Vector3<f64>) -> f64 {
        let weights = weights(self.corners(self.triangles[triangle as usize]), x);
        weights.into_iter().fold(f64::INFINITY, f64::min)
    }

    /// Heights over a grid, x fastest. The outermost ones apply up to a distance `rim` beyond the grid
    /// `[m]`. There are no triangles where a height is NaN, and beyond a rectangle that its lowest and highest corner
    /// give.
    #[must_use]
    pub fn of_grid(axes: [&[f64]; 2], z: &[f64], rim: f64, rectangle: [Vector3<f64>; 2]) -> Self {
        let finite = z.iter().filter(|z| z.is_finite());
        let rounding = 1e-9 * finite.fold(0.0, |most: f64, z| most.max(z.abs()));
        let grid = HeightGrid { axes, z, rim, rounding };
        let [columns, rows] = [0, 1].map(|k| grid.steps(k, rectangle.map(|corner| corner[k])));
        let mut field = Self::default();
        let mut known = HashMap::new();
        for j in rows {
            for i in columns.clone() {
                let at = [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(s, t)| [i + s, j + t]);
                if at.iter().any(|at| grid.point(*at).z.is_nan()) {
                    continue;
                }
                let [a, b, c, d] = at.map(|at| {
                    *known.entry(at).or_insert_with(|| {
                        field.points.push(grid.point(at));
                        field.points.len() as u32 - 1
                    })
                });
                let halves = match grid.bends_along_first([i, j]) {
                    true => [[a, b, c], [a, c, d]],
                    false => [[a, b, d], [b, c, d]],
                };
                field.triangles.extend(halves);
            }
        }
        field
    }

    /// Part over a rectangle, given by its lowest and highest corner. Points near its sides are moved onto them.
    #[must_use]
    pub fn within(&self, rectangle: [Vector3<f64>; 2]) -> Self {
        let [low, high] = rectangle;
        let near = ON_SIDE * (high - low).xy().norm();
        let mut points = self.points.clone();
        for point in &mut points {
            for k in 0..2 {
                let side = [low[k], high[k]].into_iter().find(|at| (point[k] - at).abs() <= near);
                point[k] = side.unwrap_or(point[k]);
            }
        }
        let mut part = Self::default();
        let mut known = HashMap::new();
        for &of in &self.triangles {
            let mut polygon: Vec<_> = of.map(|corner| points[corner as usize]).to_vec();
            for (k, at, sign) in
                [(0, low.x, -1.0), (0, high.x, 1.0), (1, low.y, -1.0), (1, high.y, 1.0)]
            {
                polygon = clipped(&polygon, k, at, sign);
            }
            let mut numbers: Vec<u32> = Vec::new();
            for point in polygon {
                let bits = [point.x, point.y, point.z].map(|x| (x + 0.0).to_bits());
                let number = *known.entry(bits).or_insert_with(|| {
                    part.points.push(point);
                    part.points.len() as u32 - 1
                });
                if !numbers.contains(&number) {
                    numbers.push(number);
                }
            }
            let fan = (2..numbers.len()).map(|i| [numbers[0], numbers[i - 1], numbers[i]]);
            let has_area = |of: &[u32; 3]| twice_area(part.corners(*of)) > 0.0;
            let fan: Vec<_> = fan.filter(has_area).collect();
            part.triangles.extend(fan);
        }
        part
    }

    /// Volume between the ground and the level z = 0 `[m³]`.
    #[must_use]
    pub fn volume(&self) -> f64 {
        let column = |&of: &[u32; 3]| {
            let [a, b, c] = self.corners(of);
            twice_area([a, b, c]) / 2.0 * (a.z + b.z + c.z) / 3.0
        };
        self.triangles.iter().map(column).sum()
    }

    /// Number of the triangle on the other side of each edge, by its two ends in the direction of the
    /// triangle itself.
    pub(crate) fn beyond(&self) -> BTreeMap<[u32; 2], u32> {
        let triangles = self.triangles.iter().zip(0..);
        triangles
            .flat_map(|(&of, number)| sides(of).map(|[from, to]| ([to, from], number)))
            .collect()
    }
}

/// Edges of a triangle, in its direction.
pub(crate) fn sides([a, b, c]: [u32; 3]) -> [[u32; 2]; 3] {
    [[a, b], [b, c], [c, a]]
}

/// Weights of the three corners at a point, seen from above.
pub(crate) fn weights([a, b, c]: [&Vector3<f64>; 3], x: &Vector3<f64>) -> [f64; 3] {
    let all = twice_area([a, b, c]);
    [twice_area([x, b, c]) / all, twice_area([a, x, c]) / all, twice_area([a, b, x]) / all]
}

/// Part of a polygon on one side of the line on which a coordinate has a value.
fn clipped(polygon: &[Vector3<f64>], k: usize, at: f64, sign: f64) -> Vec<Vector3<f64>> {
    let n = polygon.len();
    let mut kept = Vec::with_capacity(n + 1);
    for i in 0..n {
        let [a, b] = [polygon[i], polygon[(i + 1) % n]];
        let beyond = |x: &Vector3<f64>| sign * (x[k] - at);
        if beyond(&a) <= 0.0 {
            kept.push(a);
        }
        if beyond(&a) * beyond(&b) < 0.0 {
            // Both triangles beside an edge find the same point.
            let bits = |x: &Vector3<f64>| [x.x, x.y, x.z].map(f64::to_bits);
            let [from, to] = if bits(&a) < bits(&b) { [a, b] } else { [b, a] };
            let mut point = from + (to - from) * ((at - from[k]) / (to[k] - from[k]));
            point[k] = at;
            kept.push(point);
        }
    }
    kept
}

/// Heights over a grid with a rim.
struct HeightGrid<'a> {
    axes: [&'a [f64]; 2],
    z: &'a [f64],
    rim: f64,
    /// Difference of heights that rounding may cause `[m]`.
    rounding: f64,
}

impl HeightGrid<'_> {
    /// Coordinates of an axis, with those of the rim.
    fn at(&self, k: usize, i: usize) -> f64 {
        let axis = self.axes[k];
        match self.rim > 0.0 {
            false => axis[i],
            true if i == 0 => axis[0] - self.rim,
            true => axis.get(i - 1).copied().unwrap_or(axis[axis.len() - 1] + self.rim),
        }
    }

    /// Number of points along an axis, those of the rim included.
    fn count(&self, k: usize) -> usize {
        self.axes[k].len() + if self.rim > 0.0 { 2 } else { 0 }
    }

    /// Intervals of an axis that meet a range.
    fn steps(&self, k: usize, [from, to]: [f64; 2]) -> std::ops::Range<usize> {
        let last = self.count(k).saturating_sub(1);
        let first = (0..last).find(|&i| self.at(k, i + 1) >= from).unwrap_or(last);
        first..(first..last).find(|&i| self.at(k, i) > to).unwrap_or(last)
    }

    fn point(&self, [i, j]: [usize; 2]) -> Vector3<f64> {
        let rim = usize::from(self.rim > 0.0);
        let [column, row] =
            [(i, 0), (j, 1)].map(|(at, k)| at.saturating_sub(rim).min(self.axes[k].len() - 1));
        let z = self.z.get(column + self.axes[0].len() * row).copied().unwrap_or(f64::NAN);
        Vector3::new(self.at(0, i), self.at(1, j), z)
    }

    /// True if a crease from the lowest corner of a grid cell to the highest fits the heights around at
    /// least as well as one between the other two.
    fn bends_along_first(&self, at: [usize; 2]) -> bool {
        let corner = |of: usize| [[0, 0], [1, 0], [1, 1], [0, 1]][of];
        let [first, second] = [[[0, 1, 2], [2, 3, 0]], [[3, 0, 1], [1, 2, 3]]].map(|halves| {
            halves.map(|of| self.bend(at, of.map(corner))).into_iter().flatten().fold(0.0, f64::max)
        });
        // Rounding must not decide.
        first <= second + self.rounding
    }

    /// Least distance of the plane of half a grid cell from the heights beyond one of its two sides
    /// `[m]`; `None` without heights there. The second corner is the right angle.
    fn bend(&self, at: [usize; 2], half: [[usize; 2]; 3]) -> Option<f64> {
        let corners = half.map(|of| self.point([at[0] + of[0], at[1] + of[1]]));
        let [a, b, c] = &corners;
        let beyond = |ends: [[usize; 2]; 2], inner: [usize; 2]| {
            let heights = ends.map(|end| {
                // One step from the end, away from the corner that is not on this side.
                let [i, j] = [0, 1].map(|k| {
                    let across = usize::from(ends[0][k] == ends[1][k]);
                    (at[k] + end[k] + across * end[k]).checked_sub(across * inner[k])
                });
                let [i, j] = [i?, j?];
                let there = i < self.count(0) && j < self.count(1);
                let x = there.then(|| self.point([i, j])).filter(|x| x.z.is_finite())?;
                let [u, v, w] = weights([a, b, c], &x);
                Some((u * a.z + v * b.z + w * c.z - x.z).abs())
            });
            Some(heights[0]?.max(heights[1]?))
        };
        let sides = [beyond([half[0], half[1]], half[2]), beyond([half[1], half[2]], half[0])];
        sides.into_iter().flatten().min_by(f64::total_cmp)
    }
}
