//! The independent finite element model, checked against exact solutions and stored results.

#[path = "fem/mod.rs"]
mod fem;

use fem::{Face, Formulation, LatticePart, Mesh, OracleLattice, OracleMaterial, System, Transient};
use nalgebra::{Matrix3, Vector3, Vector6};

const ROCK: OracleMaterial = OracleMaterial { density: 2400.0, young: 18e9, poisson: 0.25 };

/// A mesh of the unit cube with a smooth distortion of its inside; the surface is unchanged.
fn distorted(mut mesh: Mesh) -> Mesh {
    for at in &mut mesh.nodes {
        let bump: f64 = at.iter().map(|x| (std::f64::consts::PI * x).sin()).product();
        *at += 0.08 * bump * Vector3::new(1.0, -0.7, 0.5 + at.x);
    }
    mesh
}

/// The unit cube as 2×2×2 blocks with joints of three thicknesses, distorted.
fn distorted_cube() -> Mesh {
    let mut lattice = OracleLattice::boxed([1.0; 3], [2; 3], 2, 0.01, ROCK);
    lattice.thickness = [vec![0.01], vec![0.05], vec![0.002]];
    distorted(lattice.mesh())
}

/// Displacements by degree of freedom, sampled from a field.
fn sampled(mesh: &Mesh, field: impl Fn(&Vector3<f64>) -> Vector3<f64>) -> Vec<f64> {
    mesh.nodes.iter().flat_map(|at| <[f64; 3]>::from(field(at))).collect()
}

/// Fixes the given components of the selected nodes.
fn hold(mesh: &Mesh, held: &mut [Option<f64>], at: impl Fn(&Vector3<f64>) -> bool, axes: &[usize]) {
    for node in mesh.select(at) {
        for axis in axes {
            held[3 * node + axis] = Some(0.0);
        }
    }
}

fn largest(values: impl IntoIterator<Item = f64>) -> f64 {
    values.into_iter().fold(0.0, |most, value| most.max(value.abs()))
}

#[test]
fn constant_strain_is_exact_on_a_distorted_graded_mesh() {
    let mesh = distorted_cube();
    let gradient = Matrix3::new(1.0, 2.0, -0.5, 0.3, -1.2, 0.8, 0.4, -0.6, 0.7) * 1e-4;
    let exact = sampled(&mesh, |at| gradient * at);
    let on_surface = |at: &Vector3<f64>| at.iter().any(|x| *x < 1e-9 || *x > 1.0 - 1e-9);
    let prescribed: Vec<Option<f64>> = (0..mesh.dofs())
        .map(|dof| on_surface(&mesh.nodes[dof / 3]).then_some(exact[dof]))
        .collect();
    let strain = gradient + gradient.transpose();
    let shear = ROCK.shear();
    let normal =
        strain.map(|e| shear * e) + Matrix3::identity() * (ROCK.lambda() * gradient.trace());
    let stress = Vector6::new(
        normal[(0, 0)],
        normal[(1, 1)],
        normal[(2, 2)],
        normal[(0, 1)],
        normal[(1, 2)],
        normal[(2, 0)],
    );
    for formulation in [Formulation::Standard, Formulation::Incompatible] {
        let system = System::assemble(&mesh, formulation);
        let solution = system.solve(&vec![0.0; mesh.dofs()], &prescribed);
        let error = largest(solution.displacement.iter().zip(&exact).map(|(a, b)| a - b));
        assert!(error < 1e-13, "{formulation:?}: displacement off by {error:e}");
        for element in &mesh.elements {
            let found = mesh.stress(element, &solution.displacement);
            let error = (found - stress).amax() / stress.amax();
            assert!(error < 1e-8, "{formulation:?}: stress off by {error:e} in {element:?}");
        }
    }
}

