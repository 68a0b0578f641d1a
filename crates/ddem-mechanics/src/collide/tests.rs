use std::f64::consts::{FRAC_1_SQRT_2, SQRT_2};

use nalgebra::{Rotation3, Vector3};

use super::edges::nearest;
use super::hull::{ConvexHull, HullFeature, HullTopology, hull_separation};
use super::separation::{
    ContactFeature, EdgeId, FaceId, Parallelepiped, Separation, distance_along, separation,
};

/// Reproducible pseudorandom numbers in [0, 1).
pub(super) struct SplitMix(pub(super) u64);

impl SplitMix {
    pub(super) fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub(super) fn within(&mut self, most: f64) -> f64 {
        most * (2.0 * self.next() - 1.0)
    }

    fn vector(&mut self, most: f64) -> Vector3<f64> {
        Vector3::new(self.within(most), self.within(most), self.within(most))
    }

    /// Rotated and sheared box.
    fn cell(&mut self, spread: f64) -> Parallelepiped {
        let turn = Rotation3::from_scaled_axis(self.vector(3.0));
        let half = [Vector3::x(), Vector3::y(), Vector3::z()]
            .map(|axis| turn * (axis * (0.3 + self.next()) + self.vector(0.1)));
        Parallelepiped { centre: self.vector(spread), half }
    }
}

fn cube(centre: [f64; 3]) -> Parallelepiped {
    Parallelepiped {
        centre: centre.into(),
        half: [Vector3::x() * 0.5, Vector3::y() * 0.5, Vector3::z() * 0.5],
    }
}

fn turned(centre: [f64; 3], turn: Rotation3<f64>) -> Parallelepiped {
    Parallelepiped { centre: centre.into(), half: cube(centre).half.map(|half| turn * half) }
}

pub(super) fn close(a: f64, b: f64) -> bool {
    (a - b).abs() < 1e-12 * (1.0 + b.abs())
}

fn check(
    a: &Parallelepiped,
    b: &Parallelepiped,
    distance: f64,
    normal: [f64; 3],
    feature: ContactFeature,
) {
    let found = separation(a, b);
    assert!(close(found.distance, distance), "{found:?}");
    assert!((found.normal - Vector3::from(normal)).norm() < 1e-12, "{found:?}");
    assert_eq!(found.feature, feature);
    assert!(close(distance_along(a, b, &found.normal), distance));
}

const fn face(direction: usize, upper: bool) -> FaceId {
    FaceId { direction, upper }
}

#[test]
fn aligned_cubes_meet_at_faces() {
    for (d, distance, sign) in [(0, -0.1, 1.0), (1, 0.2, -1.0), (2, 0.0, 1.0), (2, -0.3, -1.0)] {
        let (mut centre, mut normal) = ([0.0; 3], [0.0; 3]);
        (centre[d], normal[d]) = (sign * (1.0 + distance), sign);
        let up = sign > 0.0;
        let feature = ContactFeature::Face { of: 0, face: face(d, up), other: face(d, !up) };
        check(&cube([0.0; 3]), &cube(centre), distance, normal, feature);
    }
}

#[test]
fn corner_meets_face() {
    // Rotation of the diagonal of a cube to the vertical.
    let diagonal = Vector3::new(1.0, 1.0, 1.0);
    let turn = Rotation3::rotation_between(&diagonal, &Vector3::z()).unwrap_or_default();
    let height = 0.5 + 0.75_f64.sqrt();
    for distance in [0.1, -0.1] {
        let (low, high) = (cube([0.0; 3]), turned([0.0, 0.0, height + distance], turn));
        let feature = ContactFeature::Face { of: 0, face: face(2, true), other: face(0, false) };
        check(&low, &high, distance, [0.0, 0.0, 1.0], feature);
        let feature = ContactFeature::Face { of: 1, face: face(2, true), other: face(0, false) };
        check(&high, &low, distance, [0.0, 0.0, -1.0], feature);
    }
}

#[test]
fn crossed_edges_meet() {
    let quarter = std::f64::consts::FRAC_PI_4;
    let low = turned([0.0; 3], Rotation3::from_axis_angle(&Vector3::x_axis(), quarter));
    for distance in [0.05, -0.05] {
        let turn = Rotation3::from_axis_angle(&Vector3::y_axis(), quarter);
        let high = turned([0.1, 0.2, SQRT_2 + distance], turn);
        let edges = [
            EdgeId { direction: 0, upper: [true, true] },
            EdgeId { direction: 1, upper: [false, true] },
        ];
        check(&low, &high, distance, [0.0, 0.0, 1.0], ContactFeature::Edges(edges));
        let edges = [edges[1], edges[0]];
        check(&high, &low, distance, [0.0, 0.0, -1.0], ContactFeature::Edges(edges));
    }
}

