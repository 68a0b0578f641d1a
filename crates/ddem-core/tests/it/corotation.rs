//! §3: forces under finite rotations. The force on a block is the gradient of its energy. Forces
//! and moments balance, rigid motions cause no force, and the joint frames cause a small known
//! error.

use ddem_deck::Deck;
use nalgebra::Matrix3;

use crate::decks::*;

/// `x = R (X + strain) + shift`, with an extra rotation of each block of the order of `angle`.
fn motion(deck: &Deck, seed: u64, whole: f64, angle: f64, strain: f64) -> Vec<[f64; 3]> {
    let model = model(deck);
    let mut random = Random::new(seed);
    let (turn, shift) = (random.rotation(whole), random.vector());
    let points = points(&model);
    let mut u = Vec::new();
    for block in 0..model.n_blocks() {
        let nodes: Vec<usize> =
            (0..points.len()).filter(|&node| model.block_of(node) == block).collect();
        let centre = nodes.iter().map(|&node| points[node]).sum::<Vec3>() / nodes.len() as f64;
        let own = random.rotation(angle);
        let jump = random.vector() * angle * 0.1;
        let gradient = Matrix3::from_fn(|_, _| strain * random.next());
        for &node in &nodes {
            let arm = points[node] - centre;
            let bumps = random.vector() * strain * 0.3;
            let local = arm + gradient * arm + bumps;
            u.push((turn * (centre + jump + own * local) + shift - points[node]).into());
        }
    }
    u
}

/// Largest difference between the force and the energy gradient, relative to the largest force. The
/// gradient uses fourth-order differences at some of the degrees of freedom.
fn gradient_error(deck: &Deck, u: &[[f64; 3]], step: f64, every: usize) -> f64 {
    let mut simulation = simulation(deck);
    let mut energy = |u: &[[f64; 3]]| {
        simulation.set_displacements(u);
        let energy = simulation.energy();
        energy.strain_bodies + energy.strain_joints
    };
    let mut moved = u.to_vec();
    let mut gradient = Vec::new();
    for at in (0..3 * u.len()).step_by(every) {
        let (node, c) = (at / 3, at % 3);
        let mut difference = |step: f64| {
            moved[node][c] = u[node][c] + step;
            let after = energy(&moved);
            moved[node][c] = u[node][c] - step;
            let before = energy(&moved);
            moved[node][c] = u[node][c];
            (after - before) / (2.0 * step)
        };
        gradient.push((at, (4.0 * difference(step) - difference(2.0 * step)) / 3.0));
    }
    simulation.set_displacements(u);
    let force = simulation.internal_forces();
    let wrong = |&(at, gradient): &(usize, f64)| (force[at / 3][at % 3] - gradient).abs();
    gradient.iter().map(wrong).fold(0.0, f64::max) / largest(&force)
}

#[test]
fn force_of_a_block_is_the_gradient_of_its_energy() {
    let mut worst = [0.0_f64; 3];
    for axes in [BOX, OBLIQUE] {
        for (divisions, every) in [(1, 1), (2, 1), (4, 7)] {
            for (seed, strain) in [(1, 1e-3), (2, 3e-3), (3, 1e-2)] {
                let deck = with_axes(deck([1; 3], [1.2, 0.9, 1.5], divisions, 0.01), axes);
                let u = motion(&deck, seed, 2.5, 0.0, strain);
                let error = gradient_error(&deck, &u, 1e-4, every);
                let mut simulation = simulation(&deck);
                simulation.set_displacements(&u);
                let f = simulation.internal_forces();
                let points = points(simulation.model());
                let [force, moment] = sums(&points, &u, &f, Vec3::new(3.0, -2.0, 1.0));
                worst = [worst[0].max(error), worst[1].max(force), worst[2].max(moment)];
            }
        }
    }
    println!("gradient {:.1e}, forces {:.1e}, moments {:.1e}", worst[0], worst[1], worst[2]);
    assert!(worst[0] < 1e-9, "gradient: {:e}", worst[0]);
    assert!(worst[1] < 1e-15 && worst[2] < 1e-15, "sums: {worst:?}");
}

