//! Errors in an otherwise good deck; the messages are in `snapshots/`.

use super::{GOOD, report};

/// Good deck with one text replaced.
fn change(from: &str, to: &str) -> String {
    assert!(GOOD.contains(from), "{from} is not in the good deck");
    GOOD.replacen(from, to, 1)
}

macro_rules! bad_decks {
    ($($name:ident: $($from:literal => $to:literal),+;)+) => {
        $(
            #[test]
            fn $name() {
                let mut deck = GOOD.to_owned();
                $(
                    assert!(deck.contains($from), "{} is not in the good deck", $from);
                    deck = deck.replacen($from, $to, 1);
                )+
                let report = report(&deck);
                assert!(!report.is_empty(), "nothing is said about {}", stringify!($name));
                insta::assert_snapshot!(stringify!($name), report);
            }
        )+
    };
}

// No TOML, or no deck.
bad_decks! {
    syntax_text_without_quotes: "material = \"rock\"" => "material = rock";
    syntax_line_of_words: "density = 2400" => "density 2400";
    syntax_list_not_closed: "gravity = [0.0, 0.0, -9.81]" => "gravity = [0.0, 0.0, -9.81";
    syntax_key_twice: "density = 2400" => "density = 2400\ndensity = 2500";
    unknown_key: "density = 2400" => "denisty = 2400";
    unknown_key_inside_braces: "{ z = [1.9, 2.1] }" => "{ zz = [1.9, 2.1] }";
    unknown_key_by_normal: "{ x = \"spring\" }" => "{ w = \"spring\" }";
    unknown_section: "[[blocks]]" => "[[block]]";
    unknown_keys_all_at_once: "density = 2400" => "dnsity = 2400", "divisions = 4" => "divison = 4",
        "tolerance = 1e-6" => "tolerance = 1e-6\ntol = 1e-6", "axes = \"z\"" => "axes = 3";
    missing_key: "young = 18e9\n" => "";
    missing_key_inside_braces: ", radius = 0.2" => "";
    missing_where: "[[remove]]\nwhere = { sphere = { centre = [1.2, 1.2, 1.2], radius = 0.2 } }"
        => "[[remove]]";
    wrong_type_number: "density = 2400" => "density = \"2400 kg/m3\"";
    wrong_type_text: "material = \"soft rock\"\njoint" => "material = 7\njoint";
    wrong_type_truth: "contact = false" => "contact = \"no\"";
    wrong_type_table: "where = { z = 3.0 }" => "where = 3.0";
    wrong_type_single_brackets: "[[probe]]\nname = \"mid\"" => "[[stage]]\nname = \"x\"\nkind = 3\n[[probe]]\nname = \"mid\"";
    whole_number_wanted: "count = [12, 3, 3]" => "count = [12, 3.5, 3]";
    whole_number_negative: "count = [12, 3, 3]" => "count = [12, -3, 3]";
    too_few_numbers: "size = [12.0, 3.0, 3.0]" => "size = [12.0, 3.0]";
    too_few_lists: "axes = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]" => "axes = [[1, 0, 0], [0, 1, 0]]";
    unknown_choice: "kind = \"dynamic\"" => "kind = \"dynamics\"";
    extent_of_three: "z = [1.9, 2.1]" => "z = [1.9, 2.1, 2.3]";
    extent_of_text: "z = [1.9, 2.1]" => "z = \"top\"";
    joint_of_number: "joint = \"seam\"" => "joint = 5";
    time_step_of_text: "time_step = \"auto\"" => "time_step = \"automatic\"";
    damping_of_text: "damping = \"none\"" => "damping = \"no\"";
    names_with_escape_sequences: "density = 2400" => "\"\\u001b[31m\" = 2400";
    title_with_escape_sequences: "title = \"" => "title = \"\\u001b]0;",
        "name = \"mid\"" => "name = \"mi\\u0007d\"";
    numbers_beyond_all_quantities: "density = 2400" => "density = 1e300", "gravity = [0.0, 0.0, -9.81]" => "gravity = [0.0, 0.0, -1.1e30]",
        "size = [12.0, 3.0, 3.0]" => "size = [6e300, 3.0, 3.0]";
    damping_of_number: "damping = \"none\"" => "damping = 0.05";
    damping_unknown: "{ ratio = 0.05 }" => "{ ration = 0.05 }";
    damping_of_two: "{ ratio = 0.05 }" => "{ ratio = 0.05, mass = 2.0 }";
    damping_of_none: "{ ratio = 0.05 }" => "{ }";
    history_of_text: "{ ramp = 0.01 }" => "\"ramp\"";
    history_unknown: "{ ramp = 0.01 }" => "{ sine = 0.01 }";
    history_row_of_three: "[0.01, 1.0]]" => "[0.01, 1.0, 2.0]]";
    number_too_large: "max_steps = 200000" => "max_steps = 99999999999999999999999999";
}

