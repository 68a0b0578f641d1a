//! Properties of the method, checked on whole models through the public interface.
//!
//! Several tests print what they measure: `cargo test -p ddem-core --test it -- --nocapture`.

#![allow(clippy::disallowed_methods, clippy::print_stdout)]

mod anything;
mod architecture;
mod arrays;
mod assigned;
mod blasts;
mod blown;
mod borne;
mod boundaries;
mod breaking;
mod charges;
mod collisions;
mod compiler;
mod corotation;
mod damage;
mod decks;
mod determinism;
mod embedded;
mod equations;
mod excavation;
mod fallen;
mod filling;
mod fragments;
mod hinges;
mod hollows;
mod in_situ;
mod increments;
mod interfaces;
mod loose;
mod mechanisms;
mod meeting;
mod mixture;
mod nonconforming;
mod opened;
mod peaks;
mod programs;
mod refine;
mod resume;
mod rigid;
mod rubbing;
mod stages;
mod starts;
mod thin;
mod tiling;
mod touching;
mod tumbling;
