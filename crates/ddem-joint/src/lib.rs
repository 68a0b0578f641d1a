//! Joints of ddem that break, slide and open, and blocks that meet, at positions that are given.
//!
//! [`point`] has the pair of points that all of them are made of. [`broken`] are joints of lattices, four side by side, [`contact`]
//! joints between other faces and contacts, [`kinematics`] the frames of joints. The crate `ddem-core` moves the blocks.

pub mod broken;
pub mod contact;
pub mod kinematics;
pub mod losses;
pub mod point;
