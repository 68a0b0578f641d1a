//! Formulas of the deformable block discrete element method that know no mesh: [elements](element), [laws of joints](law),
//! [rigid bodies](rigid), [where two blocks touch](collide), and the [numbers](math) that they calculate with.
//!
//! The crate `ddem-core` loops over blocks and joints with them. Most are for four blocks side by side.

pub mod collide;
pub mod element;
pub mod law;
pub mod math;
pub mod rigid;
