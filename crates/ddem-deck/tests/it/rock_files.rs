//! Regions from files: surfaces and convex bodies, and messages about wrong files.

use std::fmt::Write;
use std::fs;

use ddem_core::problem::Vec3;
use ddem_deck::{BuiltDeck, CutRock, Deck, file_contents, read, restore_files};

use crate::rock_tessellations::tessellation;

const HEAD: &str = "
[materials.granite]
density = 2700.0
young = 50e9
poisson = 0.25
[joints.grain]
normal_stiffness = 20e9
shear_stiffness = 8e9
cohesion = 10e6
";

/// Deck with a region of a file, and the content of the file; or messages about it.
pub(crate) fn of_file(name: &str, content: &[u8], keys: &str) -> Result<Deck, Vec<String>> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("deck.toml");
    let text = format!("{HEAD}[[region]]\nfile = '{name}'\nmaterial = 'granite'\n{keys}\n");
    fs::write(&path, text).unwrap();
    fs::write(folder.path().join(name), content).unwrap();
    let folder = folder.path().to_string_lossy();
    let messages = |error: ddem_deck::DeckError| {
        let faults = error.findings().iter().map(|one| one.fault.to_string());
        faults.map(|fault| fault.replace(&*folder, "DIR")).collect::<Vec<_>>()
    };
    read(&path).map(|(deck, _)| deck).map_err(messages)
}

pub(crate) fn cut(name: &str, content: &str, keys: &str) -> Result<CutRock, Vec<String>> {
    let deck = of_file(name, content.as_bytes(), keys)?;
    let messages = |error: ddem_core::ModelError| {
        error.faults.iter().map(ToString::to_string).collect::<Vec<_>>()
    };
    deck.cut_regions().map_err(messages)
}

pub(crate) fn volume(rock: &CutRock) -> f64 {
    rock.properties.iter().map(|cell| cell.volume).sum()
}

/// Quadrilaterals of a box, counter-clockwise as seen from outside.
fn cuboid(low: [f64; 3], high: [f64; 3]) -> Vec<[[f64; 3]; 4]> {
    let corner = |k: usize| [0, 1, 2].map(|d| if k >> d & 1 == 1 { high[d] } else { low[d] });
    let quads =
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    quads.map(|four| four.map(corner)).to_vec()
}

/// OBJ of bodies with faces; `parts` divides a face into those that the file has.
fn obj(bodies: &[Vec<Vec<[f64; 3]>>]) -> String {
    let (mut text, mut n) = ("# bricks\n".to_owned(), 0);
    for (body, faces) in bodies.iter().enumerate() {
        writeln!(text, "g brick {body}").unwrap();
        for face in faces {
            for [x, y, z] in face {
                writeln!(text, "v {x} {y} {z}").unwrap();
            }
            let numbers: Vec<String> = (1..=face.len()).map(|k| format!("{}//1", n + k)).collect();
            writeln!(text, "f {}", numbers.join(" ")).unwrap();
            n += face.len();
        }
    }
    text
}

fn whole(quads: &[[[f64; 3]; 4]]) -> Vec<Vec<[f64; 3]>> {
    quads.iter().map(|quad| quad.to_vec()).collect()
}

/// Four triangles around the middle of each quadrilateral.
fn fanned(quads: &[[[f64; 3]; 4]]) -> Vec<Vec<[f64; 3]>> {
    let fan = |quad: &[[f64; 3]; 4]| {
        let middle = [0, 1, 2].map(|k| quad.iter().map(|corner| corner[k]).sum::<f64>() / 4.0);
        let quad = *quad;
        (0..4).map(move |i| vec![quad[i], quad[(i + 1) % 4], middle])
    };
    quads.iter().flat_map(fan).collect()
}

fn stl(faces: &[Vec<[f64; 3]>]) -> String {
    let mut text = "solid body\n".to_owned();
    for face in faces {
        for k in 2..face.len() {
            text += "facet normal 0 0 0\nouter loop\n";
            for [x, y, z] in [face[0], face[k - 1], face[k]] {
                writeln!(text, "vertex {x} {y} {z}").unwrap();
            }
            text += "endloop\nendfacet\n";
        }
    }
    text + "endsolid body\n"
}

/// Bricks of 2 × 1 × 1 m in running bond: two in the lower course, one above both, and halves beside it.
fn wall() -> Vec<Vec<[[f64; 3]; 4]>> {
    let brick = |x: [f64; 2], z: f64| cuboid([x[0], 0.0, z], [x[1], 1.0, z + 1.0]);
    vec![
        brick([0.0, 2.0], 0.0),
        brick([2.0, 4.0], 0.0),
        brick([0.0, 1.0], 1.0),
        brick([1.0, 3.0], 1.0),
        brick([3.0, 4.0], 1.0),
    ]
}

/// A closed surface with a dent, as STL.
pub(crate) fn body() -> String {
    stl(&angle())
}

/// A tessellation of some cells.
pub(crate) fn grains() -> String {
    tessellation(6, Vec3::new(2.0, 1.0, 1.0)).0
}

