//! Supports and loads: from `where` to nodes, and which are in force in a stage.

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

use crate::deck::{Deck, Where};
use crate::error::{Fault, RunError};
use crate::geometry::{Geometry, Region, Vec3, no_node, nothing};
use crate::history::{Course, Function};
use crate::lanes::LANES;
use crate::pack::Packs;

/// From the start of one stage up to the start of another.
#[derive(Clone, Debug)]
pub(crate) struct Period {
    from: Option<usize>,
    until: Option<usize>,
}

impl Period {
    pub(crate) fn new(deck: &Deck, from: Option<&String>, until: Option<&String>) -> Self {
        let stage = |name: &String| deck.stage.iter().position(|s| s.name == *name);
        Self { from: from.and_then(stage), until: until.and_then(stage) }
    }

    pub(crate) fn has(&self, stage: usize) -> bool {
        self.from.is_none_or(|from| stage >= from) && self.until.is_none_or(|until| stage < until)
    }
}

/// One `[[fix]]`.
#[derive(Clone, Debug)]
pub(crate) struct Fixed {
    nodes: Vec<u32>,
    axes: [bool; 3],
    velocity: [f64; 3],
    history: Course,
    period: Period,
}

/// One `[[load]]`: nodal forces `[N]` at factor 1.
#[derive(Clone, Debug)]
pub(crate) struct Loaded {
    pub(crate) forces: Vec<(u32, Vec3)>,
    history: Course,
    period: Period,
}

/// All supports and loads of a model.
#[derive(Clone, Debug, Default)]
pub(crate) struct Conditions {
    pub(crate) fixed: Vec<Fixed>,
    pub(crate) loaded: Vec<Loaded>,
}

impl Conditions {
    pub(crate) fn new(deck: &Deck, geometry: &Geometry) -> Result<Self, Vec<Fault>> {
        let names: Vec<_> = deck.blocks.iter().map(|set| set.name.as_deref()).collect();
        let region = |r: &Where| Region::new(r, &geometry.bounds, &names);
        let mut faults = Vec::new();
        let mut conditions = Self::default();
        for (index, fix) in deck.fix.iter().enumerate() {
            let nodes = region(&fix.region).nodes(geometry);
            if nodes.is_empty() {
                let region = region(&fix.region);
                faults.push(no_node(format!("fix[{index}].where"), &region, geometry));
            }
            conditions.fixed.push(Fixed {
                nodes,
                axes: ['x', 'y', 'z'].map(|axis| fix.axes.contains(axis)),
                velocity: fix.velocity.unwrap_or_default(),
                history: Course::new(fix.history.as_ref()),
                period: Period::new(deck, fix.from.as_ref(), fix.until.as_ref()),
            });
        }
        for (index, load) in deck.load.iter().enumerate() {
            match nodal_forces(load, &region(&load.region), geometry) {
                Ok(forces) => conditions.loaded.push(Loaded {
                    forces,
                    history: Course::new(load.history.as_ref()),
                    period: Period::new(deck, load.from.as_ref(), load.until.as_ref()),
                }),
                Err("no node") => {
                    let region = region(&load.region);
                    faults.push(no_node(format!("load[{index}].where"), &region, geometry));
                }
                Err(what) => faults.push(nothing(format!("load[{index}].where"), what)),
            }
        }
        for (index, initial) in deck.initial.iter().enumerate() {
            let region = region(&initial.region);
            if region.nodes(geometry).is_empty() {
                faults.push(no_node(format!("initial[{index}].where"), &region, geometry));
            }
        }
        if faults.is_empty() { Ok(conditions) } else { Err(faults) }
    }

    /// A load or a driven support that goes with time as a program says.
    ///
    /// # Errors
    ///
    /// The deck has no such entry, or a support that stands still.
    pub(crate) fn set_history(
        &mut self,
        (section, index): (&str, usize),
        function: Arc<Function>,
    ) -> Result<(), Fault> {
        let course = match section {
            "load" => self.loaded.get_mut(index).map(|load| &mut load.history),
            _ => self.fixed.get_mut(index).map(|fix| &mut fix.history),
        };
        let place = format!("{section}[{index}].history");
        let course = course.ok_or_else(|| Fault::new(place, "the deck has no such entry"))?;
        *course = Course::Computed(function);
        Ok(())
    }

    /// Factor of each load in a stage, at a time, given the times at which stages began; then 1 for
    /// what programs apply.
    pub(crate) fn factors(
        &self,
        stage: usize,
        time: f64,
        starts: &[f64],
    ) -> Result<Vec<f64>, RunError> {
        let mut factors = Vec::with_capacity(self.loaded.len() + 2);
        for (index, load) in self.loaded.iter().enumerate() {
            factors.push(match load.period.has(stage) {
                true => load.period.factor(&load.history, time, starts).at("load", index)?,
                false => 0.0,
            });
        }
        factors.push(1.0);
        Ok(factors)
    }

