//! Blast of more than a thousand blocks, until they have flown apart.

use super::resume::everything;
use super::shared::{Frames, How, edited, root, run_into};

/// Deck of the example with a duration of 0.05 s.
fn blast() -> String {
    let text = std::fs::read_to_string(root("examples/blast.toml")).expect("the example");
    edited(&text, "duration = 0.02 ", "duration = 0.05 ")
}

#[test]
#[ignore = "takes minutes"]
fn large_blast_has_same_bits_on_two_threads_and_after_resume() {
    let [one, two] = [(); 2].map(|()| tempfile::tempdir().expect("a folder"));
    let clock = std::time::Instant::now();
    assert!(run_into(&blast(), one.path(), How::default()));
    println!("one thread: {:.0} s", clock.elapsed().as_secs_f64());
    let summary = ddem_io::summary::Summary::read(one.path().join("summary.json"));
    let summary = summary.expect("a summary");
    println!("{} blocks, {:?}", summary.blocks, summary.contacts);
    assert!(summary.blocks >= 1000);
    assert!(summary.stages[0].imbalance < 1e-2, "{}", summary.stages[0].imbalance);
    // The gap is that between the surfaces minus the thickness of the joint, 4 mm.
    let gaps = Frames::open(one.path().join("contacts.vtkhdf")).all("PointData", "gap");
    let deepest = -gaps.into_iter().fold(0.0, f64::min) - 0.004;
    println!("deepest in the frames: {deepest:.2e} m");
    assert!(deepest < 0.05 * 0.05, "{deepest} m in each other");
    // Interrupted while joints break, and resumed.
    let clock = std::time::Instant::now();
    let how = How { threads: 2, stop_after: Some(1500), ..How::default() };
    assert!(!run_into(&blast(), two.path(), how));
    let how = How { threads: 2, resume: true, ..How::default() };
    assert!(run_into(&blast(), two.path(), how));
    println!("two threads: {:.0} s", clock.elapsed().as_secs_f64());
    let (expected, found) = (everything(one.path()), everything(two.path()));
    for ((what, expected), (_, found)) in expected.iter().zip(&found) {
        assert!(expected == found, "{what} differs");
    }
}
