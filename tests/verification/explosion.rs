//! V12: a block of rock blasted from its centre.
//!
//! Volumes and masses have exact values. Momentum, and work and energy of the gas, follow laws of
//! conservation. All are in the table. Sizes and speeds of flying fragments are only printed, because no independent values are
//! known.

use ddem_core::{Fragment, Simulation};
use ddem_deck::TimeStep;
use nalgebra::Vector3;

use super::record::Tolerance::{Absolute, Of, Relative};
use super::record::{Case, check, consistent, of};
use super::shared::{deck, example, simulation};

type Corners = [Vector3<f64>; 8];

/// Position of the charge [m].
const CENTRE: [f64; 3] = [1.2; 3];

fn position(simulation: &Simulation, node: u32) -> Vector3<f64> {
    let at = Vector3::from(simulation.model().point(node as usize));
    at + Vector3::from(simulation.displacement(node as usize))
}

/// Positions of the corners of the blocks, which have one element each.
fn corners(simulation: &Simulation) -> Vec<Corners> {
    let model = simulation.model();
    let hexes = (0..model.n_blocks()).flat_map(|block| model.hexes(block));
    hexes.map(|hex| hex.map(|node| position(simulation, node))).collect()
}

/// Penetration of two VTK hexahedra: the smallest overlap along their face normals and along the
/// cross products of their edges; negative if they are apart.
fn overlap(a: &Corners, b: &Corners) -> f64 {
    let edges = |x: &Corners| [x[1] - x[0], x[3] - x[0], x[4] - x[0]];
    let (of_a, of_b) = (edges(a), edges(b));
    let normals = |e: [Vector3<f64>; 3]| [(0, 1), (1, 2), (2, 0)].map(|(i, k)| e[i].cross(&e[k]));
    let crossed = of_a.iter().flat_map(|x| of_b.iter().map(move |y| x.cross(y)));
    let axes = normals(of_a).into_iter().chain(normals(of_b)).chain(crossed);
    let along = |axis: Vector3<f64>| {
        let range = |x: &Corners| {
            let places = x.map(|x| axis.dot(&x));
            (
                places.iter().copied().fold(f64::INFINITY, f64::min),
                places.iter().copied().fold(f64::NEG_INFINITY, f64::max),
            )
        };
        let ((low_a, high_a), (low_b, high_b)) = (range(a), range(b));
        (high_a - low_b).min(high_b - low_a)
    };
    axes.filter_map(|axis| axis.try_normalize(1e-9)).map(along).fold(f64::INFINITY, f64::min)
}

/// Deepest overlap of all blocks, as a part of the shorter edge of the two.
fn deepest(simulation: &Simulation) -> f64 {
    let all = corners(simulation);
    let middle = |x: &Corners| x.iter().sum::<Vector3<f64>>() / 8.0;
    let size = |x: &Corners| x.iter().map(|y| (y - middle(x)).norm()).fold(0.0, f64::max);
    let edge = |x: &Corners| (x[1] - x[0]).norm();
    let balls: Vec<_> = all.iter().map(|x| (middle(x), size(x))).collect();
    let mut worst = f64::NEG_INFINITY;
    for (i, (at, radius)) in balls.iter().enumerate() {
        for (k, (other, more)) in balls.iter().enumerate().skip(i + 1) {
            if (at - other).norm() < radius + more {
                let shorter = edge(&all[i]).min(edge(&all[k]));
                worst = worst.max(overlap(&all[i], &all[k]) / shorter);
            }
        }
    }
    worst
}

/// Run with quantities that are monitored on the way.
struct Watched {
    simulation: Simulation,
    /// Impulse of the support so far [N s].
    impulse: Vector3<f64>,
    /// Largest difference between momentum and impulse [N s].
    left_over: f64,
    /// Deepest overlap so far.
    deepest: f64,
}

