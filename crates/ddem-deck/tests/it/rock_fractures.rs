//! Cuts of finite size in decks: what they cut, the bridges of rock that they leave, and messages.

use std::fs;

use ddem_core::problem::Vec3;
use ddem_deck::{BuiltDeck, CutRock, parse, read, write};

use crate::rock_decks::{built, cut, deck, messages};

const HEAD: &str = "
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
[joints.intact]
normal_stiffness = 40e9
shear_stiffness = 16e9
[[region]]
box = { from = [0, 0, 0], to = [4, 4, 2] }
material = 'granite'
seed = 5
";
/// Sixteen columns.
const COLUMNS: &str = "
[[cut]]
set = { dip = 90, dip_direction = 0, spacing = 1, origin = [0, 0, 0] }
KIND
[[cut]]
set = { dip = 90, dip_direction = 90, spacing = 1, origin = [0, 0, 0] }
KIND
";
const DISC: &str = "
[[cut]]
name = 'fracture'
disc = { dip = 0, dip_direction = 0, centre = [2, 2, 1], radius = 1.3 }
joint = 'major'
";
const STAGE: &str = "
[[fix]]
where = { z = 0 }
axes = 'xyz'
[[stage]]
name = 'rest'
kind = 'relax'
";

fn text(kind: &str, more: &str) -> String {
    format!("{HEAD}{}{more}{STAGE}", COLUMNS.replace("KIND", kind))
}

/// Area of the joints with a name on the level plane of the fracture `[m²]`.
fn area(built: &BuiltDeck, name: &str) -> f64 {
    let model = built.model();
    let geometry = model.geometry();
    let properties = &built.problem().properties.joints;
    let level = geometry.joined().filter(|joint| {
        let blocks = joint.blocks.map(|block| geometry.centre(block as usize));
        (blocks[0] - blocks[1]).xy().norm() < 0.1 && properties[joint.joint as usize].name == name
    });
    level.map(|joint| joint.area).sum()
}

#[test]
fn keys_of_fractures_are_read_and_written() {
    let more = "
[[cut]]
polygon = [[0, 0, 0.5], [3, 0, 0.5], [3, 3, 0.5]]
joint = 'major'
bridge = 'intact'
[[cut]]
dfn = { p32 = 0.3, size = { power = 3.5, from = 0.8, to = 3.0 }, dip = 70.0, dip_direction = 200.0, fisher = 20.0, least = 1.0 }
joint = 'major'
bridge = 'tied'
[[cut]]
dfn = { number = 30, size = 1.5, dip = 20, dip_direction = 100 }
joint = 'minor'
[[cut]]
set = { dip = 10.0, dip_direction = 20.0, spacing = 0.7, persistence = 0.5 }
joint = 'minor'
";
    let deck = deck(&text("join = true", &format!("{DISC}{more}")));
    let written = write(&deck).unwrap();
    assert_eq!(parse(&written, "written.toml").unwrap().0, deck);
    let rock = deck.cut_regions().unwrap();
    let volume: f64 = rock.properties.iter().map(|cell| cell.volume).sum();
    assert!((volume - 32.0).abs() < 1e-12, "{volume}");
    for cut in [2, 3, 4, 5, 6] {
        assert!((0..rock.properties.len()).any(|cell| rock.complex.cuts_of(cell).contains(&cut)));
    }
}

/// Each column of 1 m² has four parts of a face, with centres at a quarter of its edges.
fn covered(inside: impl Fn(f64, f64) -> bool) -> f64 {
    let at = |i: i32| f64::from(i) * 0.5 + 0.25;
    let all = (0..8).flat_map(|i| (0..8).map(move |j| (at(i), at(j))));
    0.25 * all.filter(|(x, y)| inside(*x, *y)).count() as f64
}

#[test]
fn joints_lie_within_the_disc_and_bridges_outside() {
    let exact = covered(|x, y| (x - 2.0).hypot(y - 2.0) <= 1.3);
    // All columns but the four at the corners are cut: these have 0.003 of their area in the disc.
    let both = 12.0;
    let tied = built(&text("joint = 'minor'", DISC));
    assert_eq!(area(&tied, "major"), exact);
    assert_eq!(area(&tied, "rock of region[0]"), both - exact);
    let named = built(&text("joint = 'minor'", &format!("{DISC}bridge = 'intact'\n")));
    assert_eq!((area(&named, "major"), area(&named, "intact")), (exact, both - exact));
    // Bridges keep their joint.
    let assigned = "[[assign]]\njoint = 'minor'\nwhere = { cut = 'fracture' }\n";
    let other = built(&text("joint = 'minor'", &format!("{DISC}bridge = 'intact'\n{assigned}")));
    assert_eq!((area(&other, "minor"), area(&other, "intact")), (exact, both - exact));
}

