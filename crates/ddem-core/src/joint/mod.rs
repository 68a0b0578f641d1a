//! Joints that break, blocks that meet, and the frames of joints.

pub(crate) mod breaks;
pub(crate) mod contact;
pub(crate) mod kinematics;
pub(crate) mod losses;
pub(crate) mod point;
