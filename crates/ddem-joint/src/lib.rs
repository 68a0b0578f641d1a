//! Joints and contacts at given positions: failure, sliding and opening of joints, and forces of
//! blocks in contact.
//!
//! [`point`] has the pair of points that joints and contacts consist of. [`broken`] has the joints
//! of lattices, in groups of four. [`contact`] has nonconforming joints and contacts.
//! [`kinematics`] has the frames of joints, [`pair_kinematics`] the displacements of their pairs, and
//! [`losses`] their energy losses. The crate
//! `ddem-core` moves the blocks.

pub mod broken;
pub mod contact;
pub mod kinematics;
pub mod losses;
pub mod pair_kinematics;
pub mod point;
