//! Non-reflecting boundaries (§10).
//!
//! The dashpots of Lysmer and Kuhlemeyer act on faces. With the outward normal n and the velocity v
//! of the rock, their traction is `−ρ c_P v_n n − ρ c_S v_s`. A wave with normal incidence leaves
//! the model. The traction `2 ρ c w` creates an incoming wave with the velocity w.

mod active;
mod beside;
mod column;

use std::collections::{BTreeSet, HashSet};
use std::sync::Arc;

use nalgebra::Matrix3;

use crate::error::{ErrorCode, Fault, RunError};
use crate::model::conditions::{ActiveConditions, AppliedForces};
use crate::model::history::{Function, TimeFunction};
use crate::model::stage::StageRange;
use ddem_mechanics::element::Elastic;
use ddem_mesh::assembly::Assembly;
use ddem_mesh::pack::Packs;
use ddem_mesh::properties::Properties;
use ddem_mesh::{BlockFace, Geometry, Vec3};

pub(crate) use active::{ActiveBoundaries, Dashpot};
pub use column::{Column, ColumnBuilder, NoColumn, SideNode};
pub(crate) use column::{ColumnMotion, ColumnStep};

/// Matrix of damping `[N s/m]` or impedance `[Pa s/m]`.
pub type Resistance = Matrix3<f64>;

/// Boundary force on a node, dashpots excluded `[N]`.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct BoundaryForce {
    /// Constant forces, and stresses of the free field.
    pub(crate) force: Vec3,
    /// Force of incoming waves, and of dashpots whose far end moves with a column. Local damping
    /// does not act on it.
    pub(crate) wave: Vec3,
}

/// One boundary.
#[derive(Clone, Debug)]
pub struct ModelBoundary {
    /// Dashpots by face and node `[N s/m]`. A node occurs once for each of its faces. The model adds
    /// the nodes tied to them.
    pub dashpots: Vec<(u32, Resistance)>,
    /// Faces of the boundary, each with its selected area and its whole area `[m²]`.
    pub faces: Vec<(BlockFace, [f64; 2])>,
    /// Nodes of faces whose normal points down.
    pub under: BTreeSet<u32>,
    /// Velocity of the incoming wave `[m/s]`.
    pub wave: Option<Vec3>,
    /// Factor in time of the wave.
    pub history: TimeFunction,
    /// Stages in which it is in force.
    pub in_force: StageRange,
    /// Free-field columns.
    pub columns: Vec<Column>,
    /// Nodes that are connected to the columns.
    pub sides: Vec<SideNode>,
}

/// All boundaries of a model.
#[derive(Clone, Debug, Default)]
pub struct Boundaries {
    /// Boundaries, in the order of the problem.
    pub list: Vec<ModelBoundary>,
}

/// Geometry that the boundaries act on.
#[derive(Clone, Copy)]
pub(crate) struct StageGeometry<'a> {
    /// Geometry of the present stage.
    pub(super) now: &'a Geometry,
    /// Geometry at the start.
    pub(super) start: &'a Geometry,
    pub(super) packs: &'a Packs,
}

impl Boundaries {
    /// Number of nodes of all columns.
    pub(crate) fn column_nodes(&self) -> usize {
        let columns = self.list.iter().flat_map(|boundary| &boundary.columns);
        columns.map(|column| column.nodes.len()).sum()
    }

    /// True if a boundary is in force in a stage.
    pub fn has(&self, boundary: usize, stage: usize) -> bool {
        self.list[boundary].in_force.has(stage)
    }

    /// Adds the nodes that are tied to those of dashpots, without a resistance of their own, because
    /// dashpots act on tied nodes as on one.
    pub(super) fn add_tied(&mut self, geometry: &Geometry) {
        for boundary in &mut self.list {
            let mut nodes: BTreeSet<u32> =
                boundary.dashpots.iter().map(|(node, _)| *node).collect();
            let known: Vec<u32> = nodes.iter().copied().collect();
            let tied = known.iter().flat_map(|&node| geometry.ties.with(node));
            let more = tied.filter(|&&node| nodes.insert(node));
            boundary.dashpots.extend(more.map(|&node| (node, Resistance::zeros())));
        }
    }

