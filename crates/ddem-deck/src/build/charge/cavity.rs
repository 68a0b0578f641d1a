//! Cavities that removed blocks have left: their walls, and what closes the gaps between them.
//!
//! ```text
//!   +-----+ gap +-----+        c  cells of the cavity
//!   |  B  |-----|  B  |        =  walls: faces of the blocks around
//!   +=====+-----+=====+        -  strips across gaps and edges, between the edges of two walls;
//!    \                 \          where three edges meet, corners close what is left
//!   +-+       c     c   +-+
//! ```

use std::collections::{BTreeMap, BTreeSet};

use super::super::geometry::Region;
use super::mesh::Mesh;
use ddem_core::problem::{
    BlockFace, ELSEWHERE, FaceOf, Geometry, Lattice, NONE, Vec3, bounds_of, moved_to,
};

type Cell = [usize; 3];

/// How far behind a side of a cell it is looked for what is there, by its edge.
const BEYOND: [f64; 3] = [1e-3, 1e-2, 5e-2];

/// A wall, by the cell of the cavity that it looks into, the direction of its normal, and the side of
/// the cell.
pub(super) type Wall = (Cell, usize, i32);

/// One cavity.
pub(super) struct Cavity {
    pub(super) mesh: Mesh,
    /// Volume by its cells `[m³]`.
    pub(super) volume: f64,
    /// Its shortest extent `[m]`.
    pub(super) reach: f64,
    /// How many of its walls are selected, and how many it has.
    pub(super) walls: [usize; 2],
    /// Area of those that are selected `[m²]`.
    pub(super) area: f64,
    /// Where its surface ends at the side of a cell, and at what.
    pub(super) ends: Vec<(Vec3, End)>,
    /// Blocks of other sets that stand in it.
    pub(super) within: Vec<usize>,
}

/// What is behind a side of a cavity where there is no wall.
#[derive(Clone, Copy, Debug, Eq, Ord, PartialEq, PartialOrd)]
pub(super) enum End {
    /// Nothing.
    Open,
    /// A cavity among blocks of the set that are split otherwise.
    GoesOn,
    /// Such blocks.
    Split,
    /// Blocks of another set.
    Set(usize),
}

/// The cell on a side of a cell, if the lattice has it.
fn beside(lattice: &Lattice, cell: Cell, d: usize, side: i32) -> Option<Cell> {
    let next = cell[d].checked_add_signed(side as isize).filter(|next| *next < lattice.count[d])?;
    Some(moved_to(cell, d, next))
}

fn body(lattice: &Lattice, cell: Cell) -> Option<usize> {
    let index = lattice.index(cell);
    lattice.has_body(index).then(|| lattice.body[index] as usize)
}

/// The face of a block behind a side of an empty cell.
fn face(lattice: &Lattice, (cell, normal, side): Wall) -> Option<BlockFace> {
    let body = body(lattice, beside(lattice, cell, normal, side)?)?;
    Some(BlockFace { block: body, face: FaceOf { direction: normal, upper: side < 0 } })
}

/// Part of the size of a lattice by which the box around it is wider: more than rounding.
const MARGIN: f64 = 1e-6;

/// Empty cells of the lattices of a geometry, found once for all charges there.
pub(in crate::build) struct Holes<'a> {
    pub(in crate::build) geometry: &'a Geometry,
    /// Of each lattice.
    empty: Vec<Vec<Cell>>,
    /// Boxes around the lattices `[m]`.
    boxes: Vec<[Vec3; 2]>,
}

impl<'a> Holes<'a> {
    pub(in crate::build) fn new(geometry: &'a Geometry) -> Self {
        let empty = |lattice: &Lattice| {
            let cells = (0..lattice.body.len()).filter(|&i| lattice.body[i] == NONE);
            cells.map(|i| lattice.cell(i)).collect()
        };
        let around = |lattice: &Lattice| {
            let [low, high] = bounds_of(&lattice.corners());
            let margin = MARGIN * (high - low).norm();
            [low.add_scalar(-margin), high.add_scalar(margin)]
        };
        let lattices = || geometry.lattices.iter();
        let (empty, boxes) = (lattices().map(empty).collect(), lattices().map(around).collect());
        Self { geometry, empty, boxes }
    }

    /// Lattices of the sets of a region, with their empty cells.
    pub(super) fn of(&self, region: &Region) -> impl Iterator<Item = (&'a Lattice, &[Cell])> {
        let all = self.geometry.lattices.iter().zip(&self.empty);
        all.filter(|(lattice, _)| region.has_set(lattice.set)).map(|(of, cells)| (of, &cells[..]))
    }

    /// Lattices that may have a point.
    fn near(&self, x: Vec3) -> impl Iterator<Item = &'a Lattice> {
        let within =
            move |[low, high]: &[Vec3; 2]| (0..3).all(|d| low[d] <= x[d] && x[d] <= high[d]);
        let all = self.geometry.lattices.iter().zip(&self.boxes);
        all.filter(move |(_, bounds)| within(bounds)).map(|(lattice, _)| lattice)
    }
}

