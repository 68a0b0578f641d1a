//! Shapes of regions: prisms, outlines, polyhedra by faces, and their faults.

use ddem_cut::{CellComplex, Outline, PlaneSource, Polyhedron, RandomStream, ShapeError, prism};
use nalgebra::Vector3;

use crate::shared::{assert_sound, cut_all, plane, vector};

fn area(corners: &[[f64; 2]]) -> f64 {
    let next = corners.iter().cycle().skip(1);
    corners.iter().zip(next).map(|(a, b)| (a[0] * b[1] - a[1] * b[0]) / 2.0).sum()
}

fn parts_of(outline: &Outline) -> Vec<f64> {
    let corner = |&i: &usize| outline.corners()[i];
    let parts = outline.convex_parts();
    parts.iter().map(|part| area(&part.iter().map(corner).collect::<Vec<_>>())).collect()
}

#[test]
fn convex_outlines_stay_whole() {
    let outline =
        Outline::new(&[[-4.0, 0.0], [4.0, 0.0], [4.0, 3.0], [2.0, 5.0], [-2.0, 5.0], [-4.0, 3.0]])
            .unwrap();
    assert_eq!(parts_of(&outline), [36.0]);
    // Clockwise, with a corner on a straight side and one twice.
    let square = [[0.0, 0.0], [0.0, 1.0], [0.0, 2.0], [2.0, 2.0], [2.0, 2.0], [2.0, 0.0]];
    let outline = Outline::new(&square).unwrap();
    assert_eq!(outline.corners().len(), 4);
    assert_eq!(parts_of(&outline), [4.0]);
}

#[test]
fn concave_outlines_are_split_to_convex_parts() {
    let bench = [[0.0, 0.0], [4.0, 0.0], [4.0, 1.0], [2.0, 1.0], [2.0, 3.0], [0.0, 3.0]];
    let outline = Outline::new(&bench).unwrap();
    let parts = parts_of(&outline);
    assert_eq!(parts.len(), 2);
    assert!((parts.iter().sum::<f64>() - 8.0).abs() < 1e-15);
    // A star with any radii: the parts are convex and have its area.
    let mut numbers = RandomStream::new(1, 0);
    for n in 3..40 {
        let corner = |i: usize| {
            let angle = std::f64::consts::TAU * i as f64 / n as f64;
            let radius = 0.2 + numbers.uniform();
            [radius * libm::cos(angle), radius * libm::sin(angle)]
        };
        let star: Vec<[f64; 2]> = (0..n).map(corner).collect();
        let outline = Outline::new(&star).unwrap();
        let parts = parts_of(&outline);
        assert!(parts.iter().all(|part| *part > 0.0));
        assert!((parts.iter().sum::<f64>() - area(&star)).abs() < 1e-13);
    }
}

#[test]
fn parts_of_a_prism_are_one_block() {
    let bench = [[0.0, 0.0], [4.0, 0.0], [4.0, 1.0], [2.0, 1.0], [2.0, 3.0], [0.0, 3.0]];
    let outline = Outline::new(&bench).unwrap();
    let place = |[x, z]: [f64; 2], y: f64| Vector3::new(x, -y, z);
    let parts = prism(&outline, [-5.0, 0.0], place).unwrap();
    let mut rock = CellComplex::new(&[parts]);
    assert_sound(&rock, 40.0);
    let matched = rock.common_faces();
    assert_eq!(matched.len(), 1);
    assert_eq!(rock.blocks(&matched), [0, 0]);
    cut_all(&mut rock, &[plane(vector([0.1, 0.2, 1.0]), vector([1.0, 1.0, 0.8]))]);
    assert_sound(&rock, 40.0);
    let blocks = rock.blocks(&rock.common_faces());
    assert_eq!(blocks.iter().max(), Some(&1));
}

/// A cut of one part only ends on the plane between the parts. The whole part holds both pieces.
#[test]
fn a_cut_that_ends_on_a_joined_plane_leaves_one_block() {
    let bench = [[0.0, 0.0], [4.0, 0.0], [4.0, 1.0], [2.0, 1.0], [2.0, 3.0], [0.0, 3.0]];
    let outline = Outline::new(&bench).unwrap();
    let place = |[x, z]: [f64; 2], y: f64| Vector3::new(x, -y, z);
    let parts = prism(&outline, [-5.0, 0.0], place).unwrap();
    let mut rock = CellComplex::new(&[parts]);
    let allowed = rock.select(|cell, _| cell == 0);
    rock.cut(&[plane(vector([0.0, 1.0, 0.1]), vector([0.0, 2.5, 0.0]))], allowed);
    assert_eq!(rock.cells().len(), 3);
    let common = rock.common_faces();
    assert_eq!(common.iter().filter(|face| !face.matches).count(), 2, "{common:?}");
    assert_eq!(rock.blocks(&common), [0; 3]);
}

#[test]
fn only_faces_that_overlap_are_common() {
    let mut rock = CellComplex::new(&[vec![
        Polyhedron::brick(Vector3::zeros(), vector([2.0, 1.0, 1.0])).unwrap(),
    ]]);
    cut_all(&mut rock, &[plane(Vector3::x(), vector([1.0, 0.0, 0.0]))]);
    let half =
        |low: bool, rock: &CellComplex| rock.select(|cell, _| (rock.centroid(cell).x < 1.0) == low);
    // Two strips along y below, three along z above: each strip meets each other one.
    let allowed = half(true, &rock);
    rock.cut(&[plane(Vector3::y(), vector([0.0, 0.4, 0.0]))], allowed);
    let allowed = half(false, &rock);
    let across = [0.2, 0.7].map(|z| plane(Vector3::z(), vector([0.0, 0.0, z])));
    rock.cut(&across, allowed);
    let common = rock.common_faces();
    assert_eq!(common.iter().filter(|face| !face.matches).count(), 2 * 3);
    assert_eq!(common.iter().filter(|face| face.matches).count(), 1 + 2);
}

