//! All cells of a model, with shared points and planes.

use std::collections::{BTreeMap, HashMap, VecDeque};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use nalgebra::Vector3;

use crate::cell::{CellFace, ConvexCell};
use crate::fracture::Fracture;
use crate::measure::{self, CellProperties};
use crate::plane::{CutPlane, PlaneSource};
use crate::random::RandomStream;
use crate::split::{self, CellHalves};
use crate::tree::{AxisBox, CellTree};
use crate::tunnel::Tunnel;

/// Distance from a plane, relative to the diagonal of all regions, within which a point lies on it.
pub const ON_PLANE: f64 = 1e-7;

/// Largest number of cells: more would not fit in memory as blocks.
pub const MOST_CELLS: usize = 10_000_000;

/// Cells that tile regions of rock. Neighbours share points, so that their faces match.
#[derive(Clone, Debug)]
pub struct CellComplex {
    pub(crate) points: Vec<Vector3<f64>>,
    pub(crate) planes: Vec<CutPlane>,
    pub(crate) cells: Vec<ConvexCell>,
    pub(crate) tree: CellTree,
    /// Distance within which a point lies on a plane `[m]`.
    pub(crate) tolerance: f64,
    /// Largest number of cells.
    pub(crate) most: usize,
    /// Number of cells so far, for other threads.
    pub(crate) counter: Arc<AtomicUsize>,
    /// Number of times that rounding errors kept a cell whole.
    pub(crate) n_uncut: usize,
    /// Fractures of finite size, by the number of their plane.
    pub(crate) fractures: BTreeMap<u32, Fracture>,
}

/// Decision about a cell that a plane crosses.
#[derive(Clone, Copy, Debug)]
pub(crate) enum CellCut {
    Cut,
    /// A cut whose faces are bridges of rock.
    Bridge,
    Leave,
}

/// State of a cut from plane to plane.
#[derive(Debug, Default)]
pub(crate) struct Cutting {
    /// Flags of the cells that may be divided.
    allowed: Vec<bool>,
    pub(crate) count: CutCount,
    sides: PointSides,
    /// Thickness of a part up to which a cell stays whole `[m]`.
    pub(crate) thinnest: f64,
    /// Nodes and cells that the present plane meets.
    met: Vec<(u32, u32)>,
}

/// Effect of a cut.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CutCount {
    /// Number of divisions, each of which makes one cell more.
    pub divisions: usize,
    /// True if the cut stopped because there were too many cells.
    pub too_many: bool,
}

/// Sides of the points to a plane, each decided once.
#[derive(Debug, Default)]
struct PointSides {
    sides: Vec<i8>,
    heights: Vec<f64>,
    /// Number of the turn in which the side was decided.
    decided: Vec<u32>,
    /// Number of the present turn, from 1: each plane has one.
    turn: u32,
}

impl CellComplex {
    /// Points `[m]`.
    #[must_use]
    pub fn points(&self) -> &[Vector3<f64>] {
        &self.points
    }

    /// Planes of the faces.
    #[must_use]
    pub fn planes(&self) -> &[CutPlane] {
        &self.planes
    }

    /// Cells.
    #[must_use]
    pub fn cells(&self) -> &[ConvexCell] {
        &self.cells
    }

    /// Distance within which a point lies on a plane `[m]`.
    #[must_use]
    pub fn tolerance(&self) -> f64 {
        self.tolerance
    }

    /// Stops cuts at a number of cells below [`MOST_CELLS`], for which there is no more memory.
    #[must_use]
    pub fn with_most(self, most: usize) -> Self {
        Self { most: most.min(MOST_CELLS), ..self }
    }

    /// Keeps the number of cells in a counter, which other threads may read during a cut.
    #[must_use]
    pub fn counted_by(self, counter: Arc<AtomicUsize>) -> Self {
        let counted = Self { counter, ..self };
        counted.count();
        counted
    }

    /// Stores the number of cells in the counter.
    pub(crate) fn count(&self) {
        self.counter.store(self.cells.len(), Ordering::Relaxed);
    }

    /// Number of times that a cell stayed whole because rounding errors left no two polyhedra.
    #[must_use]
    pub fn n_uncut(&self) -> usize {
        self.n_uncut
    }

    /// Volume, centroid, inertia and width of a cell.
    #[must_use]
    pub fn properties(&self, cell: usize) -> CellProperties {
        measure::properties(&self.points, &self.planes, &self.cells[cell].faces)
    }

