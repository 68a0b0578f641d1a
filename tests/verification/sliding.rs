//! Blocks that slide, and blocks that stay, near the limit of friction with default settings.

use ddem_core::{Relaxed, Simulation};
use ddem_deck::Deck;
use ddem_deck::{Body, Extent, Fix, Stage, StageKind, Where};

use super::energy::closes;
use super::incline::G;
use super::record::Tolerance::{Absolute, Relative};
use super::record::{at_most, check, of};
use super::shared::{deck, edited, example, run};

/// Contact or joint between the block and the plane.
#[derive(Clone, Copy, Debug)]
enum PlaneInterface {
    /// Contact with a normal stiffness `[Pa/m]`.
    Contact(f64),
    /// Joint of springs with a normal stiffness `[Pa/m]`.
    Spring(f64),
    /// Joint of rock with a thickness `[m]`.
    Layer(f64),
}

impl std::fmt::Display for PlaneInterface {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Contact(stiffness) => write!(f, "contact of {stiffness:e} Pa/m"),
            Self::Spring(stiffness) => write!(f, "springs of {stiffness:e} Pa/m"),
            Self::Layer(thickness) => write!(f, "layer of {} mm", 1e3 * thickness),
        }
    }
}

/// The block on a plane of a slope with friction `[degrees]`.
fn block(
    plane: PlaneInterface,
    [slope, friction]: [f64; 2],
    (body, divisions): (Body, u32),
) -> Deck {
    let mut deck = deck(&example("slide_plane"));
    let slope = slope.to_radians();
    deck.model.gravity = [G * slope.sin(), 0.0, -G * slope.cos()];
    for set in &mut deck.blocks {
        set.divisions = divisions;
        if let PlaneInterface::Contact(_) = plane {
            set.joint = None;
        }
    }
    deck.blocks[1].body = body;
    deck.contact.friction = Some(friction);
    let joint = deck.joints.get_mut("plane").expect("the joint");
    joint.friction = Some(friction);
    match plane {
        PlaneInterface::Contact(stiffness) => {
            deck.contact.normal_stiffness = Some(stiffness);
            deck.contact.shear_stiffness = Some(0.5 * stiffness);
        }
        PlaneInterface::Spring(stiffness) => {
            joint.normal_stiffness = Some(stiffness);
            joint.shear_stiffness = Some(0.5 * stiffness);
        }
        PlaneInterface::Layer(thickness) => {
            (joint.normal_stiffness, joint.shear_stiffness) = (None, None);
            (joint.thickness, joint.material) = (thickness, Some("rock".to_owned()));
        }
    }
    deck
}

/// The set on the plane.
fn sliding_set() -> Where {
    Where { set: Some("block".to_owned()), ..Where::default() }
}

/// Times, velocities of a region down the plane, and its displacements `[s, m/s, m]`.
fn down(deck: &Deck, simulation: &mut Simulation, region: &Where, samples: u64) -> Vec<[f64; 3]> {
    let nodes = region.nodes(simulation.model()).unwrap();
    let stage = deck.stage.last().expect("a stage");
    let steps = simulation
        .start(
            stage.damping.unwrap_or_default(),
            stage.time_step.unwrap_or_default(),
            stage.duration,
        )
        .unwrap_or_else(|error| panic!("{error}"));
    let mut rows = Vec::new();
    for step in 1.. {
        simulation.step().unwrap_or_else(|error| panic!("{error}"));
        let left = simulation.steps_left().expect("a duration");
        if step % (steps / samples).max(1) == 0 || left == 0 {
            let mut mean = [0.0; 2];
            for &node in &nodes {
                let node = node as usize;
                let along = [simulation.velocity(node)[0], simulation.displacement(node)[0]];
                (0..2).for_each(|k| mean[k] += along[k] / nodes.len() as f64);
            }
            let [v, u] = mean;
            rows.push([simulation.time(), v, u]);
        }
        if left == 0 {
            break;
        }
    }
    rows
}

fn simulation(deck: &Deck) -> Simulation {
    Simulation::new(deck.build().unwrap_or_else(|error| panic!("{error}")))
}

