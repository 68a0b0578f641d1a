//! Arithmetic: four numbers side by side, exact sums, the leap-frog step, groups.

pub mod disjoint_sets;
pub mod exact;
pub mod lanes;
pub mod leapfrog;
pub mod number;
pub mod simd;
pub mod sums;
pub mod tracked;
