//! §10: non-reflecting boundaries. What is in the deck, and what it comes to at the nodes.
//!
//! Dashpots of Lysmer and Kuhlemeyer: a face with the outward normal n answers the velocity v of its
//! rock with the traction `−ρ c_P v_n n − ρ c_S v_s`. A wave that meets it head-on leaves; one that is to
//! come in with the velocity w is made by the traction `2 ρ c w`.

mod beside;
mod column;
mod faces;
mod outside;

use std::collections::{BTreeSet, HashSet};
use std::sync::Arc;

use nalgebra::Matrix3;

use crate::assembly::Assembly;
use crate::conditions::{Active, Applied, Conditions};
use crate::deck::{Boundary, BoundaryKind, Deck, Period, Stage, StageKind};
use crate::element::Elastic;
use crate::error::{Fault, RunError};
use crate::geometry::{Geometry, Region, Stages, Surface, Vec3, nothing};
use crate::history::{Course, Function};
use crate::pack::Packs;
use crate::properties::Properties;

pub(crate) use column::{Column, Moving, Pace};
use column::{Ground, Side};
use faces::with_areas;
pub(crate) use outside::{Dashpot, Outside};

/// A matrix of damping `[N s/m]`, or of impedance `[Pa s/m]`.
pub(crate) type Resistance = Matrix3<f64>;

/// What acts on a node from outside, besides its dashpots `[N]`.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Push {
    /// What acts whatever moves, and stresses of the free field.
    pub(crate) force: Vec3,
    /// What dashpots do that are moved from outside, `C w`: no local damping takes a part of it.
    pub(crate) wave: Vec3,
}

/// One `[[boundary]]`.
#[derive(Clone, Debug)]
pub(crate) struct Border {
    /// Dashpots by face and node, a node as often as it has faces `[N s/m]`.
    pub(crate) dashpots: Vec<(u32, Resistance)>,
    /// Faces that it takes, how much of them and how much there is `[m²]`.
    faces: Vec<(Surface, [f64; 2])>,
    /// Nodes of faces that look down.
    under: BTreeSet<u32>,
    /// Velocity of the wave that comes in `[m/s]`.
    wave: Option<Vec3>,
    history: Course,
    period: Period,
    /// Free-field columns, and where the model hangs on them.
    pub(crate) columns: Vec<Column>,
    pub(crate) sides: Vec<Side>,
}

/// All boundaries of a model.
#[derive(Clone, Debug, Default)]
pub(crate) struct Borders {
    pub(crate) list: Vec<Border>,
}

/// What boundaries are made of.
#[derive(Clone, Copy)]
pub(crate) struct Made<'a> {
    pub(crate) deck: &'a Deck,
    pub(crate) geometry: &'a Geometry,
    pub(crate) stages: &'a Stages,
    pub(crate) packs: &'a Packs,
    pub(crate) properties: &'a Properties,
}

impl Made<'_> {
    /// What there is in a stage.
    fn at(self, stage: usize) -> Self {
        Self { geometry: self.stages.at(stage), ..self }
    }

    /// What there is where a boundary of the deck comes into force.
    fn for_border(self, index: usize) -> Self {
        let from = self.deck.boundary[index].from.as_ref();
        Self { geometry: self.stages.from(self.deck, from), ..self }
    }
}

impl Borders {
    pub(crate) fn new(made: Made<'_>, conditions: &Conditions) -> Result<Self, Vec<Fault>> {
        let (mut faults, mut list) = (Vec::new(), Vec::new());
        let mut first = 0;
        for (index, entry) in made.deck.boundary.iter().enumerate() {
            match Border::new(made.for_border(index), index, entry, &mut first) {
                Ok(border) => list.push(border),
                Err(fault) => faults.push(fault),
            }
        }
        if !faults.is_empty() {
            return Err(faults);
        }
        let borders = Self { list };
        let mut faults = borders.twice(made);
        faults.extend(borders.idle(made, conditions));
        if faults.is_empty() { Ok(borders) } else { Err(faults) }
    }

    /// Nodes of all columns.
    pub(crate) fn column_nodes(&self) -> usize {
        let columns = self.list.iter().flat_map(|border| &border.columns);
        columns.map(|column| column.nodes.len()).sum()
    }

    /// Whether a boundary is in force in a stage.
    pub(crate) fn has(&self, border: usize, stage: usize) -> bool {
        self.list[border].period.has(stage)
    }

    /// Takes down what damping needs of the ground that columns are made of, before anything is taken out.
    pub(crate) fn note_ground(&mut self, packs: &Packs, assembly: &Assembly) {
        let columns = self.list.iter_mut().flat_map(|border| &mut border.columns);
        columns.for_each(|column| column.note_ground(packs, assembly));
    }