/// Walls of cavities with these empty cells.
pub(super) fn walls(lattice: &Lattice, empty: &[Cell]) -> impl Iterator<Item = (Wall, BlockFace)> {
    let sides = |cell| (0..3).flat_map(move |d| [(cell, d, -1), (cell, d, 1)]);
    let walls = empty.iter().copied().flat_map(sides);
    walls.filter_map(|wall| Some((wall, face(lattice, wall)?)))
}

/// Whether a face of a block is a wall of a cavity.
pub(in crate::build) fn is_wall(geometry: &Geometry, surface: &BlockFace) -> bool {
    let lattice = geometry.lattice(surface.block);
    let cell = geometry.bodies[surface.block].cell.map(|c| c as usize);
    let next = beside(lattice, cell, surface.direction(), surface.face.side());
    next.is_some_and(|next| lattice.body[lattice.index(next)] == NONE)
}

/// The cavities of which a region selects walls.
pub(super) fn cavities(region: &Region, holes: &Holes<'_>) -> Vec<Cavity> {
    let (mut cavities, geometry) = (Vec::new(), holes.geometry);
    for (lattice, empty) in holes.of(region) {
        let selected: BTreeMap<Wall, BlockFace> = walls(lattice, empty)
            .filter(|(_, surface)| {
                region.contains_face(&surface.centre(geometry), &surface.outward(geometry))
            })
            .collect();
        let mut cells: BTreeSet<Cell> = selected.keys().map(|wall| wall.0).collect();
        if !cells.is_empty() {
            cells.extend(empty.iter().filter(|cell| region.in_ranges(&lattice.centre(**cell))));
        }
        while let Some(cell) = cells.first().copied() {
            let part = connected(lattice, &mut cells, cell);
            let space = Space { holes, geometry, lattice, cells: part, walls: &selected };
            cavities.extend(space.cavity());
        }
    }
    cavities
}

/// Takes what is connected with a cell out of a set of cells.
fn connected(lattice: &Lattice, cells: &mut BTreeSet<Cell>, first: Cell) -> BTreeSet<Cell> {
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

/// Cells that are connected, and their walls.
struct Space<'a> {
    holes: &'a Holes<'a>,
    geometry: &'a Geometry,
    lattice: &'a Lattice,
    cells: BTreeSet<Cell>,
    walls: &'a BTreeMap<Wall, BlockFace>,
}