    /// Centroid of a cell `[m]`.
    #[must_use]
    pub fn centroid(&self, cell: usize) -> Vector3<f64> {
        measure::centroid(&self.points, &self.cells[cell].faces)
    }

    /// Flags of the cells that a condition on number and cell selects.
    #[must_use]
    pub fn select(&self, condition: impl Fn(usize, &ConvexCell) -> bool) -> Vec<bool> {
        self.cells.iter().enumerate().map(|(number, cell)| condition(number, cell)).collect()
    }

    /// Cuts cells by planes. `allowed` has a flag for each cell; parts of a cell inherit it.
    ///
    /// Planes given in order across the rock are halved in turn, which keeps the tree of boxes flat.
    pub fn cut(&mut self, planes: &[CutPlane], allowed: Vec<bool>) -> CutCount {
        self.cut_where(planes, allowed, |_, _| CellCut::Cut)
    }

    /// Cuts a share of the cells that planes cross. Other cells stay whole, or with `bridges` they are
    /// cut, too, and their new faces are bridges.
    pub fn cut_persistent(
        &mut self,
        planes: &[CutPlane],
        allowed: Vec<bool>,
        persistence: f64,
        bridges: bool,
        mut numbers: RandomStream,
    ) -> CutCount {
        let rest = if bridges { CellCut::Bridge } else { CellCut::Leave };
        self.cut_where(planes, allowed, |_, _| {
            if numbers.uniform() < persistence { CellCut::Cut } else { rest }
        })
    }

    /// Cuts the cells that a tunnel touches, by the planes of its sides and ends.
    pub fn cut_tunnel(&mut self, tunnel: &Tunnel, allowed: Vec<bool>) -> CutCount {
        let margin = 10.0 * self.tolerance;
        self.cut_where(&tunnel.planes, allowed, |complex, cell| {
            let touched = tunnel.touches(&complex.points, &complex.cells[cell].faces, margin);
            if touched { CellCut::Cut } else { CellCut::Leave }
        })
    }

    fn cut_where(
        &mut self,
        planes: &[CutPlane],
        allowed: Vec<bool>,
        mut decide: impl FnMut(&Self, usize) -> CellCut,
    ) -> CutCount {
        let mut cutting = self.cutting(allowed);
        for i in halving_order(planes.len()) {
            self.cut_one(&planes[i], None, &mut cutting, &mut decide);
            if cutting.count.too_many {
                break;
            }
        }
        cutting.count
    }

    /// State of a cut that may divide the cells with these flags.
    pub(crate) fn cutting(&self, mut allowed: Vec<bool>) -> Cutting {
        allowed.resize(self.cells.len(), false);
        Cutting { allowed, ..Cutting::default() }
    }

    /// Cuts cells by one plane, or only those that meet a box around its `part`.
    pub(crate) fn cut_one(
        &mut self,
        plane: &CutPlane,
        part: Option<&AxisBox>,
        cutting: &mut Cutting,
        decide: &mut impl FnMut(&Self, usize) -> CellCut,
    ) {
        let Cutting { allowed, count, sides, thinnest, met } = cutting;
        let (number, before) = (self.planes.len() as u32, count.divisions);
        self.planes.push(*plane);
        let mut bridge = None;
        let mut crossings = HashMap::new();
        sides.turn += 1;
        self.tree.met(plane, part, self.tolerance, met);
        for &(node, cell) in &*met {
            if !allowed[cell as usize] || !self.straddles(cell as usize, plane, sides) {
                continue;
            }
            let number = match decide(self, cell as usize) {
                CellCut::Leave => continue,
                CellCut::Cut => number,
                CellCut::Bridge => *bridge.get_or_insert_with(|| {
                    self.planes.push(plane.bridge());
                    self.planes.len() as u32 - 1
                }),
            };
            if self.divide(node, cell, number, *thinnest, sides, &mut crossings) {
                allowed.push(true);
                count.divisions += 1;
            }
            if self.cells.len() > self.most {
                count.too_many = true;
                return;
            }
        }
        // A number without faces would only take memory.
        if count.divisions == before {
            self.planes.truncate(number as usize);
        }
    }

    /// True if a cell has points on both sides of a plane.
    fn straddles(&self, cell: usize, equation: &CutPlane, sides: &mut PointSides) -> bool {
        let (mut below, mut above) = (false, false);
        for &corner in self.cells[cell].faces.iter().flat_map(|face| &face.corners) {
            let side = sides.decide(corner, || {
                (equation.height(&self.points[corner as usize]), self.tolerance)
            });
            below |= side < 0;
            above |= side > 0;
        }
        below && above
    }

