//! Regions and cuts: what decks of them give, and the messages about wrong ones.

use ddem_deck::{CutRock, parse, write};

/// Deck with every key of regions and cuts.
const ROCK: &str = r#"
[materials.granite]
density = 2700.0
young = 50e9
poisson = 0.25
[joints.minor]
normal_stiffness = 20e9
shear_stiffness = 8e9
[[region]]
name = "rock"
box = { from = [0.0, 0.0, 0.0], to = [4.0, 3.0, 2.0] }
material = "granite"
divisions = 4
body = "deformable"
north = [0.0, 1.0, 0.0]
seed = 7
small = { width = 0.1, is = "rigid" }
[[region]]
prism = { outline = [[4.0, 0.0], [6.0, 0.0], [6.0, 3.0], [5.0, 1.0], [4.0, 3.0]], axis = "z", from = 0.0, to = 2.0 }
material = "granite"
seed = 7
[[region]]
name = "wedge"
faces = [[[9.0, 0.0, 0.0], [9.0, 1.0, 0.0], [10.0, 0.0, 0.0]], [[9.0, 0.0, 0.0], [10.0, 0.0, 0.0], [9.0, 0.0, 1.0]], [[9.0, 0.0, 0.0], [9.0, 0.0, 1.0], [9.0, 1.0, 0.0]], [[10.0, 0.0, 0.0], [9.0, 1.0, 0.0], [9.0, 0.0, 1.0]]]
material = "granite"
[[cut]]
name = "level"
set = { dip = 0.0, dip_direction = 0.0, spacing = 1.0, origin = [0.0, 0.0, 0.5] }
joint = "minor"
[[cut]]
name = "steep"
set = { dip = 80.0, dip_direction = 95.0, fisher = 400.0, spacing = { mean = 1.0, spread = 0.3 } }
joint = "minor"
[[cut]]
set = { dip = 70.0, dip_direction = 10.0, spacing = { mean = 2.0, law = "lognormal", deviation = 0.5, least = 0.2 } }
joint = "minor"
where = { x = [0.0, 4.0] }
[[cut]]
name = "fault"
plane = { dip = 60.0, dip_direction = 45.0, through = [2.0, 1.0, 1.0] }
joint = "minor"
[[cut]]
plane = { points = [[0.0, 0.5, 0.0], [1.0, 0.5, 0.1], [0.0, 0.6, 1.0]] }
joint = "minor"
where = { below = 1.9 }
[[cut]]
name = "tunnel"
tunnel = { outline = [[-0.5, 0.0], [0.5, 0.0], [0.0, 0.8]], from = [2.0, 0.0, 0.6], to = [2.0, 3.0, 0.6] }
join = true
"#;

/// Cells of a deck, or its messages.
fn cut(text: &str) -> Result<CutRock, Vec<String>> {
    let (deck, _) = parse(text, "deck.toml").map_err(|error| {
        error.findings().iter().map(|one| one.fault.to_string()).collect::<Vec<_>>()
    })?;
    deck.cut_regions().map_err(|error| error.faults.iter().map(ToString::to_string).collect())
}

fn good(text: &str) -> CutRock {
    cut(text).unwrap_or_else(|messages| panic!("{}", messages.join("\n")))
}

/// Deck with one box of 4×3×2 m, further keys of it, and cuts.
fn boxed(keys: &str, cuts: &str) -> String {
    let (materials, _) = ROCK.split_once("[[region]]").unwrap();
    format!(
        "{materials}[[region]]\nbox = {{ from = [0, 0, 0], to = [4, 3, 2] }}\nmaterial = 'granite'\n\
         {keys}\n{cuts}"
    )
}

fn volume(rock: &CutRock) -> f64 {
    rock.properties.iter().map(|cell| cell.volume).sum()
}

