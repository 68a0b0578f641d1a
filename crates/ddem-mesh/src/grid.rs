//! Intersecting pairs of many boxes, by a uniform grid and, for boxes too large for it, by a sweep.

#[cfg(test)]
mod tests;

use nalgebra::Vector3;
use rayon::iter::Either;
use rayon::prelude::*;

/// Low and high corner of an axis-aligned box `[m]`.
pub type Bounds = [Vector3<f64>; 2];

/// Boxes per parallel task.
const TOGETHER: usize = 1024;
/// Largest number of cells of a box in the grid; larger boxes are swept against all others.
const LARGE: u64 = 64;
/// Length of a cell along an axis over that of the median box, so that boxes are in fewer cells.
const ROOM: f64 = 1.5;
/// Least length of a cell as a fraction of the longest median, because boxes can be flat.
const FLATTEST: f64 = 1.0 / 16.0;
/// Bits of a cell coordinate in its key. Cells that are a multiple of 2²¹ apart share a key.
const BITS: u32 = 21;

/// Lowest and highest cell of a box in the grid.
type CellRange = [[i64; 3]; 2];

/// Sorted pairs i < j of boxes that intersect or touch, each once. A box that is not finite, or
/// whose low corner exceeds its high corner along an axis, has no pairs.
pub fn overlapping_pairs(boxes: &[Bounds]) -> Vec<[u32; 2]> {
    let sound = |[low, high]: &Bounds| {
        (0..3).all(|d| low[d].is_finite() && high[d].is_finite() && low[d] <= high[d])
    };
    let all = (0..boxes.len()).into_par_iter().with_min_len(TOGETHER);
    let sound: Vec<u32> = all.filter(|&i| sound(&boxes[i])).map(|i| i as u32).collect();
    let edges = edges(boxes, &sound);
    let each = sound.into_par_iter().with_min_len(TOGETHER);
    let (small, large): (Vec<_>, Vec<_>) = each.partition_map(|i| {
        let cells = boxes[i as usize].map(|corner| cell(&corner, &edges));
        if count(&cells) <= LARGE { Either::Left((i, cells)) } else { Either::Right(i) }
    });
    let mut pairs = in_cells(boxes, &small);
    if !large.is_empty() {
        sweep(boxes, small.iter().map(|(i, _)| *i).collect(), large, &mut pairs);
    }
    pairs.par_sort_unstable();
    pairs
}

#[inline(always)]
fn overlap(a: &Bounds, b: &Bounds) -> bool {
    (0..3).all(|d| (a[0][d] <= b[1][d]) & (b[0][d] <= a[1][d]))
}

/// Edge lengths of the cells, from the medians of the box edges.
fn edges(boxes: &[Bounds], sound: &[u32]) -> [f64; 3] {
    let median = |d: usize| {
        let length = |&i: &u32| boxes[i as usize][1][d] - boxes[i as usize][0][d];
        let mut lengths: Vec<f64> = sound.iter().map(length).collect();
        if lengths.is_empty() {
            return 0.0;
        }
        let middle = lengths.len() / 2;
        *lengths.select_nth_unstable_by(middle, f64::total_cmp).1
    };
    let (x, (y, z)) = rayon::join(|| median(0), || rayon::join(|| median(1), || median(2)));
    let medians = [x, y, z];
    let longest = medians.into_iter().fold(0.0, f64::max);
    let longest = if longest > 0.0 { longest } else { spacing(boxes, sound) };
    medians.map(|median| (ROOM * median).max(FLATTEST * longest).max(f64::MIN_POSITIVE))
}

/// Approximate distance between neighbouring boxes, if most boxes are points.
fn spacing(boxes: &[Bounds], sound: &[u32]) -> f64 {
    let span = |d: usize| {
        let low = sound.iter().map(|&i| boxes[i as usize][0][d]).fold(f64::INFINITY, f64::min);
        let high = sound.iter().map(|&i| boxes[i as usize][0][d]).fold(f64::NEG_INFINITY, f64::max);
        high - low
    };
    [0, 1, 2].map(span).into_iter().fold(0.0, f64::max) / libm::cbrt(sound.len() as f64)
}

/// Cell that contains a point. It never decreases with a coordinate, even if values are rounded or
/// beyond the largest integer. The pairs are correct because of that alone.
#[inline(always)]
fn cell(at: &Vector3<f64>, edges: &[f64; 3]) -> [i64; 3] {
    [0, 1, 2].map(|d| (at[d] / edges[d]).floor() as i64)
}