#[test]
fn a_face_outside_of_the_disc_is_whole_rock() {
    // More than a twentieth of the column in the middle is covered, but no middle of its quarters.
    let small =
        DISC.replace("centre = [2, 2, 1], radius = 1.3", "centre = [1.5, 1.5, 1], radius = 0.2");
    let rock = cut(&text("joint = 'minor'", &small));
    assert_eq!(rock.properties.len(), 17);
    assert_eq!(rock.blocks.iter().max(), Some(&15));
    let model = built(&text("joint = 'minor'", &small)).model();
    assert_eq!(
        (area(&built(&text("joint = 'minor'", &small)), "major"), model.n_whole_blocks()),
        (0.0, 16)
    );
}

/// In whole rock a fracture over half of a level is a slit: its two sides are apart, and the rock
/// around, its front included, is one.
#[test]
fn a_fracture_ends_within_a_block() {
    // The polygon reaches into the third row of columns, but over the middle of no part there.
    let half =
        "[[cut]]\npolygon = [[0, 0, 1], [2.2, 0, 1], [2.2, 4, 1], [0, 4, 1]]\njoint = 'major'\n";
    let slit = built(&text("join = true", half));
    let model = slit.model();
    assert_eq!(model.n_whole_blocks(), 1);
    assert_eq!(area(&slit, "major"), 8.0);
    let geometry = model.geometry();
    let place = |node: u32| {
        let (block, at) = geometry.locate(node as usize);
        (geometry.position(block, at), geometry.centre(block).z)
    };
    let mut seen = [0; 2];
    for group in geometry.tied() {
        let places: Vec<(Vec3, f64)> = group.iter().map(|&node| place(node)).collect();
        let x = places[0].0;
        assert!(places.iter().all(|(other, _)| (other - x).norm() < 1e-12));
        if (x.z - 1.0).abs() < 1e-9 {
            let through = places.iter().any(|at| at.1 > 1.0) && places.iter().any(|at| at.1 < 1.0);
            assert_eq!(through, x.x > 2.0 - 1e-9, "{x:?}");
            seen[usize::from(through)] += 1;
        }
    }
    // Nodes half a metre apart: 4 × 9 on each side of the slit, four of which belong to one part; 3 × 9
    // from its front to the row that is not cut, and 3 × 9 in the middle of that row.
    assert_eq!(seen, [72 - 4, 27 + 27]);
}

#[test]
fn persistence_leaves_columns_whole_or_bridged() {
    let level = "[[cut]]\nset = { dip = 0, dip_direction = 0, spacing = 9, origin = [0, 0, 1], persistence = 0.6 }\njoint = 'major'\n";
    let whole = cut(&text("joint = 'minor'", level));
    let n = whole.properties.len() - 16;
    assert!((4..16).contains(&n), "{n}");
    let bridged = built(&text("joint = 'minor'", &format!("{level}bridge = 'intact'\n")));
    assert_eq!((area(&bridged, "major"), area(&bridged, "intact")), (n as f64, 16.0 - n as f64));
    let none = level.replace("0.6", "0.0");
    let error = deck(&text("joint = 'minor'", &none)).cut_regions().unwrap_err();
    insta::assert_snapshot!(error.to_string());
}