    /// Factor of each boundary's wave at a time, given the times at which stages began.
    pub(crate) fn factors(
        &self,
        stage: usize,
        time: f64,
        starts: &[f64],
    ) -> Result<Vec<f64>, RunError> {
        let factor = |(index, border): (usize, &Border)| match border.period.has(stage) {
            true => border.period.factor(&border.history, time, starts).at("boundary", index),
            false => Ok(0.0),
        };
        self.list.iter().enumerate().map(factor).collect()
    }

    /// Whether any wave may change after a time.
    pub(crate) fn change_after(&self, (stage, time): (usize, f64), starts: &[f64]) -> bool {
        let changes = |border: &Border| {
            let since = border.period.since(time, starts);
            border.period.has(stage) && border.history.changes_after(since)
        };
        self.list.iter().any(changes)
    }

    /// A wave that goes with time as a program says.
    ///
    /// # Errors
    ///
    /// The deck has no such boundary, or it has no wave.
    pub(crate) fn set_history(
        &mut self,
        index: usize,
        function: Arc<Function>,
    ) -> Result<(), Fault> {
        let border = self.list.get_mut(index).filter(|border| border.wave.is_some());
        let fault =
            || Fault::new(format!("boundary[{index}].history"), "the deck has no such wave");
        border.ok_or_else(fault)?.history = Course::Computed(function);
        Ok(())
    }

    /// Takes over the histories of the same boundaries, some of which a program may compute.
    pub(crate) fn take_histories(&mut self, from: &Self) {
        let both = self.list.iter_mut().zip(&from.list);
        both.for_each(|(own, other)| own.history.clone_from(&other.history));
    }

    /// Forces that go on where supports end at boundaries: what held a node before a stage, besides
    /// what went on there already.
    pub(crate) fn kept(
        &self,
        stage: usize,
        before: (&Active, &[f64], &Applied),
        after: &Active,
    ) -> Applied {
        let (active, reactions, kept) = before;
        let here = self.list.iter().filter(|border| border.period.has(stage));
        let mut forces: Applied =
            here.flat_map(|border| &border.dashpots).map(|(node, _)| (*node, [0.0; 3])).collect();
        for (node, force) in &mut forces {
            *force = kept.get(node).copied().unwrap_or_default();
        }
        let held: HashSet<(u32, usize)> = after.held().collect();
        for (support, reaction) in active.supports.iter().zip(reactions) {
            let axis = usize::from(support.axis);
            if let Some(force) = forces.get_mut(&support.node)
                && !held.contains(&(support.node, axis))
            {
                force[axis] += reaction;
            }
        }
        forces.retain(|_, force| *force != [0.0; 3]);
        forces
    }

    /// Faults of boundaries all of whose nodes are held, and of columns that stand on nothing.
    fn idle(&self, made: Made<'_>, conditions: &Conditions) -> Vec<Fault> {
        let mut faults = Vec::new();
        if self.list.is_empty() {
            return faults;
        }
        for stage in 0..made.deck.stage.len().max(1) {
            let (made, none) = (made.at(stage), Applied::default());
            let active = Active::new(conditions, made.geometry, made.packs, stage, &none);
            let outside = Outside::new(self, made, (conditions, stage, &active), &none);
            let name = made.deck.stage.get(stage).map_or("", |stage| &stage.name);
            for index in (0..self.list.len()).filter(|&index| self.has(index, stage)) {
                let held = outside.clamped(made, &self.list[index]);
                if held.all() {
                    faults.push(
                        Fault::new(
                            format!("boundary[{index}]"),
                            format!(
                                "all {} nodes of this boundary are held in all directions in stage \
                                 `{name}`, by {}: no dashpot there can move",
                                held.nodes,
                                held.names()
                            ),
                        )
                        .help(
                            "`until` ends the fix at the start of the stage from which (`from`) the \
                             boundary is there; what the fix bore goes on as constant forces",
                        ),
                    );
                }
                if let Some(column) = outside.floating(index, &self.list[index]) {
                    let [x, y, z] = point(made, column.nodes[0]);
                    faults.push(
                        Fault::new(
                            format!("boundary[{index}]"),
                            format!(
                                "the free-field column at ({x}, {y}, {z}) stands on nothing in \
                                 stage `{name}`"
                            ),
                        )
                        .help(
                            "give the base of the model a boundary of kind \"viscous\", or fix it",
                        ),
                    );
                }
            }
            if !faults.is_empty() {
                break;
            }
        }
        faults
    }

