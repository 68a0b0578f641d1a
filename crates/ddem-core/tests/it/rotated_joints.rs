//! A block that rotates about the last bonded pairs of a joint: the joint releases them before the
//! block penetrates the other.

use ddem_core::Simulation;
use ddem_deck::*;

use crate::decks::*;
use crate::unbonded_blocks::{all_corners, deepest};

/// Block on another block that rotates about an edge at the side x = 1.
#[derive(Clone, Copy, Debug)]
struct Hinge {
    divisions: u32,
    /// True if the lower block is split into eight.
    split: bool,
    body: Body,
    contact: bool,
}

const PLAIN: Hinge = Hinge { divisions: 1, split: false, body: Body::Deformable, contact: true };

/// Duration of the spin `[s]`, after the load has been applied.
const SPIN: f64 = 0.6;
const LOADING: f64 = 0.01;

impl Hinge {
    fn rigid(&self) -> bool {
        self.body == Body::Rigid
    }

    /// True if the upper block comes to rest by itself.
    fn free(&self) -> bool {
        !self.split && !self.rigid()
    }

    /// Position of the bonded pairs; pairs of rigid blocks are at the quarters.
    fn about(&self) -> f64 {
        if self.rigid() { 0.75 } else { 1.0 }
    }

    /// Angle at which the joint is released: a pair at the other side has opened by half the
    /// distance of two pairs.
    fn angle(&self) -> f64 {
        // The last of the four joints of a split block is half as long, and its pairs are half as
        // far apart. The same is true of the pairs of rigid blocks.
        0.5 / f64::from(self.divisions)
    }