    /// Divides a cell by a plane; false if it stays whole.
    fn divide(
        &mut self,
        node: u32,
        cell: u32,
        plane: u32,
        thinnest: f64,
        sides: &PointSides,
        crossings: &mut HashMap<(u32, u32), u32>,
    ) -> bool {
        let (points, known) = (&mut self.points, sides);
        let old = &self.cells[cell as usize];
        let halves = split::split(
            &old.faces,
            plane,
            |point| known.sides.get(point as usize).copied().unwrap_or(0),
            |a, b| {
                let (a, b) = (a.min(b), a.max(b));
                *crossings.entry((a, b)).or_insert_with(|| {
                    let [below, above] = [a, b].map(|point| known.heights[point as usize]);
                    let [from, to] = [a, b].map(|point| points[point as usize]);
                    points.push(from + (to - from) * (below / (below - above)));
                    points.len() as u32 - 1
                })
            },
        );
        let is_thin = |halves: &CellHalves| {
            self.is_thin(&halves.below, thinnest) || self.is_thin(&halves.above, thinnest)
        };
        let Some(halves) = halves.filter(|halves| thinnest == 0.0 || !is_thin(halves)) else {
            self.n_uncut += 1;
            return false;
        };
        let (region, new) = (old.region, self.cells.len() as u32);
        let boxes = [&halves.below, &halves.above].map(|faces| bounds(&self.points, faces));
        self.tree.divide(node, [(cell, boxes[0]), (new, boxes[1])]);
        self.cells[cell as usize].faces = halves.below;
        self.cells.push(ConvexCell { faces: halves.above, region });
        self.count();
        true
    }

    /// True if all corners of a polyhedron lie within a distance from the plane of a face.
    fn is_thin(&self, faces: &[CellFace], distance: f64) -> bool {
        let near = |plane: &CutPlane, corner: &u32| {
            plane.height(&self.points[*corner as usize]).abs() <= distance
        };
        let mut planes = faces.iter().map(|face| self.plane(face));
        planes.any(|plane| {
            faces.iter().flat_map(|face| &face.corners).all(|corner| near(plane, corner))
        })
    }

    /// Plane of a face.
    #[must_use]
    pub fn plane(&self, face: &CellFace) -> &CutPlane {
        &self.planes[face.plane as usize]
    }

    /// Cuts whose planes bound a cell, in increasing order.
    #[must_use]
    pub fn cuts_of(&self, cell: usize) -> Vec<u32> {
        let sources = self.cells[cell].faces.iter().map(|face| self.plane(face).source);
        let mut cuts: Vec<u32> = sources
            .filter_map(|source| match source {
                PlaneSource::Region => None,
                PlaneSource::Cut(cut) | PlaneSource::Bridge(cut) => Some(cut),
            })
            .collect();
        cuts.sort_unstable();
        cuts.dedup();
        cuts
    }
}

impl PointSides {
    /// Side of a point, −1, 0 or 1, from its height and the tolerance.
    fn decide(&mut self, point: u32, height: impl FnOnce() -> (f64, f64)) -> i8 {
        let at = point as usize;
        if at >= self.decided.len() {
            self.decided.resize(at + 1, 0);
            self.heights.resize(at + 1, 0.0);
            self.sides.resize(at + 1, 0);
        }
        if self.decided[at] != self.turn {
            let (height, tolerance) = height();
            self.decided[at] = self.turn;
            self.heights[at] = height;
            self.sides[at] = i8::from(height > tolerance) - i8::from(height < -tolerance);
        }
        self.sides[at]
    }
}

pub(crate) fn bounds(points: &[Vector3<f64>], faces: &[CellFace]) -> AxisBox {
    let corners = faces.iter().flat_map(|face| &face.corners);
    AxisBox::around(corners.map(|&corner| &points[corner as usize]))
}

/// Numbers below `n`, the middle of each range before its two halves.
fn halving_order(n: usize) -> Vec<usize> {
    let mut order = Vec::with_capacity(n);
    let mut ranges = VecDeque::new();
    ranges.push_back(0..n);
    while let Some(range) = ranges.pop_front() {
        if range.is_empty() {
            continue;
        }
        let middle = range.start + range.len() / 2;
        order.push(middle);
        ranges.extend([range.start..middle, middle + 1..range.end]);
    }
    order
}