#[test]
fn only_rigid_motions_have_zero_energy() {
    let mesh = distorted_cube();
    for formulation in [Formulation::Standard, Formulation::Incompatible] {
        let element = &mesh.elements[3];
        let matrix = fem::stiffness(&mesh.corners(element), &ROCK, formulation);
        assert!((matrix - matrix.transpose()).amax() < 1e-12 * matrix.amax());
        let mut values: Vec<f64> = matrix.symmetric_eigenvalues().iter().copied().collect();
        values.sort_by(f64::total_cmp);
        assert!(largest(values[..6].iter().copied()) < 1e-12 * values[23], "{values:?}");
        assert!(values[6] > 1e-4 * values[23], "{values:?}");

        let system = System::assemble(&mesh, formulation);
        let scale = largest(system.stiffness.values.iter().copied());
        let rotation = Vector3::new(0.3, -0.5, 0.8);
        let motion = sampled(&mesh, |at| Vector3::new(1.0, 2.0, -3.0) + rotation.cross(at));
        let force = largest(system.stiffness.multiply(&motion));
        assert!(force < 1e-12 * scale, "a rigid motion meets {force:e}");
    }
}

#[test]
fn mass_and_volume_equal_the_region() {
    let mesh = distorted_cube();
    let filled: f64 = mesh.elements.iter().map(|element| fem::volume(&mesh.corners(element))).sum();
    assert!((filled - 1.0).abs() < 1e-12, "{filled}");
    let mass: f64 = mesh.masses().iter().sum();
    assert!((mass / ROCK.density - 1.0).abs() < 1e-12, "{mass}");
    let element = &OracleLattice::boxed([2.0; 3], [1; 3], 1, 0.0, ROCK).mesh();
    assert!(largest(element.masses().iter().map(|mass| mass - 2400.0)) < 1e-9);
}

#[test]
fn element_counts_and_numbering_match_definition() {
    let mesh = OracleLattice::boxed([4.0; 3], [4; 3], 4, 0.01, ROCK).mesh();
    let count = |kind| mesh.elements.iter().filter(|element| element.kind == kind).count();
    assert_eq!(mesh.nodes.len(), 8000);
    assert_eq!(count(LatticePart::Body), 64 * 64);
    assert_eq!(count(LatticePart::Joint), 3 * 3 * 16 * 16);
    assert_eq!(count(LatticePart::Strip), 3 * 9 * 4 * 4);
    assert_eq!(count(LatticePart::Corner), 27);
    let at = mesh.nodes[125 * (1 + 4 * (2 + 4 * 3)) + 4 + 25];
    let expected = Vector3::new(1.995, 2.005, 3.005 + 0.995 / 4.0);
    assert!((at - expected).norm() < 1e-12, "{at}");
}

#[test]
fn joints_end_at_removed_blocks_and_take_softest_material() {
    let soft = OracleMaterial { young: 1e9, ..ROCK };
    let mut lattice = OracleLattice::boxed([2.0; 3], [2; 3], 1, 0.1, ROCK);
    lattice.joint = Box::new(move |face: Face| {
        Some(if face.axis == 0 && face.cell == [0, 1, 1] { soft } else { ROCK })
    });
    let mesh = lattice.mesh();
    let of = |kind| mesh.elements.iter().filter(move |element| element.kind == kind);
    assert_eq!(of(LatticePart::Joint).filter(|e| e.material == soft).count(), 1);
    assert_eq!(of(LatticePart::Strip).filter(|e| e.material == soft).count(), 2);
    assert_eq!(of(LatticePart::Corner).filter(|e| e.material == soft).count(), 1);

    lattice.removed.insert(0);
    let mesh = lattice.mesh();
    let count = |kind| mesh.elements.iter().filter(|element| element.kind == kind).count();
    assert_eq!(mesh.nodes.len(), 7 * 8);
    assert_eq!((count(LatticePart::Joint), count(LatticePart::Strip)), (9, 3));
    assert_eq!(count(LatticePart::Corner), 0);
}