// Impossible values.
bad_decks! {
    not_a_number: "density = 2400" => "density = nan";
    infinite_in_a_list: "-9.81]" => "-inf]";
    poisson_too_large: "poisson = 0.25" => "poisson = 0.5";
    density_negative_of_quoted_name: "density = 2200.0" => "density = -2200.0";
    joint_without_stiffness: "thickness = 0.01\nmaterial = \"rock\"" => "thickness = 0.01";
    joint_with_two_stiffnesses: "thickness = 0.01" => "thickness = 0.01\nyoung = 1e9";
    joint_with_half_a_spring: "thickness = 0.02\nmaterial = \"rock\"" => "normal_stiffness = 1e11";
    joint_spring_and_material: "shear_stiffness = 1e11"
        => "shear_stiffness = 1e11\nmaterial = \"rock\"";
    joint_spring_without_stiffness: "normal_stiffness = 2e11" => "normal_stiffness = 0";
    joint_without_thickness: "thickness = 0.01\n" => "";
    material_not_known: "material = \"rock\"\njoint" => "material = \"rokc\"\njoint";
    joint_not_known: "joint = \"seam\"" => "joint = \"steam\"";
    joint_by_normal_not_known: "{ x = \"spring\" }" => "{ x = \"sprong\" }";
    joint_needed: "joint = { x = \"spring\" }" => "";
    joint_needed_along_one_axis: "{ x = \"spring\" }" => "{ y = \"spring\" }";
    set_not_known: "set = \"beam\"" => "set = \"baem\"";
    set_twice: "name = \"foot\"" => "name = \"beam\"";
    stage_not_known: "from = \"shake\"" => "from = \"shape\"";
    until_before_from: "from = \"shake\"" => "from = \"shake\"\nuntil = \"load\"";
    until_first_stage: "until = \"shake\"" => "until = \"load\"";
    blocks_without_material: "material = \"rock\"\njoint" => "joint";
    blocks_without_size: "size = [12.0, 3.0, 3.0]\n" => "";
    blocks_too_many: "count = [12, 3, 3]" => "count = [12000, 3000, 3000]";
    count_of_zero: "count = [12, 3, 3]" => "count = [12, 0, 3]";
    edges_decrease: "x = [0, 1, 2.5]" => "x = [0, 2.5, 1]";
    edges_of_one: "x = [0, 1, 2.5]" => "x = [0]";
    edges_against_size: "name = \"foot\"" => "name = \"foot\"\nsize = [2.0, 3.0, 1.0]\ncount = [3, 1, 1]";
    axes_in_one_plane: "axes = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]"
        => "axes = [[1, 0, 0], [0, 1, 0], [1, 1, 0]]";
    axes_left_handed: "axes = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]"
        => "axes = [[0, 1, 0], [1, 0, 0], [0, 0, 1]]";
    range_turned_round: "z = [1.9, 2.1]" => "z = [2.1, 1.9]";
    plane_without_normal: "where = { z = 3.0 }" => "where = { plane = { point = [0, 0, 3] } }";
    plane_with_normal_of_zero: "where = { z = 3.0 }"
        => "where = { plane = { point = [0, 0, 3], normal = [0, 0, 0] } }";
    plane_too_steep: "where = { z = 3.0 }"
        => "where = { plane = { point = [0, 0, 3], dip = 91, dip_direction = 361 } }";
    above_text: "where = { z = 3.0 }" => "where = { above = \"top\" }";
    above_no_point: "where = { z = 3.0 }" => "where = { above = { normal = [0, 0, 1] } }";
    above_two_things: "where = { z = 3.0 }"
        => "where = { above = { point = [0, 0, 1], topography = \"hill.csv\" } }";
    file_not_there: "where = { z = 3.0 }" => "where = { inside = \"no such.stl\" }";
    side_of_two_sets: "where = { z = 3.0 }" => "where = { side = \"z+\" }";
    side_unknown: "where = { z = 3.0 }" => "where = { side = \"top\" }";
    dip_of_nodes: "where.x = 12.0" => "where = { dip = 40, within = 5 }";
    dip_direction_alone: "where = { z = [1.9, 2.1] }" => "where = { dip_direction = 40 }";
    dip_beside_axes: "axes = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]"
        => "axes = [[1, 0, 0], [0, 1, 0], [0, 1, 1]]\ndip = 30\ndip_direction = 90";
    planes_in_one_direction: "axes = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]"
        => "planes = { x = { dip = 90, dip_direction = 0 }, y = { dip = 90, dip_direction = 60 }, z = { dip = 90, dip_direction = 120 } }";
    sphere_of_zero: "radius = 0.2" => "radius = 0";
    assign_nothing: "joint = \"spring\"\n\n" => "\n";
    fix_wrong_letter: "axes = \"xyz\"" => "axes = \"xw\"";
    fix_letter_twice: "axes = \"xyz\"" => "axes = \"xyx\"";
    fix_velocity_of_free_axis: "velocity = [0.0, 0.0, -1e-3]" => "velocity = [1.0, 0.0, 0.0]";
    fix_history_without_velocity: "velocity = [0.0, 0.0, -1e-3]\n" => "";
    history_goes_back: "[0.01, 1.0]]" => "[0.0, 1.0]]";
    load_of_nothing: "pressure = 1e5" => "";
    load_of_two: "pressure = 1e5" => "pressure = 1e5\nforce = [1, 0, 0]";
    load_line_on_a_plane: "where = { x = 6.0, z = 3.0 }" => "where = { z = 3.0 }";
    initial_of_nothing: "velocity = [0.1, 0.0, 0.0]\nspin = [0.0, 0.0, 1.0]\n" => "";
    stage_of_the_other_kind: "increments = 1" => "increments = 1\nduration = 1.0";
    stage_without_duration: "duration = 1\n" => "";
    stage_twice: "name = \"ring\"" => "name = \"shake\"";
    stage_frames_twice: "frames = 20" => "frames = 20\nfields_every = 1e-3";
    damping_too_large: "{ ratio = 0.05 }" => "{ local = 1.0 }";
    probe_without_place: "at = [6.0, 1.5, 0.0]\n" => "";
    probe_in_two_places: "at = [6.0, 1.5, 0.0]" => "at = [6.0, 1.5, 0.0]\nwhere = { z = 0.0 }";
    probe_twice: "name = \"base\"" => "name = \"mid\"";
}

