//! Estimated steps and wall time of stages.

use std::fmt;
use std::time::Instant;

use ddem_core::{Simulation, most_trials};
use ddem_deck::{Stage, StageKind, TimeStep};

/// Estimate of a stage.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Plan {
    /// Name of the stage.
    pub name: String,
    /// Largest number of trials of a safety stage; 0 in other stages.
    pub trials: u64,
    /// Number of steps; in relaxation the largest number.
    pub steps: u64,
    /// Time step `[s]`; 0 in relaxation.
    pub time_step: f64,
    /// Steps and time step `[s]` if joints fail in the first step; automatic steps may then be
    /// shorter.
    pub broken: Option<(u64, f64)>,
    /// Estimated wall time while joints hold `[s]`.
    pub seconds: f64,
}

impl Plan {
    /// Plan of a stage while joints hold. `automatic` is the time step of a dynamic stage that
    /// gives none.
    fn new(stage: &Stage, automatic: f64) -> Self {
        let name = stage.name.clone();
        if stage.kind != StageKind::Dynamic {
            let trials =
                if stage.kind == StageKind::Safety { most_trials(&stage.search(), &[]) } else { 0 };
            let steps = stage.max_steps();
            return Self { name, trials, steps, ..Self::default() };
        }
        let time_step = match stage.time_step {
            Some(TimeStep::Seconds(step)) => step,
            _ => automatic,
        };
        Self { name, steps: steps(stage, time_step), time_step, ..Self::default() }
    }
}

/// Estimates of the stages of a simulation that has not begun.
pub(super) fn plans(simulation: &mut Simulation, stages: &[Stage]) -> Vec<Plan> {
    let mut moving = simulation.moves();
    let plan = |stage: &Stage| {
        let dynamic = stage.kind == StageKind::Dynamic;
        let damping = stage.damping.unwrap_or_default();
        let step = if dynamic { simulation.automatic_step(damping, moving) } else { Ok(0.0) };
        moving = dynamic;
        Plan::new(stage, step.unwrap_or(f64::NAN))
    };
    stages.iter().map(plan).collect()
}

fn steps(stage: &Stage, time_step: f64) -> u64 {
    (stage.duration.unwrap_or(0.0) / time_step - 1e-9).ceil().max(1.0) as u64
}

/// Adds to the plans the time steps after failure of joints and the wall times.
pub(super) fn estimate(simulation: &mut Simulation, stages: &[Stage], plans: &mut [Plan]) {
    for (stage, plan) in stages.iter().zip(&mut *plans) {
        let given = matches!(stage.time_step, Some(TimeStep::Seconds(_)));
        if stage.kind == StageKind::Dynamic && !given && simulation.model().can_fail() {
            let damping = stage.damping.unwrap_or_default();
            let step = simulation.broken_step(damping).unwrap_or(f64::NAN);
            plan.broken = (step < plan.time_step).then(|| (steps(stage, step), step));
        }
    }
    let [once, each] = step_times(simulation);
    plans.iter_mut().for_each(|plan| plan.seconds = plan.steps as f64 * each);
    plans.iter_mut().take(1).for_each(|plan| plan.seconds += once);
}

/// Extra wall time of the first step, and wall time of each later step, measured over a few steps
/// `[s]`. The first step includes everything that is done only once, such as joints that fail at
/// once.
fn step_times(simulation: &mut Simulation) -> [f64; 2] {
    let start = Instant::now();
    if simulation.step().is_err() {
        return [0.0, f64::NAN];
    }
    let (first, start) = (start.elapsed().as_secs_f64(), Instant::now());
    let mut steps = 0;
    while start.elapsed().as_secs_f64() < 0.2 && simulation.step().is_ok() {
        steps += 1;
    }
    let each = start.elapsed().as_secs_f64() / f64::from(steps.max(1));
    [(first - each).max(0.0), each]
}

impl fmt::Display for Plan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { name, trials, steps, time_step, broken, seconds } = self;
        if *time_step == 0.0 {
            // The largest number of steps does not show how long the stage will take.
            let each = seconds / *steps as f64;
            let time = wall_time(1000.0 * each);
            write!(f, "stage {name}: ")?;
            if *trials > 0 {
                write!(f, "at most {trials} trials, each ")?;
            }
            return write!(f, "until forces balance, about {time} for each 1000 steps");
        }
        write!(f, "stage {name}: {steps} steps of {time_step:.4e} s")?;
        if let Some((steps, time_step)) = broken {
            write!(f, " ({steps} of {time_step:.4e} s once they fail)")?;
        }
        write!(f, ", about {}", wall_time(*seconds))
    }
}

/// Wall time as text.
fn wall_time(seconds: f64) -> String {
    match seconds {
        s if s < 0.1 => format!("{:.0} ms", 1e3 * s),
        s if s < 10.0 => format!("{s:.1} s"),
        s if s < 120.0 => format!("{s:.0} s"),
        s if s < 7200.0 => format!("{:.0} min", s / 60.0),
        s => format!("{:.1} h", s / 3600.0),
    }
}
