//! Snapshots of the messages of files: decks, surfaces, topographies, and decks that programs make.

use std::fmt::Write;
use std::fs;
use std::sync::Arc;

use ddem_deck::*;

use crate::lint::text;
use crate::messages::messages;

/// Messages about a deck with a file `name` of each content, which `region` names.
fn of_contents(name: &str, region: &str, contents: &[&[u8]]) -> String {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("deck.toml");
    let deck = text(&[], &format!("[[remove]]\nwhere = {{ {region} }}\n"));
    fs::write(&path, deck).unwrap();
    let mut found = String::new();
    for content in contents {
        fs::write(folder.path().join(name), content).unwrap();
        let read = read(&path).map_err(|error| error.to_string());
        let built = read.and_then(|(deck, _)| {
            BuiltDeck::new(&deck).map(|_| ()).map_err(|error| error.to_string())
        });
        let error = built.expect_err("a message").replace(&*folder.path().to_string_lossy(), "DIR");
        writeln!(found, "{}", error.lines().last().unwrap()).unwrap();
    }
    found
}

#[test]
fn surfaces() {
    let facet = "facet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n";
    let open = format!("solid open\n{facet}endsolid open\n");
    let mut cut = vec![0; 80];
    cut.extend(11_u32.to_le_bytes());
    let found = of_contents(
        "pit.stl",
        "inside = 'pit.stl'",
        &[
            b"x",
            b"solid\nfacet of a diamond\n",
            b"solid none\nendsolid none\n",
            open.as_bytes(),
            &cut,
        ],
    );
    insta::assert_snapshot!(found);
}

#[test]
fn topographies() {
    let raster = |text: &str| format!("ncols 2\nnrows 2\n{text}");
    let corner = "xllcorner 0\nyllcorner 0\n";
    let rasters = [
        raster(&format!("{corner}1 1 1 1")),
        raster("xllcorner 0\ncellsize 2\n1 1 1 1"),
        raster(&format!("{corner}cellsize 2\n1 1 1")),
        raster(&format!("{corner}cellsize x\n1 1 1 1")),
        raster(&format!("{corner}cellsize 2\n1 1 1 x")),
        raster(&format!("{corner}cellsize 2\n1 1 -9999 1")),
        raster(&format!("{corner}cellsize 0\n1 1 1 1")),
    ];
    let diagonal: String = (0..60).map(|k| format!("{k},{k},1\n")).collect();
    let tables: [&[u8]; 9] = [
        diagonal.as_bytes(),
        b"0,0,1\n4,0,x\n",
        b"0,0,1\n4,0,1\n",
        b"0,0,1\n4,0,1\n0,4,1\n4,4,1\n0,0,2\n",
        b"0,0,1\n4,0,1\n0,4,1\n",
        b"0,0,1\n1,0,1\n2,0,1\n0,1,1\n1,1,1\n0,2,1\n5,5,1\n",
        b"0,0,1\n2,0,1\n0,4,1\n2,4,1\n",
        b"0,0,1\n\"4,0,1\n0,4,1\n",
        &[0, 159, 146, 150],
    ];
    let all: Vec<&[u8]> =
        tables.into_iter().chain(rasters.iter().map(|raster| raster.as_bytes())).collect();
    let found = of_contents("ground", "above = { topography = 'ground' }", &all);
    insta::assert_snapshot!(found);
}

#[test]
fn decks_that_cannot_be_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    fs::write(path("latin.toml"), b"title = 'a deck'\n# Gr\xfc\xdfe\n").unwrap();
    let mut found = String::new();
    for name in ["latin.toml", "missing.toml", ""] {
        let error = read(&path(name)).map(|_| ()).expect_err("no deck");
        let error = error.to_string().replace(&*folder.path().to_string_lossy(), "DIR");
        writeln!(found, "{error}").unwrap();
    }
    insta::assert_snapshot!(found);
}

/// Decks that a program makes may have contents that no file has.
#[test]
fn decks_of_programs() {
    let mut found = String::new();
    let mut add = |region: Where| {
        let (mut deck, _) = parse_alone(&text(&[], ""), "deck.toml").unwrap();
        deck.remove = vec![Remove { r#where: region, ..Remove::default() }];
        for fault in check(&deck) {
            writeln!(found, "{fault}").unwrap();
        }
    };
    let surface = |content: Option<Triangles>| Where {
        inside: Some(FileOf { path: "pit.stl".into(), content: content.map(Arc::new) }),
        ..Where::default()
    };
    add(surface(None));
    add(surface(Some(Triangles(vec![[[f64::NAN; 3]; 3]]))));
    let topography =
        FileOf { path: "ground".into(), content: Some(Arc::new(Heights::default().into())) };
    add(Where { above: Some(Sheet::Topography { topography }), ..Where::default() });
    let many: String = (0..70_000)
        .map(|k| format!("[materials.m{k}]\ndensity = 1\nyoung = 1e9\npoisson = 0.2\n"))
        .collect();
    writeln!(found, "{}", messages(&text(&[], &many))[0]).unwrap();
    insta::assert_snapshot!(found);
}

/// Lines of a report on a model.
#[test]
fn interfaces_and_selections() {
    let beside =
        "[[blocks]]\nname = 'beside'\norigin = [3, 0, 0]\nsize = [1, 1, 1]\nmaterial = 'rock'\n";
    let ball = "[[remove]]\nwhere = { sphere = { centre = [0, 0, 3], radius = 1.5 } }\n";
    let mut found = String::new();
    for more in [format!("{beside}{ball}"), format!("{beside}joint = 'seam'\n")] {
        let (deck, _) = parse(&text(&[], &more), "deck.toml").unwrap();
        let built = BuiltDeck::new(&deck).unwrap();
        built.interfaces().iter().for_each(|line| writeln!(found, "{line}").unwrap());
        built.selections().iter().for_each(|line| writeln!(found, "{line}").unwrap());
    }
    insta::assert_snapshot!(found);
}

/// A file of holes, which takes no room on the disk.
#[test]
fn very_large_decks_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("deck.toml");
    fs::File::create(&path).unwrap().set_len((1 << 30) + 1).unwrap();
    let error = read(&path).err().unwrap().to_string();
    insta::assert_snapshot!(error.replace(&*folder.path().to_string_lossy(), "DIR"));
}
