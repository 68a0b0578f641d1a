//! Parts of cells while planes clip them, and the points that they have in common.

use std::collections::HashMap;

use nalgebra::Vector3;

use crate::cell::{self, CellFace};
use crate::complex::CellComplex;
use crate::measure;
use crate::plane::unit;
use crate::split;

/// Relative difference of the volume of a cell from the sum of its parts that rounding may cause.
pub(crate) const ROUNDING: f64 = 1e-9;

/// Part of a cell while it is clipped: points with numbers of its own, those of the cell first.
#[derive(Clone, Debug)]
pub(crate) struct Clipped {
    pub(crate) points: Vec<Vector3<f64>>,
    pub(crate) faces: Vec<CellFace>,
}

/// Points of a complex by their place: points that are nearer than the tolerance are one.
pub(crate) struct WeldedPoints {
    tolerance: f64,
    known: HashMap<[i64; 3], Vec<u32>>,
}

impl Clipped {
    /// Cell of a complex, with its points in the order of their numbers there.
    pub(crate) fn of_cell(rock: &CellComplex, cell: usize) -> Self {
        let own = &rock.cells[cell];
        let corners = own.vertices();
        let local = |corner: &u32| corners.binary_search(corner).unwrap_or_default() as u32;
        let faces = own.faces.iter().map(|face| CellFace {
            plane: face.plane,
            corners: face.corners.iter().map(local).collect(),
        });
        let points = corners.iter().map(|&corner| rock.points[corner as usize]).collect();
        Self { points, faces: faces.collect() }
    }

    /// Corners of the faces `[m]`.
    fn corners(&self) -> impl Iterator<Item = &Vector3<f64>> {
        let corners = self.faces.iter().flat_map(|face| &face.corners);
        corners.map(|&corner| &self.points[corner as usize])
    }

    /// Lowest and highest corner of the box around it `[m]`.
    pub(crate) fn bounds(&self) -> [Vector3<f64>; 2] {
        let far = Vector3::repeat(f64::INFINITY);
        self.corners().fold([far, -far], |[low, high], x| [low.inf(x), high.sup(x)])
    }

    /// Least and largest value of a quantity at its corners.
    pub(crate) fn extent(&self, of: impl Fn(&Vector3<f64>) -> f64) -> [f64; 2] {
        self.corners().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| {
            [low.min(of(x)), high.max(of(x))]
        })
    }

    /// Width `[m]`: the least over the faces of the largest distance of a corner from the face.
    pub(crate) fn width(&self) -> f64 {
        let beyond = |face: &CellFace| {
            let normal = unit(face.area(&self.points))?;
            let at = normal.dot(&self.points[*face.corners.first()? as usize]);
            let [low, high] = self.extent(|x| normal.dot(x) - at);
            Some(high.max(-low))
        };
        self.faces.iter().filter_map(beyond).fold(f64::INFINITY, f64::min)
    }

    /// Volume `[m³]`.
    pub(crate) fn volume(&self) -> f64 {
        measure::volume(&self.points, &self.faces)
    }

    /// Faces with other numbers of their points, without those that welding closed.
    pub(crate) fn welded(&self, numbers: &[u32]) -> impl Iterator<Item = CellFace> {
        self.faces.iter().filter_map(|face| {
            let mut corners: Vec<u32> =
                face.corners.iter().map(|&corner| numbers[corner as usize]).collect();
            corners.dedup();
            while corners.len() > 1 && corners.first() == corners.last() {
                corners.pop();
            }
            (corners.len() > 2).then_some(CellFace { plane: face.plane, corners })
        })
    }

    /// Largest distance of a corner from a point `[m]`.
    pub(crate) fn reach(&self, from: &Vector3<f64>) -> f64 {
        let corners = self.faces.iter().flat_map(|face| &face.corners);
        corners.map(|&corner| (self.points[corner as usize] - from).norm()).fold(0.0, f64::max)
    }

    /// Cuts off what lies above a plane, and returns true if anything does. `None` if rounding errors spoil it.
    pub(crate) fn clip(
        &mut self,
        height: impl Fn(&Vector3<f64>) -> f64,
        plane: u32,
        tolerance: f64,
    ) -> Option<bool> {
        let heights: Vec<f64> = self.points.iter().map(height).collect();
        let side = |point: u32| {
            let height = heights.get(point as usize).copied().unwrap_or_default();
            i8::from(height > tolerance) - i8::from(height < -tolerance)
        };
        let corners = || self.faces.iter().flat_map(|face| &face.corners);
        if !corners().any(|&corner| side(corner) > 0) {
            return Some(false);
        }
        if !corners().any(|&corner| side(corner) < 0) {
            self.faces.clear();
            return Some(true);
        }
        let (mut crossings, mut new) = (HashMap::new(), Vec::new());
        let (points, first) = (&self.points, self.points.len());
        let halves = split::split(&self.faces, plane, side, |a, b| {
            let (a, b) = (a.min(b), a.max(b));
            *crossings.entry((a, b)).or_insert_with(|| {
                let [below, above] = [a, b].map(|point| heights[point as usize]);
                let [from, to] = [a, b].map(|point| points[point as usize]);
                new.push(from + (to - from) * (below / (below - above)));
                (first + new.len() - 1) as u32
            })
        })?;
        self.points.extend(new);
        self.faces = halves.below;
        Some(true)
    }
}

impl WeldedPoints {
    /// Points of cells.
    pub(crate) fn of_cells(rock: &CellComplex, cells: &[usize]) -> Self {
        let tolerance = rock.tolerance.max(f64::MIN_POSITIVE);
        let mut welded = Self { tolerance, known: HashMap::new() };
        for corner in cells.iter().flat_map(|&cell| rock.cells[cell].vertices()) {
            welded.insert(&rock.points[corner as usize], corner);
        }
        welded
    }

    /// Numbers in the complex of the points of a part of a cell with these corners.
    pub(crate) fn numbers(
        &mut self,
        rock: &mut CellComplex,
        corners: &[u32],
        part: &Clipped,
    ) -> Vec<u32> {
        let used = cell::vertices(&part.faces);
        let mut numbers = vec![u32::MAX; part.points.len()];
        for local in used {
            numbers[local as usize] = match corners.get(local as usize) {
                Some(&corner) => corner,
                None => self.number(&part.points[local as usize], &mut rock.points),
            };
        }
        numbers
    }

    fn key(&self, x: &Vector3<f64>) -> [i64; 3] {
        [x.x, x.y, x.z].map(|part| (part / (2.0 * self.tolerance)).floor() as i64)
    }

    fn insert(&mut self, x: &Vector3<f64>, number: u32) {
        let here = self.known.entry(self.key(x)).or_default();
        if !here.contains(&number) {
            here.push(number);
        }
    }

    /// Number of the point at a place; a new point if there is none.
    fn number(&mut self, x: &Vector3<f64>, points: &mut Vec<Vector3<f64>>) -> u32 {
        let key = self.key(x);
        for at in 0..27_i64 {
            let near = [key[0] + at % 3 - 1, key[1] + at / 3 % 3 - 1, key[2] + at / 9 - 1];
            let known = self.known.get(&near).into_iter().flatten();
            let same = |number: &&u32| (points[**number as usize] - x).norm() <= self.tolerance;
            if let Some(&number) = known.into_iter().find(same) {
                return number;
            }
        }
        points.push(*x);
        let number = points.len() as u32 - 1;
        self.insert(x, number);
        number
    }
}
