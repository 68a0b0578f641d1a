//! Blocks, joints and contacts that limit the time step.

use ddem_core::{Limiter, Simulation, StepLimit};

use crate::rock_decks;

/// Rock without Poisson effect: c² = E/ρ = 10⁷ m²/s².
const ROCK: &str = "
[model]
contact = false
[materials.rock]
density = 2000.0
young = 20e9
poisson = 0.0
";
/// Step of a cube of 1 m: its fastest mode has ω² = 4 E/(ρ a²).
const OF_CUBE: f64 = 3.162_277_660_168_379_5e-4;

fn limit(text: &str) -> StepLimit {
    let mut simulation = Simulation::new(rock_decks::built(text).model());
    let found = simulation.step_limit().unwrap().unwrap();
    assert_eq!(found.step, simulation.critical_step().unwrap());
    // The search changes nothing.
    assert_eq!(simulation.step_limit(), Ok(Some(found)));
    found
}

fn is(value: f64, exact: f64) {
    assert!((value / exact - 1.0).abs() < 1e-9, "{value} instead of {exact}");
}

fn cube(origin: f64, edge: f64) -> String {
    format!(
        "[[blocks]]\norigin = [{origin}, 0, 0]\nsize = [{edge}, {edge}, {edge}]\ndivisions = 1\nmaterial = 'rock'\n"
    )
}

/// A cube of one element with ν = 1/4 is fastest in its volume: ω² = 12 K/(ρ a²) = 8 E/(ρ a²).
#[test]
fn one_cube_limits_its_own_step() {
    let rock = ROCK.replace("poisson = 0.0", "poisson = 0.25");
    let found = limit(&(rock + &cube(0.0, 2.0)));
    is(found.step, 2.0 / (8.0 * 20e9 / (2000.0 * 4.0_f64)).sqrt());
    assert_eq!(found.limiter, Limiter::Block(0));
}

#[test]
fn smaller_cube_limits_the_step_of_both() {
    let found = limit(&(ROCK.to_owned() + &cube(0.0, 1.0) + &cube(5.0, 0.5)));
    assert_eq!(found.limiter, Limiter::Block(1));
    is(found.step, 0.5 * OF_CUBE);
}

/// Two columns of one element against each other over a joint of stiffness k have the frequency of
/// `½ m ω² = κ + k + √(κ² + k²)` with κ = E/a and m = ρ a. It is twice that of one element, `4 κ/m`,
/// with k = 24/7 κ.
#[test]
fn stiff_joint_halves_the_step() {
    let text = format!(
        "{ROCK}[joints.bed]\nnormal_stiffness = {}\nshear_stiffness = 1e8\n{}count = [1, 1, 2]\njoint = 'bed'\n",
        24.0 / 7.0 * 20e9,
        cube(0.0, 1.0).replace("[1, 1, 1]", "[1, 1, 2]"),
    );
    let found = limit(&text);
    assert_eq!(found.limiter, Limiter::Joint { joint: 0, blocks: [0, 1] });
    is(found.step, 0.5 * OF_CUBE);
}

/// The layers have equal constants, so that the thin one is the stiffest.
#[test]
fn thin_layer_limits_the_step() {
    let layers = "
[joints.thin]
thickness = 0.001
material = 'rock'
[joints.thick]
thickness = 0.2
material = 'rock'
[[blocks]]
size = [2, 2, 2]
count = [2, 2, 2]
divisions = 1
material = 'rock'
joint = { x = 'thin', y = 'thick', z = 'thick' }
";
    let found = limit(&(ROCK.to_owned() + layers));
    let Limiter::Joint { joint, blocks: [a, b] } = found.limiter else { panic!("{found:?}") };
    // Joints are in the order of their names.
    assert_eq!((joint, b), (1, a + 1), "{found:?}");
    let wide = limit(&(ROCK.to_owned() + &layers.replace("0.001", "0.2")));
    assert!(wide.step > 5.0 * found.step, "{found:?}, {wide:?}");
}

#[test]
fn stiff_contacts_limit_the_step() {
    let meets = ROCK.replace("contact = false", "contact = true")
        + "[contact]\nnormal_stiffness = 1e18\nshear_stiffness = 1e18\n";
    let found = limit(&(meets.clone() + &cube(0.0, 1.0) + &cube(5.0, 1.0)));
    assert!(matches!(found.limiter, Limiter::Contacts(0 | 1)), "{found:?}");
    assert!(found.step < 0.01 * OF_CUBE, "{found:?}");
    // Of two rigid cubes the smaller one is faster: k A/m and k A a²/I both have a factor 1/a.
    let rigid = |edge: f64, origin: f64| cube(origin, edge) + "body = 'rigid'\n";
    let small = limit(&(meets.clone() + &rigid(1.0, 0.0) + &rigid(0.5, 5.0)));
    assert_eq!(small.limiter, Limiter::RigidBlock(1));
    let equal = limit(&(meets + &rigid(1.0, 0.0) + &rigid(1.0, 5.0)));
    is(equal.step, small.step * 2.0_f64.sqrt());
}

