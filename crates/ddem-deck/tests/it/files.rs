//! Files named in decks: closed surfaces and topographies.

use std::fs;
use std::path::Path;

use ddem_deck::DeckError;
use ddem_io::folder::Earlier;
use ddem_io::run::{Options, RunFailure};

/// Column of 4 × 4 × 4 blocks of 1 m, from which a region is removed.
fn deck(region: &str) -> String {
    format!(
        "
[materials.rock]
density = 2400
young = 18e9
poisson = 0.25
[joints.seam]
thickness = 0.01
material = 'rock'
[[blocks]]
size = [4, 4, 4]
count = [4, 4, 4]
divisions = 1
material = 'rock'
joint = 'seam'
[[remove]]
where = {{ {region} }}
[[fix]]
axes = 'xyz'
[[load]]
pressure = 1e5
[[stage]]
name = 'press'
kind = 'relax'
[[stage]]
name = 'more'
kind = 'relax'
"
    )
}

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().unwrap_or_else(|error| panic!("{error}"))
}

fn put(folder: &Path, name: &str, content: impl AsRef<[u8]>) {
    fs::write(folder.join(name), content).unwrap_or_else(|error| panic!("{error}"));
}

/// Number of blocks left, or the error.
fn remaining_blocks(folder: &Path, region: &str) -> Result<usize, String> {
    let path = folder.join("deck.toml");
    put(folder, "deck.toml", deck(region));
    let (deck, source) = ddem_deck::read(&path).map_err(|error| error.to_string())?;
    source.check(&deck).map_err(|error| error.to_string())?;
    deck.build().map(|model| model.n_blocks()).map_err(|error| error.to_string())
}

fn assert_refused(folder: &Path, region: &str, words: &[&str]) {
    let Err(message) = remaining_blocks(folder, region) else { panic!("accepted: {words:?}") };
    for word in words {
        assert!(message.contains(word), "`{word}` is not in: {message}");
    }
}

/// Triangles of a box.
fn cuboid(low: [f32; 3], high: [f32; 3]) -> Vec<[[f32; 3]; 3]> {
    let corner = |k: usize| [0, 1, 2].map(|d| if k >> d & 1 == 1 { high[d] } else { low[d] });
    let quads =
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let halves = |[a, b, c, d]: [usize; 4]| [[a, b, c], [a, c, d]];
    quads.into_iter().flat_map(halves).map(|three| three.map(corner)).collect()
}

fn text(triangles: &[[[f32; 3]; 3]], first: &str) -> String {
    let mut text = format!("{first}\n");
    for corners in triangles {
        text += "facet normal 0 0 0\n outer loop\n";
        for [x, y, z] in corners {
            text += &format!("  vertex {x} {y} {z:e}\n");
        }
        text += " endloop\nendfacet\n";
    }
    text + "endsolid\n"
}

fn binary(triangles: &[[[f32; 3]; 3]], header: &str) -> Vec<u8> {
    let mut bytes = format!("{header:80}").into_bytes();
    bytes.extend((triangles.len() as u32).to_le_bytes());
    for corners in triangles {
        bytes.extend([0; 12]);
        corners.iter().flatten().for_each(|x| bytes.extend(x.to_le_bytes()));
        bytes.extend([0; 2]);
    }
    bytes
}

/// The surface passes through the centroids of some blocks; these are inside.
#[test]
fn text_and_binary_stl_select_same_blocks() {
    let folder = folder();
    let path = folder.path();
    let pit = cuboid([1.0, 0.0, 2.5], [3.0, 4.0, 4.0]);
    put(path, "text.stl", text(&pit, "solid pit"));
    put(path, "nameless.stl", text(&pit, "solid"));
    put(path, "binary.stl", binary(&pit, "a program"));
    put(path, "solid.stl", binary(&pit, "solid of a program that begins binary files so"));
    fs::create_dir(path.join("pits")).unwrap_or_else(|error| panic!("{error}"));
    put(path, "pits/one.STL", binary(&pit, ""));
    for name in ["text.stl", "nameless.stl", "binary.stl", "solid.stl", "pits/one.STL"] {
        assert_eq!(remaining_blocks(path, &format!("inside = '{name}'")), Ok(64 - 16), "{name}");
    }
}

