//! Fractures of finite size: discs and convex polygons.

use nalgebra::Vector3;

use crate::cell::CellFace;
use crate::complex::{CellComplex, CellCut, CutCount, Cutting};
use crate::neighbours::CommonFace;
use crate::plane::CutPlane;
use crate::polyhedron::ShapeError;
use crate::random::across;
use crate::tree::AxisBox;

/// Part of the section of a cell above which a fracture in it counts: the cell is then cut whole.
pub const TOUCHED: f64 = 0.05;

/// Part of the section of a cell above which a triangle of a surface meets it. Less is rounding: files of
/// surfaces have single precision, and their edges often lie on planes that have cut before.
const MET: f64 = 1e-5;

/// Thickness of a part, in distances within which points lie on a plane, up to which a triangle leaves a cell
/// whole. Triangles of one flat face lie in it but for such distances.
const THINNEST: f64 = 10.0;

/// Number of corners of the polygon that stands for a disc.
const SIDES: usize = 32;

/// Distance relative to the size of a polygon within which its corners lie in one plane.
const FLAT: f64 = 1e-6;

/// Disc or convex polygon in a plane.
#[derive(Clone, Debug, PartialEq)]
pub struct Fracture {
    /// Plane.
    pub plane: CutPlane,
    /// Middle `[m]`.
    pub centre: Vector3<f64>,
    /// Radius of a disc; of a polygon that of a disc with the same area `[m]`.
    pub radius: f64,
    /// Corners in order `[m]`; of a disc those of a polygon with the same area.
    corners: Vec<Vector3<f64>>,
    is_disc: bool,
}

impl Fracture {
    /// Disc with a normal of any length; `None` if that or the radius is zero or not finite.
    #[must_use]
    pub fn disc(
        centre: Vector3<f64>,
        normal: Vector3<f64>,
        radius: f64,
        cut: u32,
        joined: bool,
    ) -> Option<Self> {
        let plane = CutPlane::new(normal, centre, cut, joined)?;
        let [first, second] = across(&plane.normal);
        let turn = std::f64::consts::TAU / SIDES as f64;
        // A regular polygon has the area n/2 r² sin(2π/n).
        let reach = radius * libm::sqrt(turn / libm::sin(turn));
        let corner = |i: usize| {
            let (sin, cos) = libm::sincos(turn * i as f64);
            centre + (first * cos + second * sin) * reach
        };
        let corners = (0..SIDES).map(corner).collect();
        let valid = radius > 0.0 && radius.is_finite();
        valid.then_some(Self { plane, centre, radius, corners, is_disc: true })
    }

    /// Convex polygon through corners in either direction.
    ///
    /// # Errors
    ///
    /// If the corners enclose no area, do not lie in one plane, or are not those of a convex polygon.
    pub fn polygon(corners: &[Vector3<f64>], cut: u32, joined: bool) -> Result<Self, ShapeError> {
        let area = area_vector(corners);
        let centre = corners.iter().sum::<Vector3<f64>>() / corners.len().max(1) as f64;
        let plane = CutPlane::new(area, centre, cut, joined).ok_or(ShapeError::NoArea)?;
        let size = corners.iter().map(|x| (x - centre).norm()).fold(0.0, f64::max);
        if area.norm() <= FLAT * size * size {
            return Err(ShapeError::NoArea);
        }
        let off = corners.iter().map(|x| plane.height(x).abs()).fold(0.0, f64::max);
        if off > FLAT * size {
            return Err(ShapeError::NotPlanar { face: 0, off });
        }
        let n = corners.len();
        let turns_left = |i: usize| {
            let [a, b, c] = [corners[i], corners[(i + 1) % n], corners[(i + 2) % n]];
            (b - a).cross(&(c - b)).dot(&plane.normal) >= -FLAT * size * size
        };
        if !(0..n).all(turns_left) {
            return Err(ShapeError::Crossing);
        }
        let radius = libm::sqrt(area.norm() / std::f64::consts::PI);
        Ok(Self { plane, centre, radius, corners: corners.to_vec(), is_disc: false })
    }

    /// Area `[m²]`.
    #[must_use]
    pub fn area(&self) -> f64 {
        area_vector(&self.corners).norm()
    }

    /// True if a point of the plane lies inside or on the edge.
    #[must_use]
    pub fn contains(&self, x: &Vector3<f64>) -> bool {
        if self.is_disc {
            return (x - self.centre).norm() <= self.radius;
        }
        let n = self.corners.len();
        (0..n).all(|i| {
            let [a, b] = [self.corners[i], self.corners[(i + 1) % n]];
            (b - a).cross(&(x - a)).dot(&self.plane.normal) >= 0.0
        })
    }

    /// Area within half-spaces `normal · x ≤ offset` `[m²]`.
    #[must_use]
    pub fn area_within(&self, half_spaces: &[(Vector3<f64>, f64)]) -> f64 {
        area_vector(&clipped(self.corners.clone(), half_spaces)).norm()
    }

