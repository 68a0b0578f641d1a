//! Parts of cells: blocks that are hexahedra of any shape.
//!
//! A part is a lattice of one cell. The lattice has the parallelepiped with the same mean edges, and
//! [`PartShape`] the true corners. Nodes are at equal steps of the trilinear map, so that their
//! deviations from the parallelepiped have no mean and no first moments.

use std::collections::BTreeMap;
use std::sync::Arc;

use nalgebra::{Matrix3, Point3};

use crate::{Lattice, Topology, Vec3};
use ddem_mechanics::element::hex8::lumped_mass;
use ddem_mechanics::element::hexahedron::HexahedronElement;
use ddem_mechanics::element::{Elastic, ElementKind};

/// Steps of Newton's method for the coordinates of a point.
const MOST_STEPS: usize = 30;

/// Shape of a part of a cell.
#[derive(Clone, Debug, PartialEq)]
pub struct PartShape {
    /// Corners, numbered by bits `[m]`.
    pub corners: [Vec3; 8],
    /// Number of the block of the user: cells that are joined form one.
    pub block: u32,
    /// Number of the cell that it is a part of.
    pub cell: u32,
    /// Number of the vertex of the cell at its lowest corner.
    pub vertex: u32,
    /// Vertices at the other ends of the edges of the cell that its edges through that corner lie on.
    pub ends: [Option<u32>; 3],
    /// Faces of the cell that its lower faces across each direction lie in.
    pub faces: [Option<u32>; 3],
    /// Least width of the cell `[m]`.
    pub width: f64,
    /// Centroid of the cell `[m]`, by which its parts are selected.
    pub centroid: Vec3,
    /// Factor on its inertia, but not on its weight, at least 1.
    pub inertia: f64,
}

/// True if an element of a part, divided into `n` elements along each edge, has no volume.
#[must_use]
pub fn distorted(part: &PartShape, n: usize) -> bool {
    let topology = Topology::lattice(n);
    let sound = |element: usize| {
        let corners = topology
            .hex(element)
            .map(|node| part.point(topology.steps(node).map(|at| at as f64 / n as f64)));
        // The material does not matter.
        HexahedronElement::new(&corners, &Elastic::new(1.0, 1.0, 0.0), ElementKind::Standard)
            .is_some()
    };
    !(0..topology.elements()).all(sound)
}

/// Bounds of the step of hexahedra of one body, with their corners in VTK's order: the largest ratio
/// of stiffness to mass of the nodes of each one in any direction `[1/s²]`, and its volume `[m³]`.
/// Corners with equal coordinates are one node.
#[must_use]
pub fn stiffest_nodes(
    hexahedra: &[[Vec3; 8]],
    material: &Elastic,
    kind: ElementKind,
) -> Vec<[f64; 2]> {
    let place = |corner: &Vec3| <[f64; 3]>::from(*corner).map(f64::to_bits);
    let mut nodes: BTreeMap<[u64; 3], [f64; 4]> = BTreeMap::new();
    let mut volumes = Vec::with_capacity(hexahedra.len());
    for corners in hexahedra {
        let element = HexahedronElement::new(corners, material, kind);
        volumes.push(element.as_ref().map_or(0.0, |element| element.volume));
        let Some(element) = element else { continue };
        let mass = lumped_mass(&corners.map(Point3::from), material.density);
        let own = corners.iter().zip(mass).zip(element.diagonal());
        for ((corner, mass), diagonal) in own {
            let sums = nodes.entry(place(corner)).or_default();
            sums[0] += mass;
            (0..3).for_each(|c| sums[1 + c] += diagonal[c]);
        }
    }
    let ratio = |corner: &Vec3| {
        let [mass, x, y, z] = nodes.get(&place(corner)).copied().unwrap_or_default();
        x.max(y).max(z) / mass
    };
    let largest = |corners: &[Vec3; 8]| corners.iter().map(ratio).fold(0.0, f64::max);
    hexahedra.iter().map(largest).zip(volumes).map(Into::into).collect()
}

impl PartShape {
    /// Point at coordinates from 0 to 1 along the three edges `[m]`.
    #[must_use]
    pub fn point(&self, at: [f64; 3]) -> Vec3 {
        let weight = |corner: usize| -> f64 {
            (0..3).map(|d| if corner >> d & 1 == 1 { at[d] } else { 1.0 - at[d] }).product()
        };
        let corners = self.corners.iter().enumerate();
        corners.fold(Vec3::zeros(), |sum, (corner, x)| sum + x * weight(corner))
    }

    /// Mean of the four edges along each direction `[m]`.
    #[must_use]
    pub fn edges(&self) -> [Vec3; 3] {
        [0, 1, 2].map(|d| {
            let sign = |corner: usize| if corner >> d & 1 == 1 { 0.25 } else { -0.25 };
            let corners = self.corners.iter().enumerate();
            corners.fold(Vec3::zeros(), |sum, (corner, x)| sum + x * sign(corner))
        })
    }

    /// Mean of the corners `[m]`.
    #[must_use]
    pub fn middle(&self) -> Vec3 {
        self.corners.iter().sum::<Vec3>() / 8.0
    }

    /// Coordinates of a point along the three edges, from 0 to 1 inside; far outside if Newton's
    /// method does not find them.
    #[must_use]
    pub fn coordinates(&self, x: &Vec3) -> [f64; 3] {
        let mut at = Vec3::repeat(0.5);
        for _ in 0..MOST_STEPS {
            let error = x - self.point(at.into());
            let column = |d: usize| {
                let end = |to: f64| {
                    let mut at = <[f64; 3]>::from(at);
                    at[d] = to;
                    self.point(at)
                };
                end(1.0) - end(0.0)
            };
            let slope = Matrix3::from_columns(&[column(0), column(1), column(2)]);
            let Some(inverse) = slope.try_inverse() else { return [f64::INFINITY; 3] };
            let step = inverse * error;
            at += step;
            if step.amax() <= 1e-14 {
                break;
            }
            if at.amax() > 1e3 {
                return [f64::INFINITY; 3];
            }
        }
        at.into()
    }

    /// Lattice of one cell with the part.
    #[must_use]
    pub fn lattice(self, set: usize, material: u16, divisions: usize) -> Lattice {
        let edges = self.edges();
        let origin = self.middle() - edges.iter().sum::<Vec3>() / 2.0;
        let lattice = Lattice::of_one_block(set, material, divisions, origin, edges);
        Lattice { part: Some(Arc::new(self)), ..lattice }
    }
}
