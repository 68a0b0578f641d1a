//! What a run promises besides numbers that are right: the same bits however it is run, loads and
//! supports as the deck says, and little memory.

#![allow(clippy::print_stdout, reason = "errors that were found, shown by --nocapture")]

#[path = "../shared/mod.rs"]
mod shared;

mod bits;
mod blasts;
mod breaking;
mod contacts;
mod decks;
mod embedding;
mod energies;
mod extending;
mod histories;
mod loads;
mod memory;
mod resume;
mod session;
mod words;
