//! Grounds of fewer triangles: points are removed one by one, the least important first.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};

use nalgebra::Vector3;

use crate::height_field::{HeightField, sides, twice_area, weights};

/// Ratio of the height of a triangle to its longest side below which it is a sliver.
const SLIVER: f64 = 0.1;

/// Part of the distance in the middle of a given edge that counts: nothing was measured there.
const MIDDLE: f64 = 0.5;

/// Sine of the angle between two edges of the rim below which they are one line.
const STRAIGHT: f64 = 1e-9;

/// Difference of heights, relative to the tolerance, that no crease has.
const LEVEL: f64 = 1e-6;

/// Field of which points are removed. Numbers of removed triangles and points stay free.
struct Simplifier {
    field: HeightField,
    /// Numbers of the triangles around each point; none around a removed one.
    stars: Vec<Vec<u32>>,
    /// Removed points and middles of given edges above or below each triangle.
    held: Vec<Vec<Held>>,
    tolerance: f64,
}

/// Point of the given ground, and the part of its distance that counts.
#[derive(Clone, Copy, Debug)]
struct Held {
    x: Vector3<f64>,
    weight: f64,
}

/// Removal of a point, which moves onto a neighbour, and the largest distance that the ground then has from
/// the points around `[m]`.
#[derive(Clone, Copy, Debug)]
struct Removal {
    error: f64,
    onto: u32,
}

/// Removals by their errors, each with the number of changes around its point.
type Queue = BinaryHeap<Reverse<(u64, u32, u32)>>;

impl HeightField {
    /// Same ground with few triangles: no height differs by more than the tolerance at a given point, or by
    /// more than twice that in the middle of a given edge. The outline stays.
    #[must_use]
    pub fn simplified(&self, tolerance: f64) -> Self {
        let mut stars = vec![Vec::new(); self.points.len()];
        for (of, number) in self.triangles.iter().zip(0..) {
            of.iter().for_each(|&corner| stars[corner as usize].push(number));
        }
        // Between given points the ground is that of the given edges.
        let middles = |&of: &[u32; 3]| {
            let own = sides(of).into_iter().filter(|[from, to]| from < to);
            let ends = own.map(|edge| edge.map(|end| &self.points[end as usize]));
            ends.map(|[from, to]| Held { x: (from + to) / 2.0, weight: MIDDLE }).collect()
        };
        let held = self.triangles.iter().map(middles).collect();
        let mut work = Simplifier { field: self.clone(), stars, held, tolerance };
        work.run();
        work.finished()
    }
}

impl Simplifier {
    fn run(&mut self) {
        let mut changes = vec![0_u32; self.stars.len()];
        let mut queue = Queue::new();
        for point in 0..self.stars.len() as u32 {
            self.offer(point, &changes, &mut queue);
        }
        while let Some(Reverse((error, point, change))) = queue.pop() {
            if changes[point as usize] != change || self.stars[point as usize].is_empty() {
                continue;
            }
            // The star of the neighbour may have changed.
            changes[point as usize] += 1;
            match self.cheapest(point) {
                Some(removal) if removal.error.to_bits() <= error => {
                    let around: Vec<u32> = self.neighbours(point).into_keys().collect();
                    self.remove(point, removal.onto);
                    for other in around {
                        changes[other as usize] += 1;
                        self.offer(other, &changes, &mut queue);
                    }
                }
                _ => self.offer(point, &changes, &mut queue),
            }
        }
    }

    fn offer(&self, point: u32, changes: &[u32], queue: &mut Queue) {
        if let Some(removal) = self.cheapest(point) {
            queue.push(Reverse((removal.error.to_bits(), point, changes[point as usize])));
        }
    }

    /// Neighbours of a point, each with the number of triangles at the edge to it.
    fn neighbours(&self, point: u32) -> BTreeMap<u32, usize> {
        let mut all = BTreeMap::new();
        for &triangle in &self.stars[point as usize] {
            let corners = self.field.triangles[triangle as usize];
            for corner in corners.into_iter().filter(|corner| *corner != point) {
                *all.entry(corner).or_insert(0) += 1;
            }
        }
        all
    }

    /// Removal with the least error; `None` if a point must stay.
    fn cheapest(&self, point: u32) -> Option<Removal> {
        let neighbours = self.neighbours(point);
        let rim: Vec<u32> =
            neighbours.iter().filter(|(_, n)| **n == 1).map(|(other, _)| *other).collect();
        let targets: Vec<u32> = match rim[..] {
            [] => neighbours.keys().copied().collect(),
            [from, to] if self.is_straight([from, point, to]) => rim,
            _ => return None,
        };
        let mut best: Option<Removal> = None;
        for onto in targets {
            let most = best.map_or(self.tolerance, |best| best.error);
            let error = self.error((point, onto), &neighbours, most);
            let better = error.filter(|error| best.is_none_or(|best| *error < best.error));
            best = better.map(|error| Removal { error, onto }).or(best);
        }
        best
    }

