//! Tests of the command as a user runs it.

mod command_line;
mod contacts;
mod cuts;
mod excavation;
mod faults;
mod fragments;
mod harness;
mod interfaces;
mod kills;
mod messages;
mod pictures;
mod runs;
mod searches;
mod status;
mod templates;
mod verdicts;
