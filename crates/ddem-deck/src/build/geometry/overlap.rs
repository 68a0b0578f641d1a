//! Sets of blocks that overlap or touch.

use std::ops::Range;
use std::sync::Arc;

use crate::schema::Deck;
use ddem_core::problem::{Lattice, Vec3, bounds_of, overlapping_pairs};
use ddem_core::{ErrorCode, Fault};

/// Largest number of faults: many sets in one place would give very many, which nobody reads.
const MOST: usize = 50;

/// Two blocks that overlap, given by their cells in their sets.
struct Overlap {
    cells: [[usize; 3]; 2],
    depth: f64,
}

/// Faults of sets whose blocks overlap by more than their joints allow. A set may fill the place of
/// blocks removed from another.
pub(super) fn overlaps(lattices: &[Arc<Lattice>], deck: &Deck) -> Vec<Fault> {
    let surfaces: Vec<f64> = lattices.iter().map(|lattice| surface(lattice)).collect();
    let fault = |(i, j): (usize, usize)| {
        let rounding = rounding(&lattices[i], &lattices[j]);
        // The joint thicknesses have rounding errors, too.
        let allowed = (surfaces[i] + surfaces[j] + 1e-2 * rounding).max(rounding);
        let Overlap { cells: [in_i, in_j], depth } = deepest(&lattices[i], &lattices[j], allowed)?;
        let message = format!(
            "block {in_j:?} of `{}` and block {in_i:?} of `{}` overlap by {depth:.3e} m",
            deck.set_name(lattices[j].set),
            deck.set_name(lattices[i].set)
        );
        let whence = if allowed > rounding {
            "half the thickness of the joints of each"
        } else {
            "a ten thousandth of the shortest edge"
        };
        let help = format!(
            "move one of the sets: they may touch, or overlap by {allowed:.3e} m, {whence}; blocks \
             are counted along x, y, z from 0"
        );
        Some(
            Fault::new(
                ErrorCode::OverlappingBlocks,
                format!("{}.origin", deck.set_place(lattices[j].set)),
                message,
            )
            .help(help),
        )
    };
    close(lattices).into_iter().filter_map(fault).take(MOST).collect()
}

/// Fraction of the shortest edge by which corners written with a few digits may fail to fit.
/// Contacts accept such an overlap and close such a gap.
const ROUNDING: f64 = 1e-4;

/// Tolerance for corners written with a few digits `[m]`.
fn rounding(a: &Lattice, b: &Lattice) -> f64 {
    ROUNDING * a.shortest().min(b.shortest())
}

/// Pairs of sets that have no gap between them.
pub(super) fn touching(lattices: &[Arc<Lattice>]) -> Vec<(usize, usize)> {
    let touch = |&(i, j): &(usize, usize)| {
        let (a, b) = (&lattices[i], &lattices[j]);
        depth(a, &a.corners(), b, &b.corners()).is_some_and(|(depth, _)| depth >= -rounding(a, b))
    };
    close(lattices).into_iter().filter(touch).collect()
}

/// Pairs of sets, the earlier one first, whose boxes along the coordinate axes meet.
fn close(lattices: &[Arc<Lattice>]) -> Vec<(usize, usize)> {
    let boxes: Vec<[Vec3; 2]> = lattices.iter().map(|lattice| box_around(lattice)).collect();
    let pairs = overlapping_pairs(&boxes).into_iter();
    let mut pairs: Vec<(usize, usize)> = pairs.map(|[i, j]| (i as usize, j as usize)).collect();
    pairs.sort_unstable_by_key(|&(i, j)| (j, i));
    pairs
}

/// The two blocks of two sets that overlap most, if the depth exceeds `allowed`. Only cells that
/// are near each other are compared.
fn deepest(a: &Lattice, b: &Lattice, allowed: f64) -> Option<Overlap> {
    overlap([a, b], [&a.corners(), &b.corners()], allowed)?;
    let mut most: Option<Overlap> = None;
    for cell_b in blocks_near(b, &a.corners()) {
        let in_b = corners_of_cell(b, cell_b);
        for cell_a in blocks_near(a, &in_b) {
            let Some(depth) = overlap([a, b], [&corners_of_cell(a, cell_a), &in_b], allowed) else {
                continue;
            };
            if most.as_ref().is_none_or(|most| depth > most.depth) {
                most = Some(Overlap { cells: [cell_a, cell_b], depth });
            }
        }
    }
    most
}

