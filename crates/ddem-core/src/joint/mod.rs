//! TODO

pub(crate) mod breaks;
pub(crate) mod contact;
pub(crate) mod kinematics;