/// Moments balance too, in the deformed position. They balance to rounding for relative rotations
/// of 0.02, where the mean of the blocks' rotations is a rotation to rounding. Beyond that, its two
/// corrections leave an error of eighth order.
#[test]
fn joint_forces_and_moments_sum_to_zero() {
    for axes in [BOX, OBLIQUE] {
        for (divisions, angle) in [(1, 0.3), (2, 0.1), (4, 0.01), (2, 1e-4), (3, 0.0)] {
            let deck = with_axes(deck([2; 3], [2.0, 1.6, 2.4], divisions, 0.02), axes);
            let u = motion(&deck, 5, 2.0, angle, 3e-3);
            let mut simulation = simulation(&deck);
            simulation.set_displacements(&u);
            let f = simulation.internal_forces();
            let points = points(simulation.model());
            for about in [Vec3::zeros(), Vec3::new(7.0, -4.0, 2.0)] {
                let [force, moment] = sums(&points, &u, &f, about);
                println!("{divisions} {angle}: forces {force:.1e}, moments {moment:.1e}");
                assert!(force < 1e-15, "forces {force:e}");
                assert!(moment < 2e-15 + 4e-3 * f64::powi(angle, 8), "{angle}: moments {moment:e}");
            }
        }
    }
}

/// The frame of a joint turns with its blocks. Its effect on the energy is computed as if the mean
/// rotation turned by the mean of the turns. This misses a part of second order in the relative
/// rotation, relative to the force: 0.04 θ².
#[test]
fn joint_force_error_is_second_order_in_rotation() {
    for axes in [BOX, OBLIQUE] {
        let deck = with_axes(deck([2; 3], [2.0, 1.6, 2.4], 1, 0.05), axes);
        let errors: Vec<f64> = [2e-3, 1e-3, 5e-4, 2.5e-4]
            .iter()
            .map(|&angle| {
                let u = motion(&deck, 11, 1.0, angle, 0.1 * angle);
                gradient_error(&deck, &u, 2e-5, 1)
            })
            .collect();
        let shown: Vec<String> = errors.iter().map(|error| format!("{error:.2e}")).collect();
        println!("relative to the force, halving the rotation: {shown:?}");
        for pair in errors.windows(2) {
            let order = (pair[0] / pair[1]).log2();
            assert!((order - 2.0).abs() < 0.05, "order {order}: {errors:?}");
        }
        assert!(errors[0] < 0.1 * f64::powi(2e-3, 2), "{errors:?}");
    }
}

#[test]
fn finite_rigid_motion_gives_no_force() {
    let mut worst = 0.0_f64;
    for (count, divisions, thickness) in
        [([1, 1, 1], 1, 0.01), ([1, 1, 1], 4, 0.01), ([2, 2, 2], 2, 0.01), ([5, 2, 3], 3, 0.001)]
    {
        for axes in [BOX, OBLIQUE] {
            let size = count.map(|n| f64::from(n) * 1.1);
            let deck = with_axes(deck(count, size, divisions, thickness), axes);
            let mut simulation = simulation(&deck);
            let points = points(simulation.model());
            let diagonal = |node| simulation.model().stiffness_diagonal(node);
            let stiffness = largest(&(0..points.len()).map(diagonal).collect::<Vec<_>>());
            let mut random = Random::new(17);
            for angle in [0.0, 1e-6, 0.5, 2.0, 3.0, std::f64::consts::PI] {
                let (turn, shift) = (random.rotation(angle), random.vector() * 100.0);
                let u: Vec<[f64; 3]> =
                    points.iter().map(|x| (turn * x + shift - x).into()).collect();
                simulation.set_displacements(&u);
                let force = largest(&simulation.internal_forces());
                worst = worst.max(force / (stiffness * largest(&u) * f64::EPSILON));
            }
        }
    }
    println!("rigid motion: {worst:.2} K u eps");
    assert!(worst < 5.0, "{worst} K u eps");
}
