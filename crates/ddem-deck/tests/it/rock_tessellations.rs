//! Regions from tessellations of Neper.

use std::collections::HashMap;
use std::fmt::Write;

use ddem_core::problem::Vec3;
use ddem_cut::{CellComplex, Polyhedron, voronoi_seeds};
use ddem_deck::BuiltDeck;

use crate::rock_files::{cut, of_file, volume};

/// Volume within faces `[m³]`, by the divergence theorem.
fn enclosed(faces: &[Vec<Vec3>]) -> f64 {
    let cone = |face: &Vec<Vec3>| -> f64 {
        (2..face.len()).map(|k| face[0].dot(&face[k - 1].cross(&face[k]))).sum()
    };
    faces.iter().map(cone).sum::<f64>() / 6.0
}

/// Tessellation of Voronoi cells of a box in the format of Neper, and the volumes of the cells that its
/// numbers give.
pub(crate) fn tessellation(n: usize, size: Vec3) -> (String, Vec<f64>) {
    let seeds = voronoi_seeds([Vec3::zeros(), size], n, 0.0, 3, 0);
    let mut rock = CellComplex::new(&[vec![Polyhedron::brick(Vec3::zeros(), size).unwrap()]]);
    rock.cut_voronoi(&seeds, 0, false, &[true]);
    let mut text = format!(
        "***tess\n **format\n   3.4\n **general\n   3 standard\n **cell\n   {n}\n  *seed\n"
    );
    for (i, seed) in seeds.iter().enumerate() {
        writeln!(text, "   {} {:.12} {:.12} {:.12} 0.0", i + 1, seed.x, seed.y, seed.z).unwrap();
    }
    // Vertices that cells have, with twelve digits as in Neper's files.
    let mut vertices: HashMap<u32, usize> = HashMap::new();
    let (mut points, mut edges, mut faces) = (Vec::new(), Vec::new(), Vec::new());
    let mut edge_numbers: HashMap<(u32, u32), usize> = HashMap::new();
    let mut face_numbers: HashMap<Vec<u32>, usize> = HashMap::new();
    let (mut cells, mut volumes) = (Vec::new(), Vec::new());
    for cell in rock.cells() {
        let (mut signed, mut polygons) = (Vec::new(), Vec::new());
        for face in &cell.faces {
            for &corner in &face.corners {
                vertices.entry(corner).or_insert_with(|| {
                    let x = rock.points()[corner as usize];
                    let rounded = |x: f64| format!("{x:.12}").parse::<f64>().unwrap();
                    points.push(x.map(rounded));
                    points.len()
                });
            }
            let known = face_numbers.get(&face.sorted_corners()).copied();
            let number = known.unwrap_or_else(|| {
                let of_edge = |(a, b): (u32, u32)| {
                    let number = *edge_numbers.entry((a.min(b), a.max(b))).or_insert_with(|| {
                        edges.push((vertices[&a], vertices[&b]));
                        edges.len()
                    });
                    let turned = edges[number - 1].0 != vertices[&a];
                    if turned { -(number as i64) } else { number as i64 }
                };
                let own: Vec<String> = face.edges().map(of_edge).map(|e| e.to_string()).collect();
                let corners: Vec<String> =
                    face.corners.iter().map(|corner| vertices[corner].to_string()).collect();
                let normal = rock.outward(face);
                let offset = normal.dot(&rock.middle(face));
                faces.push(format!(
                    "{} {}\n     {} {}\n    {:.12} {:.12} {:.12} {:.12}\n     0 0 0.0 0.0 0.0",
                    corners.len(),
                    corners.join(" "),
                    own.len(),
                    own.join(" "),
                    offset,
                    normal.x,
                    normal.y,
                    normal.z,
                ));
                face_numbers.insert(face.sorted_corners(), faces.len());
                faces.len()
            });
            signed.push(if known.is_some() { -(number as i64) } else { number as i64 });
            polygons.push(face.corners.iter().map(|c| points[vertices[c] - 1]).collect::<Vec<_>>());
        }
        let signed: Vec<String> = signed.iter().map(ToString::to_string).collect();
        cells.push(format!("{} {}", signed.len(), signed.join(" ")));
        volumes.push(enclosed(&polygons));
    }
    let mut section = |name: &str, rows: Vec<String>| {
        writeln!(text, " {name}\n {}", rows.len()).unwrap();
        for (i, row) in rows.iter().enumerate() {
            writeln!(text, "   {} {row}", i + 1).unwrap();
        }
    };
    let place = |x: &Vec3| format!("{:.12} {:.12} {:.12}", x.x, x.y, x.z);
    section("**vertex", points.iter().map(|x| format!("{}     0", place(x))).collect());
    section("**edge", edges.iter().map(|(a, b)| format!("{a} {b} 0")).collect());
    section("**face", faces);
    section("**polyhedron", cells);
    text += " **domain\n  *general\n   cube\n";
    let corner =
        |k: usize| Vec3::from([0, 1, 2].map(|d| if k >> d & 1 == 1 { size[d] } else { 0.0 }));
    text += "  *vertex\n   8\n";
    for k in 0..8 {
        writeln!(text, "   {} {} label\n      1 1", k + 1, place(&corner(k))).unwrap();
    }
    text += "  *edge\n   0\n  *face\n   6\n";
    let sides =
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    for (i, side) in sides.iter().enumerate() {
        let side = side.map(|k: usize| (k + 1).to_string()).join(" ");
        writeln!(
            text,
            "   {} 4 {side}\n     4 1 2 3 4\n     plane\n     4 0.0 1.0 0.0 0.0\n     x0\n     1 1",
            i + 1
        )
        .unwrap();
    }
    (text + "***end\n", volumes)
}

