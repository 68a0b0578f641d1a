//! Tractions on the joint planes of the independent finite element model.

use std::collections::BTreeMap;

use nalgebra::{DVector, Vector3};

use super::fem::{Formulation, LatticePart, Mesh, stiffness, volume};

/// Corners of an element that face each other along each axis.
const FACING: [[[usize; 2]; 4]; 3] = [
    [[0, 1], [3, 2], [4, 5], [7, 6]],
    [[0, 3], [1, 2], [4, 7], [5, 6]],
    [[0, 4], [1, 5], [2, 6], [3, 7]],
];

/// Position of a pair, and its traction `T = (F_a − F_b)/(2 A_p)`.
pub(crate) type Pair = (Vector3<f64>, Vector3<f64>);

/// Pairs of the joint plane at `at` along `axis`, without strips and corners, eq. (M1).
pub(crate) fn tractions(mesh: &Mesh, u: &[f64], axis: usize, at: f64) -> Vec<Pair> {
    let mut pairs: BTreeMap<usize, (Vector3<f64>, Vector3<f64>, f64)> = BTreeMap::new();
    for element in mesh.elements.iter().filter(|element| element.kind == LatticePart::Joint) {
        let corners = mesh.corners(element);
        let [near, far] = [0, 6].map(|corner: usize| corners[corner][axis]);
        if (0.5 * (near + far) - at).abs() > 1e-6 {
            continue;
        }
        let matrix = stiffness(&corners, &element.material, Formulation::Standard);
        let moved = element.nodes.iter().flat_map(|node| u[3 * node..3 * node + 3].to_vec());
        let force = -(matrix * DVector::from_iterator(24, moved));
        let at = |corner: usize| Vector3::from_iterator(force.iter().skip(3 * corner).copied());
        let quarter = volume(&corners) / (far - near) / 4.0;
        for [a, b] in FACING[axis] {
            let place = 0.5 * (corners[a] + corners[b]);
            let pair = pairs.entry(element.nodes[a]);
            let pair = pair.or_insert((place, Vector3::zeros(), 0.0));
            pair.1 += at(a) - at(b);
            pair.2 += quarter;
        }
    }
    pairs.into_values().map(|(place, force, area)| (place, force / (2.0 * area))).collect()
}
