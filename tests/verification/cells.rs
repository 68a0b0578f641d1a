//! Cells cut from a region: ties, hexahedra of any shape, and joints between matching faces.

use nalgebra::Vector3;

use super::cells_contact::bodies;
use super::energy::closes;
use super::incline::rate;
use super::record::Tolerance::{Absolute, Of, Relative};
use super::record::{at_most, between, check, consistent, of};
use super::shared::{Frames, edited, example, run, simulation};

const PRESSURE: f64 = 1e6;

/// Largest deviation of the stresses of all elements from some stress `[Pa]`.
fn deviation(frames: &Frames, exact: [f64; 6]) -> f64 {
    // The last of the frames, which have equal numbers of elements.
    let stresses = frames.all("CellData", "stress");
    let first = stresses.len() - stresses.len() / frames.times().len();
    let stresses: Vec<[f64; 6]> = stresses[first..].as_chunks().0.to_vec();
    assert!(!stresses.is_empty());
    let far = |stress: &[f64; 6]| {
        stress.iter().zip(exact).map(|(found, exact)| (found - exact).abs()).fold(0.0, f64::max)
    };
    stresses.iter().map(far).fold(0.0, f64::max)
}

#[test]
fn uniform_stress_passes_joints_and_ties_of_cells() {
    let case = of("cells_pressed");
    for divisions in [2, 4] {
        let text =
            edited(&example(case.deck), "divisions = 2", &format!("divisions = {divisions}"));
        for (what, text) in [
            ("spring joints", text.clone()),
            ("tied", edited(&text, "joint = \"seam\"", "join = true")),
        ] {
            let run = run(&text);
            let is = |quantity: &str, exact: f64, computed: f64, tolerance| {
                let quantity = format!("{quantity}, {what}, {divisions} divisions");
                check(case, &quantity, exact, computed, tolerance);
            };
            let frames = Frames::open(run.path("blocks.vtkhdf"));
            let stress = deviation(&frames, [0.0, 0.0, -PRESSURE, 0.0, 0.0, 0.0]);
            is("stress of any element, deviation [Pa]", 0.0, stress, Of(PRESSURE, 1e-7));
            is("reaction of the base [N]", 0.0, run.last("base.z"), Of(6e6, 1e-8));
            if what == "tied" {
                for (axis, exact) in [("x", 5e-5), ("y", 7.5e-5), ("z", -4e-4)] {
                    let found = run.last(&format!("corner.{axis}"));
                    is(&format!("u_{axis} of the corner [m]"), exact, found, Relative(1e-7));
                }
                let strain = *run.energy.column("strain_bodies").last().expect("a row");
                is("strain energy [J]", 1200.0, strain, Relative(1e-9));
            }
        }
    }
}

/// The pressed cells with six planes through one point: more than three edges meet at corners of cells,
/// which consist of pyramids.
fn crowded(text: &str) -> String {
    let more = "[[cut]]\nplane = { dip = 80, dip_direction = 60, through = [1, 1.4, 2.1] }\njoint = \"seam\"\n\n\
                [[cut]]\nplane = { dip = 55, dip_direction = 190, through = [1, 1.4, 2.1] }\njoint = \"seam\"\n\n\
                [[cut]]\nplane = { dip = 15, dip_direction = 300, through = [1, 1.4, 2.1] }\njoint = \"seam\"\n\n\
                [[fix]]\nwhere = { x = 0.0, y = 0.0";
    edited(text, "[[fix]]\nwhere = { x = 0.0, y = 0.0", more)
}

