//! Regions that touch each other, and sets of blocks beside them.

use ddem_core::Simulation;
use ddem_deck::{BlockMode, BuiltDeck};

use crate::rock_decks::{built, deck, messages};

/// A region on another one, and a set of two blocks beside both.
const DECK: &str = "
[materials.granite]
density = 2700.0
young = 50e9
poisson = 0.25
[joints.minor]
normal_stiffness = 20e9
shear_stiffness = 8e9
[joints.major]
normal_stiffness = 10e9
shear_stiffness = 4e9
friction = 20.0
[[region]]
name = 'low'
box = { from = [0, 0, 0], to = [4, 3, 2] }
material = 'granite'
joint = 'minor'
[[region]]
name = 'top'
box = { from = [0, 0, 2], to = [4, 3, 3] }
material = 'granite'
joint = 'major'
[[blocks]]
name = 'wall'
origin = [4, 0, 0]
size = [2, 3, 3]
count = [1, 1, 3]
material = 'granite'
joint = 'minor'
[[cut]]
plane = { dip = 60, dip_direction = 90, through = [2, 1, 1] }
joint = 'minor'
where = { z = [0, 2] }
[[fix]]
where = { z = 0.0 }
axes = 'xyz'
[[stage]]
name = 'rest'
kind = 'relax'
[[stage]]
name = 'dig'
kind = 'relax'
";

fn interfaces(text: &str) -> Vec<String> {
    built(text).interfaces().iter().map(ToString::to_string).collect()
}

/// Area of the joints between blocks of two sets `[m²]`.
fn area(built: &BuiltDeck, sets: [usize; 2]) -> f64 {
    let model = built.model();
    let geometry = model.geometry();
    let between = geometry.joined().filter(|joint| {
        let mut own = joint.blocks.map(|block| geometry.set(block as usize));
        own.sort_unstable();
        own == sets
    });
    between.map(|joint| joint.area).sum()
}

#[test]
fn regions_and_sets_that_touch_are_joined_over_their_common_area() {
    assert_eq!(
        interfaces(DECK),
        [
            "sets `low` and `top` are joined by joint `major` over 10 faces",
            "sets `low` and `wall` are joined by joint `minor` over 4 faces",
            "sets `top` and `wall` are joined by joint `minor` over 4 faces",
        ]
    );
    let deck = built(DECK);
    for (sets, exact) in [([0, 1], 12.0), ([0, 2], 6.0), ([1, 2], 3.0)] {
        let found = area(&deck, sets);
        assert!((found - exact).abs() < 1e-12 * exact, "{sets:?}: {found}");
    }
}

#[test]
fn regions_without_a_joint_meet_in_contact_unless_one_is_assigned() {
    let bare = DECK.replacen("joint = 'major'\n[[blocks]]", "[[blocks]]", 1);
    assert_eq!(
        interfaces(&bare)[0],
        "sets `low` and `top` touch over 10 faces without a joint: their blocks interact by contact"
    );
    let assigned = format!("{bare}[[assign]]\njoint = 'major'\nwhere = {{ z = 2.0 }}\n");
    assert!(interfaces(&assigned)[0].contains("joined by joint `major`"));
    // An entry for a cut does not reach the faces between regions.
    let named = assigned.replacen("[[cut]]\n", "[[cut]]\nname = 'fault'\n", 1);
    let of_cut = named.replace("where = { z = 2.0 }", "where = { cut = 'fault' }");
    assert!(interfaces(&of_cut)[0].contains("without a joint"));
    let weak = "[joints.weak]\nnormal_stiffness = 10e9\nshear_stiffness = 4e9\nfriction = 10.0\n[[region]]";
    let later = "[[assign]]\njoint = 'weak'\nwhere = { z = 2.0, set = 'top' }\nfrom = 'dig'\n";
    let later = format!("{DECK}{later}").replacen("[[region]]", weak, 1);
    let stages = built(&later).problem().stages.clone();
    let count = |stage: usize| stages.at(stage).joined().filter(|joint| joint.joint == 2).count();
    assert_eq!([count(0), count(1)], [0, 10]);
}

#[test]
fn blocks_of_sets_have_the_numbers_after_those_of_cells() {
    let model = built(DECK).model();
    let cells = deck(DECK).cut_regions().unwrap().blocks.len();
    let mut numbers: Vec<usize> =
        (0..model.n_blocks()).map(|block| model.whole_block(block)).collect();
    numbers.dedup();
    assert_eq!(numbers.len(), model.n_whole_blocks());
    assert_eq!(numbers[cells..], [cells, cells + 1, cells + 2]);
}

