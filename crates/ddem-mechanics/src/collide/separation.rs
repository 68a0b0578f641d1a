//! Distance of two parallelepipeds, its direction and the features in contact: separating axes.
//!
//! Two convex bodies overlap by at least the distance along any axis. For parallelepipeds the
//! largest of these distances is along a normal of one of their faces or across one edge of each.

use nalgebra::Vector3;

/// A parallelepiped.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parallelepiped {
    /// Its centre `[m]`.
    pub centre: Vector3<f64>,
    /// Half of its edges, right-handed `[m]`.
    pub half: [Vector3<f64>; 3],
}

/// A face of a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct FaceId {
    /// The edge that it lies across.
    pub direction: usize,
    /// At the upper end of that edge.
    pub upper: bool,
}

impl FaceId {
    /// All six faces, by their numbers.
    pub fn all() -> impl Iterator<Item = Self> {
        (0..6).map(Self::from_number)
    }

    /// −1 at the lower end of the edge, +1 at the upper one.
    pub fn side(self) -> i32 {
        if self.upper { 1 } else { -1 }
    }

    /// Twice the direction, plus one at the upper side.
    pub fn number(self) -> u8 {
        2 * self.direction as u8 + u8::from(self.upper)
    }

    /// The face with a number.
    pub fn from_number(number: u8) -> Self {
        Self { direction: usize::from(number / 2), upper: number % 2 == 1 }
    }
}

/// An edge of a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EdgeId {
    /// The edge that it lies along.
    pub direction: usize,
    /// At the upper ends of the next two, cyclically.
    pub upper: [bool; 2],
}

/// Features of two parallelepipeds in contact.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ContactFeature {
    /// A face of one and whatever the other has there.
    Face {
        /// The cell that the face is of: 0, a; 1, b.
        of: usize,
        /// Its face towards the other cell.
        face: FaceId,
        /// The other cell's face that looks most against it.
        other: FaceId,
    },
    /// An edge of a and one of b, crossed.
    Edges([EdgeId; 2]),
}

/// Separation of two parallelepipeds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Separation {
    /// Distance along the normal, negative where they overlap `[m]`.
    pub distance: f64,
    /// By how much the distance along normals of faces in other directions is smaller `[m]`.
    pub margin: f64,
    /// Unit vector from a to b.
    pub normal: Vector3<f64>,
    /// Features in contact.
    pub meeting: ContactFeature,
}

/// Axes that are equal but for this part of the size are tried in a fixed order.
const EQUAL: f64 = 1e-9;
/// Cosine of 10°, the angle to the face below which crossed edges are left to the face: what of it
/// lies over the other then has the crossing in it.
const NEAR_FACE: f64 = 0.984_807_753_012_208;
/// Square of the sine below which edges are parallel, and have no axis across them.
const PARALLEL: f64 = 1e-4;
/// Relative area below which a face of two edges has no normal.
const FLAT: f64 = 1e-24;

/// A cell and what its axes need.
struct Faces<'a> {
    half: &'a [Vector3<f64>; 3],
    /// Normals, as long as a quarter of the face is large.
    areas: [Vector3<f64>; 3],
    /// One over their lengths; 0 where there is no normal.
    inverse: [f64; 3],
    /// Squared lengths of the halves.
    squares: [f64; 3],
    /// True if the normals are those of the upper faces: the edges are right-handed.
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

    /// Distances along the three normals to another cell, whose halves have the products `across`
    /// with them; minus infinity where there is no normal.
    #[inline(always)]
    fn distances(&self, apart: &Vector3<f64>, across: &[[f64; 3]; 3]) -> [f64; 3] {
        [0, 1, 2].map(|d| {
            let own = self.areas[d].dot(&self.half[d]).abs();
            let [x, y, z] = across[d].map(f64::abs);
            let free = self.areas[d].dot(apart).abs() - own - (x + y + z);
            if self.inverse[d] > 0.0 { free * self.inverse[d] } else { f64::NEG_INFINITY }
        })
    }

    /// The face that looks most along a unit vector.
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

    /// The edge along a direction that is farthest along an axis.
    #[inline(always)]
    fn edge(&self, direction: usize, axis: &Vector3<f64>) -> EdgeId {
        let upper = [1, 2].map(|next| self.half[(direction + next) % 3].dot(axis) > 0.0);
        EdgeId { direction, upper }
    }
}

/// Products of normals with the halves of the other cell, of the first with all in the first row.
#[inline(always)]
fn products(areas: &[Vector3<f64>; 3], half: &[Vector3<f64>; 3]) -> [[f64; 3]; 3] {
    areas.map(|area| half.map(|h| area.dot(&h)))
}

