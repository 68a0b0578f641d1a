//! Columns of a cell below and above the triangles of a ground.

use std::collections::{BTreeSet, HashMap, HashSet};

use nalgebra::Vector3;

use crate::clipped::{Clipped, ROUNDING};
use crate::ground::{CreaseSide, Ground};
use crate::plane::CutPlane;

/// Mark of the number of a crease or of a piece in place of that of a plane.
pub(crate) const GROUND: u32 = 1 << 31;

/// Width below which a part of a cell is thin, relative to the slack of the ground.
const THIN: f64 = 2.0;

/// Difference of two planes, relative to the slack, that nothing shows.
const NEGLIGIBLE: f64 = 1e-3;

/// Part of a cell below and above triangles of a ground, whose plane it follows.
#[derive(Clone, Debug)]
pub(crate) struct CellColumn {
    triangles: Vec<u32>,
    /// Sides that bound the column.
    sides: Vec<CreaseSide>,
    pub(crate) part: Clipped,
    volume: f64,
    /// Piece of the ground.
    pub(crate) piece: u32,
    /// Below the ground −1, above 1, and 0 if the ground divides it.
    pub(crate) side: i8,
    is_thin: bool,
    /// Largest vertical distance of its plane from the ground over it `[m]`.
    error: f64,
}

/// Columns of one cell.
pub(crate) struct CellColumns<'a> {
    ground: &'a Ground,
    whole: &'a Clipped,
    volume: f64,
    tolerance: f64,
    pub(crate) all: Vec<CellColumn>,
}