    /// Loads in force in a stage whose history is 0 when the stage is the first to see them.
    pub(crate) fn resting(&self, stage: usize) -> Vec<usize> {
        let rests = |load: &Loaded| {
            let first = load.period.from.unwrap_or(0) == stage;
            let zero =
                matches!(&load.history, Course::Given(history) if history.factor(0.0) == 0.0);
            load.period.has(stage) && first && zero
        };
        (0..self.loaded.len()).filter(|&load| rests(&self.loaded[load])).collect()
    }

    /// Supports that hold all directions of their nodes, by their numbers in the deck.
    pub(crate) fn clamped(&self) -> impl Iterator<Item = (usize, &[u32])> {
        let fixed = self.fixed.iter().enumerate();
        fixed.filter(|(_, fix)| fix.axes == [true; 3]).map(|(i, fix)| (i, fix.nodes.as_slice()))
    }

    /// Loads in force at a time whose history is 0 then.
    pub(crate) fn idle(&self, stage: usize, time: f64, starts: &[f64]) -> Vec<usize> {
        let factors = self.factors(stage, time, starts).unwrap_or_default();
        let varies = |load: &Loaded| !matches!(load.history, Course::Constant);
        let idle = |&index: &usize| {
            let load = &self.loaded[index];
            load.period.has(stage) && varies(load) && factors.get(index) == Some(&0.0)
        };
        (0..self.loaded.len()).filter(idle).collect()
    }

    /// Velocity of each fix at a time `[m/s]`.
    pub(crate) fn velocities(&self, time: f64, starts: &[f64]) -> Result<Vec<[f64; 3]>, RunError> {
        let velocity = |(index, fix): (usize, &Fixed)| {
            let factor = fix.period.factor(&fix.history, time, starts).at("fix", index)?;
            Ok(fix.velocity.map(|v| v * factor))
        };
        self.fixed.iter().enumerate().map(velocity).collect()
    }
}

/// A factor, or at what time and why there is none.
pub(crate) struct Factor(Result<f64, (f64, String)>);

impl Factor {
    pub(crate) fn at(self, section: &str, index: usize) -> Result<f64, RunError> {
        self.0.map_err(|(time, message)| RunError::History {
            entry: format!("{section}[{index}]"),
            time,
            message,
        })
    }
}

impl Period {
    /// Factor of a history that counts time from the start of the stage named in `from`.
    pub(crate) fn factor(&self, history: &Course, time: f64, starts: &[f64]) -> Factor {
        let start = self.from.and_then(|stage| starts.get(stage)).copied().unwrap_or(0.0);
        Factor(history.factor(time - start).map_err(|message| (time - start, message)))
    }
}

/// The forces of one load on its nodes, or what was looked for in vain.
fn nodal_forces(
    load: &crate::deck::Load,
    region: &Region,
    geometry: &Geometry,
) -> Result<Vec<(u32, Vec3)>, &'static str> {
    let forces: Vec<(u32, Vec3)> = if let Some(line) = load.line {
        let lengths = region
            .lengths(geometry)
            .ok_or("a line needs planes on two axes, and blocks with an edge along the third")?;
        lengths.into_iter().map(|(node, length)| (node, Vec3::from(line) * length)).collect()
    } else if let Some(force) = load.force {
        let weights = region.weights(geometry);
        let total: f64 = weights.iter().map(|(_, weight)| weight).sum();
        weights.into_iter().map(|(node, w)| (node, Vec3::from(force) * (w / total))).collect()
    } else {
        let surfaces = region.surfaces(geometry);
        if surfaces.iter().any(|surface| region.cuts_askew(geometry, surface)) {
            return Err("a range cuts an oblique face askew, which cannot be loaded in part");
        }
        let of = |surface: &crate::geometry::Surface| {
            let traction = match (load.traction, load.pressure) {
                (Some(traction), _) => Vec3::from(traction),
                (None, pressure) => -surface.outward(geometry) * pressure.unwrap_or(0.0),
            };
            let areas = region.areas(geometry, surface).into_iter();
            areas.map(move |(node, area)| (node, traction * area)).collect::<Vec<_>>()
        };
        surfaces.iter().flat_map(of).collect()
    };
    let what = match (load.line, load.force) {
        (Some(_), _) => "no node lies on that line",
        (None, Some(_)) => "no node",
        _ => "no outer face of a block",
    };
    if forces.is_empty() { Err(what) } else { Ok(forces) }
}

/// One supported degree of freedom.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Support {
    /// Place in a nodal field.
    pub(crate) at: u32,
    pub(crate) lane: u8,
    pub(crate) axis: u8,
    /// The fix whose velocity it has.
    pub(crate) fix: u32,
    pub(crate) node: u32,
}

/// Forces that programs apply to nodes `[N]`, by node.
pub(crate) type Applied = BTreeMap<u32, [f64; 3]>;

/// One load on one node.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NodalLoad {
    /// Place of the x component in a nodal field.
    pub(crate) at: u32,
    pub(crate) lane: u8,
    pub(crate) load: u32,
    pub(crate) force: [f64; 3],
}