fn count([low, high]: &CellRange) -> u64 {
    (0..3).map(|d| high[d].abs_diff(low[d]).saturating_add(1)).fold(1, u64::saturating_mul)
}

#[inline(always)]
fn key(cell: [i64; 3]) -> u64 {
    let bits = |x: i64| x as u64 & ((1 << BITS) - 1);
    (bits(cell[0]) << (2 * BITS)) | (bits(cell[1]) << BITS) | bits(cell[2])
}

/// Pairs of boxes that are not large. They are found in one cell that both share: that of the low
/// corner of their intersection.
fn in_cells(boxes: &[Bounds], small: &[(u32, CellRange)]) -> Vec<[u32; 2]> {
    let cells = |(at, (_, [low, high])): (usize, &(u32, CellRange))| {
        let [x, y, z] = [0, 1, 2].map(|d| low[d]..=high[d]);
        let rows = x.flat_map(move |x| y.clone().map(move |y| [x, y]));
        rows.flat_map(move |[x, y]| z.clone().map(move |z| (key([x, y, z]), at as u32)))
    };
    let each = small.par_iter().with_min_len(TOGETHER).enumerate();
    let mut entries: Vec<(u64, u32)> = each.flat_map_iter(cells).collect();
    entries.par_sort_unstable();
    let pair = |here: u64, [at, other]: [u32; 2]| {
        let ((i, [low, _]), (j, [other_low, _])) = (small[at as usize], small[other as usize]);
        let first = [0, 1, 2].map(|d| low[d].max(other_low[d]));
        let here = overlap(&boxes[i as usize], &boxes[j as usize]) && key(first) == here;
        here.then_some([i, j])
    };
    let pairs = entries.par_chunk_by(|a, b| a.0 == b.0).flat_map_iter(|cell| {
        let each = cell.iter().enumerate();
        each.flat_map(move |(k, &(here, at))| {
            cell[k + 1..].iter().filter_map(move |&(_, other)| pair(here, [at, other]))
        })
    });
    pairs.collect()
}

/// Adds the pairs of large boxes with each other and with small ones. Boxes are sorted along the
/// axis on which the large ones cover the smallest part.
fn sweep(boxes: &[Bounds], mut small: Vec<u32>, mut large: Vec<u32>, pairs: &mut Vec<[u32; 2]>) {
    let d = sweep_axis(boxes, &small, &large);
    let low = |i: u32| boxes[i as usize][0][d];
    let high = |i: u32| boxes[i as usize][1][d];
    for list in [&mut small, &mut large] {
        list.sort_unstable_by(|&i, &j| low(i).total_cmp(&low(j)).then(i.cmp(&j)));
    }
    let mut add = |i: u32, j: u32| {
        if overlap(&boxes[i as usize], &boxes[j as usize]) {
            pairs.push([i.min(j), i.max(j)]);
        }
    };
    let longest = small.iter().map(|&i| high(i) - low(i)).fold(0.0, f64::max);
    for (k, &i) in large.iter().enumerate() {
        let after = large[k + 1..].iter().take_while(|&&j| low(j) <= high(i));
        after.for_each(|&j| add(i, j));
        // A small box that reaches the large one begins below it by at most the length of the
        // longest small box. Twice that allows for rounding.
        let from = small.partition_point(|&j| low(j) < low(i) - 2.0 * longest);
        small[from..].iter().take_while(|&&j| low(j) <= high(i)).for_each(|&j| add(i, j));
    }
}

/// Axis along which the total length of the large boxes is shortest relative to the span of all.
fn sweep_axis(boxes: &[Bounds], small: &[u32], large: &[u32]) -> usize {
    let covered = [0, 1, 2].map(|d| {
        let all = || small.iter().chain(large).map(|&i| &boxes[i as usize]);
        let low = all().map(|b| b[0][d]).fold(f64::INFINITY, f64::min);
        let high = all().map(|b| b[1][d]).fold(f64::NEG_INFINITY, f64::max);
        let length = |&i: &u32| boxes[i as usize][1][d] - boxes[i as usize][0][d];
        let part = large.iter().map(length).sum::<f64>() / (high - low);
        if part.is_finite() { part } else { f64::MAX }
    });
    let shorter = |best: usize, d: usize| if covered[d] < covered[best] { d } else { best };
    [1, 2].into_iter().fold(0, shorter)
}
