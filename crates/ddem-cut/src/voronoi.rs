//! Voronoi cells: of each cell of rock the parts that are nearer to one seed than to all others.

use std::collections::HashMap;

use nalgebra::Vector3;

use crate::cell::{self, CellFace, ConvexCell};
use crate::clipped::{Clipped, ROUNDING, WeldedPoints};
use crate::complex::{CellComplex, CutCount, bounds};
use crate::plane::CutPlane;
use crate::seeds::SeedGrid;

/// Mark of the number of a seed in place of that of a plane.
const SEED: u32 = 1 << 31;

/// Cut by the planes between seeds.
struct VoronoiParts<'a> {
    seeds: &'a [Vector3<f64>],
    grid: SeedGrid,
    cut: u32,
    joined: bool,
    tolerance: f64,
    welded: WeldedPoints,
    /// Number of the plane between two seeds.
    planes: HashMap<(u32, u32), u32>,
}

impl CellComplex {
    /// Divides cells by the planes half way between seeds. Each part is a Voronoi cell, as far as it lies in
    /// the cell that it divides. `allowed` has a flag for each cell.
    ///
    /// A cell in which rounding errors leave no polyhedra stays whole, and is counted.
    pub fn cut_voronoi(
        &mut self,
        seeds: &[Vector3<f64>],
        cut: u32,
        joined: bool,
        allowed: &[bool],
    ) -> CutCount {
        let chosen = self.chosen(allowed);
        let welded = WeldedPoints::of_cells(self, &chosen);
        let (grid, planes) = (SeedGrid::new(seeds), HashMap::new());
        let tolerance = self.tolerance;
        let mut work = VoronoiParts { seeds, grid, cut, joined, tolerance, welded, planes };
        self.replace_each(chosen, |complex, cell| work.parts(complex, cell))
    }

    /// Numbers of the cells whose flags are set.
    pub(crate) fn chosen(&self, allowed: &[bool]) -> Vec<usize> {
        let is_chosen = |cell: &usize| allowed.get(*cell).is_some_and(|allowed| *allowed);
        (0..self.cells.len()).filter(is_chosen).collect()
    }

    /// Replaces cells by their parts, one after another. `None` leaves a cell whole, and is counted.
    pub(crate) fn replace_each(
        &mut self,
        cells: Vec<usize>,
        mut parts: impl FnMut(&mut Self, usize) -> Option<Vec<Vec<CellFace>>>,
    ) -> CutCount {
        let (mut count, leaves) = (CutCount::default(), self.tree.leaves());
        for cell in cells {
            match parts(self, cell) {
                Some(parts) if parts.len() > 1 => {
                    count.divisions += parts.len() - 1;
                    self.replace(leaves[&(cell as u32)], cell, parts);
                }
                Some(_) => {}
                None => self.n_uncut += 1,
            }
            if self.cells.len() > self.most {
                count.too_many = true;
                break;
            }
        }
        count
    }

    /// Replaces a cell by its parts.
    fn replace(&mut self, node: u32, cell: usize, parts: Vec<Vec<CellFace>>) {
        let region = self.cells[cell].region;
        let mut boxes = Vec::with_capacity(parts.len());
        for (i, faces) in parts.into_iter().enumerate() {
            let number = if i == 0 { cell } else { self.cells.len() };
            boxes.push((number as u32, bounds(&self.points, &faces)));
            let part = ConvexCell { faces, region };
            if i == 0 {
                self.cells[cell] = part;
            } else {
                self.cells.push(part);
            }
        }
        self.tree.replace(node, boxes);
        self.count();
    }
}

