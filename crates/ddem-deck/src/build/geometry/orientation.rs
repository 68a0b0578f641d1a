//! Orientations of planes: dip and dip direction.

use crate::schema::{Where, normal_of};
use ddem_core::problem::Vec3;

/// Rounding error of an angle `[rad]`.
const ROUNDING: f64 = 1e-9;

/// Orientation of planes.
#[derive(Clone, Copy, Debug)]
pub(super) struct OrientationFilter {
    /// Angle below the horizontal `[rad]`.
    dip: f64,
    /// Unit normal; `None` if planes may dip in any direction.
    normal: Option<Vec3>,
    /// Largest deviation of planes `[rad]`.
    within: f64,
}

impl OrientationFilter {
    pub(super) fn new(selector: &Where) -> Option<Self> {
        let dip = selector.dip?;
        let direction = if dip == 0.0 { Some(0.0) } else { selector.dip_direction };
        Some(Self {
            dip: dip.to_radians(),
            normal: direction.map(|direction| Vec3::from(normal_of(dip, direction))),
            within: selector.within().to_radians() + ROUNDING,
        })
    }

    /// True if a plane with this normal, which may point to either side, has the orientation.
    pub(super) fn has(&self, normal: &Vec3) -> bool {
        let off = match self.normal {
            Some(wanted) => libm::atan2(wanted.cross(normal).norm(), wanted.dot(normal).abs()),
            None => (libm::atan2(normal.xy().norm(), normal.z.abs()) - self.dip).abs(),
        };
        off <= self.within
    }
}
