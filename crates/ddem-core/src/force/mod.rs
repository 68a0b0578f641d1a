//! Loops that compute the forces on the nodes, one file each. None calls another;
//! [`step`](crate::step) calls all of them.

pub(crate) mod block;
pub(crate) mod boundary;
pub(crate) mod damping;
pub(crate) mod external;
pub(crate) mod joint;
pub(crate) mod neighbour_forces;
pub(crate) mod rigid;
pub(crate) mod support;
