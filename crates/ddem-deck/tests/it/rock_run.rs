//! Runs of regions: what their models have, and the messages about what they do not have yet.

use ddem_core::problem::Vec3;
use ddem_core::{Damping, Simulation, TimeStep};
use ddem_deck::BuiltDeck;

use crate::rock_decks::{built, deck, messages};

const HEAD: &str = "
[materials.granite]
density = 2700.0
young = 50e9
poisson = 0.25
[materials.soil]
density = 2000.0
young = 1e9
poisson = 0.3
[joints.minor]
normal_stiffness = 20e9
shear_stiffness = 8e9
[joints.major]
normal_stiffness = 10e9
shear_stiffness = 4e9
friction = 20.0
";
const BOX: &str = "
[[region]]
name = 'rock'
box = { from = [0, 0, 0], to = [4, 3, 2] }
material = 'granite'
";
const CUTS: &str = "
[[cut]]
plane = { dip = 60, dip_direction = 90, through = [2, 1, 1] }
joint = 'minor'
[[cut]]
plane = { dip = 40, dip_direction = 200, through = [2, 1, 1] }
joint = 'minor'
[[cut]]
plane = { dip = 80, dip_direction = 10, through = [2, 1.2, 1] }
join = true
";
const REST: &str = "
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

fn whole(more: &str) -> String {
    format!("{HEAD}{BOX}{CUTS}{REST}{more}")
}

#[test]
fn parts_fill_the_region_and_carry_its_mass() {
    for divisions in [2, 4] {
        let text =
            whole("").replace("'granite'\n", &format!("'granite'\ndivisions = {divisions}\n"));
        let model = built(&text).model();
        assert!((model.volumes()[0] - 24.0).abs() < 1e-12);
        let mass: f64 = (0..model.n_nodes()).map(|node| model.mass(node)).sum();
        assert!((mass - 24.0 * 2700.0).abs() < 1e-8, "{mass}");
        let volume: f64 = (0..model.n_blocks()).map(|block| model.volume(block)).sum();
        assert!((volume - 24.0).abs() < 1e-12);
        // Two planes with joints and one that joins.
        assert_eq!(model.n_whole_blocks(), 4);
        assert!(model.geometry().ties.len() > 50);
        for block in 0..model.n_blocks() {
            for at in [[0; 3], [divisions / 2 - 1; 3]] {
                let corners = model.geometry().element_corners(
                    block,
                    model.element(block, at) - model.elements_of(block).start,
                );
                let middle = corners.iter().sum::<Vec3>() / 8.0;
                assert_eq!(model.element_at(middle.into()), (block, at));
            }
        }
    }
}

#[test]
fn pyramids_fill_cells_with_crowded_corners() {
    let four = CUTS.replace("join = true", "joint = 'minor'").replace("[2, 1.2, 1]", "[2, 1, 1]")
        + "[[cut]]\nplane = { dip = 5, dip_direction = 45, through = [2, 1, 1] }\njoint = 'minor'\n";
    for divisions in [2, 6] {
        let region = BOX.replace("'granite'\n", &format!("'granite'\ndivisions = {divisions}\n"));
        let text = format!("{HEAD}{region}{four}{REST}");
        let model = built(&text).model();
        assert_eq!(model.n_whole_blocks(), 14);
        let volume: f64 = (0..model.n_blocks()).map(|block| model.volume(block)).sum();
        assert!((volume - 24.0).abs() < 1e-12);
        let mass: f64 = (0..model.n_nodes()).map(|node| model.mass(node)).sum();
        assert!((mass - 24.0 * 2700.0).abs() < 1e-8, "{mass}");
        let rock = deck(&text).cut_regions().unwrap();
        let parts: usize = (0..14).map(|cell| rock.parts(cell).len()).sum();
        assert_eq!(model.n_blocks(), parts);
    }
}

#[test]
fn joints_have_the_areas_of_the_faces() {
    let model = built(&whole("")).model();
    let rock = deck(&whole("")).cut_regions().unwrap();
    let face = |common: &ddem_cut::CommonFace| {
        let cell = &rock.complex.cells()[common.cells[0] as usize];
        cell.faces[common.faces[0] as usize].area(rock.complex.points()).norm()
    };
    let exact: f64 = rock.common.iter().filter(|face| rock.is_joint(face)).map(face).sum();
    let areas: f64 = model.geometry().joined().map(|joint| joint.area).sum();
    assert!((areas - exact).abs() < 1e-12 * exact, "{areas} {exact}");
}

