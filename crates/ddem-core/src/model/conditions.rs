//! Supports, loads and charges, and the stages in which they are in force.

mod active;
mod inactive;
mod release;

pub(crate) use active::{ActiveConditions, AppliedForces, NodalLoad, SupportedAxis, starts};

use std::ops::RangeInclusive;
use std::sync::Arc;

use crate::error::{ErrorCode, Fault, RunError, numbered};
use crate::model::charge::GasCharge;
use crate::model::history::{Function, TimeFunction};
use crate::model::stage::StageRange;
use ddem_mesh::Vec3;

pub(crate) use release::FadingForces;
pub use release::ForceFading;

/// A support.
#[derive(Clone, Debug)]
pub struct SupportGroup {
    /// Numbers of the nodes.
    pub nodes: Vec<u32>,
    /// Nodes of its selection whose blocks were removed before it came into force.
    pub removed: Vec<u32>,
    /// Directions that it holds.
    pub axes: [bool; 3],
    /// Velocity of a driven support `[m/s]`.
    pub velocity: Option<[f64; 3]>,
    /// Displacement to which it is driven in relaxation `[m]`.
    pub displacement: [f64; 3],
    /// Factor in time.
    pub history: TimeFunction,
    /// Stages in which it is in force.
    pub in_force: StageRange,
}

/// A load: nodal forces `[N]` at factor 1.
#[derive(Clone, Debug)]
pub struct LoadPattern {
    /// Nodal forces at factor 1 `[N]`.
    pub forces: Vec<(u32, Vec3)>,
    /// Factor in time.
    pub history: TimeFunction,
    /// Stages in which it is in force.
    pub in_force: StageRange,
    /// Fading of the forces; only for forces of removed blocks.
    pub fading: Option<ForceFading>,
}

/// A charge and its detonation time.
#[derive(Clone, Debug)]
pub struct TimedCharge {
    /// Surfaces on which its gas acts, and its pressure.
    pub charge: GasCharge,
    /// Factor in time.
    pub history: TimeFunction,
    /// Detonation time `[s]`, counted from the start of its first stage.
    pub delay: f64,
    /// Stages in which it is in force.
    pub in_force: StageRange,
}

/// All supports, loads and charges of a model.
#[derive(Clone, Debug, Default)]
pub struct Conditions {
    /// Supports.
    pub fixed: Vec<SupportGroup>,
    /// Loads, followed by the forces of removed blocks.
    pub loaded: Vec<LoadPattern>,
    /// Charges.
    pub charged: Vec<TimedCharge>,
}

impl Conditions {
    /// Gives a load, a charge or a support a history that a program computes.
    ///
    /// # Errors
    ///
    /// There is no such entry.
    pub(super) fn set_history(
        &mut self,
        section: &str,
        index: usize,
        function: Arc<Function>,
    ) -> Result<(), Fault> {
        let loads = self.loaded.iter().filter(|load| load.fading.is_none()).count();
        let count = match section {
            "load" => loads,
            "charge" => self.charged.len(),
            _ => self.fixed.len(),
        };
        let time_function = match section {
            "load" => {
                let load = self.loaded.get_mut(index).filter(|load| load.fading.is_none());
                load.map(|load| &mut load.history)
            }
            "charge" => self.charged.get_mut(index).map(|charged| &mut charged.history),
            _ => self.fixed.get_mut(index).map(|fix| &mut fix.history),
        };
        let place = format!("{section}[{index}].history");
        let fault = || {
            let fault = Fault::new(ErrorCode::UnknownName, place, "there is no such entry");
            fault.help(format!("the model has {}", numbered(count)))
        };
        *time_function.ok_or_else(fault)? = TimeFunction::Computed(function);
        Ok(())
    }

    /// Copies the histories of the supports, loads and charges of `from`. A program may compute
    /// some of them.
    pub(super) fn take_histories(&mut self, from: &Self) {
        let Self { fixed, loaded, charged } = self;
        fixed.iter_mut().zip(&from.fixed).for_each(|(a, b)| a.history.clone_from(&b.history));
        loaded.iter_mut().zip(&from.loaded).for_each(|(a, b)| a.history.clone_from(&b.history));
        charged.iter_mut().zip(&from.charged).for_each(|(a, b)| a.history.clone_from(&b.history));
    }

    /// Index of the factor of the forces that programs apply. The factor of gravity follows as the
    /// last one.
    pub(crate) fn applied_factor(&self) -> usize {
        self.loaded.len() + self.charged.len()
    }

