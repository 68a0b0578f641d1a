//! Dip and dip direction: north is y, east is x, up is z.

use ddem_cut::sin_cos_degrees;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::BlockSet;

/// The orientation of a set of joints.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Orientation {
    /// Angle below the horizontal of the steepest line, from 0 to 90 `[degrees]`.
    pub dip: f64,
    /// Direction in which that line goes down, clockwise from north, y, from 0 to 360 `[degrees]`.
    pub dip_direction: f64,
}

/// The orientations of the joints that cut the three edges of a set.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Orientations {
    /// Orientation of the joints that cut the first edge.
    pub x: Orientation,
    /// Orientation of the joints that cut the second edge.
    pub y: Orientation,
    /// Orientation of the joints that cut the third edge.
    pub z: Orientation,
}

impl Orientations {
    /// Unit normals of the three sets of joints.
    pub(crate) fn normals(&self) -> [[f64; 3]; 3] {
        [self.x, self.y, self.z].map(|set| normal_of(set.dip, set.dip_direction))
    }
}

/// Unit normal of a dipping plane. It points up, or along the dip direction if the plane is
/// vertical.
pub(crate) fn normal_of(dip: f64, dip_direction: f64) -> [f64; 3] {
    let ((down, level), (east, north)) = (sin_cos_degrees(dip), sin_cos_degrees(dip_direction));
    [down * east, down * north, level]
}

impl BlockSet {
    /// Directions of the three edges, of any length: `axes`, or those that the orientations of the
    /// joints give.
    pub(crate) fn directions(&self) -> [[f64; 3]; 3] {
        if let Some(planes) = &self.planes {
            return edges_between(planes.normals());
        }
        let Some(dip) = self.dip else { return self.axes };
        let dip_direction = self.dip_direction.unwrap_or(0.0);
        let ((down, level), (east, north)) = (sin_cos_degrees(dip), sin_cos_degrees(dip_direction));
        // The edges point down the dip, along the strike, and along the normal.
        [[level * east, level * north, -down], [-north, east, 0.0], normal_of(dip, dip_direction)]
    }
}

fn cross([ax, ay, az]: [f64; 3], [bx, by, bz]: [f64; 3]) -> [f64; 3] {
    [ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx]
}

/// Edges in which planes with these normals meet. The third edge points up, the largest component
/// of the first is positive, and together they are right-handed.
fn edges_between(normals: [[f64; 3]; 3]) -> [[f64; 3]; 3] {
    let turned = |edge: [f64; 3], turn: bool| if turn { edge.map(|part| -part) } else { edge };
    let largest = |edge: [f64; 3]| {
        edge.into_iter()
            .fold(0.0_f64, |most, part| if part.abs() > most.abs() { part } else { most })
    };
    let [x, y, z] = [0, 1, 2].map(|d| cross(normals[(d + 1) % 3], normals[(d + 2) % 3]));
    let x = turned(x, largest(x) < 0.0);
    let z = turned(z, if z[2] == 0.0 { largest(z) < 0.0 } else { z[2] < 0.0 });
    let volume: f64 = cross(z, x).iter().zip(y).map(|(a, b)| a * b).sum();
    [x, turned(y, volume < 0.0), z]
}
