//! Intersecting pairs of many boxes: a uniform grid, and a sweep for boxes too large for it.

#[cfg(test)]
mod tests;

use nalgebra::Vector3;
use rayon::iter::Either;
use rayon::prelude::*;

/// An axis-aligned box: its low and its high corner `[m]`.
pub type Bounds = [Vector3<f64>; 2];

/// Boxes that one task looks at.
const TOGETHER: usize = 1024;
/// Boxes over more cells than this are swept against all.
const LARGE: u64 = 64;
/// Cells are longer along an axis than the median box by this factor: a box is in fewer of them,
const ROOM: f64 = 1.5;
/// and no shorter than about this part of their longest side: boxes can be flat.
const FLATTEST: f64 = 1.0 / 16.0;
/// Bits of a coordinate of a cell in its key. Cells that are a multiple of 2²¹ apart share one.
const BITS: u32 = 21;

/// A box in the grid: its lowest and its highest cell.
type CellRange = [[i64; 3]; 2];

/// Pairs i < j of boxes that meet, touching ones included, sorted, each once. A box that is not
/// finite, or whose low corner is not below its high one, meets nothing.
pub fn meeting(boxes: &[Bounds]) -> Vec<[u32; 2]> {
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
fn meet(a: &Bounds, b: &Bounds) -> bool {
    (0..3).all(|d| (a[0][d] <= b[1][d]) & (b[0][d] <= a[1][d]))
}

/// Edges of the cells, from the medians of those of the boxes.
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

/// For boxes most of which are points: about the distance from one to the next.
fn spacing(boxes: &[Bounds], sound: &[u32]) -> f64 {
    let span = |d: usize| {
        let low = sound.iter().map(|&i| boxes[i as usize][0][d]).fold(f64::INFINITY, f64::min);
        let high = sound.iter().map(|&i| boxes[i as usize][0][d]).fold(f64::NEG_INFINITY, f64::max);
        high - low
    };
    [0, 1, 2].map(span).into_iter().fold(0.0, f64::max) / libm::cbrt(sound.len() as f64)
}

/// The cell that a point is in. Not decreasing with any coordinate, whatever is rounded or beyond
/// the largest integer: that alone makes the pairs right.
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

/// Pairs of boxes of which neither is large: they share the cell of the low corner of what they
/// have in common, and are found there.
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
        let here = meet(&boxes[i as usize], &boxes[j as usize]) && key(first) == here;
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

/// Pairs of large boxes with each other and with small ones, sorted along the axis on which the
/// large ones take up least of the whole.
fn sweep(boxes: &[Bounds], mut small: Vec<u32>, mut large: Vec<u32>, pairs: &mut Vec<[u32; 2]>) {
    let d = sweep_axis(boxes, &small, &large);
    let low = |i: u32| boxes[i as usize][0][d];
    let high = |i: u32| boxes[i as usize][1][d];
    for list in [&mut small, &mut large] {
        list.sort_unstable_by(|&i, &j| low(i).total_cmp(&low(j)).then(i.cmp(&j)));
    }
    let mut add = |i: u32, j: u32| {
        if meet(&boxes[i as usize], &boxes[j as usize]) {
            pairs.push([i.min(j), i.max(j)]);
        }
    };
    let longest = small.iter().map(|&i| high(i) - low(i)).fold(0.0, f64::max);
    for (k, &i) in large.iter().enumerate() {
        let after = large[k + 1..].iter().take_while(|&&j| low(j) <= high(i));
        after.for_each(|&j| add(i, j));
        // A small one that reaches up to it begins no farther below than the longest is long;
        // twice that is beyond rounding.
        let from = small.partition_point(|&j| low(j) < low(i) - 2.0 * longest);
        small[from..].iter().take_while(|&&j| low(j) <= high(i)).for_each(|&j| add(i, j));
    }
}

/// The axis along which the large boxes together are shortest in comparison with the span of all.
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
