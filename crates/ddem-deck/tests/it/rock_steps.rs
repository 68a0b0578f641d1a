//! Relaxation of cells: the number of steps hardly grows with the number of cells, and contacts that are
//! found on the way change neither bits nor momentum.

use ddem_core::{Damping, Simd, Simulation, TimeStep};

use crate::rock_decks::built;

fn simulation(deck: &str) -> Simulation {
    Simulation::new(built(deck).model())
}

fn set(joint: &str, [dip, direction]: [f64; 2], spacing: &str) -> String {
    format!(
        "[[cut]]
        set = {{ dip = {dip}, dip_direction = {direction}, fisher = 300, spacing = {spacing} }}
        joint = '{joint}'\n"
    )
}

fn roller(axis: &str, at: f64) -> String {
    format!("[[fix]]\nwhere = {{ {axis} = {at} }}\naxes = '{axis}'\n")
}

/// Cube of rigid rock with three scattered sets of joints a metre apart and an edge of `edge` metres,
/// on rollers at its sides and below.
fn deck(edge: f64, strength: &str) -> String {
    let minor = |orientation| set("minor", orientation, "{ mean = 1.0, spread = 0.3 }");
    let sides = [("x", 0.0), ("x", edge), ("y", 0.0), ("y", edge), ("z", 0.0)];
    format!(
        "[model]
        gravity = [0, 0, -10]
        [materials.granite]
        density = 2600.0
        young = 20e9
        poisson = 0.25
        [joints.minor]
        normal_stiffness = 5e9
        shear_stiffness = 2e9
        {strength}
        [[region]]
        name = 'rock'
        box = {{ from = [0, 0, 0], to = [{edge}, {edge}, {edge}] }}
        material = 'granite'
        body = 'rigid'
        seed = 7
        small = {{ width = 0.1 }}
        {}{}{}{}
        [[stage]]
        name = 'rest'
        kind = 'relax'",
        minor([15.0, 100.0]),
        minor([65.0, 265.0]),
        minor([80.0, 5.0]),
        sides.map(|(axis, at)| roller(axis, at)).concat(),
    )
}

/// The same of deformable cells, on joints of a normal stiffness in GPa/m.
fn deformable(edge: f64, stiffness: f64, strength: &str) -> String {
    let springs =
        format!("normal_stiffness = {stiffness}e9\nshear_stiffness = {}e9\n", 0.4 * stiffness);
    let stiff = "normal_stiffness = 5e9\n        shear_stiffness = 2e9\n";
    let deck = deck(edge, strength).replace("body = 'rigid'", "");
    assert!(deck.contains(stiff));
    deck.replace(stiff, &springs)
}

fn steps(deck: &str) -> (usize, u64, Simulation) {
    let mut simulation = simulation(deck);
    let steps = simulation.relax(1e-5, 5000).unwrap_or_else(|error| panic!("{error}"));
    (simulation.model().n_whole_blocks(), steps, simulation)
}

fn largest(simulation: &Simulation) -> f64 {
    let u = simulation.displacements();
    u.iter().flatten().fold(0.0, |most: f64, x| most.max(x.abs()))
}

/// Asserts that a simulation at rest has the largest displacement of one that is relaxed further.
fn assert_at_rest(at_rest: &Simulation, deck: &str) {
    let mut exact = simulation(deck);
    exact.relax(1e-9, 10_000).unwrap_or_else(|error| panic!("{error}"));
    let off = largest(at_rest) / largest(&exact) - 1.0;
    assert!(off.abs() < 1e-3, "{off:e}");
}

#[test]
fn steps_hardly_grow_with_the_number_of_cells() {
    let (few_cells, few, _) = steps(&deck(4.0, ""));
    let (many_cells, many, at_rest) = steps(&deck(8.0, ""));
    println!("{few_cells} and {many_cells} cells: {few} and {many} steps");
    // Without smooth motions they take more than a hundred.
    assert!(few < 80 && many < 80, "{few} and {many} steps");
    assert_at_rest(&at_rest, &deck(8.0, ""));
}

/// On soft joints cells move as rigid bodies, and on stiff ones they deform together.
#[test]
fn steps_of_deformable_cells_hardly_grow_with_their_number() {
    for stiffness in [1.0, 200.0] {
        let (few_cells, few, at_rest) = steps(&deformable(3.0, stiffness, ""));
        assert_at_rest(&at_rest, &deformable(3.0, stiffness, ""));
        let (many_cells, many, _) = steps(&deformable(6.0, stiffness, ""));
        println!("{few_cells} and {many_cells} cells: {few} and {many} steps");
        // Eight times as many nodes.
        assert!(2 * many < 3 * few && few < 500, "{few} and {many} steps");
    }
}

/// Joints of friction fail, and contacts replace some of them from step to step. A run that continues
/// computes the masses of all cells anew, one that goes on adds those of the cells that have met.
/// The cells are rigid, deformable, deformable below rigid blocks, or joined.
#[test]
fn masses_of_cells_that_meet_are_those_of_a_resumed_run() {
    let side = roller("x", 4.0);
    let soft = |friction: f64| deformable(4.0, 0.1, &format!("friction = {friction}"));
    let joined = |text: String| {
        let at = text.rfind("joint = 'minor'").unwrap();
        format!("{}join = true{}", &text[..at], &text[at + "joint = 'minor'".len()..])
    };
    let boulders = "\n[[blocks]]
        origin = [0, 0, 4]
        size = [4, 4, 0.8]
        count = [5, 5, 1]
        body = 'rigid'
        material = 'granite'
        joint = 'minor'";
    let texts = [
        (deck(4.0, "friction = 60.0"), 300),
        (soft(10.0), 300),
        (soft(10.0) + boulders, 300),
        (joined(soft(1.0)), 600),
    ];
    for (text, steps) in texts {
        assert!(assert_resumes(&text.replace(&side, ""), steps) > 0, "cells meet");
    }
}

