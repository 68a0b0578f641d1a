//! Topographies: heights over a grid of x and y.

use std::sync::Arc;

use super::{Selector, coordinates};
use crate::schema::{Heights, SurfaceFile, Where};
use ddem_core::problem::{Lattice, Sets, Vec3};
use ddem_core::{ErrorCode, Fault};
use ddem_cut::Ground;

/// Distance within which a point counts as on a grid line, as a fraction of the grid cell.
const ON_LINE: f64 = 1e-9;

/// Heights of a topography.
#[derive(Clone, Debug)]
pub(super) enum Terrain {
    /// Bilinear between the points of a grid.
    Grid(Arc<SurfaceFile>),
    /// Triangles of a ground.
    Ground(Arc<Ground>),
}

impl Terrain {
    /// Topography of a file; it has no height anywhere if the file has not been read.
    pub(super) fn new(content: Option<Arc<SurfaceFile>>) -> Self {
        let field = match content.as_deref() {
            Some(SurfaceFile::Triangles(triangles)) => triangles.height_field(),
            _ => None,
        };
        match field {
            Some(field) => Self::Ground(Arc::new(Ground::new(field, 0, true, [0.0; 2]))),
            None => Self::Grid(content.unwrap_or_else(|| Arc::new(Heights::default().into()))),
        }
    }

    /// Height at a point `[m]`. `None` beyond the rim of the grid by more than `clear`, and where a
    /// height that has weight is missing.
    pub(super) fn height(&self, x: &Vec3, clear: f64) -> Option<f64> {
        let Heights { x: columns, y: rows, z, rim } = match self {
            Self::Ground(ground) => return ground.height(x),
            Self::Grid(content) => match &**content {
                SurfaceFile::Heights(heights) => heights,
                SurfaceFile::Triangles(_) => return None,
            },
        };
        let (i, s) = between(columns, x.x, rim + clear)?;
        let (j, t) = between(rows, x.y, rim + clear)?;
        let corners = [(i, j, (1.0 - s) * (1.0 - t)), (i + 1, j, s * (1.0 - t))];
        let upper = [(i, j + 1, (1.0 - s) * t), (i + 1, j + 1, s * t)];
        let held = corners.into_iter().chain(upper).filter(|(.., weight)| *weight > 0.0);
        // A program may give fewer heights than the grid has points.
        let at = |i: usize, j: usize| z.get(i + columns.len() * j).copied().unwrap_or(f64::NAN);
        let height: f64 = held.map(|(i, j, weight)| weight * at(i, j)).sum();
        (!height.is_nan()).then_some(height)
    }

    /// Message for a point without a height.
    fn missing(&self, x: &Vec3, clear: f64) -> String {
        let no_height = || format!("it has no height at {}", coordinates(*x));
        let Self::Grid(content) = self else { return no_height() };
        let SurfaceFile::Heights(Heights { x: columns, y: rows, rim, .. }) = &**content else {
            return no_height();
        };
        let out = [(columns, x.x), (rows, x.y)];
        if out.iter().all(|(axis, at)| between(axis, *at, rim + clear).is_some()) {
            return no_height();
        }
        let end = |axis: &[f64]| {
            let ends = [axis.first(), axis.last()].map(|end| end.copied().unwrap_or(0.0));
            format!("from {} to {}", ends[0] - rim, ends[1] + rim)
        };
        format!(
            "it covers x {} and y {}, and the model has {}",
            end(columns),
            end(rows),
            coordinates(*x)
        )
    }
}

/// Interval of an axis in which a point lies, and the fraction of it below the point. A point that
/// is at most `rim` beyond the ends counts as at the end.
fn between(axis: &[f64], at: f64, rim: f64) -> Option<(usize, f64)> {
    let [first, .., last] = axis else { return None };
    if !(at >= first - rim && at <= last + rim) {
        return None;
    }
    let i = axis.partition_point(|point| *point <= at).clamp(1, axis.len() - 1) - 1;
    let part = ((at - axis[i]) / (axis[i + 1] - axis[i])).clamp(0.0, 1.0);
    let snapped = if part < ON_LINE {
        0.0
    } else if part > 1.0 - ON_LINE {
        1.0
    } else {
        part
    };
    Some((i, snapped))
}

/// Faults of the topographies of a `where` that lack a height at a point where it is needed.
pub(crate) fn uncovered(
    (at, where_): (&str, &Where),
    sets: &Sets,
    lattices: &[Arc<Lattice>],
) -> Vec<Fault> {
    let mut faults = Vec::new();
    if where_.topographies().next().is_none() {
        return faults;
    }
    let selector = Selector::new(where_, sets);
    for ((key, file), (terrain, _)) in where_.topographies().zip(&selector.terrains) {
        let lattices = lattices.iter().filter(|lattice| selector.has_set(lattice.set));
        let alone = sets.list.len() == 1;
        let mut asked = lattices.flat_map(|lattice| asked(lattice, at, alone));
        let unknown =
            |x: &Vec3| selector.asks_heights_at(x) && terrain.height(x, selector.clear()).is_none();
        if let Some(x) = asked.find(unknown) {
            let message = format!(
                "the topography `{}` does not cover the model: {}",
                file.path,
                terrain.missing(&x, selector.clear())
            );
            faults.push(Fault::new(ErrorCode::InvalidFile, format!("{at}.{key}.topography"), message).help(
                "a larger grid, or `x`, `y` or `set` in the same `where`, to leave out the part that it \
                 does not cover",
            ));
        }
    }
    faults
}

