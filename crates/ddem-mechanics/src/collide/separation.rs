//! Distance of two parallelepipeds, its direction and the features in contact, by separating axes.
//!
//! The distance of two convex shapes is at least their distance along any axis. For overlapping
//! parallelepipeds the largest of these distances is along a face normal or along the cross product
//! of an edge of each.

use nalgebra::Vector3;

/// Parallelepiped.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parallelepiped {
    /// Centre `[m]`.
    pub centre: Vector3<f64>,
    /// Half edge vectors `[m]`.
    pub half: [Vector3<f64>; 3],
}

/// Face of a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct FaceId {
    /// Edge direction that the face lies across.
    pub direction: usize,
    /// True at the upper end of that edge.
    pub upper: bool,
}

impl FaceId {
    /// All six faces in the order of their numbers.
    pub fn all() -> impl Iterator<Item = Self> {
        (0..6).map(Self::from_number)
    }

    /// Side of the face: −1 at the lower end of the edge, +1 at the upper end.
    pub fn side(self) -> i32 {
        if self.upper { 1 } else { -1 }
    }

    /// Number of the face: twice the direction, plus one at the upper side.
    pub fn number(self) -> u8 {
        2 * self.direction as u8 + u8::from(self.upper)
    }

    /// Face with a number.
    pub fn from_number(number: u8) -> Self {
        Self { direction: usize::from(number / 2), upper: number % 2 == 1 }
    }
}

/// Edge of a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EdgeId {
    /// Direction of the edge.
    pub direction: usize,
    /// True at the upper end along the next direction and along the one after it, cyclically.
    pub upper: [bool; 2],
}

/// Features of two parallelepipeds in contact.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ContactFeature {
    /// A face of one cell against any feature of the other.
    Face {
        /// Cell that owns the face: 0 is a, 1 is b.
        of: usize,
        /// Face of that cell towards the other cell.
        face: FaceId,
        /// Face of the other cell that points most against it.
        other: FaceId,
    },
    /// An edge of a and an edge of b that cross.
    Edges([EdgeId; 2]),
}

/// Separation of two parallelepipeds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Separation {
    /// Distance along the normal, negative where they overlap `[m]`.
    pub distance: f64,
    /// Distance minus the largest distance along face normals in other directions `[m]`.
    pub margin: f64,
    /// Unit vector from a to b.
    pub normal: Vector3<f64>,
    /// Features in contact.
    pub feature: ContactFeature,
}

/// Distance, as a fraction of the size, within which axes count as equal and a fixed order decides.
pub(super) const EQUAL: f64 = 1e-9;
/// Cosine of 10°. Crossed edges whose axis is closer to the face normal are left to the face,
/// because the overlap with the face then contains the crossing.
pub(super) const NEAR_FACE: f64 = 0.984_807_753_012_208;
/// Square of the sine below which edges are parallel and have no common normal.
pub(super) const PARALLEL: f64 = 1e-4;
/// Relative area below which the face of two edges has no normal.
const FLAT: f64 = 1e-24;

/// Cell with the quantities that its axes need.
struct Faces<'a> {
    half: &'a [Vector3<f64>; 3],
    /// Face normals with the length of a quarter of the face area.
    areas: [Vector3<f64>; 3],
    /// Inverse lengths of the normals; 0 without a normal.
    inverse: [f64; 3],
    /// Squared lengths of the half edges.
    squares: [f64; 3],
    /// True if the normals point out of the upper faces, that is, if the edges are right-handed.
    right: bool,
}

impl<'a> Faces<'a> {
    #[inline(always)]
    fn new(half: &'a [Vector3<f64>; 3]) -> Self {
        let [x, y, z] = half;
        let areas = [y.cross(z), z.cross(x), x.cross(y)];
        let squares = half.map(|h| h.norm_squared());
        let inverse = [0, 1, 2].map(|d| {
            let square = areas[d].norm_squared();
            let flat = square <= FLAT * (squares[(d + 1) % 3] * squares[(d + 2) % 3]);
            if flat { 0.0 } else { 1.0 / square.sqrt() }
        });
        Self { half, areas, inverse, squares, right: areas[2].dot(z) >= 0.0 }
    }

