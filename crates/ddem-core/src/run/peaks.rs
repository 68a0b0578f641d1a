//! Updates of the peak values during a run.

use super::Simulation;
use crate::model::Model;
use ddem_mechanics::element::Elastic;

/// Time between two samples of the stresses, as a fraction of the time in which a compression wave
/// crosses the smallest element. For a wave as long as ten elements the samples miss 0.3 % of the
/// peak.
const SAMPLING: f64 = 0.25;

impl Simulation {
    /// Updates the peaks after a time step: velocities at every step, stresses as often as waves
    /// require.
    pub(super) fn note_peaks(&mut self) {
        let Some(sampling_period) = self.sampling_period else { return };
        let state = &mut *self.state;
        state.peaks.note_velocities(&state.v);
        let every = (sampling_period / self.motion.time_step).clamp(1.0, 1e9) as u64;
        if self.state.steps.is_multiple_of(every) {
            self.note_stresses();
        }
    }

    /// Updates the stress peaks with the present stresses, if the deck has `peaks`.
    pub(super) fn note_stresses(&mut self) {
        let mut peaks = std::mem::take(&mut self.state.peaks);
        let snapshot = self.as_measured();
        peaks.note_stresses(&|block, elements| {
            let Some(strained) = snapshot.strained(block) else { return };
            let topology = self.model.geometry.topology(block);
            for (e, [tension, compression]) in elements.iter_mut().enumerate() {
                let [least, most] = strained.range(topology.element_steps(e));
                *tension = tension.max(most);
                *compression = compression.max(-least);
            }
        });
        self.state.peaks = peaks;
    }
}

/// Time between two samples of the stresses `[s]`; `None` without peaks.
pub(super) fn sampling_period(model: &Model) -> Option<f64> {
    let speeds: Vec<f64> = model.properties.materials.iter().map(Elastic::p_speed).collect();
    let crossing = |block: usize| {
        let divisions = model.geometry.topology(block).divisions() as f64;
        let edge = model.geometry.shortest_edge(block) / divisions;
        edge / speeds[usize::from(model.material(block))]
    };
    let blocks = (0..model.n_blocks()).filter(|&block| !model.is_rigid(block));
    let shortest = blocks.map(crossing).fold(f64::INFINITY, f64::min);
    model.properties.peaks.then_some(SAMPLING * shortest)
}
