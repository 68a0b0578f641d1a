//! Time steps and durations that stages give, compared with the critical time step before anything is written.

use ddem_core::{ErrorCode, Fault, ModelError, RunError, SHORTEST_STEP, Simulation};
use ddem_deck::lint::{Code, Diagnostic};
use ddem_deck::{Deck, Stage, StageKind, TimeStep};

use super::RunFailure;
use super::warnings::stage_place;

/// Largest number of steps of a stage: about thirty years at a microsecond a step.
const MOST_STEPS: f64 = 1e15;

/// Time step that a dynamic stage gives `[s]`.
fn given(stage: &Stage) -> Option<f64> {
    match stage.time_step {
        Some(TimeStep::Seconds(step)) if stage.kind == StageKind::Dynamic => Some(step),
        _ => None,
    }
}

/// Checks given time steps and durations of stages against the critical time step of the present
/// blocks.
pub(super) fn check_steps(simulation: &mut Simulation, stages: &[Stage]) -> Result<(), RunFailure> {
    let Some(critical) = critical_step(simulation, stages)? else { return Ok(()) };
    let stages = stages.iter().enumerate();
    let faults: Vec<Fault> =
        stages.flat_map(|(index, stage)| faults(index, stage, critical)).collect();
    if faults.is_empty() { Ok(()) } else { Err(ModelError { faults }.into()) }
}

/// Checks given time steps and durations of all stages of a deck, each against the critical time
/// step of its own blocks, joints and materials. The simulation has not begun.
pub(super) fn check_all_steps(simulation: &mut Simulation, deck: &Deck) -> Result<(), RunFailure> {
    let Some(critical) = critical_step(simulation, &deck.stage)? else { return Ok(()) };
    // A copy of a large model takes time and memory.
    let mut later = None;
    let mut found = Vec::new();
    for (index, stage) in deck.stage.iter().enumerate() {
        let mut own = critical;
        if given(stage).is_some() && changes(deck, index) {
            let stopped = |_: RunError| RunFailure::Stopped;
            let mut copy: Simulation = match later.take() {
                Some(copy) => copy,
                None => simulation.back_to(&simulation.save()).map_err(stopped)?,
            };
            copy.enter(index).map_err(stopped)?;
            own = copy.critical_step().map_err(stopped)?;
            later = Some(copy);
        }
        found.extend(faults(index, stage, own));
    }
    if found.is_empty() { Ok(()) } else { Err(ModelError { faults: found }.into()) }
}

/// True if the blocks of a stage differ from those of the first stage in number, joints or materials.
fn changes(deck: &Deck, index: usize) -> bool {
    let assigned = deck.assign.iter().flat_map(|entry| [&entry.from, &entry.until]);
    let mut names = assigned.chain(deck.remove.iter().map(|entry| &entry.from)).flatten();
    names.any(|name| deck.stage.iter().skip(1).take(index).any(|stage| stage.name == *name))
}

/// Critical time step of the present blocks, if any stage is dynamic `[s]`.
fn critical_step(simulation: &mut Simulation, stages: &[Stage]) -> Result<Option<f64>, RunFailure> {
    if !stages.iter().any(|stage| stage.kind == StageKind::Dynamic) {
        return Ok(None);
    }
    let critical = simulation.critical_step().map_err(|_| RunFailure::Stopped)?;
    if !(critical.is_finite() && critical > 0.0) {
        let message = "densities or moduli are far out of range: no time step is stable";
        let fault = Fault::new(ErrorCode::NoCriticalStep, "materials", message);
        return Err(ModelError::from(fault).into());
    }
    Ok(Some(critical))
}

/// Faults of a stage whose critical time step is known.
fn faults(index: usize, stage: &Stage, critical: f64) -> Vec<Fault> {
    let mut faults = Vec::new();
    if stage.kind != StageKind::Dynamic {
        return faults;
    }
    let critical = stage.damping.unwrap_or_default().stable_step(critical);
    let mut add = |code: ErrorCode, key: &str, message: String, help: String| {
        faults.push(Fault::new(code, format!("stage[{index}].{key}"), message).help(help));
    };
    if let Some(step) = given(stage).filter(|step| *step > critical) {
        let message = format!(
            "`time_step` is {step:e} s and exceeds the critical time step, {critical:.6e} s"
        );
        let help = format!("at most {critical:.4e}, or \"auto\" for 0.9 of it");
        add(ErrorCode::UnstableTimeStep, "time_step", message, help);
    }
    for (key, seconds) in [("time_step", given(stage)), ("duration", stage.duration)] {
        if let Some(seconds) = seconds.filter(|seconds| *seconds < SHORTEST_STEP * critical) {
            let message = format!(
                "`{key}` is {seconds:e} s, less than a billionth of the critical time step, {critical:.3e} s"
            );
            add(ErrorCode::UnstableTimeStep, key, message, "is it in seconds?".to_owned());
        }
    }
    let steps = stage.duration.unwrap_or(0.0) / critical;
    if steps > MOST_STEPS {
        let message = format!(
            "the stage needs {steps:.1e} steps of the critical time step, {critical:.3e} s"
        );
        add(ErrorCode::TooLarge, "duration", message, "is the duration in seconds?".to_owned());
    }
    faults
}

/// Warnings about given time steps that are stable only until joints fail.
pub(super) fn unsafe_steps(
    deck: &Deck,
    simulation: &mut Simulation,
    stages: &[Stage],
) -> Vec<Diagnostic> {
    let given = stages.iter().filter_map(|stage| Some((stage, given(stage)?)));
    let mut warnings = Vec::new();
    for (stage, step) in given {
        let Ok(safe) = simulation.safe_step() else { break };
        let safe = stage.damping.unwrap_or_default().stable_step(safe);
        if simulation.model().can_fail() && step > safe {
            let message =
                format!("once joints have failed, a time step of {step:e} s may create energy");
            let at = format!("{}.time_step", stage_place(deck, stage));
            let help = format!("up to {safe:.3e} s is safe");
            warnings.push(Diagnostic::warning(Code::UnsafeTimeStep, at, message, help));
        }
    }
    warnings
}
