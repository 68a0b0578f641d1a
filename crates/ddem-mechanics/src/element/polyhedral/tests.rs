use std::f64::consts::TAU;

use fearless_simd::{Level, dispatch};
use nalgebra::{DMatrix, Matrix3, Vector3};

use super::{CornerNodes, PolyhedralCorner, PolyhedralTable, force};
use crate::element::hexahedron::{HexahedronElement, HexahedronTable};
use crate::element::{Elastic, ElementKind};
use crate::math::lanes::{LANES, Lanes, load, zero};

fn material() -> Elastic {
    Elastic::new(2400.0, 18e9, 0.27)
}

/// Pyramid divided at its vertices: nodes, hexahedra at the base, and the corner at the apex.
struct Pyramid {
    nodes: Vec<Vector3<f64>>,
    hexahedra: Vec<[usize; 8]>,
    apex: Vec<usize>,
    volume: f64,
}

/// Oblique pyramid over a polygon of `sides` sides.
fn pyramid(sides: usize) -> Pyramid {
    let map = Matrix3::new(1.0, 0.2, 0.3, -0.1, 1.3, 0.4, 0.1, -0.2, 0.8);
    let base: Vec<Vector3<f64>> = (0..sides)
        .map(|i| {
            let angle = TAU * (i as f64 + 0.3 * (1.7 * i as f64).sin()) / sides as f64;
            map * Vector3::new(angle.cos(), angle.sin(), 0.0)
        })
        .collect();
    let apex = map * Vector3::new(0.2, -0.3, 1.5);
    let mean = |of: &[Vector3<f64>]| of.iter().sum::<Vector3<f64>>() / of.len() as f64;
    let next = |i: usize| (i + 1) % sides;
    // Vertices, middles of the sides of the base and of the edges to the apex, means of the faces.
    let mut nodes = base.clone();
    nodes.push(apex);
    nodes.extend((0..sides).map(|i| mean(&[base[i], base[next(i)]])));
    nodes.extend((0..sides).map(|i| mean(&[base[i], apex])));
    nodes.extend((0..sides).map(|i| mean(&[base[i], base[next(i)], apex])));
    nodes.push(mean(&base));
    nodes.push((base.iter().sum::<Vector3<f64>>() + apex) / (sides + 1) as f64);
    let (side, edge, face) = (sides + 1, 2 * sides + 1, 3 * sides + 1);
    let (bottom, cell) = (4 * sides + 1, 4 * sides + 2);
    let hexahedra = (0..sides)
        .map(|i| {
            let before = (i + sides - 1) % sides;
            [i, side + i, bottom, side + before, edge + i, face + i, cell, face + before]
        })
        .collect();
    let mut corner = vec![sides];
    corner.extend((0..sides).map(|i| edge + i));
    corner.extend((0..sides).map(|i| face + i));
    corner.push(cell);
    let volume = (1..sides - 1)
        .map(|i| (base[i] - base[0]).cross(&(base[i + 1] - base[0])).dot(&(apex - base[0])) / 6.0)
        .sum();
    Pyramid { nodes, hexahedra, apex: corner, volume }
}

/// Element at the apex.
fn corner(pyramid: &Pyramid) -> PolyhedralCorner {
    let nodes: Vec<_> = pyramid.apex.iter().map(|&node| pyramid.nodes[node]).collect();
    PolyhedralCorner::new(&nodes, &material()).expect("a volume")
}

/// Forces of the element in one of the lanes.
fn forces(element: &PolyhedralCorner, u: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
    let table = PolyhedralTable::new([Some(element), None, None, None], u.len());
    let u: Vec<[Lanes; 3]> = u.iter().map(|u| [u.x, u.y, u.z].map(|u| Lanes([u; 4]))).collect();
    let mut f = vec![[Lanes::ZERO; 3]; u.len()];
    dispatch!(Level::new(), simd => force(simd, &table, &u, &mut f));
    assert!(f.iter().flatten().all(|f| f.0[1..] == [0.0; 3]));
    f.iter().map(|f| Vector3::from(f.map(|f| f.0[0]))).collect()
}

/// Stiffness from the forces of unit displacements.
fn stiffness(element: &PolyhedralCorner, nodes: usize) -> DMatrix<f64> {
    let mut dense = DMatrix::zeros(3 * nodes, 3 * nodes);
    for column in 0..3 * nodes {
        let mut u = vec![Vector3::zeros(); nodes];
        u[column / 3][column % 3] = 1.0;
        for (node, f) in forces(element, &u).into_iter().enumerate() {
            for k in 0..3 {
                dense[(3 * node + k, column)] = f[k];
            }
        }
    }
    dense
}

