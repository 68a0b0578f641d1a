//! Cut of cells by a ground: vertical planes at its creases, and the plane of a piece in each column.

use std::collections::HashMap;

use nalgebra::Vector3;

use crate::cell::{self, CellFace};
use crate::clipped::{Clipped, WeldedPoints};
use crate::columns::{CellColumns, GROUND};
use crate::complex::{CellComplex, CutCount};
use crate::ground::Ground;
use crate::plane::CutPlane;

impl CellComplex {
    /// Divides the cells that a ground passes through. Vertical planes at the creases make columns, and
    /// the plane of one piece divides each of them. `allowed` has a flag for each cell.
    ///
    /// A cell in which rounding errors leave no polyhedra stays whole, and is counted.
    pub fn cut_ground(&mut self, ground: &Ground, allowed: &[bool]) -> CutCount {
        let chosen = self.chosen(allowed);
        let mut welded = WeldedPoints::of_cells(self, &chosen);
        let mut planes = HashMap::new();
        self.replace_each(chosen, |complex, cell| {
            let whole = Clipped::of_cell(complex, cell);
            let parts = ground.parts(&whole, complex.tolerance)?;
            let corners = complex.cells[cell].vertices();
            complex.numbered(ground, &parts, &corners, &mut welded, &mut planes)
        })
    }

    /// Faces of the parts of a cell with the numbers of the complex; `None` if rounding errors spoil one.
    fn numbered(
        &mut self,
        ground: &Ground,
        parts: &[Clipped],
        corners: &[u32],
        welded: &mut WeldedPoints,
        planes: &mut HashMap<u32, u32>,
    ) -> Option<Vec<Vec<CellFace>>> {
        let mut finished = Vec::with_capacity(parts.len());
        for part in parts {
            let numbers = welded.numbers(self, corners, part);
            let mut faces: Vec<CellFace> = part.welded(&numbers).collect();
            cell::check(&faces).ok()?;
            for face in faces.iter_mut().filter(|face| face.plane & GROUND != 0) {
                let mark = face.plane ^ GROUND;
                face.plane = *planes.entry(mark).or_insert_with(|| {
                    self.planes.push(ground.plane(mark));
                    self.planes.len() as u32 - 1
                });
            }
            finished.push(faces);
        }
        Some(finished)
    }

    /// Point of the cells with these flags at which a ground has no height; `None` if it covers all of them.
    #[must_use]
    pub fn uncovered(&self, ground: &Ground, allowed: &[bool]) -> Option<Vector3<f64>> {
        let chosen = || (0..self.cells.len()).filter(|&cell| allowed[cell]);
        let corners = chosen().flat_map(|cell| self.cells[cell].vertices());
        let mut corners = corners.map(|corner| self.points[corner as usize]);
        let bare = corners.find(|x| ground.height(x).is_none());
        bare.or_else(|| {
            let mut beside = ground.beside_rim();
            beside.find(|x| chosen().any(|cell| self.is_on_vertical(cell, x)))
        })
    }

    /// True if a vertical line passes through the inside of a cell.
    fn is_on_vertical(&self, cell: usize, x: &Vector3<f64>) -> bool {
        let [mut low, mut high] = [f64::NEG_INFINITY, f64::INFINITY];
        let margin = 100.0 * self.tolerance;
        for face in &self.cells[cell].faces {
            let normal = self.outward(face);
            let room = -normal.dot(&(x - self.middle(face)));
            if normal.z.abs() < 1e-9 {
                if room <= margin {
                    return false;
                }
                continue;
            }
            let at = x.z + room / normal.z;
            if normal.z > 0.0 { high = high.min(at) } else { low = low.max(at) }
        }
        high - low > margin
    }
}

impl Ground {
    /// Parts of a cell; the cell itself if the ground does not divide it. `None` if rounding errors spoil them.
    fn parts(&self, whole: &Clipped, tolerance: f64) -> Option<Vec<Clipped>> {
        let [low, high] = whole.bounds();
        let over = self.buckets.over(&low, &high);
        let corners =
            over.iter().flat_map(|&of| self.field.corners(self.field.triangles[of as usize]));
        let [least, most] = corners.fold([f64::INFINITY, f64::NEG_INFINITY], |[least, most], x| {
            [least.min(x.z), most.max(x.z)]
        });
        if least > high.z || most < low.z {
            return Some(vec![whole.clone()]);
        }
        let columns = CellColumns::new(self, whole, tolerance)?;
        if columns.all.iter().all(|column| column.side != 0) {
            return Some(vec![whole.clone()]);
        }
        let mut parts = Vec::with_capacity(2 * columns.all.len());
        for column in columns.all {
            if column.side != 0 {
                parts.push(column.part);
                continue;
            }
            let plane = &self.planes[column.piece as usize];
            let mark = GROUND | (self.creases.len() as u32 + column.piece);
            for sign in [1.0, -1.0] {
                let mut half = column.part.clone();
                half.clip(|x| sign * plane.height(x), mark, tolerance)?;
                parts.push(half);
            }
        }
        Some(parts)
    }

    /// Plane of a crease or of a piece; pieces follow the creases.
    fn plane(&self, number: u32) -> CutPlane {
        let number = number as usize;
        let piece = || self.planes[number - self.creases.len()];
        self.creases.get(number).copied().unwrap_or_else(piece)
    }

    /// Points beside the rim, without a height `[m]`.
    fn beside_rim(&self) -> impl Iterator<Item = Vector3<f64>> {
        self.field.triangles.iter().zip(&self.sides).flat_map(|(&of, own)| {
            let corners = self.field.corners(of);
            let at_rim = (0..3).filter(|&k| own[k].is_none());
            let beside = |k: usize| {
                let [from, to] = [corners[k], corners[(k + 1) % 3]];
                let along = to - from;
                let out = Vector3::new(along.y, -along.x, 0.0);
                let points = [0.25, 0.01].map(|share| (from + to) / 2.0 + out * share);
                points.into_iter().find(|x| self.height(x).is_none())
            };
            at_rim.filter_map(beside).collect::<Vec<_>>()
        })
    }
}
