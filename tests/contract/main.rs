//! What a run promises besides numbers that are right: the same bits however it is run, loads and
//! supports as the deck says, and little memory.

#[path = "../shared/mod.rs"]
mod shared;

mod bits;
mod decks;
mod histories;
mod loads;
mod memory;
mod resume;
