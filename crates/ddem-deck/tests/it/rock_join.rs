//! `[[join]]`: joints of regions that are left out.

use std::collections::BTreeSet;
use std::sync::Arc;

use ddem_core::law::MohrCoulomb;
use ddem_core::problem::Vec3;
use ddem_core::{Damping, FIELDS, Field, FieldLocation, Limiter, PairAtRest, Simulation, TimeStep};
use ddem_cut::{CommonFace, PlaneSource};
use ddem_deck::BlockMode;

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

/// Names of the cuts that still have joints.
fn cuts_with_joints(text: &str) -> Vec<String> {
    let rock = cut(text);
    let joints = rock.common.iter().filter(|face| rock.is_joint(face));
    let names = joints.filter_map(|face| match rock.complex.planes()[face.plane as usize].source {
        PlaneSource::Cut(cut) | PlaneSource::Bridge(cut) => Some(rock.cut_name(cut)),
        PlaneSource::Region => None,
    });
    names.collect::<BTreeSet<_>>().into_iter().collect()
}

#[test]
fn joints_of_a_cut_are_left_out_by_its_name() {
    for (name, left) in [("steep", "flat"), ("flat", "steep")] {
        let text = with(&format!("[[join]]\nwhere = {{ cut = '{name}' }}"));
        assert_eq!(cuts_with_joints(&text), [left]);
        // A stereonet does not draw a plane without joints.
        let (planes, _) = cut(&text).planes();
        let joined: Vec<bool> = planes.iter().map(|plane| plane.joined).collect();
        assert_eq!(joined, [name == "steep", name == "flat"]);
    }
}

/// Rock with a joint that ends on a plane without a joint, within one block.
fn ended() -> String {
    let ends = "[[cut]]\nname = 'short'\nplane = { dip = 90, dip_direction = 0, through = [2, 1.7, 1] }\n\
                joint = 'minor'\nwhere = { x = [0, 2] }\n";
    with(&format!("{ends}[[join]]\nwhere = {{ cut = 'steep' }}"))
}

/// Faces that match only in part are held by springs as stiff as a thin layer of rock.
#[test]
fn cells_are_joined_where_a_cut_ended() {
    let text = ended();
    let rock = cut(&text);
    assert!(rock.common.iter().any(|face| !face.matches && !rock.is_joint(face)));
    let model = built(&text).model();
    assert!((model.volumes()[0] - 24.0).abs() < 1e-12);
    // That of the rock follows the one of the deck.
    assert!(model.geometry().joined().any(|joint| joint.joint == 1));
    settled(&text);
}

/// Springs that hold whole rock together are no joints: no field, count, name or energy of joints has them.
#[test]
fn whole_rock_has_no_joints_in_results() {
    let mut simulation = Simulation::new(built(&ended()).model());
    simulation.relax(1e-6, 100_000).unwrap();
    let (rock, model) = (cut(&ended()), simulation.model());
    let faces = rock.common.iter().filter(|face| rock.is_joint(face)).count();
    assert_eq!((model.n_whole_joints(), model.joint_numbers().max()), (faces, Some(0)));
    assert_eq!(model.n_breakable(), [0, 0]);
    assert_eq!(model.joints_without_strength().collect::<Vec<_>>(), ["minor"]);
    assert!(model.n_joints() < model.geometry().joined().count());
    assert_eq!((model.pairs().count(), model.quads().count()), (model.n_pairs(), model.n_joints()));
    let last = model.quads().flatten().max().unwrap() as usize;
    assert_eq!(last + 1, model.n_pairs());
    let law = Arc::new(MohrCoulomb::default());
    insta::assert_snapshot!(built(&ended()).model().set_law("rock of region[0]", law).unwrap_err());

    // Each row belongs to its own pair.
    let pairs: Vec<_> = model.pairs().collect();
    let (nodes, tractions) = (simulation.displacements().to_vec(), simulation.tractions());
    let snapshot = simulation.snapshot();
    let field = |name: &str| {
        let on_pairs = |field: &&Field| field.on == FieldLocation::Pair && field.name == name;
        snapshot.values(FIELDS.iter().find(on_pairs).unwrap()).as_chunks::<3>().0.to_vec()
    };
    let displacements = pairs.iter().map(|pair| {
        let [a, b] = pair.nodes.map(|node| nodes[node as usize]);
        [0, 1, 2].map(|c| 0.5 * (a[c] + b[c]))
    });
    assert_eq!(field("displacement"), displacements.collect::<Vec<_>>());
    assert_eq!(field("traction"), tractions);
    // Both sides are held at x = 0.
    let loaded = |(pair, traction): (&PairAtRest, &[f64; 3])| {
        (pair.point[0] > 1e-9) == (traction != &[0.0; 3])
    };
    assert!(pairs.iter().zip(&tractions).all(loaded));
    assert_eq!(simulation.fragments().len(), 1);
}

/// Without joints, joints hold no energy and limit no step.
#[test]
fn whole_rock_strains_as_blocks_do() {
    let text = ended().replace("joint = 'minor'\nwhere", "join = true\nwhere");
    let text = format!("{text}\n[[join]]\nwhere = {{ cut = 'flat' }}");
    let mut simulation = Simulation::new(built(&text).model());
    assert!(simulation.model().geometry().joined().next().is_some());
    assert_eq!((simulation.model().n_joints(), simulation.model().n_pairs()), (0, 0));
    let limit = simulation.step_limit().unwrap().unwrap();
    assert!(matches!(limit.limiter, Limiter::Block(_)), "{limit:?}");
    simulation.relax(1e-9, 100_000).unwrap();
    let energy = simulation.energy();
    assert_eq!(energy.strain_joints, 0.0);
    // A load does twice the work that blocks store, and damping takes the rest.
    assert!((2.0 * energy.strain_bodies / energy.external_work - 1.0).abs() < 1e-4, "{energy:?}");
}

