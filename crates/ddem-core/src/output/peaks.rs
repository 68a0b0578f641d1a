//! Peak values so far.

use std::ops::Range;

use super::{Field, FieldLocation, Snapshot};

/// Fields of a model whose deck has `peaks`.
pub(super) const PEAK_FIELDS: [Field; 3] = [
    Field::new("peak_velocity", "m/s", FieldLocation::Node, 1, velocity).dense(),
    Field::new("peak_tension", "Pa", FieldLocation::Element, 1, tension).dense(),
    Field::new("peak_compression", "Pa", FieldLocation::Element, 1, compression).dense(),
];

fn velocity(snapshot: &Snapshot<'_>, range: Range<usize>, out: &mut [f64]) {
    snapshot.fill_peak_velocities(range, out);
}

fn tension(snapshot: &Snapshot<'_>, range: Range<usize>, out: &mut [f64]) {
    stress(snapshot, range, out, |[tension, _]| tension);
}

fn compression(snapshot: &Snapshot<'_>, range: Range<usize>, out: &mut [f64]) {
    stress(snapshot, range, out, |[_, compression]| compression);
}

fn stress(snapshot: &Snapshot<'_>, range: Range<usize>, out: &mut [f64], of: fn([f64; 2]) -> f64) {
    let Snapshot { model, state, .. } = snapshot;
    model.fill_elements(range, out, |block| {
        let peaks = &state.peaks.stresses[block];
        move |element| [of(peaks[element])]
    });
}

impl Snapshot<'_> {
    /// Implements [`Simulation::peak_velocities`](crate::Simulation::peak_velocities).
    pub(crate) fn peak_velocities(&self) -> Vec<f64> {
        let n = if self.state.peaks.speeds.is_empty() { 0 } else { self.model.n_nodes() };
        let mut speeds = vec![0.0; n];
        self.fill_peak_velocities(0..n, &mut speeds);
        speeds
    }

    /// Writes the largest speeds of a range of nodes so far `[m/s]`.
    fn fill_peak_velocities(&self, range: Range<usize>, out: &mut [f64]) {
        self.model.fill_nodes(range, out, |block| {
            let (pack, lane) = self.model.packs.slot(block);
            let speeds = &self.state.peaks.speeds[self.model.packs.packs[pack].start..];
            move |node| [speeds[node].0[lane].sqrt()]
        });
    }

    /// Implements [`Simulation::peak_stresses`](crate::Simulation::peak_stresses).
    pub(crate) fn peak_stresses(&self) -> Vec<[f64; 2]> {
        self.state.peaks.stresses.concat()
    }
}
