//! Loads on the free parts of faces of cells, and motions that cells are given.

use ddem_core::Simulation;
use ddem_core::problem::Vec3;

use crate::rock_decks::built;

/// Square tunnel of 2 m through a box of rock, or 2 m into it, and loads in it. Cells beside the tunnel have
/// faces that reach beyond it.
fn tunnel(end: f64, joints: &str, loads: &str) -> String {
    let roller =
        |axis: &str, at: f64| format!("[[fix]]\nwhere = {{ {axis} = {at:?} }}\naxes = '{axis}'\n");
    let sides = [("x", 0.0), ("x", 10.0), ("y", 0.0), ("y", 4.0), ("z", 0.0), ("z", 10.0)];
    let rollers: String = sides.iter().map(|&(axis, at)| roller(axis, at)).collect();
    format!(
        "[materials.granite]
        density = 2500.0
        young = 20e9
        poisson = 0.25
        [joints.bed]
        normal_stiffness = 20e9
        shear_stiffness = 8e9
        [[region]]
        name = 'rock'
        box = {{ from = [0, 0, 0], to = [10, 4, 10] }}
        material = 'granite'
        {joints}
        [[cut]]
        name = 'heading'
        tunnel = {{ outline = [[-1, -1], [1, -1], [1, 1], [-1, 1]], from = [5, 0, 5], to = [5, {end}, 5] }}
        join = true
        [[initial]]
        stress = [-2e6, -2e6, -2e6, 0, 0, 0]
        [[remove]]
        where = {{ inside = 'heading' }}
        from = 'dig'
        {rollers}
        {loads}
        [[stage]]
        name = 'rest'
        kind = 'relax'
        [[stage]]
        name = 'dig'
        kind = 'relax'
        "
    )
}

/// Two oblique joints through the rock around the tunnel.
const BEDS: &str = "
[[cut]]
plane = { dip = 35, dip_direction = 70, through = [4.7, 1.3, 5.4] }
joint = 'bed'
[[cut]]
plane = { dip = 75, dip_direction = 160, through = [5.2, 2.1, 4.8] }
joint = 'bed'
";

fn pressure(selection: &str) -> String {
    format!("[[load]]\nwhere = {{ {selection} }}\npressure = 2e6\nfrom = 'dig'\n")
}

/// Resultant of each load of a deck `[N]`, and its moment about the middle of the tunnel `[N m]`.
fn resultants(deck: &str) -> Vec<[Vec3; 2]> {
    let model = built(deck).model();
    let of = |forces: &[(u32, Vec3)]| {
        let moment = |(node, force): &(u32, Vec3)| {
            let arm = Vec3::from(model.point(*node as usize)) - Vec3::new(5.0, 2.0, 5.0);
            arm.cross(force)
        };
        [forces.iter().map(|(_, force)| force).sum(), forces.iter().map(moment).sum()]
    };
    model.conditions().loaded.iter().map(|load| of(&load.forces)).collect()
}

#[test]
fn pressure_acts_on_the_free_parts_of_faces() {
    let walls = [
        ("x = 4.0", -Vec3::x()),
        ("x = 6.0", Vec3::x()),
        ("z = 4.0", -Vec3::z()),
        ("z = 6.0", Vec3::z()),
    ];
    let loads: String = walls.iter().map(|(plane, _)| pressure(plane)).collect();
    for joints in ["", BEDS] {
        let found =
            resultants(&tunnel(4.0, joints, &(loads.clone() + &pressure("inside = 'heading'"))));
        // Each wall has 8 m², and the forces pass through its middle.
        for ((plane, along), [force, moment]) in walls.iter().zip(&found) {
            assert!((force - along * 16e6).norm() < 1e-3, "{plane}: {force}");
            assert!(moment.norm() < 1e-2, "{plane}: {moment}");
        }
        let [force, moment] = found[4];
        assert!(force.norm() < 1e-3 && moment.norm() < 1e-2, "{force} {moment}");
    }
    // The end of a heading.
    let [force, _] = resultants(&tunnel(2.0, BEDS, &pressure("y = 2.0")))[0];
    assert!((force - Vec3::y() * 8e6).norm() < 1e-3, "{force}");
}