const BLOCKS: [((Body, u32), &str); 4] = [
    ((Body::Rigid, 1), "rigid"),
    ((Body::Deformable, 1), "deformable, 1 division"),
    ((Body::Deformable, 2), "deformable, 2 divisions"),
    ((Body::Deformable, 4), "deformable, 4 divisions"),
];

#[test]
fn plate_slides_with_exact_acceleration() {
    let case = of("slide_plane");
    let planes = [
        (PlaneInterface::Contact(1e6), 1.2),
        (PlaneInterface::Contact(1e10), 0.3),
        (PlaneInterface::Contact(1e12), 0.15),
        (PlaneInterface::Spring(1e7), 0.6),
        (PlaneInterface::Spring(1e11), 0.3),
        (PlaneInterface::Spring(1e12), 0.15),
        (PlaneInterface::Layer(0.01), 0.15),
    ];
    let slopes = [[30.0, 28.0], [35.0, 25.0], [25.0, 23.0]];
    for (i, (plane, duration)) in planes.into_iter().enumerate() {
        for (k, (kind, name)) in BLOCKS.into_iter().enumerate() {
            let [slope, friction] = slopes[(i + k) % slopes.len()];
            let mut deck = block(plane, [slope, friction], kind);
            deck.stage[0].duration = Some(duration);
            let rows = down(&deck, &mut simulation(&deck), &sliding_set(), 200);
            let late = rows[rows.len() / 2];
            let end = rows[rows.len() - 1];
            let found = (end[1] - late[1]) / (end[0] - late[0]);
            let [a, f] = [slope, friction].map(f64::to_radians);
            let exact = G * (a.sin() - a.cos() * f.tan());
            let what = format!("acceleration at {friction}° on {slope}°, {plane}, {name} [m/s²]");
            check(case, &what, exact, found, Relative(1e-2));
        }
    }
}

/// The weight of a cube acts near its front edge, where a joint of rigid blocks has no pairs.
#[test]
fn cube_slides_like_plate() {
    let case = of("slide_plane");
    for (plane, slopes) in [
        (PlaneInterface::Spring(1e11), [[35.0, 33.0], [30.0, 28.0]]),
        (PlaneInterface::Layer(0.01), [[35.0, 33.0], [25.0, 23.0]]),
    ] {
        for ([slope, friction], (kind, name)) in
            slopes.into_iter().flat_map(|slope| BLOCKS.map(|kind| (slope, kind)))
        {
            let mut deck = block(plane, [slope, friction], kind);
            deck.blocks[1].size = Some([1.0; 3]);
            deck.stage[0].duration = Some(0.3);
            let rows = down(&deck, &mut simulation(&deck), &sliding_set(), 200);
            let [late, end] = [rows[rows.len() / 2], rows[rows.len() - 1]];
            let found = (end[1] - late[1]) / (end[0] - late[0]);
            let [a, f] = [slope, friction].map(f64::to_radians);
            let exact = G * (a.sin() - a.cos() * f.tan());
            let what =
                format!("cube, acceleration at {friction}° on {slope}°, {plane}, {name} [m/s²]");
            check(case, &what, exact, found, Relative(1e-2));
        }
    }
}

/// A rigid block as slender as can slide without toppling chatters on its front edge. Friction uses
/// the pressure of spring and dashpot.
#[test]
fn slender_block_slides_like_plate() {
    let case = of("slide_plane");
    let [slope, friction] = [31.0, 26.0];
    for plane in
        [PlaneInterface::Contact(1e10), PlaneInterface::Spring(1e10), PlaneInterface::Layer(0.01)]
    {
        let mut deck = block(plane, [slope, friction], (Body::Rigid, 1));
        deck.blocks[1].size = Some([0.8, 0.7, 1.28]);
        deck.stage[0].duration = Some(1.2);
        let rows = down(&deck, &mut simulation(&deck), &sliding_set(), 200);
        let [late, end] = [rows[rows.len() / 2], rows[rows.len() - 1]];
        let found = (end[1] - late[1]) / (end[0] - late[0]);
        let [a, f] = [slope, friction].map(f64::to_radians);
        let exact = G * (a.sin() - a.cos() * f.tan());
        let what =
            format!("slender block, acceleration at {friction}° on {slope}°, {plane} [m/s²]");
        check(case, &what, exact, found, Relative(5e-3));
    }
}