#[test]
fn assign_and_remove_select_cells() {
    let names = |text: &str| {
        let model = built(text).model();
        let mut numbers: Vec<u16> = model.joint_numbers().collect();
        numbers.sort_unstable();
        numbers.dedup();
        numbers
    };
    // Joints are in the order of their names.
    assert_eq!(names(&whole("")), [1]);
    let both = "[[assign]]\njoint = 'major'\nwhere = { dip = 60, dip_direction = 90 }";
    assert_eq!(names(&whole(both)), [0, 1]);
    let soft = whole("[[assign]]\nmaterial = 'soil'\nwhere = { x = [0.0, 1.5] }");
    let model = built(&soft).model();
    let soil = (0..model.n_blocks()).filter(|&block| model.material(block) == 1);
    let volume: f64 = soil.map(|block| model.volume(block)).sum();
    assert!(volume > 1.0 && volume < 23.0, "{volume}");
    let gone = whole("[[remove]]\nwhere = { x = [0.0, 1.5] }");
    let left = built(&gone).model().volumes()[0];
    assert!((left + volume - 24.0).abs() < 1e-12, "{left} {volume}");
}

/// The base carries what is there, before and after an excavation of joined cells.
#[test]
fn base_carries_the_weight_of_the_blocks_that_are_left() {
    for body in ["deformable", "rigid"] {
        base_carries_what_is_left(body);
    }
}

fn base_carries_what_is_left(body: &str) {
    let text = whole("[[remove]]\nwhere = { x = [1.0, 2.0] }\nfrom = 'dig'")
        .replace("[materials.granite]", "[model]\ngravity = [0, 0, -10]\n[materials.granite]")
        .replace("axes = 'xyz'", "axes = 'xyz'\n[[fix]]\nwhere = { y = 3.0 }\naxes = 'xyz'")
        .replace("material = 'granite'\n", &format!("material = 'granite'\nbody = '{body}'\n"));
    let mut simulation = Simulation::new(built(&text).model());
    for stage in 0..2 {
        simulation.enter(stage).unwrap();
        simulation.relax(1e-9, 100_000).unwrap();
        let model = simulation.model();
        let left = (0..model.n_blocks()).filter(|&block| !model.is_removed(block));
        let volume: f64 = left.map(|block| model.volume(block)).sum();
        let all: Vec<u32> = (0..model.n_nodes() as u32).collect();
        let reaction = simulation.reaction(&all)[2];
        assert!((reaction / (volume * 27e3) - 1.0).abs() < 1e-8, "{reaction} {volume}");
        assert_eq!(volume < 23.9, stage == 1);
        let field = simulation.displacements();
        for group in simulation.model().geometry().tied() {
            // Parts of a rigid body have one pose, but arms that are rounded.
            let most = if body == "rigid" { 1e-20 } else { 0.0 };
            let [x, y, z] = field[group[0] as usize];
            let away = |&node: &u32| {
                let [a, b, c] = field[node as usize];
                (a - x).abs().max((b - y).abs()).max((c - z).abs())
            };
            let far = group.iter().map(away).fold(0.0, f64::max);
            assert!(far <= most, "{far:e}");
        }
    }
}

/// Material and joints change with a stage, by place, and change back.
#[test]
fn assigned_materials_and_joints_follow_the_stages() {
    let more = "
[joints.weak]
normal_stiffness = 20e9
shear_stiffness = 8e9
cohesion = 1e6
friction = 10.0
[[assign]]
material = 'soil'
where = { x = [0.0, 1.5] }
from = 'dig'
until = 'fill'
[[assign]]
joint = 'weak'
where = { dip = 60, dip_direction = 90 }
from = 'dig'
until = 'fill'
[[stage]]
name = 'fill'
kind = 'relax'
";
    let text = whole(more)
        .replace("[materials.granite]", "[model]\ngravity = [0, 0, -10]\n[materials.granite]")
        .replace(
            "shear_stiffness = 8e9\n[joints.major]",
            "shear_stiffness = 8e9\ncohesion = 9e6\n[joints.major]",
        )
        .replace("axes = 'xyz'", "axes = 'xyz'\n[[fix]]\nwhere = { y = 3.0 }\naxes = 'xyz'");
    let mut simulation = Simulation::new(built(&text).model());
    let names = ["major", "minor", "weak"];
    for (stage, softened) in [(0, false), (1, true), (2, false)] {
        simulation.enter(stage).unwrap();
        simulation.relax(1e-9, 100_000).unwrap();
        let model = simulation.model();
        let soil: Vec<usize> = (0..model.n_blocks()).filter(|&b| model.material(b) == 1).collect();
        assert_eq!(!soil.is_empty(), softened);
        let volume: f64 = soil.iter().map(|&block| model.volume(block)).sum();
        let weight = 10.0 * (24.0 * 2700.0 - volume * 700.0);
        let all: Vec<u32> = (0..model.n_nodes() as u32).collect();
        let reaction = simulation.reaction(&all)[2];
        assert!((reaction / weight - 1.0).abs() < 1e-8, "{stage}: {reaction} {weight}");
        // Of the two cuts with joints one has weak ones.
        let model = simulation.model();
        let of = |number: &u16| names[usize::from(*number)];
        let mut found: Vec<&str> = model.joint_numbers().map(|number| of(&number)).collect();
        found.sort_unstable();
        found.dedup();
        let expected: &[&str] = if softened { &["minor", "weak"] } else { &["minor"] };
        assert_eq!(found, expected, "{stage}");
    }
    let mut found = messages(&text.replace("x = [0.0, 1.5]", "x = [3.99, 4.0]"));
    found.extend(messages(&text.replace("{ dip = 60", "{ dip = 20")));
    found.extend(messages(&text.replace(
        "[joints.weak]\nnormal_stiffness = 20e9",
        "[joints.weak]\nnormal_stiffness = 21e9",
    )));
    insta::assert_snapshot!(found.join("\n"));
}