#[test]
fn polyhedra_overlap_by_more_than_a_face() {
    let brick =
        |x: f64| Polyhedron::brick(vector([x, 0.0, 0.0]), vector([x + 1.0, 1.0, 1.0])).unwrap();
    assert!(brick(0.0).overlaps(&brick(0.9), 1e-6));
    assert!(!brick(0.0).overlaps(&brick(1.0), 1e-6));
    // Crossed rods are apart along the product of two edges only.
    let rod = |along: Vector3<f64>, aside: Vector3<f64>, z: f64| {
        let corner = |s: f64, t: f64, u: f64| along * s + aside * t + Vector3::z() * (u + z);
        let end = |s: f64| {
            [(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)]
                .map(|(t, u)| corner(s, 0.2 * t, 0.2 * u))
        };
        let (low, high) = (end(-1.0), end(1.0));
        let mut faces = vec![low.to_vec(), high.iter().rev().copied().collect()];
        faces.extend((0..4).map(|i| vec![low[i], high[i], high[(i + 1) % 4], low[(i + 1) % 4]]));
        Polyhedron::from_faces(&faces)
            .or_else(|_| {
                faces.iter_mut().for_each(|face| face.reverse());
                Polyhedron::from_faces(&faces)
            })
            .unwrap()
    };
    let (one, other) =
        (rod(Vector3::x(), Vector3::y(), 0.0), rod(Vector3::y(), Vector3::x(), 0.41));
    assert!(!one.overlaps(&other, 1e-6));
    assert!(one.overlaps(&rod(Vector3::y(), Vector3::x(), 0.39), 1e-6));
}

#[test]
fn regions_that_share_a_face_are_two_blocks_with_common_faces() {
    let brick = |x: f64| Polyhedron::brick(vector([x, 0.0, 0.0]), vector([x + 1.0, 1.0, 1.0]));
    let mut rock = CellComplex::new(&[vec![brick(0.0).unwrap()], vec![brick(1.0).unwrap()]]);
    cut_all(&mut rock, &[plane(vector([0.3, 0.2, 1.0]), vector([1.0, 0.5, 0.5]))]);
    assert_eq!(rock.cells().iter().map(|cell| cell.region).collect::<Vec<_>>(), [0, 1, 0, 1]);
    let matched = rock.common_faces();
    let between = |face: &&ddem_cut::CommonFace| {
        rock.planes()[face.plane as usize].source == PlaneSource::Region
    };
    assert_eq!((matched.len(), matched.iter().filter(between).count()), (4, 2));
    assert_eq!(rock.blocks(&matched), [0, 1, 2, 3]);
}

#[test]
fn outlines_without_area_or_crossing_themselves_are_refused() {
    assert_eq!(Outline::new(&[[0.0, 0.0], [1.0, 0.0]]), Err(ShapeError::NoArea));
    assert_eq!(Outline::new(&[[0.0, 0.0], [1.0, 1.0], [2.0, 2.0]]), Err(ShapeError::NoArea));
    let crossing = [[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]];
    assert_eq!(Outline::new(&crossing), Err(ShapeError::Crossing));
    let touching = [[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [2.0, 0.0], [0.0, 4.0]];
    assert_eq!(Outline::new(&touching), Err(ShapeError::Crossing));
}

/// Faces of a cube of edge 1, outward.
fn cube_faces() -> Vec<Vec<Vector3<f64>>> {
    let brick = Polyhedron::brick(Vector3::zeros(), Vector3::repeat(1.0)).unwrap();
    brick
        .faces
        .iter()
        .map(|face| face.iter().map(|&corner| brick.points[corner]).collect())
        .collect()
}

#[test]
fn faces_must_close_to_a_convex_shape_seen_from_outside() {
    let faces = cube_faces();
    assert!((Polyhedron::from_faces(&faces).unwrap().volume() - 1.0).abs() < 1e-15);
    let open = Polyhedron::from_faces(&faces[1..]);
    assert!(matches!(open, Err(ShapeError::Open { n: 0, .. })), "{open:?}");
    let inward: Vec<Vec<_>> =
        faces.iter().map(|face| face.iter().rev().copied().collect()).collect();
    assert_eq!(Polyhedron::from_faces(&inward), Err(ShapeError::InsideOut));
    let mut one_turned = faces.clone();
    one_turned[2].reverse();
    assert!(matches!(Polyhedron::from_faces(&one_turned), Err(ShapeError::Open { .. })));
    let mut bent = faces.clone();
    for corner in bent.iter_mut().flatten() {
        if *corner == Vector3::repeat(1.0) {
            *corner += Vector3::repeat(0.2);
        }
    }
    assert!(matches!(Polyhedron::from_faces(&bent), Err(ShapeError::NotPlanar { .. })));
    // A dent: the upper face is replaced by four triangles down to the middle.
    let top = faces.iter().position(|face| face.iter().all(|x| x.z == 1.0)).unwrap();
    let mut dented = faces.clone();
    let rim = dented.remove(top);
    let middle = vector([0.5, 0.5, 0.7]);
    dented.extend((0..4).map(|i| vec![rim[i], rim[(i + 1) % 4], middle]));
    let dented = Polyhedron::from_faces(&dented);
    assert!(matches!(dented, Err(ShapeError::NotConvex { .. })), "{dented:?}");
    let flat = Polyhedron::brick(Vector3::zeros(), vector([1.0, 1.0, 0.0]));
    assert_eq!(flat, Err(ShapeError::NoVolume));
}
