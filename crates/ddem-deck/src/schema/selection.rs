//! Selection of a part of space: the keys of a `where`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{FileOf, SurfaceFile, Triangles, normal_of};

/// Largest angle of a joint to the wanted orientation `[degrees]`.
const WITHIN: f64 = 2.0;

/// Part of space: all given keys must hold; keys that are not given do not restrict it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Where {
    /// Plane at a number, or range `[from, to]` with its ends, along x `[m]`; default none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub x: Option<Extent>,
    /// Plane or range along y `[m]`; default none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub y: Option<Extent>,
    /// Plane or range along z `[m]`; default none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub z: Option<Extent>,
    /// Inside of a sphere, `{ centre, radius }` `[m]`; default none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sphere: Option<Sphere>,
    /// Inside of a cylinder with flat ends, `{ from, to, radius }`, as a borehole or a tunnel
    /// `[m]`; default none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cylinder: Option<Cylinder>,
    /// Points on a plane, `{ point, normal }` or `{ point, dip, dip_direction }`; default none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub plane: Option<Plane>,
    /// Half-space above a level z, a plane, or `{ topography = "heights.csv" }`; default none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub above: Option<Sheet>,
    /// Half-space below a level z, a plane, or a topography; default none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub below: Option<Sheet>,
    /// Inside of a tunnel, by the name of its cut, or of the closed surface of an STL file,
    /// whose path is relative to the folder of the deck; default none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub inside: Option<FileOf<Triangles>>,
    /// Side of a set along its own edges, `"x-"`, `"x+"`, `"y-"`, `"y+"`, `"z-"` or `"z+"`; default
    /// none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub side: Option<Side>,
    /// Joints and outer faces of this dip, from 0 to 90 `[degrees]`; default any.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dip: Option<f64>,
    /// Dip direction of these joints, clockwise from north, y, from 0 to 360 `[degrees]`; default
    /// any.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dip_direction: Option<f64>,
    /// Largest angle to `dip` and `dip_direction` `[degrees]`; default 2.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("default" = WITHIN))]
    pub within: Option<f64>,
    /// Name of a cut: joints that it made; default any.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cut: Option<String>,
    /// Name of a set of blocks; default all sets.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub set: Option<String>,
}

impl Where {
    /// True if no key is given, so that everything is selected.
    pub fn is_everywhere(&self) -> bool {
        *self == Self::default()
    }

    /// Largest angle to `dip` and `dip_direction` `[degrees]`: `within` or its default.
    pub(crate) fn within(&self) -> f64 {
        self.within.unwrap_or(WITHIN)
    }

    /// Number of planes that the `where` names.
    pub(crate) fn n_planes(&self) -> usize {
        let along = [self.x, self.y, self.z];
        let along = along.iter().filter(|extent| matches!(extent, Some(Extent::Plane(_)))).count();
        along + usize::from(self.plane.is_some()) + usize::from(self.side.is_some())
    }

    /// Topographies, by the key that names them.
    pub(crate) fn topographies(
        &self,
    ) -> impl Iterator<Item = (&'static str, &FileOf<SurfaceFile>)> {
        [("above", &self.above), ("below", &self.below)].into_iter().filter_map(|(key, sheet)| {
            match sheet {
                Some(Sheet::Topography { topography }) => Some((key, topography)),
                _ => None,
            }
        })
    }
}

/// Plane or range along one axis.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum Extent {
    /// A plane, within 1e-6 of the size of the model.
    Plane(f64),
    /// A range `[from, to]` with its ends.
    Range([f64; 2]),
}

/// A sphere.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Sphere {
    /// Centre `[m]`.
    pub centre: [f64; 3],
    /// Radius `[m]`.
    pub radius: f64,
}

/// A cylinder: a borehole or a tunnel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Cylinder {
    /// Centre of one end `[m]`.
    pub from: [f64; 3],
    /// Centre of the other end `[m]`.
    pub to: [f64; 3],
    /// Radius `[m]`.
    pub radius: f64,
}

/// A plane: `point`, and either `normal` or both `dip` and `dip_direction`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Plane {
    /// A point on it `[m]`.
    pub point: [f64; 3],
    /// Normal of the plane, of any length; default none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub normal: Option<[f64; 3]>,
    /// Angle below the horizontal of its steepest line, from 0 to 90 `[degrees]`; default none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dip: Option<f64>,
    /// Direction in which that line goes down, clockwise from north, y, from 0 to 360 `[degrees]`;
    /// default none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dip_direction: Option<f64>,
}

impl Plane {
    /// Unit normal. If the plane is given by `dip`, the normal points up or along the dip
    /// direction.
    pub(crate) fn unit_normal(&self) -> [f64; 3] {
        let Some(normal) = self.normal else {
            return normal_of(self.dip.unwrap_or(0.0), self.dip_direction.unwrap_or(0.0));
        };
        let length = normal.iter().fold(0.0_f64, |length, part| libm::hypot(length, *part));
        normal.map(|part| part / length)
    }
}

/// Boundary between the space above and the space below: a level z `[m]`, a topography, or a plane.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum Sheet {
    /// A level z `[m]`.
    Level(f64),
    /// Heights over x and y.
    Topography {
        /// Heights over a grid, CSV with the columns x, y, z or ESRI ASCII, or an open STL surface; the
        /// path is relative to the folder of the deck.
        topography: FileOf<SurfaceFile>,
    },
    /// A plane. Its upper side is above; for an upright plane, the side that the normal points to.
    Plane(Plane),
}

/// A side of a set of blocks: the lower or the upper end of one of its three edges.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum Side {
    /// Lower end of the first edge.
    #[serde(rename = "x-")]
    LowX,
    /// Upper end of the first edge.
    #[serde(rename = "x+")]
    HighX,
    /// Lower end of the second edge.
    #[serde(rename = "y-")]
    LowY,
    /// Upper end of the second edge.
    #[serde(rename = "y+")]
    HighY,
    /// Lower end of the third edge.
    #[serde(rename = "z-")]
    LowZ,
    /// Upper end of the third edge.
    #[serde(rename = "z+")]
    HighZ,
}

impl Side {
    /// Number of the edge, and true for its upper end.
    pub(crate) fn end(self) -> (usize, bool) {
        match self {
            Self::LowX => (0, false),
            Self::HighX => (0, true),
            Self::LowY => (1, false),
            Self::HighY => (1, true),
            Self::LowZ => (2, false),
            Self::HighZ => (2, true),
        }
    }
}
