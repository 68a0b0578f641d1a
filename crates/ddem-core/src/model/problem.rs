//! The input of the method: blocks, joints, supports, loads and stages as plain data, in SI units.
//!
//! A [`Model`](crate::Model) is made from a [`Problem`]. The crate `ddem-deck` makes problems from
//! decks. A problem itself finds the rigid motions that its supports leave free, and the boundaries
//! that supports hold.

mod build_error;
mod builder;

pub use build_error::BuildError;
pub use builder::ProblemBuilder;

pub use crate::model::boundary::{
    Boundaries, Column, ColumnBuilder, ModelBoundary, NoColumn, Resistance, SideNode, impedance,
};
pub use crate::model::charge::{ChargeSize, Gas, GasCharge, GasSurface};
pub use crate::model::conditions::{
    Conditions, ForceFading, LoadPattern, SupportGroup, TimedCharge,
};
pub use crate::model::history::{TimeFunction, no_velocity};
pub use crate::model::mechanism::FreeMotion;
pub use crate::model::rules::{Faults, Rule, shown};
pub use crate::model::stage::StageRange;
pub use ddem_mechanics::collide::FaceId;
pub use ddem_mesh::grid::overlapping_pairs;
pub use ddem_mesh::in_situ::Stress;
pub use ddem_mesh::properties::{
    ContactProperties, DAMPING, FRICTION, JointElasticity, JointProperties, Properties,
};
pub use ddem_mesh::{
    Block, BlockFace, CellCount, ELSEWHERE, FaceOverlap, FreeElement, Geometry, HexMesh, Lattice,
    MISSES, MeshBlock, MeshError, MeshFaces, NO_JOINT, NONE, NonconformingFace, NonconformingJoint,
    Pages, PartShape, RestFace, SLIVER, Stages, Ties, Topology, TributaryLengths, Vec3, bounds,
    bounds_of, distorted, faces, moved_to, stiffest_nodes,
};

use std::sync::Arc;

use rayon::prelude::*;

use crate::model::boundary::{ActiveBoundaries, StageGeometry};
use crate::model::conditions::{ActiveConditions, AppliedForces};
use crate::model::mechanism::free_motion;
use crate::model::stage::StageKind;
use ddem_mesh::pack::Packs;

/// Complete input of a model.
#[derive(Clone, Debug)]
pub struct Problem {
    /// Materials, joints, contacts and settings.
    pub properties: Properties,
    /// Blocks and joints of each stage.
    pub stages: Stages,
    /// Supports, loads and charges.
    pub conditions: Conditions,
    /// Non-reflecting boundaries.
    pub boundaries: Boundaries,
    /// Stress of each block at the start; empty if no block has one.
    pub stresses: Vec<Option<Stress>>,
    /// Motions at the start; later ones replace earlier ones.
    pub motions: Vec<StartMotion>,
    /// Kinds of the stages.
    pub kinds: Vec<StageKind>,
    /// Sets of blocks.
    pub sets: Sets,
}

/// Rigid motion of nodes at the start.
#[derive(Clone, Debug)]
pub struct StartMotion {
    /// Numbers of the nodes.
    pub nodes: Vec<u32>,
    /// Velocity at the centre `[m/s]`.
    pub velocity: Vec3,
    /// Angular velocity `[rad/s]`.
    pub spin: Vec3,
    /// Centre of the rotation `[m]`.
    pub centre: Vec3,
}

/// The sets of blocks, and the box around them all.
#[derive(Clone, Debug)]
pub struct Sets {
    /// Corners of the box along the coordinate axes `[m]`.
    pub bounds: [Vec3; 2],
    /// The sets, by number.
    pub list: Vec<Set>,
}

/// One set of blocks.
#[derive(Clone, Debug)]
pub struct Set {
    /// Name, if it has one.
    pub name: Option<String>,
    /// Name in messages.
    pub label: String,
    /// Unit normals of its three pairs of sides, and positions of both sides along them `[m]`.
    pub ends: [(Vec3, [f64; 2]); 3],
    /// Corners, numbered by bits `[m]`.
    pub corners: [Vec3; 8],
}