#[test]
fn uniform_stress_passes_cells_of_pyramids() {
    let case = of("cells_pressed");
    let text = crowded(&example(case.deck));
    let text = edited(&text, "tolerance = 3e-11", "tolerance = 2e-10");
    let in_place = format!(
        "[[initial]]\nstress = [0, 0, {:e}, 0, 0, 0]\n\n[[fix]]\nwhere = {{ x = 0.0, y = 0.0",
        -PRESSURE
    );
    let in_place = edited(&text, "[[fix]]\nwhere = { x = 0.0, y = 0.0", &in_place);
    for what in ["spring joints", "tied"] {
        let of = |text: &str| match what {
            "tied" => text.replace("joint = \"seam\"", "join = true"),
            _ => text.to_owned(),
        };
        let run = run(&of(&text));
        let stress = deviation(
            &Frames::open(run.path("blocks.vtkhdf")),
            [0.0, 0.0, -PRESSURE, 0.0, 0.0, 0.0],
        );
        let quantity = format!(
            "stress of any element with crowded corners, deviation, {what}, 2 divisions [Pa]"
        );
        check(case, &quantity, 0.0, stress, Of(PRESSURE, 1e-6));
        // With more divisions a relaxation takes minutes.
        for divisions in [2, 4, 6] {
            let divided = edited(&in_place, "divisions = 2", &format!("divisions = {divisions}"));
            let mut simulation = simulation(&of(&divided));
            let size = |force: &[f64; 3]| Vector3::from(*force).norm();
            let left = simulation.forces().iter().map(size).fold(0.0, f64::max);
            let most = simulation.internal_forces().iter().map(size).fold(0.0, f64::max);
            let quantity = format!(
                "force on any node / largest internal force, crowded corners, stress in place, {what}, \
                 {divisions} divisions"
            );
            check(case, &quantity, 0.0, left / most, Absolute(1e-9));
        }
    }
}

/// Forces of a linear field of displacements: zero inside, and those of a uniform stress outside.
#[test]
fn linear_field_is_exact_in_tied_cells() {
    let case = of("cells_pressed");
    let plain = example(case.deck);
    let decks = [("", plain.clone()), (", crowded corners", crowded(&plain))];
    for ((of, text), divisions) in decks.iter().flat_map(|deck| [2, 4].map(|n| (deck, n))) {
        let text = text.replace("joint = \"seam\"", "join = true");
        let text = edited(&text, "divisions = 2", &format!("divisions = {divisions}"));
        let text = edited(&text, "pressure = 1e6", "pressure = 0.0");
        let mut simulation = simulation(&text);
        let nodes: Vec<Vector3<f64>> =
            (0..simulation.model().n_nodes()).map(|n| simulation.model().point(n).into()).collect();
        let gradient =
            nalgebra::Matrix3::new(3e-5, -2e-5, 1e-5, 4e-5, 1e-5, -3e-5, 2e-5, 5e-5, -4e-5);
        let field: Vec<[f64; 3]> = nodes.iter().map(|x| (gradient * x).into()).collect();
        simulation.set_displacements(&field);
        let forces = simulation.internal_forces();
        let inner =
            |x: &Vector3<f64>| (0..3).all(|d| x[d] > 1e-9 && x[d] < [2.0, 3.0, 4.0][d] - 1e-9);
        let size = |force: &[f64; 3]| Vector3::from(*force).norm();
        let most = forces.iter().map(size).fold(0.0, f64::max);
        let inside = nodes.iter().zip(&forces).filter(|(x, _)| inner(x));
        let left = inside.map(|(_, force)| size(force)).fold(0.0, f64::max);
        let what = format!("force inside / largest force, {divisions} divisions{of}");
        check(case, &what, 0.0, left / most, Absolute(1e-12));
        let strain = (gradient + gradient.transpose()) / 2.0;
        let (lambda, shear) = (4e9, 4e9);
        let exact =
            nalgebra::Matrix3::identity() * (lambda * strain.trace()) + strain * (2.0 * shear);
        let exact = [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0)].map(|at| exact[at]);
        let far = |stress: &[f64; 6]| {
            stress.iter().zip(exact).map(|(found, exact)| (found - exact).abs()).fold(0.0, f64::max)
        };
        let far = simulation.stresses().iter().map(far).fold(0.0, f64::max);
        let size = exact.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
        let what = format!("stress of a linear field, deviation [Pa], {divisions} divisions{of}");
        check(case, &what, 0.0, far, Of(size, 1e-11));
    }
}