    /// Distances to another cell along the three normals. `across` are the products of the normals
    /// with the half edges of the other cell. Minus infinity without a normal.
    #[inline(always)]
    fn distances(&self, offset: &Vector3<f64>, across: &[[f64; 3]; 3]) -> [f64; 3] {
        [0, 1, 2].map(|d| {
            let own = self.areas[d].dot(&self.half[d]).abs();
            let [x, y, z] = across[d].map(f64::abs);
            let free = self.areas[d].dot(offset).abs() - own - (x + y + z);
            if self.inverse[d] > 0.0 { free * self.inverse[d] } else { f64::NEG_INFINITY }
        })
    }

    /// Face whose normal points most along a unit vector.
    #[inline(always)]
    fn along(&self, axis: &Vector3<f64>) -> FaceId {
        let (mut most, mut face) = (f64::NEG_INFINITY, FaceId { direction: 0, upper: true });
        for d in 0..3 {
            let cosine = self.areas[d].dot(axis) * self.inverse[d];
            if cosine.abs() > most + EQUAL {
                most = cosine.abs();
                face = FaceId { direction: d, upper: (cosine >= 0.0) == self.right };
            }
        }
        face
    }

    /// Edge along a direction that lies farthest along an axis.
    #[inline(always)]
    fn edge(&self, direction: usize, axis: &Vector3<f64>) -> EdgeId {
        let upper = [1, 2].map(|next| self.half[(direction + next) % 3].dot(axis) > 0.0);
        EdgeId { direction, upper }
    }
}

/// Products of normals with the half edges of the other cell; one row for each normal.
#[inline(always)]
fn products(areas: &[Vector3<f64>; 3], half: &[Vector3<f64>; 3]) -> [[f64; 3]; 3] {
    areas.map(|area| half.map(|h| area.dot(&h)))
}

/// Axis of largest distance among face normals and cross products of the edges of two cells. If the
/// cells do not overlap its distance is a lower bound of the true one.
pub fn separation(a: &Parallelepiped, b: &Parallelepiped) -> Separation {
    let offset = b.centre - a.centre;
    let (of_a, of_b) = (Faces::new(&a.half), Faces::new(&b.half));
    let across = [products(&of_a.areas, &b.half), products(&of_b.areas, &a.half)];
    let [ax, ay, az] = of_a.squares;
    let [bx, by, bz] = of_b.squares;
    let equal = EQUAL * (ax + ay + az + bx + by + bz).sqrt();

    let distances = [of_a.distances(&offset, &across[0]), of_b.distances(&offset, &across[1])];
    let (mut best, mut at) = (f64::NEG_INFINITY, None);
    for (of, distances) in distances.iter().enumerate() {
        for (direction, &distance) in distances.iter().enumerate() {
            if distance > best + equal {
                (best, at) = (distance, Some((of, direction)));
            }
        }
    }
    let Some((of, direction)) = at else { return shapeless(a, b, &offset) };
    let (one, other) = if of == 0 { (&of_a, &of_b) } else { (&of_b, &of_a) };
    let normal = towards(one.areas[direction] * one.inverse[direction], &offset);

    // Largest distance along normals in other directions than a given one.
    let second = |normal: &Vector3<f64>| {
        let mut second = f64::NEG_INFINITY;
        for (faces, distances) in [&of_a, &of_b].into_iter().zip(&distances) {
            for (d, distance) in distances.iter().enumerate() {
                let cosine = faces.areas[d].dot(normal) * faces.inverse[d];
                if cosine.abs() < NEAR_FACE {
                    second = second.max(*distance);
                }
            }
        }
        second
    };
    if let Some((distance, normal, [i, j])) =
        crossed([&of_a, &of_b], &across, &offset, best, &normal, equal)
    {
        let feature = ContactFeature::Edges([of_a.edge(i, &normal), of_b.edge(j, &-normal)]);
        let margin = distance - second(&normal);
        return Separation { distance, margin, normal, feature };
    }
    let outward = if of == 0 { normal } else { -normal };
    let upper = (one.areas[direction].dot(&outward) >= 0.0) == one.right;
    let face = FaceId { direction, upper };
    let feature = ContactFeature::Face { of, face, other: other.along(&-outward) };
    Separation { distance: best, margin: best - second(&normal), normal, feature }
}

