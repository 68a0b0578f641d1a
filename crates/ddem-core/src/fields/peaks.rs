//! The largest values so far.

use super::{Field, On};
use crate::simulation::Simulation;

/// Fields of a model that asks for peaks.
pub(super) const PEAK_FIELDS: [Field; 3] = [
    Field { name: "peak_velocity", unit: "m/s", on: On::Node, components: 1, fill: velocity },
    Field { name: "peak_tension", unit: "Pa", on: On::Element, components: 1, fill: tension },
    Field {
        name: "peak_compression",
        unit: "Pa",
        on: On::Element,
        components: 1,
        fill: compression,
    },
];

fn velocity(simulation: &mut Simulation) -> Vec<f64> {
    simulation.peak_velocities()
}

fn tension(simulation: &mut Simulation) -> Vec<f64> {
    simulation.peak_stresses().into_iter().map(|[tension, _]| tension).collect()
}

fn compression(simulation: &mut Simulation) -> Vec<f64> {
    simulation.peak_stresses().into_iter().map(|[_, compression]| compression).collect()
}

impl Simulation {
    /// Largest speed of every node since the start of the run `[m/s]`, of all steps in time: the peak
    /// particle velocity. Empty where the deck has no `peaks`.
    #[must_use]
    pub fn peak_velocities(&self) -> Vec<f64> {
        let (model, speeds) = (&self.model, &self.state.peaks.speeds);
        let n = if speeds.is_empty() { 0 } else { model.n_nodes() };
        let speed = |node| {
            let (pack, local, lane) = model.place(node);
            speeds[model.packs.packs[pack].start + local].0[lane].sqrt()
        };
        (0..n).map(speed).collect()
    }

    /// Largest principal tension and compression at the centre of every element since the start of the
    /// run, both counted from 0 up `[Pa]`: four times at least while a wave crosses an element or in every step, and in
    /// every equilibrium. Empty where the deck has no `peaks`.
    #[must_use]
    pub fn peak_stresses(&self) -> Vec<[f64; 2]> {
        self.state.peaks.stresses.concat()
    }
}
