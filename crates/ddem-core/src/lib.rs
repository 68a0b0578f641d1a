//! The deformable block discrete element method: models, the step, relaxation, results.
//!
//! A [`Problem`] is the input as plain data. A [`Model`] is made from it, and a [`Simulation`]
//! moves the model. The crate `ddem-deck` makes problems from decks; a
//! [`ProblemBuilder`](problem::ProblemBuilder) makes them from arrays. [`FIELDS`] lists all result
//! fields. This crate uses no files and no environment, and no clock but one that a program gives.
//!
//! To read the method in the source, begin with `step/mod.rs`: one explicit step in its order. Then
//! read
//!
//! - `force/block.rs` and `force/joint/mod.rs`, the elastic forces, with `element/lattice.rs` of
//!   `ddem-mechanics`;
//! - `law/` of `ddem-mechanics`, the strength of joints;
//! - `broken/` of `ddem-joint`, the state of joints that fail;
//! - `pack.rs` of `ddem-mesh`, the storage of four blocks side by side;
//! - `run/relax.rs`, static equilibrium.
//!
//! `docs/method.md` has the theory.

#![warn(clippy::print_stdout)]
#![cfg_attr(test, allow(clippy::disallowed_methods))]

mod error;
mod force;
mod model;
mod output;
mod run;
mod state;
mod step;

pub use ddem_joint::contact::ContactWarning;
pub use ddem_mechanics::element::{self, ElementKind};
pub use ddem_mechanics::law;
pub use ddem_mechanics::math::simd::Simd;
pub use ddem_mesh::ConformingJoint;
pub use ddem_mesh::properties::Kinematics;
pub use error::{ErrorCode, FastestBlock, Fault, ModelError, MovingBlock, RunError, counted};
pub use model::Model;
pub use model::charge::{ChargeSize, ChargeState};
pub use model::elements::WorstShape;
pub use model::history::{Duvall, Function, History, Triangle};
pub use model::pairs::PairAtRest;
pub use model::problem::{self, Problem};
pub use model::stage::{Damping, SafetySearch, StageKind, TimeStep};
pub use nalgebra;
pub use output::energy::Energy;
pub use output::{
    CONTACT_FIELDS, Contact, ContactCounts, ContactField, ContactSummary, FIELDS, FORCE, Field,
    FieldKind, FieldLocation, Fragment, FragmentSummary, JointSummary, Largest, Reaction, Snapshot,
    StateSummary, fields,
};
pub use run::relax::Relaxed;
pub use run::safety::{
    Safety, SafetyTrial, SearchNews, TellSearch, TrialProgress, most_trials, undecided,
};
pub use run::saved::{RestoreError, Saved};
pub use run::{Limiter, SHORTEST_STEP, Simulation, StepLimit};
pub use state::profile::{Clock, Profile};
pub use state::watch::Verdict;
