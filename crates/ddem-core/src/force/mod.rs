//! Forces on the nodes: loops, one file each. None calls another; [`step`](crate::step) calls them all.

pub(crate) mod block;
pub(crate) mod boundary;
pub(crate) mod contact;
pub(crate) mod damping;
pub(crate) mod external;
pub(crate) mod joint;
pub(crate) mod neighbour_forces;
pub(crate) mod rigid;
pub(crate) mod support;