    fn deck(&self) -> Deck {
        let mut deck = deck([1, 1, 2], [1.0, 1.0, 2.0], self.divisions, 0.02);
        deck.model.kinematics = Kinematics::Corotational;
        deck.model.contact = Some(self.contact);
        // An element that can bend would yield under the load. One that cannot bend levers the far
        // pairs open, so they have failed before the block spins.
        deck.model.element = ElementKind::Standard;
        deck.blocks[0].body = self.body;
        let weak = Joint {
            cohesion: Some(1e9),
            friction: Some(45.0),
            tension: Some(2e5),
            ..deck.joints["seam"].clone()
        };
        deck.joints.insert("seam".into(), weak);
        if self.split {
            let z = Some(Extent::Range([0.0, 1.0]));
            deck.refine = vec![Refine { r#where: Where { z, ..Where::default() }, factor: 2 }];
        }
        let lower = Where { z: Some(Extent::Range([0.0, 0.99])), ..Where::default() };
        deck.fix = vec![fix(lower, "xyz")];
        if !self.free() {
            // In stage `rest` the upper block is fixed at its top, in its present position, and
            // stays loaded. It would not come to rest otherwise. A joint that turns with both
            // blocks would pull at this support.
            deck.fix.push(Fix { from: Some("rest".into()), ..fix(plane(2, 2.0), "xyz") });
        }
        // The load acts on the pairs that must hold.
        for (x, part) in [(0.0, 1.0 - self.about()), (1.0, self.about())] {
            let [x, z] = [x, 1.01].map(|at| Some(Extent::Plane(at)));
            let edge = Where { x, z, ..Where::default() };
            let force = Some([0.0, 0.0, -4e6 * part]);
            let until = self.free().then(|| "rest".to_owned());
            let history = Some(History::Ramp(0.002));
            if part > 0.0 {
                deck.load.push(Load { r#where: edge, force, history, until, ..Load::default() });
            }
        }
        deck.stage = vec![relax_stage("press"), relax_stage("rest")];
        deck
    }

    /// Loaded state without rotation.
    fn loaded(&self) -> Simulation {
        let mut simulation = simulation(&self.deck());
        let started = simulation.start(Damping::Local(0.8), TimeStep::Auto, Some(LOADING));
        started.unwrap_or_else(|error| panic!("{error}"));
        while simulation.steps_left() != Some(0) {
            simulation.step().unwrap_or_else(|error| panic!("{error}"));
        }
        // A rigid block is loaded at the point where it begins to turn.
        assert!(self.rigid() || simulation.fragments().len() == 1, "{self:?}");
        simulation
    }

    /// Vectors at the nodes of the upper block as a function of the position relative to the hinge;
    /// zero at other nodes.
    fn of_upper(&self, simulation: &Simulation, what: impl Fn(Vec3) -> Vec3) -> Vec<[f64; 3]> {
        let (model, centre) = (simulation.model(), Vec3::new(self.about(), 0.0, 1.01));
        let of = |node: usize| {
            let x = Vec3::from(model.point(node)) - centre;
            if x.z < -0.005 { [0.0; 3] } else { what(x).into() }
        };
        (0..model.n_nodes()).map(of).collect()
    }

    /// Loaded state, spun at 5 rad/s.
    fn spun(&self) -> Simulation {
        let mut simulation = self.loaded();
        let spun = self.of_upper(&simulation, |x| Vec3::new(0.0, 5.0, 0.0).cross(&x));
        simulation.set_velocities(&spun);
        let started = simulation.start(Damping::None, TimeStep::Auto, Some(SPIN));
        started.unwrap_or_else(|error| panic!("{error}"));
        simulation
    }

    /// Loaded state, turned by an angle and relaxed until the joint is released or at rest.
    fn relaxed(&self, angle: f64) -> Simulation {
        let mut simulation = self.loaded();
        let turn = nalgebra::Rotation3::from_axis_angle(&Vec3::y_axis(), angle);
        let turned = self.of_upper(&simulation, |x| turn * x - x);
        let pressed = simulation.displacements();
        let both = |(a, b): (&[f64; 3], &[f64; 3])| (Vec3::from(*a) + Vec3::from(*b)).into();
        let u: Vec<[f64; 3]> = turned.iter().zip(&pressed).map(both).collect();
        simulation.enter(1).unwrap_or_else(|error| panic!("{error}"));
        simulation.set_displacements(&u);
        simulation.start_relaxation(1).unwrap_or_else(|error| panic!("{error}"));
        for _ in 0..100_000 {
            let relaxed = simulation.relax_step(1e-4);
            let relaxed = relaxed.unwrap_or_else(|error| panic!("{self:?}, {angle}: {error}"));
            if relaxed == ddem_core::Relaxed::Done || simulation.fragments().len() == 2 {
                return simulation;
            }
        }
        panic!("{self:?}, {angle}: neither at rest nor let go");
    }
}

fn step(simulation: &mut Simulation, hinge: Hinge) {
    simulation.step().unwrap_or_else(|error| panic!("{hinge:?}: {error}"));
}

#[test]
fn rotated_joint_is_released() {
    for hinge in [
        PLAIN,
        Hinge { divisions: 3, ..PLAIN },
        Hinge { split: true, ..PLAIN },
        Hinge { split: true, divisions: 2, ..PLAIN },
    ] {
        let mut simulation = hinge.spun();
        let (mut worst, mut until) = (f64::NEG_INFINITY, 0.0);
        while simulation.steps_left() != Some(0) {
            step(&mut simulation, hinge);
            if simulation.steps().is_multiple_of(10) && until == 0.0 {
                let whole = simulation.fragments().len() == 1;
                until = if whole { until } else { simulation.time() - LOADING };
            }
            if simulation.steps().is_multiple_of(50) {
                worst = worst.max(deepest(&all_corners(&simulation), 0).0);
            }
        }
        let energy = simulation.energy();
        println!("{hinge:?}: held for {until} s, {worst} m in each other, {energy:?}");
        let due = hinge.angle() / 5.0;
        assert!((0.7 * due..1.3 * due).contains(&until), "{hinge:?}: {until} s, not {due} s");
        assert!(worst < 0.03, "{hinge:?}: {worst} m in each other");
        assert!(energy.balance.abs() < 1e-5 * energy.largest, "{hinge:?}: {energy:?}");
    }
}

/// The last two pairs of rigid blocks lie inside the face, but the block turns about its edge.
#[test]
fn last_pairs_of_rigid_blocks_are_released_together() {
    let hinge = Hinge { body: Body::Rigid, ..PLAIN };
    let mut simulation = hinge.spun();
    let mut worst = f64::NEG_INFINITY;
    while simulation.steps_left() != Some(0) {
        step(&mut simulation, hinge);
        if simulation.time() > LOADING + 0.02 {
            assert_eq!(simulation.fragments().len(), 2);
        }
        if simulation.steps().is_multiple_of(50) {
            worst = worst.max(deepest(&all_corners(&simulation), 0).0);
        }
    }
    assert!(worst < 0.01, "{worst} m in each other");
    let energy = simulation.energy();
    assert!(energy.imbalance() < 1e-2, "{energy:?}");
    assert_eq!(hinge.relaxed(0.05).fragments().len(), 2);
}

/// Without contacts nothing would take over from the joint.
#[test]
fn rotated_joint_without_contacts_holds() {
    let split = Hinge { split: true, ..PLAIN };
    for hinge in [PLAIN, split, Hinge { body: Body::Rigid, ..PLAIN }] {
        let hinge = Hinge { contact: false, ..hinge };
        let mut simulation = hinge.spun();
        // Far beyond the angle of release.
        while simulation.time() < LOADING + 1.6 * hinge.angle() / 5.0 {
            step(&mut simulation, hinge);
        }
        assert_eq!(simulation.fragments().len(), 1, "{hinge:?}");
    }
}

/// A relaxation releases a turned joint as dynamic steps do, so the first step after it releases
/// nothing.
#[test]
fn relaxation_releases_rotated_joint() {
    let split = Hinge { split: true, ..PLAIN };
    for hinge in [PLAIN, split] {
        for (part, fragments) in [(0.8, 1), (1.2, 2)] {
            let mut simulation = hinge.relaxed(part * hinge.angle());
            assert_eq!(simulation.fragments().len(), fragments, "{hinge:?}, {part}");
        }
        if hinge.split {
            // At release its pairs have opened by more than the edge of a block, which stops a
            // relaxation.
            continue;
        }
        let held = Hinge { contact: false, ..hinge };
        let mut simulation = held.relaxed(1.2 * hinge.angle());
        assert_eq!(simulation.fragments().len(), 1, "{held:?}");
    }
}
