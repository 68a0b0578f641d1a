//! Convex polyhedra, and the parts that planes cut off them.

use super::selector::PlaneEquation;
use ddem_core::problem::Vec3;

/// Number of sides of the prism that represents a cylinder with the same cross-sectional area.
const SIDES: usize = 720;

/// Convex polyhedron, given by its faces, counter-clockwise as seen from outside.
#[derive(Clone, Debug)]
pub(super) struct Convex(Vec<Vec<Vec3>>);

impl Convex {
    /// Parallelepiped with these corners; bit `d` of a corner's number is its end along edge `d`.
    pub(super) fn parallelepiped(corners: &[Vec3; 8]) -> Self {
        let faces =
            [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
        Self(faces.iter().map(|face| face.iter().map(|&k| corners[k]).collect()).collect())
    }

    /// Prism with the volume of a cylinder.
    pub(super) fn cylinder([from, to]: &[Vec3; 2], radius: f64) -> Self {
        let axis = (to - from).normalize();
        let across = Vec3::ith(axis.iamin(), 1.0).cross(&axis).normalize();
        let third = axis.cross(&across);
        let step = std::f64::consts::TAU / SIDES as f64;
        let reach = radius * (step / libm::sin(step)).sqrt();
        let at = |k: usize| {
            let (sine, cosine) = libm::sincos(step * (k % SIDES) as f64);
            (across * cosine + third * sine) * reach
        };
        let side = |k| vec![from + at(k), from + at(k + 1), to + at(k + 1), to + at(k)];
        let mut faces: Vec<Vec<Vec3>> = (0..SIDES).map(side).collect();
        faces.push((0..SIDES).rev().map(|k| from + at(k)).collect());
        faces.push((0..SIDES).map(|k| to + at(k)).collect());
        Self(faces)
    }

    /// Part on the side of a plane from which its normal points away.
    pub(super) fn cut(&self, plane: &PlaneEquation) -> Self {
        let (mut faces, mut rim) = (Vec::new(), Vec::new());
        for face in &self.0 {
            let mut inside = Vec::new();
            for (k, a) in face.iter().enumerate() {
                let b = &face[(k + 1) % face.len()];
                let (p, q) = (plane.signed_distance(a), plane.signed_distance(b));
                if p <= 0.0 {
                    inside.push(*a);
                }
                if (p < 0.0 && q > 0.0) || (p > 0.0 && q < 0.0) {
                    let on = a + (b - a) * (p / (p - q));
                    inside.push(on);
                    rim.push(on);
                } else if p == 0.0 {
                    rim.push(*a);
                }
            }
            // The lid replaces a face in the plane; a face that only touches the plane has no area.
            let lies = face.iter().all(|x| plane.signed_distance(x) == 0.0);
            if inside.len() > 2 && !lies {
                faces.push(inside);
            }
        }
        faces.extend(lid(&plane.normal, rim));
        Self(faces)
    }

    /// Volume `[m³]`.
    pub(super) fn volume(&self) -> f64 {
        let Some(&origin) = self.0.first().and_then(|face| face.first()) else { return 0.0 };
        let cone = |face: &Vec<Vec3>| {
            let fan = face.windows(2).map(|two| {
                (face[0] - origin).dot(&(two[0] - origin).cross(&(two[1] - origin))) / 6.0
            });
            fan.sum::<f64>()
        };
        self.0.iter().map(cone).sum()
    }
}

/// Face that closes a polyhedron where a plane has cut it, with the corners in order around their
/// middle.
fn lid(normal: &Vec3, rim: Vec<Vec3>) -> Option<Vec<Vec3>> {
    let first = rim.first()?;
    let middle = rim.iter().sum::<Vec3>() / rim.len() as f64;
    let across = (first - middle).try_normalize(0.0)?;
    let third = normal.cross(&across);
    let angle = |x: &Vec3| libm::atan2((x - middle).dot(&third), (x - middle).dot(&across));
    let mut lid = rim;
    lid.sort_by(|a, b| angle(a).total_cmp(&angle(b)));
    (lid.len() > 2).then_some(lid)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn flat(normal: [f64; 3], at: f64) -> PlaneEquation {
        let length = Vec3::from(normal).norm();
        PlaneEquation { normal: Vec3::from(normal) / length, at: at / length, tolerance: 0.0 }
    }

    fn cube() -> Convex {
        Convex::parallelepiped(&std::array::from_fn(|k| {
            Vec3::from([0, 1, 2].map(|d| (k >> d & 1) as f64))
        }))
    }

    #[test]
    fn half_spaces_cut_cube_to_exact_volume() {
        assert!((cube().volume() - 1.0).abs() < 1e-15);
        // A corner, both halves along diagonals, all, and nothing.
        for (normal, at, volume) in [
            ([1.0, 1.0, 1.0], 1.0, 1.0 / 6.0),
            ([1.0, 1.0, 1.0], 2.0, 5.0 / 6.0),
            ([1.0, 1.0, 1.0], 1.5, 0.5),
            ([1.0, 1.0, 0.0], 1.0, 0.5),
            ([-1.0, 0.0, 1.0], 0.0, 0.5),
            ([0.0, 0.0, 1.0], 0.3, 0.3),
            ([0.0, 0.0, 1.0], 1.0, 1.0),
            ([1.0, 2.0, 3.0], 7.0, 1.0),
            ([0.0, 0.0, 1.0], 0.0, 0.0),
            ([1.0, 2.0, 3.0], -1.0, 0.0),
        ] {
            let cut = cube().cut(&flat(normal, at)).volume();
            assert!((cut - volume).abs() < 1e-12, "{normal:?} {at}: {cut}, not {volume}");
        }
        let wedge = cube().cut(&flat([1.0, 0.0, 1.0], 1.0)).cut(&flat([0.0, 1.0, 0.0], 0.5));
        assert!((wedge.volume() - 0.25).abs() < 1e-12);
    }

    #[test]
    fn cylinder_and_its_half_have_exact_volume() {
        let ends = [Vec3::new(1.0, 2.0, 3.0), Vec3::new(2.0, 4.0, 5.0)];
        let exact = std::f64::consts::PI * 0.25 * 3.0;
        let cylinder = Convex::cylinder(&ends, 0.5);
        assert!((cylinder.volume() / exact - 1.0).abs() < 1e-12);
        let middle = flat([1.0, 2.0, 2.0], (ends[0] + ends[1]).dot(&Vec3::new(0.5, 1.0, 1.0)));
        assert!((cylinder.cut(&middle).volume() / exact - 0.5).abs() < 1e-12);
        // Along its axis.
        let along = flat([2.0, -1.0, 0.0], 0.0);
        assert!((cylinder.cut(&along).volume() / exact - 0.5).abs() < 1e-4);
    }
}
