//! Numbers: four side by side, exact sums, the leap-frog, groups, rules of values.

pub(crate) mod exact;
pub(crate) mod groups;
pub(crate) mod lanes;
pub(crate) mod leapfrog;
pub(crate) mod rules;
pub(crate) mod simd;
pub(crate) mod sums;
pub(crate) mod tracked;
