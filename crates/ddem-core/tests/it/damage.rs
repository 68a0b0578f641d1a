//! Damaged saved states: they are refused, or the simulation runs or stops. Nothing panics.

use ddem_core::{RestoreError, Saved, Simd, Simulation};
use ddem_deck::{Deck, Kinematics, StageKind};

use crate::decks::*;

fn restore(deck: &Deck, bytes: Vec<u8>) -> Result<Simulation, RestoreError> {
    Simulation::restore(model(deck), Simd::default(), &Saved::from(bytes))
}

/// Truncates a saved state, extends it and changes it in many places.
pub(crate) fn withstands_damage(deck: &Deck, saved: &Saved, places: usize) {
    let whole = saved.bytes();
    let (n, mut random) = (whole.len(), Random::new(7));
    let mut any = |below: usize| ((0.5 + 0.5 * random.next()) * below as f64) as usize;
    for length in (0..100).chain((0..50).map(|_| any(n))).chain([n - 1]) {
        assert!(restore(deck, whole[..length].to_vec()).is_err(), "{length} of {n} bytes");
    }
    let longer = restore(deck, [whole, &[0]].concat());
    assert!(longer.is_err_and(|error| error.to_string().contains("bytes after the end")));
    let ends = (0..200.min(n)).chain(n.saturating_sub(100)..n);
    let places: Vec<usize> = ends.chain((0..places).map(|_| any(n))).collect();
    let (mut refused, mut stopped, mut ran) = (0, 0, 0);
    for at in places {
        let nan = f64::NAN.to_le_bytes();
        for wrong in [&[!whole[at]][..], &[whole[at] ^ 1], &[0], &[0xff], &nan] {
            println!("{wrong:?} at {at} of {n}");
            let mut bytes = whole.to_vec();
            bytes.iter_mut().skip(at).zip(wrong).for_each(|(byte, wrong)| *byte = *wrong);
            let Ok(mut simulation) = restore(deck, bytes) else {
                refused += 1;
                continue;
            };
            simulation.energy();
            simulation.tractions();
            simulation.contacts();
            let stage = deck.stage.get(simulation.stage());
            let relaxes = stage.is_some_and(|stage| stage.kind == StageKind::Relax);
            let moved = (0..3).try_for_each(|_| match relaxes {
                true => simulation.relax_step(1e-6).map(|_| ()),
                false => simulation.step(),
            });
            *if moved.is_ok() { &mut ran } else { &mut stopped } += 1;
        }
    }
    println!("{refused} refused, {stopped} stopped, {ran} ran");
    assert!(refused > 100, "{refused}");
}

/// An old saved state must not be read as a new one. If this test fails, a type in the state has
/// changed its fields: increase `FORMAT` and set the new length here.
#[test]
fn state_layout_change_needs_new_format() {
    let start = simulation(&crate::mixture::mixture(Kinematics::Corotational)).save();
    assert_eq!((start.bytes()[0], start.bytes().len()), (7, 81_804));
}

/// Errors distinguish the reasons and say what to do.
#[test]
fn foreign_states_are_refused_with_the_reason() {
    let deck = deck([2, 1, 1], [2.0, 1.0, 1.0], 2, 0.01);
    let saved = simulation(&deck).save();
    let restore_error = |other: &Deck, bytes: &[u8]| match restore(other, bytes.to_vec()) {
        Ok(_) => panic!("restored"),
        Err(error) => error.to_string(),
    };
    let finer = crate::decks::deck([2, 1, 1], [2.0, 1.0, 1.0], 3, 0.01);
    let other = restore_error(&finer, saved.bytes());
    assert!(other.contains("another model, with 54 nodes instead of 128"), "{other}");
    let mut bytes = saved.bytes().to_vec();
    bytes[0] += 1;
    let format = restore_error(&deck, &bytes);
    assert!(format.contains("run from the start"), "{format}");
    let damaged = restore_error(&deck, &saved.bytes()[..100]);
    assert!(damaged.contains("damaged"), "{damaged}");
}
