//! Warnings during a run.

use ddem_core::problem::DAMPING;
use ddem_core::{ChargeState, Energy, Simulation};
use ddem_deck::lint::{Code, Diagnostic};
use ddem_deck::{Damping, Deck, Stage, StageKind};

use super::resume::Cursor;
use super::{Event, Observer};

/// Energy imbalance, relative to the largest energy, above which a warning is issued.
const MUCH: f64 = 0.01;
/// Largest relative change of the volume of a cavity before its charge detonates.
const CHANGED: f64 = 0.1;
/// Friction loss, relative to the energy, above which blocks have slid.
const SLID: f64 = 0.1;

/// Key path of a stage; without a number if the stage is not in the deck.
pub(super) fn stage_place(deck: &Deck, stage: &Stage) -> String {
    let index = deck.stage.iter().position(|own| own.name == stage.name);
    index.map_or_else(|| "stage".to_owned(), |index| format!("stage[{index}]"))
}

impl Cursor {
    /// Reports a diagnostic and keeps it for the summary, unless the deck allows it.
    pub(super) fn warn(&mut self, deck: &Deck, warning: Diagnostic, observer: &mut dyn Observer) {
        if self.keep(deck, &warning) {
            observer.event(Event::Warning(&warning));
        }
    }

    /// Keeps a diagnostic for the summary, once. Returns false if the deck allows it.
    pub(super) fn keep(&mut self, deck: &Deck, warning: &Diagnostic) -> bool {
        let reports = deck.reports(warning);
        if reports && !self.warnings.contains(warning) {
            self.warnings.push(warning.clone());
        }
        reports
    }
}

/// Warning about deformable blocks that slide while a deck has switched off all damping.
pub(super) fn undamped_sliding(
    simulation: &mut Simulation,
    stage: &Stage,
    begun: &Cursor,
) -> Option<Diagnostic> {
    let contact = simulation.model().problem().properties.contact.damping_ratio();
    let undamped = stage.damping.unwrap_or_default() == Damping::None && contact == 0.0;
    if stage.kind == StageKind::Relax || !undamped {
        return None;
    }
    let energy = simulation.energy();
    let most = energy.kinetic.max(energy.external_work.abs());
    let model = simulation.model();
    let rigid = (0..model.n_blocks()).all(|block| model.is_rigid(block));
    (!rigid && energy.friction - begun.friction > SLID * most).then(|| {
        let message =
            "deformable blocks slid without damping: they vibrate, which reduces their friction";
        let help = format!("check whether `damping = {DAMPING}` in `[contact]` changes the result");
        Diagnostic::warning(Code::UndampedSliding, "contact.damping", message, help)
    })
}

/// Charges of a deck at the present time, by their numbers.
pub(super) fn charges(simulation: &Simulation) -> impl Iterator<Item = (usize, ChargeState)> {
    (0..).map_while(|index| Some((index, simulation.charge(index)?)))
}

/// Warnings about charges that have detonated since `before` after the surrounding rock had moved.
pub(super) fn detonations(simulation: &Simulation, before: &[bool]) -> Vec<Diagnostic> {
    let sizes = simulation.model().charges();
    let newly_detonated =
        charges(simulation).zip(&sizes).zip(before).filter(|(_, detonated)| !**detonated);
    let warnings = newly_detonated.filter_map(|(((index, charge), size), _)| {
        let part = charge.detonation_volume.filter(|_| size.walls > 0)? / size.volume;
        let at = format!("charge[{index}]");
        if charge.vented && charge.detonation_volume == Some(charge.volume) {
            let message = "the charge had no effect: its cavity had already vented at detonation";
            let help = "detonate it before the rock around it opens: with a smaller `delay`, or earlier by `from`";
            return Some(Diagnostic::warning(Code::VentedCharge, at, message, help));
        }
        ((part - 1.0).abs() > CHANGED).then(|| {
            let message = format!(
                "the charge detonated in {:.3e} m³, {:.0} % of its cavity at the start: the rock around had moved",
                part * size.volume,
                100.0 * part
            );
            let help = "compare its `delay` and `from` with those of the charges and loads before it";
            Diagnostic::warning(Code::CavityChanged, at, message, help)
        })
    });
    warnings.collect()
}

/// Warning about the energy imbalance of a stage.
pub(super) fn energy_imbalance(
    energy: &Energy,
    before: f64,
    stage: &Stage,
    deck: &Deck,
) -> Option<Diagnostic> {
    let relax = stage.kind == StageKind::Relax;
    let remedy = if relax { "more `increments`" } else { "a shorter `time_step`" };
    let Energy { balance, contact, .. } = *energy;
    // Losses have the opposite sign in `balance`.
    let (error, column, cause) = if contact.abs() > balance.abs() {
        (-contact, "contact", " in contacts that form, separate and rotate")
    } else {
        (balance, "balance", "")
    };
    let went = if error < 0.0 { "lost" } else { "gained" };
    let imbalance = energy.imbalance();
    (imbalance > MUCH && imbalance > before + 0.5 * MUCH).then(|| {
        let message = format!(
            "energy imbalance: {:.1} % of the largest energy is {went}{cause} (`{column}` in energy.csv)",
            100.0 * imbalance
        );
        let help = format!("check whether {remedy} changes the result");
        Diagnostic::warning(Code::EnergyImbalance, stage_place(deck, stage), message, help)
    })
}
