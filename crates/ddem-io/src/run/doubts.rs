//! Warnings at the end of a stage.

use ddem_core::{ChargeState, Energy, Simulation};
use ddem_deck::{Damping, Stage, StageKind};

use super::resume::Cursor;

/// Part of the energy out of balance above which something is said.
const MUCH: f64 = 0.01;

/// Part of the volume of a cavity by which it may change until its charge goes off.
const CHANGED: f64 = 0.1;
/// Part of the energy that friction has taken above which blocks have slid.
const SLID: f64 = 0.1;

/// Warning about deformable blocks that slide where a deck has turned all damping off.
pub(super) fn flutter(
    simulation: &mut Simulation,
    stage: &Stage,
    begun: &Cursor,
) -> Option<String> {
    let contact = simulation.model().problem().properties.contact.damping_ratio();
    let undamped = stage.damping.unwrap_or_default() == Damping::None && contact == 0.0;
    if stage.kind == StageKind::Relax || !undamped {
        return None;
    }
    let energy = simulation.energy();
    let most = energy.kinetic.max(energy.external.abs());
    let model = simulation.model();
    let rigid = (0..model.n_blocks()).all(|block| model.is_rigid(block));
    (!rigid && energy.friction - begun.friction > SLID * most).then(|| {
        "deformable blocks have slid without damping (`damping` in `[contact]` is 0); such blocks flutter and \
         slide too easily: look whether 0.2 changes the answer"
            .to_owned()
    })
}

/// The charges of a deck at the present time, by their numbers.
pub(super) fn charges(simulation: &Simulation) -> impl Iterator<Item = (usize, ChargeState)> {
    (0..).map_while(|index| Some((index, simulation.charge(index)?)))
}

/// Warnings about charges that have gone off since, where the rock around was not what it was at
/// the start any more.
pub(super) fn gone_off(simulation: &Simulation, before: &[bool]) -> Vec<String> {
    let sizes = simulation.model().charges();
    let fresh = charges(simulation).zip(&sizes).zip(before).filter(|(_, off)| !**off);
    let said = fresh.filter_map(|(((index, charge), size), _)| {
        let part = charge.began.filter(|_| size.walls > 0)? / size.volume;
        if charge.vented && charge.began == Some(charge.volume) {
            return Some(format!(
                "charge {index} did nothing: when it went off its walls had moved apart, and the gas was out"
            ));
        }
        ((part - 1.0).abs() > CHANGED).then(|| {
            format!(
                "charge {index} went off in {:.3e} m³, {:.0} % of the room that there was at the start: the rock \
                 around had moved",
                part * size.volume,
                100.0 * part
            )
        })
    });
    said.collect()
}

/// Warning about energy that has gone out of balance in a stage.
pub(super) fn unbalanced_energy(energy: &Energy, before: f64, relax: bool) -> Option<String> {
    let help = if relax { "more `increments`" } else { "a shorter `time_step`" };
    let Energy { balance, contact, .. } = *energy;
    // What is lost has the other sign in `balance`.
    let (error, column, place) = if contact.abs() > balance.abs() {
        (-contact, "contact", " where blocks meet, part and turn on each other")
    } else {
        (balance, "balance", "")
    };
    let went = if error < 0.0 { "lost" } else { "gained" };
    let imbalance = energy.imbalance();
    (imbalance > MUCH && imbalance > before + 0.5 * MUCH).then(|| {
        format!(
            "{:.1} % of the largest energy is {went}{place} (`{column}` in energy.csv): look whether {help} \
             changes the answer",
            100.0 * imbalance
        )
    })
}
