//! Formulas of the deformable block discrete element method, independent of any mesh:
//! [elements](element), [laws of joints](law), [rigid blocks](rigid), [contact geometry](collide)
//! and the [arithmetic](math) behind them.
//!
//! The crate `ddem-core` loops over blocks and joints with them. Most formulas act on four blocks
//! side by side.

pub mod collide;
pub mod element;
pub mod law;
pub mod math;
pub mod rigid;
