//! The same bits on any number of threads and with any instruction set.

use std::path::Path;

use ddem_core::{Simd, Simulation};
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
    assert!(expected[0].len() > 10_000 && expected[1].len() > 10_000);
    for threads in [2, 3] {
        assert!(run(How { threads, ..How::default() }) == expected, "{threads} threads");
    }
    for (name, simd) in Simd::available() {
        assert!(run(How { simd, ..How::default() }) == expected, "{name}");
    }
}

/// Bits of displacements, velocities and stresses after some steps of both kinds.
fn state(threads: usize, simd: Simd) -> Vec<u64> {
    let deck = deck(&large());
    let model = deck.build().expect("a model");
    let mut simulation = Simulation::with_simd(model, simd);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
    pool.install(|| {
        simulation.enter(0).unwrap_or_else(|error| panic!("{error}"));
        simulation.relax(1e-5, 10_000).expect("equilibrium");
        simulation.enter(1).unwrap_or_else(|error| panic!("{error}"));
        let stage = deck.stage[1].clone();
        let damping = stage.damping.unwrap_or_default();
        simulation.start(damping, TimeStep::Auto, stage.duration).expect("a stable step");
        for _ in 0..100 {
            simulation.step().expect("finite numbers");
        }
        let (u, v) = (simulation.displacements(), simulation.velocities());
        let stresses = simulation.stresses().into_flattened();
        let tractions = simulation.tractions().into_flattened();
        let forces = simulation.internal_forces().into_flattened();
        let all = [u.into_flattened(), v.into_flattened(), stresses, tractions, forces];
        all.concat().into_iter().map(f64::to_bits).collect()
    })
}

#[test]
fn fields_are_identical_for_any_threads_and_simd() {
    let expected = state(1, Simd::default());
    for threads in [2, 3] {
        assert!(state(threads, Simd::default()) == expected, "{threads} threads");
    }
    for (name, simd) in Simd::available() {
        assert!(state(1, simd) == expected, "{name}");
    }
}