/// A cube tilts as it sinks into a soft layer, which is as thick as the cube sinks deep. When all
/// pairs have failed the axes of the joint turn with the ground block, and no spring jumps.
#[test]
fn cube_on_soft_layer_slides_like_plate() {
    let case = of("slide_plane");
    let [slope, friction] = [25.0, 22.0];
    let (thickness, stiffness, poisson) = (0.05, 1e6, 0.2);
    let mut deck = block(PlaneInterface::Layer(thickness), [slope, friction], (Body::Rigid, 1));
    deck.blocks[0].body = Body::Rigid;
    deck.blocks[1].size = Some([0.7; 3]);
    deck.blocks[1].origin[2] += thickness;
    let joint = deck.joints.get_mut("plane").expect("the joint");
    (joint.material, joint.density, joint.poisson) = (None, Some(2000.0), Some(poisson));
    let constrained = (1.0 - poisson) / ((1.0 + poisson) * (1.0 - 2.0 * poisson));
    joint.young = Some(stiffness * thickness / constrained);
    deck.stage[0].duration = Some(2.6);
    let mut simulation = simulation(&deck);
    let rows = down(&deck, &mut simulation, &sliding_set(), 200);
    let [late, end] = [rows[rows.len() / 2], rows[rows.len() - 1]];
    let found = (end[1] - late[1]) / (end[0] - late[0]);
    let [a, f] = [slope, friction].map(f64::to_radians);
    let exact = G * (a.sin() - a.cos() * f.tan());
    let what = format!("cube on a soft layer, acceleration at {friction}° on {slope}° [m/s²]");
    check(case, &what, exact, found, Relative(1e-2));
    at_most(case, "cube on a soft layer, imbalance", 2e-2, simulation.energy().imbalance());
}

/// Near the limit on a soft joint a cube tilts until half of its base is open. Its joint becomes a
/// contact, which carries the same shear.
#[test]
fn cube_on_soft_joint_comes_to_rest() {
    let case = of("slide_plane");
    for stiffness in [1e6, 3e6] {
        let mut deck =
            block(PlaneInterface::Spring(stiffness), [28.0, 30.0], (Body::Deformable, 2));
        deck.blocks[1].size = Some([0.7; 3]);
        deck.stage =
            vec![Stage { name: "weight".to_owned(), kind: StageKind::Relax, ..Stage::default() }];
        let mut simulation = simulation(&deck);
        simulation.relax(1e-5, 200_000).unwrap_or_else(|error| panic!("{stiffness:e}: {error}"));
        let what = format!("cube on {stiffness:e} Pa/m, imbalance of a relax stage");
        at_most(case, &what, 5e-2, simulation.energy().imbalance());
    }
}

#[test]
fn block_of_one_set_slides_in_plane_of_fixed_block() {
    let case = of("slide_plane");
    for (stiffness, (body, name)) in [
        (1e7, (Body::Deformable, "deformable")),
        (3e7, (Body::Deformable, "deformable")),
        (1e9, (Body::Deformable, "deformable")),
        (1e9, (Body::Rigid, "rigid")),
    ] {
        let mut deck = block(PlaneInterface::Spring(stiffness), [30.0, 28.0], (body, 1));
        deck.blocks.remove(0);
        deck.blocks[0].size = Some([1.0, 1.0, 2.0]);
        deck.blocks[0].count = Some([1, 1, 2]);
        let height = |range| Where { z: Some(Extent::Range(range)), ..Where::default() };
        deck.fix[0].r#where = height([-0.1, 0.9]);
        deck.stage[0].duration = Some(1.0);
        let rows = down(&deck, &mut simulation(&deck), &height([1.1, 2.1]), 200);
        let [late, end] = [rows[rows.len() / 2], rows[rows.len() - 1]];
        let found = (end[1] - late[1]) / (end[0] - late[0]);
        let [a, f] = [30_f64, 28.0].map(f64::to_radians);
        let exact = G * (a.sin() - a.cos() * f.tan());
        let what =
            format!("acceleration on a block of the same set, {stiffness:e} Pa/m, {name} [m/s²]");
        check(case, &what, exact, found, Relative(1e-2));
    }
}

