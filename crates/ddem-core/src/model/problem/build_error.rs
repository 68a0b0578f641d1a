//! Faults of a problem that is built from arrays.

use crate::error::{ErrorCode, numbered};
use ddem_mesh::MeshError;

/// Fault of a problem that is built from arrays. Its display ends with the code.
#[derive(Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BuildError {
    /// Fault of the mesh.
    #[error("{} [{}]", .0, ErrorCode::InvalidMesh)]
    Mesh(MeshError),
    /// A number that refers to nothing.
    #[error(
        "there is no {what} {number}: the problem has {} [{}]",
        numbered(*.count),
        ErrorCode::UnknownName
    )]
    Missing {
        /// Kind of item.
        what: &'static str,
        /// Number that was given.
        number: usize,
        /// Number of existing items.
        count: usize,
    },
    /// A node without a block.
    #[error(
        "node {node} belongs to no block: give nodes of blocks [{}]",
        ErrorCode::InvalidArgument
    )]
    Loose {
        /// Number of the node.
        node: u32,
    },
    /// Four nodes that do not lie on one face of a block.
    #[error(
        "nodes {quad:?} are not on one face of a block: give four nodes of one face [{}]",
        ErrorCode::InvalidArgument
    )]
    NoFace {
        /// The four nodes.
        quad: [u32; 4],
    },
    /// Two faces that a joint cannot join.
    #[error("joint `{joint}` cannot join blocks {blocks:?}: {why} [{}]", ErrorCode::NotSupported)]
    NoJoint {
        /// The two blocks.
        blocks: [usize; 2],
        /// Name of the joint.
        joint: String,
        /// Reason.
        why: String,
    },
    /// More items than 16-bit numbers can count; one of these numbers means none.
    #[error("there are {count} {what}: give at most {} [{}]", u16::MAX, ErrorCode::TooLarge)]
    TooMany {
        /// Kind of item.
        what: &'static str,
        /// Number of items.
        count: usize,
    },
    /// A joint law with numbers that springs cannot have.
    #[error("the law of joint `{joint}`: {why} [{}]", ErrorCode::InvalidLaw)]
    Law {
        /// Name of the joint.
        joint: String,
        /// Reason.
        why: String,
    },
    /// A node of a rigid block that is not one of its corners.
    #[error(
        "node {node} is no corner of rigid block {block}, which has no other nodes: give one of its corners [{}]",
        ErrorCode::InvalidArgument
    )]
    InRigid {
        /// Number of the node.
        node: u32,
        /// Number of the block.
        block: usize,
    },
}

crate::debug_as_display!(BuildError);

impl From<MeshError> for BuildError {
    fn from(error: MeshError) -> Self {
        Self::Mesh(error)
    }
}

impl BuildError {
    /// Code of the error.
    #[must_use]
    pub fn code(&self) -> ErrorCode {
        match self {
            Self::Mesh(_) => ErrorCode::InvalidMesh,
            Self::NoFace { .. } | Self::InRigid { .. } | Self::Loose { .. } => {
                ErrorCode::InvalidArgument
            }
            Self::Missing { .. } => ErrorCode::UnknownName,
            Self::NoJoint { .. } => ErrorCode::NotSupported,
            Self::TooMany { .. } => ErrorCode::TooLarge,
            Self::Law { .. } => ErrorCode::InvalidLaw,
        }
    }
}
