//! Grounds that cut rock, in all their files, the selections above them, and messages.

use std::fmt::Write;
use std::fs;

use ddem_deck::lint::Code;
use ddem_deck::{
    BlockMode, BuiltDeck, CutRock, Deck, file_contents, parse_alone, read, restore_files, write,
};

const HEAD: &str = "
[model]
gravity = [0, 0, -10]
[materials.granite]
density = 2700.0
young = 50e9
poisson = 0.25
[joints.bedding]
normal_stiffness = 20e9
shear_stiffness = 8e9
[[region]]
box = { from = [0, 0, 0], to = [8, 6, 5] }
material = 'granite'
[[cut]]
set = { dip = 40, dip_direction = 60, spacing = 1.5 }
joint = 'bedding'
[[cut]]
name = 'ground'
";
const STAGE: &str = "
[[fix]]
where = { z = 0 }
axes = 'xyz'
[[stage]]
name = 'rest'
kind = 'relax'
";

/// Deck with a file and keys of the cut and after it, or messages about the file.
fn of_file(name: &str, content: &[u8], keys: &str) -> Result<Deck, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("deck.toml");
    let cut = format!("surface = '{name}'\n{keys}\n");
    fs::write(&path, format!("{HEAD}{cut}{STAGE}")).unwrap();
    fs::write(folder.path().join(name), content).unwrap();
    let message = |error: ddem_deck::DeckError| {
        let text = error.to_string().replace(&*folder.path().to_string_lossy(), "DIR");
        text.lines().last().unwrap().to_owned()
    };
    read(&path).map(|(deck, _)| deck).map_err(message)
}

fn cut(name: &str, content: &[u8], keys: &str) -> Result<CutRock, String> {
    of_file(name, content, keys)?.cut_regions().map_err(|error| error.to_string())
}

/// Heights in every metre.
fn heights(of: impl Fn(f64, f64) -> f64) -> Vec<[f64; 3]> {
    let at = |k: u32| f64::from(k);
    let places = (0..7).flat_map(|j| (0..9).map(move |i| (at(i), at(j))));
    places.map(|(x, y)| [x, y, of(x, y)]).collect()
}

fn csv(points: &[[f64; 3]]) -> String {
    points.iter().fold("x,y,z\n".to_owned(), |mut text, [x, y, z]| {
        writeln!(text, "{x},{y},{z}").unwrap();
        text
    })
}

/// Triangles of a grid of 9 by 7 points as STL.
fn stl(points: &[[f64; 3]]) -> String {
    let mut text = "solid ground\n".to_owned();
    for square in 0..48 {
        let first = square % 8 + 9 * (square / 8);
        let [a, b, c, d] = [first, first + 1, first + 10, first + 9].map(|k| points[k]);
        for corners in [[a, b, c], [a, c, d]] {
            let vertices: String =
                corners.iter().map(|[x, y, z]| format!("vertex {x} {y} {z}\n")).collect();
            let facet = format!("outer loop\n{vertices}endloop\n");
            writeln!(text, "facet normal 0 0 0\n{facet}endfacet").unwrap();
        }
    }
    text + "endsolid ground\n"
}

/// Ridge along y.
fn ridge(x: f64, _: f64) -> f64 {
    3.5 - 0.5 * (x - 5.0).abs()
}

fn removed(name: &str) -> String {
    format!("join = true\n[[remove]]\nwhere = {{ above = {{ topography = '{name}' }} }}")
}

/// Volumes of the cells that are not removed, and those that are `[m³]`.
fn volumes(rock: &CutRock) -> [f64; 2] {
    let mut sums = [0.0; 2];
    for (verdict, cell) in rock.verdicts().into_iter().zip(&rock.properties) {
        sums[usize::from(verdict.mode == BlockMode::Removed)] += cell.volume;
    }
    sums
}

#[test]
fn grounds_of_all_files_cut_and_select_alike() {
    let points = heights(ridge);
    let exact = 6.0 * (3.5 * 8.0 - 0.5 * (12.5 + 4.5));
    // The raster is two cells wider; its heights are those of the centres of cells.
    let rows = (0..9).rev().map(|_| {
        let row = (-1..10).map(|i| ridge(f64::from(i), 0.0).to_string());
        row.collect::<Vec<_>>().join(" ")
    });
    let rows = rows.collect::<Vec<_>>().join("\n");
    let raster = format!("ncols 11\nnrows 9\nxllcenter -1\nyllcenter -1\ncellsize 1\n{rows}\n");
    let files =
        [("ground.csv", csv(&points)), ("ground.asc", raster), ("ground.stl", stl(&points))];
    let mut counts = Vec::new();
    for (name, content) in files {
        let rock = cut(name, content.as_bytes(), &removed(name)).unwrap();
        let [below, above] = volumes(&rock);
        assert!((below - exact).abs() < 1e-9, "{name}: {below} instead of {exact}");
        assert!((below + above - 240.0).abs() < 1e-9);
        counts.push(rock.properties.len());
        // Two planes of the ground and one upright plane at its crease, none of which is a joint.
        let planes = rock.planes().0.into_iter().filter(|plane| plane.cut == 1);
        let dips: Vec<f64> = planes.map(|plane| plane.dip.round()).collect();
        assert_eq!(dips.iter().filter(|dip| **dip == 90.0).count(), 1, "{name}: {dips:?}");
        assert_eq!(dips.len(), 3, "{name}: {dips:?}");
    }
    assert!(counts.iter().all(|count| *count == counts[0]), "{counts:?}");
}