    /// True if the fracture covers more than a share of the section of a cell.
    fn touches(&self, complex: &CellComplex, cell: usize, share: f64) -> bool {
        let faces = &complex.cells()[cell].faces;
        let corners = || faces.iter().flat_map(|face| &face.corners);
        let at = |&corner: &u32| complex.points()[corner as usize];
        let inside = corners().map(at).sum::<Vector3<f64>>() / corners().count() as f64;
        let outward = |face: &CellFace| {
            let plane = complex.plane(face);
            let sign = if plane.height(&inside) > 0.0 { -1.0 } else { 1.0 };
            (plane.normal * sign, plane.offset * sign)
        };
        let half_spaces: Vec<_> = faces.iter().map(outward).collect();
        let reach = self.corners.iter().map(|x| (x - self.centre).norm()).fold(0.0, f64::max);
        let beyond = |(normal, offset): &(Vector3<f64>, f64)| normal.dot(&self.centre) - offset;
        if half_spaces.iter().any(|half_space| beyond(half_space) > reach) {
            return false;
        }
        let covered = self.area_within(&half_spaces);
        if covered == 0.0 {
            return false;
        }
        // A square beyond the cell.
        let middle = inside - self.plane.normal * self.plane.height(&inside);
        let reach = corners().map(|corner| (at(corner) - middle).norm()).fold(0.0, f64::max);
        let [first, second] = across(&self.plane.normal);
        let square = [(2.0, 2.0), (-2.0, 2.0), (-2.0, -2.0), (2.0, -2.0)];
        let square = square.map(|(a, b)| middle + (first * a + second * b) * reach).to_vec();
        let section = area_vector(&clipped(square, &half_spaces)).norm();
        covered > share * section
    }
}

/// Area vector of a polygon `[m²]`.
pub(crate) fn area_vector(corners: &[Vector3<f64>]) -> Vector3<f64> {
    let Some(&origin) = corners.first() else { return Vector3::zeros() };
    let triangle = |two: &[Vector3<f64>]| (two[0] - origin).cross(&(two[1] - origin)) / 2.0;
    corners.windows(2).map(triangle).fold(Vector3::zeros(), |sum, part| sum + part)
}

/// Part of a convex polygon within half-spaces `normal · x ≤ offset`.
pub(crate) fn clipped(
    mut polygon: Vec<Vector3<f64>>,
    half_spaces: &[(Vector3<f64>, f64)],
) -> Vec<Vector3<f64>> {
    for (normal, offset) in half_spaces {
        let height = |x: &Vector3<f64>| normal.dot(x) - offset;
        let n = polygon.len();
        let mut kept = Vec::with_capacity(n + 1);
        for i in 0..n {
            let [a, b] = [polygon[i], polygon[(i + 1) % n]];
            let (from, to) = (height(&a), height(&b));
            if from <= 0.0 {
                kept.push(a);
            }
            if (from < 0.0 && to > 0.0) || (from > 0.0 && to < 0.0) {
                kept.push(a + (b - a) * (from / (from - to)));
            }
        }
        polygon = kept;
    }
    polygon
}

impl CellComplex {
    /// Cuts cells by fractures, the largest first. A cell of whose section a fracture covers more
    /// than [`TOUCHED`] is cut whole; [`CellComplex::covers`] tells the parts of its new faces apart.
    pub fn cut_fractures(&mut self, fractures: &[Fracture], allowed: Vec<bool>) -> CutCount {
        let cutting = self.cutting(allowed);
        self.cut_covered(fractures, cutting, TOUCHED)
    }

    /// Cuts all cells that the triangles of a surface meet by the planes of the triangles. No cell
    /// then lies on both sides of the surface, but for parts as thin as rounding.
    pub fn cut_surface(&mut self, triangles: &[Fracture], allowed: Vec<bool>) -> CutCount {
        let mut cutting = self.cutting(allowed);
        cutting.thinnest = THINNEST * self.tolerance;
        self.cut_covered(triangles, cutting, MET)
    }

    fn cut_covered(
        &mut self,
        fractures: &[Fracture],
        mut cutting: Cutting,
        share: f64,
    ) -> CutCount {
        let mut order: Vec<&Fracture> = fractures.iter().collect();
        order.sort_by(|a, b| b.radius.total_cmp(&a.radius));
        for fracture in order {
            let plane = self.planes().len() as u32;
            let before = cutting.count.divisions;
            let bounds = AxisBox::around(fracture.corners.iter());
            self.cut_one(&fracture.plane, Some(&bounds), &mut cutting, &mut |complex, cell| {
                if fracture.touches(complex, cell, share) { CellCut::Cut } else { CellCut::Leave }
            });
            if cutting.count.divisions > before {
                self.fractures.insert(plane, fracture.clone());
            }
            if cutting.count.too_many {
                break;
            }
        }
        cutting.count
    }

    /// True if a point of a plane lies on its fracture, or if the plane has no end.
    #[must_use]
    pub fn covers(&self, plane: u32, x: &Vector3<f64>) -> bool {
        self.fractures.get(&plane).is_none_or(|fracture| fracture.contains(x))
    }

    /// True if a fracture covers the middle of one of the quadrilaterals into which midpoint
    /// subdivision divides the two sides of a common face.
    #[must_use]
    pub fn is_covered(&self, common: &CommonFace) -> bool {
        let sides = common.cells.iter().zip(common.faces);
        let mut faces =
            sides.map(|(&cell, face)| &self.cells()[cell as usize].faces[face as usize]);
        faces.any(|face| {
            let n = face.corners.len();
            let at = |i: usize| self.points()[face.corners[i % n] as usize];
            let mean = (0..n).map(at).sum::<Vector3<f64>>() / n as f64;
            // The corner, the midpoints of the edges at it, and the mean of the face.
            let middle = |i: usize| (at(i) * 2.0 + (at(i + n - 1) + at(i + 1)) / 2.0 + mean) / 4.0;
            (0..n).any(|i| self.covers(common.plane, &middle(i)))
        })
    }

    /// Fracture of a plane; `None` if the plane has no end.
    #[must_use]
    pub fn fracture(&self, plane: u32) -> Option<&Fracture> {
        self.fractures.get(&plane)
    }
}
