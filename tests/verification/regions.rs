//! Regions of rock that touch each other and sets of blocks.

use super::cells_contact::glides;
use super::incline::G;
use super::record::Tolerance::Relative;
use super::record::{check, of};
use super::shared::{edited, example, run, simulation};
use ddem_deck::SafetySearch;

#[test]
fn column_of_regions_and_a_set_shortens() {
    let case = of("regions_column");
    let text = example(case.deck);
    // Planes through one region only: the faces at the seams no longer match.
    let planes = "[[cut]]\nplane = { dip = 90, dip_direction = 80, through = [2, 2, 3] }\njoint = \"seam\"\n\
                  where = { z = [2, 4] }\n\n\
                  [[cut]]\nplane = { dip = 90, dip_direction = 30, through = [2, 2, 5] }\njoint = \"seam\"\n\
                  where = { z = [4, 6] }\n\n[[fix]]\nwhere = { z = 0.0 }";
    let cut = edited(&text, "[[fix]]\nwhere = { z = 0.0 }", planes);
    for (what, text, tolerance) in [("whole", text, 1e-9), ("cut", cut, 1e-8)] {
        let run = run(&text);
        let is = |quantity: &str, exact: f64, computed: f64, tolerance| {
            check(case, &format!("{quantity}, {what}"), exact, computed, tolerance);
        };
        is("settlement of the top [m]", 1.22e-3, -run.last("top.z"), Relative(tolerance));
        is("reaction of the base [N]", 16e6, run.last("base.z"), Relative(1e-8));
        let part = |column| *run.energy.column(column).last().expect("a row");
        let strain = part("strain_bodies") + part("strain_joints");
        is("strain energy [J]", 0.5 * 16e6 * 1.22e-3, strain, Relative(tolerance));
    }
}

#[test]
fn block_on_the_slope_of_another_region_has_its_factor() {
    let case = of("regions_slope");
    let text = example(case.deck);
    let (slope, friction) = (25_f64.to_radians(), 35_f64.to_radians());
    let of_friction = friction.tan() / slope.tan();
    let cohesion = 40e3 / (2.0 * 2500.0 * G * slope.sin());
    let cohesive = edited(
        &text,
        "friction = 35.0",
        "friction = 35.0\ncohesion = 20e3\nresidual_cohesion = 20e3",
    );
    // The base as a set of blocks: a box, turned by the slope.
    let (from, to) = (text.find("[[region]]"), text.find("[[region]]\nname = \"block\""));
    let (from, to) = (from.expect("the base"), to.expect("the block"));
    let set = "[[blocks]]\nname = \"base\"\norigin = [-0.4226182617, 0, 0.9589228449]\nsize = [4.4135116, 1, 1]\n\
               axes = [[0.9063077870, 0, -0.4226182617], [0, 1, 0], [0.4226182617, 0, 0.9063077870]]\n\
               count = [3, 1, 1]\njoint = \"seam\"\nmaterial = \"rock\"\ndivisions = 2\n\n";
    let on_set = format!("{}{set}{}", &text[..from], &text[to..]);
    let on_set = edited(&on_set, "where = { z = -1.0 }", "where = { set = \"base\" }");
    let rigid = |text: &str| text.replace("divisions = 2", "body = \"rigid\"");
    for (what, text, exact) in [
        ("friction, 2 divisions", text.clone(), of_friction),
        ("friction, rigid", rigid(&text), of_friction),
        ("cohesion, 2 divisions", cohesive.clone(), of_friction + cohesion),
        ("cohesion, rigid", rigid(&cohesive), of_friction + cohesion),
        ("on a set, 2 divisions", on_set.clone(), of_friction),
        ("on a set, rigid", rigid(&on_set), of_friction),
    ] {
        let mut simulation = simulation(&text);
        simulation.relax(1e-6, 20_000).expect("an equilibrium");
        let search =
            SafetySearch { bracket: [1.2, 4.0], resolution: 0.002, ..SafetySearch::default() };
        let found = simulation.factor_of_safety(&search, &|_| {}).expect("a factor");
        let found = found.factor.expect("a factor within the bracket");
        check(case, &format!("factor of safety, {what}"), exact, found, Relative(5e-3));
    }
}

#[test]
fn cell_slides_over_blocks_of_a_set() {
    glides(of("regions_glide"));
}