/// Points whose heights an entry of the deck may need: centroids of blocks if it selects blocks,
/// centres of their faces if it selects joints, otherwise nodes. The outer faces of a single set
/// have no joints.
fn asked<'a>(lattice: &'a Lattice, entry: &str, alone: bool) -> impl Iterator<Item = Vec3> + 'a {
    let blocks = ["remove", "refine"].iter().any(|section| entry.starts_with(section));
    let joints = entry.starts_with("assign") || entry.starts_with("charge");
    // Steps along a block's edge: halves of it, or parts of its elements.
    let parts = match (blocks || joints, lattice.divisions) {
        (true, _) => 2,
        // An odd number of divisions is doubled, so that the centre of a face is one of the points.
        (false, divisions) => divisions * (1 + divisions % 2),
    };
    (0..lattice.block.len()).flat_map(move |index| {
        let cell = lattice.cell(index);
        let steps = (parts + 1).pow(3);
        let at = move |step: usize| {
            [step % (parts + 1), step / (parts + 1) % (parts + 1), step / (parts + 1).pow(2)]
        };
        let wanted = move |at: &[usize; 3]| {
            let middle = |d: &usize| at[*d] == 1;
            match (blocks, joints) {
                (true, _) => (0..3).all(|d| middle(&d)),
                (_, true) => {
                    let inner = |d: usize| {
                        at[d] + cell[d] > 0 && at[d] + 2 * cell[d] < 2 * lattice.count[d]
                    };
                    (0..3).filter(middle).count() >= 2 && (!alone || (0..3).all(inner))
                }
                _ => true,
            }
        };
        (0..steps).map(at).filter(wanted).map(move |at| {
            lattice.point([0, 1, 2].map(|d| {
                lattice.cuts[d][cell[d]] + lattice.lengths[d][cell[d]] * at[d] as f64 / parts as f64
            }))
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn terrain(x: &[f64], y: &[f64], z: &[f64], rim: f64) -> Terrain {
        let heights = Heights { x: x.into(), y: y.into(), z: z.into(), rim };
        Terrain::new(Some(Arc::new(heights.into())))
    }

    #[test]
    fn heights_are_bilinear_in_each_cell() {
        // 1 + 2x + 3y + 4xy at the corners of uneven cells.
        let of = |x: f64, y: f64| 1.0 + 2.0 * x + 3.0 * y + 4.0 * x * y;
        let (xs, ys) = ([0.0, 1.0, 4.0], [-1.0, 1.0]);
        let z: Vec<f64> = ys.iter().flat_map(|&y| xs.iter().map(move |&x| of(x, y))).collect();
        let terrain = terrain(&xs, &ys, &z, 0.0);
        for (x, y) in [(0.0, -1.0), (0.5, 0.25), (1.0, 1.0), (3.0, -0.5), (4.0, 1.0)] {
            let height = terrain.height(&Vec3::new(x, y, 7.0), 0.0).unwrap_or(f64::NAN);
            assert!((height - of(x, y)).abs() < 1e-12, "{height} at {x}, {y}");
        }
        assert_eq!(terrain.height(&Vec3::new(4.1, 0.0, 0.0), 1e-6), None);
    }

    #[test]
    fn incomplete_grid_has_no_heights() {
        let here = Vec3::zeros();
        for (x, z) in [(&[0.0][..], &[1.0, 1.0][..]), (&[], &[]), (&[0.0, 1.0], &[1.0])] {
            let height = terrain(x, &[-1.0, 0.5], z, 0.5).height(&here, 0.0);
            assert_eq!(height, None, "{x:?}");
        }
    }

    /// A missing height without weight does not matter, and the rim has the height of the end.
    #[test]
    fn missing_heights_and_rim_are_handled() {
        let terrain =
            terrain(&[0.0, 1.0, 2.0], &[0.0, 1.0], &[1.0, 2.0, f64::NAN, 3.0, 4.0, 5.0], 0.5);
        let at = |x, y| terrain.height(&Vec3::new(x, y, 0.0), 0.0);
        assert_eq!(at(1.0, 0.0), Some(2.0));
        assert_eq!(at(2.0, 1.0), Some(5.0));
        assert_eq!(at(1.5, 0.5), None);
        assert_eq!(at(-0.5, -0.5), Some(1.0));
        assert_eq!(at(-0.6, 0.0), None);
        assert!(
            terrain.missing(&Vec3::new(1.5, 0.5, 0.0), 0.0).contains("no height at [1.5, 0.5, 0]")
        );
        assert!(
            terrain.missing(&Vec3::new(9.0, 0.5, 0.0), 0.0).contains("covers x from -0.5 to 2.5")
        );
    }
}
