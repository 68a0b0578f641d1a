//! Relaxation of rigid cells: the number of steps hardly grows with the number of cells, and contacts
//! that are found on the way change neither bits nor momentum.

use ddem_core::{Simd, Simulation};

use crate::rock_decks::built;

/// Cube of rock with three scattered sets of joints a metre apart and an edge of `edge` metres, on
/// rollers at its sides and below.
fn rock(edge: f64) -> Simulation {
    Simulation::new(built(&deck(edge, "")).model())
}

fn deck(edge: f64, strength: &str) -> String {
    let set = |dip: f64, direction: f64| {
        format!(
            "[[cut]]
            set = {{ dip = {dip}, dip_direction = {direction}, fisher = 300, \
            spacing = {{ mean = 1.0, spread = 0.3 }} }}
            joint = 'minor'\n"
        )
    };
    let roller =
        |axis: &str, at: f64| format!("[[fix]]\nwhere = {{ {axis} = {at} }}\naxes = '{axis}'\n");
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
        set(15.0, 100.0),
        set(65.0, 265.0),
        set(80.0, 5.0),
        sides.map(|(axis, at)| roller(axis, at)).concat(),
    )
}

fn steps(edge: f64) -> (usize, u64, Simulation) {
    let mut simulation = rock(edge);
    let steps = simulation.relax(1e-5, 5000).unwrap_or_else(|error| panic!("{error}"));
    (simulation.model().n_whole_blocks(), steps, simulation)
}

#[test]
fn steps_hardly_grow_with_the_number_of_cells() {
    let (few_cells, few, _) = steps(4.0);
    let (many_cells, many, simulation) = steps(8.0);
    println!("{few_cells} and {many_cells} cells: {few} and {many} steps");
    // Without smooth motions they take more than a hundred.
    assert!(few < 80 && many < 80, "{few} and {many} steps");
    let mut exact = rock(8.0);
    exact.relax(1e-9, 10_000).unwrap_or_else(|error| panic!("{error}"));
    let largest = |simulation: &Simulation| {
        let u = simulation.displacements();
        u.iter().flatten().fold(0.0, |most: f64, x| most.max(x.abs()))
    };
    let off = largest(&simulation) / largest(&exact) - 1.0;
    assert!(off.abs() < 1e-3, "{off:e}");
}

/// Joints of friction fail, and contacts replace some of them from step to step. A run that continues
/// computes the masses of all cells anew, one that goes on adds those of the cells that have met.
#[test]
fn masses_of_cells_that_meet_are_those_of_a_resumed_run() {
    let roller = "[[fix]]\nwhere = { x = 4 }\naxes = 'x'\n";
    let text = deck(4.0, "friction = 60.0").replace(roller, "");
    let take = |simulation: &mut Simulation, steps: usize| -> Vec<usize> {
        let step = |_| {
            simulation.relax_step(1e-6).unwrap_or_else(|error| panic!("{error}"));
            simulation.contact_points()[0]
        };
        (0..steps).map(step).collect()
    };
    let mut whole = Simulation::new(built(&text).model());
    let points = take(&mut whole, 300);
    let half = points.iter().position(|&points_now| 2 * points_now > points[299]);
    let half = half.expect("cells meet") + 1;
    let mut part = Simulation::new(built(&text).model());
    take(&mut part, half);
    let saved = part.save();
    let resumed = Simulation::restore(built(&text).model(), Simd::default(), &saved);
    let mut resumed = resumed.unwrap_or_else(|error| panic!("{error}"));
    take(&mut resumed, 300 - half);
    let bits = |simulation: &Simulation| {
        simulation.displacements().iter().flatten().map(|x| x.to_bits()).collect::<Vec<_>>()
    };
    assert!(bits(&resumed) == bits(&whole), "resumed after {half} steps");
}