    /// What is said of boundaries that are held in part.
    pub(crate) fn doubts(&self, made: Made<'_>, conditions: &Conditions) -> Vec<String> {
        let mut doubts = self.in_cavities(made);
        let stage = |stage| made.deck.stage.get(stage);
        let moves = |at| stage(at).is_none_or(|stage: &Stage| stage.kind == StageKind::Dynamic);
        for index in 0..self.list.len() {
            let stages = 0..made.deck.stage.len().max(1);
            for stage in stages.filter(|&stage| self.has(index, stage)) {
                let (made, none) = (made.at(stage), Applied::default());
                let active = Active::new(conditions, made.geometry, made.packs, stage, &none);
                let outside = Outside::new(self, made, (conditions, stage, &active), &none);
                let held = outside.clamped(made, &self.list[index]);
                if let Some(first) = held.first {
                    let [x, y, z] = point(made, first);
                    doubts.push(format!(
                        "boundary {index}: {} of its {} nodes are held in all directions by {}, first \
                         that at ({x}, {y}, {z}): no dashpot there can move",
                        held.count,
                        held.nodes,
                        held.names()
                    ));
                    break;
                }
                // A base that waves come in by may bear the weight.
                let side = self.list[index].wave.is_none() && moves(stage);
                let across = outside.held_across(made, &self.list[index]).filter(|_| side);
                if let Some((axis, fix)) = across {
                    let name = made.deck.stage.get(stage).map_or("", |stage| &stage.name);
                    doubts.push(format!(
                        "boundary {index}: fix {fix} holds its nodes along {}, its normal, in stage `{name}`: \
                         what comes straight to it goes back (`until` ends a fix, and what it bore goes on)",
                        ["x", "y", "z"][axis]
                    ));
                    break;
                }
            }
        }
        doubts
    }
}

impl Border {
    fn new(
        made: Made<'_>,
        index: usize,
        entry: &Boundary,
        first: &mut usize,
    ) -> Result<Self, Fault> {
        let Made { deck, geometry, properties, .. } = made;
        let start = made.stages.at(0);
        let region = Region::new(&entry.region, &geometry.frame);
        let place = format!("boundary[{index}]");
        let surfaces = surfaces(&region, geometry, &place)?;
        let mut border = Self {
            dashpots: Vec::new(),
            faces: with_areas(&region, made, &surfaces),
            under: BTreeSet::new(),
            wave: entry.velocity.map(Vec3::from),
            history: Course::new(entry.history.as_ref()),
            period: Period::new(deck, entry.from.as_ref(), entry.until.as_ref()),
            columns: Vec::new(),
            sides: Vec::new(),
        };
        if entry.kind == BoundaryKind::FreeField {
            let mut ground = Ground::new(made, first);
            for surface in &surfaces {
                ground.stand(&region, surface, &place)?;
            }
            (border.columns, border.sides) = ground.done();
            border.dashpots =
                border.sides.iter().map(|side| (side.node, side.resistance)).collect();
            return Ok(border);
        }
        // Columns go on below what has been taken out.
        for (ground, surfaces) in [(geometry, &surfaces), (start, &region.surfaces(start))] {
            let below = surfaces.iter().filter(|face| face.outward(ground).z < 1e-9 - 1.0);
            let areas = below.flat_map(|face| region.areas(ground, face));
            border.under.extend(areas.map(|(node, _)| node));
        }
        for surface in &surfaces {
            let impedance = impedance(geometry, properties, surface);
            let areas = region.areas(geometry, surface).into_iter();
            border.dashpots.extend(areas.map(|(node, area)| (node, impedance * area)));
        }
        Ok(border)
    }
}

/// The outer faces of deformable blocks that a boundary selects.
fn surfaces(region: &Region, geometry: &Geometry, place: &str) -> Result<Vec<Surface>, Fault> {
    let surfaces = region.surfaces(geometry);
    let place = format!("{place}.where");
    if surfaces.is_empty() {
        let inside = !region.nodes(geometry).is_empty();
        let what = "no outer face of a block";
        let fault = nothing(place, what);
        return Err(match inside {
            true => fault.help(
                "the nodes there are inside of the model or at a joint: a boundary takes faces without a \
                 neighbour, on every plane given",
            ),
            false => fault,
        });
    }
    if surfaces.iter().any(|surface| region.cuts_askew(geometry, surface)) {
        let message = "a range cuts an oblique face askew, which cannot be taken in part";
        return Err(Fault::new(place, message));
    }
    if surfaces.iter().any(|surface| geometry.lattice(surface.body).rigid) {
        let message = "selects faces of rigid blocks: waves go through deformable ones only";
        return Err(Fault::new(place, message).help(
            "leave the boundary out, or make the blocks along it a set with `body = \"deformable\"`",
        ));
    }
    Ok(surfaces)
}

/// `ρ c_P n nᵀ + ρ c_S (1 − n nᵀ)` of the block behind a face `[Pa s/m]`.
fn impedance(geometry: &Geometry, properties: &Properties, surface: &Surface) -> Resistance {
    let rock = &properties.materials[geometry.bodies[surface.body].material as usize];
    resistance(rock, &surface.outward(geometry))
}

/// That of a rock behind a face with the normal n.
fn resistance(rock: &Elastic, n: &Vec3) -> Resistance {
    let along = n * n.transpose();
    let [p, s] = [rock.p_speed(), rock.s_speed()].map(|speed| rock.density * speed);
    along * p + (Resistance::identity() - along) * s
}

/// Reference position of a node `[m]`.
fn point(made: Made<'_>, node: u32) -> [f64; 3] {
    let (body, at) = made.geometry.locate(node as usize);
    made.geometry.position(body, at).into()
}
