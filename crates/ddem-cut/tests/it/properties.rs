//! Volume, centroid, inertia and width of cells.

use ddem_cut::{CellComplex, Polyhedron, RandomStream};
use nalgebra::{Matrix3, Rotation3, Vector3};

use crate::shared::{any_vector, cube, cut_all, plane};

/// Volume, ∫x dV and ∫x xᵀ dV of a cell.
type Integrals = (f64, Vector3<f64>, Matrix3<f64>);

/// Weights and barycentric coordinates of seven points of a triangle, exact to degree five (Radon).
fn quadrature() -> Vec<(f64, [f64; 3])> {
    let root = 15.0_f64.sqrt();
    let mut points = vec![(9.0 / 40.0, [1.0 / 3.0; 3])];
    for sign in [-1.0, 1.0] {
        let (weight, a) = ((155.0 + sign * root) / 1200.0, (6.0 + sign * root) / 21.0);
        for i in 0..3 {
            let mut point = [a; 3];
            point[i] = 1.0 - 2.0 * a;
            points.push((weight, point));
        }
    }
    points
}

/// Integrals by the divergence theorem: each integrand is a derivative along one axis.
fn by_surface(rock: &CellComplex, cell: usize, origin: &Vector3<f64>) -> Integrals {
    let (mut volume, mut first, mut second) = (0.0, Vector3::zeros(), Matrix3::zeros());
    for face in &rock.cells()[cell].faces {
        let at = |i: usize| rock.points()[face.corners[i] as usize] - origin;
        for i in 2..face.corners.len() {
            let corners = [at(0), at(i - 1), at(i)];
            let area = (corners[1] - corners[0]).cross(&(corners[2] - corners[0])) / 2.0;
            for (weight, shares) in quadrature() {
                let x: Vector3<f64> =
                    (0..3).map(|k| corners[k] * shares[k]).fold(Vector3::zeros(), |a, b| a + b);
                volume += weight * x.z * area.z;
                for a in 0..3 {
                    first[a] += weight * x[a] * x[a] / 2.0 * area[a];
                    for b in 0..3 {
                        let flux =
                            if a == b { x[a].powi(3) / 3.0 } else { x[a].powi(2) / 2.0 * x[b] };
                        second[(a, b)] += weight * flux * area[a];
                    }
                }
            }
        }
    }
    (volume, first, second)
}

#[test]
fn cells_of_random_planes_agree_with_the_divergence_theorem() {
    for seed in 0..20 {
        let mut numbers = RandomStream::new(seed, 0);
        let mut rock = cube(1.0);
        let mut any = || any_vector(&mut numbers);
        let planes: Vec<_> =
            (0..8).map(|_| plane(any(), any() / 2.0 + Vector3::repeat(0.5))).collect();
        cut_all(&mut rock, &planes);
        for cell in 0..rock.cells().len() {
            let properties = rock.properties(cell);
            let size = properties.volume.cbrt();
            let (volume, first, second) = by_surface(&rock, cell, &properties.centroid);
            // A thin cell has few digits of its volume left.
            assert!((volume - properties.volume).abs() < 1e-15, "{volume} {properties:?}");
            assert!(first.norm() < 1e-14 * (1e-3 + size.powi(4)), "{first} {size}");
            let inertia = Matrix3::identity() * second.trace() - second;
            assert!((inertia - properties.inertia).norm() < 1e-15, "{inertia}");
            assert!((properties.centroid - rock.centroid(cell)).norm() < 1e-13);
        }
    }
}

fn turned(shape: &Polyhedron, turn: &Rotation3<f64>, offset: Vector3<f64>) -> Polyhedron {
    let points = shape.points.iter().map(|point| turn * point + offset).collect();
    Polyhedron { points, faces: shape.faces.clone() }
}

#[test]
fn turned_boxes_have_the_inertia_of_their_edges() {
    let mut numbers = RandomStream::new(11, 0);
    for _ in 0..100 {
        let edges = any_vector(&mut numbers).abs() + Vector3::repeat(0.1);
        let turn = Rotation3::from_scaled_axis(any_vector(&mut numbers) * 3.0);
        let offset = any_vector(&mut numbers) * 10.0;
        let brick = Polyhedron::brick(-edges / 2.0, edges / 2.0).unwrap();
        let rock = CellComplex::new(&[vec![turned(&brick, &turn, offset)]]);
        let properties = rock.properties(0);
        let volume = edges.product();
        let squares = edges.component_mul(&edges) * (volume / 12.0);
        let own = Matrix3::from_diagonal(&Vector3::from([
            squares.y + squares.z,
            squares.x + squares.z,
            squares.x + squares.y,
        ]));
        let expected = turn.matrix() * own * turn.matrix().transpose();
        assert!((properties.volume - volume).abs() < 1e-13);
        assert!((properties.centroid - offset).norm() < 1e-13);
        assert!((properties.inertia - expected).norm() < 1e-13);
        assert!((properties.width - edges.min()).abs() < 1e-13);
    }
}

#[test]
fn tetrahedra_have_the_inertia_of_their_corners() {
    let mut numbers = RandomStream::new(12, 0);
    let mut tested = 0;
    while tested < 100 {
        let [a, b, c, d] = [(); 4].map(|()| any_vector(&mut numbers));
        let volume = (b - a).cross(&(c - a)).dot(&(d - a)) / 6.0;
        if volume < 0.01 {
            continue;
        }
        tested += 1;
        let faces = [vec![a, c, b], vec![a, b, d], vec![b, c, d], vec![c, a, d]];
        let rock = CellComplex::new(&[vec![Polyhedron::from_faces(&faces).unwrap()]]);
        let properties = rock.properties(0);
        // V/20 (Σ xxᵀ) with corners counted from the centroid, whose sum is zero.
        let centroid = (a + b + c + d) / 4.0;
        let second: Matrix3<f64> = [a, b, c, d]
            .iter()
            .map(|x| (x - centroid) * (x - centroid).transpose() * (volume / 20.0))
            .fold(Matrix3::zeros(), |sum, part| sum + part);
        let expected = Matrix3::identity() * second.trace() - second;
        assert!((properties.volume - volume).abs() < 1e-14);
        assert!((properties.centroid - centroid).norm() < 1e-14);
        assert!((properties.inertia - expected).norm() < 1e-14);
        // The least height: three times the volume over the largest face.
        let area = |x: [Vector3<f64>; 3]| (x[1] - x[0]).cross(&(x[2] - x[0])).norm() / 2.0;
        let largest = [[a, b, c], [a, b, d], [b, c, d], [c, a, d]].map(area);
        let largest = largest.into_iter().fold(0.0, f64::max);
        assert!((properties.width - 3.0 * volume / largest).abs() < 1e-13);
    }
}