/// Stiff springs hold the rock together if a cut ends on a plane that joins.
#[test]
fn joined_cells_hold_where_their_nodes_do_not_match() {
    let tunnel = "[[cut]]\njoin = true\ntunnel = { outline = [[-0.5, 0], [0.5, 0], [0.5, 0.6], [0, 0.9], \
                  [-0.5, 0.6]], from = [2, 0, 0.6], to = [2, 3, 0.6] }";
    let text = format!("{HEAD}{BOX}{tunnel}{REST}[[load]]\nwhere = {{ z = 2.0 }}\npressure = 1e6");
    let model = built(&text).model();
    assert_eq!(model.n_whole_blocks(), 1);
    assert!(model.geometry().joined().next().is_some());
    let mut simulation = Simulation::new(model);
    simulation.relax(1e-8, 100_000).unwrap();
    let all: Vec<u32> = (0..simulation.model().n_nodes() as u32).collect();
    assert!((simulation.reaction(&all)[2] / 12e6 - 1.0).abs() < 1e-6);
    assert_eq!(simulation.fragments().len(), 1);
}

/// A rigid tetrahedron with edges of 1 m along the axes, `ρ = 1200 kg/m³`: 200 kg, and about its centre
/// of mass `∫ (y² + z²) ρ dV = 200 (1/5 − 1/8) = 15` and `−∫ x y ρ dV = −200 (1/20 − 1/16) = 2.5`.
/// It spins about the point (1/4, 1/4, 1/4), its centre of mass, and moves.
#[test]
fn rigid_cells_have_the_inertia_of_their_polyhedra() {
    let text = "[materials.light]\ndensity = 1200.0\nyoung = 1e9\npoisson = 0.25\n\
                [[region]]\nmaterial = 'light'\nbody = 'rigid'\n\
                faces = [[[0, 0, 0], [0, 1, 0], [1, 0, 0]], [[0, 0, 0], [1, 0, 0], [0, 0, 1]], \
                [[0, 0, 0], [0, 0, 1], [0, 1, 0]], [[1, 0, 0], [0, 1, 0], [0, 0, 1]]]\n\
                [[initial]]\nvelocity = [1.0, 2.0, -3.0]\nspin = [0.3, -0.2, 0.7]\ncentre = [0.25, 0.25, 0.25]\n\
                [[stage]]\nname = 'tumble'\nkind = 'dynamic'\nduration = 1.0\n";
    let mut simulation = Simulation::new(built(text).model());
    let (v, spin) = (Vec3::new(1.0, 2.0, -3.0), Vec3::new(0.3, -0.2, 0.7));
    let turning = Vec3::from([0, 1, 2].map(|k| 15.0 * spin[k] + 2.5 * (spin.sum() - spin[k])));
    let about = Vec3::repeat(0.25).cross(&(v * 200.0)) + turning;
    let energy = 100.0 * v.norm_squared() + 0.5 * turning.dot(&spin);
    let away = |found: [f64; 3], exact: Vec3| (Vec3::from(found) - exact).amax() / exact.amax();
    assert!(away(simulation.momentum(), v * 200.0) < 1e-14);
    assert!(away(simulation.angular_momentum(), about) < 1e-14);
    assert!((simulation.energy().kinetic / energy - 1.0).abs() < 1e-14);
    // It tumbles freely: nothing changes.
    simulation.enter(0).unwrap();
    simulation.start(Damping::None, TimeStep::Auto, None).unwrap();
    for _ in 0..2000 {
        simulation.step().unwrap();
    }
    assert!(away(simulation.momentum(), v * 200.0) < 1e-13);
    assert!(away(simulation.angular_momentum(), about) < 1e-12);
    assert!((simulation.energy().kinetic / energy - 1.0).abs() < 1e-8);
}

