//! Contact of cells, and the factor of safety of a wedge.

use ddem_deck::SafetySearch;

use super::contact_energy::free_energy;
use super::energy::closes;
use super::incline::{G, rate};
use super::record::Tolerance::{Absolute, Of, Relative};
use super::record::{Case, at_least, at_most, between, check, consistent, of};
use super::rotation::changes;
use super::shared::{Run, edited, example, run, simulation};

/// Decks of a region with deformable blocks of two and four divisions, and with rigid blocks.
pub(super) fn bodies(text: &str) -> [(&'static str, String); 3] {
    let with = |keys: &str| text.replace("divisions = 2", keys);
    [
        ("2 divisions", with("divisions = 2")),
        ("4 divisions", with("divisions = 4")),
        ("rigid", with("body = \"rigid\"")),
    ]
}

/// Checks that the block of a deck slides from its place with a slope of 40 degrees and a friction of 20.
pub(super) fn glides(case: Case) {
    let (slope, friction) = (40_f64.to_radians(), 20_f64.to_radians());
    let resisting = G * slope.cos() * friction.tan();
    let exact = G * slope.sin() - resisting;
    for (what, text) in bodies(&example(case.deck)) {
        let run = run(&text);
        let late = run.probes.series("block.x").into_iter().filter(|[time, _]| *time >= 0.1);
        let quantity = format!("acceleration, {what} [m/s²]");
        check(case, &quantity, exact, rate(late), Relative(2e-3));
        let distance = run.last("way.x");
        let off = run.last("way.z").abs().max(run.last("way.y").abs());
        let quantity = format!("off the plane, {what} [m]");
        check(case, &quantity, 0.0, off, Absolute(1e-3 * distance));
        let taken = *run.energy.column("friction").last().expect("a row");
        let mass = 2400.0 * (1.0 + 0.5 * friction.tan());
        let quantity = format!("taken by friction, {what} [J]");
        check(case, &quantity, mass * resisting * 0.5 * exact, taken, Relative(1e-2));
    }
}

#[test]
fn cell_slides_over_the_parts_of_another() {
    glides(of("cells_glide"));
}

#[test]
fn rebounding_cell_never_rises_higher() {
    let case = of("cells_toss");
    for (what, text) in bodies(&example(case.deck)) {
        let run = run(&text);
        let height = run.probes.column("block.z").iter().copied().fold(0.0, f64::max);
        let quantity = format!("height, {what} [m]");
        check(case, &quantity, 1.0 / (2.0 * G), height, Relative(0.005));
        let [most, first] = free_energy(&run);
        let quantity = format!("energy gained, {what} [part]");
        at_most(case, &quantity, 1e-9, most / first - 1.0);
    }
}

/// Checks that cells move like blocks of the same shapes and meshes, with the given keys of `[contact]`.
fn moves_like_blocks(case: Case, text: &str, how: &str) {
    let (from, to) = (text.find("[[region]]"), text.find("[[fix]]"));
    let (from, to) = (from.expect("regions"), to.expect("a support"));
    let plate = "[[blocks]]\nname = \"plate\"\norigin = [-1, 0, -0.5]\nsize = [2, 1, 0.5]\nmaterial = \"rock\"\n\
                 divisions = 2\n\n";
    let prism = "[[blocks]]\nname = \"prism\"\norigin = [0.3330127019, 0.25, 0.01]\nsize = [0.5, 0.5, 0.5]\n\
                axes = [[0.5, 0.0, 0.8660254038], [0.0, 1.0, 0.0], [-0.8660254038, 0.0, 0.5]]\n\
                material = \"rock\"\ndivisions = 2\n\n";
    let middle = text.find("[[region]]                         #").expect("the prism");
    let [of_plate, of_prism] = [&text[from..middle], &text[middle..to]];
    let made =
        |sets: [&str; 2]| run(&format!("{}{}{}{}", &text[..from], sets[0], sets[1], &text[to..]));
    let blocks = made([plate, prism]);
    for (what, cells) in [
        ("cells", made([of_plate, of_prism])),
        ("cell on a set", made([plate, of_prism])),
        ("set on a cell", made([of_plate, prism])),
    ] {
        // It has just left the plate.
        for axis in ["x", "z"] {
            let column = format!("prism.{axis}");
            let at = |run: &Run| {
                let series = run.probes.series(&column);
                series.into_iter().rev().find(|[time, _]| *time <= 0.05).expect("a row")[1]
            };
            let quantity = format!("{column} at 0.05 s, {what}{how}");
            consistent(case, &quantity, at(&blocks), at(&cells), Of(1.0, 2e-2));
        }
        closes(case, &format!(", {what}{how}"), &cells);
    }
}

#[test]
fn falling_prism_moves_like_a_block() {
    let case = of("cells_meet");
    let text = example(case.deck);
    moves_like_blocks(case, &text, "");
    moves_like_blocks(case, &edited(&text, "damping = 0.0\n", ""), ", damped");
}

#[test]
fn damping_of_cells_keeps_their_momentum() {
    let case = of("cells_meet");
    let text = edited(&example(case.deck), "damping = 0.0\n", "");
    let (fix, initial) = (text.find("[[fix]]"), text.find("[[initial]]"));
    let (fix, initial) = (fix.expect("a support"), initial.expect("a velocity"));
    let free = format!("{}{}", &text[..fix], &text[initial..]);
    let free = edited(&free, "gravity = [0.0, 0.0, -9.81]", "gravity = [0.0, 0.0, 0.0]");
    // The prism as two cells that are joined.
    let plane = "plane = { dip = 50, dip_direction = 30, through = [0.2, 0.5, 0.3] }";
    let joined =
        format!("[[cut]]\n{plane}\nwhere = {{ z = [0.01, 1.0] }}\njoin = true\n\n[[initial]]");
    let cut = free.replacen("[[initial]]", &joined, 1);
    for (what, text) in [("whole", free), ("of joined cells", cut)] {
        let [momentum, angular, ..] = changes(&text);
        at_most(case, &format!("change of momentum, {what} [part]"), 1e-9, momentum);
        at_most(case, &format!("change of angular momentum, {what} [part]"), 1e-9, angular);
        let run = run(&text);
        closes(case, &format!(", {what}"), &run);
        let damped = *run.energy.column("damping").last().expect("a row");
        at_least(case, &format!("taken by damping, {what} [J]"), 1.0, damped);
    }
}

#[test]
fn fracture_inside_a_block_closes() {
    let case = of("cells_slit");
    let run = run(&example(case.deck));
    between(case, "settlement of the top [m]", -run.last("top.z"), [0.04, 0.041]);
}

/// The cohesive wedge with other joints and a face of 65/185 (dip and dip direction), 30 m high: volume
/// 4584.0852 m³, areas 647.2497 and 626.1358 m², plunge 31.19651° of the line of intersection.
fn large_wedge(text: &str) -> String {
    let changes = [
        (
            "[[-25, -8], [2.911761874, -8], [-3.639702343, 10], [-25, 10]]",
            "[[-90, -24], [11.191383796, -24], [-13.989229745, 30], [-90, 30]]",
        ),
        ("from = -20, to = 20", "from = -80, to = 80"),
        ("[-0.913545457643, 0.406736643076, 0]", "[-0.996194698092, -0.087155742748, 0]"),
        ("dip = 40, dip_direction = 130", "dip = 45, dip_direction = 105"),
        ("dip = 60, dip_direction = 220", "dip = 70, dip_direction = 235"),
        ("cohesion = 20e3", "cohesion = 50e3"),
        ("z = -8.0", "z = -24.0"),
        ("x = -25.0", "x = -90.0"),
        ("y = -20.0", "y = -80.0"),
        ("y = 20.0", "y = 80.0"),
    ];
    changes.iter().fold(text.to_owned(), |text, (old, new)| edited(&text, old, new))
}

#[test]
fn wedge_has_the_factor_of_limit_equilibrium() {
    let case = of("cells_wedge");
    let text = example(case.deck);
    let cohesive = edited(
        &text,
        "friction = 45.0",
        "friction = 30.0\ncohesion = 20e3\nresidual_cohesion = 20e3",
    );
    let large = large_wedge(&cohesive);
    for (what, text, exact) in [
        ("friction", text, 1.519_047),
        ("cohesion", cohesive, 1.651_201),
        ("large wedge, cohesion", large, 2.486_595),
    ] {
        let four = edited(&text, "divisions = 2", "divisions = 4");
        let rigid = edited(&text, "divisions = 2", "body = \"rigid\"");
        for (body, text) in [("rigid", rigid), ("2 divisions", text), ("4 divisions", four)] {
            let mut simulation = simulation(&text);
            simulation.relax(1e-6, 20_000).expect("an equilibrium");
            let search = SafetySearch { bracket: [1.3, 3.5], ..SafetySearch::default() };
            let found = simulation.factor_of_safety(&search, &|_| {}).expect("a factor");
            let found = found.factor.expect("a factor within the bracket");
            let what = format!("factor of safety, {what}, {body}");
            check(case, &what, exact, found, Relative(5e-3));
        }
    }
}