// Joints that fail.
bad_decks! {
    joint_cohesion_negative: "cohesion = 2e6" => "cohesion = -2e6";
    joint_tension_negative: "tension = 1e6" => "tension = -1e6";
    joint_friction_too_large: "friction = 40.0" => "friction = 90.0";
    joint_friction_negative: "friction = 40.0" => "friction = -40.0";
    joint_residual_friction_too_large: "residual_friction = 30.0" => "residual_friction = 95.0";
    joint_residual_friction_above_peak: "residual_friction = 30.0" => "residual_friction = 40.5";
    joint_residual_cohesion_negative: "residual_cohesion = 1e5" => "residual_cohesion = -1e5";
    joint_residual_cohesion_above_peak: "residual_cohesion = 1e5" => "residual_cohesion = 2.1e6";
    joint_residual_above_nothing: "cohesion = 2e6\n" => "";
    joint_dilation_negative: "dilation = 5.0" => "dilation = -5.0";
    joint_dilation_above_friction: "dilation = 5.0" => "dilation = 41.0";
    joint_energy_negative: "[50.0, 200.0]" => "[-50.0, 200.0]";
    joint_energy_of_one: "[50.0, 200.0]" => "[50.0]";
    joint_energy_too_small_in_opening: "[50.0, 200.0]" => "[0.2, 200.0]";
    joint_energy_too_small_in_sliding: "[50.0, 200.0]" => "[50.0, 2]";
    joint_energy_too_small_for_a_spring: "shear_stiffness = 1e11"
        => "shear_stiffness = 1e11\ntension = 1e6\nfracture_energy = [1.0, 1.0]";
    joint_residual_without_strength: "thickness = 0.02"
        => "thickness = 0.02\nfracture_energy = [50.0, 200.0]";
    joint_strength_of_all_faults: "cohesion = 2e6" => "cohesion = 5e4",
        "friction = 40.0" => "friction = 95.0", "tension = 1e6" => "tension = -1.0",
        "dilation = 5.0" => "dilation = 97.0", "[50.0, 200.0]" => "[-1.0, -1.0]";
    joint_jrc_too_large: "jrc = 10.0" => "jrc = 21.0";
    joint_jrc_negative: "jrc = 10.0" => "jrc = -1.0";
    joint_jrc_without_jcs: "jcs = 80e6\n" => "";
    joint_jcs_without_jrc: "jrc = 10.0\n" => "";
    joint_jcs_of_zero: "jcs = 80e6" => "jcs = 0.0";
    joint_jrc_without_residual_friction: "residual_friction = 28.0\n" => "";
    joint_jrc_with_cohesion: "jrc = 10.0" => "jrc = 10.0\ncohesion = 1e5";
    joint_jrc_with_friction: "jrc = 10.0" => "jrc = 10.0\nfriction = 40.0";
    joint_jrc_with_residual_cohesion: "jrc = 10.0" => "jrc = 10.0\nresidual_cohesion = 0.0";
    joint_jrc_with_energy: "jrc = 10.0" => "jrc = 10.0\nfracture_energy = [50.0, 200.0]";
    joint_jrc_with_steep_dilation: "dilation = 4.0" => "dilation = 71.0";
    joint_jrc_with_steep_residual: "residual_friction = 28.0" => "residual_friction = 71.0";
}

