//! The deformable block discrete element method.

pub mod deck;
pub mod element;

mod assembly;
mod cluster;
mod conditions;
mod energy;
mod error;
mod fields;
mod force;
mod frames;
mod geometry;
mod history;
mod joints;
mod lanes;
mod mechanism;
mod model;
mod motion;
mod pack;
mod parallel;
mod relax;
mod saved;
mod scratch;
mod simd;
mod simulation;
mod state;
mod step;
mod sums;
mod timestep;

pub use deck::Deck;
pub use energy::Energy;
pub use error::{Fault, ModelError, RunError};
pub use fields::{FIELDS, Field, On};
pub use geometry::Face;
pub use model::{Model, Size};
pub use relax::Relaxed;
pub use saved::Saved;
pub use simd::Simd;
pub use simulation::Simulation;