#[test]
fn nearly_parallel_faces_meet_as_faces() {
    let low = turned([0.0; 3], Rotation3::from_axis_angle(&Vector3::x_axis(), 0.05));
    let turn = Rotation3::from_axis_angle(&Vector3::y_axis(), 0.05);
    let found = separation(&low, &turned([0.9, 0.9, 0.97], turn));
    assert!(matches!(found.feature, ContactFeature::Face { .. }), "{found:?}");
}

/// Distance along the unit vector of an axis, from the corners of both cells.
fn by_corners(a: &Parallelepiped, b: &Parallelepiped, axis: &Vector3<f64>) -> f64 {
    let axis = if axis.dot(&(b.centre - a.centre)) < 0.0 { -axis } else { *axis };
    let most = corners(a).map(|x| x.dot(&axis)).into_iter().fold(f64::MIN, f64::max);
    let least = corners(b).map(|x| x.dot(&axis)).into_iter().fold(f64::MAX, f64::min);
    (least - most) / axis.norm()
}

fn corners(cell: &Parallelepiped) -> [Vector3<f64>; 8] {
    let sign = |i: usize, d: usize| if i >> d & 1 == 1 { 1.0 } else { -1.0 };
    [0, 1, 2, 3, 4, 5, 6, 7]
        .map(|i| cell.centre + (0..3).map(|d| cell.half[d] * sign(i, d)).sum::<Vector3<f64>>())
}

/// Outward normals of the upper faces.
fn normals(cell: &Parallelepiped) -> [Vector3<f64>; 3] {
    [0, 1, 2].map(|d| {
        let normal = cell.half[(d + 1) % 3].cross(&cell.half[(d + 2) % 3]).normalize();
        if normal.dot(&cell.half[d]) < 0.0 { -normal } else { normal }
    })
}

/// Distance along the axis that `separation` must find, and largest distance along all axes,
/// without the rules for edges. If the best axis across edges is close to the normal of the best
/// face, the normal is the axis to find.
fn by_axes(a: &Parallelepiped, b: &Parallelepiped) -> [f64; 2] {
    let (mut best, mut normal) = (f64::MIN, Vector3::zeros());
    for axis in normals(a).into_iter().chain(normals(b)) {
        let distance = by_corners(a, b, &axis);
        if distance > best {
            (best, normal) = (distance, axis);
        }
    }
    let (mut all, mut most, face) = (best, best, best);
    for i in 0..9 {
        let axis = a.half[i / 3].cross(&b.half[i % 3]);
        let sine = axis.norm() / (a.half[i / 3].norm() * b.half[i % 3].norm());
        let distance = by_corners(a, b, &axis);
        all = all.max(distance);
        if sine > 0.01 && distance > most {
            let beside = axis.normalize().dot(&normal).abs() < 10_f64.to_radians().cos();
            (most, best) = (distance, if beside { distance } else { face });
        }
    }
    [best, all]
}

/// Checks that the features in contact lie farthest along the normal.
fn check_meeting(a: &Parallelepiped, b: &Parallelepiped, found: &Separation) {
    let farthest = |cell: &Parallelepiped, axis: Vector3<f64>, at: Vector3<f64>| {
        let most = corners(cell).map(|x| x.dot(&axis)).into_iter().fold(f64::MIN, f64::max);
        assert!((at.dot(&axis) - most).abs() < 1e-12, "{found:?}");
    };
    let signed = |half: Vector3<f64>, upper: bool| if upper { half } else { -half };
    match found.feature {
        ContactFeature::Face { of, face, other } => {
            let (one, two) = if of == 0 { (a, b) } else { (b, a) };
            let outward = if of == 0 { found.normal } else { -found.normal };
            let half = &one.half;
            let middle = one.centre + signed(half[face.direction], face.upper);
            farthest(one, outward, middle);
            farthest(one, outward, middle + half[(face.direction + 1) % 3]);
            let against =
                |face: FaceId| -signed(normals(two)[face.direction], face.upper).dot(&outward);
            for direction in 0..3 {
                for upper in [false, true] {
                    assert!(against(other) > against(FaceId { direction, upper }) - 1e-8);
                }
            }
        }
        ContactFeature::Edges(edges) => {
            for (cell, edge, axis) in [(a, edges[0], found.normal), (b, edges[1], -found.normal)] {
                let [along, next, last] = [0, 1, 2].map(|k| cell.half[(edge.direction + k) % 3]);
                let middle =
                    cell.centre + signed(next, edge.upper[0]) + signed(last, edge.upper[1]);
                farthest(cell, axis, middle + along);
                farthest(cell, axis, middle - along);
            }
        }
    }
}

