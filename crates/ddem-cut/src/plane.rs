//! Planes, and the directions of planes that dip.

use nalgebra::Vector3;

/// Plane of faces: `normal · x = offset`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CutPlane {
    /// Unit normal.
    pub normal: Vector3<f64>,
    /// Distance from the origin along the normal `[m]`.
    pub offset: f64,
    /// Origin of the plane.
    pub source: PlaneSource,
    /// True if no joint lies between the cells that meet here.
    pub joined: bool,
}

/// Origin of a plane.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum PlaneSource {
    /// Face of a region, or between two convex parts of one.
    Region,
    /// Cut, by its number.
    Cut(u32),
    /// Bridge of rock that a cut leaves in its plane, by the number of the cut.
    Bridge(u32),
}

impl CutPlane {
    /// Plane of a cut through a point, with a normal of any length; `None` if that length is zero or
    /// not finite.
    #[must_use]
    pub fn new(
        normal: Vector3<f64>,
        through: Vector3<f64>,
        cut: u32,
        joined: bool,
    ) -> Option<Self> {
        let normal = unit(normal)?;
        let offset = normal.dot(&through);
        offset.is_finite().then_some(Self { normal, offset, source: PlaneSource::Cut(cut), joined })
    }

    /// Plane of a cut through three points; `None` if they lie on one line.
    #[must_use]
    pub fn through(points: [Vector3<f64>; 3], cut: u32, joined: bool) -> Option<Self> {
        let [a, b, c] = points;
        let (ab, ac) = (b - a, c - a);
        let normal = ab.cross(&ac);
        // A sine below this leaves no digits of the normal.
        if normal.norm() <= 1e-9 * ab.norm() * ac.norm() {
            return None;
        }
        Self::new(normal, a, cut, joined)
    }

    /// Same plane for the bridges of rock that its cut leaves.
    pub(crate) fn bridge(&self) -> Self {
        let source = match self.source {
            PlaneSource::Cut(cut) => PlaneSource::Bridge(cut),
            other => other,
        };
        Self { source, ..*self }
    }

    /// Signed distance of a point `[m]`, positive on the side of the normal.
    #[must_use]
    pub fn height(&self, x: &Vector3<f64>) -> f64 {
        self.normal.dot(x) - self.offset
    }
}

/// Vector of length 1 along a vector; `None` if that has no direction.
pub(crate) fn unit(vector: Vector3<f64>) -> Option<Vector3<f64>> {
    let largest = vector.amax();
    // Without the first division the squares of very small and very large parts are lost.
    let scaled = vector / largest;
    (largest > 0.0 && largest.is_finite()).then(|| scaled / scaled.norm())
}

/// Directions by compass: dip directions count clockwise from north, seen from above.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Compass {
    north: Vector3<f64>,
    east: Vector3<f64>,
}

impl Default for Compass {
    fn default() -> Self {
        Self { north: Vector3::y(), east: Vector3::x() }
    }
}

impl Compass {
    /// Compass whose north is the horizontal part of a vector; `None` if that part is zero.
    #[must_use]
    pub fn new(north: Vector3<f64>) -> Option<Self> {
        let north = unit(Vector3::new(north.x, north.y, 0.0))?;
        Some(Self { north, east: north.cross(&Vector3::z()) })
    }

    /// Horizontal unit vector to the north.
    #[must_use]
    pub fn north(&self) -> Vector3<f64> {
        self.north
    }

    /// Plunge below the horizontal and trend of a direction `[degrees]`. The trend counts as dip
    /// directions do, from 0 to 360; a vertical direction has 0.
    #[must_use]
    pub fn plunge_trend(&self, direction: &Vector3<f64>) -> [f64; 2] {
        let [east, north] = [self.east, self.north].map(|axis| axis.dot(direction));
        let level = libm::hypot(east, north);
        let plunge = libm::atan2(-direction.z, level).to_degrees();
        let trend = libm::atan2(east, north).to_degrees();
        [plunge, if level <= 1e-12 * direction.norm() { 0.0 } else { trend.rem_euclid(360.0) }]
    }

    /// Unit normal of a plane that dips `[degrees]`. It points up, or along the dip direction if the
    /// plane is vertical.
    #[must_use]
    pub fn normal(&self, dip: f64, dip_direction: f64) -> Vector3<f64> {
        let ((down, level), (east, north)) = (sin_cos_degrees(dip), sin_cos_degrees(dip_direction));
        (self.east * east + self.north * north) * down + Vector3::z() * level
    }
}

/// Sine and cosine of an angle in degrees, without rounding where they are 0, 1 and −1.
#[must_use]
pub fn sin_cos_degrees(degrees: f64) -> (f64, f64) {
    match degrees.rem_euclid(360.0) {
        0.0 => (0.0, 1.0),
        90.0 => (1.0, 0.0),
        180.0 => (0.0, -1.0),
        270.0 => (-1.0, 0.0),
        other => libm::sincos(other.to_radians()),
    }
}