/// Reason to make one column of two: the error that the first one then has, or none.
type Reason = fn(&CellColumns<'_>, &CellColumn, &CellColumn) -> Option<f64>;

/// Place of the reason that makes no difference.
const BOTH_WHOLE: usize = 1;

/// Reasons in their order.
const REASONS: [Reason; 4] = [
    // One plane.
    |_, one, other| (one.piece == other.piece).then_some(one.error),
    // Both are whole.
    |_, one, other| (one.side != 0 && one.side == other.side).then_some(one.error),
    // Two planes that nothing tells apart.
    |of, one, other| {
        let error = one.error + of.error(one, other).max(of.error(other, one));
        (error <= NEGLIGIBLE * of.ground.slack).then_some(error)
    },
    // The first one is thin.
    |of, one, other| {
        let error = one.error + of.error(one, other);
        (one.is_thin && error <= of.ground.slack).then_some(error)
    },
];

impl CellColumn {
    /// True if two of its sides lie in one plane.
    fn has_straight_edge(&self) -> bool {
        let mut creases: Vec<u32> = self.sides.iter().map(|side| side.crease).collect();
        creases.sort_unstable();
        creases.windows(2).any(|two| two[0] == two[1])
    }
}

impl<'a> CellColumns<'a> {
    /// Columns of a cell with few joined ones; `None` if rounding errors spoil them.
    pub(crate) fn new(ground: &'a Ground, whole: &'a Clipped, tolerance: f64) -> Option<Self> {
        let mut columns =
            Self { ground, whole, volume: whole.volume(), tolerance, all: Vec::new() };
        let [low, high] = whole.bounds();
        for triangle in ground.buckets.over(&low, &high) {
            let sides: Vec<CreaseSide> =
                ground.sides[triangle as usize].iter().flatten().copied().collect();
            let piece = ground.pieces[triangle as usize];
            columns.all.extend(columns.column(vec![triangle], &sides, (piece, 0.0)));
        }
        let sum: f64 = columns.all.iter().map(|column| column.volume).sum();
        if (sum - columns.volume).abs() > ROUNDING * columns.volume {
            return None;
        }
        if columns.all.iter().any(|column| column.side == 0) {
            columns.unite_pieces();
            for (i, reason) in REASONS.into_iter().enumerate() {
                columns.unite(reason, i == BOTH_WHOLE);
            }
        }
        Some(columns)
    }

    /// Part of the cell within sides of triangles; `None` if there is none.
    fn column(
        &self,
        triangles: Vec<u32>,
        sides: &[CreaseSide],
        (piece, error): (u32, f64),
    ) -> Option<CellColumn> {
        let mut part = self.whole.clone();
        for side in sides {
            let plane = &self.ground.creases[side.crease as usize];
            let sign = if side.above { -1.0 } else { 1.0 };
            part.clip(|x| sign * plane.height(x), GROUND | side.crease, self.tolerance)?;
            if part.faces.is_empty() {
                return None;
            }
        }
        // Several sides may lie in one face.
        let bounds =
            |of: &&CreaseSide| part.faces.iter().any(|face| face.plane == GROUND | of.crease);
        let bounding = sides.iter().filter(bounds).copied().collect();
        let volume = part.volume();
        let (side, is_thin) = self.side(&part, piece, self.ground.slack - error);
        Some(CellColumn { triangles, sides: bounding, part, volume, piece, side, is_thin, error })
    }

    /// Side of a part to the plane of a piece, and true if it or what the plane cuts off is thin. A plane
    /// that would leave a thin layer, no higher than the `room`, leaves the part whole.
    fn side(&self, part: &Clipped, piece: u32, room: f64) -> (i8, bool) {
        let plane = &self.ground.planes[piece as usize];
        let [low, high] = part.extent(|x| plane.height(x));
        let thin = THIN * self.ground.slack;
        let is_thin = part.width() < thin;
        if high <= self.tolerance {
            return (-1, is_thin);
        }
        if low >= -self.tolerance {
            return (1, is_thin);
        }
        if is_thin {
            return (0, true);
        }
        let thin_half = |sign: f64| {
            let mut half = part.clone();
            let cut = half.clip(|x| sign * plane.height(x), GROUND, self.tolerance);
            cut.is_none() || half.faces.is_empty() || half.width() < thin
        };
        let room = room * plane.normal.z;
        match [1.0, -1.0].map(thin_half) {
            [_, true] if high <= room => (-1, false),
            [true, _] if low >= -room => (1, false),
            [below, above] => (0, below || above),
        }
    }

    /// Largest vertical distance between the planes of two columns over the first one `[m]`.
    fn error(&self, one: &CellColumn, other: &CellColumn) -> f64 {
        let [own, plane] = [one, other].map(|of| &self.ground.planes[of.piece as usize]);
        let height = |of: &CutPlane, x: &Vector3<f64>| of.height(x) / of.normal.z;
        let [low, high] = one.part.extent(|x| height(own, x) - height(plane, x));
        high.max(-low)
    }

    /// One column of all that lie over each piece, if it is convex.
    fn unite_pieces(&mut self) {
        let mut pieces: Vec<u32> = self.all.iter().map(|column| column.piece).collect();
        pieces.sort_unstable();
        for piece in pieces.chunk_by(|a, b| a == b).filter(|of| of.len() > 2) {
            let own: Vec<usize> =
                (0..self.all.len()).filter(|&i| self.all[i].piece == piece[0]).collect();
            let errors = own.iter().map(|&i| self.all[i].error);
            let error = errors.fold(0.0, f64::max);
            if let Some(column) = self.united(&own, (piece[0], error)) {
                let first = own[0];
                let mut number = 0..;
                self.all.retain(|_| number.next().is_some_and(|at| !own[1..].contains(&at)));
                self.all[first] = column;
            }
        }
    }

    /// Column of several, in place of them; `None` if it is not convex.
    fn united(&self, own: &[usize], plane: (u32, f64)) -> Option<CellColumn> {
        let triangles: Vec<u32> =
            own.iter().flat_map(|&i| self.all[i].triangles.iter().copied()).collect();
        let sides = own.iter().flat_map(|&i| &self.all[i].sides);
        let outer: Vec<CreaseSide> =
            sides.filter(|side| !triangles.contains(&side.beyond)).copied().collect();
        let column = self.column(triangles, &outer, plane)?;
        let sum: f64 = own.iter().map(|&i| self.all[i].volume).sum();
        ((column.volume - sum).abs() <= ROUNDING * self.volume).then_some(column)
    }

    /// Makes one column of two neighbours as long as there is a reason. The second one gives its plane. With
    /// `keep_edges` no face of it meets two others.
    fn unite(&mut self, reason: Reason, keep_edges: bool) {
        // Pairs that are not convex, by their first triangles and numbers of triangles.
        let mut tried = HashSet::new();
        let name = |column: &CellColumn| (column.triangles[0], column.triangles.len());
        loop {
            let mut pairs = self.neighbours();
            pairs.retain(|&[i, j]| !tried.contains(&[i, j].map(|of| name(&self.all[of]))));
            let error =
                |&[i, j]: &[usize; 2]| Some((reason(self, &self.all[i], &self.all[j])?, [i, j]));
            let mut pairs: Vec<(f64, [usize; 2])> = pairs.iter().filter_map(error).collect();
            pairs.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            let mut changed = vec![false; self.all.len()];
            let mut united = Vec::new();
            for (error, pair) in pairs {
                if pair.iter().any(|&of| changed[of]) {
                    continue;
                }
                let [one, other] = pair.map(|of| &self.all[of]);
                let column = self.united(&pair, (other.piece, error.max(other.error)));
                match column.filter(|column| !keep_edges || !column.has_straight_edge()) {
                    None => {
                        tried.insert([one, other].map(name));
                    }
                    Some(mut column) => {
                        if one.side == other.side && one.side != 0 {
                            column.side = one.side;
                        }
                        pair.iter().for_each(|&of| changed[of] = true);
                        united.push((pair, column));
                    }
                }
            }
            if united.is_empty() {
                return;
            }
            let gone: HashSet<usize> = united.iter().map(|([i, j], _)| *i.max(j)).collect();
            for ([i, j], column) in united {
                self.all[i.min(j)] = column;
            }
            let mut number = 0..;
            self.all.retain(|_| number.next().is_some_and(|at| !gone.contains(&at)));
        }
    }

    /// Pairs of columns that meet at a crease, the smaller one first.
    fn neighbours(&self) -> BTreeSet<[usize; 2]> {
        let owners: HashMap<u32, usize> = (self.all.iter().enumerate())
            .flat_map(|(i, column)| column.triangles.iter().map(move |&of| (of, i)))
            .collect();
        let mut pairs = BTreeSet::new();
        for (i, column) in self.all.iter().enumerate() {
            let beyond = column.sides.iter().filter_map(|side| owners.get(&side.beyond));
            pairs.extend(beyond.map(|&j| {
                let larger = column.volume > self.all[j].volume;
                if larger { [j, i] } else { [i, j] }
            }));
        }
        pairs
    }
}
