//! The input of the method: blocks, joints, supports, loads and stages as plain data, in SI units.
//!
//! A [`Problem`] is what a [`Model`](crate::Model) is made from. The crate `ddem-deck` makes one from a deck. What
//! can be asked of a problem before a model exists (rigid motions that its supports leave free, boundaries that are
//! held) is answered here.

mod builder;

pub use builder::{BuildError, ProblemBuilder};

pub use crate::model::boundary::{
    Border, Borders, Column, Ground, NoColumn, Resistance, Side, impedance,
};
pub use crate::model::charge::{Charge, ChargeSize, Gas, Shell};
pub use crate::model::conditions::{Charged, Conditions, Fading, Fixed, Loaded};
pub use crate::model::history::{Course, no_velocity};
pub use crate::model::mechanism::FreeMotion;
pub use crate::model::rules::{Faults, Rule, shown};
pub use crate::model::stage::Period;
pub use ddem_mechanics::collide::FaceOf;
pub use ddem_mesh::grid::meeting;
pub use ddem_mesh::in_situ::Stress;
pub use ddem_mesh::properties::{
    ContactProperties, DAMPING, JointElasticity, JointProperties, Properties,
};
pub use ddem_mesh::{
    Abutment, Abuts, BlockFace, Body, ELSEWHERE, FaceOverlap, Geometry, HexMesh, Lattice, MISSES,
    MeshBlock, MeshError, MeshFaces, NO_JOINT, NONE, Pages, RestFace, SLIVER, Stages, Strip,
    Topology, Vec3, bounds, bounds_of, faces, moved_to,
};

use std::sync::Arc;

use rayon::prelude::*;

use crate::model::boundary::{Made, Outside};
use crate::model::conditions::{Active, Applied};
use crate::model::mechanism::free_motion;
use crate::model::stage::StageKind;
use ddem_mesh::pack::Packs;

/// Everything that a model is made from.
#[derive(Clone, Debug)]
pub struct Problem {
    /// Materials, joints, contacts and settings.
    pub properties: Properties,
    /// Blocks and joints from which stage on.
    pub stages: Stages,
    /// Supports, loads and charges.
    pub conditions: Conditions,
    /// Non-reflecting boundaries.
    pub borders: Borders,
    /// Stress of each block at the start; empty where none has any.
    pub stresses: Vec<Option<Stress>>,
    /// Motions at the start; later ones replace earlier ones.
    pub motions: Vec<StartMotion>,
    /// Kinds of the stages.
    pub kinds: Vec<StageKind>,
    /// Sets of blocks.
    pub sets: Sets,
}

/// Motion of nodes at the start, as of a rigid body.
#[derive(Clone, Debug)]
pub struct StartMotion {
    /// Numbers of the nodes.
    pub nodes: Vec<u32>,
    /// Velocity at the centre `[m/s]`.
    pub velocity: Vec3,
    /// Angular velocity `[rad/s]`.
    pub spin: Vec3,
    /// Centre of the turn `[m]`.
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
    /// Unit normals of the planes that cut its edges, and positions of its two ends along them `[m]`.
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
    /// Number of those that are held in all directions, and whose block has no free node there.
    pub held: usize,
    /// Position of the first of those `[m]`.
    pub first: Option<[f64; 3]>,
    /// Numbers of the supports that hold them.
    pub fixes: Vec<usize>,
    /// Axis along the normal that a support holds, and the number of that support.
    pub across: Option<(usize, usize)>,
    /// Foot of a free-field column that stands on nothing `[m]`.
    pub floating: Option<[f64; 3]>,
}

impl Problem {
    /// Number of stages; without any there is one.
    #[must_use]
    pub fn n_stages(&self) -> usize {
        self.kinds.len().max(1)
    }

    /// Rigid motion that the supports of a stage leave free to blocks that joints and contacts hold together.
    #[must_use]
    pub fn free_motion(&self, stage: usize) -> Option<FreeMotion> {
        let geometry = self.stages.at(stage);
        let packs = Packs::new(geometry);
        let active = Active::new(&self.conditions, geometry, &packs, stage, &Applied::default());
        free_motion(geometry, &active, self.properties.contact.search)
    }

    /// Whether a stage has the blocks, the supports and the boundaries of the one before.
    #[must_use]
    pub fn goes_on(&self, stage: usize) -> bool {
        let Some(before) = stage.checked_sub(1) else { return false };
        let borders = self.borders.list.iter().map(|border| &border.period);
        let mut periods = self.conditions.fixed.iter().map(|fix| &fix.period).chain(borders);
        Arc::ptr_eq(self.stages.at(before), self.stages.at(stage))
            && periods.all(|period| period.has(before) == period.has(stage))
    }

    /// Supports at each boundary that is in force in a stage, for each stage.
    #[must_use]
    pub fn boundary_holds(&self) -> Vec<Vec<BoundaryHold>> {
        let stages = 0..self.n_stages();
        if self.borders.list.is_empty() {
            return stages.map(|_| Vec::new()).collect();
        }
        let packs = Packs::new(self.stages.at(0));
        let others = stages
            .into_par_iter()
            .map(|stage| (!self.goes_on(stage)).then(|| self.boundary_holds_in(stage, &packs)));
        let mut holds: Vec<Vec<BoundaryHold>> = Vec::new();
        for other in others.collect::<Vec<_>>() {
            holds.push(other.or_else(|| holds.last().cloned()).unwrap_or_default());
        }
        holds
    }

    fn boundary_holds_in(&self, stage: usize, packs: &Packs) -> Vec<BoundaryHold> {
        let here = (0..self.borders.list.len()).filter(|&index| self.borders.has(index, stage));
        let here: Vec<usize> = here.collect();
        if here.is_empty() {
            return Vec::new();
        }
        let (geometry, start) = (&**self.stages.at(stage), &**self.stages.at(0));
        let made = Made { geometry, start, packs };
        let none = Applied::default();
        let active = Active::new(&self.conditions, geometry, packs, stage, &none);
        let outside = Outside::new(&self.borders, made, &self.conditions, stage, &active, &none);
        let point = |node: u32| {
            let (body, at) = geometry.locate(node as usize);
            geometry.position(body, at).into()
        };
        let hold = |boundary: usize| {
            let border = &self.borders.list[boundary];
            let clamped = outside.clamped(made, border);
            let floating = outside.floating(boundary, border).map(|column| point(column.nodes[0]));
            BoundaryHold {
                boundary,
                nodes: clamped.nodes,
                held: clamped.count,
                first: clamped.first.map(point),
                fixes: clamped.fixes.into_iter().collect(),
                across: outside.held_across(made, border),
                floating,
            }
        };
        here.into_iter().map(hold).collect()
    }

    /// Degrees of freedom, node and axis, that supports hold in a stage.
    #[must_use]
    pub fn held(&self, stage: usize) -> Vec<(u32, usize)> {
        let geometry = self.stages.at(stage);
        let packs = Packs::new(geometry);
        let none = Applied::default();
        Active::new(&self.conditions, geometry, &packs, stage, &none).held().collect()
    }
}