#[test]
fn wrong_fractures() {
    let size = "size = 1, dip = 20, dip_direction = 0";
    let mut found = Vec::new();
    for cut in [
        "disc = { dip = 95, dip_direction = 0, centre = [2, 2, nan], radius = 0 }",
        "disc = { dip = 5, dip_direction = 0, centre = [2, 2, 9], radius = 1 }",
        "disc = { dip = 5, dip_direction = 0, centre = [2, 2, 1] }",
        "polygon = [[0, 0, 1], [1, 0, 1], [2, 0, 1]]",
        "polygon = [[0, 0, 1], [1, 0, 1], [1, 1, 1.2], [0, 1, 1]]",
        "polygon = [[0, 0, 1], [1, 1, 1], [1, 0, 1], [0, 1, 1]]",
        "polygon = [[0, 0, 1], [2, 0, 1], [1, 0.5, 1], [0, 2, 1]]",
        "polygon = [[0, 0, inf], [1, 1, 1], [1, 0, 1], [0, 1, 1]]",
        "polygon = [[0, 0, 9], [1, 0, 9], [1, 1, 9], [0, 1, 9]]",
        &format!("dfn = {{ p32 = 0, {size} }}"),
        &format!("dfn = {{ number = 0, {size} }}"),
        &format!("dfn = {{ number = 3, p32 = 1, {size} }}"),
        &format!("dfn = {{ {size} }}"),
        &format!("dfn = {{ p32 = 1e9, {size} }}"),
        "dfn = { p32 = 1 }",
        "dfn = { p32 = 1, dip = 20, dip_direction = 0, size = { power = 3, from = 2, to = 1 } }",
        "dfn = { p32 = 1, dip = 20, dip_direction = 0, size = { power = 90, from = 0, to = 1 }, fisher = 0, least = -1 }",
        "dfn = { p32 = 1, dip = 20, dip_direction = 0, size = 'wide' }",
        "dfn = { number = 9, dip = 20, dip_direction = 0, size = 0.1, least = 1 }",
        "set = { dip = 0, dip_direction = 0, spacing = 1, persistence = 1.5 }",
        "plane = { dip = 0, dip_direction = 0, through = [0, 0, 1] }\nbridge = 'intact'",
        "disc = { dip = 5, dip_direction = 0, centre = [2, 2, 1], radius = 1 }\nbridge = 'intakt'",
        "dfn = { file = 'missing.csv' }",
    ] {
        let of_cut =
            messages(&text("joint = 'minor'", &format!("[[cut]]\n{cut}\njoint = 'major'\n")));
        assert!(!of_cut.is_empty(), "nothing is said about {cut}");
        found.extend(of_cut.into_iter().filter(|one| !found.contains(one)).collect::<Vec<_>>());
    }
    let mut unread = deck(&text("joint = 'minor'", DISC));
    unread.cut[2].disc = None;
    let file = Some(ddem_deck::FileOf::new("list.csv"));
    unread.cut[2].dfn = Some(ddem_deck::NetworkCut { file, ..Default::default() });
    found.push(unread.cut_regions().unwrap_err().to_string());
    insta::assert_snapshot!(found.join("\n"));
}

/// Cells, or the message, of a deck with a table of fractures.
fn of_table(content: &[u8], keys: &str) -> Result<CutRock, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("deck.toml");
    let cut = format!("[[cut]]\ndfn = {{ file = 'list.csv'{keys} }}\njoint = 'major'\n");
    fs::write(&path, text("joint = 'minor'", &cut)).unwrap();
    fs::write(folder.path().join("list.csv"), content).unwrap();
    let read = read(&path).map_err(|error| {
        let text = error.to_string().replace(&*folder.path().to_string_lossy(), "DIR");
        text.lines().last().unwrap().to_owned()
    });
    read?.0.cut_regions().map_err(|error| error.to_string())
}

#[test]
fn tables_of_fractures_are_discs() {
    let disc = cut(&text("joint = 'minor'", DISC));
    let plain = "# discs\n2, 2, 1, 0, 0, 1.3\n2, 2, 0.5, 0, 0, 0.7\n";
    let headed = "radius,dip_direction,dip,z,y,x\n1.3,0,0,1,2,2\n0.7,0,0,0.5,2,2\n";
    for content in [plain, headed] {
        let rock = of_table(content.as_bytes(), ", least = 1").unwrap();
        assert_eq!(rock.complex.cells(), disc.complex.cells());
        assert_eq!(rock.properties, disc.properties);
    }
    let both = of_table(plain.as_bytes(), "").unwrap();
    assert!(both.properties.len() > disc.properties.len());
    // A disc of a centimetre covers less than a twentieth of a column.
    let more = format!("{plain}1.5, 1.5, 1.5, 10, 0, 0.01\n");
    let idle = of_table(more.as_bytes(), "").unwrap();
    assert_eq!([both.idle_fractures(), idle.idle_fractures()], [0, 1]);
    assert_eq!(idle.properties, both.properties);
}

