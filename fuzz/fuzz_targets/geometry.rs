//! Files that decks name: topographies, surfaces, tables of fractures, and the rock of regions.

#![no_main]

use std::sync::LazyLock;

use ddem_deck::BuiltDeck;
use libfuzzer_sys::fuzz_target;
use tempfile::TempDir;

static FOLDER: LazyLock<TempDir> = LazyLock::new(|| tempfile::tempdir().expect("a folder"));

const MATTER: &str = "
[materials.rock]
density = 2400
young = 18e9
poisson = 0.25
[joints.seam]
normal_stiffness = 1e10
shear_stiffness = 1e10
";
const REGION: &str = "
[[region]]
box = { from = [0, 0, 0], to = [3, 3, 3] }
material = 'rock'
[[cut]]
joint = 'seam'
";
const FILE: &str = "
[[region]]
material = 'rock'
joint = 'seam'
";
const BLOCKS: &str = "
[[blocks]]
size = [4, 4, 4]
count = [2, 2, 2]
divisions = 1
material = 'rock'
joint = 'seam'
[[remove]]
where = { above = { topography = 'file' } }
";

// The first byte chooses the kind of the file.
fuzz_target!(|data: &[u8]| {
    let Some((kind, bytes)) = data.split_first() else { return };
    let (name, rest) = match kind % 6 {
        0 => ("file", BLOCKS.to_owned()),
        1 => ("file", format!("{REGION}surface = 'file'\n")),
        2 => ("file", format!("{REGION}dfn = {{ file = 'file' }}\n")),
        3 => ("file.stl", "[[region]]\nmaterial = 'rock'\nfile = 'file.stl'\n".to_owned()),
        4 => ("file.obj", format!("{FILE}file = 'file.obj'\n")),
        _ => ("file.tess", format!("{FILE}file = 'file.tess'\n")),
    };
    std::fs::write(FOLDER.path().join(name), bytes).expect("a file");
    let path = FOLDER.path().join("deck.toml");
    std::fs::write(&path, format!("{MATTER}{rest}")).expect("a file");
    if let Ok((deck, _)) = ddem_deck::read(&path) {
        let _ = BuiltDeck::new(&deck);
    }
});