#[test]
fn distances_match_corners_and_sampled_directions() {
    let mut numbers = SplitMix(1);
    let directions: Vec<Vector3<f64>> =
        (0..2000).map(|_| numbers.vector(1.0).normalize()).collect();
    let mut of_edges = 0;
    for _ in 0..1000 {
        let (a, b) = (numbers.cell(1.0), numbers.cell(1.0));
        let found = separation(&a, &b);
        let [best, all] = by_axes(&a, &b);
        assert!((found.distance - best).abs() < 1e-8, "{found:?} {best}");
        assert!(close(by_corners(&a, &b, &found.normal), found.distance));
        assert!(close(found.normal.norm(), 1.0) && found.normal.dot(&(b.centre - a.centre)) >= 0.0);
        check_meeting(&a, &b, &found);
        let back = separation(&b, &a);
        assert!((back.distance - found.distance).abs() < 1e-8);
        of_edges += usize::from(matches!(found.feature, ContactFeature::Edges(_)));
        for direction in directions.iter().filter(|_| all < 0.0) {
            assert!(by_corners(&a, &b, direction) <= all + 1e-12);
        }
    }
    assert!((100..900).contains(&of_edges), "{of_edges}");
}

#[test]
fn degenerate_cells_have_answers() {
    let sound = |found: &Separation| found.distance.is_finite() && close(found.normal.norm(), 1.0);
    let mut numbers = SplitMix(2);
    let blocks = |numbers: &mut SplitMix| {
        let whole = numbers.cell(1.0);
        let [x, y, z] = whole.half;
        let o = Vector3::zeros();
        let shapes = [[x, y, z], [x, y, o], [x, o, z], [x, o, o], [o; 3], [x, x, y], [y, x, z]];
        shapes.map(|half| Parallelepiped { half, ..whole })
    };
    for _ in 0..20 {
        let (all_a, all_b) = (blocks(&mut numbers), blocks(&mut numbers));
        for a in &all_a {
            for b in &all_b {
                assert!(sound(&separation(a, b)), "{a:?} {b:?}");
                assert!(
                    sound(&separation(a, &Parallelepiped { centre: a.centre, ..*b })),
                    "{a:?} {b:?}"
                );
            }
        }
        // A left-handed cell has the same shape.
        let (found, other) = (separation(&all_a[0], &all_b[0]), separation(&all_a[6], &all_b[6]));
        assert!((found.distance - other.distance).abs() < 1e-8);
        check_meeting(&all_a[6], &all_b[6], &other);
        for huge in [1e200, f64::NAN, f64::INFINITY] {
            let wild = Parallelepiped { half: all_a[0].half.map(|half| half * huge), ..all_a[0] };
            let _ = separation(&wild, &all_b[0]);
        }
    }
}

#[test]
fn closest_points_of_edges_are_exact() {
    let v = |x: f64, y: f64, z: f64| Vector3::new(x, y, z);
    let a = [v(0.0, 0.0, 0.0), v(4.0, 0.0, 0.0)];
    // Crossed; beyond an end of a; beyond an end of b; beyond an end of each.
    assert_eq!(nearest(a, [v(1.0, -1.0, 1.0), v(1.0, 3.0, 1.0)]), [0.25, 0.25]);
    assert_eq!(nearest(a, [v(5.0, -1.0, 1.0), v(5.0, 3.0, 1.0)]), [1.0, 0.25]);
    assert_eq!(nearest(a, [v(3.0, 1.0, 1.0), v(3.0, 3.0, 1.0)]), [0.75, 0.0]);
    assert_eq!(nearest(a, [v(-3.0, -1.0, 1.0), v(-3.0, -3.0, 1.0)]), [0.0, 0.0]);
    // Parallel edges: the middle of the common length; one behind the other: the ends.
    assert_eq!(nearest(a, [v(2.0, 1.0, 0.0), v(6.0, 1.0, 0.0)]), [0.75, 0.25]);
    assert_eq!(nearest(a, [v(6.0, 1.0, 0.0), v(2.0, 1.0, 0.0)]), [0.75, 0.75]);
    assert_eq!(nearest(a, [v(5.0, 1.0, 0.0), v(6.0, 1.0, 0.0)]), [1.0, 0.0]);
    assert_eq!(nearest(a, [v(-1.0, 1.0, 0.0), v(-2.0, 1.0, 0.0)]), [0.0, 0.0]);
    // Points.
    let (p, q) = ([v(1.0, 1.0, 0.0); 2], [v(2.0, 1.0, FRAC_1_SQRT_2); 2]);
    assert_eq!(nearest(a, p)[0], 0.25);
    assert_eq!(nearest(p, a)[1], 0.25);
    assert!(nearest(p, q).iter().all(|x| (0.0..=1.0).contains(x)));
}