#[test]
fn wrong_tables_of_fractures() {
    let mut found = Vec::new();
    for content in [
        &b"\xff\xfe"[..],
        b"",
        b"x,y,z,dip,dip_direction\n1,1,1,0,0\n",
        b"x,y,z,dip,dip_direction,radius\n1,1,1,0,0,wide\n",
        b"1,1,1,0,0\n",
        b"1,1,1,0,0,nan\n",
        b"1,1,1,0,0,-1\n",
        b"1,1,1,100,0,1\n",
        b"1,1,1,10,400,1\n",
    ] {
        found.push(of_table(content, "").map(|_| ()).expect_err("a message"));
    }
    found.push(of_table(b"1,1,1,0,0,1\n", ", size = 1").map(|_| ()).expect_err("a message"));
    insta::assert_snapshot!(found.join("\n"));
}

/// The list of the discs of a network gives the same cells when it is read as a file.
#[test]
fn listed_fractures_give_the_same_cells() {
    let network = "[[cut]]
polygon = [[0, 0, 0.5], [3, 0, 0.5], [3, 3, 0.6]]
joint = 'major'
[[cut]]
name = 'network'
dfn = { p32 = 1.5, size = { power = 3.0, from = 0.5, to = 2.0 }, dip = 80, dip_direction = 350, fisher = 4 }
joint = 'major'
";
    for north in ["[0, 1, 0]", "[1, 2, 0]"] {
        let turned = |text: String| {
            text.replace("seed = 5", &format!("seed = 5\nnorth = {north}"))
                .replace("dip_direction = 0,", "dip_direction = 0.0,")
        };
        let rock = cut(&turned(text("joint = 'minor'", network)));
        let of_network: Vec<_> = rock.fractures.iter().filter(|of| of.cut == 3).collect();
        assert!(of_network.len() > 20 && rock.fractures.len() == of_network.len() + 1);
        // A right-angled triangle of 3 m by √(9 + 0.01) m.
        let polygon = rock.fractures[0];
        assert!((polygon.area - 1.5 * 9.01_f64.sqrt()).abs() < 1e-12);
        assert!((polygon.radius - (polygon.area / std::f64::consts::PI).sqrt()).abs() < 1e-12);
        let mut table = "cut,x,y,z,dip,dip_direction,radius,area\n".to_owned();
        for of in of_network {
            let [x, y, z] = of.centre;
            let row = [x, y, z, of.dip, of.dip_direction, of.radius, of.area];
            table += &format!("network,{}\n", row.map(|number| number.to_string()).join(","));
        }
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("deck.toml");
        let (before, _) = network.split_once("dfn = ").unwrap();
        let from_file = format!("{before}dfn = {{ file = 'fractures.csv' }}\njoint = 'major'\n");
        fs::write(&path, turned(text("joint = 'minor'", &from_file))).unwrap();
        fs::write(folder.path().join("fractures.csv"), table).unwrap();
        let again = read(&path).unwrap().0.cut_regions().unwrap();
        assert_eq!(again.properties.len(), rock.properties.len());
        // The list has no sides, by which cells are numbered.
        let volumes = |rock: &CutRock| {
            let mut all: Vec<f64> = rock.properties.iter().map(|cell| cell.volume).collect();
            all.sort_by(f64::total_cmp);
            all
        };
        for (a, b) in volumes(&again).into_iter().zip(volumes(&rock)) {
            assert!((a - b).abs() < 1e-12, "{a} {b}");
        }
        for (a, b) in again.fractures.iter().zip(&rock.fractures) {
            assert_eq!((a.cut, a.centre, a.radius), (b.cut, b.centre, b.radius));
            assert!((a.dip - b.dip).abs() < 1e-12);
            let turn = (a.dip_direction - b.dip_direction).abs();
            assert!(turn.min(360.0 - turn) < 1e-10);
        }
    }
}

/// A surface of quadrilaterals, each split into two triangles, as STL.
fn stl(quads: &[[[f64; 3]; 4]]) -> String {
    let corner = |[x, y, z]: [f64; 3]| format!("vertex {x} {y} {z}\n");
    let facet = |corners: [[f64; 3]; 3]| {
        format!(
            "facet normal 0 0 0\nouter loop\n{}endloop\nendfacet\n",
            corners.map(corner).concat()
        )
    };
    let both = |&[a, b, c, d]: &[[f64; 3]; 4]| facet([a, b, c]) + &facet([a, c, d]);
    format!("solid surface\n{}endsolid surface\n", quads.iter().map(both).collect::<String>())
}

