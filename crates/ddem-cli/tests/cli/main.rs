//! The command as a user runs it.

mod command_line;
mod harness;
mod runs;
