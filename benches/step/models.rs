//! Models of the benchmark, ready to step.

use ddem::deck::{
    BlockSet, Body, Damping, Deck, Extent, Fix, Joint, JointChoice, Kinematics, Material, TimeStep,
    Where,
};
use ddem::{Relaxed, Simulation};

/// Tolerance of a relaxation that does not end while it is measured.
const TOLERANCE: f64 = 1e-12;

/// Operation that is repeated.
#[derive(Clone, Copy)]
enum Operation {
    Step,
    Relax,
    Forces,
}

/// Simulation and the operation that is measured.
pub(crate) struct BenchModel {
    simulation: Simulation,
    operation: Operation,
    /// True if points of joints and contacts are counted, not nodes.
    points: bool,
}

impl BenchModel {
    fn new(simulation: Simulation, operation: Operation) -> Self {
        Self { simulation, operation, points: false }
    }

    pub(crate) fn step(&mut self) {
        match self.operation {
            Operation::Step => self.simulation.step().expect("finite numbers"),
            Operation::Forces => self.simulation.evaluate_forces(),
            Operation::Relax => {
                let relaxed = self.simulation.relax_step(TOLERANCE);
                if !matches!(relaxed, Ok(Relaxed::Moving)) {
                    // Steps without motion would count as fast ones.
                    let start = vec![[0.0; 3]; self.nodes()];
                    self.simulation.finish_relaxation();
                    self.simulation.set_displacements(&start);
                    self.simulation.start_relaxation(1).expect("masses");
                }
            }
        }
    }

    pub(crate) fn nodes(&self) -> usize {
        self.simulation.model().n_nodes()
    }

    /// Number of nodes, or of points of joints and contacts.
    pub(crate) fn units(&self) -> usize {
        let [contacts, _] = self.simulation.contact_points();
        match self.points {
            true if contacts > 0 => contacts,
            true => self.simulation.model().n_pairs(),
            false => self.nodes(),
        }
    }

    /// Memory `[B]`; of contacts alone if these are counted.
    pub(crate) fn bytes(&self) -> usize {
        let [contacts, _] = self.simulation.contact_points();
        if self.points && contacts > 0 {
            self.simulation.contact_bytes()
        } else {
            self.simulation.bytes()
        }
    }
}

/// Strength of the joints.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum JointStrength {
    /// No joints: blocks beside each other that do not interact.
    None,
    /// Joints that cannot fail.
    Unbreakable,
    /// Joints that are checked in every step and hold.
    Strong,
    /// Joints of which every pair has failed and slides under pressure.
    Broken,
}

impl JointStrength {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Unbreakable => "unbreakable",
            Self::Strong => "checked",
            Self::Broken => "broken",
        }
    }
}

/// Cubes of 1 m with four divisions and joints of rock, 1 cm thick.
fn deck(count: [u32; 3], kinematics: Kinematics) -> Deck {
    let mut deck = Deck::default();
    deck.model.kinematics = kinematics;
    let rock = Material { density: 2400.0, young: 18e9, poisson: 0.25 };
    let seam = Joint { thickness: 0.01, material: Some("rock".into()), ..Joint::default() };
    deck.materials.insert("rock".into(), rock);
    deck.joints.insert("seam".into(), seam);
    deck.blocks.push(BlockSet {
        size: Some(count.map(f64::from)),
        count: Some(count),
        material: "rock".into(),
        joint: Some(JointChoice::All("seam".into())),
        ..BlockSet::default()
    });
    deck
}

fn started(deck: &Deck, damping: Damping) -> Simulation {
    let mut simulation = Simulation::new(deck.build().expect("a deck without faults"));
    simulation.start(damping, TimeStep::Auto, None).expect("a stable step");
    simulation
}

/// Lattice of blocks that steps in time.
pub(crate) fn lattice(
    count: [u32; 3],
    kinematics: Kinematics,
    strength: JointStrength,
) -> BenchModel {
    let mut deck = deck(count, kinematics);
    let number = if strength == JointStrength::Strong { 1e12 } else { 0.0 };
    match strength {
        JointStrength::Unbreakable => {}
        JointStrength::None => {
            deck.model.contact = Some(false);
            separate(&mut deck, count[0]);
        }
        JointStrength::Strong | JointStrength::Broken => {
            deck.model.contact = Some(false);
            for joint in deck.joints.values_mut() {
                (joint.cohesion, joint.friction, joint.tension) =
                    (Some(number), Some(2.0), Some(number));
            }
        }
    }
    let mut simulation = Simulation::new(deck.build().expect("a deck without faults"));
    if strength == JointStrength::Broken {
        tear(&mut simulation);
    }
    simulation.start(Damping::Ratio(0.05), TimeStep::Auto, None).expect("a stable step");
    if strength == JointStrength::Broken {
        let failed = |simulation: &Simulation| simulation.failed_pairs().iter().sum::<u64>();
        while failed(&simulation) < simulation.model().n_pairs() as u64 {
            simulation.step().expect("finite numbers");
        }
        simulation.step().expect("finite numbers");
    }
    BenchModel::new(simulation, Operation::Step)
}