// Contacts and rigid blocks.
bad_decks! {
    contact_unknown_key: "damping = 0.3" => "dampping = 0.3";
    contact_of_text: "[contact]\nnormal_stiffness = 3e10" => "[contact]\nnormal_stiffness = \"stiff\"";
    contact_of_all_faults: "normal_stiffness = 3e10" => "normal_stiffness = 0",
        "shear_stiffness = 1.5e10" => "shear_stiffness = -1", "friction = 25.0" => "friction = 90.0",
        "damping = 0.3" => "damping = 1.1\nrestitution = -0.5";
    contact_damped_twice: "damping = 0.3" => "damping = 0.3\nrestitution = 0.5";
    contact_in_two_brackets: "[contact]" => "[[contact]]";
    body_of_another_kind: "body = \"deformable\"" => "body = \"stiff\"";
    stress_of_a_rigid_set: "body = \"deformable\"" => "body = \"rigid\"",
        "at = [6.0, 1.5, 0.0]\nquantity = \"displacement\""
            => "where = { set = \"beam\" }\nquantity = \"stress\"";
    stress_of_rigid_blocks_only: "body = \"deformable\"" => "body = \"rigid\"",
        "name = \"foot\"" => "name = \"foot\"\nbody = \"rigid\"",
        "quantity = \"displacement\"" => "quantity = \"stress\"";
}

// Charges and boundaries.
bad_decks! {
    charge_of_nothing: "mass = 1.5\nexplosive = \"anfo\"" => "pressure = 1e6\nmass = 1.5";
    explosive_unknown: "\"anfo\"" => "\"anfoo\"";
    explosive_of_number: "\"anfo\"" => "850";
    history_of_a_charge: "history = \"gas\"" => "history = \"gases\"";
    triangle_of_nothing: ", duration = 1e-3 }" => " }";
    cylinder_without_end: ", to = [1.2, 1.2, 3.0]" => "";
    kind_of_a_boundary: "[[fix]]" => "[[boundary]]\nwhere = { x = 12.0 }\nkind = \"viscos\"\n\n[[fix]]";
    waves_of_a_boundary: "[[fix]]" => "[[boundary]]\nwhere = { x = 12.0 }\nkind = \"viscous\"\n\
            history = { ramp = 0.1 }\n\n[[boundary]]\nwhere = { x = 0.0 }\nkind = \"free-field\"\n\
            velocity = [0.1, 0.0, 0.0]\n\n[[fix]]";
}

// Initial stress and excavation.
bad_decks! {
    stress_of_five: "spin = [0.0, 0.0, 1.0]" => "spin = [0.0, 0.0, 1.0]\nstress = [-1e6, -1e6, -2e6, 0, 0]";
    gradient_without_stress: "spin = [0.0, 0.0, 1.0]"
            => "spin = [0.0, 0.0, 1.0]\ngradient = { z = [1e4, 1e4, 2e4, 0, 0, 0] }";
    gradient_along_w: "spin = [0.0, 0.0, 1.0]"
            => "stress = [0, 0, 0, 0, 0, 0]\nspin = [0.0, 0.0, 1.0]\n\
                gradient = { w = [1e4, 1e4, 2e4, 0, 0, 0] }";
    excavation_in_the_first_stage: "[[remove]]" => "[[remove]]\nfrom = \"load\"";
    excavation_in_no_stage: "[[remove]]" => "[[remove]]\nfrom = \"shaek\"";
    excavation_that_ends: "[[remove]]" => "[[remove]]\nfrom = \"shake\"\nuntil = \"ring\"";
    excavation_released_backwards: "[[remove]]" => "[[remove]]\nfrom = \"shake\"\nrelease = -0.1";
    excavation_released_at_the_start: "[[remove]]" => "[[remove]]\nrelease = 0.1";
    excavation_released_in_two_ways: "[[remove]]" => "[[remove]]\nfrom = \"shake\"\nrelease = 0.2\n\
            where = { x = 12.0 }\n\n[[remove]]\nfrom = \"shake\"\nrelease = 0.1";
}

