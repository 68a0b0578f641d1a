//! A simulation as bytes, from which it goes on bit for bit.
//!
//! All that changes is in [`State`], and its encoding is derived: a new field of it is in here by itself. It asks for
//! another [`FORMAT`].

mod check;

use std::io::{self, Write};

use serde::{Deserialize, Serialize};

use crate::model::Model;
use crate::model::stage::Damping;
use crate::run::Simulation;
use crate::state::motion::Motion;
use crate::state::{RelaxationProgress, State};
use ddem_mechanics::math::simd::Simd;

/// Number of the encoding: another one where anything in it has other fields.
const FORMAT: u32 = 3;

/// State of a simulation without its model, as bytes: to be kept, and given to [`Simulation::restore`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Saved {
    bytes: Vec<u8>,
}

/// Reason why a simulation cannot go on from what was saved.
#[derive(Clone, PartialEq, Eq, thiserror::Error)]
pub enum RestoreError {
    /// Another version of the program wrote it.
    #[error(
        "its state has format {found}, and this version of ddem reads format {FORMAT}: go on with the version that wrote \
         it, or run again from the start"
    )]
    Format {
        /// Number of its encoding.
        found: u32,
    },
    /// The state belongs to a model of another size.
    #[error("it belongs to another model, with {saved} {what} instead of {model}")]
    Model {
        /// Quantity that differs.
        what: &'static str,
        /// Number in the model that it belongs to.
        saved: u64,
        /// Number in this one.
        model: u64,
    },
    /// Its bytes are not those that were saved.
    #[error("its state is damaged: {what}")]
    Damaged {
        /// Description of the fault.
        what: String,
    },
}

crate::debug_as_display!(RestoreError);

impl From<postcard::Error> for RestoreError {
    fn from(error: postcard::Error) -> Self {
        Self::Damaged { what: error.to_string() }
    }
}

/// Encoded state: of a simulation that is saved, `S` is borrowed.
#[derive(Serialize, Deserialize)]
struct Image<S> {
    state: S,
    run: RunState,
}

/// Data that a simulation needs besides its state to continue.
#[derive(Serialize, Deserialize)]
struct RunState {
    damping: Damping,
    time_step: f64,
    critical_steps: [Option<f64>; 2],
    initial_energy: f64,
    started: bool,
    /// A relaxation is over, and nothing has been set in motion since.
    resting: bool,
    relaxation: Option<RelaxationProgress>,
}

/// Numbers that tell a model from others, and what they count.
fn counts(model: &Model) -> [(&'static str, usize); 9] {
    [
        ("blocks", model.n_blocks()),
        ("rigid packs of blocks", model.packs.rigid),
        ("nodes", model.n_nodes()),
        ("elements", model.n_elements()),
        ("pairs of points at joints", model.n_pairs()),
        ("stages", model.n_stages()),
        ("factors of loads", model.conditions.n_factors()),
        ("shells of charges", model.conditions.n_shells()),
        ("levels of free-field columns", model.boundaries.column_nodes()),
    ]
}

impl Saved {
    /// The bytes.
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// The state, if it is one of this model.
    fn decode(&self, model: &Model) -> Result<Image<State>, RestoreError> {
        let (found, rest) = postcard::take_from_bytes(&self.bytes)?;
        if found != FORMAT {
            return Err(RestoreError::Format { found });
        }
        let known = counts(model);
        let (saved, rest) = postcard::take_from_bytes::<[u64; 9]>(rest)?;
        for ((what, model), saved) in known.into_iter().zip(saved) {
            if saved != model as u64 {
                return Err(RestoreError::Model { what, saved, model: model as u64 });
            }
        }
        let (image, rest) = postcard::take_from_bytes(rest)?;
        check::expect(rest.is_empty(), "it continues beyond its end")?;
        Ok(image)
    }
}

impl From<Vec<u8>> for Saved {
    /// Bytes that were those of a saved state.
    fn from(bytes: Vec<u8>) -> Self {
        Self { bytes }
    }
}

/// Contents of a saved state: format, numbers of the model, state.
type Whole<'a> = (u32, [u64; 9], Image<&'a State>);

impl Simulation {
    /// The present state.
    #[must_use]
    pub fn save(&self) -> Saved {
        // A vector that grows would be copied and end up too long.
        let mut bytes = Vec::with_capacity(self.saved_size());
        let written = self.save_to(&mut bytes);
        written.unwrap_or_else(|error| unreachable!("memory takes all: {error}"));
        Saved { bytes }
    }

    /// Number of bytes of the present state.
    #[must_use]
    pub fn saved_size(&self) -> usize {
        let size = postcard::ser_flavors::Size::default();
        postcard::serialize_with_flavor(&self.whole(), size).unwrap_or_default()
    }

    /// Writes the bytes of the present state, without a copy of it in memory.
    ///
    /// # Errors
    ///
    /// `out` does not take them.
    pub fn save_to(&self, out: impl Write) -> io::Result<()> {
        postcard::to_io(&self.whole(), out).map(|_| ()).map_err(io::Error::other)
    }

    fn whole(&self) -> Whole<'_> {
        let run = RunState {
            damping: self.damping,
            time_step: self.motion.time_step,
            critical_steps: self.critical_steps,
            initial_energy: self.initial_energy,
            started: self.started,
            resting: self.motion.fictitious && self.relaxation.is_none(),
            relaxation: self.relaxation.as_ref().map(|relaxation| relaxation.progress.clone()),
        };
        let model = counts(&self.model).map(|(_, count)| count as u64);
        (FORMAT, model, Image { state: &*self.state, run })
    }

    /// A simulation that goes on from a saved state, bit for bit.
    ///
    /// # Errors
    ///
    /// The state is one of another version of the program or of another model, or it is damaged.
    pub fn restore(mut model: Model, simd: Simd, saved: &Saved) -> Result<Self, RestoreError> {
        let Image { mut state, run } = saved.decode(&model)?;
        check::stages(&model, &state, &run)?;
        if !model.steps(0, state.stage).is_empty() {
            model.excavate(model.back(state.stage, state.stage));
        }
        check::state(&model, &state)?;
        check::run(&model, &state, &run)?;
        state.released.iter().for_each(|(&load, released)| model.set_released(load, released));
        state.contacts.index();
        state.contacts.bonds_mut().for_each(|(_, bond)| bond.law = bond.joint);
        state.broken_joints.recheck();
        let mut simulation = Self::with_state(model, state, simd);
        simulation.restore_run(run);
        Ok(simulation)
    }

    /// Goes on as it did when it was saved.
    fn restore_run(&mut self, run: RunState) {
        self.damping = run.damping;
        let before = self.state.before;
        *self.motion = Motion::dynamic(&self.model.assembly, run.damping, before, run.time_step);
        self.critical_steps = run.critical_steps;
        self.started = run.started;
        if run.resting {
            self.rest();
        }
        if let Some(state) = run.relaxation {
            self.continue_relaxation(state);
        }
        self.initial_energy = run.initial_energy;
    }
}
