//! The largest values so far as plain numbers.

use super::Saved;
use crate::model::Model;
use crate::state::Peaks;

const SPEEDS: &str = "peak_speeds";
const STRESSES: &str = "peak_stresses";

/// Adds the peaks of a model that asks for them.
pub(super) fn save(model: &Model, peaks: &Peaks, saved: &mut Saved) {
    if !model.properties.peaks {
        return;
    }
    let speed = |node| {
        let (pack, local, lane) = model.place(node);
        peaks.speeds[model.packs.packs[pack].start + local].0[lane]
    };
    let mut put = |name: &str, values: Vec<f64>| saved.arrays.insert(name.to_owned(), values);
    put(SPEEDS, (0..model.n_nodes()).map(speed).collect());
    put(STRESSES, peaks.stresses.concat().into_flattened());
}

/// Sets the peaks that were saved; `None` when the numbers are not those of this model.
pub(super) fn restore(model: &Model, saved: &Saved, peaks: &mut Peaks) -> Option<()> {
    if !model.properties.peaks {
        return Some(());
    }
    let array = |name: &str| saved.arrays.get(name).map(Vec::as_slice);
    let (speeds, (stresses, rest)) = (array(SPEEDS)?, array(STRESSES)?.as_chunks::<2>());
    let fits = speeds.len() == model.n_nodes() && stresses.len() == model.n_elements();
    if !fits || !rest.is_empty() {
        return None;
    }
    for (node, &speed) in speeds.iter().enumerate() {
        let (pack, local, lane) = model.place(node);
        peaks.speeds[model.packs.packs[pack].start + local].0[lane] = speed;
    }
    peaks.stresses.iter_mut().flatten().zip(stresses).for_each(|(known, &peak)| *known = peak);
    Some(())
}
