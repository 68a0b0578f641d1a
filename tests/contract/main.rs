//! Properties of a run besides correct numbers: the same bits however it is run, loads and supports
//! as in the deck, and low memory use.

#![allow(clippy::print_stdout, reason = "errors that were found, shown by --nocapture")]

#[path = "../shared/mod.rs"]
mod shared;

mod bits;
mod blasts;
mod cells;
mod contacts;
mod decks;
mod embedding;
mod endurance;
mod energies;
mod extending;
mod histories;
mod joint_failure;
mod loads;
mod memory;
mod naming;
mod profile;
mod resume;
mod session;

use std::alloc::System;

use cap::Cap;

/// Allocator of the system, which counts the bytes in use.
#[global_allocator]
static HEAP: Cap<System> = Cap::new(System, usize::MAX);