impl VoronoiParts<'_> {
    /// Faces of the parts of a cell in the order of their seeds; `None` if rounding errors spoil one.
    fn parts(&mut self, rock: &mut CellComplex, cell: usize) -> Option<Vec<Vec<CellFace>>> {
        let own = rock.cells[cell].clone();
        let corners = own.vertices();
        let whole = Clipped::of_cell(rock, cell);
        let mut parts = Vec::new();
        for seed in self.near(&whole.points) {
            let part = self.part(&whole, seed)?;
            if !part.faces.is_empty() {
                parts.push((seed, part));
            }
        }
        if parts.len() < 2 {
            return Some(vec![own.faces]);
        }
        let sum: f64 = parts.iter().map(|(_, part)| part.volume()).sum();
        if (sum - whole.volume()).abs() > ROUNDING * whole.volume() {
            return None;
        }
        let numbers: Vec<Vec<u32>> =
            parts.iter().map(|(_, part)| self.welded.numbers(rock, &corners, part)).collect();
        let mut finished = Vec::with_capacity(parts.len());
        for ((seed, part), numbers) in parts.iter().zip(&numbers) {
            let faces = self.finished(rock, *seed, part, numbers);
            cell::check(&faces).ok()?;
            finished.push(faces);
        }
        Some(finished)
    }

    /// Seeds whose Voronoi cells may meet a convex cell with these corners, in increasing order.
    fn near(&self, corners: &[Vector3<f64>]) -> Vec<u32> {
        let middle = corners.iter().sum::<Vector3<f64>>() / corners.len().max(1) as f64;
        let radius = corners.iter().map(|x| (x - middle).norm()).fold(0.0, f64::max);
        let distance = |seed: &Vector3<f64>| (seed - middle).norm();
        let nearest = self.seeds.iter().map(distance).fold(f64::INFINITY, f64::min);
        // A corner is nearer to the nearest seed than this, less its distance from the middle.
        let reach = nearest + 2.0 * radius + self.tolerance;
        let seeds = self.seeds.iter().enumerate();
        seeds.filter(|(_, seed)| distance(seed) <= reach).map(|(i, _)| i as u32).collect()
    }

    /// Part of a cell that is nearest to a seed; without faces if there is none. `None` if rounding errors
    /// spoil it.
    fn part(&self, whole: &Clipped, seed: u32) -> Option<Clipped> {
        let mut part = whole.clone();
        let at = self.seeds[seed as usize];
        let mut reach = part.reach(&at);
        let home = self.grid.place(&at);
        for ring in 0..=self.grid.rings() {
            // Seeds of this ring and beyond are too far to be nearest anywhere in the part.
            if ring > 0 && self.grid.least(ring) > 2.0 * reach {
                break;
            }
            let distance = |other: &u32| (self.seeds[*other as usize] - at).norm();
            let mut others = self.grid.ring(home, ring);
            others.sort_by(|a, b| distance(a).total_cmp(&distance(b)).then(a.cmp(b)));
            for other in others.into_iter().filter(|&other| other != seed) {
                if distance(&other) > 2.0 * reach {
                    break;
                }
                let Some(plane) = self.between(seed, other) else { continue };
                let sign = if seed < other { 1.0 } else { -1.0 };
                if part.clip(|x| sign * plane.height(x), SEED | other, self.tolerance)? {
                    reach = part.reach(&at);
                }
                if part.faces.is_empty() {
                    return Some(part);
                }
            }
        }
        Some(part)
    }

    /// Plane half way between two seeds, with the normal from the lower number to the higher.
    fn between(&self, a: u32, b: u32) -> Option<CutPlane> {
        let [from, to] = [a.min(b), a.max(b)].map(|seed| self.seeds[seed as usize]);
        CutPlane::new(to - from, (from + to) / 2.0, self.cut, self.joined)
    }

    /// Faces of a part with the numbers of the complex, without those that welding closed.
    fn finished(
        &mut self,
        rock: &mut CellComplex,
        seed: u32,
        part: &Clipped,
        numbers: &[u32],
    ) -> Vec<CellFace> {
        let mut faces = Vec::with_capacity(part.faces.len());
        for mut face in part.welded(numbers) {
            if face.plane & SEED != 0 {
                let other = face.plane ^ SEED;
                let pair = (seed.min(other), seed.max(other));
                let plane = self.between(seed, other);
                face.plane = *self.planes.entry(pair).or_insert_with(|| {
                    rock.planes.extend(plane);
                    rock.planes.len() as u32 - 1
                });
            }
            faces.push(face);
        }
        faces
    }
}
