//! Rigid and deformable blocks in contact, and joints that contacts replace. The bytes are the same
//! however a deck is run and after any interruption; impossible states in its checkpoint are
//! refused.

use std::path::Path;

use ddem_core::Simd;
use ddem_io::checkpoint::{self, Checkpoint};
use ddem_io::folder::Earlier;
use ddem_io::run::{Options, run};

use super::resume::{everything, interrupted};
use super::shared::{Frames, How, StopAfter, run_into};

/// Two walls with weak joints, one of them rigid, on a floor. A driven block breaks them, and
/// another block falls on the rubble.
pub(crate) fn rubble() -> String {
    let wall = |name: &str, y: f64, body: &str| {
        format!(
            "[[blocks]]\nname = '{name}'\nbody = '{body}'\norigin = [0, {y}, 0]\nsize = [1.5, 0.8, 1]\n\
             count = [3, 1, 2]\ndivisions = 2\nmaterial = 'soft'\njoint = '{name}'\n"
        )
    };
    let block = |name: &str, origin: &str, axes: &str| {
        format!(
            "[[blocks]]\nname = '{name}'\norigin = {origin}\naxes = {axes}\nsize = [0.5, 0.6, 0.4]\n\
             divisions = 2\nmaterial = 'soft'\n"
        )
    };
    let walls = [wall("spring", 0.0, "rigid"), wall("seam", 1.0, "deformable")].concat();
    let straight = "[[1, 0, 0], [0, 1, 0], [0, 0, 1]]";
    let turned = "[[0.8, 0.6, 0], [-0.36, 0.48, 0.8], [0.48, -0.64, 0.6]]";
    let rams = [
        block("ram", "[-0.6, 0.1, 0.5]", straight)
            .replace("[[blocks]]", "[[blocks]]\nbody = 'rigid'"),
        block("soft ram", "[-0.6, 1.1, 0.5]", straight),
        block("falls", "[0.8, 0.8, 1.4]", turned),
    ];
    let strength = "cohesion = 1e4\ntension = 5e3\nfriction = 30\nresidual_friction = 20\n";
    format!(
        "[materials.soft]\ndensity = 2400\nyoung = 1e8\npoisson = 0.25\n\
         [joints.spring]\nnormal_stiffness = 2e8\nshear_stiffness = 1e8\n{strength}\
         [joints.seam]\nthickness = 0.01\nmaterial = 'soft'\n{strength}\
         [model]\ngravity = [0, 0, -9.81]\n[contact]\ndamping = 0.1\n{walls}{}\
         [[blocks]]\nname = 'floor'\nbody = 'rigid'\norigin = [-2, -1, -0.5]\nsize = [6, 4, 0.5]\n\
         material = 'soft'\n\
         [[fix]]\nwhere = {{ set = 'floor' }}\naxes = 'xyz'\n\
         [[fix]]\nwhere = {{ set = 'ram' }}\naxes = 'xyz'\nvelocity = [4, 0, 0]\n\
         [[initial]]\nwhere = {{ set = 'soft ram' }}\nvelocity = [12, 0, 0]\n\
         [[stage]]\nname = 'hit'\nkind = 'dynamic'\nduration = 0.12\nframes = 5\n\
         damping = {{ ratio = 0.01 }}\n\
         [[stage]]\nname = 'rest'\nkind = 'dynamic'\nduration = 0.1\nframes = 3\n\
         damping = {{ local = 0.5 }}\n\
         [[probe]]\nname = 'falls'\nwhere = {{ set = 'falls' }}\nevery = 1e-3\n\
         [[probe]]\nname = 'floor'\nquantity = 'reaction'\nwhere = {{ set = 'floor' }}\nevery = 1e-3\n",
        rams.concat()
    )
}

fn files(how: How) -> Vec<(String, Vec<u64>)> {
    let folder = tempfile::tempdir().expect("a folder");
    assert!(run_into(&rubble(), folder.path(), how));
    everything(folder.path())
}

fn compare(expected: &[(String, Vec<u64>)], found: &[(String, Vec<u64>)], how: &str) {
    for ((what, expected), (_, found)) in expected.iter().zip(found) {
        assert!(expected == found, "{what} differs, {how}");
    }
}

#[test]
fn rubble_results_are_identical_for_any_threads_and_simd() {
    let expected = files(How::default());
    for threads in [2, 3] {
        compare(
            &expected,
            &files(How { threads, ..How::default() }),
            &format!("{threads} threads"),
        );
    }
    for (name, simd) in Simd::available() {
        compare(&expected, &files(How { simd, ..How::default() }), name);
    }
}

#[test]
fn run_interrupted_during_contact_resumes() {
    let (expected, steps) = interrupted(&rubble(), &[]);
    let [hit, rest] = [steps[0], steps[1]];
    println!("steps of the stages: {steps:?}");
    let stops: [&[u64]; 9] = [
        &[0],
        &[1],
        &[2, 1, 0, 1],
        &[hit / 7, hit / 5, hit / 3],
        &[hit / 2, 1, 1],
        &[hit - 1, 1],
        &[hit],
        &[hit + 1, 1],
        &[hit + rest / 2, rest / 3],
    ];
    for stops in stops {
        let (found, steps_found) = interrupted(&rubble(), stops);
        assert_eq!(steps_found, steps, "stopped after {stops:?}");
        compare(&expected, &found, &format!("after stops at {stops:?}"));
    }
}

