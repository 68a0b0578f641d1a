//! A saved simulation continues with the same bits; scratch space holds no state.

use ddem_core::{Relaxed, Saved, Simd, Simulation};
use ddem_deck::{Damping, Deck, Extent, Fix, History, Kinematics, Load, TimeStep};

use crate::decks::*;

/// Two stages with weight, a ramped load and a driven side.
fn jointed() -> Deck {
    let mut deck = with_axes(deck([3, 2, 2], [3.0, 2.0, 2.0], 2, 0.02), LEANING);
    deck.model.gravity = [0.0, 0.0, -9.81];
    deck.fix.push(fix(plane(2, 0.0), "xyz"));
    deck.load.push(Load {
        force: Some([1e6, 2e6, 0.0]),
        history: Some(History::Ramp(1e-2)),
        ..Load::default()
    });
    deck.load.push(Load {
        force: Some([0.0, 1e6, 0.0]),
        from: Some("b".into()),
        ..Load::default()
    });
    deck.stage = vec![relax_stage("a"), relax_stage("b")];
    deck.fix.push(Fix {
        velocity: Some([0.0, 0.0, 0.1]),
        from: Some("b".into()),
        ..fix(plane(0, 0.0), "z")
    });
    deck
}

fn reloaded(deck: &Deck, saved: &Saved) -> Simulation {
    let restored = Simulation::restore(model(deck), Simd::default(), saved);
    restored.unwrap_or_else(|error| panic!("{error}"))
}

fn step(simulation: &mut Simulation) {
    simulation.step().unwrap_or_else(|error| panic!("{error}"));
}

fn start(simulation: &mut Simulation, damping: Damping) {
    let start = simulation.start(damping, TimeStep::Auto, Some(0.02));
    start.unwrap_or_else(|error| panic!("{error}"));
}

/// All outputs, as bits.
fn state_bits(simulation: &mut Simulation) -> Vec<u64> {
    let nodes: Vec<u32> = (0..simulation.model().n_nodes() as u32).collect();
    let mut state_bits = bits(&simulation.displacements());
    state_bits.extend(bits(&simulation.velocities()));
    state_bits.extend(bits(&[simulation.reaction(&nodes)]));
    state_bits.extend(bits(&simulation.tractions()));
    state_bits.extend(simulation.stresses().iter().flatten().map(|x| x.to_bits()));
    state_bits.extend(simulation.energy().values().map(f64::to_bits));
    state_bits.extend(
        [simulation.time(), simulation.time_step(), simulation.unbalanced()].map(f64::to_bits),
    );
    state_bits.push(simulation.steps());
    state_bits
}

const DAMPINGS: [Damping; 4] =
    [Damping::None, Damping::Ratio(0.05), Damping::Mass(200.0), Damping::Local(0.7)];

#[test]
fn dynamic_run_resumes_from_any_step() {
    let deck = jointed();
    for damping in DAMPINGS {
        let mut whole = simulation(&deck);
        start(&mut whole, damping);
        for at in 0..40 {
            if [0, 1, 2, 17, 39].contains(&at) {
                let saved = whole.save();
                let mut resumed = reloaded(&deck, &saved);
                assert!(resumed.save() == saved, "{damping:?}: saved again at step {at}");
                assert!(
                    state_bits(&mut resumed) == state_bits(&mut whole),
                    "{damping:?} at step {at}"
                );
                let mut here = reloaded(&deck, &saved);
                (0..10).for_each(|_| step(&mut here));
                let mut there = reloaded(&deck, &saved);
                (0..10).for_each(|_| step(&mut there));
                assert!(state_bits(&mut here) == state_bits(&mut there), "{damping:?}");
            }
            step(&mut whole);
        }
    }
}

#[test]
fn run_resumed_at_every_step_has_same_bits() {
    let deck = jointed();
    for damping in DAMPINGS {
        let mut whole = simulation(&deck);
        start(&mut whole, damping);
        // Rebuilt at every step, so that state kept in scratch space would be lost.
        let mut rebuilt = reloaded(&deck, &whole.save());
        for at in 0..60 {
            step(&mut whole);
            step(&mut rebuilt);
            rebuilt = reloaded(&deck, &rebuilt.save());
            assert!(rebuilt.save() == whole.save(), "{damping:?}, step {at}");
        }
        assert!(state_bits(&mut rebuilt) == state_bits(&mut whole), "{damping:?}");
    }
}

/// Relaxes for at most `steps` steps; returns true at equilibrium.
fn relax(simulation: &mut Simulation, steps: usize) -> bool {
    (0..steps).any(|_| match simulation.relax_step(1e-6) {
        Ok(relaxed) => relaxed == Relaxed::Done,
        Err(error) => panic!("{error}"),
    })
}

#[test]
fn relaxation_resumes_from_any_step() {
    let deck = jointed();
    let mut whole = simulation(&deck);
    whole.start_relaxation(3).unwrap_or_else(|error| panic!("{error}"));
    let mut rebuilt = reloaded(&deck, &whole.save());
    let (mut done, mut steps) = (false, 0);
    while !done {
        assert!(rebuilt.save() == whole.save(), "saved at step {steps}");
        assert!(state_bits(&mut rebuilt) == state_bits(&mut whole), "state at step {steps}");
        let n = if steps < 5 { 1 } else { 13 };
        done = relax(&mut whole, n);
        assert_eq!(relax(&mut rebuilt, n), done);
        rebuilt = reloaded(&deck, &rebuilt.save());
        steps += n;
        assert!(steps < 20_000, "not in equilibrium");
    }
    assert!(state_bits(&mut rebuilt) == state_bits(&mut whole), "at the end");
}