    /// True if three points lie on a line, seen from above.
    fn is_straight(&self, three: [u32; 3]) -> bool {
        let [a, b, c] = self.field.corners(three);
        let lengths = (b - a).xy().norm() * (c - b).xy().norm();
        let ahead = (b - a).xy().dot(&(c - b).xy()) > 0.0;
        ahead && twice_area([a, b, c]).abs() <= STRAIGHT * lengths
    }

    /// Triangles around a point that remain after it moved onto a neighbour: their numbers and corners.
    fn moved(&self, point: u32, onto: u32) -> Vec<(u32, [u32; 3])> {
        let star = self.stars[point as usize].iter();
        let all = star.map(|&triangle| (triangle, self.field.triangles[triangle as usize]));
        let rest = all.filter(|(_, corners)| !corners.contains(&onto));
        let moved = |corner: u32| if corner == point { onto } else { corner };
        rest.map(|(number, corners)| (number, corners.map(moved))).collect()
    }

    /// Largest distance of the ground from given points after a removal `[m]`; `None` if it is above
    /// `most`, or if the triangles would not be sound.
    fn error(
        &self,
        (point, onto): (u32, u32),
        neighbours: &BTreeMap<u32, usize>,
        most: f64,
    ) -> Option<f64> {
        let common = self.neighbours(onto).into_keys().filter(|of| neighbours.contains_key(of));
        let moved = self.moved(point, onto);
        if common.count() != neighbours[&onto] || moved.is_empty() {
            return None;
        }
        let star = || self.stars[point as usize].iter();
        let before =
            star().map(|&triangle| self.slenderness(self.field.triangles[triangle as usize]));
        let before = before.fold(f64::INFINITY, f64::min);
        let after = moved.iter().map(|(_, corners)| self.slenderness(*corners));
        let after = after.fold(f64::INFINITY, f64::min);
        if after <= 1e-6 {
            return None;
        }
        let mut worst = 0.0_f64;
        let own = Held { x: self.field.points[point as usize], weight: 1.0 };
        for Held { x, weight } in
            star().flat_map(|&triangle| &self.held[triangle as usize]).chain([&own])
        {
            let (_, height) = self.below(x, &moved)?;
            worst = worst.max(weight * (height - x.z).abs());
            if worst > most {
                return None;
            }
        }
        let sound = after >= SLIVER.min(before) || worst <= LEVEL * self.tolerance;
        sound.then_some(worst)
    }

    /// Height of a triangle, seen from above, over its longest side; negative if it is clockwise.
    fn slenderness(&self, triangle: [u32; 3]) -> f64 {
        let corners = self.field.corners(triangle);
        let length = |i: usize| (corners[i] - corners[(i + 1) % 3]).xy().norm_squared();
        twice_area(corners) / (0..3).map(length).fold(0.0, f64::max)
    }

    /// Place among triangles of the one above or below a point, and its height there `[m]`.
    fn below(&self, x: &Vector3<f64>, triangles: &[(u32, [u32; 3])]) -> Option<(usize, f64)> {
        let weights = triangles.iter().enumerate().map(|(place, (_, corners))| {
            let corners = self.field.corners(*corners);
            let weights = weights(corners, x);
            let height: f64 = (0..3).map(|k| weights[k] * corners[k].z).sum();
            (place, height, weights.into_iter().fold(f64::INFINITY, f64::min))
        });
        let best = weights.max_by(|a, b| a.2.total_cmp(&b.2).then(b.0.cmp(&a.0)));
        best.map(|(place, height, _)| (place, height))
    }

    fn remove(&mut self, point: u32, onto: u32) {
        let moved = self.moved(point, onto);
        let star = std::mem::take(&mut self.stars[point as usize]);
        let mut points = vec![Held { x: self.field.points[point as usize], weight: 1.0 }];
        for &triangle in &star {
            points.append(&mut self.held[triangle as usize]);
            let corners = self.field.triangles[triangle as usize];
            if corners.contains(&onto) {
                for corner in corners {
                    self.stars[corner as usize].retain(|other| *other != triangle);
                }
            }
        }
        for (triangle, corners) in &moved {
            self.field.triangles[*triangle as usize] = *corners;
            self.stars[onto as usize].push(*triangle);
        }
        for held in points {
            if let Some((place, _)) = self.below(&held.x, &moved) {
                self.held[moved[place].0 as usize].push(held);
            }
        }
    }

    /// Field of what was not removed.
    fn finished(self) -> HeightField {
        let mut field = HeightField::default();
        let mut numbers = vec![0; self.stars.len()];
        for (point, _) in self.stars.iter().enumerate().filter(|(_, star)| !star.is_empty()) {
            numbers[point] = field.points.len() as u32;
            field.points.push(self.field.points[point]);
        }
        let mut left: Vec<u32> = self.stars.into_iter().flatten().collect();
        left.sort_unstable();
        left.dedup();
        let corners = |&triangle: &u32| {
            self.field.triangles[triangle as usize].map(|corner| numbers[corner as usize])
        };
        field.triangles = left.iter().map(corners).collect();
        field
    }
}
