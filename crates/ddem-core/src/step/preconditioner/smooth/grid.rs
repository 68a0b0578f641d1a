//! Grids of trilinear functions over a model, each twice as coarse as the one before.
//!
//! Along a direction with one cell the two functions are 1 and a slope from −1 to 1. A model that
//! is thin in this direction is soft against the first and stiff against the second. The functions
//! of the two nodes would hide the soft one.

use rayon::prelude::*;

use super::TOGETHER;
use super::bodies::AtCentre;
use super::points::SmoothPoints;
use ddem_mesh::Vec3;

/// Smallest edge of a cell along each direction, in mean blocks.
const BLOCKS_PER_CELL: f64 = 2.0;

/// Value of a trilinear function at one point of the next finer level.
#[derive(Clone, Copy, Debug)]
struct Weighted {
    number: u32,
    weight: f64,
}

/// Point of the next finer level.
#[derive(Clone, Copy, Debug)]
struct FinerPoint {
    at: Vec3,
    /// Function, 1 or the slope, along directions with one cell at that level.
    factors: [Option<usize>; 3],
}

impl FinerPoint {
    fn at(at: &Vec3) -> Self {
        Self { at: *at, factors: [None; 3] }
    }
}

/// Grid of trilinear functions, one for each node.
#[derive(Clone, Debug)]
pub(super) struct FunctionGrid {
    low: Vec3,
    /// Edges of a cell `[m]`.
    edges: Vec3,
    /// Number of cells along x, y and z.
    cells: [usize; 3],
    /// First point of the finer level in `weights` for each node, and one past the last.
    start: Vec<u32>,
    weights: Vec<Weighted>,
    /// Nodes of the cell around each point of the finer level, by their weights.
    around: Vec<[Weighted; 8]>,
    /// Inverse stiffness against each function `[m/N]`.
    pub(super) inverse: Vec<[f64; 3]>,
    /// Forces on the functions `[N]`, then their motion `[m]`.
    pub(super) moved: Vec<Vec3>,
}

impl FunctionGrid {
    /// Grids over the points of a model, until one cell covers all of them.
    pub(super) fn over(points: &SmoothPoints) -> Vec<Self> {
        let [low, length] = points.bounds();
        let finest = points.extent * BLOCKS_PER_CELL;
        let mut spacing = finest.min();
        let mut grids: Vec<Self> = Vec::new();
        let mut finer: Vec<FinerPoint> = points.positions.iter().map(FinerPoint::at).collect();
        loop {
            let cells = [0, 1, 2].map(|d| {
                (length[d] / spacing.max(finest[d]) - 1e-6).ceil().clamp(1.0, 1e6) as usize
            });
            let is_new = grids.last().is_none_or(|finer| finer.cells != cells);
            // Blocks far from each other leave most cells empty.
            if is_new && cells.iter().product::<usize>() <= points.positions.len() {
                let edges = Vec3::from([0, 1, 2].map(|d| length[d] / cells[d] as f64));
                let grid = Self::new(low, edges, cells, &finer);
                finer = grid.points();
                grids.push(grid);
            }
            if cells == [1; 3] {
                return grids;
            }
            spacing *= 2.0;
        }
    }

    fn new(low: Vec3, edges: Vec3, cells: [usize; 3], finer: &[FinerPoint]) -> Self {
        let nodes = cells.iter().map(|cells| cells + 1).product::<usize>();
        let mut grid = Self {
            low,
            edges,
            cells,
            start: vec![0; nodes + 1],
            weights: Vec::new(),
            around: Vec::new(),
            inverse: vec![[0.0; 3]; nodes],
            moved: vec![Vec3::zeros(); nodes],
        };
        grid.around = finer.iter().map(|point| grid.cell_around(point)).collect();
        let mut by_node: Vec<(u32, Weighted)> = Vec::new();
        for (point, around) in grid.around.iter().enumerate() {
            for own in around.iter().filter(|own| own.weight != 0.0) {
                by_node.push((own.number, Weighted { number: point as u32, weight: own.weight }));
                grid.start[own.number as usize + 1] += 1;
            }
        }
        by_node.sort_by_key(|(node, _)| *node);
        (0..nodes).for_each(|node| grid.start[node + 1] += grid.start[node]);
        grid.weights = by_node.into_iter().map(|(_, weighted)| weighted).collect();
        grid
    }

    /// Functions as points of the next coarser grid.
    fn points(&self) -> Vec<FinerPoint> {
        let [nx, ny, _] = self.cells.map(|cells| cells + 1);
        let at = |node: usize| {
            let steps = [node % nx, node / nx % ny, node / (nx * ny)];
            let along = Vec3::from(steps.map(|step| step as f64)).component_mul(&self.edges);
            let factors = [0, 1, 2].map(|d| (self.cells[d] == 1).then_some(steps[d]));
            FinerPoint { at: self.low + along, factors }
        };
        (0..self.moved.len()).map(at).collect()
    }