impl Watched {
    /// Starts the first stage of a deck.
    fn start(text: &str) -> Self {
        let stage = deck(text).stage[0].clone();
        let mut simulation = simulation(text);
        let damping = stage.damping.unwrap_or_default();
        let step = stage.time_step.unwrap_or(TimeStep::Auto);
        simulation.start(damping, step, stage.duration).expect("a stable step");
        Self { simulation, impulse: Vector3::zeros(), left_over: 0.0, deepest: f64::MIN }
    }

    /// Takes a step and monitors every fiftieth one.
    fn step(&mut self) -> bool {
        self.simulation.step().expect("finite numbers");
        let look = self.simulation.steps().is_multiple_of(50);
        if look {
            self.deepest = self.deepest.max(deepest(&self.simulation));
        }
        look
    }

    /// Continues to a time and sums the impulse of the support.
    fn add_up(&mut self, time: f64) {
        let model = self.simulation.model();
        let base: Vec<u32> =
            (0..model.n_nodes() as u32).filter(|&i| model.point(i as usize)[2] == 0.0).collect();
        let mut before = Vector3::from(self.simulation.reaction(&base));
        while self.simulation.time() < time - 1e-9 {
            let look = self.step();
            let now = Vector3::from(self.simulation.reaction(&base));
            self.impulse += 0.5 * self.simulation.time_step() * (before + now);
            before = now;
            if look {
                let momentum = Vector3::from(self.simulation.momentum());
                self.left_over = self.left_over.max((momentum - self.impulse).norm());
            }
        }
    }
}

/// Fragment that flies: one that the support does not hold.
struct Flying {
    /// Initial distance from the charge [m].
    away: f64,
    mass: f64,
    size: f64,
    /// Outward speed [m/s].
    speed: f64,
}

fn flying(simulation: &mut Simulation) -> Vec<Flying> {
    let fragments = simulation.fragments();
    let model = simulation.model();
    let find = |fragment: &Fragment| {
        let nodes: Vec<u32> =
            fragment.blocks.iter().flat_map(|&block| model.hexes(block)).flatten().collect();
        let place = |node: &u32| Vector3::from(model.point(*node as usize));
        let held = nodes.iter().any(|node| place(node).z == 0.0);
        let middle = nodes.iter().map(place).sum::<Vector3<f64>>() / nodes.len() as f64;
        let way = middle - Vector3::from(CENTRE);
        let speed = Vector3::from(fragment.velocity).dot(&way.normalize());
        let (away, mass, size) = (way.norm(), fragment.mass, fragment.size());
        (!held).then_some(Flying { away, mass, size, speed })
    };
    fragments.iter().filter_map(find).collect()
}

/// Distances from the charge that group the fragments [m].
const SHELLS: [[f64; 2]; 4] = [[0.0, 0.2], [0.2, 0.4], [0.4, 0.8], [0.8, 3.0]];

/// Checks that rock flies away from the charge at every distance.
fn plausible(simulation: &mut Simulation) {
    let time = simulation.time();
    let all = flying(simulation);
    let mean = |part: &[&Flying], of: fn(&Flying) -> f64| {
        part.iter().map(|f| f.mass * of(f)).sum::<f64>() / part.iter().map(|f| f.mass).sum::<f64>()
    };
    for [from, to] in SHELLS {
        let part: Vec<&Flying> = all.iter().filter(|f| (from..to).contains(&f.away)).collect();
        let place = format!("{from} to {to} m from the charge, {time} s");
        let (size, speed) = (mean(&part, |f| f.size), mean(&part, |f| f.speed));
        println!("{place}: size {size} m, outward {speed} m/s");
        assert!(speed > 0.0, "{place}: outward with {speed} m/s");
    }
    let momentum = |f: &Flying| f.mass * f.speed;
    let outward: f64 = all.iter().map(|f| momentum(f).max(0.0)).sum();
    let both: f64 = all.iter().map(|f| momentum(f).abs()).sum();
    assert!(outward > 0.95 * both, "{time} s: {outward} of {both} N s go outward");
}