/// A pressure as large as the stress in the rock replaces the excavated rock.
#[test]
fn pressure_on_walls_replaces_excavated_rock() {
    for joints in ["", BEDS] {
        let deck = tunnel(4.0, joints, &pressure("inside = 'heading'"));
        let mut simulation = Simulation::new(built(&deck).model());
        for stage in 0..2 {
            simulation.enter(stage).unwrap();
            simulation.relax(1e-6, 10_000).unwrap();
        }
        let n = simulation.model().n_nodes();
        let most =
            (0..n).map(|node| Vec3::from(simulation.displacement(node)).norm()).fold(0.0, f64::max);
        // The rock has a strain of 5e-5 under this pressure.
        assert!(most < 1e-12, "{most} m");
    }
}

/// Warnings about a boundary on a part of the rock around a tunnel that ends 2 m or 4 m into the rock.
fn boundary_warnings(end: f64, change: impl Fn(&str) -> String, selection: &str) -> Vec<String> {
    let entry =
        format!("[[boundary]]\nwhere = {{ {selection} }}\nkind = 'viscous'\nfrom = 'dig'\n");
    let built = built(&change(&tunnel(end, "", &entry)));
    built.warnings(&built.model()).iter().map(ToString::to_string).collect()
}

/// Boundaries on walls of tunnels are mistakes, as in sets of blocks, whenever the cells there were removed.
#[test]
fn boundaries_on_walls_of_tunnels_give_a_warning() {
    let in_stage = str::to_owned;
    let at_start = |text: &str| {
        text.replace(
            "where = { inside = 'heading' }\n        from = 'dig'",
            "where = { inside = 'heading' }",
        )
    };
    let in_cavities = |found: Vec<String>| -> Vec<String> {
        found.into_iter().filter(|warning| warning.contains("walls-in-boundary")).collect()
    };
    let mut found = Vec::new();
    for end in [2.0, 4.0] {
        let dug = in_cavities(boundary_warnings(end, in_stage, "inside = 'heading'"));
        assert_eq!(dug, in_cavities(boundary_warnings(end, at_start, "inside = 'heading'")));
        found.extend(dug);
        found.extend(in_cavities(boundary_warnings(end, in_stage, "x = [0.0, 4.0]")));
        let outside = boundary_warnings(end, in_stage, "x = 0.0");
        assert_eq!(in_cavities(outside), [""; 0]);
    }
    insta::assert_snapshot!(found.join("\n"));
}

/// Rigid cube of 1 m with eight parts.
const CUBE: &str = "
[materials.rock]
density = 2500.0
young = 10e9
poisson = 0.25
[[region]]
box = { from = [1, 2, 3], to = [2, 3, 4] }
material = 'rock'
body = 'rigid'
[[stage]]
name = 'fly'
kind = 'dynamic'
duration = 1e-3
";

/// The nearest rigid motion to a linear field of a cube is its value at the centre and half of its curl.
#[test]
fn rigid_cells_take_the_nearest_motion_of_all_their_nodes() {
    let mut simulation = Simulation::new(built(CUBE).model());
    let points: Vec<Vec3> = (0..simulation.model().n_nodes())
        .map(|node| simulation.model().point(node).into())
        .collect();
    let centre = Vec3::new(1.5, 2.5, 3.5);
    let gradient = nalgebra::Matrix3::new(0.1, 0.4, -0.2, 0.0, 0.3, 0.5, 0.7, -0.1, 0.2);
    let mean = Vec3::new(1.0, -2.0, 0.5);
    let field = |x: &Vec3| <[f64; 3]>::from(mean + gradient * (x - centre));
    simulation.set_velocities(&points.iter().map(field).collect::<Vec<_>>());
    let curl = gradient - gradient.transpose();
    let spin = Vec3::new(curl.m32, curl.m13, curl.m21) / 2.0;
    let momentum = Vec3::from(simulation.momentum());
    assert!((momentum - mean * 2500.0).norm() < 1e-9, "{momentum}");
    let energy = 0.5 * 2500.0 * (mean.norm_squared() + spin.norm_squared() / 6.0);
    let kinetic = simulation.energy().kinetic;
    assert!((kinetic / energy - 1.0).abs() < 1e-12, "{kinetic} {energy}");
    // A rigid motion stays as it is.
    let turn = nalgebra::Rotation3::from_scaled_axis(Vec3::new(0.4, -0.2, 0.9));
    let turned = |x: &Vec3| mean + turn * (x - centre) - (x - centre);
    let displacements: Vec<[f64; 3]> = points.iter().map(|x| turned(x).into()).collect();
    simulation.set_displacements(&displacements);
    for (node, exact) in displacements.iter().enumerate() {
        let off = Vec3::from(simulation.displacement(node)) - Vec3::from(*exact);
        assert!(off.norm() < 1e-14, "{node}: {off}");
    }
}
