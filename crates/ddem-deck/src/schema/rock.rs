//! Regions of rock, and the cuts that divide them into blocks.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Body, DiscCut, FileOf, NetworkCut, RockFile, SurfaceFile, Where};

/// Part of the rock that cuts divide: a box, a prism, a convex polyhedron, or the rock of a file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct RockRegion {
    /// Name of the region; default none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Box along the axes, `{ from = [0, 0, 0], to = [40, 40, 30] }`, by two opposite corners `[m]`;
    /// needed without another shape.
    #[serde(rename = "box", skip_serializing_if = "Option::is_none")]
    pub bounds: Option<BoxShape>,
    /// Outline, convex or not, along an axis, `{ outline, axis, from, to }` `[m]`; needed without
    /// another shape.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub prism: Option<PrismShape>,
    /// Corners of each face of a convex polyhedron, counter-clockwise seen from outside
    /// `[m]`; needed without another shape.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub faces: Option<Vec<Vec<[f64; 3]>>>,
    /// File, whose path is relative to the folder of the deck: a closed surface (`.stl`), convex bodies
    /// (`.obj`), or cells of Neper (`.tess`) `[m]`; needed without another shape.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub file: Option<FileOf<RockFile>>,
    /// Name of the joint to regions and sets of blocks that touch the region and have one, too, and
    /// between the cells of `file`; needed without `join` if the file has several.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub joint: Option<String>,
    /// The cells of `file` are one block where they touch; default `false`.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    #[schemars(extend("default" = bool::default()))]
    pub join: bool,
    /// Name of the material; needed.
    pub material: String,
    /// Number of elements along each edge of a cell, even, at most 64; default 2.
    pub divisions: u32,
    /// Kind of the blocks, `"deformable"` or `"rigid"`; default `"deformable"`.
    pub body: Body,
    /// Direction from which dip directions count, clockwise seen from above; default `[0, 1, 0]`.
    pub north: [f64; 3],
    /// Number that determines all random orientations and spacings in the region; default 0.
    pub seed: u64,
    /// Treatment of thin blocks, `{ width, is }`; default that of its keys.
    #[serde(skip_serializing_if = "SmallBlocks::is_default")]
    pub small: SmallBlocks,
}

impl Default for RockRegion {
    fn default() -> Self {
        Self {
            name: None,
            bounds: None,
            prism: None,
            faces: None,
            file: None,
            joint: None,
            join: false,
            material: String::new(),
            divisions: 2,
            body: Body::Deformable,
            north: [0.0, 1.0, 0.0],
            seed: 0,
            small: SmallBlocks::default(),
        }
    }
}

impl RockRegion {
    /// Number of the cells of the file, 0 without one.
    #[must_use]
    pub fn n_file_cells(&self) -> usize {
        let content = self.file.as_ref().and_then(|file| file.content.as_ref());
        content.map_or(0, |content| content.n_cells())
    }
}

/// A box along the axes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BoxShape {
    /// One corner `[m]`.
    pub from: [f64; 3],
    /// The opposite corner `[m]`.
    pub to: [f64; 3],
}

/// An outline along an axis.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PrismShape {
    /// Corners of the outline, in either direction: y and z along x, x and z along y, x and y along
    /// z, shape (n, 2) `[m]`.
    pub outline: Vec<[f64; 2]>,
    /// Axis along which the outline extends, `"x"`, `"y"` or `"z"`.
    pub axis: AxisName,
    /// Position of one end on the axis `[m]`.
    pub from: f64,
    /// Position of the other end on the axis `[m]`.
    pub to: f64,
}

/// A coordinate axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum AxisName {
    /// The axis x.
    X,
    /// The axis y.
    Y,
    /// The axis z.
    Z,
}

/// Blocks that are thinner than most.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SmallBlocks {
    /// Width below which a cell is thin, as a part of the median width of the region by volume,
    /// from 0 to 1; default 0.2.
    pub width: f64,
    /// Treatment of thin cells: `"scaled"` (more inertia), `"rigid"` (and more inertia) or
    /// `"removed"`; default `"scaled"`.
    pub is: SmallKind,
}

impl Default for SmallBlocks {
    fn default() -> Self {
        Self { width: 0.2, is: SmallKind::Scaled }
    }
}

impl SmallBlocks {
    fn is_default(&self) -> bool {
        *self == Self::default()
    }
}

/// Treatment of thin blocks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum SmallKind {
    /// Inertia, but not weight, raised to that of a block which is not thin.
    #[default]
    Scaled,
    /// No deformation.
    Rigid,
    /// No block.
    Removed,
}

/// Word for bridges of whole rock.
pub(crate) const TIED: &str = "tied";

impl RockCut {
    /// Name of the joint in the bridges of rock that the cut leaves; `None` for whole rock.
    pub(crate) fn bridge_joint(&self) -> Option<&String> {
        self.bridge.as_ref().filter(|name| *name != TIED)
    }
}

