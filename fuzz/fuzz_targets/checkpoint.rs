//! Checkpoints: the file, and the state in it with a good seal.

#![no_main]

use std::sync::LazyLock;

use ddem_core::{Model, Saved, Simd, Simulation};
use ddem_deck::BuiltDeck;
use ddem_io::checkpoint::Checkpoint;
use libfuzzer_sys::fuzz_target;
use tempfile::TempDir;

static FOLDER: LazyLock<TempDir> = LazyLock::new(|| tempfile::tempdir().expect("a folder"));

const DECK: &str = "
[materials.rock]
density = 2400
young = 18e9
poisson = 0.25
[joints.seam]
normal_stiffness = 1e10
shear_stiffness = 1e10
cohesion = 1e5
[[blocks]]
size = [2, 1, 1]
count = [2, 1, 1]
divisions = 1
material = 'rock'
joint = 'seam'
";

fn model() -> Model {
    let (deck, _) = ddem_deck::parse_alone(DECK, "deck.toml").expect("a deck");
    BuiltDeck::new(&deck).expect("a model").model()
}

fuzz_target!(|data: &[u8]| {
    let path = FOLDER.path().join("checkpoint.h5");
    std::fs::write(&path, data).expect("a file");
    let _ = Checkpoint::load(&path);
    let _ = Simulation::restore(model(), Simd::default(), &Saved::from(data.to_vec()));
});