/// The joints, the elements and the weight of the nodes carry a stress in place to rounding.
#[test]
fn stress_in_place_balances_weight() {
    let case = of("cells_in_place");
    // Cuts that end at another joint: the faces on its sides do not match.
    let ends = "[[cut]]\nplane = { dip = 85, dip_direction = 20, through = [0.9, 1.4, 2] }\njoint = \"seam\"\n\
                where = { z = [2, 4] }\n\n[[fix]]\nwhere = { z = 0.0 }";
    let ends = edited(&example(case.deck), "[[fix]]\nwhere = { z = 0.0 }", ends);
    let load = "[[load]]\nwhere = { z = 4.0 }\ntraction = [0, 0, -104e3]\n\n[[stage]]";
    let uniform = edited(
        &edited(&ends, "gravity = [0.0, 0.0, -10.0]", "gravity = [0, 0, 0]"),
        "[[stage]]",
        load,
    );
    let uniform = edited(&uniform, "gradient = { z = [13e3, 13e3, 26e3, 0, 0, 0] }", "#");
    for (what, text) in [("", example(case.deck)), (", T faces", uniform)] {
        let mut simulation = simulation(&text);
        let geometry = simulation.model().geometry();
        let differ = |joint: &ddem_core::problem::NonconformingJoint| {
            let areas = joint.sides().map(|side| side.area(geometry));
            (areas[0] - areas[1]).abs() > 0.01 * areas[0]
        };
        assert_eq!(geometry.joined().any(differ), !what.is_empty());
        let size = |force: &[f64; 3]| Vector3::from(*force).norm();
        let left = simulation.forces().iter().map(size).fold(0.0, f64::max);
        let most = simulation.internal_forces().iter().map(size).fold(0.0, f64::max);
        let what = format!("force on any node / largest internal force{what}");
        check(case, &what, 0.0, left / most, Absolute(1e-9));
    }
    let rigid = edited(&example(case.deck), "divisions = 4", "body = \"rigid\"");
    for (body, text) in [("", example(case.deck)), (", rigid", rigid)] {
        let run = run(&text);
        let weight = 2600.0 * 10.0 * 24.0;
        let quantity = format!("reaction of the base{body} [N]");
        check(case, &quantity, weight, run.last("base.z"), Relative(1e-10));
        let kinetic = run.energy.column("kinetic").into_iter().fold(0.0, f64::max);
        at_most(case, &format!("kinetic energy{body} [J]"), 1e-15, kinetic);
    }
}

#[test]
fn wedge_slides_on_steep_joint_and_stays_on_rough_one() {
    let case = of("cells_slide");
    let (slope, g) = (40_f64.to_radians(), 9.81);
    for (body, text) in bodies(&example(case.deck)) {
        let run = run(&text);
        let exact = g * (slope.sin() - slope.cos() * 20_f64.to_radians().tan());
        for (axis, exact) in [("x", exact * slope.cos()), ("z", -exact * slope.sin())] {
            let velocities = run.probes.series(&format!("wedge.{axis}"));
            let late = velocities.into_iter().filter(|[time, _]| *time >= 0.02);
            let what = format!("acceleration along {axis} [m/s²], {body}");
            check(case, &what, exact, rate(late), Relative(5e-3));
        }
        closes(case, &format!(", {body}"), &run);
    }
    // A force that ends at once would make it rock.
    let text = edited(&example(case.deck), "friction = 20.0", "friction = 50.0");
    let text = edited(&text, "force = [-23186.36, 0.0, 19455.67]", "force = [0.0, 0.0, 1e-3]");
    let [(_, deformable), _, (_, rigid)] = bodies(&text);
    for (body, text) in [("", deformable), (", rigid", rigid)] {
        let run = run(&text);
        let column = |name: &str| run.probes.column(name).into_iter();
        let both = column("way.x").chain(column("way.z"));
        let most = both.fold(0.0, |most: f64, x| most.max(x.abs()));
        at_most(case, &format!("largest displacement with 50 degrees{body} [m]"), 1e-5, most);
    }
}