    /// Stores the slots of the nodes in front of the columns, and their stiffness over mass for
    /// damping. This happens before any block is removed.
    pub(super) fn note_damping(&mut self, geometries: StageGeometry<'_>, assembly: &Assembly) {
        let columns = self.list.iter_mut().flat_map(|boundary| &mut boundary.columns);
        columns.for_each(|column| column.note_damping(geometries, assembly));
    }

    /// Factor of each boundary's wave at a time. `starts` are the start times of the stages.
    pub(crate) fn factors(
        &self,
        stage: usize,
        time: f64,
        starts: &[f64],
    ) -> Result<Vec<f64>, RunError> {
        let factor = |(index, boundary): (usize, &ModelBoundary)| match boundary.in_force.has(stage)
        {
            true => boundary.in_force.factor(&boundary.history, time, starts).at("boundary", index),
            false => Ok(0.0),
        };
        self.list.iter().enumerate().map(factor).collect()
    }

    /// True if any wave in force may change after a time.
    pub(crate) fn change_after(&self, stage: usize, time: f64, starts: &[f64]) -> bool {
        let changes = |boundary: &ModelBoundary| {
            let since = boundary.in_force.since(time, starts);
            boundary.in_force.has(stage) && boundary.history.changes_after(since)
        };
        self.list.iter().any(changes)
    }

    /// Gives the wave of a boundary a history that a program computes.
    ///
    /// # Errors
    ///
    /// There is no such boundary, or it has no wave.
    pub(super) fn set_history(
        &mut self,
        index: usize,
        function: Arc<Function>,
    ) -> Result<(), Fault> {
        let boundary = self.list.get_mut(index).filter(|boundary| boundary.wave.is_some());
        let fault = || {
            Fault::new(
                ErrorCode::UnknownName,
                format!("boundary[{index}].history"),
                "no boundary with this number has a wave",
            )
            .help("`velocity` gives a boundary a wave; boundaries are numbered from 0")
        };
        boundary.ok_or_else(fault)?.history = TimeFunction::Computed(function);
        Ok(())
    }

    /// Copies the histories of the boundaries of `from`. A program may compute some of them.
    pub(super) fn take_histories(&mut self, from: &Self) {
        let both = self.list.iter_mut().zip(&from.list);
        both.for_each(|(own, other)| own.history.clone_from(&other.history));
    }

    /// Constant forces that replace supports which end at boundaries: their reactions before the
    /// stage, plus the locked reactions of earlier stages.
    pub(crate) fn locked_reactions(
        &self,
        stage: usize,
        before: (&ActiveConditions, &[f64], &AppliedForces),
        after: &ActiveConditions,
    ) -> AppliedForces {
        let (active, reactions, locked_reactions) = before;
        let here = self.list.iter().filter(|boundary| boundary.in_force.has(stage));
        let mut forces: AppliedForces = here
            .flat_map(|boundary| &boundary.dashpots)
            .map(|(node, _)| (*node, [0.0; 3]))
            .collect();
        for (node, force) in &mut forces {
            *force = locked_reactions.get(node).copied().unwrap_or_default();
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

/// Impedance `ρ c_P n nᵀ + ρ c_S (1 − n nᵀ)` of the block behind a face `[Pa s/m]`.
pub fn impedance(geometry: &Geometry, properties: &Properties, face: &BlockFace) -> Resistance {
    let rock = &properties.materials[geometry.blocks[face.block].material as usize];
    resistance(rock, &face.outward(geometry))
}

/// Impedance of the rock behind a face with the normal n `[Pa s/m]`.
fn resistance(rock: &Elastic, n: &Vec3) -> Resistance {
    let along = n * n.transpose();
    let [p, s] = [rock.p_speed(), rock.s_speed()].map(|speed| rock.density * speed);
    along * p + (Resistance::identity() - along) * s
}
