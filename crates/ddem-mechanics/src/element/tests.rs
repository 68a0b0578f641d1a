use fearless_simd::{Level, dispatch};
use nalgebra::{Matrix3, Point3, Rotation3, SVector, Vector3};

use super::Elastic;
use super::corotation::{mean_rotation, split_torque};
use super::hex8::{self, ElementStiffness};
use super::lattice::force;
use super::modal::Modal;
use super::principal;
use super::table::ElementTable;
use crate::element::ElementKind;
use crate::math::lanes::{Lanes, add, splat, zero};

fn material() -> Elastic {
    Elastic::new(2400.0, 18e9, 0.27)
}

fn nodes(edges: &[Vector3<f64>; 3]) -> [Point3<f64>; 8] {
    hex8::CORNERS
        .map(|s| Point3::from((0..3).map(|k| edges[k] * (s[k] + 1.0) / 2.0).sum::<Vector3<f64>>()))
}

fn shapes() -> [[Vector3<f64>; 3]; 2] {
    let v = Vector3::new;
    [
        [v(0.7, 0.0, 0.0), v(0.0, 1.1, 0.0), v(0.0, 0.0, 0.01)],
        [v(0.7, 0.1, -0.2), v(0.2, 1.1, 0.3), v(-0.1, 0.25, 0.9)],
    ]
}

fn distance(a: &ElementStiffness, b: &ElementStiffness) -> f64 {
    (a - b).abs().max() / b.abs().max()
}

#[test]
fn modal_stiffness_is_that_of_gauss_points() {
    for edges in shapes() {
        let gauss = hex8::stiffness(&nodes(&edges), &material());
        let modal = Modal::new(&edges, &material(), ElementKind::Standard).dense();
        assert!(distance(&modal, &gauss) < 1e-14, "{}", distance(&modal, &gauss));
    }
}

#[test]
fn incompatible_modes_leave_constant_strain_and_rigid_motion_alone() {
    for edges in shapes() {
        let standard = Modal::new(&edges, &material(), ElementKind::Standard).dense();
        let soft = Modal::new(&edges, &material(), ElementKind::Incompatible).dense();
        assert!(distance(&soft, &standard) > 1e-3, "the modes change the bending stiffness");
        for (i, k) in (0..3).flat_map(|i| (0..3).map(move |k| (i, k))) {
            let linear = SVector::<f64, 24>::from_iterator(nodes(&edges).iter().flat_map(|x| {
                let mut u = [0.0; 3];
                u[i] = x[k];
                u
            }));
            let (a, b) = (standard * linear, soft * linear);
            assert!((a - b).norm() <= 1e-14 * standard.norm() * linear.norm());
        }
        let zero_modes = soft.symmetric_eigenvalues().iter().filter(|e| e.abs() < 1e-3).count();
        assert_eq!(zero_modes, 6);
    }
}

#[test]
fn shape_functions_are_one_at_their_node_and_strains_of_a_translation_vanish() {
    for (a, corner) in hex8::CORNERS.into_iter().enumerate() {
        for (b, n) in hex8::shape(corner).into_iter().enumerate() {
            assert_eq!(n, if a == b { 1.0 } else { 0.0 });
        }
    }
    let (b, volume) = hex8::strain_matrix(&nodes(&shapes()[1]), [0.3, -0.2, 0.7]);
    let shift = SVector::<f64, 24>::from_fn(|i, _| [1.0, 2.0, 3.0][i % 3]);
    assert!((b * shift).norm() < 1e-14 && volume > 0.0);
}

#[test]
fn lumped_mass_is_an_eighth_of_the_element_at_every_node() {
    let edges = shapes()[1];
    let volume = edges[0].cross(&edges[1]).dot(&edges[2]);
    for mass in hex8::lumped_mass(&nodes(&edges), 2400.0) {
        assert!((mass - 2400.0 * volume / 8.0).abs() < 1e-10);
    }
}

#[test]
fn lattice_force_is_the_assembled_product_in_every_lane() {
    for (edges, is_box) in shapes().into_iter().zip([true, false]) {
        for kind in [ElementKind::Standard, ElementKind::Incompatible] {
            for dims in [[3, 2, 4], [1, 2, 2], [2, 1, 1], [1, 1, 1]] {
                let modals =
                    [1.0, 2.0, 0.5].map(|s| Modal::new(&edges.map(|e| e * s), &material(), kind));
                check_lattice(
                    [Some(&modals[0]), Some(&modals[1]), None, Some(&modals[2])],
                    dims,
                    is_box,
                );
            }
        }
    }
}

