//! Block sets and what changes parts of them.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Deck, Orientations, Where};

/// A lattice of blocks divided by joint planes.
///
/// The cuts along each edge are `count` equal parts of `size`, or the positions in `edges`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct BlockSet {
    /// Name of the set, for `where = { set = … }`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// The corner from which edges are measured `[m]`.
    pub origin: [f64; 3],
    /// Length of the three edges of the whole set `[m]`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub size: Option<[f64; 3]>,
    /// Blocks along the three edges; default 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub count: Option<[u32; 3]>,
    /// Blocks as hexahedra of another program, instead of a lattice.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mesh: Option<BlockMesh>,
    /// Uneven cuts; an edge given here needs neither `size` nor `count`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub edges: Option<Edges>,
    /// Elements along each edge of a deformable block.
    pub divisions: u32,
    /// Name of the material.
    pub material: String,
    /// Name of the joint between the blocks, one for all or one for each normal; needed where
    /// there is more than one block.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub joint: Option<JointChoice>,
    /// Deformable or rigid blocks.
    pub body: Body,
    /// Directions of the three edges (any length); oblique ones give parallelepipeds.
    pub axes: [[f64; 3]; 3],
    /// Dip of the joints that cut the third edge, from 0 to 90 `[degrees]`, instead of `axes`: the
    /// first edge points down the dip, the second along the strike.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dip: Option<f64>,
    /// Direction of that dip, clockwise from north, y, from 0 to 360 `[degrees]`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dip_direction: Option<f64>,
    /// Orientations of all three sets of joints, instead of `axes`; oblique ones give parallelepipeds.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub planes: Option<Orientations>,
}

/// The coordinate axes.
pub(crate) const COORDINATES: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

impl Default for BlockSet {
    fn default() -> Self {
        Self {
            name: None,
            origin: [0.0; 3],
            size: None,
            count: None,
            mesh: None,
            edges: None,
            divisions: 4,
            material: String::new(),
            joint: None,
            body: Body::Deformable,
            axes: COORDINATES,
            dip: None,
            dip_direction: None,
            planes: None,
        }
    }
}

impl BlockSet {
    /// Elements along each edge of a block: `divisions`, but one for a rigid block, whose eight
    /// corners are its nodes.
    #[must_use]
    pub fn elements_along_edge(&self) -> u32 {
        match self.body {
            Body::Deformable => self.divisions,
            Body::Rigid => 1,
        }
    }

    /// Names of the joints by the direction of their normal, where given.
    pub(crate) fn joints(&self) -> [Option<&str>; 3] {
        match &self.joint {
            Some(JointChoice::All(name)) => [Some(name); 3],
            Some(JointChoice::ByNormal { x, y, z }) => [x, y, z].map(|name| name.as_deref()),
            None => [None; 3],
        }
    }
}

impl Deck {
    /// Name of a set for messages: its name, or its place where it has none.
    pub(crate) fn set_name(&self, set: usize) -> String {
        self.blocks[set].name.clone().unwrap_or_else(|| format!("blocks[{set}]"))
    }
}

/// Blocks as hexahedra: parallelepipeds, each divided evenly along its three edges.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BlockMesh {
    /// Positions of the nodes, shape `(n_nodes, 3)` `[m]`.
    pub nodes: Vec<[f64; 3]>,
    /// Nodes of the hexahedra in VTK's order, from 0, shape `(n_hexes, 8)`.
    pub hexes: Vec<[u32; 8]>,
    /// Block of each hexahedron, numbers from 0 without gaps, shape `(n_hexes)`.
    pub blocks: Vec<u32>,
    /// Joints of single pairs of faces, instead of the `joint` of the set; later entries win.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub joints: Vec<MeshJoint>,
}

/// A joint between two faces of blocks of a mesh.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MeshJoint {
    /// Four nodes on each of the two faces, as those of a hexahedron there.
    pub faces: [[u32; 4]; 2],
    /// Name of the joint.
    pub joint: String,
}

/// Positions of the cuts along each edge, from the first face to the last `[m]`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Edges {
    /// Along the first edge.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub x: Option<Vec<f64>>,
    /// Along the second edge.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub y: Option<Vec<f64>>,
    /// Along the third edge.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub z: Option<Vec<f64>>,
}

/// The joints of a set: one for all, or by the edge that the joint's plane cuts.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
#[schemars(deny_unknown_fields)]
pub enum JointChoice {
    /// One joint on all planes.
    All(String),
    /// One for each direction of the normal.
    ByNormal {
        /// Planes that cut the first edge.
        #[serde(skip_serializing_if = "Option::is_none")]
        x: Option<String>,
        /// Planes that cut the second edge.
        #[serde(skip_serializing_if = "Option::is_none")]
        y: Option<String>,
        /// Planes that cut the third edge.
        #[serde(skip_serializing_if = "Option::is_none")]
        z: Option<String>,
    },
}

/// Kind of a block.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Body {
    /// Meshed with hex8 elements.
    #[default]
    Deformable,
    /// Six degrees of freedom (§8): eight corners that move together, joints in four pairs.
    Rigid,
}

/// Another joint or material for a part of the model.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Assign {
    /// Joints whose face centre lies inside; blocks whose centroid does, or a face of which lies on
    /// a plane given.
    #[serde(rename = "where", default, skip_serializing_if = "Where::is_everywhere")]
    pub region: Where,
    /// Name of the joint for the joints inside. From a later stage on it can have other strengths than the
    /// one before, and must have its thickness, stiffness and density.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub joint: Option<String>,
    /// Name of the material for the blocks inside.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub material: Option<String>,
    /// Stage from whose start this is in force.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub from: Option<String>,
    /// Stage up to whose start this is in force.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub until: Option<String>,
}

/// Blocks taken out: a cavity, or an excavation when it starts with a stage.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Remove {
    /// Blocks whose centroid lies inside, or a face of which lies on a plane given.
    #[serde(rename = "where")]
    pub region: Where,
    /// Stage at whose start they are taken out; without it they were never there.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub from: Option<String>,
    /// Blocks do not come back: refused.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub until: Option<String>,
    /// Time over which the forces that they exerted on the rest go to zero `[s]`, in a relax stage
    /// its increments; default 0, at once.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub release: Option<f64>,
}

/// Blocks split `factor` times along each edge.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Refine {
    /// Blocks whose centroid lies inside.
    #[serde(rename = "where")]
    pub region: Where,
    /// Parts along each edge.
    pub factor: u32,
}