#[test]
fn every_key_is_read_and_written() {
    let (deck, _) = parse(ROCK, "rock.toml").unwrap();
    assert_eq!((deck.region.len(), deck.cut.len()), (3, 6));
    let text = write(&deck).unwrap();
    assert_eq!(parse(&text, "written.toml").unwrap().0, deck);
    assert_eq!(toml::from_str::<ddem_deck::Deck>(ROCK).unwrap(), deck);
}

#[test]
fn the_cells_fill_the_regions() {
    let rock = good(ROCK);
    // 24, the prism 2 (6 − 2), and a corner of a cube.
    assert!((volume(&rock) - (24.0 + 8.0 + 1.0 / 6.0)).abs() < 1e-12, "{}", volume(&rock));
    let n = rock.complex.cells().len();
    assert!(n > 60, "{n}");
    assert_eq!(rock.complex.n_uncut(), 0);
    for cell in rock.complex.cells() {
        assert_eq!(cell.check(), Ok(()));
    }
    for (region, expected) in [(0, 24.0), (1, 8.0), (2, 1.0 / 6.0)] {
        let of: f64 = rock.cells_of(region).iter().map(|&cell| rock.properties[cell].volume).sum();
        assert!((of - expected).abs() < 1e-12, "region {region}: {of}");
    }
    let again = good(ROCK);
    assert_eq!(again.complex.cells(), rock.complex.cells());
    assert_eq!(again.complex.points(), rock.complex.points());
}

#[test]
fn sets_along_the_edges_make_a_lattice() {
    let rock = good(&boxed(
        "",
        "[[cut]]\nset = { dip = 90, dip_direction = 90, spacing = 1.0, origin = [0, 0, 0] }\njoint = 'minor'
         [[cut]]\nset = { dip = 90, dip_direction = 0, spacing = 1.0, origin = [0, 0, 0] }\njoint = 'minor'
         [[cut]]\nset = { dip = 0, dip_direction = 0, spacing = 1.0, origin = [0, 0, 0] }\njoint = 'minor'",
    ));
    assert_eq!(rock.complex.cells().len(), 4 * 3 * 2);
    assert!(rock.properties.iter().all(|cell| (cell.volume - 1.0).abs() < 1e-14));
    assert_eq!(rock.common.len(), 3 * 3 * 2 + 4 * 2 * 2 + 4 * 3);
    assert!(rock.common.iter().all(|face| rock.is_joint(face)));
    // Eight vertices, halves of two elements along an edge.
    assert_eq!(rock.n_elements(0), 8);
    assert_eq!(rock.median_width(0), 1.0);
}

#[test]
fn the_origin_is_the_middle_by_default() {
    let set = "[[cut]]\nset = { dip = 0, dip_direction = 0, spacing = 50.0 }\njoint = 'minor'";
    let rock = good(&boxed("", set));
    let volumes: Vec<f64> = rock.properties.iter().map(|cell| cell.volume).collect();
    assert_eq!(volumes, [12.0, 12.0]);
}

#[test]
fn dip_directions_count_from_north() {
    let plane =
        "[[cut]]\nplane = { dip = 90, dip_direction = 0, through = [1, 1, 1] }\njoint = 'minor'";
    // North along y: the plane y = 1. North along x: the plane x = 1.
    let volumes = |north: &str| {
        let rock = good(&boxed(north, plane));
        let mut all: Vec<f64> = rock.properties.iter().map(|cell| cell.volume.round()).collect();
        all.sort_by(f64::total_cmp);
        all
    };
    assert_eq!(volumes(""), [8.0, 16.0]);
    assert_eq!(volumes("north = [2, 0, 1]"), [6.0, 18.0]);
}

