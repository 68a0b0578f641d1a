//! The same bits with any number of threads and any instruction set.

use ddem_core::{Simd, Simulation};
use ddem_deck::{Damping, Deck, Load, Remove, Sphere, TimeStep, Where};

use crate::decks::*;

/// Loaded blocks with a hole, in numbers that fill whole packs and that do not.
fn cases() -> [Deck; 2] {
    [([4, 4, 4], BOX), ([5, 3, 4], LEANING)].map(|(count, axes)| {
        let size = count.map(f64::from);
        let mut deck = with_axes(deck(count, size, 4, 0.01), axes);
        let units = axes.map(|axis| Vec3::from(axis).normalize());
        let centre = (units[0] + units[1] + units[2]) * 1.5;
        let sphere = Some(Sphere { centre: centre.into(), radius: 0.01 });
        let region = Where { sphere, ..Where::default() };
        deck.remove.push(Remove { r#where: region, ..Remove::default() });
        deck.model.gravity = [1.0, 0.5, -9.81];
        deck.fix.push(fix(plane(2, 0.0), "xyz"));
        let force = Some([3e6, 1e6, -2e6]);
        deck.load.push(Load { force, ..Load::default() });
        deck
    })
}

fn run(deck: &Deck, damping: Damping, simd: Simd, threads: usize) -> (Vec<u64>, Vec<u64>, u64) {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    let pool = pool.unwrap_or_else(|error| panic!("{error}"));
    pool.install(|| {
        let mut simulation = Simulation::with_simd(model(deck), simd);
        let start = simulation.start(damping, TimeStep::Auto, None);
        start.unwrap_or_else(|error| panic!("{error}"));
        for _ in 0..200 {
            simulation.step().unwrap_or_else(|error| panic!("{error}"));
        }
        let velocities = simulation.velocities();
        let energy = simulation.energy().balance.to_bits();
        (bits(&simulation.displacements()), bits(&velocities), energy)
    })
}

#[test]
fn dynamic_bits_are_independent_of_threads_and_simd() {
    let dampings = [Damping::Local(0.3), Damping::Stiffness(2e-5)];
    for (case, deck) in cases().iter().enumerate() {
        let mut first = None;
        for (name, simd) in Simd::available() {
            for threads in [1, 2, 3, 8] {
                let result = run(deck, dampings[case % 2], simd, threads);
                let first = first.get_or_insert_with(|| result.clone());
                assert!(*first == result, "{name}, {threads} threads");
            }
        }
        assert!(first.is_some_and(|(u, ..)| u.iter().any(|bits| *bits != 0)));
    }
}

/// The same for a relaxation, whose sums decide when it restarts and ends.
#[test]
fn relaxation_bits_are_independent_of_threads_and_simd() {
    let deck = &cases()[1];
    let relax = |simd: Simd, threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.unwrap_or_else(|error| panic!("{error}")).install(|| {
            let mut simulation = Simulation::with_simd(model(deck), simd);
            let steps = simulation.relax(1e-4, 5000).unwrap_or_else(|error| panic!("{error}"));
            (steps, bits(&simulation.displacements()))
        })
    };
    let first = relax(Simd::available()[0].1, 1);
    for (name, simd) in Simd::available() {
        assert!(relax(simd, 3) == first, "{name}");
    }
}
