//! What the method promises, checked on whole models through the public interface.

mod architecture;
mod corotation;
mod decks;
mod determinism;
mod equations;
mod mechanisms;
mod selection;
mod tiling;