#[test]
fn oblique_gap_has_thickness_along_normal() {
    let slope = 60f64.to_radians();
    let mut lattice = OracleLattice::boxed([2.0, 1.0, 1.0], [2, 1, 1], 1, 0.1, ROCK);
    lattice.axes[1] = Vector3::new(slope.cos(), slope.sin(), 0.0);
    let mesh = lattice.mesh();
    let joint = mesh.elements.iter().find(|e| e.kind == LatticePart::Joint).expect("a joint");
    let corners = mesh.corners(joint);
    let normal = Vector3::new(slope.sin(), -slope.cos(), 0.0);
    assert!(((corners[1] - corners[0]).dot(&normal) - 0.1).abs() < 1e-12);
    assert!((fem::volume(&corners) - 0.1).abs() < 1e-12);
}

/// Tip deflection over that of Timoshenko for a cantilever 10 × 1 × 1 with two elements over
/// its height.
fn cantilever(formulation: Formulation) -> f64 {
    let mesh = OracleLattice::boxed([10.0, 1.0, 1.0], [10, 1, 1], 2, 1e-3, ROCK).mesh();
    let mut prescribed = vec![None; mesh.dofs()];
    hold(&mesh, &mut prescribed, |at| at.x < 1e-9, &[0]);
    hold(&mesh, &mut prescribed, |at| at.x < 1e-9 && (at.z - 0.5).abs() < 1e-9, &[2]);
    hold(&mesh, &mut prescribed, |at| at.x < 1e-9 && (at.y - 0.5).abs() < 1e-9, &[1]);
    let mut load = vec![0.0; mesh.dofs()];
    for (node, share) in mesh.outer_face(0, true) {
        load[3 * node + 2] = -1e4 * share;
    }
    let solution = System::assemble(&mesh, formulation).solve(&load, &prescribed);
    let tip = solution.displacement[3 * mesh.nearest(Vector3::new(10.0, 0.5, 0.5)) + 2];
    let shear_area = 10.0 * (1.0 + ROCK.poisson) / (12.0 + 11.0 * ROCK.poisson);
    let exact = 1e4 * (1e3 / 3.0 * 12.0 / ROCK.young + 10.0 / (shear_area * ROCK.shear()));
    -tip / exact
}

#[test]
fn incompatible_elements_bend_as_timoshenko_beams_do() {
    let bent = cantilever(Formulation::Incompatible);
    assert!((bent - 1.0).abs() < 0.005, "incompatible: {bent}");
    let locked = cantilever(Formulation::Standard);
    assert!((0.5..0.95).contains(&locked), "standard: {locked}");
}

#[test]
fn largest_eigenvalue_equals_dense_solution() {
    let mesh = distorted_cube();
    let system = System::assemble(&mesh, Formulation::Standard);
    let fixed: Vec<bool> = (0..mesh.dofs()).map(|dof| mesh.nodes[dof / 3].z < 1e-9).collect();
    let free: Vec<usize> = (0..mesh.dofs()).filter(|&dof| !fixed[dof]).collect();
    let mass = system.dof_masses();
    let dense = nalgebra::DMatrix::from_fn(free.len(), free.len(), |i, j| {
        system.stiffness.get(free[i], free[j]) / (mass[free[i]] * mass[free[j]]).sqrt()
    });
    let exact = dense.symmetric_eigenvalues().max();
    let found = system.largest_eigenvalue(&fixed);
    assert!((found / exact - 1.0).abs() < 1e-10, "{found} against {exact}");
}

#[test]
fn free_bar_vibrates_at_exact_period_and_keeps_energy() {
    let steel = OracleMaterial { density: 8000.0, young: 200e9, poisson: 0.0 };
    let mesh = OracleLattice::boxed([10.0, 0.5, 0.5], [10, 1, 1], 2, 0.01, steel).mesh();
    let system = System::assemble(&mesh, Formulation::Standard);
    let fixed: Vec<bool> = (0..mesh.dofs()).map(|dof| mesh.nodes[dof / 3].x < 1e-9).collect();
    let step = 0.9 * 2.0 / system.largest_eigenvalue(&fixed).sqrt();
    let wave = (steel.young / steel.density).sqrt();
    let mode = |at: &Vector3<f64>| (std::f64::consts::PI * at.x / 20.0).sin();
    let none = vec![0.0; mesh.dofs()];
    let mut motion = Transient::new(&system, none.clone(), none, fixed, step);
    motion.displacement = sampled(&mesh, |at| Vector3::x() * (1e-6 * mode(at)));
    let energy = system.strain_energy(&motion.displacement);
    let half_period = 20.0 / wave;
    motion.run((half_period / step).round() as usize);
    let end = motion.displacement[3 * mesh.nearest(Vector3::new(10.0, 0.0, 0.0))];
    assert!((end / -1e-6 - 1.0).abs() < 2e-3, "{end:e} at {}", motion.time());
    let total = motion.kinetic_energy() + system.strain_energy(&motion.displacement);
    assert!((total / energy - 1.0).abs() < 1e-3, "{total} from {energy}");
}