/// Depth by which two parallelepipeds overlap `[m]`, if it exceeds `allowed`.
fn overlap([a, b]: [&Lattice; 2], corners: [&[Vec3; 8]; 2], allowed: f64) -> Option<f64> {
    let (depth, size) = depth(a, corners[0], b, corners[1])?;
    (depth > allowed + 1e-9 * size).then_some(depth)
}

/// Depth of the overlap and size of two parallelepipeds `[m]`, by separating axes. A negative depth
/// is a gap of at least that width.
fn depth(a: &Lattice, in_a: &[Vec3; 8], b: &Lattice, in_b: &[Vec3; 8]) -> Option<(f64, f64)> {
    let normals = (0..3).flat_map(|d| [a.normal(d), b.normal(d)]);
    let crossed = (0..9).map(|k| a.axes[k / 3].cross(&b.axes[k % 3]));
    let mut depth = f64::INFINITY;
    let size = (in_a[7] - in_a[0]).norm() + (in_b[7] - in_b[0]).norm();
    for axis in normals.chain(crossed).filter(|axis| axis.norm() > 1e-9) {
        let axis = axis.normalize();
        let range = |corners: &[Vec3; 8]| {
            let along = corners.iter().map(|x| x.dot(&axis));
            along.fold((f64::MAX, f64::MIN), |(lo, hi), x| (lo.min(x), hi.max(x)))
        };
        let ((lo_a, hi_a), (lo_b, hi_b)) = (range(in_a), range(in_b));
        depth = depth.min(hi_a.min(hi_b) - lo_a.max(lo_b));
    }
    depth.is_finite().then_some((depth, size))
}

/// Half of the largest thickness of a lattice's joints `[m]`, by which its blocks may reach into
/// those of other sets.
fn surface(lattice: &Lattice) -> f64 {
    let along = |d: usize| {
        let widest = lattice.gaps[d].iter().copied().fold(0.0, f64::max);
        widest * lattice.normal(d).dot(&lattice.axes[d]) / 2.0
    };
    along(0).max(along(1)).max(along(2))
}

/// Box along the coordinate axes around a lattice, enlarged by more than rounding errors.
fn box_around(lattice: &Lattice) -> [Vec3; 2] {
    let [low, high] = bounds_of(&lattice.corners());
    // The margin exceeds the tolerance of touching for any size of the other set.
    let margin = Vec3::repeat(4e-9 * (high - low).norm() + ROUNDING * lattice.shortest());
    [low - margin, high + margin]
}

fn corners_of_cell(lattice: &Lattice, cell: [usize; 3]) -> [Vec3; 8] {
    lattice.corners_of(cell, cell.map(|i| i + 1))
}

/// Cells that have a block and may meet a parallelepiped, x fastest.
fn blocks_near<'a>(
    lattice: &'a Lattice,
    corners: &[Vec3; 8],
) -> impl Iterator<Item = [usize; 3]> + use<'a> {
    let [x, y, z] = [0, 1, 2].map(|d| layers_near(lattice, corners, d));
    let rows = z.flat_map(move |k| y.clone().map(move |j| (j, k)));
    let cells = rows.flat_map(move |(j, k)| x.clone().map(move |i| [i, j, k]));
    cells.filter(|&cell| lattice.has_block(lattice.index(cell)))
}

/// Layers of cells along an edge between the outermost of some points.
fn layers_near(lattice: &Lattice, points: &[Vec3; 8], d: usize) -> Range<usize> {
    let normal = lattice.normal(d);
    let slant = normal.dot(&lattice.axes[d]);
    let along = points.iter().map(|x| (x - lattice.origin).dot(&normal) / slant);
    let (low, high) = along.fold((f64::MAX, f64::MIN), |(low, high), x| (low.min(x), high.max(x)));
    let cuts = &lattice.cuts[d];
    let from = cuts[1..].partition_point(|&cut| cut <= low);
    let to = cuts[..lattice.count[d]].partition_point(|&cut| cut < high);
    from..to.max(from)
}
