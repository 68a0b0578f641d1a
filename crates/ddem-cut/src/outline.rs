//! Polygons in a plane, and their convex parts.

use crate::polyhedron::ShapeError;

/// Sine of the angle between two edges below which they are one.
const STRAIGHT: f64 = 1e-9;

/// Polygon that does not cross itself, without corners on straight sides, counter-clockwise.
#[derive(Clone, Debug, PartialEq)]
pub struct Outline {
    corners: Vec<[f64; 2]>,
}

/// Twice the area of a triangle `[m²]`, positive if it turns left.
fn turn(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// Sine of the angle by which a path turns at its second point, or 0 where it does not move.
fn sine(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    let length = |p: [f64; 2], q: [f64; 2]| libm::hypot(q[0] - p[0], q[1] - p[1]);
    let product = length(a, b) * length(b, c);
    if product > 0.0 { turn(a, b, c) / product } else { 0.0 }
}

/// True if two sides, without common ends, cross or touch.
fn meet(a: [f64; 2], b: [f64; 2], c: [f64; 2], d: [f64; 2]) -> bool {
    let opposite = |p: f64, q: f64| p * q <= 0.0;
    let apart = (0..2).any(|axis| {
        a[axis].max(b[axis]) < c[axis].min(d[axis]) || c[axis].max(d[axis]) < a[axis].min(b[axis])
    });
    !apart && opposite(turn(a, b, c), turn(a, b, d)) && opposite(turn(c, d, a), turn(c, d, b))
}

impl Outline {
    /// Outline through corners in either direction.
    ///
    /// # Errors
    ///
    /// If fewer than three corners enclose an area, or sides cross.
    pub fn new(corners: &[[f64; 2]]) -> Result<Self, ShapeError> {
        let mut corners = corners.to_vec();
        while let Some(i) = (0..corners.len()).find(|&i| {
            let n = corners.len();
            sine(corners[(i + n - 1) % n], corners[i], corners[(i + 1) % n]).abs() <= STRAIGHT
        }) {
            corners.remove(i);
        }
        let n = corners.len();
        if n < 3 {
            return Err(ShapeError::NoArea);
        }
        let side = |i: usize| (corners[i], corners[(i + 1) % n]);
        for i in 0..n {
            for j in (i + 2)..n {
                let ((a, b), (c, d)) = (side(i), side(j));
                if (j + 1) % n != i && meet(a, b, c, d) {
                    return Err(ShapeError::Crossing);
                }
            }
        }
        let area: f64 = (1..n - 1).map(|i| turn(corners[0], corners[i], corners[i + 1])).sum();
        if area < 0.0 {
            corners.reverse();
        }
        Ok(Self { corners })
    }

    /// Corners `[m]`, counter-clockwise.
    #[must_use]
    pub fn corners(&self) -> &[[f64; 2]] {
        &self.corners
    }

    /// Convex parts, as numbers of corners, counter-clockwise. Parts meet along whole sides.
    #[must_use]
    pub fn convex_parts(&self) -> Vec<Vec<usize>> {
        let mut parts = self.triangles();
        while let Some((i, j, merged)) = self.mergeable(&parts) {
            parts[i] = merged;
            parts.remove(j);
        }
        parts
    }

    /// Triangles between the corners, by clipping ears.
    fn triangles(&self) -> Vec<Vec<usize>> {
        let at = |i: usize| self.corners[i];
        let mut left: Vec<usize> = (0..self.corners.len()).collect();
        let mut triangles = Vec::new();
        while left.len() > 3 {
            let n = left.len();
            let [before, after] = [n - 1, 1];
            let ear = |i: usize| [left[(i + before) % n], left[i], left[(i + after) % n]];
            let free = |&i: &usize| {
                let [a, b, c] = ear(i);
                let inside = |&p: &usize| {
                    ![a, b, c].contains(&p)
                        && turn(at(a), at(b), at(p)) >= 0.0
                        && turn(at(b), at(c), at(p)) >= 0.0
                        && turn(at(c), at(a), at(p)) >= 0.0
                };
                turn(at(a), at(b), at(c)) > 0.0 && !left.iter().any(inside)
            };
            // Rounding errors may leave no ear; any corner that turns left then serves.
            let i = (0..n).find(free).unwrap_or_else(|| {
                let turns = |i: &usize| {
                    let [a, b, c] = ear(*i);
                    turn(at(a), at(b), at(c)) > 0.0
                };
                (0..n).find(turns).unwrap_or(0)
            });
            triangles.push(ear(i).to_vec());
            left.remove(i);
        }
        triangles.push(left);
        triangles
    }

    /// Numbers of two parts, and the convex part that they form together.
    fn mergeable(&self, parts: &[Vec<usize>]) -> Option<(usize, usize, Vec<usize>)> {
        for i in 0..parts.len() {
            for j in i + 1..parts.len() {
                let merged = merged(&parts[i], &parts[j]).filter(|merged| self.is_convex(merged));
                if let Some(merged) = merged {
                    return Some((i, j, merged));
                }
            }
        }
        None
    }

    fn is_convex(&self, part: &[usize]) -> bool {
        let n = part.len();
        let at = |i: usize| self.corners[part[i % n]];
        // A straight angle would make two faces in one plane.
        (0..n).all(|i| sine(at(i), at(i + 1), at(i + 2)) > STRAIGHT)
    }
}

/// Two polygons joined at the side that they share.
fn merged(one: &[usize], other: &[usize]) -> Option<Vec<usize>> {
    let (n, m) = (one.len(), other.len());
    for i in 0..n {
        for j in 0..m {
            if one[i] == other[(j + 1) % m] && one[(i + 1) % n] == other[j] {
                let first = (0..n).map(|k| one[(i + 1 + k) % n]);
                let second = (2..m).map(|k| other[(j + k) % m]);
                return Some(first.chain(second).collect());
            }
        }
    }
    None
}
