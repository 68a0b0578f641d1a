//! Cavities left by removed blocks: their walls, and the polygons that close the gaps between
//! walls.
//!
//! ```text
//!   +-----+ gap +-----+        c  cells of the cavity
//!   |  B  |-----|  B  |        =  walls: faces of the blocks around
//!   +=====+-----+=====+        -  strips across gaps and edges, between the edges of two walls;
//!    \                 \          where three edges meet, corners close the rest
//!   +-+       c     c   +-+
//! ```

use std::collections::{BTreeMap, BTreeSet};

use super::super::geometry::Selector;
use super::holes::{CellIndex, Holes, Wall, beside, blocks_in, face, walls};
use super::mesh::SurfaceBuilder;
use ddem_core::problem::{
    BlockFace, ELSEWHERE, Geometry, Lattice, NONE, Vec3, bounds_of, moved_to,
};

/// Distances behind a side of a cell at which the neighbour is looked up, as fractions of its edge.
const BEYOND: [f64; 3] = [1e-3, 1e-2, 5e-2];

/// One cavity.
pub(super) struct Cavity {
    pub(super) mesh: SurfaceBuilder,
    /// Volume by its cells `[m³]`.
    pub(super) volume: f64,
    /// Shortest extent of the cavity `[m]`.
    pub(super) shortest_extent: f64,
    /// Numbers of selected walls and of all walls.
    pub(super) walls: [usize; 2],
    /// Area of the selected walls `[m²]`.
    pub(super) area: f64,
    /// Positions and kinds of the sides at which its surface is open.
    pub(super) ends: Vec<(Vec3, CavityEnd)>,
    /// Blocks of other sets that stand in it.
    pub(super) within: Vec<usize>,
}

/// Neighbour behind a side of a cavity that has no wall.
#[derive(Clone, Copy, Debug, Eq, Ord, PartialEq, PartialOrd)]
pub(super) enum CavityEnd {
    /// No neighbour: the cavity is open.
    Open,
    /// Cavity among blocks of the same set that are split differently.
    OtherCavity,
    /// Blocks of the same set that are split differently.
    Split,
    /// Blocks of another set.
    Set(usize),
}

/// Cavities with walls that a `where` selects.
pub(super) fn cavities(selector: &Selector, holes: &Holes<'_>) -> Vec<Cavity> {
    let (mut cavities, geometry) = (Vec::new(), holes.geometry);
    for (lattice, empty) in holes.empty_near(selector) {
        let selected: BTreeMap<Wall, BlockFace> = walls(lattice, &empty)
            .filter(|(_, surface)| {
                selector.contains_face(&surface.centre(geometry), &surface.outward(geometry))
            })
            .collect();
        let mut cells: BTreeSet<CellIndex> = selected.keys().map(|wall| wall.0).collect();
        if !cells.is_empty() {
            cells.extend(empty.iter().filter(|cell| selector.in_ranges(&lattice.centre(**cell))));
        }
        while let Some(cell) = cells.first().copied() {
            let part = connected(lattice, &mut cells, cell);
            let corners = corners(lattice, &part);
            let [low, high] = bounds_of(&corners);
            let wide = Vec3::repeat(BEYOND[2] * (high - low).sum());
            let around = holes.overlapping([low - wide, high + wide]);
            let space =
                CavityCells { around, geometry, lattice, cells: part, corners, walls: &selected };
            cavities.extend(space.cavity());
        }
    }
    cavities
}

/// Corners of the smallest box around some cells, along the edges of the lattice.
fn corners(lattice: &Lattice, cells: &BTreeSet<CellIndex>) -> [Vec3; 8] {
    let ends = |d: usize, end: usize| cells.iter().map(move |cell| cell[d] + end);
    let from = [0, 1, 2].map(|d| ends(d, 0).min().unwrap_or(0));
    let to = [0, 1, 2].map(|d| ends(d, 1).max().unwrap_or(0));
    lattice.corners_of(from, to)
}