/// A joint that ends inside a block leaves a slit.
#[test]
fn joints_end_inside_blocks() {
    for body in ["deformable", "rigid"] {
        let text = with(
            "[[join]]\nwhere = { cut = 'flat' }\n[[join]]\nwhere = { cut = 'steep', z = [0, 0.8] }",
        );
        let text =
            text.replace("'granite'\n[[cut]]", &format!("'granite'\nbody = '{body}'\n[[cut]]"));
        assert_eq!(n_blocks(&text), 1);
        let model = built(&text).model();
        let slit: f64 = model.geometry().joined().map(|joint| joint.area).sum();
        // The flat plane meets the middle of the steep one: its upper part stays.
        let rock = cut(HEAD);
        let is_upper = |face: &&CommonFace| {
            rock.complex.planes()[face.plane as usize].source == PlaneSource::Cut(0)
                && rock.complex.common_middle(face).z > 0.8
        };
        let exact: f64 =
            rock.common.iter().filter(is_upper).map(|face| rock.complex.common_area(face)).sum();
        assert!(exact > 1.0 && (slit - exact).abs() < 1e-12, "{slit} {exact}");
        settled(&text);
    }
}

#[test]
fn joints_between_regions_stay() {
    let beside = "[[region]]\nname = 'beside'\nbox = { from = [4, 0, 0], to = [5, 3, 2] }\nmaterial = 'granite'\njoint = 'minor'\n";
    let text = with(&format!("{beside}[[join]]\nwhere = {{ x = [0, 5] }}"))
        .replace("material = 'granite'\n[[cut]]", "material = 'granite'\njoint = 'minor'\n[[cut]]");
    assert_eq!(n_blocks(&text), 2);
    let areas: f64 = built(&text).model().geometry().joined().map(|joint| joint.area).sum();
    assert!((areas - 6.0).abs() < 1e-12, "{areas}");
}

/// A whole block that reaches a support is held.
#[test]
fn block_theory_knows_joined_cells() {
    let text = HEAD.replace("where = { x = 0.0 }", "where = { z = 0.0 }");
    let modes = |text: &str| -> Vec<BlockMode> {
        cut(text).verdicts().iter().map(|verdict| verdict.mode).collect()
    };
    assert!(modes(&text).iter().any(|mode| *mode != BlockMode::Held));
    let all = format!("{text}[[join]]\nwhere = {{ z = [0, 2] }}");
    assert_eq!(modes(&all), [BlockMode::Held; 4]);
}

#[test]
fn joints_are_selected_by_place_cut_and_dip() {
    for (place, blocks) in [
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
            of("[[blocks]]\nname = 'boulder'\norigin = [0, 0, 2]\nsize = [1, 1, 1]\nmaterial = 'granite'\n[[join]]\nwhere = { set = 'boulder' }"),
            of("[[cut]]\nplane = { dip = 5, dip_direction = 0, through = [2, 1, 1] }\njoint = 'minor'\nwhere = { cut = 'flat' }"),
        ]
        .join("\n\n")
    );
}

/// Parts of a block that an excavation has cut off fall freely, while the rest slides and is damped.
#[test]
fn separated_parts_of_a_block_move_apart() {
    let text = "
[model]
gravity = [2, 0, -10]
[materials.granite]
density = 2700.0
young = 5e9
poisson = 0.25
[contact]
friction = 1.0
[[region]]
name = 'slab'
box = { from = [0, 0, 0], to = [3, 1, 1] }
material = 'granite'
[[region]]
name = 'base'
box = { from = [-1, 0, -1], to = [1, 1, 0] }
material = 'granite'
body = 'rigid'
[[cut]]
plane = { dip = 90, dip_direction = 90, through = [1, 0.5, 0.5] }
where = { z = [0.0, 1.0] }
join = true
[[cut]]
plane = { dip = 90, dip_direction = 90, through = [2, 0.5, 0.5] }
where = { z = [0.0, 1.0] }
join = true
[[fix]]
where = { set = 'base' }
axes = 'xyz'
[[remove]]
where = { x = [1.1, 1.9] }
from = 'fall'
[[stage]]
name = 'rest'
kind = 'dynamic'
duration = 0.001
[[stage]]
name = 'fall'
kind = 'dynamic'
duration = 0.05
";
    let mut simulation = Simulation::new(built(text).model());
    assert_eq!(simulation.model().n_whole_blocks(), 2);
    simulation.enter(1).unwrap();
    let steps = simulation.start(Damping::None, TimeStep::Auto, Some(0.05)).unwrap();
    (0..steps).for_each(|_| simulation.step().unwrap());
    let (velocities, model) = (simulation.velocities(), simulation.model());
    let speed = |from: f64| {
        let own = (0..model.n_nodes())
            .filter(|&node| (from..=from + 1.0).contains(&model.point(node)[0]));
        let nodes: Vec<_> = own.filter(|&node| model.point(node)[2] > 0.1).collect();
        let mass: f64 = nodes.iter().map(|&node| model.mass(node)).sum();
        let momentum = nodes.iter().map(|&node| Vec3::from(velocities[node]) * model.mass(node));
        momentum.sum::<Vec3>() / mass
    };
    let falls = speed(2.0) / simulation.time();
    assert!((falls - Vec3::new(2.0, 0.0, -10.0)).norm() < 1e-6, "{falls}");
    let slides = speed(0.0) / simulation.time();
    let exact = 2.0 - 10.0 * 1_f64.to_radians().tan();
    assert!((slides.x / exact - 1.0).abs() < 0.01, "{slides}");
}
