//! `[[join]]`: joints of regions that are left out.

use ddem_core::Simulation;

use crate::rock_decks::{built, cut, messages};

const HEAD: &str = "
[model]
gravity = [0, 0, -10]
[materials.granite]
density = 2700.0
young = 5e9
poisson = 0.25
[joints.minor]
normal_stiffness = 2e9
shear_stiffness = 8e8
[[region]]
box = { from = [0, 0, 0], to = [4, 3, 2] }
material = 'granite'
[[cut]]
name = 'steep'
plane = { dip = 60, dip_direction = 90, through = [2, 1, 1] }
joint = 'minor'
[[cut]]
name = 'flat'
plane = { dip = 20, dip_direction = 200, through = [2, 1, 1] }
joint = 'minor'
[[fix]]
where = { x = 0.0 }
axes = 'xyz'
[[stage]]
name = 'rest'
kind = 'relax'
";

fn with(entries: &str) -> String {
    format!("{HEAD}{entries}")
}

fn n_blocks(text: &str) -> usize {
    cut(text).blocks.iter().max().map_or(0, |last| *last as usize + 1)
}

/// Displacements of all nodes in equilibrium `[m]`.
fn settled(text: &str) -> Vec<[f64; 3]> {
    let mut simulation = Simulation::new(built(text).model());
    simulation.relax(1e-6, 100_000).unwrap();
    simulation.displacements().to_vec()
}

#[test]
fn cells_are_whole_rock_if_all_joints_are_left_out() {
    let all = with("[[join]]\nwhere = { z = [0, 2] }");
    assert_eq!((n_blocks(HEAD), n_blocks(&all)), (4, 1));
    let whole = HEAD.replace("joint = 'minor'\n", "join = true\n");
    assert_eq!(settled(&all), settled(&whole));
    assert_ne!(settled(&all), settled(HEAD));
}

#[test]
fn rigid_cells_without_joints_are_one_body() {
    let rigid = |text: &str| {
        text.replace(
            "'granite'\n[[cut]]\nname = 'steep'",
            "'granite'\nbody = 'rigid'\n[[cut]]\nname = 'steep'",
        )
    };
    let text = rigid(&with("[[join]]\nwhere = { cut = 'flat' }"));
    let rock = cut(&text);
    assert!(rock.is_rigid(0));
    let model = built(&text).model();
    assert_eq!(model.n_whole_blocks(), 2);
    // One joint is left; its halves are those of the cells.
    let area: f64 = model.geometry().joined().map(|joint| joint.area).sum();
    let exact = 3.0 * 2.0 / 60_f64.to_radians().sin();
    assert!((area - exact).abs() < 1e-12, "{area} {exact}");
}

#[test]
fn joints_are_selected_by_place_cut_and_dip() {
    for (place, blocks) in [
        ("{ cut = 'steep' }", 2),
        ("{ cut = 'flat' }", 2),
        ("{ dip = 20, dip_direction = 200 }", 2),
        ("{ cut = 'steep', z = [0, 0.8] }", 3),
        ("{ cut = 'flat', x = [0, 1.5] }", 3),
        ("{ plane = { point = [2, 1, 1], dip = 60, dip_direction = 90 } }", 2),
    ] {
        let text = with(&format!("[[join]]\nwhere = {place}"));
        assert_eq!(n_blocks(&text), blocks, "{place}");
    }
}

#[test]
fn wrong_joins() {
    let of = |entries: &str| messages(&with(entries)).join("\n");
    let rockless = "
[materials.granite]
density = 2700.0
young = 5e9
poisson = 0.25
[[blocks]]
size = [1, 1, 1]
material = 'granite'
[[join]]
where = { z = [0, 1] }
";
    insta::assert_snapshot!(
        [
            of("[[join]]\nwhere = { z = [3, 4] }"),
            of("[[join]]\nwhere = { cut = 'stepe' }"),
            of("[[join]]\nwhere = { cut = 'flat', z = 1.0 }"),
            of("[[join]]"),
            messages(rockless).join("\n"),
            of("[[cut]]\nplane = { dip = 5, dip_direction = 0, through = [2, 1, 1] }\njoint = 'minor'\nwhere = { cut = 'flat' }"),
        ]
        .join("\n\n")
    );
}