#[test]
fn entries_that_regions_do_not_have_yet() {
    let sections = [
        "[[refine]]\nfactor = 2\nwhere = { x = [0, 1] }",
        "[[charge]]\nmass = 1.0\nexplosive = { density = 1000.0, detonation_velocity = 4000.0, gamma = 3.0 }\nwhere = { x = [0, 1] }",
        "[[boundary]]\nkind = 'free-field'\nwhere = { x = 4.0 }",
        "[[load]]\nline = [0, 0, 1.0]\nwhere = { x = 0.0, z = 2.0 }",
    ];
    let mut found: Vec<String> = Vec::new();
    for section in sections {
        let messages = messages(&whole(section));
        assert!(!messages.is_empty(), "nothing is said about {section}");
        found.extend(messages);
    }
    insta::assert_snapshot!(found.join("\n"));
}

#[test]
fn wrong_geometries_of_regions() {
    let mut found = Vec::new();
    for more in [
        "[[remove]]\nwhere = { x = [3.9, 4.0] }",
        "[[remove]]\nwhere = { x = [0.0, 4.0] }",
        "[[assign]]\njoint = 'major'\nwhere = { x = [3.99, 4.0] }",
        "[[assign]]\nmaterial = 'soil'\nwhere = { x = [3.99, 4.0] }",
    ] {
        found.extend(messages(&whole(more)));
    }
    let stiffnesses = "normal_stiffness = 10e9\nshear_stiffness = 4e9";
    let thick = "thickness = 0.3\nmaterial = 'soil'";
    let text = whole("[[assign]]\njoint = 'major'").replace(stiffnesses, thick);
    found.extend(messages(&text));
    assert!(messages(&text.replace("0.3", "0.1")).is_empty());
    found.extend(messages(
        &whole("").replace("where = { z = 0.0 }", "where = { x = 2.2, z = 0.0 }"),
    ));
    insta::assert_snapshot!(found.join("\n"));
}

/// A tunnel through the cuts of the deck, which leaves the rock whole.
const TUNNEL: &str = "
[[cut]]
name = 'drift'
tunnel = { outline = [[-0.5, 0], [0.5, 0], [0.5, 0.6], [0, 0.9], [-0.5, 0.6]], from = [2, 0, 0.6], to = [2, 3, 0.6] }
join = true
";
/// Volume of that tunnel `[m³]`: a rectangle and a triangle, 3 m long.
const DRIFT: f64 = 3.0 * (0.6 + 0.15);

/// Deck whose plane cuts and tunnel have names.
fn named(more: &str) -> String {
    let cuts = CUTS.replacen("[[cut]]", "[[cut]]\nname = 'fault'", 1);
    format!("{HEAD}{BOX}{cuts}{TUNNEL}{REST}{more}")
}

#[test]
fn the_inside_of_a_tunnel_has_its_volume() {
    let dug = named("[[remove]]\nwhere = { inside = 'drift' }\nfrom = 'dig'");
    let mut simulation = Simulation::new(built(&dug).model());
    let left = |simulation: &Simulation| -> f64 {
        let model = simulation.model();
        let there = (0..model.n_blocks()).filter(|&block| !model.is_removed(block));
        there.map(|block| model.volume(block)).sum()
    };
    simulation.enter(0).unwrap();
    assert!((left(&simulation) - 24.0).abs() < 1e-12);
    simulation.enter(1).unwrap();
    assert!((left(&simulation) - (24.0 - DRIFT)).abs() < 1e-12);
    let never = built(&named("[[remove]]\nwhere = { inside = 'drift' }")).model();
    assert!((never.volumes()[0] - (24.0 - DRIFT)).abs() < 1e-12);
    let soft = built(&named("[[assign]]\nmaterial = 'soil'\nwhere = { inside = 'drift' }")).model();
    let soil = (0..soft.n_blocks()).filter(|&block| soft.material(block) == 1);
    assert!((soil.map(|block| soft.volume(block)).sum::<f64>() - DRIFT).abs() < 1e-12);
}