/// What is in force in one stage, sorted by pack.
#[derive(Clone, Debug, Default)]
pub(crate) struct Active {
    pub(crate) supports: Vec<Support>,
    pub(crate) loads: Vec<NodalLoad>,
    support_start: Vec<u32>,
    load_start: Vec<u32>,
    /// Bodies by pack and lane that have supports.
    pub(crate) held_bodies: Vec<[bool; LANES]>,
}

impl Active {
    pub(crate) fn new(
        conditions: &Conditions,
        geometry: &Geometry,
        packs: &Packs,
        stage: usize,
        applied: &Applied,
    ) -> Self {
        let place = |node: u32| {
            let (body, at) = geometry.locate(node as usize);
            let (pack, lane) = packs.slot(body);
            let n = geometry.lattice(body).divisions + 1;
            let local = at[0] + n * (at[1] + n * at[2]);
            (pack, 3 * (packs.packs[pack].start + local) as u32, lane as u8)
        };
        let mut supports = Vec::new();
        for (fix, entry) in conditions.fixed.iter().enumerate() {
            if entry.period.has(stage) {
                for &node in &entry.nodes {
                    let (pack, at, lane) = place(node);
                    for axis in (0..3u8).filter(|&axis| entry.axes[axis as usize]) {
                        let at = at + u32::from(axis);
                        supports.push((pack, Support { at, lane, axis, fix: fix as u32, node }));
                    }
                }
            }
        }
        // Where two entries hold the same degree of freedom, the later one has the last word.
        supports.sort_by_key(|(pack, s)| (*pack, s.at, s.lane, std::cmp::Reverse(s.fix)));
        supports.dedup_by_key(|(_, s)| (s.at, s.lane));
        let mut loads = Vec::new();
        for (index, entry) in conditions.loaded.iter().enumerate() {
            if entry.period.has(stage) {
                for &(node, force) in &entry.forces {
                    let (pack, at, lane) = place(node);
                    let force = force.into();
                    loads.push((pack, NodalLoad { at, lane, load: index as u32, force }));
                }
            }
        }
        for (&node, &force) in applied {
            let (pack, at, lane) = place(node);
            loads.push((pack, NodalLoad { at, lane, load: conditions.loaded.len() as u32, force }));
        }
        loads.sort_by_key(|(pack, l)| (*pack, l.at, l.lane, l.load));
        let n = packs.packs.len();
        let mut held_bodies = vec![[false; LANES]; n];
        for (pack, support) in &supports {
            held_bodies[*pack][support.lane as usize] = true;
        }
        Self {
            held_bodies,
            support_start: starts(n, supports.iter().map(|s| s.0)),
            load_start: starts(n, loads.iter().map(|l| l.0)),
            supports: supports.into_iter().map(|s| s.1).collect(),
            loads: loads.into_iter().map(|l| l.1).collect(),
        }
    }

    /// Places of the supports of a pack.
    pub(crate) fn supports_of(&self, pack: usize) -> Range<usize> {
        self.support_start[pack] as usize..self.support_start[pack + 1] as usize
    }

    /// Place of the first support of a pack; one past the last pack is allowed.
    pub(crate) fn first_support(&self, pack: usize) -> usize {
        self.support_start[pack] as usize
    }

    pub(crate) fn loads_of(&self, pack: usize) -> &[NodalLoad] {
        &self.loads[self.load_start[pack] as usize..self.load_start[pack + 1] as usize]
    }

    /// The force of a load on a node, by its pack, place and lane, if it has one.
    pub(crate) fn force_mut(
        &mut self,
        (pack, at, lane): (usize, u32, u8),
        load: u32,
    ) -> Option<&mut [f64; 3]> {
        let range = self.load_start[pack] as usize..self.load_start[pack + 1] as usize;
        let loads = &mut self.loads[range];
        let found = loads.binary_search_by_key(&(at, lane, load), |l| (l.at, l.lane, l.load));
        found.ok().map(|found| &mut loads[found].force)
    }

    /// The support of a degree of freedom, by its pack, place and lane: its number.
    pub(crate) fn support_at(&self, pack: usize, at: u32, lane: u8) -> Option<usize> {
        let range = self.supports_of(pack);
        let key = |s: &Support| (s.at, s.lane);
        let found = self.supports[range.clone()].binary_search_by_key(&(at, lane), key);
        found.ok().map(|found| range.start + found)
    }

    /// Nodes and axes that are held.
    pub(crate) fn held(&self) -> impl Iterator<Item = (u32, usize)> + '_ {
        self.supports.iter().map(|s| (s.node, s.axis as usize))
    }
}

/// Where each pack's entries begin in a list sorted by pack, shape `(n + 1)`.
pub(crate) fn starts(n: usize, packs: impl Iterator<Item = usize>) -> Vec<u32> {
    let mut starts = vec![0; n + 1];
    packs.for_each(|pack| starts[pack + 1] += 1);
    for pack in 0..n {
        starts[pack + 1] += starts[pack];
    }
    starts
}

#[cfg(test)]
mod tests;