/// A cut of the rock. Cuts act in the order of the deck.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct RockCut {
    /// Name of the cut; default none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Planes at distances along a normal, `{ dip, dip_direction, fisher, spacing, origin }`; needed
    /// without another shape.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub set: Option<SetCut>,
    /// One plane, `{ dip, dip_direction, through }` or `{ points }`; needed without another shape.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub plane: Option<PlaneCut>,
    /// A disc, `{ dip, dip_direction, centre, radius }`; needed without another shape.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub disc: Option<DiscCut>,
    /// Corners of a plane convex polygon, in order, shape (n, 3) `[m]`; needed without another shape.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub polygon: Option<Vec<[f64; 3]>>,
    /// A network of discs, `{ p32, size, dip, dip_direction, fisher }` or `{ file }`; needed without
    /// another shape.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dfn: Option<NetworkCut>,
    /// Ground, of an STL file or of heights over a grid (CSV, ESRI ASCII), or another surface of an STL
    /// file, whose path is relative to the folder of the deck; needed without another shape.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub surface: Option<FileOf<SurfaceFile>>,
    /// Largest vertical distance of the cut from the given points of a ground, above 0 `[m]`; default
    /// 0.005 of the diagonal of the regions.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tolerance: Option<f64>,
    /// Sides and ends of a tunnel or shaft, `{ outline, from, to }`, which cut the cells that it
    /// touches; needed without another shape.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tunnel: Option<TunnelCut>,
    /// Voronoi cells of seeds, `{ number, least }` or `{ points }`; needed without another shape.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub voronoi: Option<VoronoiCut>,
    /// Name of the joint on the planes; needed without `join`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub joint: Option<String>,
    /// The cut makes no joint, and the parts on its sides stay one block, as around a tunnel before
    /// its excavation; default `false`.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    #[schemars(extend("default" = bool::default()))]
    pub join: bool,
    /// Rock that a set with `persistence`, a disc, a polygon or a network leaves in its planes: the
    /// name of a joint, or `"tied"` for whole rock; default `"tied"`.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("default" = TIED))]
    pub bridge: Option<String>,
    /// Cells that are cut, by their centroid; default everywhere.
    #[serde(skip_serializing_if = "Where::is_everywhere")]
    pub r#where: Where,
}

/// A set of joints.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SetCut {
    /// Mean angle below the horizontal of the steepest line, from 0 to 90 `[degrees]`.
    pub dip: f64,
    /// Mean direction in which that line goes down, clockwise from `north` of the region, from 0 to
    /// 360 `[degrees]`.
    pub dip_direction: f64,
    /// Concentration κ of the Fisher distribution of the normals, above 0; default none: parallel.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fisher: Option<f64>,
    /// Distance between planes along the mean normal, above 0, or its law, `{ mean, spread }` or
    /// `{ mean, law, deviation, least }` `[m]`.
    pub spacing: SetSpacing,
    /// Share of the cells in the way of a plane that it cuts, from 0 to 1; default 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("default" = 1.0))]
    pub persistence: Option<f64>,
    /// Point on one of the planes, and on the line along which distances count `[m]`; default the
    /// middle of the regions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub origin: Option<[f64; 3]>,
}

/// Distances between the planes of a set.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum SetSpacing {
    /// The same distance everywhere `[m]`.
    Constant(f64),
    /// Random distances.
    Random(SpacingTable),
}

/// Random distances between planes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SpacingTable {
    /// Mean distance, above 0 `[m]`.
    pub mean: f64,
    /// Largest deviation, less than `mean`: all distances within `mean ± spread` are equally
    /// frequent `[m]`; needed without `law`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub spread: Option<f64>,
    /// Law of the distances, `"exponential"` or `"lognormal"`; needed without `spread`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub law: Option<SpacingLaw>,
    /// Standard deviation, above 0 `[m]`; needed with `law = "lognormal"`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub deviation: Option<f64>,
    /// Least distance, less than `mean`, above which the law begins; the mean stays `mean`
    /// `[m]`; default 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("default" = f64::default()))]
    pub least: Option<f64>,
}

/// Law of random distances.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum SpacingLaw {
    /// Planes at random positions.
    Exponential,
    /// Distances whose logarithm is normally distributed.
    Lognormal,
}

/// One plane.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct PlaneCut {
    /// Angle below the horizontal of the steepest line, from 0 to 90 `[degrees]`; needed without
    /// `points`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dip: Option<f64>,
    /// Direction in which that line goes down, clockwise from `north` of the region, from 0 to 360
    /// `[degrees]`; needed without `points`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dip_direction: Option<f64>,
    /// Point on the plane `[m]`; needed without `points`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub through: Option<[f64; 3]>,
    /// Three points on the plane, shape (3, 3) `[m]`; needed without `dip`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub points: Option<[[f64; 3]; 3]>,
}

/// A tunnel or shaft.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TunnelCut {
    /// Corners of the outline around the axis, in either direction, shape (n, 2) `[m]`.
    pub outline: Vec<[f64; 2]>,
    /// Start of the axis `[m]`.
    pub from: [f64; 3],
    /// End of the axis `[m]`.
    pub to: [f64; 3],
}

/// Voronoi cells: each is nearer to its seed than to all others.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct VoronoiCut {
    /// Number of seeds at random places in the box around the regions, from 2; needed without
    /// `points`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub number: Option<u32>,
    /// Least distance between random seeds `[m]`; default 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("default" = f64::default()))]
    pub least: Option<f64>,
    /// Seeds, shape (n, 3) `[m]`; needed without `number`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub points: Option<Vec<[f64; 3]>>,
}