#[test]
fn surface_is_closed() {
    for edges in 3..8 {
        let corner = CornerNodes { edges };
        assert_eq!(corner.quads().count(), 2 * edges);
        let sides: Vec<[usize; 2]> =
            corner.quads().flat_map(|q| (0..4).map(move |k| [q[k], q[(k + 1) % 4]])).collect();
        for &[a, b] in &sides {
            assert_eq!(sides.iter().filter(|&&side| side == [b, a]).count(), 1, "{a} {b}");
        }
        assert!(sides.iter().flatten().all(|&node| node < corner.count()));
    }
}

#[test]
fn volumes_of_the_parts_of_a_pyramid_are_its_own() {
    for sides in 4..8 {
        let pyramid = pyramid(sides);
        let of = |nodes: &[usize; 8]| {
            let corners = nodes.map(|node| pyramid.nodes[node]);
            HexahedronElement::new(&corners, &material(), ElementKind::default())
                .expect("a volume")
                .volume
        };
        let sum = pyramid.hexahedra.iter().map(of).sum::<f64>() + corner(&pyramid).volume;
        assert!((sum / pyramid.volume - 1.0).abs() < 1e-14, "{sides}: {sum} {}", pyramid.volume);
    }
}

#[test]
fn stiffness_is_symmetric_with_six_rigid_motions() {
    for sides in 4..8 {
        let pyramid = pyramid(sides);
        let stiffness = stiffness(&corner(&pyramid), 2 * sides + 2);
        let most = stiffness.amax();
        assert!((&stiffness - stiffness.transpose()).amax() < 1e-14 * most);
        let values = stiffness.symmetric_eigenvalues();
        let free = values.iter().filter(|value| value.abs() < 1e-9 * most).count();
        assert_eq!(free, 6, "{sides}");
        assert!(values.min() > -1e-12 * most);
    }
}

/// In a linear field the inner node of a pyramid, where hexahedra and corner meet, is in equilibrium,
/// and the others have the forces of the uniform stress on the surface.
#[test]
fn linear_fields_are_in_equilibrium_beside_hexahedra() {
    let gradient = Matrix3::new(1.0, 0.3, -0.2, 0.5, -0.7, 0.4, 0.1, 0.6, 0.2) * 1e-3;
    let stress = {
        let rows = [0, 1, 2].map(|i| [0, 1, 2].map(|k| gradient[(i, k)]));
        let [xx, yy, zz, xy, yz, zx] = material().stress(&rows);
        Matrix3::new(xx, xy, zx, xy, yy, yz, zx, yz, zz)
    };
    for sides in 4..8 {
        let pyramid = pyramid(sides);
        let mut sum = vec![Vector3::zeros(); pyramid.nodes.len()];
        let mut moment = Matrix3::zeros();
        let mut add = |node: usize, f: Vector3<f64>| {
            sum[node] += f;
            moment += f * pyramid.nodes[node].transpose();
        };
        for of in &pyramid.hexahedra {
            let corners = of.map(|node| pyramid.nodes[node]);
            let element = HexahedronElement::new(&corners, &material(), ElementKind::Incompatible);
            let table = HexahedronTable::new([element.as_ref(); LANES]);
            let found = dispatch!(Level::new(), simd => {
                let mut u = [zero(simd); 8];
                for (u, corner) in u.iter_mut().zip(&corners) {
                    let value = gradient * corner;
                    *u = load(simd, &[value.x, value.y, value.z].map(|u| Lanes([u; 4])));
                }
                crate::element::hexahedron::force(simd, &table, &u).map(|f| f.map(Lanes::from))
            });
            for (&node, f) in of.iter().zip(found) {
                add(node, Vector3::from(f.map(|f| f.0[0])));
            }
        }
        let u: Vec<_> = pyramid.apex.iter().map(|&node| gradient * pyramid.nodes[node]).collect();
        for (&node, f) in pyramid.apex.iter().zip(forces(&corner(&pyramid), &u)) {
            add(node, f);
        }
        let largest = sum.iter().map(Vector3::norm).fold(0.0, f64::max);
        let inner = sum[pyramid.nodes.len() - 1];
        assert!(inner.norm() < 1e-13 * largest, "{sides}: {}", inner.norm() / largest);
        // The moments of the forces are V σ.
        assert!((moment / pyramid.volume - stress).amax() < 1e-12 * stress.amax(), "{sides}");
    }
}

#[test]
fn corners_without_volume_are_refused() {
    let pyramid = pyramid(5);
    let mut nodes: Vec<_> = pyramid.apex.iter().map(|&node| pyramid.nodes[node]).collect();
    nodes[1..6].reverse();
    nodes[6..10].reverse();
    assert!(PolyhedralCorner::new(&nodes, &material()).is_none(), "turned inside out");
    assert!(PolyhedralCorner::new(&[Vector3::zeros(); 10], &material()).is_none());
    nodes.pop();
    for count in [0, 1, 6, 11] {
        assert!(PolyhedralCorner::new(&nodes[..count], &material()).is_none(), "{count} nodes");
    }
}
