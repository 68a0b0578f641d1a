//! Division of a cell by a plane.

use crate::cell::{self, CellFace};

/// Parts of a cell below and above a plane.
#[derive(Debug)]
pub(crate) struct CellHalves {
    pub(crate) below: Vec<CellFace>,
    pub(crate) above: Vec<CellFace>,
}

/// Parts of a face below and above a plane, with all corners on the plane.
#[derive(Debug)]
struct FaceHalves {
    below: Vec<u32>,
    above: Vec<u32>,
}

/// Divides a cell. `side` is the side of a point, −1, 0 or 1; `crossing` the number of the point in
/// which an edge meets the plane. Sides are decided once for each point, so that all cells around
/// a point or an edge agree.
///
/// `None` if rounding errors leave no two polyhedra; the cell then stays as it is.
pub(crate) fn split(
    faces: &[CellFace],
    plane: u32,
    side: impl Fn(u32) -> i8,
    mut crossing: impl FnMut(u32, u32) -> u32,
) -> Option<CellHalves> {
    let mut halves = CellHalves { below: Vec::new(), above: Vec::new() };
    let mut on_plane = Vec::new();
    for face in faces {
        let sides = || face.corners.iter().map(|&corner| side(corner));
        on_plane.extend(face.corners.iter().copied().filter(|&corner| side(corner) == 0));
        match (sides().any(|side| side < 0), sides().any(|side| side > 0)) {
            (true, true) => {
                let parts = split_face(&face.corners, &side, &mut crossing, &mut on_plane)?;
                halves.below.push(CellFace { plane: face.plane, corners: parts.below });
                halves.above.push(CellFace { plane: face.plane, corners: parts.above });
            }
            (true, false) => halves.below.push(face.clone()),
            (false, true) => halves.above.push(face.clone()),
            // Below and above would be equally wrong.
            (false, false) => return None,
        }
    }
    on_plane.sort_unstable();
    on_plane.dedup();
    let cap = cap(&halves, &on_plane)?;
    halves.below.push(CellFace { plane, corners: cap.iter().rev().copied().collect() });
    halves.above.push(CellFace { plane, corners: cap });
    let sound = cell::check(&halves.below).is_ok() && cell::check(&halves.above).is_ok();
    sound.then_some(halves)
}

/// Divides a face with corners on both sides. `None` if it crosses the plane more than twice.
fn split_face(
    corners: &[u32],
    side: &impl Fn(u32) -> i8,
    crossing: &mut impl FnMut(u32, u32) -> u32,
    on_plane: &mut Vec<u32>,
) -> Option<FaceHalves> {
    let n = corners.len();
    let at = |i: usize| corners[i % n];
    // The first corner above after one below. A corner on the plane between two corners of one side
    // counts as theirs.
    let before = |i: usize| (1..n).map(|back| side(at(i + n - back))).find(|&side| side != 0);
    let start = (0..n).find(|&i| side(at(i)) > 0 && before(i) == Some(-1))?;
    let find = |from: usize, wanted: i8| (from..start + n).find(|&i| side(at(i)) == wanted);
    let after_last = |from: usize, to: usize, wanted: i8| {
        (from..to).rev().find(|&i| side(at(i)) == wanted).map(|i| i + 1)
    };
    let below = find(start, -1)?;
    let down = after_last(start, below, 1)?;
    if find(below, 1).is_some() {
        return None;
    }
    let end = start + n;
    let up = after_last(below, end, -1)?;
    // Of several corners on the plane one divides the face: the same in all cells around.
    let mut crossing_of = |range: std::ops::Range<usize>| {
        let lowest = range.clone().min_by_key(|&i| at(i));
        match lowest {
            Some(i) => (at(i), i, i + 1),
            None => {
                let i = range.start;
                let point = crossing(at(i + n - 1), at(i));
                on_plane.push(point);
                (point, i, i)
            }
        }
    };
    let (exit, exit_from, exit_to) = crossing_of(down..below);
    let (entry, entry_from, entry_to) = crossing_of(up..end);
    let part = |range: std::ops::Range<usize>| range.map(at);
    let below = std::iter::once(exit).chain(part(exit_to..entry_from)).chain([entry]).collect();
    let above = std::iter::once(entry)
        .chain(part(entry_to..start + n))
        .chain(part(start..exit_from))
        .chain([exit])
        .collect();
    Some(FaceHalves { below, above })
}

/// Edges between points on the plane that belong to one face only, reversed.
fn open_edges(faces: &[CellFace], on_plane: &[u32]) -> Vec<(u32, u32)> {
    let on = |point: u32| on_plane.binary_search(&point).is_ok();
    let mut edges: Vec<(u32, u32)> =
        faces.iter().flat_map(CellFace::edges).filter(|&(a, b)| on(a) && on(b)).collect();
    edges.sort_unstable();
    let alone = |&(a, b): &(u32, u32)| edges.binary_search(&(b, a)).is_err();
    let mut open: Vec<_> = edges.iter().copied().filter(alone).map(|(a, b)| (b, a)).collect();
    open.sort_unstable();
    open
}

/// Corners of the new face, counter-clockwise seen from below; `None` unless its edges close to one
/// loop, the same for both parts.
fn cap(halves: &CellHalves, on_plane: &[u32]) -> Option<Vec<u32>> {
    let pieces = open_edges(&halves.above, on_plane);
    let mut others: Vec<_> =
        open_edges(&halves.below, on_plane).iter().map(|&(a, b)| (b, a)).collect();
    others.sort_unstable();
    if pieces.len() < 3 || pieces != others {
        return None;
    }
    let first = pieces[0].0;
    let mut corners = vec![first];
    let mut end = pieces[0].1;
    while end != first {
        corners.push(end);
        let next = pieces.binary_search_by_key(&end, |piece| piece.0).ok()?;
        end = pieces[next].1;
        if corners.len() > pieces.len() {
            return None;
        }
    }
    (corners.len() == pieces.len()).then_some(corners)
}