#[test]
fn where_limits_a_cut_to_blocks_inside() {
    let halves =
        "[[cut]]\nplane = { dip = 90, dip_direction = 90, through = [2, 0, 0] }\njoint = 'minor'\n";
    let level =
        "[[cut]]\nplane = { dip = 0, dip_direction = 0, through = [0, 0, 1] }\njoint = 'minor'\n";
    for condition in [
        "x = [0, 1.5]",
        "sphere = { centre = [1, 1.5, 1], radius = 0.1 }",
        "below = { point = [2, 0, 0], normal = [1, 0, 0.001] }",
    ] {
        let rock = good(&boxed("", &format!("{halves}{level}where = {{ {condition} }}")));
        let mut volumes: Vec<f64> = rock.properties.iter().map(|cell| cell.volume).collect();
        volumes.sort_by(f64::total_cmp);
        assert_eq!(volumes, [6.0, 6.0, 12.0], "{condition}");
    }
}

#[test]
fn joined_cells_are_one_block() {
    let plane = "[[cut]]\nplane = { dip = 0, dip_direction = 0, through = [0, 0, 1] }\n";
    let joined = good(&boxed("", &format!("{plane}join = true")));
    assert_eq!((joined.complex.cells().len(), &joined.blocks[..]), (2, &[0, 0][..]));
    let cut = good(&boxed("", &format!("{plane}joint = 'minor'")));
    assert_eq!(cut.blocks, [0, 1]);
}

/// The sides of a tunnel end on each other, so that faces overlap in part. The rock stays one block.
#[test]
fn a_tunnel_leaves_the_rock_whole() {
    let tunnel = "[[cut]]\njoin = true\ntunnel = { outline = [[-0.5, 0], [0.5, 0], [0.5, 0.6], [0, 0.9], \
                  [-0.5, 0.6]], from = [2, 0, 0.6], to = [2, 3, 0.6] }";
    let rock = good(&boxed("", tunnel));
    assert!(rock.common.iter().any(|face| !face.matches));
    assert_eq!(rock.blocks, vec![0; rock.complex.cells().len()]);
    assert!(!rock.common.iter().any(|face| rock.is_joint(face)));
}

/// A fault does not depend on the seed: regions with other seeds are cut by one plane, and the face
/// that they share is divided alike.
#[test]
fn regions_of_any_seed_share_a_fault() {
    let beside = "[[region]]\nseed = 5\nnorth = [0.1, 0.3, 0]\nmaterial = 'granite'\n\
                  box = { from = [4.0, 0.0, 0.0], to = [6.0, 3.0, 2.0] }\n";
    let fault =
        "[[cut]]\njoint = 'minor'\nplane = { points = [[0, 0, 0.5], [4, 0, 1.1], [4, 3, 1.4]] }";
    let rock = good(&boxed("north = [1, 3, 0]\nseed = 4", &format!("{beside}{fault}")));
    assert_eq!(rock.complex.cells().len(), 4);
    assert!(rock.common.iter().all(|face| face.matches));
    assert_eq!(rock.common.len(), 2 + 2);
}

#[test]
fn thin_cells_count_as_they_are_treated() {
    let slices =
        "[[cut]]\njoint = 'minor'\nplane = { dip = 0, dip_direction = 0, through = [0, 0, 0.1] }";
    let elements = |small: &str| {
        let rock = good(&boxed(&format!("divisions = 4\n{small}"), slices));
        (0..2).map(|cell| rock.n_elements(cell)).sum::<usize>()
    };
    assert_eq!(elements("small = { is = 'scaled' }"), 64 + 64);
    assert_eq!(elements("small = { is = 'rigid' }"), 8 + 64);
    assert_eq!(elements("small = { is = 'removed' }"), 64);
    assert_eq!(elements("body = 'rigid'\nsmall = { is = 'scaled' }"), 8 + 8);
}