#[test]
fn bricks_of_an_obj_file_have_joints_where_they_touch() {
    let [plain, triangles] = [whole, fanned].map(|faces| {
        let bodies: Vec<_> = wall().iter().map(|quads| faces(quads)).collect();
        cut("wall.obj", &obj(&bodies), "joint = 'grain'").unwrap()
    });
    for rock in [&plain, &triangles] {
        assert_eq!(rock.properties.len(), 5);
        assert_eq!(rock.blocks, [0, 1, 2, 3, 4]);
        assert_eq!(volume(rock), 8.0);
        // A bed joint of 4 m² in four parts, and three head joints of 1 m².
        let area: f64 = rock.common.iter().map(|face| rock.complex.common_area(face)).sum();
        assert!((area - 7.0).abs() < 1e-12, "{area}");
        assert_eq!(rock.common.iter().filter(|face| rock.is_joint(face)).count(), 7);
        // Triangles in one plane are one face.
        assert!(rock.complex.cells().iter().all(|cell| cell.faces.len() == 6));
    }
    let joined: Vec<_> = wall().iter().map(|quads| whole(quads)).collect();
    let joined = cut("wall.obj", &obj(&joined), "join = true").unwrap();
    assert_eq!(joined.blocks, [0; 5]);
}

#[test]
fn runs_of_bricks_have_the_areas_of_their_joints() {
    let bodies: Vec<_> = wall().iter().map(|quads| whole(quads)).collect();
    let support = "joint = 'grain'\n[[fix]]\nwhere = { z = 0 }\naxes = 'xyz'\n[[stage]]\nname = 'rest'\nkind = 'relax'";
    let deck = of_file("wall.obj", obj(&bodies).as_bytes(), support).unwrap();
    let built = BuiltDeck::new(&deck).unwrap_or_else(|error| panic!("{error}"));
    let model = built.model();
    assert_eq!(model.n_whole_blocks(), 5);
    let area: f64 = model.geometry().joined().map(|joint| joint.area).sum();
    assert!((area - 7.0).abs() < 1e-12, "{area}");
    // The file is part of a checkpoint.
    let contents = file_contents(&deck);
    let mut restored = deck.clone();
    restored.region[0].file.as_mut().unwrap().content = None;
    assert!(restore_files(&mut restored, &contents));
    assert_eq!(restored, deck);
    restored.region[0].file.as_mut().unwrap().content = None;
    let cut_off = contents.into_iter().map(|(path, all)| (path, all[..all.len() - 1].to_vec()));
    assert!(!restore_files(&mut restored, &cut_off.collect()));
}

/// Corners of an L of 3 m², 2 m long.
fn angle() -> Vec<Vec<[f64; 3]>> {
    let outline = [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]];
    let at = |i: usize, y: f64| [outline[i % 6][0], y, outline[i % 6][1]];
    let mut faces: Vec<Vec<[f64; 3]>> =
        (0..6).map(|i| vec![at(i, 0.0), at(i, 2.0), at(i + 1, 2.0), at(i + 1, 0.0)]).collect();
    for corners in [[0, 1, 2, 3], [0, 3, 4, 5]] {
        faces.push(corners.map(|i| at(i, 0.0)).to_vec());
        faces.push(corners.map(|i| at(i, 2.0)).into_iter().rev().collect());
    }
    faces
}

#[test]
fn regions_of_closed_surfaces_have_their_volumes() {
    // The sixth of a cube whose faces are fans of triangles is convex: one cell of six faces.
    let cube = cut("cube.stl", &stl(&fanned(&cuboid([-1.0; 3], [1.0, 2.0, 3.0]))), "").unwrap();
    assert_eq!(cube.properties.len(), 1);
    assert_eq!(cube.complex.cells()[0].faces.len(), 6);
    assert_eq!(volume(&cube), 24.0);
    let angle = cut("angle.stl", &stl(&angle()), "").unwrap();
    assert!(angle.properties.len() > 1);
    assert!(angle.blocks.iter().all(|block| *block == 0));
    assert!((volume(&angle) - 6.0).abs() < 1e-12, "{}", volume(&angle));
    let centroid: Vec3 =
        angle.properties.iter().map(|of| of.centroid * of.volume).sum::<Vec3>() / 6.0;
    assert!((centroid - Vec3::new(2.5 / 3.0, 1.0, 2.5 / 3.0)).norm() < 1e-12);
}

