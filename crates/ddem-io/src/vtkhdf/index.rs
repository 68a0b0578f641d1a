//! Index of the steps: where the points, cells and fields of each step begin.

use hdf5::{Dataset, Group, H5Type, Result};

use super::create::COUNTS;
use super::data::Location;

/// Reads the index of the first steps. HDF5 compares its checksums meanwhile, so that damage is noticed. After a power
/// failure later steps may be incomplete.
pub(super) fn verify(root: &Group, steps: usize) -> Result<()> {
    let index = root.group("Steps")?;
    let mut all = index.datasets()?;
    for location in [Location::Point, Location::Cell] {
        all.extend(index.group(location.offsets())?.datasets()?);
    }
    for name in COUNTS {
        all.push(root.dataset(name)?);
    }
    all.iter().try_for_each(|dataset| first_rows::<f64>(dataset, steps).map(drop))
}

/// The first rows of an array with one column, or all if there are fewer.
pub(super) fn first_rows<T: H5Type + Clone>(dataset: &Dataset, rows: usize) -> Result<Vec<T>> {
    let rows = rows.min(dataset.size());
    Ok(match (rows, dataset.ndim()) {
        (1.., 1) => dataset.read_slice_1d(..rows)?.to_vec(),
        (1.., 2) => dataset.read_slice_2d((..rows, ..))?.into_iter().collect(),
        // The next append reports such an array.
        _ => Vec::new(),
    })
}

/// Number of valid steps. An append that was killed may have left the times of more.
pub(super) fn steps(root: &Group) -> Result<usize> {
    let index = root.group("Steps")?;
    let steps = index.attr("NSteps")?.read_scalar::<i64>()?;
    let steps = usize::try_from(steps).map_err(|e| format!("NSteps: {e}"))?;
    let times = index.dataset("Values")?.size();
    if times < steps {
        return Err(format!("it counts {steps} steps, but has the times of {times}").into());
    }
    Ok(steps)
}