/// Sets velocities that drive the blocks towards and past each other, so that all joints fail.
fn tear(simulation: &mut Simulation) {
    let model = simulation.model();
    let middle = model.point(model.n_nodes() - 1).map(|x| x / 2.0);
    let mut velocities = Vec::with_capacity(model.n_nodes());
    for node in 0..model.n_nodes() {
        let block = model.block_of(node);
        let centre = model.point(block * model.n_nodes() / model.n_blocks());
        let aside = |k: usize| ((block * (7 + 4 * k)) % 5) as f64 - 2.0;
        velocities.push([0, 1, 2].map(|k| 0.02 * aside(k) - 0.05 * (centre[k] - middle[k])));
    }
    simulation.set_velocities(&velocities);
}

/// Elastic forces of blocks and joints alone, 8 000 nodes.
pub(crate) fn forces(kinematics: Kinematics) -> BenchModel {
    let model = lattice([4, 4, 4], kinematics, JointStrength::Unbreakable);
    BenchModel { operation: Operation::Forces, ..model }
}

/// Support of everything at z = 0.
fn floor() -> Fix {
    let held = Where { z: Some(Extent::Plane(0.0)), ..Where::default() };
    Fix { r#where: held, axes: "xyz".into(), ..Fix::default() }
}

/// Blocks of two divisions that relax under their weight.
pub(crate) fn relaxation(count: u32) -> BenchModel {
    let mut deck = deck([count; 3], Kinematics::Corotational);
    deck.model.gravity = [0.0, 0.0, -9.81];
    deck.blocks[0].divisions = 2;
    deck.fix.push(floor());
    let mut simulation = Simulation::new(deck.build().expect("a deck without faults"));
    simulation.start_relaxation(1).expect("masses");
    BenchModel::new(simulation, Operation::Relax)
}

/// Cells of a region between three scattered joint sets, whose joints hold. The units of rigid cells are
/// the pairs of their joints.
pub(crate) fn cells(edge: f64, body: Body) -> BenchModel {
    let rigid = body == Body::Rigid;
    let name = if rigid { "rigid" } else { "deformable" };
    let set = |dip: u32, direction: u32| {
        format!(
            "[[cut]]\njoint = 'seam'\n\
             set = {{ dip = {dip}, dip_direction = {direction}, fisher = 300, spacing = 1.1 }}\n"
        )
    };
    let text = format!(
        "model.gravity = [0, 0, -9.81]\n\
         materials.rock = {{ density = 2400, young = 18e9, poisson = 0.25 }}\n\
         joints.seam = {{ normal_stiffness = 2e11, shear_stiffness = 7e10 }}\n\
         [[region]]\nbox = {{ from = [0, 0, 0], to = [{edge}, {edge}, {edge}] }}\n\
         material = 'rock'\nbody = '{name}'\n{}{}{}",
        set(20, 100),
        set(75, 265),
        set(80, 5)
    );
    let (mut deck, _) = ddem::deck::parse_alone(&text, "cells").expect("a deck");
    deck.fix.push(floor());
    let simulation = started(&deck, Damping::Local(0.8));
    BenchModel { points: rigid, ..BenchModel::new(simulation, Operation::Step) }
}

/// Each block of a lattice as a set of its own, without joints.
fn separate(deck: &mut Deck, count: u32) {
    let all = deck.blocks.remove(0);
    for k in 0..count.pow(3) {
        let cell = [k % count, k / count % count, k / count.pow(2)];
        let origin = cell.map(f64::from);
        let (size, count) = (Some([1.0; 3]), None);
        deck.blocks.push(BlockSet { origin, size, count, joint: None, ..all.clone() });
    }
}

/// Deformable cubes of two divisions in face contact.
pub(crate) fn loose(count: u32) -> BenchModel {
    let mut deck = deck([count; 3], Kinematics::Corotational);
    deck.model.gravity = [0.0, 0.0, -9.81];
    deck.blocks[0].divisions = 2;
    separate(&mut deck, count);
    deck.fix.push(floor());
    BenchModel::new(started(&deck, Damping::Local(0.8)), Operation::Step)
}

/// Cubes of one division under their weight, with contact. Their joints are springs, of which some
/// break.
pub(crate) fn springs(count: u32) -> BenchModel {
    let mut deck = deck([count; 3], Kinematics::Corotational);
    deck.model.gravity = [6.0, 1.0, -9.81];
    deck.blocks[0].divisions = 1;
    let seam = Joint {
        normal_stiffness: Some(2e10),
        shear_stiffness: Some(1e10),
        cohesion: Some(1e4),
        tension: Some(1e4),
        friction: Some(30.0),
        ..Joint::default()
    };
    deck.joints.insert("seam".into(), seam);
    deck.fix.push(floor());
    BenchModel::new(started(&deck, Damping::Ratio(0.05)), Operation::Step)
}

/// Rigid cubes, face to face: in one lattice with joints, or each as its own set in contact.
pub(crate) fn cubes(count: u32, joined: bool) -> BenchModel {
    let mut deck = deck([count; 3], Kinematics::Corotational);
    deck.blocks[0].body = Body::Rigid;
    deck.model.gravity = [0.0, 0.0, -9.81];
    if !joined {
        separate(&mut deck, count);
    }
    deck.fix.push(floor());
    let mut model = BenchModel::new(started(&deck, Damping::Local(0.8)), Operation::Step);
    model.points = true;
    for _ in 0..200 {
        model.step();
    }
    model
}