/// Best axis across an edge of a and an edge of b: distance, axis from a to b, and directions of
/// the edges. `None` if the best face normal gives at least the same distance, or if the axis is
/// close to that normal. Then no other axis is better than the face, whose own distance may be that
/// of a corner beside the other cell.
#[inline(always)]
fn crossed(
    [a, b]: [&Faces<'_>; 2],
    across: &[[[f64; 3]; 3]; 2],
    offset: &Vector3<f64>,
    best: f64,
    face: &Vector3<f64>,
    equal: f64,
) -> Option<(f64, Vector3<f64>, [usize; 2])> {
    let (mut beat, mut found) = (best + equal, None);
    for i in 0..3 {
        let (i1, i2) = ((i + 1) % 3, (i + 2) % 3);
        let moment = offset.cross(&a.half[i]);
        for j in 0..3 {
            let (j1, j2) = ((j + 1) % 3, (j + 2) % 3);
            // Products with the axis aᵢ × bⱼ: c·(aᵢ × bⱼ) is (c × aᵢ)·bⱼ. For the other half edges
            // these are the known products of bⱼ with normals of a and of aᵢ with normals of b.
            let in_a = across[0][i1][j].abs() + across[0][i2][j].abs();
            let in_b = across[1][j1][i].abs() + across[1][j2][i].abs();
            let free = moment.dot(&b.half[j]).abs() - in_a - in_b;
            let (both, cosine) = (a.squares[i] * b.squares[j], a.half[i].dot(&b.half[j]));
            let square = both - cosine * cosine;
            // Roots and quotients are computed only for axes that are likely to win.
            if free * free.abs() > beat * beat.abs() * square && square > PARALLEL * both {
                let axis = a.half[i].cross(&b.half[j]);
                let length = axis.norm();
                let (distance, unit) = (free / length, axis / length);
                if distance > beat {
                    beat = distance + equal;
                    let apart_from_face = unit.dot(face).abs() < NEAR_FACE;
                    found = apart_from_face.then(|| (distance, towards(unit, offset), [i, j]));
                }
            }
        }
    }
    found
}

/// Axis or its opposite, so that it points along the vector from a to b.
#[inline(always)]
fn towards(axis: Vector3<f64>, offset: &Vector3<f64>) -> Vector3<f64> {
    if axis.dot(offset) < 0.0 { -axis } else { axis }
}

/// Separation of cells without any face normal, along the line of their centres.
#[cold]
fn shapeless(a: &Parallelepiped, b: &Parallelepiped, offset: &Vector3<f64>) -> Separation {
    let normal = offset.try_normalize(0.0).unwrap_or_else(Vector3::x);
    let (face, other) =
        (FaceId { direction: 0, upper: true }, FaceId { direction: 0, upper: false });
    let feature = ContactFeature::Face { of: 0, face, other };
    let distance = distance_along(a, b, &normal);
    Separation { distance, margin: 0.0, normal, feature }
}

/// Distance of two cells along a unit axis from a to b `[m]`, negative if they overlap along it. It
/// is a lower bound of their distance.
pub(super) fn distance_along(a: &Parallelepiped, b: &Parallelepiped, axis: &Vector3<f64>) -> f64 {
    let half = |cell: &Parallelepiped| {
        let [x, y, z] = &cell.half;
        x.dot(axis).abs() + y.dot(axis).abs() + z.dot(axis).abs()
    };
    (b.centre - a.centre).dot(axis) - (half(a) + half(b))
}
