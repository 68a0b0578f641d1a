//! §10: non-reflecting boundaries.
//!
//! Dashpots of Lysmer and Kuhlemeyer: a face with the outward normal n answers the velocity v of its
//! rock with the traction `−ρ c_P v_n n − ρ c_S v_s`. A wave that meets it head-on leaves; one that is to
//! come in with the velocity w is made by the traction `2 ρ c w`.

mod beside;
mod column;
mod outside;

use std::collections::{BTreeSet, HashSet};
use std::sync::Arc;

use nalgebra::Matrix3;

use crate::error::{Fault, RunError};
use crate::model::conditions::{Active, Applied};
use crate::model::history::{Course, Function};
use crate::model::stage::Period;
use ddem_mechanics::element::Elastic;
use ddem_mesh::assembly::Assembly;
use ddem_mesh::pack::Packs;
use ddem_mesh::properties::Properties;
use ddem_mesh::{BlockFace, Geometry, Vec3};

pub use column::{Column, Ground, NoColumn, Side};
pub(crate) use column::{Moving, Pace};
pub(crate) use outside::{Dashpot, Outside};

/// A matrix of damping `[N s/m]`, or of impedance `[Pa s/m]`.
pub type Resistance = Matrix3<f64>;

/// What acts on a node from outside, besides its dashpots `[N]`.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Push {
    /// What acts whatever moves, and stresses of the free field.
    pub(crate) force: Vec3,
    /// What dashpots do that are moved from outside, `C w`: no local damping takes a part of it.
    pub(crate) wave: Vec3,
}

/// One boundary.
#[derive(Clone, Debug)]
pub struct Border {
    /// Dashpots by face and node, a node as often as it has faces `[N s/m]`.
    pub dashpots: Vec<(u32, Resistance)>,
    /// Faces that it takes, how much of them and how much there is `[m²]`.
    pub faces: Vec<(BlockFace, [f64; 2])>,
    /// Nodes of faces that look down.
    pub under: BTreeSet<u32>,
    /// Velocity of the wave that comes in `[m/s]`.
    pub wave: Option<Vec3>,
    /// Factor in time of the wave.
    pub history: Course,
    /// Stages in which it is in force.
    pub period: Period,
    /// Free-field columns, and where the model hangs on them.
    pub columns: Vec<Column>,
    /// Nodes that hang on the columns.
    pub sides: Vec<Side>,
}

/// All boundaries of a model.
#[derive(Clone, Debug, Default)]
pub struct Borders {
    /// In the order of the problem.
    pub list: Vec<Border>,
}

/// What boundaries act on.
#[derive(Clone, Copy)]
pub(crate) struct Made<'a> {
    /// What is where now.
    pub(super) geometry: &'a Geometry,
    /// What was where at the start.
    pub(super) start: &'a Geometry,
    pub(super) packs: &'a Packs,
}

impl Borders {
    /// Nodes of all columns.
    pub(crate) fn column_nodes(&self) -> usize {
        let columns = self.list.iter().flat_map(|border| &border.columns);
        columns.map(|column| column.nodes.len()).sum()
    }

    /// Whether a boundary is in force in a stage.
    pub fn has(&self, border: usize, stage: usize) -> bool {
        self.list[border].period.has(stage)
    }

    /// Takes down where the nodes are that columns stand behind, and what damping needs of the ground that they
    /// are made of, before anything is taken out.
    pub(super) fn note_ground(&mut self, made: Made<'_>, assembly: &Assembly) {
        let columns = self.list.iter_mut().flat_map(|border| &mut border.columns);
        columns.for_each(|column| column.note_ground(made, assembly));
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
    pub(crate) fn change_after(&self, stage: usize, time: f64, starts: &[f64]) -> bool {
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
    /// There is no such boundary, or it has no wave.
    pub(super) fn set_history(
        &mut self,
        index: usize,
        function: Arc<Function>,
    ) -> Result<(), Fault> {
        let border = self.list.get_mut(index).filter(|border| border.wave.is_some());
        let fault = || Fault::new(format!("boundary[{index}].history"), "there is no such wave");
        border.ok_or_else(fault)?.history = Course::Computed(function);
        Ok(())
    }

    /// Takes over the histories of the same boundaries, some of which a program may compute.
    pub(super) fn take_histories(&mut self, from: &Self) {
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
}

/// `ρ c_P n nᵀ + ρ c_S (1 − n nᵀ)` of the block behind a face `[Pa s/m]`.
pub fn impedance(geometry: &Geometry, properties: &Properties, surface: &BlockFace) -> Resistance {
    let rock = &properties.materials[geometry.bodies[surface.block].material as usize];
    resistance(rock, &surface.outward(geometry))
}

/// That of a rock behind a face with the normal n.
fn resistance(rock: &Elastic, n: &Vec3) -> Resistance {
    let along = n * n.transpose();
    let [p, s] = [rock.p_speed(), rock.s_speed()].map(|speed| rock.density * speed);
    along * p + (Resistance::identity() - along) * s
}