/// A slab cut off a cube, with the inertia of its width.
#[test]
fn joints_of_cells_limit_the_step() {
    let text = |stiffness: f64| {
        format!(
            "{ROCK}[joints.bed]\nnormal_stiffness = {stiffness}\nshear_stiffness = 1e6\n\
             [[region]]\nbox = {{ from = [0, 0, 0], to = [2, 2, 2] }}\nmaterial = 'rock'\n\
             [[cut]]\nplane = {{ dip = 0, dip_direction = 0, through = [1, 1, 1] }}\njoint = 'bed'\n"
        )
    };
    let (soft, stiff) = (limit(&text(1e6)), limit(&text(1e13)));
    assert!(matches!(soft.limiter, Limiter::Block(_)), "{soft:?}");
    let Limiter::Joint { joint: 0, blocks } = stiff.limiter else { panic!("{stiff:?}") };
    let model = rock_decks::built(&text(1e13)).model();
    let mut whole = blocks.map(|block| model.whole_block(block));
    whole.sort_unstable();
    assert_eq!(whole, [0, 1]);
    assert!(stiff.step < 0.2 * soft.step, "{soft:?}, {stiff:?}");
}

/// A block of parallelepipeds sheared by 3/4 has the scaled Jacobian 4/5.
#[test]
fn worst_element_is_the_most_sheared_one() {
    let skew = "axes = [[1, 0, 0], [0, 1, 0], [3, 0, 4]]\n";
    let text = ROCK.to_owned() + &cube(0.0, 1.0) + &cube(5.0, 2.0) + skew;
    let worst = rock_decks::built(&text).model().worst_element().unwrap();
    assert_eq!(worst.block, 1);
    assert!((worst.scaled_jacobian - 0.8).abs() < 1e-12, "{worst:?}");
    let middle = [5.0 + 1.0 + 0.6, 1.0, 0.8];
    assert!((0..3).all(|c| (worst.point[c] - middle[c]).abs() < 1e-12), "{worst:?}");
    assert_eq!(
        rock_decks::built(&(ROCK.to_owned() + &cube(0.0, 1.0))).model().worst_element(),
        None
    );
    // The parts of a sheared cell are sheared like it.
    let region = "[[region]]\nprism = { outline = [[0, 0], [1, 0], [1.75, 1], [0.75, 1]], axis = 'z', from = 0, to = 1 }\nmaterial = 'rock'\n";
    let worst = rock_decks::built(&(ROCK.to_owned() + region)).model().worst_element().unwrap();
    assert!((worst.scaled_jacobian - 0.8).abs() < 1e-12, "{worst:?}");
}

/// Each block of cells has the step of a model of that block alone, and the shortest one is that of the model.
#[test]
fn blocks_of_cells_have_the_steps_of_models_of_their_own() {
    let region = |low: f64, high: f64| {
        format!(
            "[[region]]\nbox = {{ from = [0, 0, {low}], to = [1, 1, {high}] }}\nmaterial = 'rock'\n"
        )
    };
    let cut = |z: f64, how: &str| {
        format!("[[cut]]\nplane = {{ dip = 0, dip_direction = 0, through = [0, 0, {z}] }}\n{how}\n")
    };
    let soft = "[joints.soft]\nnormal_stiffness = 1.0\nshear_stiffness = 1.0\n";
    let joint = "joint = 'soft'";
    let cuts = cut(0.3, joint) + &cut(0.9, joint) + &cut(1.5, "join = true");
    let text = format!("{ROCK}{soft}{}{cuts}", region(0.0, 2.0));
    let mut simulation = Simulation::new(rock_decks::built(&text).model());
    let mut steps: Vec<f64> = simulation.cell_steps().unwrap().into_values().collect();
    steps.sort_by(f64::total_cmp);
    let alone = |low, high, cuts: &str| limit(&format!("{ROCK}{}{cuts}", region(low, high))).step;
    let joined = alone(0.9, 2.0, &cut(1.5, "join = true"));
    let mut exact = [alone(0.0, 0.3, ""), alone(0.3, 0.9, ""), joined];
    exact.sort_by(f64::total_cmp);
    assert_eq!(steps.len(), exact.len());
    // Each iteration ends when it hardly changes.
    let close =
        |step: f64, exact: f64| assert!((step / exact - 1.0).abs() < 1e-5, "{step}, {exact}");
    steps.iter().zip(exact).for_each(|(step, exact)| close(*step, exact));
    close(steps[0], simulation.critical_step().unwrap());
    // Sets of blocks have no cells.
    let mut cube = Simulation::new(rock_decks::built(&(ROCK.to_owned() + &cube(0.0, 1.0))).model());
    assert!(cube.cell_steps().unwrap().is_empty());
}
