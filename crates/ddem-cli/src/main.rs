//! Command line of ddem.

fn main() {}