/// Removes the cells that are connected with `first` from `cells` and returns them.
fn connected(
    lattice: &Lattice,
    cells: &mut BTreeSet<CellIndex>,
    first: CellIndex,
) -> BTreeSet<CellIndex> {
    let (mut part, mut next) = (BTreeSet::new(), vec![first]);
    while let Some(cell) = next.pop() {
        if cells.remove(&cell) {
            part.insert(cell);
            let sides = (0..3).flat_map(|d| [(d, -1), (d, 1)]);
            next.extend(sides.filter_map(|(d, side)| beside(lattice, cell, d, side)));
        }
    }
    part
}

/// Connected cells and their walls.
struct CavityCells<'a> {
    /// Lattices whose boxes are near the cells.
    around: Vec<&'a Lattice>,
    geometry: &'a Geometry,
    lattice: &'a Lattice,
    cells: BTreeSet<CellIndex>,
    /// Corners of the smallest box around all cells, along the edges of the lattice.
    corners: [Vec3; 8],
    walls: &'a BTreeMap<Wall, BlockFace>,
}

impl CavityCells<'_> {
    fn cavity(&self) -> Option<Cavity> {
        let of = |&cell: &CellIndex| self.walls.range((cell, 0, i32::MIN)..=(cell, 2, i32::MAX));
        let own = || self.cells.iter().flat_map(of);
        own().next()?;
        let mut mesh = SurfaceBuilder::default();
        for (_, surface) in own() {
            mesh.add_wall(self.geometry, surface);
        }
        for d in 0..3 {
            let (e, f) = ((d + 1) % 3, (d + 2) % 3);
            let around = |cell: &CellIndex| {
                let edge = |(i, j): (usize, usize)| {
                    moved_to(moved_to(*cell, e, cell[e] + i), f, cell[f] + j)
                };
                [(0, 0), (1, 0), (0, 1), (1, 1)].map(edge)
            };
            let edges: BTreeSet<CellIndex> = self.cells.iter().flat_map(around).collect();
            edges.into_iter().for_each(|edge| self.close_edge(&mut mesh, d, edge));
        }
        self.close_corners(&mut mesh);
        let sides = |cell: &CellIndex| [0, 1, 2].map(|d| [-1, 1].map(|side| (*cell, d, side)));
        let all = self.cells.iter().flat_map(sides).flatten();
        let all = all.filter(|wall| face(self.lattice, *wall).is_some()).count();
        let walls = [own().count(), all];
        let area = own().map(|(_, surface)| surface.area(self.geometry)).sum();
        let (volume, shortest_extent) = self.extent();
        let ends = if mesh.is_closed() { Vec::new() } else { self.ends() };
        Some(Cavity { mesh, volume, shortest_extent, walls, area, ends, within: self.within() })
    }

    /// Centres of the cell sides behind which the lattice has neither a block nor an empty cell,
    /// with the neighbour behind each.
    fn ends(&self) -> Vec<(Vec3, CavityEnd)> {
        let Self { lattice, .. } = self;
        let mut ends = Vec::new();
        for &cell in &self.cells {
            for (d, side) in (0..3).flat_map(|d| [(d, -1), (d, 1)]) {
                let next = beside(lattice, cell, d, side);
                let elsewhere = next.map(|next| lattice.block[lattice.index(next)] == ELSEWHERE);
                if elsewhere != Some(false) {
                    ends.push(self.end(cell, d, side));
                }
            }
        }
        ends
    }

    fn end(&self, cell: CellIndex, d: usize, side: i32) -> (Vec3, CavityEnd) {
        let lattice = self.lattice;
        let (e, f) = ((d + 1) % 3, (d + 2) % 3);
        // Points beyond the joint between sets, in the quarters of the side: smaller blocks may
        // meet in its middle.
        let point = |beyond: f64, [i, k]: [f64; 2]| {
            let mut along = [0.0; 3];
            let between = |d: usize, part: f64| {
                let [low, high] = [0, 1].map(|end| lattice.cuts[d][cell[d] + end]);
                low + part * (high - low)
            };
            along[d] = between(d, 0.5 + f64::from(side) * (0.5 + beyond));
            (along[e], along[f]) = (between(e, i), between(f, k));
            lattice.point(along)
        };
        let quarters = [[0.25, 0.25], [0.75, 0.25], [0.25, 0.75], [0.75, 0.75]];
        // A lid may have a joint below it; points farther away are tried if the nearest find
        // nothing.
        let seen = BEYOND.iter().flat_map(|&beyond| quarters.map(|quarter| (beyond, quarter)));
        let mut seen = seen.map(|(beyond, quarter)| self.behind(&point(beyond, quarter)));
        let first = seen.by_ref().take(quarters.len()).max();
        let end = first.filter(|end| *end != CavityEnd::Open).or_else(|| seen.max());
        (point(0.0, [0.5; 2]), end.unwrap_or(CavityEnd::Open))
    }

    /// Neighbour in other lattices at a point. If there are several, it is the last in the order of
    /// `CavityEnd`, so that blocks precede cavities.
    fn behind(&self, x: &Vec3) -> CavityEnd {
        let set = self.lattice.set;
        let at = |lattice: &Lattice| {
            let content = lattice.block[lattice.index(lattice.cell_at(x)?)];
            match content {
                ELSEWHERE => None,
                NONE => (lattice.set == set).then_some(CavityEnd::OtherCavity),
                _ if lattice.set == set => Some(CavityEnd::Split),
                _ => Some(CavityEnd::Set(lattice.set)),
            }
        };
        self.around.iter().copied().filter_map(at).max().unwrap_or(CavityEnd::Open)
    }

    /// Blocks of other sets whose centre is in one of the cells.
    fn within(&self) -> Vec<usize> {
        let Self { geometry, lattice, .. } = self;
        let here = |x: &Vec3| lattice.cell_at(x).is_some_and(|c| self.cells.contains(&c));
        let mut blocks = Vec::new();
        for other in self.around.iter().filter(|other| other.set != lattice.set) {
            let near = blocks_in(other, other.cells_among(&self.corners));
            blocks.extend(near.filter(|&block| here(&geometry.centre(block))));
        }
        blocks.sort_unstable();
        blocks
    }

    /// Volume of the cells up to the walls `[m³]` and their shortest extent `[m]`.
    fn extent(&self) -> (f64, f64) {
        let Self { lattice, .. } = self;
        let end = |cell: CellIndex, d: usize, side: i32| {
            let plane = cell[d] + usize::from(side > 0);
            let inner = beside(lattice, cell, d, side).is_some_and(|c| self.cells.contains(&c));
            let gap = if inner { 0.0 } else { lattice.gaps[d][plane] / 2.0 };
            lattice.cuts[d][plane] + f64::from(side) * gap
        };
        let [x, y, z] = &lattice.axes;
        let skew = x.dot(&y.cross(z)).abs();
        let (mut volume, mut box_) = (0.0, [[f64::INFINITY, f64::NEG_INFINITY]; 3]);
        for &cell in &self.cells {
            let mut part = skew;
            for (d, [low, high]) in box_.iter_mut().enumerate() {
                let (from, to) = (end(cell, d, -1), end(cell, d, 1));
                part *= to - from;
                (*low, *high) = (low.min(from), high.max(to));
            }
            volume += part;
        }
        (volume, box_.iter().map(|[low, high]| high - low).fold(f64::INFINITY, f64::min))
    }

    /// The four cells around a lattice edge along `d`, in circular order. `edge` gives the planes
    /// across.
    fn around(&self, d: usize, edge: CellIndex) -> [Option<CellIndex>; 4] {
        let (e, f) = ((d + 1) % 3, (d + 2) % 3);
        [(1, 1), (0, 1), (0, 0), (1, 0)].map(|(i, j)| {
            let (along_e, along_f) = (edge[e].checked_sub(i)?, edge[f].checked_sub(j)?);
            let cell = moved_to(moved_to(edge, e, along_e), f, along_f);
            (0..3).all(|k| cell[k] < self.lattice.count[k]).then_some(cell)
        })
    }

    /// Adds strips from wall to wall across the cells of the cavity at a lattice edge along `d`.
    fn close_edge(&self, mesh: &mut SurfaceBuilder, d: usize, edge: CellIndex) {
        let around = self.around(d, edge);
        let within = |q: usize| around[q % 4].is_some_and(|cell| self.cells.contains(&cell));
        for first in (0..4).filter(|&q| within(q) && !within(q + 3)) {
            let last = (first..first + 4).take_while(|&q| within(q)).last().unwrap_or(first);
            let before = self.line(d, edge, [around[first], around[(first + 3) % 4]]);
            let after = self.line(d, edge, [around[last % 4], around[(last + 1) % 4]]);
            let (Some(before), Some(after)) = (before, after) else { continue };
            if before == after {
                continue;
            }
            for (p, q) in before.windows(2).zip(after.windows(2)) {
                mesh.add_beside(vec![p[0], p[1], q[1], q[0]]);
            }
        }
    }

    /// Nodes along a lattice edge of the wall between two adjacent cells, if there is a wall.
    fn line(
        &self,
        d: usize,
        edge: CellIndex,
        [cell, next]: [Option<CellIndex>; 2],
    ) -> Option<Vec<u32>> {
        let (cell, next) = (cell?, next?);
        let normal = (0..3).find(|&k| cell[k] != next[k])?;
        let side = if next[normal] > cell[normal] { 1 } else { -1 };
        let surface = self.walls.get(&(cell, normal, side))?;
        let n = self.lattice.divisions;
        let node = |k: usize| {
            let mut at = [0, 1, 2].map(|axis| if next[axis] < edge[axis] { n } else { 0 });
            at[d] = k;
            self.geometry.node(surface.block, at) as u32
        };
        Some((0..=n).map(node).collect())
    }

    /// Closes the openings that remain at single points of the lattice.
    fn close_corners(&self, mesh: &mut SurfaceBuilder) {
        let mut corners: BTreeMap<CellIndex, BTreeMap<u32, u32>> = BTreeMap::new();
        for (a, b) in mesh.rim() {
            if let (Some(at), Some(other)) = (self.corner(a), self.corner(b))
                && at == other
            {
                // The new polygon runs in the opposite direction of the existing edge.
                corners.entry(at).or_default().insert(b, a);
            }
        }
        for mut next in corners.into_values() {
            while let Some((first, second)) = next.pop_first() {
                let mut polygon = vec![first];
                let mut at = second;
                while at != first {
                    polygon.push(at);
                    let Some(following) = next.remove(&at) else { break };
                    at = following;
                }
                if at == first && polygon.len() > 2 {
                    mesh.add(polygon);
                }
            }
        }
    }

    /// Lattice point of a node that is a corner of its block.
    fn corner(&self, node: u32) -> Option<CellIndex> {
        let (block, at) = self.geometry.locate(node as usize);
        let n = self.lattice.divisions;
        let cell = self.geometry.blocks[block].cell;
        let ends = at.iter().all(|&i| i == 0 || i == n);
        ends.then(|| [0, 1, 2].map(|k| cell[k] as usize + usize::from(at[k] == n)))
    }
}

/// Centre of the joint between the faces of two blocks.
pub(super) fn between(geometry: &Geometry, [a, b]: &[BlockFace; 2]) -> Vec3 {
    (a.centre(geometry) + b.centre(geometry)) / 2.0
}
