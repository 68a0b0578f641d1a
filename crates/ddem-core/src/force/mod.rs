//! Who pushes on the nodes: loops, one file each. None calls another; [`step`](crate::step) does.

pub(crate) mod body;
pub(crate) mod boundary;
pub(crate) mod contact;
pub(crate) mod damping;
pub(crate) mod external;
pub(crate) mod joint;
pub(crate) mod rigid;
pub(crate) mod shares;
pub(crate) mod support;