#[test]
fn single_brackets() {
    let deck = "[stage]\nname = \"a\"\nkind = \"relax\"\n";
    insta::assert_snapshot!(report(deck));
}

#[test]
fn empty_deck() {
    insta::assert_snapshot!(report(""));
}

#[test]
fn material_without_a_name() {
    insta::assert_snapshot!(report("[materials]\ndensity = 2400\nyoung = 1e9\npoisson = 0.2\n"));
}

#[test]
fn one_line_per_fault() {
    let deck = change("density = 2400", "density = -1\nyuong = 3");
    let error = ddem_deck::parse(&deck, "deck.toml").expect_err("an unknown key");
    insta::assert_snapshot!(error);
    // A `main` that returns the error shows this text.
    assert_eq!(format!("{error:?}"), error.to_string());
}

/// The text is not shown: it would fill the screen, and the library that draws it panics from column
/// 65 536 on.
#[test]
fn mistakes_in_long_lines_are_named() {
    let rows = "[0, 0], ".repeat(20_000);
    let deck = change("[[0, 0], [0.01, 1.0]]", &format!("[{rows}[0, nan]]"));
    let (deck, source) = ddem_deck::parse(&deck, "deck.toml").expect("numbers");
    let error = source.check(&deck).expect_err("no number");
    let report = error.report(false);
    assert!(report.len() < 1000 && report.contains(&error.findings()[0].to_string()), "{report}");
}

#[test]
fn long_fault_lists_are_truncated() {
    let rows = "[0, nan], ".repeat(1000);
    let deck = change("[[0, 0], [0.01, 1.0]]", &format!("[{rows}]"));
    let (deck, source) = ddem_deck::parse(&deck, "deck.toml").expect("numbers");
    let error = source.check(&deck).expect_err("no numbers");
    assert_eq!(error.findings().len(), 1000);
    assert!(error.report(false).ends_with("… and 980 more\n"));
}

#[test]
fn missing_deck_file_is_refused() {
    let error = ddem_deck::read("no such deck.toml".as_ref()).expect_err("no file");
    let message = error.to_string();
    assert!(message.starts_with("cannot read the deck `no such deck.toml`: "), "{message}");
    assert!(message.ends_with("(a deck is a TOML file) [invalid-file]"), "{message}");
    assert!(error.findings().is_empty());
}

/// The block of a probe point is known only after the blocks are built.
#[test]
fn stress_probe_in_rigid_block_is_refused() {
    let deck = |probe: &str| {
        format!(
            "[materials.rock]\ndensity = 2400\nyoung = 18e9\npoisson = 0.25\n\
             [[blocks]]\nname = 'hard'\nbody = 'rigid'\nsize = [1, 1, 1]\nmaterial = 'rock'\n\
             [[blocks]]\nname = 'soft'\norigin = [0, 0, 2]\nsize = [1, 1, 1]\ndivisions = 1\n\
             material = 'rock'\n[[probe]]\nname = 'p'\nquantity = 'stress'\n{probe}\n"
        )
    };
    let built = |probe: &str| {
        let (deck, _) = ddem_deck::parse(&deck(probe), "deck.toml").expect("a deck");
        ddem_io::run::Session::new(&deck, ddem_core::Simd::default()).map(|_| ())
    };
    for probe in ["at = [0, 0, 0]", "where = { x = 0.0 }"] {
        let error = built(probe).expect_err("no stress");
        let start = "probe[0].quantity: block 0 is rigid: it has no stress (";
        assert!(error.to_string().starts_with(start), "{error}");
    }
    for probe in ["at = [0, 0, 3]", "where = { x = 0.0, set = 'soft' }"] {
        assert!(built(probe).is_ok(), "{probe}");
    }
}
