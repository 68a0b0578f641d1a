use fearless_simd::{Level, dispatch};
use nalgebra::{Matrix3, Point3, SMatrix, SVector, Vector3};

use super::{HexahedronElement, HexahedronTable, MOST_POISSON, force, scaled_jacobian};
use crate::element::hex8::{self, CORNERS, ElementStiffness};
use crate::element::modal::Modal;
use crate::element::{Elastic, ElementKind};
use crate::math::lanes::{LANES, Lanes, load, zero};

const KINDS: [ElementKind; 2] = [ElementKind::Standard, ElementKind::Incompatible];

/// Numbers between −1 and 1, the same in every run.
pub(crate) struct Numbers(pub(crate) u64);

impl Numbers {
    pub(crate) fn next(&mut self) -> f64 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / f64::from(1 << 30) / f64::from(1 << 22) - 1.0
    }

    pub(crate) fn vector(&mut self) -> Vector3<f64> {
        Vector3::new(self.next(), self.next(), self.next())
    }
}

/// Corners of a cube with edges of 2 m under a random linear map, each moved by up to `part`.
fn corners(numbers: &mut Numbers, part: f64) -> [Vector3<f64>; 8] {
    loop {
        let map = Matrix3::from_fn(|_, _| numbers.next());
        if map.determinant() > 0.05 {
            return CORNERS.map(|at| map * (Vector3::from(at) + numbers.vector() * part));
        }
    }
}

/// Hexahedra whose Jacobian is positive at all Gauss points.
fn hexahedra(count: usize, part: f64) -> Vec<[Vector3<f64>; 8]> {
    let mut numbers = Numbers(7);
    let mut found = Vec::new();
    while found.len() < count {
        let corners = corners(&mut numbers, part);
        let positive = |&at: &[f64; 3]| hex8::strain_matrix(&corners.map(Point3::from), at).1 > 0.0;
        if hex8::gauss_points().iter().chain(&[[0.0; 3]]).all(positive) {
            found.push(corners);
        }
    }
    found
}

fn material(poisson: f64) -> Elastic {
    Elastic::new(2400.0, 18e9, poisson)
}

/// Stiffness from the forces of unit displacements.
fn stiffness(element: &HexahedronElement) -> ElementStiffness {
    let table = HexahedronTable::new([None, Some(element), None, None]);
    let mut dense = ElementStiffness::zeros();
    for column in 0..24 {
        let mut u = [[Lanes::ZERO; 3]; 8];
        u[column / 3][column % 3] = Lanes([1.0; LANES]);
        let f = forces(&table, &u);
        assert!(f.iter().flatten().all(|f| (f.0[0], f.0[2], f.0[3]) == (0.0, 0.0, 0.0)));
        dense.set_column(column, &SVector::from_fn(|row, _| f[row / 3][row % 3].0[1]));
    }
    dense
}

fn forces(table: &HexahedronTable, u: &[[Lanes; 3]; 8]) -> [[Lanes; 3]; 8] {
    dispatch!(Level::new(), simd => {
        let mut at = [zero(simd); 8];
        for (at, u) in at.iter_mut().zip(u) {
            *at = load(simd, u);
        }
        force(simd, table, &at).map(|f| f.map(Lanes::from))
    })
}

fn distance(a: &ElementStiffness, b: &ElementStiffness) -> f64 {
    (a - b).abs().max() / b.abs().max()
}

/// Values of the modes at the corners over 8, times the identity: amplitudes of a displacement.
fn amplitudes(mode: usize) -> SMatrix<f64, 3, 24> {
    let value = |corner: [f64; 3]| -> f64 {
        (0..3).filter(|k| mode & (1 << k) != 0).map(|k| corner[k]).product()
    };
    SMatrix::from_fn(|i, column| if column % 3 == i { value(CORNERS[column / 3]) } else { 0.0 })
}

