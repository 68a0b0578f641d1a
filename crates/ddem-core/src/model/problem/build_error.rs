//! Faults of a problem that is built from arrays.

use crate::error::ErrorCode;
use ddem_mesh::MeshError;

/// Fault of a problem that is built from arrays.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BuildError {
    /// Fault of the mesh.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// A number that refers to nothing.
    #[error("there is no {what} {number}: there are {count}, from 0")]
    Missing {
        /// Kind of item.
        what: &'static str,
        /// Number that was given.
        number: usize,
        /// Number of existing items.
        count: usize,
    },
    /// Four nodes that do not lie on one face of a block.
    #[error("nodes {quad:?} are no part of a face of a block")]
    NoFace {
        /// The four nodes.
        quad: [u32; 4],
    },
    /// Two faces that a joint cannot join.
    #[error("blocks {blocks:?} cannot be joined by joint `{joint}`: {why}")]
    NoJoint {
        /// The two blocks.
        blocks: [usize; 2],
        /// Name of the joint.
        joint: String,
        /// Reason.
        why: String,
    },
    /// More items than 16-bit numbers can count; one of these numbers means none.
    #[error("there are {count} {what}: {} are the most", u16::MAX)]
    TooMany {
        /// Kind of item.
        what: &'static str,
        /// Number of items.
        count: usize,
    },
    /// A joint law with numbers that springs cannot have.
    #[error("the law of joint `{joint}`: {why}")]
    Law {
        /// Name of the joint.
        joint: String,
        /// Reason.
        why: String,
    },
    /// A node of a rigid block that is not one of its corners.
    #[error("node {node} is inside of rigid block {block}, of which only the corners are nodes")]
    InRigid {
        /// Number of the node.
        node: u32,
        /// Number of the block.
        block: usize,
    },
}

impl BuildError {
    /// Code of the error.
    #[must_use]
    pub fn code(&self) -> ErrorCode {
        match self {
            Self::Mesh(_) | Self::NoFace { .. } | Self::InRigid { .. } => ErrorCode::InvalidMesh,
            Self::Missing { .. } => ErrorCode::UnknownName,
            Self::NoJoint { .. } => ErrorCode::NotSupported,
            Self::TooMany { .. } => ErrorCode::TooLarge,
            Self::Law { .. } => ErrorCode::InvalidLaw,
        }
    }
}
