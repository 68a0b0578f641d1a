//! The command as a user runs it.

mod command_line;
mod contacts;
mod harness;
mod runs;