/// Supports at a boundary in one stage.
#[derive(Clone, Debug)]
pub struct BoundaryHold {
    /// Number of the boundary.
    pub boundary: usize,
    /// Number of its nodes.
    pub nodes: usize,
    /// Number of its nodes that are held in all directions. A block counts if all its nodes on the
    /// boundary are held.
    pub held: usize,
    /// Position of the first held node `[m]`.
    pub first: Option<[f64; 3]>,
    /// Numbers of the supports that hold these nodes.
    pub fixes: Vec<usize>,
    /// Axis normal to the boundary along which supports hold all its nodes, and the number of one
    /// of them.
    pub across: Option<(usize, usize)>,
    /// Foot of a free-field column without dashpots and supports below it `[m]`.
    pub floating: Option<[f64; 3]>,
}

impl Problem {
    /// Number of stages, at least one.
    #[must_use]
    pub fn n_stages(&self) -> usize {
        self.kinds.len().max(1)
    }

    /// Rigid motion that the supports of a stage leave free, of blocks connected by joints and
    /// contacts.
    #[must_use]
    pub fn free_motion(&self, stage: usize) -> Option<FreeMotion> {
        let geometry = self.stages.at(stage);
        let packs = Packs::new(geometry);
        let active = ActiveConditions::new(
            &self.conditions,
            geometry,
            &packs,
            stage,
            &AppliedForces::default(),
        );
        free_motion(geometry, &active, self.properties.contact.search)
    }

    /// True if a stage has the blocks, supports and boundaries of the previous one.
    #[must_use]
    pub fn is_unchanged(&self, stage: usize) -> bool {
        let Some(before) = stage.checked_sub(1) else { return false };
        let boundaries = self.boundaries.list.iter().map(|boundary| &boundary.in_force);
        let mut periods = self.conditions.fixed.iter().map(|fix| &fix.in_force).chain(boundaries);
        Arc::ptr_eq(self.stages.at(before), self.stages.at(stage))
            && periods.all(|in_force| in_force.has(before) == in_force.has(stage))
    }

    /// Supports at the boundaries in force, for each stage.
    #[must_use]
    pub fn boundary_holds(&self) -> Vec<Vec<BoundaryHold>> {
        let stages = 0..self.n_stages();
        if self.boundaries.list.is_empty() {
            return stages.map(|_| Vec::new()).collect();
        }
        let packs = Packs::new(self.stages.at(0));
        let others = stages.into_par_iter().map(|stage| {
            (!self.is_unchanged(stage)).then(|| self.boundary_holds_in(stage, &packs))
        });
        let mut holds: Vec<Vec<BoundaryHold>> = Vec::new();
        for other in others.collect::<Vec<_>>() {
            holds.push(other.or_else(|| holds.last().cloned()).unwrap_or_default());
        }
        holds
    }

    fn boundary_holds_in(&self, stage: usize, packs: &Packs) -> Vec<BoundaryHold> {
        let here =
            (0..self.boundaries.list.len()).filter(|&index| self.boundaries.has(index, stage));
        let here: Vec<usize> = here.collect();
        if here.is_empty() {
            return Vec::new();
        }
        let (geometry, start) = (&**self.stages.at(stage), &**self.stages.at(0));
        let geometries = StageGeometry { now: geometry, start, packs };
        let none = AppliedForces::default();
        let active = ActiveConditions::new(&self.conditions, geometry, packs, stage, &none);
        let in_force = ActiveBoundaries::new(
            &self.boundaries,
            geometries,
            &self.conditions,
            stage,
            &active,
            &none,
        );
        let point = |node: u32| {
            let (block, at) = geometry.locate(node as usize);
            geometry.position(block, at).into()
        };
        let hold = |index: usize| {
            let boundary = &self.boundaries.list[index];
            let held = in_force.held_nodes(geometries, boundary);
            let floating = in_force.floating(index, boundary).map(|column| point(column.nodes[0]));
            BoundaryHold {
                boundary: index,
                nodes: held.nodes,
                held: held.count,
                first: held.first.map(point),
                fixes: held.fixes.into_iter().collect(),
                across: in_force.held_across(geometries, boundary),
                floating,
            }
        };
        here.into_iter().map(hold).collect()
    }

    /// Degrees of freedom (node and axis) that supports hold in a stage.
    #[must_use]
    pub fn held(&self, stage: usize) -> Vec<(u32, usize)> {
        let geometry = self.stages.at(stage);
        let packs = Packs::new(geometry);
        let none = AppliedForces::default();
        ActiveConditions::new(&self.conditions, geometry, &packs, stage, &none).held().collect()
    }
}