impl Space<'_> {
    fn cavity(&self) -> Option<Cavity> {
        let of = |&cell: &Cell| self.walls.range((cell, 0, i32::MIN)..=(cell, 2, i32::MAX));
        let own = || self.cells.iter().flat_map(of);
        own().next()?;
        let mut mesh = Mesh::default();
        for (_, surface) in own() {
            mesh.add_wall(self.geometry, surface);
        }
        for d in 0..3 {
            let (e, f) = ((d + 1) % 3, (d + 2) % 3);
            let around = |cell: &Cell| {
                let edge = |(i, j): (usize, usize)| {
                    moved_to(moved_to(*cell, e, cell[e] + i), f, cell[f] + j)
                };
                [(0, 0), (1, 0), (0, 1), (1, 1)].map(edge)
            };
            let edges: BTreeSet<Cell> = self.cells.iter().flat_map(around).collect();
            edges.into_iter().for_each(|edge| self.close_edge(&mut mesh, d, edge));
        }
        self.close_corners(&mut mesh);
        let sides = |cell: &Cell| [0, 1, 2].map(|d| [-1, 1].map(|side| (*cell, d, side)));
        let all = self.cells.iter().flat_map(sides).flatten();
        let all = all.filter(|wall| face(self.lattice, *wall).is_some()).count();
        let walls = [own().count(), all];
        let area = own().map(|(_, surface)| surface.area(self.geometry)).sum();
        let (volume, reach) = self.extent();
        let ends = if mesh.is_closed() { Vec::new() } else { self.ends() };
        Some(Cavity { mesh, volume, reach, walls, area, ends, within: self.within() })
    }

    /// Sides of the cells behind which the lattice has nothing, and what is there.
    fn ends(&self) -> Vec<(Vec3, End)> {
        let Self { lattice, .. } = self;
        let mut ends = Vec::new();
        for &cell in &self.cells {
            for (d, side) in (0..3).flat_map(|d| [(d, -1), (d, 1)]) {
                let next = beside(lattice, cell, d, side);
                let elsewhere = next.map(|next| lattice.body[lattice.index(next)] == ELSEWHERE);
                if elsewhere != Some(false) {
                    ends.push(self.end(cell, d, side));
                }
            }
        }
        ends
    }

    fn end(&self, cell: Cell, d: usize, side: i32) -> (Vec3, End) {
        let lattice = self.lattice;
        let (e, f) = ((d + 1) % 3, (d + 2) % 3);
        // Beyond the joint between sets, and in the quarters: smaller blocks may meet in the middle.
        let place = |beyond: f64, [i, k]: [f64; 2]| {
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
        // A lid may have a seam below it.
        let seen = BEYOND.iter().flat_map(|&beyond| quarters.map(|quarter| (beyond, quarter)));
        let mut seen = seen.map(|(beyond, quarter)| self.behind(&place(beyond, quarter)));
        let first = seen.by_ref().take(quarters.len()).max();
        let end = first.filter(|end| *end != End::Open).or_else(|| seen.max());
        (place(0.0, [0.5; 2]), end.unwrap_or(End::Open))
    }

    /// What other lattices have at a place; what pushes back comes last in the order of ends.
    fn behind(&self, x: &Vec3) -> End {
        let set = self.lattice.set;
        let at = |lattice: &Lattice| {
            let content = lattice.body[lattice.index(lattice.cell_at(x)?)];
            match content {
                ELSEWHERE => None,
                NONE => (lattice.set == set).then_some(End::GoesOn),
                _ if lattice.set == set => Some(End::Split),
                _ => Some(End::Set(lattice.set)),
            }
        };
        self.holes.near(*x).filter_map(at).max().unwrap_or(End::Open)
    }

    /// Blocks of other sets whose centre is in one of the cells.
    fn within(&self) -> Vec<usize> {
        let Self { geometry, lattice, .. } = self;
        let corners: Vec<Vec3> = self.corners().collect();
        let here = |x: &Vec3| lattice.cell_at(x).is_some_and(|c| self.cells.contains(&c));
        let mut blocks = Vec::new();
        for other in geometry.lattices.iter().filter(|other| other.set != lattice.set) {
            // There may be many blocks, and many cavities: those around this one are looked at.
            let [x, y, z] = other.cells_among(&corners);
            let cells = z.flat_map(|k| y.clone().map(move |j| (j, k)));
            let cells = cells.flat_map(|(j, k)| x.clone().map(move |i| [i, j, k]));
            let there = cells.filter_map(|cell| body(other, cell));
            blocks.extend(there.filter(|&block| here(&geometry.centre(block))));
        }
        blocks.sort_unstable();
        blocks
    }

    /// Corners of what is around all of the cells, along the edges of the lattice.
    fn corners(&self) -> impl Iterator<Item = Vec3> {
        let cuts = &self.lattice.cuts;
        let end = |d: usize| {
            let cells = self.cells.iter().map(|cell| cell[d]);
            let (first, last) = cells.fold((usize::MAX, 0), |(a, b), c| (a.min(c), b.max(c)));
            [cuts[d][first], cuts[d][last + 1]]
        };
        let ends = [0, 1, 2].map(end);
        (0..8).map(move |i| self.lattice.point([0, 1, 2].map(|d| ends[d][i >> d & 1])))
    }

    /// Volume of the cells, up to the walls, and their shortest extent.
    fn extent(&self) -> (f64, f64) {
        let Self { lattice, .. } = self;
        let end = |cell: Cell, d: usize, side: i32| {
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

    /// The four cells around an edge along d, whose planes across are those of `edge`, going round.
    fn around(&self, d: usize, edge: Cell) -> [Option<Cell>; 4] {
        let (e, f) = ((d + 1) % 3, (d + 2) % 3);
        [(1, 1), (0, 1), (0, 0), (1, 0)].map(|(i, j)| {
            let (along_e, along_f) = (edge[e].checked_sub(i)?, edge[f].checked_sub(j)?);
            let cell = moved_to(moved_to(edge, e, along_e), f, along_f);
            (0..3).all(|k| cell[k] < self.lattice.count[k]).then_some(cell)
        })
    }

    /// Strips from wall to wall across the cells of the cavity at an edge along d.
    fn close_edge(&self, mesh: &mut Mesh, d: usize, edge: Cell) {
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

    /// Nodes along an edge of the wall between a cell and the next, if it is one.
    fn line(&self, d: usize, edge: Cell, [cell, next]: [Option<Cell>; 2]) -> Option<Vec<u32>> {
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

    /// Closes what is left open at single points of the lattice.
    fn close_corners(&self, mesh: &mut Mesh) {
        let mut corners: BTreeMap<Cell, BTreeMap<u32, u32>> = BTreeMap::new();
        for (a, b) in mesh.rim() {
            if let (Some(at), Some(other)) = (self.corner(a), self.corner(b))
                && at == other
            {
                // Against the edge that is there.
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

    /// The point of the lattice at which a corner of a block lies.
    fn corner(&self, node: u32) -> Option<Cell> {
        let (body, at) = self.geometry.locate(node as usize);
        let n = self.lattice.divisions;
        let cell = self.geometry.bodies[body].cell;
        let ends = at.iter().all(|&i| i == 0 || i == n);
        ends.then(|| [0, 1, 2].map(|k| cell[k] as usize + usize::from(at[k] == n)))
    }
}

/// Centre of the joint between the faces of two blocks.
pub(super) fn between(geometry: &Geometry, [a, b]: &[BlockFace; 2]) -> Vec3 {
    (a.centre(geometry) + b.centre(geometry)) / 2.0
}
