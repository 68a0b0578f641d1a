//! Numbers and volumes of blocks that curved and slanted shapes select, beside the volumes of the
//! shapes.

use std::fmt;
use std::sync::Arc;

use super::convex::Convex;
use super::selector::{PlaneEquation, Selector};
use super::sets::{bounds_of_sets, sides};
use ddem_core::counted;
use ddem_core::problem::{Lattice, Set, Sets, Vec3};

/// Whole blocks that a curved or slanted `where` has selected.
#[derive(Clone, Debug, PartialEq)]
pub struct Selection {
    /// Place of the entry in the deck, as in `remove[0]`.
    pub entry: String,
    /// Action on the blocks, as in "excavate `tunnel`".
    pub what: String,
    /// Number of blocks.
    pub blocks: usize,
    /// Volume of their cells, including half of the surrounding joints `[m³]`.
    pub volume: f64,
    /// Name of the shape: sphere, cylinder, surface, half-space, topography, box, or shapes for
    /// several of them.
    pub shape: &'static str,
    /// Volume of the shape `[m³]`, of cylinders and half-spaces only within the sets of blocks;
    /// `None` if unknown.
    pub holds: Option<f64>,
    /// True if parts of the shape lie outside of the sets of blocks.
    pub sticks_out: bool,
}

impl fmt::Display for Selection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { what, blocks, volume, shape, holds, sticks_out, .. } = self;
        write!(f, "{what}: {}, {} m³", counted(*blocks, "block"), shown(*volume))?;
        let Some(holds) = holds else { return Ok(()) };
        let out = if *sticks_out { ", in part outside of the blocks" } else { "" };
        let hold = if *shape == "shapes" { "hold" } else { "holds" };
        write!(f, " (the {shape} {hold} {} m³{out})", shown(*holds))
    }
}

/// Volume as text with four digits.
fn shown(volume: f64) -> String {
    if !(1e-3..1e7).contains(&volume) && volume != 0.0 {
        return format!("{volume:.3e}");
    }
    let digits = (3.0 - libm::log10(volume.max(1e-3)).floor()).max(0.0) as usize;
    let text = format!("{volume:.digits$}");
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text,
    }
}

impl Selection {
    /// Selection of the blocks in a selector; `None` if the selector consists of planes and ranges
    /// along the edges of the blocks.
    pub(crate) fn new(
        (entry, what): (String, String),
        selector: &Selector,
        sets: &Sets,
        lattices: &[Arc<Lattice>],
    ) -> Option<Self> {
        let own = || lattices.iter().filter(|lattice| selector.has_set(lattice.set));
        let shape = selector.shape(own().any(|lattice| !lattice.is_box()))?;
        let (mut blocks, mut volume) = (0, 0.0);
        for lattice in own() {
            let selected =
                |&at: &usize| lattice.has_block(at) && selector.selects(lattice, lattice.cell(at));
            for at in (0..lattice.block.len()).filter(selected) {
                blocks += 1;
                volume += cell_volume(lattice, lattice.cell(at));
            }
        }
        let (holds, sticks_out) = selector.holds(sets).unzip();
        let sticks_out = sticks_out.unwrap_or(false);
        Some(Self { entry, what, blocks, volume, shape, holds, sticks_out })
    }
}

/// Volume of a cell, including half of the surrounding gaps `[m³]`.
fn cell_volume(lattice: &Lattice, cell: [usize; 3]) -> f64 {
    let [a, b, c] = &lattice.axes;
    a.dot(&b.cross(c)) * (0..3).map(|d| lattice.lengths[d][cell[d]]).product::<f64>()
}

impl Selector {
    /// Name of the shape, if it is curved or slanted.
    fn shape(&self, turned: bool) -> Option<&'static str> {
        let ranges = self.ranges.iter().any(Option::is_some);
        let shapes = [
            (self.sphere.is_some(), "sphere"),
            (self.cylinder.is_some(), "cylinder"),
            (self.solid.is_some(), "surface"),
            (!self.half_spaces.is_empty(), "half-space"),
            (!self.terrains.is_empty(), "topography"),
        ];
        let mut there = shapes.into_iter().filter(|(there, _)| *there).map(|(_, name)| name);
        match (there.next(), there.next()) {
            (None, _) => (ranges && turned).then_some("box"),
            (Some(name), None) if !ranges => Some(name),
            _ => Some("shapes"),
        }
    }

    /// Volume of the shape `[m³]`, and true if parts of it lie outside of the sets of blocks.
    fn holds(&self, sets: &Sets) -> Option<(f64, bool)> {
        if !self.planes.is_empty() || !self.terrains.is_empty() {
            return None;
        }
        let ranges = || self.ranges.iter().any(Option::is_some);
        match (self.sphere, self.cylinder, &self.solid) {
            (Some((centre, radius)), None, None) if self.half_spaces.is_empty() && !ranges() => {
                let [low, high] = [-radius, radius].map(|r| centre.add_scalar(r));
                let volume = 4.0 / 3.0 * std::f64::consts::PI * radius.powi(3);
                Some((volume, self.sticks_out([low, high], sets)))
            }
            (None, None, Some(solid)) if self.half_spaces.is_empty() && !ranges() => {
                Some((solid.volume()?, self.sticks_out(solid.bounds(), sets)))
            }
            (None, cylinder, None) => Some((self.flat_parts(cylinder, sets), false)),
            _ => None,
        }
    }

    /// True if a box extends beyond the box around the sets.
    fn sticks_out(&self, [low, high]: [Vec3; 2], sets: &Sets) -> bool {
        let bounds = bounds_of_sets(sets, |set| self.has_set(set));
        (0..3).any(|k| {
            low[k] < bounds[0][k] - self.tolerance[k] || high[k] > bounds[1][k] + self.tolerance[k]
        })
    }

    /// Volume of the sets, or of a cylinder in them, within the ranges and half-spaces `[m³]`.
    fn flat_parts(&self, cylinder: Option<([Vec3; 2], f64)>, sets: &Sets) -> f64 {
        let ends = (0..3).filter_map(|k| self.ranges[k].map(|ends| (k, ends)));
        let ends = ends.flat_map(|(k, [from, to])| {
            let normal = Vec3::ith(k, 1.0);
            [
                PlaneEquation { normal: -normal, at: -from, tolerance: 0.0 },
                PlaneEquation { normal, at: to, tolerance: 0.0 },
            ]
        });
        let flats: Vec<PlaneEquation> = ends
            .filter(|flat| flat.at.is_finite())
            .chain(self.half_spaces.iter().copied())
            .collect();
        let sets = sets.list.iter().enumerate().filter(|(set, _)| self.has_set(*set));
        let part = |set: &Set| match cylinder {
            Some((ends, radius)) => {
                let whole = Convex::cylinder(&ends, radius);
                sides(set).iter().chain(&flats).fold(whole, |part, flat| part.cut(flat))
            }
            None => {
                let whole = Convex::parallelepiped(&set.corners);
                flats.iter().fold(whole, |part, flat| part.cut(flat))
            }
        };
        sets.map(|(_, set)| part(set).volume()).sum()
    }
}