/// Resumes from a checkpoint with another state, and returns the error message.
fn resumed(folder: &Path, state: &[u8]) -> String {
    let path = folder.join("checkpoint.h5");
    let whole = Checkpoint::load(&path).expect("a checkpoint");
    checkpoint::save(&path, &whole.deck, &whole.run, state).expect("a file");
    let (deck, source) = ddem_deck::parse(&rubble(), "test.toml").expect("a deck");
    let options = Options { earlier: Earlier::Resume, ..Options::new(folder) };
    let outcome = run(&deck, &source, &options, &mut StopAfter(5));
    checkpoint::save(&path, &whole.deck, &whole.run, &whole.state).expect("a file");
    outcome.err().map_or_else(String::new, |error| error.to_string())
}

#[test]
fn impossible_checkpoint_state_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let how = How { stop_after: Some(800), ..How::default() };
    assert!(!run_into(&rubble(), folder.path(), how));
    let whole = Checkpoint::load(folder.path().join("checkpoint.h5")).expect("a file").state;
    let changed = |at: usize, value: u8| {
        let mut changed = whole.clone();
        changed[at] = value;
        changed
    };
    // The number of blocks follows the format number.
    for (wrong, reason) in [
        (Vec::new(), "damaged"),
        (whole[..whole.len() - 1].to_vec(), "damaged"),
        (whole[..whole.len() / 2].to_vec(), "damaged"),
        ([&whole[..], &[0]].concat(), "bytes after the end"),
        (changed(0, whole[0] + 1), "run from the start"),
        (changed(1, whole[1] + 1), "another model"),
    ] {
        let message = resumed(folder.path(), &wrong);
        assert!(
            message.contains("checkpoint.h5` cannot be resumed") && message.contains(reason),
            "{message}"
        );
    }
    assert!(run_into(&rubble(), folder.path(), How { resume: true, ..How::default() }));
}

/// Three blocks of 24 kN that come to rest on each other and on fixed ground.
const PILE: &str = "
[model]
gravity = [0, 0, -10]
[materials.rock]
density = 2400
young = 1e8
poisson = 0.25
[[blocks]]
name = 'ground'
body = 'rigid'
origin = [-1, -1, -1]
size = [3, 3, 1]
material = 'rock'
[[blocks]]
origin = [0, 0, 0]
size = [1, 1, 1]
divisions = 2
material = 'rock'
[[blocks]]
body = 'rigid'
origin = [0.05, 0.03, 1]
size = [1, 1, 1]
material = 'rock'
[[blocks]]
body = 'rigid'
origin = [0.1, 0.0, 2.05]
size = [1, 1, 1]
material = 'rock'
[[fix]]
where = { set = 'ground' }
axes = 'xyz'
[[stage]]
name = 'rest'
kind = 'dynamic'
duration = 2.0
frames = 4
damping = { local = 0.8 }
";

/// Sums that an engineer takes from the file: at each level the contacts carry the weight above.
#[test]
fn contact_forces_in_results_carry_weight() {
    let folder = tempfile::tempdir().expect("a folder");
    assert!(run_into(PILE, folder.path(), How::default()));
    let frames = Frames::open(folder.path().join("contacts.vtkhdf"));
    assert_eq!(frames.times().len(), 5);
    let [force, blocks, area, traction, normal] =
        ["force", "blocks", "area", "traction", "normal"].map(|name| frames.at(name, 4));
    let (force, blocks) = (force.as_chunks::<3>().0, blocks.as_chunks::<2>().0);
    let (traction, normal) = (traction.as_chunks::<3>().0, normal.as_chunks::<3>().0);
    for level in 0..3 {
        let here = |at: &usize| blocks[*at] == [f64::from(level), f64::from(level + 1)];
        let all = (0..blocks.len()).filter(here);
        let sum = |c: usize| all.clone().map(|at| force[at][c]).sum::<f64>();
        let weight = f64::from(3 - level) * 24e3;
        let sums = [0, 1, 2].map(sum);
        assert!((sums[2] / weight + 1.0).abs() < 1e-4, "level {level}: {sums:?}");
        assert!(sums[0].hypot(sums[1]) < 1e-4 * weight, "level {level}: {sums:?}");
    }
    for at in 0..blocks.len() {
        let along: f64 = (0..3).map(|c| traction[at][c] * normal[at][c]).sum();
        assert!(
            along < 0.0 && (0..3).all(|c| (traction[at][c] * area[at] - force[at][c]).abs() < 1e-6)
        );
    }
    // At the start the last block hangs in the air, and no contact carries force yet.
    assert!(frames.at("gap", 0).is_empty());
    let summary = ddem_io::summary::Summary::read(folder.path().join("summary.json"));
    let contacts = summary.expect("a summary").contacts;
    assert_eq!((contacts.block_pairs, contacts.points), (3, blocks.len() as u64));
    let deepest = frames.at("gap", 4).into_iter().fold(0.0_f64, |most, gap| most.max(-gap));
    assert!((contacts.deepest / deepest - 1.0).abs() < 1e-9, "{contacts:?} {deepest}");
}