#[test]
fn invalid_surfaces_are_refused() {
    let folder = folder();
    let path = folder.path();
    let mut open = cuboid([1.0; 3], [3.0; 3]);
    open.truncate(11);
    put(path, "open.stl", text(&open, "solid open"));
    assert_refused(
        path,
        "inside = 'open.stl'",
        &["deck.toml:16:20: remove[0].where.inside", "is not closed: 3 open edges of 11 triangles"],
    );
    let whole = binary(&open, "cut");
    put(path, "cut.stl", &whole[..200]);
    assert_refused(
        path,
        "inside = 'cut.stl'",
        &["this is no STL file: it would have 11 triangles in 200 bytes"],
    );
    put(path, "short.stl", "x");
    assert_refused(path, "inside = 'short.stl'", &["this is no STL file: it is too short"]);
    put(path, "words.stl", "solid\nfacet of a diamond\n");
    assert_refused(path, "inside = 'words.stl'", &["this is no STL file"]);
    put(path, "none.stl", text(&[], "solid none"));
    assert_refused(path, "inside = 'none.stl'", &["has no triangle"]);
    assert_refused(path, "inside = 'opne.stl'", &["cannot read", "did you mean `open.stl`?"]);
    assert_refused(path, "inside = '.'", &["cannot read"]);
    assert_refused(path, "inside = 3", &["expected the path of a file, in quotes, found 3"]);
}

/// Heights of 2.1 in the west and 4.1 in the east.
#[test]
fn csv_and_esri_heights_select_same_blocks() {
    let folder = folder();
    let path = folder.path();
    put(path, "plain.csv", "0,0,2.1\n4,0,4.1\n0,4,2.1\n4,4,4.1\n");
    put(path, "named.csv", "x, y, z\n4, 4, 4.1\n0, 4, 2.1\n0, 0, 2.1\n4, 0, 4.1\n");
    put(path, "other.csv", "# surveyed\nEast;North;Height\n0;0;2.1\n4;0;4.1\n0;4;2.1\n4;4;4.1\n");
    // Cell centres at −1, 1, 3 and 5 have the heights 1.6, 2.6, 3.6 and 4.6.
    let grid = |corner: &str| {
        format!(
            "ncols 4\nnrows 2\n{corner}\ncellsize 2\nNODATA_value -99\n1.6 2.6 3.6 4.6\n1.6 2.6 3.6 4.6\n"
        )
    };
    put(path, "corner.asc", grid("xllcorner -2\nyllcorner 0"));
    put(path, "centre.asc", grid("XLLCENTER -1\nYLLCENTER 1"));
    // Centroids above 2.1 + x/2: those at 2.5 with x = 0.5, and those at 3.5 with x = 0.5, 1.5 or
    // 2.5.
    for name in ["plain.csv", "named.csv", "other.csv", "corner.asc", "centre.asc"] {
        let region = format!("above = {{ topography = '{name}' }}");
        assert_eq!(remaining_blocks(path, &region), Ok(64 - 4 * 4), "{name}");
        let region = format!("below = {{ topography = '{name}' }}");
        assert_eq!(remaining_blocks(path, &region), Ok(4 * 4), "{name}");
    }
    // The first row of an ESRI grid is the northernmost.
    put(path, "north.asc", "ncols 2\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 2\n0 0\n9 9\n");
    assert_eq!(remaining_blocks(path, "above = { topography = 'north.asc' }, y = [3, 4]"), Ok(48));
    assert_eq!(remaining_blocks(path, "below = { topography = 'north.asc' }, y = [0, 1]"), Ok(48));
    // Heights may be missing where none is needed.
    let east = "nan 9\nNaN 9\n";
    let head = "ncols 2\nnrows 2\nxllcenter 0\nyllcenter 0\ncellsize 3\nNODATA_value nan\n";
    put(path, "nan.asc", format!("{head}{east}"));
    assert_eq!(remaining_blocks(path, "below = { topography = 'nan.asc' }, x = [3, 4]"), Ok(48));
}