#[test]
fn cells_of_a_tessellation_have_the_volumes_of_the_file() {
    let (text, volumes) = tessellation(1000, Vec3::new(2.0, 1.0, 1.5));
    let rock = cut("grains.tess", &text, "joint = 'grain'").unwrap();
    assert_eq!(rock.properties.len(), 1000);
    for (cell, volume) in rock.properties.iter().zip(&volumes) {
        assert!((cell.volume - volume).abs() <= 1e-9 * volume, "{} {volume}", cell.volume);
    }
    assert!((volume(&rock) - 3.0).abs() < 1e-9);
    // Faces of cells match, so that all of them can fail.
    assert!(rock.common.iter().all(|face| face.matches && rock.is_joint(face)));
    assert_eq!(*rock.blocks.last().unwrap(), 999);
    let outer: f64 = {
        let faces = rock.complex.cells().iter().flat_map(|cell| &cell.faces);
        let all: f64 = faces.map(|face| face.area(rock.complex.points()).norm()).sum();
        let inner: f64 = rock.common.iter().map(|face| rock.complex.common_area(face)).sum();
        all - 2.0 * inner
    };
    assert!((outer - 2.0 * (2.0 + 3.0 + 1.5)).abs() < 1e-8, "{outer}");
}

/// Grain growth of Neper leaves grains that others have grown over as polyhedra without faces.
#[test]
fn grains_without_volume_are_left_out() {
    let (text, _) = tessellation(4, Vec3::repeat(1.0));
    let text = text.replace("**polyhedron\n 4\n", "**polyhedron\n 5\n");
    let text = text.replace(" **domain", "   5 0\n **domain");
    let rock = cut("grains.tess", &text, "joint = 'grain'").unwrap();
    assert_eq!(rock.properties.len(), 4);
    assert!((volume(&rock) - 1.0).abs() < 1e-9);
    let only = " **polyhedron\n 1\n   1 0\n **domain";
    let (start, end) = text.split_once(" **polyhedron").unwrap();
    let none = format!("{start}{only}{}", end.split_once(" **domain").unwrap().1);
    let messages = cut("grains.tess", &none, "joint = 'grain'").map(|_| ()).unwrap_err();
    assert!(messages[0].contains("there is no polyhedron"), "{messages:?}");
}

#[test]
fn cells_of_a_tessellation_run_and_are_cut() {
    let (text, _) = tessellation(30, Vec3::repeat(1.0));
    let plane = "joint = 'grain'\n[[cut]]\nplane = { dip = 0, dip_direction = 0, through = [0, 0, 0.4] }\njoint = 'grain'\n";
    let rock = cut("grains.tess", &text, plane).unwrap();
    assert!(rock.properties.len() > 40);
    let below: f64 =
        rock.properties.iter().filter(|of| of.centroid.z < 0.4).map(|of| of.volume).sum();
    assert!((below - 0.4).abs() < 1e-9, "{below}");
    let more = format!(
        "{plane}[[fix]]\nwhere = {{ z = 0 }}\naxes = 'xyz'\n[[stage]]\nname = 'rest'\nkind = 'relax'"
    );
    let deck = of_file("grains.tess", text.as_bytes(), &more).unwrap();
    let model = BuiltDeck::new(&deck).unwrap_or_else(|error| panic!("{error}")).model();
    assert_eq!(model.n_whole_blocks(), rock.properties.len());
}