#[test]
fn wrong_files_of_regions() {
    let cube = whole(&cuboid([0.0; 3], [1.0; 3]));
    let moved = whole(&cuboid([0.5, 0.0, 0.0], [1.5, 1.0, 1.0]));
    let inside_out = |faces: &[Vec<[f64; 3]>]| -> Vec<Vec<[f64; 3]>> {
        faces.iter().map(|face| face.iter().copied().rev().collect()).collect()
    };
    let turned_one = {
        let mut faces = cube.clone();
        faces[0].reverse();
        faces
    };
    let dented = {
        let mut faces = fanned(&cuboid([0.0; 3], [1.0; 3]));
        for corner in
            faces.iter_mut().flatten().filter(|x| x[2] == 1.0 && x[0] == 0.5 && x[1] == 0.5)
        {
            corner[2] = 0.7;
        }
        faces
    };
    let crossing = [cube.clone(), moved.clone()].concat();
    let mut found = Vec::new();
    let mut add = |name: &str, content: &str, keys: &str| {
        let messages = cut(name, content, keys).map(|_| ()).expect_err(name);
        found.extend(messages);
    };
    for (content, keys) in [
        (stl(&cube[1..]), ""),
        (stl(&turned_one), ""),
        (stl(&inside_out(&cube)), ""),
        (stl(&crossing), ""),
        ("x".to_owned(), ""),
    ] {
        add("body.stl", &content, keys);
    }
    let two = obj(&[cube.clone(), whole(&cuboid([1.0, 0.0, 0.0], [2.0, 1.0, 1.0]))]);
    for (content, keys) in [
        (obj(&[cube[1..].to_vec()]), ""),
        (obj(&[inside_out(&cube)]), ""),
        (obj(std::slice::from_ref(&dented)), ""),
        (obj(&[cube.clone(), moved.clone()]), "join = true"),
        (two.clone(), ""),
        (two.clone(), "joint = 'grain'\njoin = true"),
        (two.clone(), "joint = 'grains'"),
        (obj(std::slice::from_ref(&cube)), "join = true"),
        (two.clone(), "joint = 'grain'\nbox = { from = [0, 0, 0], to = [1, 1, 1] }"),
        ("v 1 2\n".to_owned(), ""),
        ("v 1 2 nan\n".to_owned(), ""),
        ("v 1 2 3\nf 1 2 3\n".to_owned(), ""),
        ("v 1 2 3\nf 1 1\n".to_owned(), ""),
        ("v 1 2 3\n".to_owned(), ""),
    ] {
        add("bodies.obj", &content, keys);
    }
    add("bodies.step", "x", "");
    let (good, _) = tessellation(4, Vec3::repeat(1.0));
    let last = good.find(" **polyhedron\n 4\n").unwrap();
    let (_, polyhedra) = good[last..].split_once("4\n").unwrap();
    let three: String = polyhedra.lines().take(3).map(|line| format!("{line}\n")).collect();
    let rest = &good[good.find(" **domain").unwrap()..];
    let gaps = format!("{} **polyhedron\n 3\n{three}{rest}", &good[..last]);
    for content in [
        "***tesr\n".to_owned(),
        "***tess\n **format\n   1.10\n".to_owned(),
        good.replace("   3 standard", "   2 standard"),
        good.replace("   3.4", "   new"),
        good[..good.find(" **face").unwrap()].to_owned(),
        good[..good.find("***end").unwrap() - 40].to_owned(),
        good.replace(" **vertex\n ", " **vertex\n 9999999999"),
        gaps,
    ] {
        add("grains.tess", &content, "joint = 'grain'");
    }
    // A word after the beginning of a section replaced, or the last word.
    let spoilt = |section: &str, number: usize| {
        let (before, after) = good.rsplit_once(section).unwrap();
        let end = after.split_whitespace().nth(number).unwrap();
        let at = after.match_indices(char::is_whitespace).map(|(at, _)| at + 1);
        let at = at.filter(|&at| !after[at..].starts_with(char::is_whitespace)).nth(number);
        let (kept, rest) = after.split_at(at.unwrap());
        format!("{before}{section}{kept}?{}", &rest[end.len()..])
    };
    for (section, number) in [
        ("**vertex", 5),
        ("**face", 3),
        ("**polyhedron", 3),
        (" *vertex", 1),
        (" *face", 1),
        (" *face", 3),
    ] {
        add("grains.tess", &spoilt(section, number), "joint = 'grain'");
    }
    add("grains.tess", &good[..good.find("     plane").unwrap()], "joint = 'grain'");
    let bent = good.replacen(" 1.000000000000 ", " 1.300000000000 ", 1);
    add("grains.tess", &bent, "joint = 'grain'");
    let messages = of_file("grains.tess", &[b'*', 0xff], "").map(|_| ()).expect_err("no text");
    found.extend(messages);
    insta::assert_snapshot!(found.join("\n"));
}

#[test]
fn larger_files_than_memory_are_not_read() {
    let folder = tempfile::tempdir().unwrap();
    let text = format!("{HEAD}[[region]]\nfile = 'large.obj'\nmaterial = 'granite'\n");
    fs::write(folder.path().join("deck.toml"), text).unwrap();
    let file = fs::File::create(folder.path().join("large.obj")).unwrap();
    file.set_len(1 << 40).unwrap();
    let error = read(&folder.path().join("deck.toml")).map(|_| ()).expect_err("too large");
    let message = error.findings()[0].fault.to_string();
    insta::assert_snapshot!(message.replace(&*folder.path().to_string_lossy(), "DIR"));
}