/// Checks that volume and mass are conserved and that the base has not moved.
fn checked(case: Case, simulation: &mut Simulation) {
    let time = format!("{:.2} s", simulation.time());
    let (gap, all) = (0.008_f64, simulation.fragments());
    // Blocks of 0.4 m, which reach the outer faces, and of 0.2, 0.1 and 0.05 m. Eight of each size
    // are split or missing.
    let coarse = (2.4 - 5.0 * gap).powi(3) - 8.0 * (0.4 - gap).powi(3);
    let rock = coarse + [0.2, 0.1, 0.05].map(|x| 56.0 * (x - gap).powi(3)).iter().sum::<f64>();
    let volume: f64 = all.iter().map(|f| f.volume).sum();
    let what = format!("volume of all fragments, {time} [m3]");
    check(case, &what, rock, volume, Relative(1e-9));
    // The remaining volume is joints, except the crossings beside split blocks.
    let exact = 2600.0 * rock + 2400.0 * (2.4_f64.powi(3) - 0.1_f64.powi(3) - rock);
    let mass: f64 = all.iter().map(|f| f.mass).sum();
    check(case, &format!("mass of all fragments, {time} [kg]"), exact, mass, Relative(1e-3));
    let model = simulation.model();
    let base = (0..model.n_nodes()).filter(|&i| model.point(i)[2] == 0.0);
    let way = base.map(|i| Vector3::from(simulation.displacement(i)).norm()).fold(0.0, f64::max);
    check(case, &format!("way of the base, {time} [m]"), 0.0, way, Absolute(0.0));
}

#[test]
fn blasted_block_has_exact_volume_momentum_and_gas_work() {
    let case = of("v12_blast");
    let mut watched = Watched::start(&example(case.deck));
    let start = watched.simulation.charge(0).expect("a charge");
    // The eight missing cells and half of the gaps around them, with edges and corners cut off.
    let (edge, gap) = (0.1_f64, 0.008_f64);
    let cut = 6.0 * (edge - gap) * gap.powi(2) + 8.0 * 5.0 / 6.0 * gap.powi(3);
    let room = (edge + gap).powi(3) - cut;
    check(case, "volume of the cavity [m3]", room, start.volume, Relative(1e-9));
    // 1 kg of TNT that has expanded into the cavity.
    let (density, detonation, gamma) = (1630.0, 6930.0_f64, 2.727);
    let burnt = density * detonation.powi(2) / (2.0 * (gamma + 1.0));
    let pressure = burnt * (1.0 / density / room).powf(gamma);
    check(case, "pressure at the start [Pa]", pressure, start.pressure, Relative(1e-9));
    watched.add_up(0.005);
    while watched.simulation.time() < 0.01 {
        watched.step();
    }
    let simulation = &mut watched.simulation;
    checked(case, simulation);
    plausible(simulation);
    let size = |f: &Fragment| f.mass * Vector3::from(f.velocity).norm();
    let off = watched.left_over / simulation.fragments().iter().map(size).sum::<f64>();
    let what = "largest difference of momentum and impulse of the support / sum of m v, to 0.005 s";
    consistent(case, what, 0.0, off, Of(1.0, 1e-12));
    while watched.simulation.steps_left() != Some(0) {
        watched.step();
    }
    let simulation = &mut watched.simulation;
    checked(case, simulation);
    plausible(simulation);
    let end = simulation.charge(0).expect("a charge");
    assert!(end.vented, "the gas is still in the cavity: {end:?}");
    let part = (start.volume / end.volume).powf(gamma - 1.0);
    let expected = pressure * room / (gamma - 1.0) * (1.0 - part);
    let energy = simulation.energy();
    let what = "work of the gas, expected: adiabatic to the volume at which it vents [J]";
    consistent(case, what, expected, energy.external_work, Relative(1e-2));
    let kept = energy.kinetic + energy.strain_bodies + energy.strain_joints;
    let found = kept + energy.friction + energy.fracture + energy.contact + energy.damping;
    let what = "motion, strain, friction, fracture and damping, expected: the same work [J]";
    consistent(case, what, expected, found, Relative(1e-2));
    let deep = watched.deepest;
    assert!(deep < 0.05, "not plausible: blocks {deep} of the shorter edge in each other");
}