/// Rough heights: the same at each call.
fn rough(x: f64, y: f64) -> f64 {
    2.5 + 0.2 * (1.9 * x + 0.7 * y).sin()
        + 0.15 * (2.3 * y - 1.1 * x).cos()
        + 0.1 * (5.0 * x * y).sin()
}

#[test]
fn selections_take_the_simplified_ground() {
    let content = csv(&heights(rough));
    let keys = |tolerance: f64| format!("tolerance = {tolerance}\n{}", removed("ground.csv"));
    let mut counts = Vec::new();
    for tolerance in [0.01, 0.1, 0.4] {
        let deck = of_file("ground.csv", content.as_bytes(), &keys(tolerance)).unwrap();
        let rock = deck.cut_regions().unwrap();
        let [below, above] = volumes(&rock);
        assert!((below + above - 240.0).abs() < 1e-9);
        // No cell lies on both sides by more than the tolerance.
        let points = rock.complex.points();
        for (verdict, cell) in rock.verdicts().iter().zip(rock.complex.cells()) {
            let is_above = verdict.mode == BlockMode::Removed;
            for x in cell.vertices().into_iter().map(|corner| points[corner as usize]) {
                let place = (x.x.fract().abs() < 1e-6 && x.y.fract().abs() < 1e-6).then_some(x);
                let Some(x) = place else { continue };
                let over = x.z - rough(x.x.round(), x.y.round());
                let wrong = if is_above { -over } else { over };
                assert!(wrong <= tolerance * (1.0 + 1e-6), "{wrong} at {x:?}, {tolerance}");
            }
        }
        counts.push(rock.properties.len());
        // The model has the same cells.
        let built = BuiltDeck::new(&deck).unwrap();
        let model = built.model();
        let mass: f64 = (0..model.n_blocks()).map(|block| model.volume(block)).sum();
        assert!((mass - below).abs() < 1e-6, "{mass} {below}");
        assert!(built.warnings(&model).iter().all(|of| of.code != Code::AddedInertia));
    }
    assert!(counts[0] > counts[1] && counts[1] > counts[2], "{counts:?}");
}

#[test]
fn keys_of_grounds_are_written_and_restored() {
    let content = csv(&heights(rough));
    let keys = format!("tolerance = 0.25\n{}", removed("ground.csv"));
    let deck = of_file("ground.csv", content.as_bytes(), &keys).unwrap();
    let (mut again, _) = parse_alone(&write(&deck).unwrap(), "written.toml").unwrap();
    assert_eq!(again.cut[1].tolerance, Some(0.25));
    assert!(restore_files(&mut again, &file_contents(&deck)));
    assert_eq!(again, deck);
    let triangles = of_file("ground.stl", stl(&heights(rough)).as_bytes(), &removed("ground.stl"));
    let triangles = triangles.unwrap();
    let (mut again, _) = parse_alone(&write(&triangles).unwrap(), "written.toml").unwrap();
    assert!(restore_files(&mut again, &file_contents(&triangles)));
    assert_eq!(again, triangles);
    // A file without the end of a name for its kind.
    for content in [stl(&heights(rough)), csv(&heights(rough))] {
        let deck = of_file("ground", content.as_bytes(), &removed("ground")).unwrap();
        let (mut again, _) = parse_alone(&write(&deck).unwrap(), "written.toml").unwrap();
        assert!(restore_files(&mut again, &file_contents(&deck)));
        assert_eq!(again, deck);
    }
}

