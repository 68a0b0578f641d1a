//! Number of steps of a relaxation of rigid cells: it hardly grows with the number of cells.

use ddem_core::Simulation;

use crate::rock_decks::built;

/// Cube of rock with three scattered sets of joints a metre apart and an edge of `edge` metres, on
/// rollers at its sides and below.
fn rock(edge: f64) -> Simulation {
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
    let text = format!(
        "[model]
        gravity = [0, 0, -10]
        [materials.granite]
        density = 2600.0
        young = 20e9
        poisson = 0.25
        [joints.minor]
        normal_stiffness = 5e9
        shear_stiffness = 2e9
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
    );
    Simulation::new(built(&text).model())
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