/// Beam on two edges under a line load at midspan: mesh, load, supports.
fn line_loaded_beam(thickness: f64) -> (Mesh, Vec<f64>, Vec<Option<f64>>) {
    let mesh = OracleLattice::boxed([12.0, 3.0, 3.0], [12, 3, 3], 4, thickness, ROCK).mesh();
    let mut prescribed = vec![None; mesh.dofs()];
    hold(&mesh, &mut prescribed, |at| at.x < 1e-9 && at.z < 1e-9, &[0, 2]);
    hold(&mesh, &mut prescribed, |at| at.x > 12.0 - 1e-9 && at.z < 1e-9, &[2]);
    for end in [0.0, 12.0] {
        prescribed[3 * mesh.nearest(Vector3::new(end, 1.5, 0.0)) + 1] = Some(0.0);
    }
    let mut load = vec![0.0; mesh.dofs()];
    let top = mesh.grid_size()[2] - 1;
    for (row, length) in mesh.tributary_lengths(1).iter().enumerate() {
        for column in [29, 30] {
            let node = mesh.grid_node([column, row, top]).expect("the beam is whole");
            assert!((mesh.nodes[node].x - 6.0).abs() < thickness);
            load[3 * node + 2] = -300e3 * length;
        }
    }
    (mesh, load, prescribed)
}

#[test]
fn beam_agrees_with_stored_solution() {
    let (mesh, load, prescribed) = line_loaded_beam(0.01);
    let system = System::assemble(&mesh, Formulation::Standard);
    let solution = system.solve(&load, &prescribed);
    assert!(solution.unbalanced < 1e-10, "{:e}", solution.unbalanced);
    let mut compared = 0;
    for line in include_str!("data/v3_beam_fem.csv").lines().skip(2) {
        let row: Vec<f64> = line.split(',').map(|field| field.parse().expect("a number")).collect();
        let at = Vector3::new(row[0], row[1], row[2]);
        let node = mesh.nearest(at);
        assert!((mesh.nodes[node] - at).norm() < 1e-6, "no node at {at}");
        for axis in 0..3 {
            let error = solution.displacement[3 * node + axis] - row[3 + axis];
            assert!(error.abs() < 2e-6 * 6.8e-4, "{error:e} along {axis} at {at}");
        }
        compared += 1;
    }
    assert!(compared >= 60);
    let below_load = mesh.nearest(Vector3::new(5.995, 1.5, 0.0));
    let settled = solution.displacement[3 * below_load + 2];
    assert!((settled / -6.81154e-4 - 1.0).abs() < 2e-6, "{settled:e}");
    let lifted: f64 = solution.reactions.iter().skip(2).step_by(3).sum();
    assert!((lifted / 1.8e6 - 1.0).abs() < 1e-9, "{lifted}");
}

#[test]
fn beam_deflection_for_other_joint_thickness_is_reproduced() {
    for (thickness, expected) in [(0.001, -6.80937e-4), (0.05, -6.82077e-4)] {
        let (mesh, load, prescribed) = line_loaded_beam(thickness);
        let system = System::assemble(&mesh, Formulation::Standard);
        let solution = system.solve(&load, &prescribed);
        let node = mesh.nearest(Vector3::new(6.0 - thickness / 2.0, 1.5, 0.0));
        let settled = solution.displacement[3 * node + 2];
        assert!((settled / expected - 1.0).abs() < 2e-6, "{thickness}: {settled:e}");
    }
}