#[test]
fn excavation_takes_cells_and_blocks_alike() {
    let text = format!("{DECK}[[remove]]\nwhere = {{ z = [2.0, 3.0] }}\nfrom = 'dig'\n");
    let problem = built(&text).problem().clone();
    let geometry = problem.stages.at(1);
    let removed = (0..geometry.blocks.len()).filter(|&block| geometry.is_removed(block));
    let sets: Vec<usize> = removed.map(|block| geometry.set(block)).collect();
    // The eight parts of the upper region and one block.
    assert_eq!(sets, [1, 1, 1, 1, 1, 1, 1, 1, 2]);
    let gone = format!("{DECK}[[remove]]\nwhere = {{ z = [2.0, 3.0] }}\n");
    assert!((built(&gone).model().volumes()[0] - 36.0).abs() < 1e-12);
}

/// A block on a part of the slope of another region, which dips by 25 degrees to the east, between
/// smooth walls.
#[test]
fn block_theory_knows_the_joint_between_regions() {
    let slope = include_str!("../../../../examples/verification/regions_slope.toml");
    // Without its lower face, which is rock to the table, as all outer faces but upward ones.
    let slope = slope.replace("[3.1415416229, 1.5036836344], ", "");
    let walls =
        "[[fix]]\nwhere = { y = 0.0 }\naxes = 'y'\n[[fix]]\nwhere = { y = 1.0 }\naxes = 'y'\n";
    let slope = format!("{slope}{walls}");
    let verdict = |text: &str| deck(text).cut_regions().unwrap().verdicts().pop().unwrap();
    let tan = |angle: f64| angle.to_radians().tan();
    let joined = verdict(&slope);
    assert_eq!(joined.mode, BlockMode::SlidesOnOne);
    let factor = joined.factor.unwrap();
    assert!((factor - tan(35.0) / tan(25.0)).abs() < 1e-7, "{factor}");
    let [plunge, trend] = joined.plunge_trend.unwrap();
    assert!((plunge - 25.0).abs() < 1e-7 && (trend - 90.0).abs() < 1e-7, "{plunge} {trend}");
    // Without a joint the regions meet in contact, whose friction is 30 degrees.
    let contact = verdict(&slope.replace("joint = \"seam\"\n", ""));
    assert!((contact.factor.unwrap() - tan(30.0) / tan(25.0)).abs() < 1e-7);
}

#[test]
fn sets_that_reach_into_regions_and_names_of_both_are_faults() {
    let mut found = messages(&DECK.replace("origin = [4, 0, 0]", "origin = [3.5, 0, 0]"));
    found.extend(messages(&DECK.replace("name = 'wall'", "name = 'low'")));
    insta::assert_snapshot!(found.join("\n"));
}

/// Blocks that remain carry their own weight, not that of the cells.
#[test]
fn rigid_set_relaxes_after_all_rigid_cells_have_gone() {
    let rigid = DECK.replace("material = 'granite'\n", "material = 'granite'\nbody = 'rigid'\n");
    let gone = "[[remove]]\nwhere = { x = [0.0, 4.0] }\nfrom = 'dig'\n";
    let text = format!("model.gravity = [0, 0, -9.81]\n{rigid}{gone}");
    let mut simulation = Simulation::new(built(&text).model());
    simulation.relax(1e-9, 20_000).expect("an equilibrium");
    simulation.enter(1).expect("an excavation");
    simulation.relax(1e-9, 2000).expect("an equilibrium without cells");
}

/// A line load and a charge on the set, without the set `name`.
const ON_SET: &str = "
[[remove]]
where = { set = 'wall', z = [1, 2] }
[[load]]
line = [0, 0, -1e3]
where = { set = 'wall', x = 6.0, z = 3.0 }
[[charge]]
where = { set = 'wall', z = [0, 3] }
pressure = 1e5
";

#[test]
fn line_loads_and_charges_act_on_sets_beside_regions() {
    let model = built(&format!("{DECK}{ON_SET}")).model();
    let conditions = model.conditions();
    let sum: f64 = conditions.loaded[0].forces.iter().map(|(_, force)| force.z).sum();
    assert!((sum + 3e3).abs() < 1e-9, "{sum}");
    let charge = &conditions.charged[0].charge;
    // The roof and the floor of the hole.
    assert_eq!((charge.size.walls, charge.size.area), (2, 12.0));
    let of_set = |node: &u32| model.geometry().set(model.geometry().locate(*node as usize).0) == 2;
    assert!(charge.nodes.iter().all(of_set));
}
