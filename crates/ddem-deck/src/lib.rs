//! Decks of ddem: the input of a user, which is read, checked and converted to a problem.
//!
//! [`read()`] reads a TOML file and locates every mistake. [`check()`] finds mistakes in its
//! values. A [`BuiltDeck`] cuts its blocks and makes the [`Problem`](ddem_core::Problem), from
//! which a [`Model`](ddem_core::Model) is made.
//!
//! ```
//! let text = "
//! [materials.rock]
//! density = 2400
//! young = 18e9
//! poisson = 0.25
//! [[blocks]]
//! size = [1, 1, 1]
//! material = 'rock'
//! ";
//! let (deck, source) = ddem_deck::parse(text, "cube.toml")?;
//! source.check(&deck)?;
//! let model = deck.build()?;
//! assert_eq!(model.n_nodes(), 125);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#![warn(clippy::print_stdout)]
#![cfg_attr(test, allow(clippy::disallowed_methods))]

mod build;
mod check;
mod diagnose;
pub mod lint;
mod near;
mod reader;
mod schema;

pub use build::{
    BlockMode, BlockVerdict, BuildPhase, BuildProgress, BuiltDeck, CutRock, Interface,
    RockFracture, RockPlane, Selection,
};
pub use check::{check, check_cuts};
pub use diagnose::{DeckError, Finding};
pub use near::near;
pub use reader::{
    Source, file_contents, from_table, join_paths, json_schema, parse, parse_alone, read,
    read_files, restore_files, write,
};
pub use schema::*;
pub use toml;