#[test]
fn invalid_height_grids_are_refused() {
    let folder = folder();
    let path = folder.path();
    let region = "above = { topography = 'ground' }";
    for (content, words) in [
        ("0,0,1\n4,0,x\n", "line 2: expected three numbers, found `4, 0, x`"),
        ("0,0\n4,0\n", "line 1: expected three numbers"),
        ("0,0,1\n4,0,1\n", "here are 2 different x and 1 different y"),
        ("0,0,1\n4,0,1\n0,4,1\n4,4,1\n0,0,2\n", "there are two heights at x = 0, y = 0"),
        ("0,0,1\n4,0,1\n0,4,1\n", "it has no height at [0.5, 0.5, 0.5]"),
        ("0,0,1\n4,0,\n0,4,1\n4,4,nan\n", "it has no height at"),
        ("0,0,1\n2,0,1\n0,4,1\n2,4,1\n", "it covers x from 0 to 2 and y from 0 to 4"),
        ("ncols 2\nnrows 2\nxllcorner 0\nyllcorner 0\n1 1 1 1", "`cellsize` is missing"),
        ("ncols 2\nnrows 2\nxllcorner 0\ncellsize 2\n1 1 1 1", "`yllcorner` is missing"),
        (
            "ncols 2\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 2\n1 1 1",
            "2 columns and 2 rows have not 3 heights",
        ),
        (
            "ncols 2.5\nnrows 2\ncellsize 2\n1 1",
            "2.5 columns and 2 rows of cells of 2 m are no grid",
        ),
        (
            "ncols 2\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 2\n1 1 -9999 1",
            "it has no height at",
        ),
        ("", "here are 0 different x"),
    ] {
        put(path, "ground", content);
        assert_refused(path, region, &["remove[0].where.above.topography", words]);
    }
    put(path, "ground", [0, 159, 146, 150]);
    assert_refused(path, region, &["this is not text"]);
}

/// A run resumes only with the files with which it began.
#[test]
fn run_resumes_only_with_same_files() {
    struct Nothing;
    impl ddem_io::run::Observer for Nothing {
        fn event(&mut self, _: ddem_io::run::Event<'_>) {}
    }

    let folder = folder();
    let path = folder.path();
    put(path, "pit.stl", binary(&cuboid([1.0, 0.0, 2.5], [3.0, 4.0, 4.0]), ""));
    put(path, "deck.toml", deck("inside = 'pit.stl'"));
    let mut options = Options::new(path.join("out"));
    let run = |options: &Options| {
        let (deck, source) = ddem_deck::read(&path.join("deck.toml"))?;
        ddem_io::run::run(&deck, &source, options, &mut Nothing)
    };
    run(&options).unwrap_or_else(|error| panic!("{error}"));
    options.earlier = Earlier::Resume;
    run(&options).unwrap_or_else(|error| panic!("{error}"));

    // The checkpoint of a session contains the files, so the deck's folder is not needed.
    let load = || {
        let simd = ddem_core::Simd::default();
        ddem_io::run::Session::load(&path.join("out/checkpoint.h5"), simd, None, |_| Ok(()))
    };
    let session = load().unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(session.simulation().model().n_blocks(), 48);

    put(path, "pit.stl", binary(&cuboid([1.0, 0.0, 2.5], [3.0, 3.9, 4.0]), ""));
    let error = run(&options).map(|_| ()).expect_err("another surface");
    assert!(error.to_string().contains("`pit.stl` has changed since"), "{error}");
    let session = load().unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(session.simulation().model().n_blocks(), 48);

    fs::remove_file(path.join("pit.stl")).unwrap_or_else(|error| panic!("{error}"));
    assert!(matches!(run(&options), Err(RunFailure::Deck(DeckError::Wrong { .. }))));
    let summary = fs::read_to_string(path.join("out/summary.json")).unwrap_or_default();
    let found: ddem_io::summary::Summary =
        serde_json::from_str(&summary).unwrap_or_else(|error| panic!("{error}"));
    let [selection] = &found.selections[..] else { panic!("{:?}", found.selections) };
    assert_eq!((selection.what.as_str(), selection.blocks), ("remove 0", 16));
    assert_eq!((selection.volume, selection.holds), (16.0, Some(12.0)));
}
