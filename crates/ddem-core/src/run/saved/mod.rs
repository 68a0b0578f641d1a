//! Encoding of a simulation as bytes, from which it continues bit for bit.
//!
//! All variables are in [`State`], and its encoding is derived. A new field is therefore included
//! automatically, but it requires another [`FORMAT`].

mod check;

use std::io::{self, Write};

use serde::{Deserialize, Serialize};

use crate::error::ErrorCode;
use crate::model::Model;
use crate::model::stage::Damping;
use crate::run::Simulation;
use crate::state::motion::Motion;
use crate::state::{RelaxationProgress, State};
use ddem_mechanics::math::simd::Simd;

/// Number of the encoding. Any change of its fields requires another number.
const FORMAT: u32 = 7;

/// State of a simulation without its model, as bytes. Store it, and pass it to
/// [`Simulation::restore`].
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Saved {
    bytes: Vec<u8>,
}

/// Reason why a simulation cannot continue from a saved state. Its display ends with the code.
#[derive(Clone, PartialEq, Eq, thiserror::Error)]
pub enum RestoreError {
    /// Another version of the program wrote the state.
    #[error(
        "the saved state has format {found}; this version of ddem reads format {FORMAT}: resume with the version that wrote \
         it, or run from the start [{}]",
        ErrorCode::CheckpointMismatch
    )]
    Format {
        /// Number of its encoding.
        found: u32,
    },
    /// The state belongs to a model of another size.
    #[error(
        "the saved state belongs to another model, with {saved} {what} instead of {model}: restore it with the model \
         that was saved [{}]",
        ErrorCode::CheckpointMismatch
    )]
    Model {
        /// Quantity that differs.
        what: &'static str,
        /// Number in the model of the state.
        saved: u64,
        /// Number in this model.
        model: u64,
    },
    /// The bytes are not those that were saved.
    #[error(
        "the saved state is damaged ({what}): use another one, or run from the start [{}]",
        ErrorCode::InvalidFile
    )]
    Damaged {
        /// Description of the fault.
        what: String,
    },
}

crate::debug_as_display!(RestoreError);

impl RestoreError {
    /// Code of the error.
    #[must_use]
    pub fn code(&self) -> ErrorCode {
        match self {
            Self::Format { .. } | Self::Model { .. } => ErrorCode::CheckpointMismatch,
            Self::Damaged { .. } => ErrorCode::InvalidFile,
        }
    }
}

impl From<postcard::Error> for RestoreError {
    fn from(error: postcard::Error) -> Self {
        Self::Damaged { what: error.to_string() }
    }
}

/// Encoded state; `S` is borrowed when a simulation is saved.
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
    /// True after a relaxation, until something is set in motion.
    resting: bool,
    relaxation: Option<RelaxationProgress>,
}

/// Numbers that distinguish a model from others, with their names.
fn counts(model: &Model) -> [(&'static str, usize); 9] {
    [
        ("blocks", model.n_blocks()),
        ("rigid packs of blocks", model.packs.rigid),
        ("nodes", model.n_nodes()),
        ("elements", model.n_elements()),
        ("pairs of points at joints", model.n_pairs()),
        ("stages", model.n_stages()),
        ("factors of loads", model.conditions.n_factors()),
        ("gas surfaces of charges", model.conditions.n_gas_surfaces()),
        ("levels of free-field columns", model.boundaries.column_nodes()),
    ]
}

impl Saved {
    /// The bytes.
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// Decoded state, if it belongs to this model.
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
        check::expect(rest.is_empty(), "bytes after the end")?;
        Ok(image)
    }
}

impl From<Vec<u8>> for Saved {
    /// Takes the bytes of a saved state.
    fn from(bytes: Vec<u8>) -> Self {
        Self { bytes }
    }
}

/// Contents of a saved state: format, numbers of the model, state.
type SavedContents<'a> = (u32, [u64; 9], Image<&'a State>);

impl Simulation {
    /// Present state as bytes.
    #[must_use]
    pub fn save(&self) -> Saved {
        // A growing vector would be copied and end up too long.
        let mut bytes = Vec::with_capacity(self.saved_size());
        let written = self.save_to(&mut bytes);
        written.unwrap_or_else(|error| unreachable!("memory takes all: {error}"));
        Saved { bytes }
    }

    /// Number of bytes of the present state.
    #[must_use]
    pub fn saved_size(&self) -> usize {
        let size = postcard::ser_flavors::Size::default();
        postcard::serialize_with_flavor(&self.contents(), size).unwrap_or_default()
    }

    /// Writes the bytes of the present state, without a copy of it in memory.
    ///
    /// # Errors
    ///
    /// Those of `out`.
    pub fn save_to(&self, out: impl Write) -> io::Result<()> {
        postcard::to_io(&self.contents(), out).map(|_| ()).map_err(io::Error::other)
    }

    fn contents(&self) -> SavedContents<'_> {
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

    /// Simulation that continues from a saved state, bit for bit.
    ///
    /// # Errors
    ///
    /// The state comes from another version of the program or from another model, or it is damaged.
    pub fn restore(mut model: Model, simd: Simd, saved: &Saved) -> Result<Self, RestoreError> {
        let Image { mut state, run } = saved.decode(&model)?;
        check::stages(&model, &state, &run)?;
        if !model.steps(0, state.stage).is_empty() {
            model.excavate(model.back(state.stage, state.stage));
        }
        check::state(&model, &state)?;
        check::run(&model, &state, &run)?;
        state.released.iter().for_each(|(&load, released)| model.set_released(load, released));
        let blocks = model.contact.as_ref().map_or(&[][..], |contact| &contact.blocks);
        state.contacts.fix(&model.bonded_patches, blocks);
        state.contacts.index();
        state.contacts.bonds_mut().for_each(|(_, bond)| bond.law = bond.joint);
        state.broken_joints.count_failed();
        state.broken_joints.recheck();
        let mut simulation = Self::with_state(model, state, simd);
        simulation.restore_run(run);
        Ok(simulation)
    }

    /// Restores the settings of the run and continues its relaxation, if there was one.
    fn restore_run(&mut self, run: RunState) {
        self.damping = run.damping;
        let before = self.state.before;
        *self.motion = Motion::dynamic(&self.model.assembly, run.damping, before, run.time_step);
        self.forget_critical_steps();
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

#[cfg(test)]
mod tests;