/// A resume after a static stage and one between two dynamic stages.
#[test]
fn checkpoint_between_stages_resumes() {
    let deck = jointed();
    let mut whole = simulation(&deck);
    whole.start_relaxation(1).unwrap_or_else(|error| panic!("{error}"));
    assert!(relax(&mut whole, 20_000));
    whole.finish_relaxation();
    let mut resumed = reloaded(&deck, &whole.save());
    assert!(state_bits(&mut resumed) == state_bits(&mut whole), "after the relaxation");
    for damping in [Damping::Ratio(0.02), Damping::Stiffness(1e-5), Damping::Local(0.5)] {
        for simulation in [&mut whole, &mut resumed] {
            simulation.enter(1).unwrap_or_else(|error| panic!("{error}"));
            start(simulation, damping);
            (0..25).for_each(|_| step(simulation));
        }
        assert!(state_bits(&mut resumed) == state_bits(&mut whole), "{damping:?}");
        assert!(resumed.save() == whole.save(), "{damping:?}");
        resumed = reloaded(&deck, &resumed.save());
    }
    for simulation in [&mut whole, &mut resumed] {
        simulation.synchronise();
    }
    assert!(state_bits(&mut resumed) == state_bits(&mut whole), "settled");
    let energy = whole.energy();
    assert!(energy.balance.abs() < 1e-3 * energy.external_work.abs(), "{energy:?}");
}

/// `increments` apply loads in equal parts from their previous values: displacements of the linear
/// model follow them.
#[test]
fn increments_apply_loads_in_equal_parts() {
    let mut deck = jointed();
    deck.model.kinematics = Kinematics::Small;
    let mut simulation = simulation(&deck);
    let mut relax = |increments: u32, stage: usize| {
        simulation.enter(stage).unwrap_or_else(|error| panic!("{error}"));
        simulation.start_relaxation(increments).unwrap_or_else(|error| panic!("{error}"));
        let mut parts = Vec::new();
        for _ in 0..20_000 {
            let relaxed = simulation.relax_step(1e-8).unwrap_or_else(|error| panic!("{error}"));
            if relaxed != Relaxed::Moving {
                parts.push(Vec3::from(simulation.displacement(simulation.model().n_nodes() - 1)));
            }
            if relaxed == Relaxed::Done {
                break;
            }
        }
        simulation.finish_relaxation();
        assert_eq!(parts.len(), increments as usize);
        parts
    };
    let near = |a: Vec3, b: Vec3, size: f64| assert!((a - b).norm() < 1e-5 * size, "{a} {b}");
    // Weight is applied in three parts from zero; the ramp is still at zero.
    let weight = relax(3, 0);
    for (i, part) in weight.iter().enumerate() {
        near(*part, weight[2] * (i + 1) as f64 / 3.0, weight[2].norm());
    }
    // The second load is added in two parts.
    let loaded = relax(2, 1);
    near(loaded[0], (weight[2] + loaded[1]) / 2.0, loaded[1].norm());
    assert!((loaded[1] - weight[2]).norm() > 0.1 * weight[2].norm());
}

/// Stack of rigid blocks on joints without bond, pushed so that it opens and slides.
fn dry() -> Deck {
    let mut deck = deck([2, 1, 3], [2.0, 1.0, 3.0], 1, 0.0);
    deck.blocks[0].body = ddem_deck::Body::Rigid;
    let section = deck.joints.values_mut().next();
    let section = section.unwrap_or_else(|| panic!("a joint"));
    section.material = None;
    (section.normal_stiffness, section.shear_stiffness) = (Some(1e9), Some(5e8));
    section.friction = Some(20.0);
    deck.model.gravity = [0.0, 0.0, -9.81];
    let mut base = plane(0, 0.0);
    base.x = None;
    base.z = Some(Extent::Range([0.0, 1.0]));
    deck.fix.push(fix(base, "xyz"));
    let mut top = plane(0, 0.0);
    top.x = None;
    top.z = Some(Extent::Range([2.0, 3.0]));
    deck.load.push(Load {
        r#where: top,
        force: Some([6e4, 1e3, 0.0]),
        history: Some(History::Ramp(2e-2)),
        ..Load::default()
    });
    deck
}

/// Joints without strength are released in the steps around the one that waits for the first
/// failure. A run saved and resumed at any of these steps is the same, on any number of threads.
#[test]
fn joints_without_strength_resume_from_any_step_on_any_threads() {
    let deck = dry();
    let on = |threads: usize, work: &(dyn Fn() -> (Vec<u64>, Vec<u64>) + Sync)| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.unwrap_or_else(|error| panic!("{error}")).install(work)
    };
    let run = |every: u64| {
        let mut simulation = simulation(&deck);
        let started = simulation.start(Damping::None, TimeStep::Auto, None);
        started.unwrap_or_else(|error| panic!("{error}"));
        let (mut failed, mut released) = (Vec::new(), 0);
        while simulation.time() < 0.03 {
            step(&mut simulation);
            failed.push(simulation.failed_pairs().iter().sum());
            released = crate::unbonded_blocks::contacts(&mut simulation)[1];
            // All of the first steps with failures, and some later ones.
            let early = failed.iter().filter(|&&failed| failed > 0).count() < 20;
            if every > 0 && (early || simulation.steps().is_multiple_of(every)) {
                let saved = simulation.save();
                simulation = reloaded(&deck, &saved);
            }
        }
        assert!(released > 0 && failed.last().is_some_and(|&failed| failed > 4), "{released}");
        (state_bits(&mut simulation), failed)
    };
    let whole = on(1, &|| run(0));
    assert!(whole == on(1, &|| run(7)), "resumed");
    assert!(whole == on(3, &|| run(0)), "three threads");
    assert!(whole == on(2, &|| run(5)), "resumed on two threads");
}
