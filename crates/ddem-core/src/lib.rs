//! The deformable block discrete element method: geometry, elements, joints, the step.
//!
//! A [`Problem`] is the input as plain data, a [`Model`] is made of it, a [`Simulation`] moves it. The crate `ddem-deck`
//! makes problems from decks, a [`ProblemBuilder`](problem::ProblemBuilder) from arrays.
//! [`FIELDS`] lists what can be seen. No file, no clock and no environment is touched here.
//!
//! To read the method in the source, begin with `step/mod.rs`: one explicit step in its order. Then
//! `force/body.rs`, `force/joint.rs` and `element/lattice.rs`, the elastic forces; `law/`, what a
//! joint bears, and `breaks/`, what becomes of it; `pack.rs`, how four bodies lie side by side;
//! `relax.rs`, static equilibrium. `docs/method.md` has the theory.

#![warn(clippy::print_stdout)]
#![cfg_attr(test, allow(clippy::disallowed_methods))]

pub mod element;
pub mod law;
pub mod problem;

mod assembly;
mod boundary;
mod breaks;
mod charge;
mod cluster;
mod conditions;
mod contact;
mod energy;
mod error;
mod exact;
mod fields;
mod force;
mod frames;
mod geometry;
mod grid;
mod groups;
mod history;
mod in_situ;
mod inertia;
mod joints;
mod kinematics;
mod lanes;
mod leapfrog;
mod mechanism;
mod model;
mod motion;
mod pack;
mod pairs;
mod parallel;
mod pass;
mod properties;
mod relax;
mod rigid;
mod rules;
mod safety;
mod saved;
mod scratch;
mod seams;
mod simd;
mod simulation;
mod sliding;
mod stage;
mod state;
mod step;
mod sums;
mod timestep;
mod touch;
mod tracked;
mod verdict;
mod view;
mod watch;

pub use charge::{ChargeSize, ChargeState};
pub use contact::ContactDoubt;
pub use element::ElementKind;
pub use energy::Energy;
pub use error::{Fault, ModelError, Moving, RunError};
pub use fields::{
    CONTACT_FIELDS, Contact, ContactCounts, ContactField, ContactSummary, FIELDS, FORCE, Field,
    FieldKind, Fragment, FragmentSummary, JointSummary, Largest, On, Reaction, Snapshot,
    StateSummary,
};
pub use geometry::Face;
pub use history::{Duvall, Function, History, Triangle};
pub use model::Model;
pub use nalgebra;
pub use pairs::PairAt;
pub use problem::Problem;
pub use properties::Kinematics;
pub use relax::Relaxed;
pub use safety::{Safety, Trial, undecided};
pub use saved::{RestoreError, Saved};
pub use simd::Simd;
pub use simulation::{SHORTEST_STEP, Simulation};
pub use stage::{Damping, Search, StageKind, TimeStep};
pub use watch::Verdict;