fn check_lattice(modals: [Option<&Modal>; 4], dims: [usize; 3], is_box: bool) {
    let [nx, ny, nz] = dims.map(|n| n + 1);
    let n = 3 * nx * ny * nz;
    let u: Vec<Lanes> = (0..n)
        .map(|i| Lanes(std::array::from_fn(|l| ((i * 7 + l * 13) as f64 * 0.37).sin() * 1e-3)))
        .collect();
    let mut g = vec![Lanes::ZERO; n];
    let table = ElementTable::new(modals, is_box);
    dispatch!(Level::new(), simd => force(simd, dims, &table, &u, &mut g));
    for (lane, modal) in modals.iter().enumerate() {
        let mut expected = vec![0.0; n];
        for cell in 0..dims.iter().product() {
            let [i, j, k] = [cell % dims[0], cell / dims[0] % dims[1], cell / (dims[0] * dims[1])];
            let place = |s: [f64; 3]| {
                let [a, b, c] = s.map(|s| usize::from(s > 0.0));
                (i + a) + nx * ((j + b) + ny * (k + c))
            };
            let Some(modal) = modal else { continue };
            let dofs: Vec<usize> =
                hex8::CORNERS.iter().flat_map(|s| [0, 1, 2].map(|c| 3 * place(*s) + c)).collect();
            let local = SVector::<f64, 24>::from_fn(|r, _| u[dofs[r]].0[lane]);
            let force = modal.dense() * local;
            dofs.iter().zip(force.iter()).for_each(|(&dof, f)| expected[dof] += f);
        }
        let size = expected.iter().fold(1.0_f64, |m, x| m.max(x.abs()));
        for (g, e) in g.iter().zip(&expected) {
            assert!((g.0[lane] - e).abs() < 1e-13 * size, "{dims:?} lane {lane}");
        }
    }
}

/// The principal stresses are found in arbitrarily rotated axes, also if two or three are equal.
#[test]
fn principal_stresses_survive_rotation() {
    let values = [
        [3.0, 1.0, -2.0],
        [5.0, 5.0, -1.0],
        [5.0, -1.0, -1.0],
        [2.0, 2.0, 2.0],
        [1.0, 0.0, 0.0],
        [0.0, 0.0, -1.0],
        [1.0, 0.0, -1.0],
        [1.0 + 1e-9, 1.0, -4.0],
        [0.0, 0.0, 0.0],
    ];
    for ([most, middle, least], turn) in values.into_iter().flat_map(|v| [(v, 0.0), (v, 0.7)]) {
        for scale in [1.0, 3e7] {
            let r = Rotation3::from_euler_angles(turn, -2.0 * turn, 3.0 * turn);
            let diagonal = Matrix3::from_diagonal(&Vector3::new(most, middle, least));
            let s = (r.matrix() * diagonal * r.matrix().transpose()) * scale;
            let found =
                principal(&[(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0)].map(|at| s[at]));
            // If two values are equal, half of the digits of their difference are lost.
            let error = (found[0] - scale * least).abs().max((found[1] - scale * most).abs());
            assert!(error <= 3e-7 * scale, "{most} {middle} {least} by {turn}: {found:?}");
        }
    }
}

/// Two blocks, one upright and one upside down, are rotated by π against each other. Their mean is
/// no rotation.
#[test]
fn opposite_blocks_get_no_torque_from_joint_frame() {
    dispatch!(Level::new(), simd => {
        let matrix = |rows: [[f64; 3]; 3]| rows.map(|row| row.map(|x| splat(simd, x)));
        let upright = matrix([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
        let flipped = matrix([[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]]);
        let sum = [0, 1, 2].map(|i| add(upright[i], flipped[i]));
        let frame = mean_rotation(simd, &sum, 2.0);
        let parts = split_torque(simd, &[upright, flipped], &frame, zero(simd));
        assert!(parts.iter().flatten().all(|x| Lanes::from(*x).0 == [0.0; 4]));
    });
}