/// Sides of an L of six corners along y, from 0.5 to 3.5, with a slanted edge.
fn angle() -> Vec<[[f64; 3]; 4]> {
    let outline = [[0.5, 0.25], [3.5, 0.25], [3.25, 0.75], [1.5, 0.75], [1.5, 1.75], [0.5, 1.75]];
    let at = |i: usize, y: f64| [outline[i % 6][0], y, outline[i % 6][1]];
    let mut quads: Vec<_> =
        (0..6).map(|i| [at(i, 0.5), at(i + 1, 0.5), at(i + 1, 3.5), at(i, 3.5)]).collect();
    for y in [0.5, 3.5] {
        quads.push([at(0, y), at(1, y), at(2, y), at(3, y)]);
        quads.push([at(0, y), at(3, y), at(4, y), at(5, y)]);
    }
    quads
}

fn of_surface(content: &str, more: &str) -> Result<CutRock, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("deck.toml");
    fs::write(&path, text("joint = 'minor'", &format!("[[cut]]\nsurface = 'body.stl'\n{more}")))
        .unwrap();
    fs::write(folder.path().join("body.stl"), content).unwrap();
    let read = read(&path).map_err(|error| {
        let text = error.to_string().replace(&*folder.path().to_string_lossy(), "DIR");
        text.lines().last().unwrap().to_owned()
    });
    read?.0.cut_regions().map_err(|error| error.to_string())
}

#[test]
fn surfaces_divide_the_rock_exactly() {
    let remove = "join = true\n[[remove]]\nwhere = { inside = 'body.stl' }\n";
    let rock = of_surface(&stl(&angle()), remove).unwrap();
    let inside = rock.verdicts().into_iter().zip(&rock.properties);
    let inside = inside.filter(|(verdict, _)| verdict.mode == ddem_deck::BlockMode::Removed);
    let volume: f64 = inside.map(|(_, cell)| cell.volume).sum();
    // A rectangle of 3 m × 0.5 m without a triangle, and one of 1 m × 1 m above, 3 m long.
    let exact = 3.0 * (3.0 * 0.5 - 0.25 * 0.5 / 2.0 + 1.0);
    assert!((volume - exact).abs() < 1e-12, "{volume} {exact}");
    let all: f64 = rock.properties.iter().map(|cell| cell.volume).sum();
    assert!((all - 32.0).abs() < 1e-12);
    // Columns stay blocks: the surface makes no joint.
    assert_eq!(rock.blocks.iter().max(), Some(&15));
    // An open surface: a ridge over the whole box.
    let roof = |x: [f64; 2], z: [f64; 2]| {
        [[x[0], 0.0, z[0]], [x[1], 0.0, z[1]], [x[1], 4.0, z[1]], [x[0], 4.0, z[0]]]
    };
    let ridge = [roof([0.0, 2.0], [0.5, 1.5]), roof([2.0, 4.0], [1.5, 0.5])];
    let rock = of_surface(&stl(&ridge), "join = true\n").unwrap();
    let below = rock.properties.iter().filter(|cell| {
        let x = cell.centroid;
        x.z < 1.5 - (x.x - 2.0).abs() / 2.0
    });
    let below: f64 = below.map(|cell| cell.volume).sum();
    assert!((below - 16.0).abs() < 1e-12, "{below}");
    assert_eq!(rock.properties.len(), 32);
}

#[test]
fn wrong_surfaces() {
    let far = angle().into_iter().map(|quad| quad.map(|[x, y, z]| [x + 9.0, y, z]));
    let mut found = Vec::new();
    for (content, more) in [
        ("solid surface\nendsolid surface\n", "join = true\n"),
        (&*stl(&angle()).replace("3.25", "nan"), "join = true\n"),
        (&*stl(&far.collect::<Vec<_>>()), "join = true\n"),
        ("x", "join = true\n"),
        (&*stl(&angle()), ""),
    ] {
        let message = of_surface(content, more).map(|_| ()).expect_err("a message");
        found.push(message);
    }
    insta::assert_snapshot!(found.join("\n"));
}
