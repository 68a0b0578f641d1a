//! The eight-node hexahedron, integrated at 2×2×2 Gauss points.

use nalgebra::{Matrix3, Matrix6, SMatrix, SVector, Vector3, Vector6};

use super::OracleMaterial;

/// The stiffness of one element: 8 nodes × 3 components.
pub type ElementMatrix = SMatrix<f64, 24, 24>;

/// Strain from the nodal displacements.
type StrainMatrix = SMatrix<f64, 6, 24>;

/// Strain from the nine incompatible amplitudes.
type ModeMatrix = SMatrix<f64, 6, 9>;

/// Reference coordinates of the nodes, in VTK order.
const CORNERS: [[f64; 3]; 8] = [
    [-1.0, -1.0, -1.0],
    [1.0, -1.0, -1.0],
    [1.0, 1.0, -1.0],
    [-1.0, 1.0, -1.0],
    [-1.0, -1.0, 1.0],
    [1.0, -1.0, 1.0],
    [1.0, 1.0, 1.0],
    [-1.0, 1.0, 1.0],
];

/// Displacement field of an element.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Formulation {
    /// Trilinear, fully integrated.
    Standard,
    /// Trilinear with the Wilson–Taylor incompatible modes, condensed.
    Incompatible,
    /// Constant strain by the mean gradient, the rest as in the parallelepiped of the centre.
    MeanStrain,
}

/// The stiffness matrix of an element with the given node positions.
pub fn stiffness(
    nodes: &[Vector3<f64>; 8],
    material: &OracleMaterial,
    formulation: Formulation,
) -> ElementMatrix {
    if formulation == Formulation::MeanStrain {
        return mean_strain_stiffness(nodes, material);
    }
    let elasticity = elasticity(material);
    let centre = jacobian(nodes, [0.0; 3]);
    let (centre_inverse, centre_volume) = (inverse(&centre), centre.determinant());

    let mut compatible = ElementMatrix::zeros();
    let mut coupling = SMatrix::<f64, 9, 24>::zeros();
    let mut modes = SMatrix::<f64, 9, 9>::zeros();
    for point in gauss_points() {
        let jacobian = jacobian(nodes, point);
        let volume = jacobian.determinant();
        let strain = strain_matrix(&jacobian, point);
        let stress = elasticity * strain;
        compatible += strain.transpose() * stress * volume;
        if formulation == Formulation::Incompatible {
            let mode_strain = mode_matrix(&centre_inverse, point) * (centre_volume / volume);
            coupling += mode_strain.transpose() * stress * volume;
            modes += mode_strain.transpose() * (elasticity * mode_strain) * volume;
        }
    }
    if formulation == Formulation::Standard {
        return compatible;
    }
    let condensed = modes.cholesky().expect("incompatible modes are stiff").solve(&coupling);
    compatible - coupling.transpose() * condensed
}

/// The stiffness of constant strain by the mean gradient `∇̄N = ∫ ∇N dV / V`. What is left of a
/// displacement after its mean gradient is taken off, in the modes ξη, ξζ, ηζ and ξηζ, meets the
/// stiffness of the parallelepiped with the Jacobian of the centre, scaled to the volume.
fn mean_strain_stiffness(nodes: &[Vector3<f64>; 8], material: &OracleMaterial) -> ElementMatrix {
    let volume = volume(nodes);
    let mut gradients = [Vector3::zeros(); 8];
    for point in gauss_points() {
        let jacobian = jacobian(nodes, point);
        let pull_back = inverse(&jacobian).transpose() * (jacobian.determinant() / volume);
        for (gradient, corner) in gradients.iter_mut().zip(&CORNERS) {
            *gradient += pull_back * shape_gradient(corner, point);
        }
    }
    let mut strain = StrainMatrix::zeros();
    for (node, component) in (0..8).flat_map(|node| (0..3).map(move |i| (node, i))) {
        strain.set_column(3 * node + component, &strain_of(&gradients[node], component));
    }

    // Displacement without its mean gradient, by nodes; then its part in the higher modes.
    let rest = SMatrix::<f64, 8, 8>::from_fn(|a, b| {
        (if a == b { 1.0 } else { 0.0 }) - nodes[a].dot(&gradients[b])
    });
    let mode = |corner: &[f64; 3], powers: [usize; 3]| -> f64 {
        (0..3).filter(|&axis| powers[axis] == 1).map(|axis| corner[axis]).product()
    };
    let higher = [[1, 1, 0], [1, 0, 1], [0, 1, 1], [1, 1, 1]];
    let projection = SMatrix::<f64, 8, 8>::from_fn(|a, b| {
        higher.iter().map(|&m| mode(&CORNERS[a], m) * mode(&CORNERS[b], m) / 8.0).sum()
    });
    let nodal = projection * rest;
    let left = ElementMatrix::from_fn(|row, column| match row % 3 == column % 3 {
        true => nodal[(row / 3, column / 3)],
        false => 0.0,
    });
    let centre = jacobian(nodes, [0.0; 3]);
    let affine = CORNERS.map(|corner| centre * Vector3::from(corner));
    let bending = stiffness(&affine, material, Formulation::Standard);
    strain.transpose() * (elasticity(material) * strain) * volume
        + left.transpose() * bending * left * (volume / (8.0 * centre.determinant()))
}

