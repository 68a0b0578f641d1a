//! **ddem** computes jointed rock: blocks meshed with hexahedra, joints of real thickness between
//! them, explicit dynamics. Until a joint breaks the model *is* the finite element model.
//!
//! This crate re-exports all of [`ddem_core`] (a problem, its model, and a simulation of it).
//! [`deck`] reads decks from TOML and turns them into models, `io` runs them and writes results for
//! ParaView. Without the default feature `io` neither HDF5 nor CMake is needed.
//!
//! A block on a smooth floor under its own weight, with a loop over the steps:
//!
//! ```
//! use ddem::deck::{BlockSet, Damping, Extent, Fix, Material, TimeStep, Where};
//! use ddem::{Deck, Simulation};
//!
//! let mut deck = Deck::default();
//! deck.model.gravity = [0.0, 0.0, -9.81];
//! let rock = Material { density: 2400.0, young: 18e9, poisson: 0.25 };
//! deck.materials.insert("rock".into(), rock);
//! deck.blocks.push(BlockSet {
//!     size: Some([1.0, 1.0, 2.0]),
//!     material: "rock".into(),
//!     ..BlockSet::default()
//! });
//! let floor = Where { z: Some(Extent::Plane(0.0)), ..Where::default() };
//! deck.fix.push(Fix { r#where: floor.clone(), axes: "z".into(), ..Fix::default() });
//!
//! let model = deck.build()?;
//! let (top, floor) = (model.nearest_node([0.5, 0.5, 2.0]), floor.nodes(&model)?);
//! let mut simulation = Simulation::new(model);
//! simulation.start(Damping::Ratio(0.05), TimeStep::Auto, None)?;
//! while simulation.time() < 0.02 {
//!     simulation.step()?;
//! }
//! let settlement = simulation.displacement(top)[2];
//! let weight = simulation.reaction(&floor)[2];
//! assert!((settlement + 2400.0 * 9.81 * 2.0 * 2.0 / 2.0 / 18e9).abs() < 2e-7);
//! assert!((weight - 2400.0 * 9.81 * 2.0).abs() < 500.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Decks from files, with all their results:
//!
//! ```no_run
//! use ddem::io::run::{Event, Observer, Options, run};
//!
//! struct Quiet;
//! impl Observer for Quiet {
//!     fn event(&mut self, _: Event<'_>) {}
//! }
//!
//! let (deck, source) = ddem::deck::read("examples/beam.toml".as_ref())?;
//! run(&deck, &source, &Options::new("results/beam"), &mut Quiet)?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub use ddem_core::*;
pub use ddem_deck as deck;
pub use ddem_deck::{BuiltDeck, Deck, Interface, Selection, Size};
#[cfg(feature = "io")]
pub use ddem_io as io;