    /// Number of surfaces of all charges.
    pub(crate) fn n_gas_surfaces(&self) -> usize {
        self.charged.iter().map(|charged| charged.charge.surfaces.len()).sum()
    }

    /// Number of all factors, including that of gravity.
    pub(crate) fn n_factors(&self) -> usize {
        self.applied_factor() + 2
    }

    /// Factors of all loads and charges in a stage at a time, then 1 for the forces that programs
    /// apply. `starts` are the start times of the stages.
    ///
    /// # Errors
    ///
    /// A history that a program computes has no value.
    pub fn factors(&self, stage: usize, time: f64, starts: &[f64]) -> Result<Vec<f64>, RunError> {
        let mut factors = Vec::with_capacity(self.n_factors());
        for (index, load) in self.loaded.iter().enumerate() {
            factors.push(match load.acts(stage) {
                true => load.factor(time, starts).at("load", index)?,
                false => 0.0,
            });
        }
        for (index, charged) in self.charged.iter().enumerate() {
            let TimedCharge { history, delay, in_force, .. } = charged;
            // The history is not evaluated before the detonation.
            let burns = in_force.has(stage) && in_force.since(time, starts) >= *delay;
            factors.push(match burns {
                true => in_force.factor(history, time - delay, starts).at("charge", index)?,
                false => 0.0,
            });
        }
        factors.push(1.0);
        Ok(factors)
    }

    /// Supports that hold all three directions: their numbers in the deck and their nodes.
    pub fn clamped(&self) -> impl Iterator<Item = (usize, &[u32])> {
        let fixed = self.fixed.iter().enumerate();
        fixed.filter(|(_, fix)| fix.axes == [true; 3]).map(|(i, fix)| (i, fix.nodes.as_slice()))
    }

    /// Displacement of each fix in a `fraction` of its prescribed displacement `[m]`; zero for
    /// fixes that come into force outside of `stages`.
    pub(crate) fn support_increments(
        &self,
        stages: RangeInclusive<usize>,
        fraction: f64,
    ) -> Vec<[f64; 3]> {
        let begins = |fix: &SupportGroup| stages.contains(&fix.in_force.from.unwrap_or(0));
        let increment = |fix: &SupportGroup| match begins(fix) {
            true => fix.displacement.map(|u| u * fraction),
            false => [0.0; 3],
        };
        self.fixed.iter().map(increment).collect()
    }

    /// True if a charge has detonated within the last `span` of time `[s]`.
    pub(super) fn have_detonated(&self, span: f64, time: f64, starts: &[f64]) -> bool {
        self.charged.iter().any(|TimedCharge { delay, in_force, .. }| {
            let begun = in_force.from.is_none_or(|from| from < starts.len());
            begun && (0.0..span).contains(&(in_force.since(time, starts) - delay))
        })
    }

    /// Velocity of each fix at a time `[m/s]`.
    pub(crate) fn velocities(&self, time: f64, starts: &[f64]) -> Result<Vec<[f64; 3]>, RunError> {
        let velocity = |(index, fix): (usize, &SupportGroup)| {
            let factor = fix.in_force.factor(&fix.history, time, starts).at("fix", index)?;
            Ok(fix.velocity.unwrap_or_default().map(|v| v * factor))
        };
        self.fixed.iter().enumerate().map(velocity).collect()
    }
}

/// A factor or, if it has no value, the time and the reason.
pub(super) struct Factor(Result<f64, (f64, String)>);

impl Factor {
    fn of(history: &TimeFunction, since: f64) -> Self {
        Self(history.factor(since).map_err(|message| (since, message)))
    }

    pub(crate) fn at(self, section: &str, index: usize) -> Result<f64, RunError> {
        self.0.map_err(|(time, message)| RunError::HistoryFailed {
            entry: format!("{section}[{index}]"),
            time,
            message,
        })
    }
}

impl StageRange {
    /// Time `[s]` since the start of the stage `from`, or since the start of the run without it.
    pub(super) fn since(&self, time: f64, starts: &[f64]) -> f64 {
        time - self.from.and_then(|stage| starts.get(stage)).copied().unwrap_or(0.0)
    }

    /// Factor of a history whose time counts from the start of the stage `from`.
    pub(super) fn factor(&self, history: &TimeFunction, time: f64, starts: &[f64]) -> Factor {
        Factor::of(history, self.since(time, starts))
    }
}