/// The element from its definition: `V B̄ᵀ D B̄ + Pᵀ K P` with the mean strain matrix B̄ of the Gauss
/// points, the part P of a displacement that is not linear, and the stiffness K that the
/// parallelepiped has for this part, by Gauss points for the standard element.
fn definition(corners: &[Vector3<f64>; 8], poisson: f64, kind: ElementKind) -> ElementStiffness {
    let points = corners.map(Point3::from);
    let (mut mean, mut volume) = (SMatrix::<f64, 6, 24>::zeros(), 0.0);
    for at in hex8::gauss_points() {
        let (b, weight) = hex8::strain_matrix(&points, at);
        mean += b * weight;
        volume += weight;
    }
    mean /= volume;
    let x = SMatrix::<f64, 24, 1>::from_iterator(corners.iter().flatten().copied());
    let edges = [1, 2, 4].map(|mode| amplitudes(mode) * x / 4.0);
    let centre = edges[0].cross(&edges[1]).dot(&edges[2]);
    let affine = CORNERS
        .map(|at| Point3::from((0..3).map(|k| edges[k] * (at[k] / 2.0)).sum::<Vector3<f64>>()));
    // The same G as the material.
    let young = 18e9 * (1.0 + poisson.min(MOST_POISSON)) / (1.0 + poisson);
    let capped = Elastic::new(2400.0, young, poisson.min(MOST_POISSON));
    let whole = match kind {
        ElementKind::Standard => hex8::stiffness(&affine, &material(poisson)),
        ElementKind::Incompatible => Modal::new(&edges, &capped, kind).dense(),
    };
    // Displacements of the four modes beyond the linear ones, from their amplitudes.
    let mut warping = SMatrix::<f64, 12, 24>::zeros();
    for (m, mode) in [3, 5, 6, 7].into_iter().enumerate() {
        warping.fixed_view_mut::<3, 24>(3 * m, 0).copy_from(&amplitudes(mode));
    }
    // Mean gradient without symmetry: its entries are those of B̄.
    let gradient = SMatrix::<f64, 9, 24>::from_fn(|row, column| {
        let (i, k) = (row / 3, row % 3);
        if column % 3 == i { mean[(k, column - column % 3 + k)] } else { 0.0 }
    });
    let positions = warping * x;
    let linear = SMatrix::<f64, 12, 9>::from_fn(|row, column| {
        if column / 3 == row % 3 { positions[row - row % 3 + column % 3] } else { 0.0 }
    });
    let rest = warping - linear * gradient;
    let inside = warping * whole * warping.transpose() / 64.0 * (volume / centre);
    let d = SMatrix::<f64, 6, 6>::from_fn(|i, k| material(poisson).matrix()[i][k]);
    mean.transpose() * d * mean * volume + rest.transpose() * inside * rest
}

#[test]
fn kernel_is_the_definition_by_gauss_points() {
    for poisson in [0.27, 0.45] {
        for corners in hexahedra(500, 0.5) {
            for kind in KINDS {
                let element =
                    HexahedronElement::new(&corners, &material(poisson), kind).expect("a volume");
                let expected = definition(&corners, poisson, kind);
                let error = distance(&stiffness(&element), &expected);
                assert!(error < 1e-13, "{error} {kind:?} {corners:?}");
            }
        }
    }
}

#[test]
fn parallelepipeds_have_the_element_of_lattices() {
    for corners in hexahedra(100, 0.0) {
        let edges = [1, 3, 4].map(|at| corners[at] - corners[0]);
        for (kind, poisson) in [(KINDS[0], 0.27), (KINDS[0], 0.45), (KINDS[1], 0.27)] {
            let element =
                HexahedronElement::new(&corners, &material(poisson), kind).expect("a volume");
            let expected = Modal::new(&edges, &material(poisson), kind).dense();
            let error = distance(&stiffness(&element), &expected);
            assert!(error < 1e-13, "{error} {kind:?}");
        }
    }
}

#[test]
fn only_rigid_motions_take_no_force_and_none_is_stiffer_than_by_gauss_points() {
    for corners in hexahedra(300, 0.5) {
        for kind in KINDS {
            let element =
                HexahedronElement::new(&corners, &material(0.27), kind).expect("a volume");
            let own = stiffness(&element).symmetric_eigenvalues();
            let gauss = hex8::stiffness(&corners.map(Point3::from), &material(0.27));
            let most = gauss.symmetric_eigenvalues().max();
            let free = own.iter().filter(|value| value.abs() < 1e-9 * most).count();
            assert_eq!(free, 6, "{kind:?} {corners:?}");
            assert!(own.min() > -1e-12 * most && own.max() <= 1.01 * most, "{}", own.max() / most);
        }
    }
}