/// The axis of largest distance among the normals of the faces and those across the edges of two
/// cells. Where they do not overlap, its distance is a lower bound of the true one.
pub fn separation(a: &Parallelepiped, b: &Parallelepiped) -> Separation {
    let apart = b.centre - a.centre;
    let (of_a, of_b) = (Faces::new(&a.half), Faces::new(&b.half));
    let across = [products(&of_a.areas, &b.half), products(&of_b.areas, &a.half)];
    let [ax, ay, az] = of_a.squares;
    let [bx, by, bz] = of_b.squares;
    let equal = EQUAL * (ax + ay + az + bx + by + bz).sqrt();

    let distances = [of_a.distances(&apart, &across[0]), of_b.distances(&apart, &across[1])];
    let (mut best, mut at) = (f64::NEG_INFINITY, None);
    for (of, distances) in distances.iter().enumerate() {
        for (direction, &distance) in distances.iter().enumerate() {
            if distance > best + equal {
                (best, at) = (distance, Some((of, direction)));
            }
        }
    }
    let Some((of, direction)) = at else { return shapeless(a, b, &apart) };
    let (one, other) = if of == 0 { (&of_a, &of_b) } else { (&of_b, &of_a) };
    let normal = towards(one.areas[direction] * one.inverse[direction], &apart);

    // The best of the normals in other directions than a given one.
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
        crossed([&of_a, &of_b], &across, &apart, best, &normal, equal)
    {
        let meeting = ContactFeature::Edges([of_a.edge(i, &normal), of_b.edge(j, &-normal)]);
        let margin = distance - second(&normal);
        return Separation { distance, margin, normal, meeting };
    }
    let outward = if of == 0 { normal } else { -normal };
    let upper = (one.areas[direction].dot(&outward) >= 0.0) == one.right;
    let face = FaceId { direction, upper };
    let meeting = ContactFeature::Face { of, face, other: other.along(&-outward) };
    Separation { distance: best, margin: best - second(&normal), normal, meeting }
}

/// The best axis across an edge of a and one of b: the distance, the axis from a to b, the directions of
/// the edges. `None` if it does not beat the distance along the best normal of a face, or is close to
/// it: then no other axis is better than the face, whose own distance may be that of a corner beside
/// the other cell.
#[inline(always)]
fn crossed(
    [a, b]: [&Faces<'_>; 2],
    across: &[[[f64; 3]; 3]; 2],
    apart: &Vector3<f64>,
    best: f64,
    face: &Vector3<f64>,
    equal: f64,
) -> Option<(f64, Vector3<f64>, [usize; 2])> {
    let (mut beat, mut found) = (best + equal, None);
    for i in 0..3 {
        let (i1, i2) = ((i + 1) % 3, (i + 2) % 3);
        let moment = apart.cross(&a.half[i]);
        for j in 0..3 {
            let (j1, j2) = ((j + 1) % 3, (j + 2) % 3);
            // Products with the axis aᵢ × bⱼ: c·(aᵢ × bⱼ) is (c × aᵢ)·bⱼ, and those with the other
            // halves are of bⱼ with normals of a and of aᵢ with normals of b, which are there.
            let in_a = across[0][i1][j].abs() + across[0][i2][j].abs();
            let in_b = across[1][j1][i].abs() + across[1][j2][i].abs();
            let free = moment.dot(&b.half[j]).abs() - in_a - in_b;
            let (both, cosine) = (a.squares[i] * b.squares[j], a.half[i].dot(&b.half[j]));
            let square = both - cosine * cosine;
            // Roots and quotients are for those that are about to win.
            if free * free.abs() > beat * beat.abs() * square && square > PARALLEL * both {
                let axis = a.half[i].cross(&b.half[j]);
                let length = axis.norm();
                let (distance, unit) = (free / length, axis / length);
                if distance > beat {
                    beat = distance + equal;
                    let apart_from_face = unit.dot(face).abs() < NEAR_FACE;
                    found = apart_from_face.then(|| (distance, towards(unit, apart), [i, j]));
                }
            }
        }
    }
    found
}

/// The axis or its opposite, whichever points along the vector from a to b.
#[inline(always)]
fn towards(axis: Vector3<f64>, apart: &Vector3<f64>) -> Vector3<f64> {
    if axis.dot(apart) < 0.0 { -axis } else { axis }
}

/// For cells none of whose faces has a normal: along the line of their centres.
#[cold]
fn shapeless(a: &Parallelepiped, b: &Parallelepiped, apart: &Vector3<f64>) -> Separation {
    let normal = apart.try_normalize(0.0).unwrap_or_else(Vector3::x);
    let (face, other) =
        (FaceId { direction: 0, upper: true }, FaceId { direction: 0, upper: false });
    let meeting = ContactFeature::Face { of: 0, face, other };
    let distance = distance_along(a, b, &normal);
    Separation { distance, margin: 0.0, normal, meeting }
}

/// Distance of two cells along a unit axis from a to b, negative where they overlap along it: a
/// lower bound of their distance `[m]`.
pub(super) fn distance_along(a: &Parallelepiped, b: &Parallelepiped, axis: &Vector3<f64>) -> f64 {
    let half = |cell: &Parallelepiped| {
        let [x, y, z] = &cell.half;
        x.dot(axis).abs() + y.dot(axis).abs() + z.dot(axis).abs()
    };
    (b.centre - a.centre).dot(axis) - (half(a) + half(b))
}