#[test]
fn another_cut_keeps_the_random_numbers_of_a_set() {
    let set = "[[cut]]\nset = { dip = 40, dip_direction = 130, fisher = 50, spacing = { mean = 0.8, law = 'exponential' } }\njoint = 'minor'\n";
    let plane =
        "[[cut]]\nplane = { dip = 0, dip_direction = 0, through = [0, 0, 1] }\njoint = 'minor'\n";
    let planes = |seed: &str, cuts: &str| {
        let rock = good(&boxed(seed, cuts));
        let of_cut = rock
            .complex
            .planes()
            .iter()
            .filter(|plane| plane.source == ddem_cut::PlaneSource::Cut(0));
        of_cut.map(|plane| plane.offset.to_bits()).collect::<Vec<_>>()
    };
    let alone = planes("", set);
    assert!(alone.len() > 2);
    assert_eq!(planes("", &format!("{set}{plane}")), alone);
    assert_ne!(planes("seed = 1", set), alone);
}

/// Messages about changed decks, in order. An empty text stands for the end of the deck.
fn messages(changes: &[(&str, &str)]) -> String {
    let mut found: Vec<String> = Vec::new();
    for (from, to) in changes {
        let changed = match *from {
            "" => format!("{ROCK}{to}"),
            from => {
                assert!(ROCK.contains(from), "{from} is not in the deck");
                ROCK.replacen(from, to, 1)
            }
        };
        let messages = cut(&changed).err().unwrap_or_default();
        assert!(!messages.is_empty(), "nothing is said about {to}");
        for message in messages {
            if !found.contains(&message) {
                found.push(message);
            }
        }
    }
    found.join("\n")
}

const BOX: &str = "box = { from = [0.0, 0.0, 0.0], to = [4.0, 3.0, 2.0] }";
const OUTLINE: &str = "[[4.0, 0.0], [6.0, 0.0], [6.0, 3.0], [5.0, 1.0], [4.0, 3.0]]";
const LAST_FACE: &str = "[[10.0, 0.0, 0.0], [9.0, 1.0, 0.0], [9.0, 0.0, 1.0]]";
/// Sets that no number of planes alone makes too many.
const THREE_SETS: &str = "
[[cut]]
joint = 'minor'
set = { dip = 0, dip_direction = 0, spacing = 0.01 }
[[cut]]
joint = 'minor'
set = { dip = 90, dip_direction = 0, spacing = 0.01 }
[[cut]]
joint = 'minor'
set = { dip = 90, dip_direction = 90, spacing = 0.008 }
";
const TWICE: &str = "[[10.0, 0.0, 0.0], [9.0, 1.0, 0.0], [9.0, 0.0, 1.0]], [[10.0, 0.0, 0.0], [9.0, 1.0, 0.0], [9.0, 0.0, 1.0]]";
const LOGNORMAL: &str = "{ mean = 2.0, law = \"lognormal\", deviation = 0.5, least = 0.2 }";
const POINTS: &str = "points = [[0.0, 0.5, 0.0], [1.0, 0.5, 0.1], [0.0, 0.6, 1.0]]";
const TRIANGLE: &str = "[[-0.5, 0.0], [0.5, 0.0], [0.0, 0.8]]";

