//! What the method promises, checked on whole models through the public interface.

mod architecture;
mod bad_input;
mod corotation;
mod decks;
mod determinism;
mod equations;
mod mechanisms;
mod resume;
mod selection;
mod tiling;
