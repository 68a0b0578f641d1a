//! Sets of blocks, and the entries that change parts of them.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Deck, Orientations, Where};

/// A lattice of blocks divided by joint planes.
///
/// The cuts along each edge are `count` equal parts of `size`, or the positions in `edges`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct BlockSet {
    /// Name of the set, for `where`; default none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Corner from which the edges are measured `[m]`; default `[0, 0, 0]`.
    pub origin: [f64; 3],
    /// Lengths of the three edges of the set `[m]`; needed without `edges`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub size: Option<[f64; 3]>,
    /// Numbers of blocks along the three edges, of equal size; default `[1, 1, 1]`.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("default" = ONE_BLOCK))]
    pub count: Option<[u32; 3]>,
    /// Blocks as hexahedra of another program, instead of a lattice; default none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mesh: Option<BlockMesh>,
    /// Positions of all cuts along an edge, as in `{ x = [0.0, 1.0, 2.5] }`, instead of `size` and
    /// `count` `[m]`; default even cuts.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub edges: Option<Edges>,
    /// Number of elements along each edge of a deformable block; default 4.
    pub divisions: u32,
    /// Name of the material; needed.
    pub material: String,
    /// Name of the joint between the blocks, or one for each normal, `{ x = …, y = …, z = … }`;
    /// needed for more than one block.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub joint: Option<JointChoice>,
    /// Kind of the blocks, `"deformable"` or `"rigid"`; default `"deformable"`.
    pub body: Body,
    /// Directions of the three edges, right-handed, of any length; default the coordinate axes.
    pub axes: [[f64; 3]; 3],
    /// Dip of the joints that cut the third edge, from 0 to 90, instead of `axes` `[degrees]`;
    /// default none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dip: Option<f64>,
    /// Direction of that dip, clockwise from north, y, from 0 to 360 `[degrees]`; default none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dip_direction: Option<f64>,
    /// Orientations of all three sets of joints, instead of `axes` `[degrees]`; default none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub planes: Option<Orientations>,
}

/// Numbers of blocks along the edges of a set without joints.
const ONE_BLOCK: [u32; 3] = [1; 3];
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

    /// Numbers of blocks along the three edges, for those without `edges`: `count` or its default.
    pub(crate) fn count(&self) -> [u32; 3] {
        self.count.unwrap_or(ONE_BLOCK)
    }

    /// Names of the joints by the direction of their normal, if given.
    pub(crate) fn joints(&self) -> [Option<&str>; 3] {
        match &self.joint {
            Some(JointChoice::All(name)) => [Some(name); 3],
            Some(JointChoice::ByNormal { x, y, z }) => [x, y, z].map(|name| name.as_deref()),
            None => [None; 3],
        }
    }
}

impl Deck {
    /// Name of a set for messages: its name, or its place in the deck if it has none.
    pub(crate) fn set_name(&self, set: usize) -> String {
        let name = match set.checked_sub(self.region.len()) {
            Some(index) => &self.blocks[index].name,
            None => &self.region[set].name,
        };
        name.clone().unwrap_or_else(|| self.set_place(set))
    }

    /// Place of a set in the deck.
    pub(crate) fn set_place(&self, set: usize) -> String {
        match set.checked_sub(self.region.len()) {
            Some(index) => format!("blocks[{index}]"),
            None => format!("region[{set}]"),
        }
    }

    /// Number of a set of blocks, by its place in the deck: regions of rock have the first numbers.
    pub(crate) fn set_number(&self, blocks: usize) -> usize {
        self.region.len() + blocks
    }

    /// Names of the sets: regions of rock, then sets of blocks.
    pub(crate) fn set_names(&self) -> Vec<Option<&str>> {
        let regions = self.region.iter().map(|region| region.name.as_deref());
        let sets = self.blocks.iter().map(|set| set.name.as_deref());
        regions.chain(sets).collect()
    }
}

/// Blocks as hexahedra: parallelepipeds, each divided evenly along its three edges.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BlockMesh {
    /// Positions of the nodes, shape (n_nodes, 3) `[m]`.
    pub nodes: Vec<[f64; 3]>,
    /// Eight nodes of each hexahedron, from 0, in VTK's order, shape (n_hexes, 8).
    pub hexes: Vec<[u32; 8]>,
    /// Block of each hexahedron, numbers from 0 without gaps, shape (n_hexes,).
    pub blocks: Vec<u32>,
    /// Joints of single pairs of faces; later entries win; default the `joint` of the set.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub joints: Vec<MeshJoint>,
}

/// A joint between two faces of blocks of a mesh.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MeshJoint {
    /// The four nodes that one hexahedron has on each of the two faces.
    pub faces: [[u32; 4]; 2],
    /// Name of the joint.
    pub joint: String,
}

/// Positions of the cuts along each edge, from the first face to the last `[m]`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Edges {
    /// Cuts along the first edge.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub x: Option<Vec<f64>>,
    /// Cuts along the second edge.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub y: Option<Vec<f64>>,
    /// Cuts along the third edge.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub z: Option<Vec<f64>>,
}

/// Joints of a set: one for all planes, or one for each edge that the planes cut.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
#[schemars(deny_unknown_fields)]
pub enum JointChoice {
    /// One joint on all planes.
    All(String),
    /// One joint for each direction of the normal.
    ByNormal {
        /// Joint on the planes that cut the first edge.
        #[serde(skip_serializing_if = "Option::is_none")]
        x: Option<String>,
        /// Joint on the planes that cut the second edge.
        #[serde(skip_serializing_if = "Option::is_none")]
        y: Option<String>,
        /// Joint on the planes that cut the third edge.
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
    /// Six degrees of freedom: the eight corners move together, and joints have four pairs
    /// (docs/method.md, §8).
    Rigid,
}

/// Another joint or material for a part of the model.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Assign {
    /// Joints by the centre of their faces, blocks by their centroid; later entries win; default
    /// everywhere.
    #[serde(default, skip_serializing_if = "Where::is_everywhere")]
    pub r#where: Where,
    /// Name of the joint for the joints inside; needed without `material`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub joint: Option<String>,
    /// Name of the material for the blocks inside; needed without `joint`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub material: Option<String>,
    /// Stage at whose start the entry comes into force; default the first.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub from: Option<String>,
    /// Stage at whose start the entry ends; default none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub until: Option<String>,
}

/// Joints of regions that are left out: the cells on their sides are one block there.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Join {
    /// Joints between cells of one region, by the centre of their faces.
    pub r#where: Where,
}

/// Removed blocks: a cavity, or with `from` an excavation in that stage.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Remove {
    /// Blocks to remove, by their centroid.
    pub r#where: Where,
    /// Stage at whose start they are removed; default none: never in the model.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub from: Option<String>,
    /// Not allowed: removed blocks do not return.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub until: Option<String>,
    /// Time in which the forces of the removed blocks decrease linearly to 0, in a relax stage its
    /// increments `[s]`; default 0: at once.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("default" = f64::default()))]
    pub release: Option<f64>,
}

/// Blocks split `factor` times along each edge.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Refine {
    /// Blocks to split, by their centroid.
    pub r#where: Where,
    /// Number of parts along each edge, at least 2.
    pub factor: u32,
}
