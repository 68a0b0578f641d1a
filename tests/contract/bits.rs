//! The same bits on any number of threads and with any instruction set.

use std::path::Path;

use ddem_core::{FIELDS, Simd, Simulation};
use ddem_deck::TimeStep;

use super::decks::mixed;
use super::shared::{How, deck, run_into};

/// Deck large enough for several parallel tasks.
fn large() -> String {
    let text = mixed().replace("divisions = 2", "divisions = 4");
    assert!(deck(&text).build().expect("a model").n_nodes() > 3000);
    text
}

/// Tables of a run.
fn tables(folder: &Path) -> [Vec<u8>; 2] {
    ["probes.csv", "energy.csv"].map(|name| std::fs::read(folder.join(name)).expect("a table"))
}

fn run(how: How) -> [Vec<u8>; 2] {
    let folder = tempfile::tempdir().expect("a folder");
    assert!(run_into(&large(), folder.path(), how));
    tables(folder.path())
}

#[test]
fn tables_are_identical_for_any_threads_and_simd() {
    let expected = run(How::default());
    for (table, rows) in expected.iter().zip([100, 10]) {
        assert!(table.iter().filter(|&&byte| byte == b'\n').count() > rows);
    }
    for threads in [2, 3] {
        assert!(run(How { threads, ..How::default() }) == expected, "{threads} threads");
    }
    for (name, simd) in Simd::available() {
        assert!(run(How { simd, ..How::default() }) == expected, "{name}");
    }
}

/// Failed pairs, and the bits of all outputs, after a relaxation and some steps in time.
pub(crate) fn output_bits(
    text: &str,
    threads: usize,
    simd: Simd,
    steps: usize,
) -> ([u64; 2], Vec<u64>) {
    let deck = deck(text);
    let mut simulation = Simulation::with_simd(deck.build().expect("a model"), simd);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
    pool.install(|| {
        simulation.enter(0).unwrap_or_else(|error| panic!("{error}"));
        simulation.relax(1e-5, 10_000).expect("equilibrium");
        simulation.enter(1).unwrap_or_else(|error| panic!("{error}"));
        let stage = deck.stage[1].clone();
        let damping = stage.damping.unwrap_or_default();
        simulation.start(damping, TimeStep::Auto, stage.duration).expect("a stable step");
        for _ in 0..steps {
            simulation.step().expect("finite numbers");
        }
        let mut bits: Vec<u64> =
            simulation.energy().values().into_iter().map(f64::to_bits).collect();
        for field in FIELDS {
            bits.extend(simulation.snapshot().values(&field).into_iter().map(f64::to_bits));
        }
        let forces = simulation.internal_forces().into_flattened();
        bits.extend(forces.into_iter().map(f64::to_bits));
        (simulation.failed_pairs(), bits)
    })
}

#[test]
fn fields_are_identical_for_any_threads_and_simd() {
    let text = large();
    let expected = output_bits(&text, 1, Simd::default(), 100);
    for threads in [2, 3] {
        assert!(output_bits(&text, threads, Simd::default(), 100) == expected, "{threads} threads");
    }
    for (name, simd) in Simd::available() {
        assert!(output_bits(&text, 1, simd, 100) == expected, "{name}");
    }
}