#[test]
fn wrong_regions() {
    let inward = "faces = [[[9.0, 0.0, 0.0], [10.0, 0.0, 0.0], [9.0, 1.0, 0.0]], [[9.0, 0.0, 0.0], [9.0, 0.0, 1.0], [10.0, 0.0, 0.0]], [[9.0, 0.0, 0.0], [9.0, 1.0, 0.0], [9.0, 0.0, 1.0]], [[10.0, 0.0, 0.0], [9.0, 0.0, 1.0], [9.0, 1.0, 0.0]]]";
    let bent = "faces = [[[0, 0, 0], [0, 1, 0], [1, 1, 0], [1, 0, 0]], [[0, 0, 1], [1, 0, 1], [1, 1, 1.3], [0, 1, 1]], [[0, 0, 0], [1, 0, 0], [1, 0, 1], [0, 0, 1]], [[1, 0, 0], [1, 1, 0], [1, 1, 1.3], [1, 0, 1]], [[1, 1, 0], [0, 1, 0], [0, 1, 1], [1, 1, 1.3]], [[0, 1, 0], [0, 0, 0], [0, 0, 1], [0, 1, 1]]]";
    let dented = "faces = [[[0, 0, 0], [0, 1, 0], [1, 1, 0], [1, 0, 0]], [[0, 0, 0], [1, 0, 0], [0.5, 0.5, 0.2]], [[1, 0, 0], [1, 1, 0], [0.5, 0.5, 0.2]], [[1, 1, 0], [0, 1, 0], [0.5, 0.5, 0.2]], [[0, 1, 0], [0.4, 0.5, 0.05], [0.5, 0.5, 0.2]], [[0.4, 0.5, 0.05], [0, 0, 0], [0.5, 0.5, 0.2]], [[0, 1, 0], [0, 0, 0], [0.4, 0.5, 0.05]]]";
    let found = messages(&[
        (BOX, ""),
        (
            BOX,
            "box = { from = [0, 0, 0], to = [4, 3, 2] }\nprism = { outline = [[0, 0], [1, 0], [0, 1]], axis = 'x', from = 0, to = 1 }",
        ),
        (BOX, "box = { from = [0, 0, 0], to = [4, 3, 0] }"),
        (BOX, "box = { from = [0, 0, 0], to = [4.5, 3, 2] }"),
        (BOX, "box = { from = [0, 0, nan], to = [4, 3, 0] }"),
        (BOX, inward),
        (BOX, dented),
        (BOX, "box = [0, 1]"),
        (LAST_FACE, "[[10.0, 0.0, 0.0], [9.0, 1.0, 0.0], [9.0, 0.2, 1.0]]"),
        (LAST_FACE, "[[10.0, 0.0, 0.0], [9.0, 0.0, 1.0], [9.0, 1.0, 0.0]]"),
        (LAST_FACE, "[[10.0, 0.0, 0.0], [9.0, 0.0, 1.0]]"),
        (LAST_FACE, TWICE),
        (BOX, bent),
        (BOX, "faces = [[[0, 0, 0], [0, 1, 0], [1, 1.0, 0], [1, 0, 0.3]]]"),
        (OUTLINE, "[[4, 0], [6, 0], [5, 0]]"),
        (OUTLINE, "[[4, 0], [6, 3], [6, 0], [4, 3]]"),
        ("axis = \"z\"", "axis = \"w\""),
        ("axis = \"z\", from = 0.0", "axis = \"z\", from = 2.0"),
        ("material = \"granite\"", "material = \"marble\""),
        ("material = \"granite\"", ""),
        ("divisions = 4", "divisions = 3"),
        ("divisions = 4", "divisions = 0"),
        ("divisions = 4", "divisions = 1000"),
        ("north = [0.0, 1.0, 0.0]", "north = [0, 0, 1]"),
        ("small = { width = 0.1, is = \"rigid\" }", "small = { width = 2.0 }"),
        ("small = { width = 0.1, is = \"rigid\" }", "small = { is = 'gone' }"),
        ("seed = 7", "seed = -1"),
        ("name = \"wedge\"", "name = \"rock\""),
    ]);
    insta::assert_snapshot!(found);
}

