//! Runs saved after an excavation, when joints have failed and blocks have made contact.

use ddem_core::{FIELDS, Simd, Simulation};
use ddem_deck::*;

use crate::decks::*;

fn region(x: [f64; 2], z: [f64; 2]) -> Where {
    Where { x: Some(Extent::Range(x)), z: Some(Extent::Range(z)), ..Where::default() }
}

/// Two columns on a floor; the upper block of the second one is split into eight parts. Its outer
/// parts are pushed away from the first column. Then the layer of 2 cm below both upper blocks is
/// removed.
fn undermined() -> Deck {
    let mut deck = deck([2, 1, 3], [2.0, 1.0, 2.02], 2, 0.0);
    deck.materials.insert("rock".into(), Material { density: 2000.0, young: 1e8, poisson: 0.2 });
    let set = &mut deck.blocks[0];
    (set.size, set.count) = (None, None);
    set.edges = Some(Edges {
        x: Some(vec![0.0, 1.0, 2.0]),
        y: Some(vec![0.0, 1.0]),
        z: Some(vec![0.0, 1.0, 1.02, 2.02]),
    });
    deck.joints.insert(
        "seam".into(),
        Joint {
            normal_stiffness: Some(2e8),
            shear_stiffness: Some(1e8),
            cohesion: Some(2e4),
            tension: Some(1e4),
            friction: Some(30.0),
            ..Joint::default()
        },
    );
    deck.model.gravity = [0.0, 0.0, -9.81];
    deck.contact.damping = Some(0.1);
    deck.refine.push(Refine { r#where: region([1.0, 2.0], [1.02, 2.02]), factor: 2 });
    deck.fix.push(fix(plane(2, 0.0), "xyz"));
    // Only the outer four parts move, so some joints beside the others hold.
    deck.initial.push(Initial {
        r#where: region([1.5, 2.0], [1.5, 2.02]),
        velocity: Some([0.3, 0.1, 0.0]),
        ..Initial::default()
    });
    let stage =
        |name: &str| Stage { kind: StageKind::Dynamic, duration: Some(0.2), ..relax_stage(name) };
    deck.stage = vec![stage("before"), stage("dig")];
    let (region, from) = (region([0.0, 2.0], [1.0, 1.02]), Some("dig".to_owned()));
    deck.remove.push(Remove { r#where: region, from, release: Some(0.01), ..Remove::default() });
    deck
}

/// All fields, energies and counts, as bits.
fn state_bits(simulation: &mut Simulation) -> Vec<u64> {
    let mut state_bits: Vec<u64> = simulation.energy().values().map(f64::to_bits).into();
    for field in FIELDS {
        state_bits.extend(simulation.snapshot().values(&field).into_iter().map(f64::to_bits));
    }
    let counts = simulation.contact_counts();
    state_bits.extend([counts.points as u64, counts.block_pairs as u64, simulation.steps()]);
    state_bits.extend(simulation.failed_pairs());
    state_bits
}

fn run_until(simulation: &mut Simulation, until: f64) {
    while simulation.time() < until {
        simulation.step().unwrap_or_else(|error| panic!("{error}"));
    }
}

fn reloaded(simulation: &Simulation) -> Simulation {
    let restored = Simulation::restore(model(&undermined()), Simd::default(), &simulation.save());
    restored.unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn failed_joints_and_contacts_after_excavation_resume() {
    let mut whole = simulation(&undermined());
    let begun = whole.start(Damping::None, TimeStep::Auto, None);
    begun.unwrap_or_else(|error| panic!("{error}"));
    run_until(&mut whole, 0.02);
    let failed: u64 = whole.failed_pairs().iter().sum();
    assert!(failed > 0);
    whole.enter(1).unwrap_or_else(|error| panic!("{error}"));
    let mut at_once = reloaded(&whole);
    run_until(&mut whole, 0.03);
    let mut falling = reloaded(&whole);
    // The free fall of 2 cm takes 64 ms from the end of the release.
    run_until(&mut whole, 0.1);
    let mut met = reloaded(&whole);
    assert!(whole.failed_pairs().iter().sum::<u64>() > failed);
    assert!(whole.contact_counts().points > 0);
    // Some pairs of the nonconforming joints hold and some have failed.
    let states = ddem_core::fields(whole.model()).find(|field| field.name == "state");
    let states = states.map(|field| whole.snapshot().values(field)).unwrap_or_default();
    let matching: usize =
        whole.model().faces().iter().map(|f| (f.divisions as usize + 1).pow(2)).sum();
    let bonds = &states[matching..];
    assert!(bonds.contains(&0.0) && bonds.iter().any(|state| *state > 0.0), "{bonds:?}");
    run_until(&mut whole, 0.12);
    let seen_whole = state_bits(&mut whole);
    for (when, resumed) in [&mut at_once, &mut falling, &mut met].into_iter().enumerate() {
        run_until(resumed, 0.12);
        assert!(state_bits(resumed) == seen_whole, "saved at {when}");
    }
    assert!(whole.energy().imbalance() < 0.01, "{}", whole.energy().imbalance());
}
