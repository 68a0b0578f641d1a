//! Blasts in free space: blocks of several sizes break, fly apart and collide.

use ddem_core::Simulation;
use ddem_deck::*;

use crate::decks::*;
use crate::unbonded_blocks::{all_corners, deepest, momenta};

fn within(from: [f64; 3], to: [f64; 3]) -> Where {
    let [x, y, z] = [0, 1, 2].map(|d| Some(Extent::Range([from[d], to[d]])));
    Where { x, y, z, ..Where::default() }
}

/// Two cubes of 1.6 m side by side but offset, each with small blocks around a charge.
fn two_charges() -> Deck {
    let mut deck = deck([4; 3], [1.6; 3], 1, 0.004);
    deck.model.kinematics = Kinematics::Corotational;
    let crack = Joint {
        cohesion: Some(10e6),
        tension: Some(5e6),
        friction: Some(45.0),
        residual_friction: Some(35.0),
        ..deck.joints["seam"].clone()
    };
    deck.joints.insert("seam".into(), crack);
    let shift = [1.63, 0.3, 0.1];
    // A second material name for the same rock tells the cubes apart.
    deck.materials.insert("other".into(), deck.materials["rock"]);
    let material = "other".into();
    deck.blocks.push(BlockSet { origin: shift, material, ..deck.blocks[0].clone() });
    for ([x, y, z], delay) in [([0.0; 3], 0.0), (shift, 1e-3)] {
        let around = |reach: f64| {
            let at = [x, y, z].map(|c| c + 0.8);
            within(at.map(|c| c - reach), at.map(|c| c + reach))
        };
        deck.refine.extend([0.4, 0.2].map(|reach| Refine { r#where: around(reach), factor: 2 }));
        deck.remove.push(Remove { r#where: around(0.1), ..Remove::default() });
        deck.charge.push(Charge {
            r#where: around(0.15),
            pressure: Some(2e8),
            gamma: Some(1.5),
            history: Some(ChargeHistory::Gas(GasWord::Gas)),
            delay: Some(delay),
            ..Charge::default()
        });
    }
    deck
}

/// Total momentum and angular momentum, relative to the sums of the sizes of their parts.
fn momentum_error(simulation: &mut Simulation) -> [f64; 2] {
    let (sums, sizes) = momenta(simulation);
    [0, 1].map(|k| sums[k].norm() / sizes[k])
}

#[test]
fn flying_and_colliding_fragments_keep_momentum() {
    let deck = two_charges();
    let mut simulation = simulation(&deck);
    let warnings = crate::decks::warnings(&deck);
    assert!(warnings.is_empty(), "{warnings:?}");
    simulation
        .start(Damping::None, TimeStep::Auto, Some(0.012))
        .unwrap_or_else(|error| panic!("{error}"));
    let (mut worst, mut deep, mut across) = ([0.0_f64; 2], f64::NEG_INFINITY, 0);
    while simulation.steps_left() != Some(0) {
        simulation.step().unwrap_or_else(|error| panic!("{error}"));
        if !simulation.steps().is_multiple_of(50) {
            continue;
        }
        let now = momentum_error(&mut simulation);
        worst = [0, 1].map(|k| worst[k].max(now[k]));
        deep = deep.max(deepest(&all_corners(&simulation), 0).0);
        let contacts = simulation.contacts();
        let cube = |block: usize| simulation.model().material(block);
        across += contacts.iter().filter(|c| cube(c.blocks[0]) != cube(c.blocks[1])).count();
    }
    let fragments = simulation.fragments();
    let energy = simulation.energy();
    println!(
        "{} blocks, {} steps, {} fragments, left over {worst:?}, deepest {deep}, {across} across, {energy:?}",
        simulation.model().n_blocks(),
        simulation.steps(),
        fragments.len()
    );
    assert!(fragments.len() > 100 && across > 10, "{} {across}", fragments.len());
    assert!(worst[0] < 1e-12 && worst[1] < 1e-9, "{worst:?}");
    assert!(deep < 0.01, "{deep}");
    assert!(energy.balance.abs() < 1e-2 * energy.external_work, "{energy:?}");
}

/// Warnings name the faces and joints on which the gas does not act.
#[test]
fn charge_at_nonconforming_faces_warns() {
    let mut deck = two_charges();
    deck.blocks.truncate(1);
    deck.refine.truncate(2);
    deck.remove.truncate(1);
    deck.charge.truncate(1);
    let warnings = |deck: &Deck| crate::decks::warnings(deck).join("\n");
    assert_eq!(warnings(&deck), "");
    // The cell lies at the edge of the small blocks.
    let cell = within([0.6, 0.7, 0.7], [0.7, 0.9, 0.9]);
    deck.remove[0].r#where = cell;
    deck.charge[0].r#where = within([0.55, 0.65, 0.65], [0.75, 0.95, 0.95]);
    let message = warnings(&deck);
    assert!(message.contains("borders on blocks") && !message.contains("outside"), "{message}");
    // The charge lies in joints, some conforming and some not.
    deck.remove.clear();
    deck.charge[0].r#where = within([0.55, 0.71, 0.71], [0.75, 0.89, 0.89]);
    let message = warnings(&deck);
    assert!(message.contains("4 joints between faces that do not match"), "{message}");
    deck.charge[0].r#where = within([0.59, 0.71, 0.71], [0.61, 0.79, 0.79]);
    let faults = deck.build().err().map(|error| error.faults).unwrap_or_default();
    let help = faults.first().and_then(|fault| fault.help.as_deref()).unwrap_or_default();
    assert!(help.contains("faces that do not match"), "{faults:?}");
}
