//! Motion of neighbours, in a saved state.

use super::Saved;
use crate::watch::Watch;

pub(super) fn save(watch: &Watch, saved: &mut Saved) {
    let Watch { since, calm, looks, places } = watch;
    saved.counters.insert("watch_since".to_owned(), *since);
    saved.counters.insert("watch_calm".to_owned(), *calm);
    let mut put = |name: &str, values: Vec<f64>| saved.arrays.insert(name.to_owned(), values);
    put("watch_looks", looks.as_flattened().to_vec());
    put("watch_stage", places[0].as_flattened().to_vec());
    put("watch_event", places[1].as_flattened().to_vec());
}

/// `None` where something is missing.
pub(super) fn restore(saved: &Saved) -> Option<Watch> {
    let array = |name: &str| saved.arrays.get(name).map(Vec::as_slice);
    let count = |name: &str| saved.counters.get(name).copied();
    let places = |name: &str| array(name).map(|values| values.as_chunks::<3>().0.to_vec());
    Some(Watch {
        since: count("watch_since")?,
        calm: count("watch_calm")?,
        looks: array("watch_looks")?.as_chunks::<3>().0.to_vec(),
        places: [places("watch_stage")?, places("watch_event")?],
    })
}