    /// Lower node of the cell around a point along a direction, and the values there of the
    /// functions of the lower and the upper node.
    fn values(&self, point: &FinerPoint, d: usize) -> (usize, [f64; 2]) {
        let along = (point.at[d] - self.low[d]) / self.edges[d];
        let lower = (along.max(0.0) as usize).min(self.cells[d] - 1);
        let part = (along - lower as f64).clamp(0.0, 1.0);
        let values = match (self.cells[d], point.factors[d]) {
            (1, Some(factor)) => [0, 1].map(|own| f64::from(u8::from(own == factor))),
            (1, None) => [1.0, 2.0 * part - 1.0],
            _ => [1.0 - part, part],
        };
        (lower, values)
    }

    fn cell_around(&self, point: &FinerPoint) -> [Weighted; 8] {
        let along = [0, 1, 2].map(|d| self.values(point, d));
        std::array::from_fn(|corner| {
            let upper = [0, 1, 2].map(|d| corner >> d & 1);
            let at = [0, 1, 2].map(|d| along[d].0 + upper[d]);
            let number = at[0] + (self.cells[0] + 1) * (at[1] + (self.cells[1] + 1) * at[2]);
            let part = |d: usize| along[d].1[upper[d]];
            Weighted { number: number as u32, weight: part(0) * part(1) * part(2) }
        })
    }

    /// Functions of the cell around the centre of a body.
    pub(super) fn at_centre(&self, centre: &Vec3) -> [AtCentre; 8] {
        let along = [0, 1, 2].map(|d| self.values(&FinerPoint::at(centre), d).1);
        let slopes = [0, 1, 2].map(|d| {
            let [lower, upper] = if self.cells[d] == 1 { [0.0, 2.0] } else { [-1.0, 1.0] };
            [lower, upper].map(|rise| rise / self.edges[d])
        });
        let around = self.cell_around(&FinerPoint::at(centre));
        std::array::from_fn(|corner| {
            let upper = [0, 1, 2].map(|d| corner >> d & 1);
            let half = [0, 1, 2].map(|d| {
                let others = [(d + 1) % 3, (d + 2) % 3].map(|e| along[e][upper[e]]);
                0.5 * slopes[d][upper[d]] * others[0] * others[1]
            });
            let Weighted { number, weight } = around[corner];
            AtCentre { function: number, value: weight, half_gradient: half.into() }
        })
    }

    /// Functions of this grid at a point of the next finer level, with their values.
    pub(super) fn functions_at(&self, finer: usize) -> impl Iterator<Item = (u32, f64)> {
        let around = self.around[finer].iter().filter(|own| own.weight != 0.0);
        around.map(|own| (own.number, own.weight))
    }

    /// Functions of this grid at a position, from those of the next finer level.
    pub(super) fn coarser(&self, finer: &[(u32, f64)]) -> Vec<(u32, f64)> {
        let mut values: Vec<(u32, f64)> = Vec::new();
        for &(function, value) in finer {
            for (own, weight) in self.functions_at(function as usize) {
                match values.iter_mut().find(|(number, _)| *number == own) {
                    Some((_, sum)) => *sum += value * weight,
                    None => values.push((own, value * weight)),
                }
            }
        }
        values
    }

    /// Collects the forces on the functions from those of the next finer level.
    pub(super) fn collect(&mut self, finer: &[Vec3]) {
        let Self { start, weights, moved, .. } = self;
        let of = |(node, sum): (usize, &mut Vec3)| {
            let own = &weights[start[node] as usize..start[node + 1] as usize];
            *sum = own.iter().fold(Vec3::zeros(), |sum, Weighted { number, weight }| {
                sum + finer[*number as usize] * *weight
            });
        };
        moved.par_iter_mut().with_min_len(TOGETHER).enumerate().for_each(of);
    }

    /// Computes the motion of the functions from their forces, and adds that of the next coarser
    /// grid.
    pub(super) fn respond(&mut self, coarser: Option<&Self>) {
        let Self { inverse, moved, .. } = self;
        let respond = |(node, moved): (usize, &mut Vec3)| {
            let own = moved.component_mul(&Vec3::from(inverse[node]));
            *moved = own + coarser.map_or_else(Vec3::zeros, |grid| grid.at(node));
        };
        moved.par_iter_mut().with_min_len(TOGETHER).enumerate().for_each(respond);
    }

    /// Motion at a point of the next finer level `[m]`.
    pub(super) fn at(&self, point: usize) -> Vec3 {
        let around = self.around[point].iter();
        around.fold(Vec3::zeros(), |sum, Weighted { number, weight }| {
            sum + self.moved[*number as usize] * *weight
        })
    }
}