#[test]
fn wrong_cuts() {
    let steep = "fisher = 400.0, spacing = { mean = 1.0, spread = 0.3 }";
    let found = messages(&[
        ("dip = 80.0", "dip = 95.0"),
        ("dip_direction = 95.0", "dip_direction = 400.0"),
        ("fisher = 400.0", "fisher = 0.0"),
        ("spacing = 1.0", "spacing = 0.0"),
        ("spacing = 1.0", "spacing = 'wide'"),
        ("spacing = 1.0, ", ""),
        (steep, "spacing = { mean = 1.0, spread = 1.0 }"),
        (steep, "spacing = { mean = 1.0 }"),
        (steep, "spacing = { mean = 1.0, spread = 0.3, law = 'exponential' }"),
        (steep, "spacing = { mean = 1.0, spread = 0.3, least = 0.1 }"),
        (LOGNORMAL, "{ mean = 2.0, law = 'lognormal' }"),
        (LOGNORMAL, "{ mean = 2.0, law = 'lognormal', deviation = 1e9, least = 0.5 }"),
        (LOGNORMAL, "{ mean = 2.0, law = 'lognormal', deviation = 0.5, least = 3.0 }"),
        (LOGNORMAL, "{ mean = 2.0, law = 'exponential', deviation = 0.5 }"),
        (LOGNORMAL, "{ mean = 2.0, law = 'weibull' }"),
        (POINTS, "points = [[0, 0, 0], [1, 1, 1], [2, 2, 2]]"),
        (POINTS, "points = [[0, 0, 0], [1, 1, 1], [2, 0, 2]], dip = 10"),
        (POINTS, "dip = 10, dip_direction = 0"),
        (TRIANGLE, "[[-0.5, 0.0], [0.5, 0.0]]"),
        (TRIANGLE, "[[0, 0], [1, 1], [1, 0], [0, 1]]"),
        ("to = [2.0, 3.0, 0.6]", "to = [2.0, 0.0, 0.6]"),
        ("to = [2.0, 3.0, 0.6]", "to = [2.0, 1e-14, 0.6]"),
        ("join = true", ""),
        ("join = true", "join = true\njoint = 'minor'"),
        ("joint = \"minor\"", "joint = \"miner\""),
        ("name = \"fault\"", "name = \"fault\"\nset = { dip = 1, dip_direction = 1, spacing = 1 }"),
        ("plane = { dip = 60.0, dip_direction = 45.0, through = [2.0, 1.0, 1.0] }", ""),
        ("where = { below = 1.9 }", "where = { set = 'rock' }"),
        ("where = { below = 1.9 }", "where = { dip = 30 }"),
        ("where = { below = 1.9 }", "where = { z = [2, 1] }"),
        ("name = \"steep\"", "name = \"level\""),
    ]);
    insta::assert_snapshot!(found);
}

#[test]
fn cuts_without_effect() {
    let found = messages(&[
        ("spacing = 1.0, origin = [0.0, 0.0, 0.5]", "spacing = 9.0, origin = [0.0, 0.0, 3.5]"),
        ("through = [2.0, 1.0, 1.0]", "through = [2.0, 1.0, 50.0]"),
        (
            "from = [2.0, 0.0, 0.6], to = [2.0, 3.0, 0.6]",
            "from = [2.0, 0.0, 9.6], to = [2.0, 3.0, 9.6]",
        ),
        ("where = { below = 1.9 }", "where = { below = -1.0 }"),
        ("where = { below = 1.9 }", "where = { z = 1.0 }"),
        ("spacing = 1.0, origin", "spacing = 1e-9, origin"),
        ("origin = [0.0, 0.0, 0.5]", "origin = [0.0, 0.0, 5e8]"),
        ("", THREE_SETS),
        (
            "",
            "[[cut]]\njoint = 'minor'\nset = { dip = 10, dip_direction = 0, spacing = 1e-6 }\nwhere = { x = [0, 4] }",
        ),
        ("[[cut]]", "[[cutt]]"),
    ]);
    insta::assert_snapshot!(found);
}

#[test]
fn decks_without_regions_have_nothing_to_cut() {
    let (materials, _) = ROCK.split_once("[[region]]").unwrap();
    let mut found = cut(materials).err().unwrap();
    let level =
        "[[cut]]\njoint = 'minor'\nplane = { dip = 0, dip_direction = 0, through = [0, 0, 1] }";
    found.extend(cut(&format!("{materials}{level}")).err().unwrap());
    insta::assert_snapshot!(found.join("\n"));
}