#[test]
fn closest_points_of_random_edges_match_sampling() {
    let mut numbers = SplitMix(7);
    for case in 0..2000 {
        let mut a = [numbers.vector(1.0), numbers.vector(1.0)];
        let mut b = [numbers.vector(1.0), numbers.vector(1.0)];
        match case % 4 {
            // Nearly parallel, or of very different lengths.
            0 => {
                let off = 10_f64.powf(-16.0 * numbers.next());
                b[1] = b[0] + (a[1] - a[0]) * 0.7 + numbers.vector(off);
            }
            1 => a[1] = a[0] + (a[1] - a[0]) * 1e-9,
            _ => {}
        }
        let at = |[s, t]: [f64; 2]| a[0].lerp(&a[1], s) - b[0].lerp(&b[1], t);
        let found = nearest(a, b);
        assert!(found.iter().all(|x| (0.0..=1.0).contains(x)));
        let least = at(found).norm();
        for k in 0..2601 {
            let on = [f64::from(k % 51) / 50.0, f64::from(k / 51) / 50.0];
            assert!(at(on).norm() > least - 1e-7, "{case}: {a:?} {b:?} {found:?} {on:?}");
        }
    }
}

/// Topology of a parallelepiped whose corners are numbered by bits.
fn box_topology() -> HullTopology {
    let ring = |FaceId { direction: d, upper }| {
        let [first, second] = [1, 2].map(|next| 1_u32 << ((d + next) % 3));
        let at = u32::from(upper) << d;
        let [first, second] = if upper { [first, second] } else { [second, first] };
        vec![at, at + first, at + first + second, at + second]
    };
    HullTopology::new(FaceId::all().map(ring).collect()).unwrap()
}

#[test]
fn hulls_of_parallelepipeds_have_their_separation() {
    let (mut random, topology) = (SplitMix(8), box_topology());
    let mut edges = 0;
    for _ in 0..2000 {
        let mut cells = [random.cell(1.5), random.cell(1.5)];
        if random.next() < 0.2 {
            // A mirrored cell.
            cells[0].half[1] *= -1.0;
        }
        let points = [corners(&cells[0]), corners(&cells[1])];
        let [a, b] = [0, 1].map(|k| ConvexHull { topology: &topology, points: &points[k] });
        let (found, exact) = (hull_separation(a, b), separation(&cells[0], &cells[1]));
        assert!(close(found.distance, exact.distance), "{found:?} {exact:?}");
        assert!((found.normal - exact.normal).norm() < 1e-9, "{found:?} {exact:?}");
        assert!(close(found.margin, exact.margin), "{found:?} {exact:?}");
        match (found.feature, exact.feature) {
            (
                HullFeature::Face { of, face, .. },
                ContactFeature::Face { of: own, face: id, .. },
            ) => {
                assert_eq!((of, face), (own, usize::from(id.number())));
            }
            (HullFeature::Edges(_), ContactFeature::Edges(_)) => edges += 1,
            _ => panic!("{found:?} {exact:?}"),
        }
    }
    assert!(edges > 100);
}

#[test]
fn the_other_face_of_a_hull_holds_its_deepest_vertex() {
    // A flat pyramid that stands with its apex on a box: the base points most against the box only
    // from the other side.
    let base = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
    let faces = vec![vec![0, 1, 2, 3], vec![1, 0, 4], vec![2, 1, 4], vec![3, 2, 4], vec![0, 3, 4]];
    let pyramid = HullTopology::new(faces).unwrap();
    let mut points: Vec<Vector3<f64>> =
        base.iter().map(|[x, y]| Vector3::new(*x, *y, 2.0)).collect();
    points.push(Vector3::new(0.1, 0.2, 0.6));
    let (topology, ground) = (box_topology(), corners(&cube([0.0; 3])));
    let found = hull_separation(
        ConvexHull { topology: &topology, points: &ground },
        ConvexHull { topology: &pyramid, points: &points },
    );
    assert!(close(found.distance, 0.1), "{found:?}");
    assert_eq!(found.normal, Vector3::z());
    let HullFeature::Face { of: 0, face: 5, other } = found.feature else { panic!("{found:?}") };
    assert!(other > 0);
}