/// Elements of a cube of 3×3×3 with moved inner nodes, whose faces are not plane: a linear field is
/// in equilibrium.
#[test]
fn linear_fields_are_in_equilibrium_on_distorted_meshes() {
    let mut numbers = Numbers(3);
    let place = |[i, j, k]: [usize; 3]| i + 4 * (j + 4 * k);
    let steps = || (0..64).map(|node| [node % 4, node / 4 % 4, node / 16]);
    let inner = |step: &[usize; 3]| step.iter().all(|&at| at == 1 || at == 2);
    let nodes: Vec<Vector3<f64>> = steps()
        .map(|step| {
            let moved = if inner(&step) { numbers.vector() * 0.3 } else { Vector3::zeros() };
            Vector3::from(step.map(|at| at as f64)) + moved
        })
        .collect();
    let gradient = Matrix3::from_fn(|_, _| numbers.next());
    for kind in KINDS {
        let mut residual = vec![Vector3::zeros(); 64];
        let mut largest = 0.0_f64;
        for cell in steps().filter(|step| step.iter().all(|&at| at < 3)) {
            let of = CORNERS.map(|at| place([0, 1, 2].map(|k| cell[k] + usize::from(at[k] > 0.0))));
            let element = HexahedronElement::new(&of.map(|node| nodes[node]), &material(0.3), kind);
            let table = HexahedronTable::new([element.as_ref(); LANES]);
            let u = of.map(|node| <[f64; 3]>::from(gradient * nodes[node]).map(|u| Lanes([u; 4])));
            for (node, f) in of.into_iter().zip(forces(&table, &u)) {
                let f = Vector3::from(f.map(|f| f.0[2]));
                residual[node] += f;
                largest = largest.max(f.norm());
            }
        }
        for (step, residual) in steps().zip(residual).filter(|(step, _)| inner(step)) {
            assert!(residual.norm() < 1e-12 * largest, "{step:?} {}", residual.norm() / largest);
        }
    }
}

#[test]
fn elements_without_volume_are_refused() {
    let mut corners = CORNERS.map(Vector3::from);
    let new = |corners: &[Vector3<f64>; 8]| {
        HexahedronElement::new(corners, &material(0.25), ElementKind::default())
    };
    assert!(new(&corners).is_some());
    corners.swap(0, 1);
    corners.swap(2, 3);
    corners.swap(4, 5);
    corners.swap(6, 7);
    assert!(new(&corners).is_none(), "turned inside out");
    assert!(new(&[Vector3::zeros(); 8]).is_none());
}

/// A brick that is sheared by 3/4 along x has edges of 1 and 5/4 along z: 4/5 at all corners. With the
/// corner (1, 1, 1) of a cube at (1/2, 1/2, 1/2), the volume of its three unit edges there is
/// −½ ⋅ 3/4 over (3/4)^(3/2). A wedge with one edge shrunk to a point counts its other corners.
#[test]
fn scaled_jacobians_are_those_by_hand() {
    let cube = CORNERS.map(|at| (Vector3::from(at) + Vector3::repeat(1.0)) / 2.0);
    assert_eq!(scaled_jacobian(&cube), 1.0);
    let brick = cube.map(|x| Vector3::new(3.0 * x.x, 2.0 * x.y, 0.1 * x.z));
    assert!((scaled_jacobian(&brick) - 1.0).abs() < 1e-15);
    let sheared = cube.map(|x| Vector3::new(x.x + 0.75 * x.z, x.y, x.z));
    assert!((scaled_jacobian(&sheared) - 0.8).abs() < 1e-15);
    let mirrored = sheared.map(|x| Vector3::new(-x.x, x.y, x.z));
    assert!((scaled_jacobian(&mirrored) + 0.8).abs() < 1e-15);
    let mut dented = cube;
    dented[6] = Vector3::repeat(0.5);
    // Edges (½, −½, −½), (−½, ½, −½) and (−½, −½, ½) along x, y and z: their volume is −½.
    let expected = -0.5 / libm::pow(0.75, 1.5);
    assert!((scaled_jacobian(&dented) - expected).abs() < 1e-15, "{}", scaled_jacobian(&dented));
    let mut wedge = cube;
    wedge[5] = wedge[4];
    let half = scaled_jacobian(&wedge);
    assert!(half > 0.0 && half < 1.0, "{half}");
}
