//! Ground of plane pieces, with the vertical planes at its creases.

use std::collections::HashMap;

use nalgebra::Vector3;

use crate::buckets::Buckets;
use crate::height_field::{HeightField, sides, twice_area};
use crate::plane::CutPlane;

/// Sine of the angle between two creases below which they lie in one vertical plane.
const STRAIGHT: f64 = 1e-9;

/// Weight of a corner below which a point lies outside of a triangle.
const OUTSIDE: f64 = -1e-6;

/// Side of a triangle in the vertical plane of a crease.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct CreaseSide {
    /// Number of the plane.
    pub(crate) crease: u32,
    /// True if the triangle is on the side of the normal.
    pub(crate) above: bool,
    /// Triangle on the other side.
    pub(crate) beyond: u32,
}

/// Surface of a ground, of plane pieces that meet at creases.
#[derive(Clone, Debug, PartialEq)]
pub struct Ground {
    pub(crate) field: HeightField,
    pub(crate) buckets: Buckets,
    /// Sides of each triangle; none at the rim.
    pub(crate) sides: Vec<[Option<CreaseSide>; 3]>,
    /// Vertical planes.
    pub(crate) creases: Vec<CutPlane>,
    /// Piece of each triangle.
    pub(crate) pieces: Vec<u32>,
    /// Planes of the pieces, with their normals upward.
    pub(crate) planes: Vec<CutPlane>,
    pub(crate) slack: f64,
}

impl Ground {
    /// Ground of a cut. Neighbours within the distance `same` of one plane are one piece. Cells follow the
    /// ground within `slack` where that avoids thin ones `[m]`.
    #[must_use]
    pub fn new(field: HeightField, cut: u32, joined: bool, [same, slack]: [f64; 2]) -> Self {
        let buckets = Buckets::new(&field);
        let mut ground = Self {
            buckets,
            sides: vec![[None; 3]; field.triangles.len()],
            creases: Vec::new(),
            pieces: vec![u32::MAX; field.triangles.len()],
            planes: Vec::new(),
            slack,
            field,
        };
        ground.find_sides(cut);
        ground.find_pieces(cut, joined, same);
        ground
    }

    /// Triangles.
    #[must_use]
    pub fn field(&self) -> &HeightField {
        &self.field
    }

    /// Number of plane pieces.
    #[must_use]
    pub fn n_pieces(&self) -> usize {
        self.planes.len()
    }

    /// Height above or below a point `[m]`; `None` beyond the rim.
    #[must_use]
    pub fn height(&self, x: &Vector3<f64>) -> Option<f64> {
        let near = self.buckets.at(x).iter();
        let inside = near.map(|&triangle| (triangle, self.field.inside(triangle, x)));
        let (triangle, inside) = inside.max_by(|a, b| a.1.total_cmp(&b.1).then(b.0.cmp(&a.0)))?;
        let plane = &self.planes[self.pieces[triangle as usize] as usize];
        (inside >= OUTSIDE).then(|| x.z - plane.height(x) / plane.normal.z)
    }

    /// Finds the sides of the triangles and their vertical planes.
    fn find_sides(&mut self, cut: u32) {
        let beyond = self.field.beyond();
        let inner = beyond.keys().filter(|[a, b]| a < b && beyond.contains_key(&[*b, *a]));
        let lines = self.find_lines(inner.copied().collect(), cut);
        let points = &self.field.points;
        for (number, &of) in self.field.triangles.iter().enumerate() {
            for (k, [from, to]) in sides(of).into_iter().enumerate() {
                let (Some(&beyond), Some(&crease)) =
                    (beyond.get(&[from, to]), lines.get(&[from.min(to), from.max(to)]))
                else {
                    continue;
                };
                // The triangle is on the left of its edges.
                let direction = (points[to as usize] - points[from as usize]).xy();
                let normal = self.creases[crease as usize].normal;
                let above = direction.x * normal.y - direction.y * normal.x > 0.0;
                self.sides[number][k] = Some(CreaseSide { crease, above, beyond });
            }
        }
    }

    /// Vertical plane of each edge. Edges that continue each other have one plane.
    fn find_lines(&mut self, mut edges: Vec<[u32; 2]>, cut: u32) -> HashMap<[u32; 2], u32> {
        let points = &self.field.points;
        let along = |[a, b]: [u32; 2]| (points[b as usize] - points[a as usize]).xy();
        // The longest edge of a line gives its plane.
        edges.sort_by(|a, b| along(*b).norm().total_cmp(&along(*a).norm()).then(a.cmp(b)));
        let mut around = vec![Vec::new(); points.len()];
        for edge in &edges {
            edge.iter().for_each(|&end| around[end as usize].push(*edge));
        }
        let mut lines = HashMap::new();
        for first in edges {
            let direction = along(first);
            let normal = Vector3::new(direction.y, -direction.x, 0.0);
            let plane = CutPlane::new(normal, points[first[0] as usize], cut, true);
            let Some(plane) = plane.filter(|_| !lines.contains_key(&first)) else { continue };
            let line = self.creases.len() as u32;
            self.creases.push(plane);
            let mut open = vec![first];
            while let Some(edge) = open.pop() {
                lines.insert(edge, line);
                for &other in edge.iter().flat_map(|&end| &around[end as usize]) {
                    let direction = along(other);
                    let across = plane.normal.xy().dot(&direction).abs();
                    if !lines.contains_key(&other) && across <= STRAIGHT * direction.norm() {
                        open.push(other);
                    }
                }
            }
        }
        lines
    }

    /// Makes one piece of neighbours in one plane, the largest triangles first.
    fn find_pieces(&mut self, cut: u32, joined: bool, same: f64) {
        let field = &self.field;
        let area = |number: u32| twice_area(field.corners(field.triangles[number as usize]));
        let mut order: Vec<u32> = (0..field.triangles.len() as u32).collect();
        order.sort_by(|a, b| area(*b).total_cmp(&area(*a)).then(a.cmp(b)));
        for first in order {
            if self.pieces[first as usize] != u32::MAX {
                continue;
            }
            let [a, b, c] = field.corners(field.triangles[first as usize]);
            let normal = (b - a).cross(&(c - a));
            let Some(plane) = CutPlane::new(normal, *a, cut, joined) else { continue };
            let piece = self.planes.len() as u32;
            self.planes.push(plane);
            let mut open = vec![first];
            while let Some(number) = open.pop() {
                self.pieces[number as usize] = piece;
                for side in self.sides[number as usize].iter().flatten() {
                    let other = side.beyond as usize;
                    let corners = field.corners(field.triangles[other]);
                    let flat = corners.into_iter().all(|x| plane.height(x).abs() <= same);
                    if self.pieces[other] == u32::MAX && flat {
                        open.push(side.beyond);
                    }
                }
            }
        }
    }
}