/// The volume of an element.
pub fn volume(nodes: &[Vector3<f64>; 8]) -> f64 {
    gauss_points().map(|point| jacobian(nodes, point).determinant()).sum()
}

/// The row-sum lumped mass of each node of an element, ρV/8 for an affine one.
pub fn lumped_masses(nodes: &[Vector3<f64>; 8], material: &OracleMaterial) -> [f64; 8] {
    let mut masses = [0.0; 8];
    for point in gauss_points() {
        let weight = material.density * jacobian(nodes, point).determinant();
        for (mass, corner) in masses.iter_mut().zip(&CORNERS) {
            *mass += weight * shape(corner, point);
        }
    }
    masses
}

/// The stress at the centroid of an element under the given nodal displacements.
///
/// The incompatible strains vanish there, so it is the same for both formulations.
pub fn stress_at_centroid(
    nodes: &[Vector3<f64>; 8],
    material: &OracleMaterial,
    displacements: &[Vector3<f64>; 8],
) -> Vector6<f64> {
    let stacked = SVector::<f64, 24>::from_fn(|row, _| displacements[row / 3][row % 3]);
    let centroid = [0.0; 3];
    elasticity(material) * (strain_matrix(&jacobian(nodes, centroid), centroid) * stacked)
}

/// Hooke's law in Voigt form.
fn elasticity(material: &OracleMaterial) -> Matrix6<f64> {
    let mut matrix = Matrix6::zeros();
    matrix.fixed_view_mut::<3, 3>(0, 0).fill(material.lambda());
    for axis in 0..3 {
        matrix[(axis, axis)] += 2.0 * material.shear();
        matrix[(axis + 3, axis + 3)] = material.shear();
    }
    matrix
}

/// The eight Gauss points, each of weight one.
fn gauss_points() -> impl Iterator<Item = [f64; 3]> {
    CORNERS.iter().map(|corner| corner.map(|sign| sign / 3f64.sqrt()))
}

/// The trilinear shape function of the node at `corner`.
fn shape(corner: &[f64; 3], point: [f64; 3]) -> f64 {
    (0..3).map(|axis| (1.0 + corner[axis] * point[axis]) / 2.0).product()
}

/// The derivatives of that shape function by the reference coordinates.
fn shape_gradient(corner: &[f64; 3], point: [f64; 3]) -> Vector3<f64> {
    Vector3::from_fn(|along, _| {
        (0..3)
            .map(|axis| match axis == along {
                true => corner[axis] / 2.0,
                false => (1.0 + corner[axis] * point[axis]) / 2.0,
            })
            .product()
    })
}

/// ∂x/∂ξ: row = component of position, column = reference coordinate.
fn jacobian(nodes: &[Vector3<f64>; 8], point: [f64; 3]) -> Matrix3<f64> {
    let mut matrix = Matrix3::zeros();
    for (node, corner) in nodes.iter().zip(&CORNERS) {
        matrix += node * shape_gradient(corner, point).transpose();
    }
    matrix
}

/// The inverse of a Jacobian; the element must not be turned inside out.
fn inverse(jacobian: &Matrix3<f64>) -> Matrix3<f64> {
    assert!(jacobian.determinant() > 0.0, "an element is flat or turned inside out");
    jacobian.try_inverse().expect("a Jacobian of positive determinant has an inverse")
}

/// The Voigt strain of a displacement with the given gradient in one component and zero in the
/// others.
fn strain_of(gradient: &Vector3<f64>, component: usize) -> Vector6<f64> {
    let mut displacement = Vector3::zeros();
    displacement[component] = 1.0;
    let full = displacement * gradient.transpose();
    Vector6::new(
        full[(0, 0)],
        full[(1, 1)],
        full[(2, 2)],
        full[(0, 1)] + full[(1, 0)],
        full[(1, 2)] + full[(2, 1)],
        full[(2, 0)] + full[(0, 2)],
    )
}

/// Strain from nodal displacements at a reference point.
fn strain_matrix(jacobian: &Matrix3<f64>, point: [f64; 3]) -> StrainMatrix {
    let pull_back = inverse(jacobian).transpose();
    let mut matrix = StrainMatrix::zeros();
    for (node, corner) in CORNERS.iter().enumerate() {
        let gradient = pull_back * shape_gradient(corner, point);
        for component in 0..3 {
            matrix.set_column(3 * node + component, &strain_of(&gradient, component));
        }
    }
    matrix
}

/// Strain from the amplitudes of 1 − ξ², 1 − η², 1 − ζ², with the Jacobian of the centre
/// (Taylor's correction: the modes then pass the patch test on any shape).
fn mode_matrix(centre_inverse: &Matrix3<f64>, point: [f64; 3]) -> ModeMatrix {
    let mut matrix = ModeMatrix::zeros();
    for axis in 0..3 {
        let mut reference = Vector3::zeros();
        reference[axis] = -2.0 * point[axis];
        let gradient = centre_inverse.transpose() * reference;
        for component in 0..3 {
            matrix.set_column(3 * axis + component, &strain_of(&gradient, component));
        }
    }
    matrix
}