/// A slope whose joints have friction alone. Some thin cells meet on the way, and their contacts are far
/// stiffer than its joints. With such contacts in the masses of all cells it took 1840 steps.
#[test]
fn contacts_of_thin_cells_add_few_steps() {
    let bedding = |orientation| set("bedding", orientation, "5");
    let text = format!(
        "model.gravity = [0, 0, -9.81]
        materials.granite = {{ density = 2700, young = 50e9, poisson = 0.25 }}
        joints.bedding = {{ normal_stiffness = 20e9, shear_stiffness = 8e9, friction = 35 }}
        [[region]]
        material = 'granite'
        [region.prism]
        outline = [[0, 0], [40, 0], [40, 28], [24, 28], [10, 8], [0, 8]]
        axis = 'y'
        from = 0
        to = 30
        {}{}{}
        [[fix]]
        where = {{ z = 0 }}
        axes = 'xyz'
        {}{}{}{}
        [[stage]]
        name = 'weight'
        kind = 'relax'",
        bedding([28.0, 270.0]),
        bedding([75.0, 80.0]),
        bedding([85.0, 350.0]),
        roller("x", 40.0),
        roller("x", 0.0),
        roller("y", 0.0),
        roller("y", 30.0),
    );
    let (_, taken, _) = steps(&text);
    println!("{taken} steps");
    assert!(taken < 700, "{taken} steps");
}

/// Asserts that a run that continues where half of its contacts have been found, or halfway without
/// any, has the bits of one that goes on. Returns the number of contacts.
fn assert_resumes(text: &str, steps: usize) -> usize {
    let take = |simulation: &mut Simulation, steps: usize| -> Vec<usize> {
        let step = |_| {
            simulation.relax_step(1e-6).unwrap_or_else(|error| panic!("{error}"));
            simulation.contact_points()[0]
        };
        (0..steps).map(step).collect()
    };
    let mut whole = simulation(text);
    let points = take(&mut whole, steps);
    let half = points.iter().position(|&points_now| 2 * points_now > points[steps - 1]);
    let half = half.map_or(steps / 2, |half| half + 1);
    let mut part = simulation(text);
    take(&mut part, half);
    let saved = part.save();
    let resumed = Simulation::restore(built(text).model(), Simd::default(), &saved);
    let mut resumed = resumed.unwrap_or_else(|error| panic!("{error}"));
    take(&mut resumed, steps - half);
    let bits = |simulation: &Simulation| {
        simulation.displacements().iter().flatten().map(|x| x.to_bits()).collect::<Vec<_>>()
    };
    assert!(bits(&resumed) == bits(&whole), "resumed after {half} steps");
    points[steps - 1]
}

/// A column of two cells on a floor under a tilted gravity topples and lies on it, turned by a right
/// angle, where it is relaxed. The floor carries the weight of all: 42 m³ of rock.
#[test]
fn toppled_cells_come_to_rest() {
    let plane = |dip: f64, through: [f64; 3]| {
        format!(
            "[[cut]]
            joint = 'seam'
            plane = {{ dip = {dip}, dip_direction = 90, through = {through:?} }}\n"
        )
    };
    let text = format!(
        "model.gravity = [2.5, 0, -9]
        materials.rock = {{ density = 2400, young = 1e8, poisson = 0.25 }}
        joints.seam = {{ normal_stiffness = 2e6, shear_stiffness = 1e6, friction = 40 }}
        [[region]]
        box = {{ from = [-1, 0, -1], to = [14, 2, 6] }}
        material = 'rock'
        {}{}{}{}
        [[remove]]
        where = {{ x = [-1, 0], z = [0, 6] }}
        [[remove]]
        where = {{ x = [1, 14], z = [0, 6] }}
        [[fix]]
        where = {{ z = -1 }}
        axes = 'xyz'
        [[stage]]
        name = 'fall'
        kind = 'dynamic'
        duration = 2.2",
        plane(0.0, [0.0; 3]),
        plane(90.0, [0.0; 3]),
        plane(90.0, [1.0, 0.0, 0.0]),
        plane(0.0, [0.0, 0.0, 3.0]),
    );
    let mut simulation = simulation(&text);
    simulation.start(Damping::Local(0.2), TimeStep::Auto, None).unwrap();
    while simulation.time() < 2.2 {
        simulation.step().unwrap();
    }
    simulation.relax(1e-6, 20_000).unwrap_or_else(|error| panic!("{error}"));
    let moved = simulation.displacements().iter().map(|u| u[0]).fold(0.0, f64::max);
    assert!(moved > 5.0, "the column lies {moved} m down the slope");
    let all: Vec<u32> = (0..simulation.model().n_nodes() as u32).collect();
    let force = simulation.reaction(&all);
    let weight = 42.0 * 2400.0;
    for (axis, gravity) in [(0, 2.5), (2, -9.0)] {
        let off = force[axis] / (-gravity * weight) - 1.0;
        assert!(off.abs() < 1e-4, "axis {axis}: {off:e}");
    }
}