#[test]
fn block_below_friction_limit_stays() {
    let case = of("slide_plane");
    for (plane, duration) in [
        (PlaneInterface::Contact(1e9), 10.0),
        (PlaneInterface::Spring(1e9), 10.0),
        (PlaneInterface::Contact(1e12), 1.0),
    ] {
        for (kind, name) in [BLOCKS[0], BLOCKS[2]] {
            let mut deck = block(plane, [30.0, 32.0], kind);
            deck.stage[0].duration = Some(duration);
            let rows = down(&deck, &mut simulation(&deck), &sliding_set(), 200);
            let creep = (rows[rows.len() - 1][2] - rows[rows.len() / 4][2]).abs();
            let what = format!("creep, weight at once, {plane}, {name} [m]");
            at_most(case, &what, 1e-4, creep);
            // Apply the weight in a relax stage while the block is fixed along the plane.
            let hold = Fix {
                r#where: sliding_set(),
                axes: "x".to_owned(),
                until: Some("slide".to_owned()),
                ..Fix::default()
            };
            deck.fix.push(hold);
            let press =
                Stage { name: "press".to_owned(), kind: StageKind::Relax, ..Stage::default() };
            deck.stage.insert(0, press);
            let mut simulation = simulation(&deck);
            simulation.enter(0).unwrap_or_else(|error| panic!("{error}"));
            simulation.start_relaxation(1).unwrap_or_else(|error| panic!("{error}"));
            while simulation.relax_step(1e-6).unwrap_or_else(|error| panic!("{error}"))
                != Relaxed::Done
            {}
            simulation.finish_relaxation();
            simulation.enter(1).unwrap_or_else(|error| panic!("{error}"));
            let rows = down(&deck, &mut simulation, &sliding_set(), 200);
            let creep = rows[rows.len() - 1][2] - rows[rows.len() / 50][2];
            let what = format!("creep, weight relaxed, {plane}, {name} [m]");
            at_most(case, &what, 1e-4, creep.abs());
        }
    }
}

#[test]
fn dilating_joint_slides_forth_and_back() {
    let case = of("v05_sledge");
    let (k_n, k_s) = (1.0 / (1.0 / 6e9 + 0.1 / 21.6e9), 1.0 / (1.0 / 2e9 + 0.1 / 7.2e9));
    for dilation in [5.0_f64, 10.0] {
        let angle = format!("dilation = {dilation:.1}");
        let run = run(&edited(&example(case.deck), "dilation = 5.0", &angle));
        let column = |name: &str| run.probes.series(name);
        let (force, press, way) = (column("box.x"), column("box.z"), column("top.x"));
        let (rough, rubs) = (dilation.to_radians().tan(), 30_f64.to_radians().tan());
        for (how, sign, [from, to]) in [("there", 1.0, [0.1, 0.19]), ("back", -1.0, [0.32, 0.37])] {
            let mut worst = [0.0_f64; 2];
            for i in (0..way.len()).filter(|&i| (from..to).contains(&way[i][0])) {
                let u = way[i][1];
                let shear =
                    sign * (1e6 + k_n * u * rough) * rubs / (1.0 + sign * k_n / k_s * rough * rubs);
                let pressure = 1e6 + k_n * (u - shear / k_s) * rough;
                worst[0] = worst[0].max((-force[i][1] / shear - 1.0).abs());
                worst[1] = worst[1].max((press[i][1] / pressure - 1.0).abs());
            }
            for (name, off) in ["shear", "pressure"].into_iter().zip(worst) {
                let what = format!(
                    "largest relative difference of the {name} on the way {how}, dilation {dilation}°"
                );
                check(case, &what, 0.0, off, Absolute(0.01));
            }
        }
        closes(case, &format!(", dilation {dilation}°"), &run);
    }
}