#[test]
fn cells_that_are_cubes_equal_blocks() {
    let case = of("cells_blocks");
    let text = example(case.deck);
    let from = text.find("[[region]]").expect("a region");
    let to = text.find("[[fix]]").expect("a support");
    let set = "[[blocks]]\nsize = [2, 3, 2]\ncount = [2, 3, 2]\nmaterial = \"rock\"\ndivisions = 4\n\
               joint = \"seam\"\n\n";
    let blocks = format!("{}{set}{}", &text[..from], &text[to..]);
    let blocks = edited(&blocks, "[model]\n", "[model]\ncontact = false\n");
    let [cells, blocks] = [text, blocks].map(|text| run(&text));
    let columns = ["corner", "inside", "top", "base"];
    for column in
        columns.iter().flat_map(|name| ["x", "y", "z"].map(|axis| format!("{name}.{axis}")))
    {
        let largest = |run: &super::shared::Run| {
            run.probes.column(&column).into_iter().fold(0.0, |most: f64, x| most.max(x.abs()))
        };
        let size = largest(&blocks);
        consistent(
            case,
            &format!("{column} at the end"),
            blocks.last(&column),
            cells.last(&column),
            Of(size, 1e-7),
        );
    }
}

#[test]
fn cantilever_of_joined_cells_bends() {
    let case = of("cells_cantilever");
    let exact = 5e-3 + 1e5 * 5.0 / (10.0 * 1.25 / (12.0 + 11.0 * 0.25) * 4e9);
    for (kind, least) in [("incompatible", 0.94), ("standard", 0.91)] {
        let element = format!("element = \"{kind}\"");
        let run = run(&edited(&example(case.deck), "element = \"incompatible\"", &element));
        let bent = -run.last("end.z") / exact;
        between(case, &format!("deflection / Timoshenko's, {kind}"), bent, [least, 1.0]);
        check(
            case,
            &format!("reaction of the wall [N], {kind}"),
            1e5,
            run.last("wall.z"),
            Relative(1e-6),
        );
    }
}

/// A rotation by one radian, of tied parts and of parts with joints between them.
#[test]
fn rotation_of_cells_gives_no_force() {
    let case = of("cells_pressed");
    let text =
        edited(&example(case.deck), "kinematics = \"small\"", "kinematics = \"corotational\"");
    let text = edited(&text, "pressure = 1e6", "pressure = 0.0");
    for (what, text) in [
        ("spring joints", text.clone()),
        ("tied", edited(&text, "joint = \"seam\"", "join = true")),
    ] {
        let mut simulation = simulation(&text);
        let turn = nalgebra::Rotation3::new(Vector3::new(0.6, -0.48, 0.64));
        let nodes = 0..simulation.model().n_nodes();
        let field = nodes.map(|node| {
            let x = Vector3::from(simulation.model().point(node));
            (turn * x - x).into()
        });
        let field: Vec<[f64; 3]> = field.collect();
        simulation.set_displacements(&field);
        let size = |force: &[f64; 3]| Vector3::from(*force).norm();
        let most = simulation.forces().iter().map(size).fold(0.0, f64::max);
        // The stiffness of the elements is E times their size, about 1 m.
        let what = format!("force on any node after a rotation by 1 rad [N], {what}");
        check(case, &what, 0.0, most, Of(10e9, 1e-13));
    }
}

/// Points of faces that are no parallelograms carry the stress if a cut has ended on a face. The joint
/// on that cut is parallel to the pressure: under another stress it would open or slide, and the cell
/// on the other side could not follow.
#[test]
fn uniform_stress_passes_faces_that_do_not_match() {
    let case = of("cells_pressed");
    let plane = "plane = { dip = 70, dip_direction = 250, through = [0.9, 1.7, 2.2] }\n";
    let upright = "plane = { dip = 90, dip_direction = 250, through = [0.9, 1.7, 2.2] }\n\
                   where = { z = [2.0, 4.0] }\n";
    let text = edited(&example(case.deck), plane, upright);
    for divisions in [2, 4] {
        let text = edited(&text, "divisions = 2", &format!("divisions = {divisions}"));
        let run = run(&text);
        let frames = Frames::open(run.path("blocks.vtkhdf"));
        let stress = deviation(&frames, [0.0, 0.0, -PRESSURE, 0.0, 0.0, 0.0]);
        let quantity = format!("stress deviation [Pa], faces in part, {divisions} divisions");
        check(case, &quantity, 0.0, stress, Of(PRESSURE, 1e-6));
    }
}