/// A deck of a program has no surface of the tunnel in it; a shaft counts its outline from the north.
#[test]
fn tunnels_are_known_by_name_without_files() {
    let text = named("[[remove]]\nwhere = { inside = 'drift' }")
        .replace("from = [2, 0, 0.6], to = [2, 3, 0.6]", "from = [2, 1.2, 0], to = [2, 1.2, 2]")
        .replace("material = 'granite'\n\n", "material = 'granite'\nnorth = [1, 0, 0]\n\n");
    let mut read = deck(&text);
    let left = 24.0 - 2.0 * DRIFT / 3.0;
    assert!((BuiltDeck::new(&read).unwrap().model().volumes()[0] - left).abs() < 1e-12);
    read.remove[0].r#where.inside = Some(ddem_deck::FileOf::new("drift"));
    assert!((BuiltDeck::new(&read).unwrap().model().volumes()[0] - left).abs() < 1e-12);
    read.cut.last_mut().unwrap().r#where.inside = Some(ddem_deck::FileOf::new("drift"));
    assert!(read.cut_regions().unwrap().properties.len() > 4);
}

#[test]
fn the_name_of_a_cut_selects_its_joints() {
    let area = |text: &str| {
        let model = built(text).model();
        let joints = model.geometry().joined().filter(|joint| joint.joint == 0);
        joints.map(|joint| joint.area).sum::<f64>()
    };
    let text = named("[[assign]]\njoint = 'major'\nwhere = { cut = 'fault' }");
    let rock = deck(&text).cut_regions().unwrap();
    let of_fault = |face: &&ddem_cut::CommonFace| {
        let plane = &rock.complex.planes()[face.plane as usize];
        plane.source == ddem_cut::PlaneSource::Cut(0)
    };
    let face = |common: &ddem_cut::CommonFace| {
        let cell = &rock.complex.cells()[common.cells[0] as usize];
        cell.faces[common.faces[0] as usize].area(rock.complex.points()).norm()
    };
    // A plane of 3 m by 2 m that dips at 60°.
    let exact = 6.0 / 60_f64.to_radians().sin();
    let all: f64 = rock.common.iter().filter(of_fault).map(face).sum();
    assert!((all - exact).abs() < 1e-12 * exact, "{all} {exact}");
    assert!((area(&text) - exact).abs() < 1e-12 * exact, "{}", area(&text));
    let part = area(&text.replace("cut = 'fault'", "cut = 'fault', z = [1, 2]"));
    assert!(part > 0.0 && part < 0.9 * exact, "{part}");
}

#[test]
fn wrong_names_of_cuts() {
    let mut found = Vec::new();
    for (section, region) in [
        ("assign]]\njoint = 'major'", "cut = 'fualt'"),
        ("assign]]\njoint = 'major'", "cut = 'drift'"),
        ("assign]]\njoint = 'major'\nmaterial = 'soil'", "cut = 'fault'"),
        ("remove]]", "cut = 'fault'"),
        ("remove]]", "inside = 'drfit'"),
        ("remove]]", "inside = 'fault'"),
        ("remove]]", "inside = 'elsewhere'"),
    ] {
        found.extend(messages(&named(&format!("[[{section}\nwhere = {{ {region} }}"))));
    }
    found.extend(messages(&whole("[[remove]]\nwhere = { inside = 'drift' }")));
    let unnamed = named("[[assign]]\njoint = 'major'\nwhere = { cut = 'fault' }");
    let unnamed = unnamed.replace("name = 'fault'\n", "").replace("name = 'drift'\n", "");
    found.extend(messages(&unnamed));
    let shaft = named("[[remove]]\nwhere = { inside = 'drift' }")
        .replace("from = [2, 0, 0.6], to = [2, 3, 0.6]", "from = [2, 1.2, 0], to = [2, 1.2, 2]");
    let other = "[[region]]\nnorth = [1, 0, 0]\nbox = { from = [9, 0, 0], to = [10, 1, 1] }\nmaterial = 'soil'\n";
    found.extend(messages(&shaft.replacen("[[cut]]", &format!("{other}[[cut]]"), 1)));
    let broken = named("[[remove]]\nwhere = { inside = 'drift' }").replace("[0.5, 0], ", "");
    found.extend(messages(&broken.replace("[0.5, 0.6], [0, 0.9], [-0.5, 0.6]", "[0, 0]")));
    insta::assert_snapshot!(found.join("\n"));
}