#[test]
fn wrong_grounds() {
    let points = heights(ridge);
    let part =
        |keep: fn(&[f64; 3]) -> bool| csv(&points.iter().copied().filter(keep).collect::<Vec<_>>());
    let gap = csv(&points).replace("3,2,2.5\n", "3,2,nan\n");
    let sheet = stl(&points);
    let second = stl(&heights(|x, y| 4.5 + ridge(x, y) / 10.0));
    let two = sheet.replace("endsolid ground\n", "") + second.trim_start_matches("solid ground\n");
    let join = "join = true";
    let mut found = String::new();
    for (name, content, keys) in [
        ("ground.csv", part(|[x, ..]| *x < 7.0), join.to_owned()),
        ("ground.csv", gap, join.to_owned()),
        ("ground.csv", csv(&points).replace("3,2,2.5\n", "3,2\n"), join.to_owned()),
        ("ground.csv", csv(&points).replace("3,2,2.5\n", "3.5,2.5,2.5\n"), join.to_owned()),
        ("ground.csv", "0,0,1\n4,0,1\n".to_owned(), join.to_owned()),
        (
            "ground.asc",
            "ncols 3\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 4\n1 1 1\n1 1\n".to_owned(),
            join.to_owned(),
        ),
        ("ground.csv", csv(&heights(|x, _| 9.0 + x)), join.to_owned()),
        ("ground.csv", csv(&points), "tolerance = 0\njoin = true".to_owned()),
        ("ground.stl", two.clone(), "tolerance = 0.1\njoin = true".to_owned()),
        ("ground.stl", two, removed("ground.stl")),
        ("ground.stl", sheet.replace("vertex 1 ", "vertex nan "), removed("ground.stl")),
    ] {
        let message = cut(name, content.as_bytes(), &keys).map(|_| ());
        let message = message.and_then(|()| {
            let deck = of_file(name, content.as_bytes(), &keys)?;
            BuiltDeck::new(&deck).map(|_| ()).map_err(|error| error.to_string())
        });
        writeln!(found, "{}", message.expect_err(name).lines().next().unwrap()).unwrap();
    }
    insta::assert_snapshot!(found);
}

/// A box of fins: 256 thin ones make more than 500 triangles.
fn fins(n: usize) -> String {
    let quads = (0..n).flat_map(|k| {
        let at = |k: usize| 0.5 + 7.0 * k as f64 / n as f64;
        let (from, to) = (at(k), 0.5 * (at(k) + at(k + 1)));
        let [a, b, c, d] = [[from, 1.0, 1.0], [to, 1.0, 1.0], [to, 4.0, 1.0], [from, 4.0, 1.0]];
        let [e, f, g, h] = [a, b, c, d].map(|[x, y, _]| [x, y, 2.0]);
        [[a, d, c, b], [e, f, g, h], [a, b, f, e], [b, c, g, f], [c, d, h, g], [d, a, e, h]]
    });
    let facet = |corners: [[f64; 3]; 3]| {
        let vertices: String =
            corners.iter().map(|[x, y, z]| format!("vertex {x} {y} {z}\n")).collect();
        format!("facet normal 0 0 0\nouter loop\n{vertices}endloop\nendfacet\n")
    };
    let body: String = quads.map(|[a, b, c, d]| facet([a, b, c]) + &facet([a, c, d])).collect();
    format!("solid fins\n{body}endsolid fins\n")
}

#[test]
fn other_surfaces_of_many_triangles_are_warned_of() {
    let of = |n: usize| {
        let deck = of_file("fins.stl", fins(n).as_bytes(), "join = true").unwrap();
        let built = BuiltDeck::new(&deck).unwrap();
        let warnings = built.warnings(&built.model());
        warnings.into_iter().find(|of| of.code == Code::ManyTriangles)
    };
    assert_eq!(of(40), None);
    insta::assert_snapshot!(of(42).unwrap().to_string());
    // A ground of many triangles is simplified.
    let fine = heights(ridge);
    let deck = of_file("ground.stl", stl(&fine).as_bytes(), "join = true").unwrap();
    let built = BuiltDeck::new(&deck).unwrap();
    assert!(built.warnings(&built.model()).iter().all(|of| of.code != Code::ManyTriangles));
}

/// A fault of triangles that ends in the rock is no ground: it cuts the cells that it meets.
#[test]
fn surfaces_that_end_in_the_rock_cut_by_their_triangles() {
    let facet = |corners: [[f64; 3]; 3]| {
        let vertices = corners.map(|[x, y, z]| format!("vertex {x} {y} {z}\n")).concat();
        format!("facet normal 0 0 0\nouter loop\n{vertices}endloop\nendfacet\n")
    };
    let [a, b, c, d] = [[0.0, 0.0, 2.0], [2.0, 0.0, 2.0], [2.0, 6.0, 2.0], [0.0, 6.0, 2.0]];
    let text = format!("solid fault\n{}{}endsolid fault\n", facet([a, b, c]), facet([a, c, d]));
    let rock = cut("fault.stl", text.as_bytes(), "joint = 'bedding'").unwrap();
    let cells = 0..rock.properties.len();
    let is_cut = |&cell: &usize| rock.cut_names(cell).iter().any(|name| name == "ground");
    let (beside, rest): (Vec<usize>, Vec<usize>) = cells.partition(is_cut);
    assert!(!beside.is_empty() && !rest.is_empty(), "{beside:?} {rest:?}");
    // No cell near it lies on both sides.
    for cell in beside {
        let corners = rock.complex.cells()[cell].vertices();
        let heights = corners.iter().map(|&corner| rock.complex.points()[corner as usize].z - 2.0);
        let (low, high) = heights.fold((0.0, 0.0), |(l, h), z| (f64::min(l, z), f64::max(h, z)));
        assert!(low > -1e-9 || high < 1e-9, "{low} {high}");
    }
}
