//! Selections of a `where`: nodes, and the length, area or volume that belongs to each.
//!
//! ```text
//!   x = 6 lies in a gap: both sides belong to the selection and share
//!
//!     --o-----o | o-----o--      w_i = half the spacing to each selected neighbour,
//!           5.995 6.005          and half of each neighbouring gap
//! ```

use std::collections::BTreeMap;

use super::Selector;
use super::touching::TouchingFaces;
use ddem_core::problem::{
    BlockFace, FaceId, FreeElement, Geometry, TributaryLengths, Vec3, bounds_of,
};

/// Margin of the box around a block, as a fraction of its longest edge.
const MARGIN: f64 = 1e-8;

/// Points by which the free parts of a face are selected `[m]`: the centre of an outer face, of a face of a
/// cell those of its elements.
pub(in crate::build) fn free_centres(geometry: &Geometry, face: &BlockFace) -> Vec<Vec3> {
    match geometry.part(face.block) {
        Some(_) => face.free_elements(geometry).iter().map(|free| free.centre).collect(),
        None => Vec::from_iter(face.is_outer(geometry).then(|| face.centre(geometry))),
    }
}

/// Boxes around the blocks of a geometry, to find the nodes of many selectors.
pub(crate) struct NodeSearch<'a> {
    geometry: &'a Geometry,
    boxes: Vec<[Vec3; 2]>,
}

impl<'a> NodeSearch<'a> {
    pub(crate) fn new(geometry: &'a Geometry) -> Self {
        let around = |block: usize| {
            let margin = MARGIN * geometry.longest_edge(block);
            let [low, high] = bounds_of(&geometry.corners(block));
            [low.add_scalar(-margin), high.add_scalar(margin)]
        };
        Self { geometry, boxes: (0..geometry.blocks.len()).map(around).collect() }
    }

    /// Nodes that a selector selects, in order.
    pub(crate) fn nodes(&self, selector: &Selector) -> Vec<u32> {
        // A node is in the box of its block, and so is the centre of a rigid block.
        let meets = |block: usize| selector.part_of(&self.boxes[block]).is_some();
        selector.nodes_in(self.geometry, meets)
    }
}

impl Selector {
    /// True if a node is selected: it is in the ranges, and each plane contains it or lies in a gap
    /// beside it.
    pub(crate) fn has_node(&self, geometry: &Geometry, block: usize, at: [usize; 3]) -> bool {
        let x = geometry.position(block, at);
        // A rigid block is selected as a whole, by its centroid or that of its cell.
        let whole = geometry.is_rigid(block);
        let point = if whole { geometry.centroid(block) } else { x };
        self.has_set(geometry.set(block))
            && self.in_ranges(&point)
            && self.planes.iter().all(|plane| {
                plane.has(&x)
                    || (0..3).any(|d| {
                        geometry.partner(block, at, d).is_some_and(|(other, step)| {
                            let y = geometry.position(other, step);
                            let sides = [x, y].map(|x| plane.normal.dot(&x));
                            let (low, high) = (sides[0].min(sides[1]), sides[0].max(sides[1]));
                            low + plane.tolerance < plane.at && plane.at < high - plane.tolerance
                        })
                    })
            })
    }

    /// Selected nodes, in order.
    pub(crate) fn nodes(&self, geometry: &Geometry) -> Vec<u32> {
        self.nodes_in(geometry, |_| true)
    }

    /// Selected nodes of the blocks that a condition on their numbers admits, in order.
    fn nodes_in(&self, geometry: &Geometry, admits: impl Fn(usize) -> bool) -> Vec<u32> {
        let mut nodes = Vec::new();
        for block in 0..geometry.blocks.len() {
            if !admits(block) || geometry.is_removed(block) || !self.has_set(geometry.set(block)) {
                continue;
            }
            let topology = geometry.topology(block);
            for local in 0..topology.nodes() {
                if self.has_node(geometry, block, topology.steps(local)) {
                    nodes.push(geometry.blocks[block].first_node + local as u32);
                }
            }
        }
        nodes
    }

    /// Nodes that the `where` selected at the start and whose blocks have been removed since.
    pub(crate) fn removed_nodes(&self, start: &Geometry, now: &Geometry) -> Vec<u32> {
        if std::ptr::eq(start, now) {
            return Vec::new();
        }
        let mut nodes = self.nodes(start);
        nodes.retain(|&node| now.is_removed(now.locate(node as usize).0));
        nodes
    }

    /// Weight of each selected node: its part of the selected line's length, of the selected face's
    /// area or of the volume, or 1 at a single point. The two sides of a gap share its weight.
    pub(crate) fn weights(&self, geometry: &Geometry) -> Vec<(u32, f64)> {
        let weight = |node: u32| {
            let copies = geometry.ties.with(node).len();
            if geometry.part(geometry.block_of(node as usize)).is_some() {
                return (node, 1.0 / copies.max(1) as f64);
            }
            let (block, at) = geometry.locate(node as usize);
            let weight = (0..3).map(|d| self.extent_along(geometry, block, at, d)).product();
            (node, weight)
        };
        self.nodes(geometry).into_iter().map(weight).collect()
    }

    /// Half the spacing to each selected neighbour along `d` plus half of a selected gap. Without
    /// neighbours in the block it is 1, or 0.5 at a gap.
    fn extent_along(&self, geometry: &Geometry, block: usize, at: [usize; 3], d: usize) -> f64 {
        let partner = geometry
            .partner(block, at, d)
            .filter(|&(other, step)| self.has_node(geometry, other, step));
        let inside = [-1, 1].iter().filter(|&&side| {
            geometry
                .step(block, at, d, side)
                .is_some_and(|(other, step)| other == block && self.has_node(geometry, other, step))
        });
        let half = geometry.spacing(block, d) / 2.0;
        match (inside.count(), partner) {
            (0, None) => 1.0,
            (0, Some(_)) => 0.5,
            (count, None) => count as f64 * half,
            (count, Some((other, step))) => {
                let gap = (geometry.position(other, step) - geometry.position(block, at)).norm();
                count as f64 * half + gap / 2.0
            }
        }
    }

    /// Integral of a node's hat function along `d` towards one side, clipped by the ranges `[m]`:
    /// within the block, or over half of a gap that `over_gap` allows to cross.
    fn hat(
        &self,
        geometry: &Geometry,
        block: usize,
        at: [usize; 3],
        (d, side): (usize, i32),
        over_gap: &dyn Fn(usize) -> bool,
    ) -> f64 {
        let Some((other, step)) = geometry.step(block, at, d, side) else { return 0.0 };
        if other != block && !over_gap(other) {
            return 0.0;
        }
        let (x, y) = (geometry.position(block, at), geometry.position(other, step));
        let (mut from, mut to) = (0.0_f64, 1.0_f64);
        for axis in 0..3 {
            let (Some([low, high]), step) = (self.range(axis), y[axis] - x[axis]) else { continue };
            if step.abs() > self.tolerance[axis].min(0.5 * (y - x).norm()) {
                let (a, b) = ((low - x[axis]) / step, (high - x[axis]) / step);
                (from, to) = (from.max(a.min(b)), to.min(a.max(b)));
            }
        }
        let (from, to) = (from.clamp(0.0, 1.0), to.clamp(0.0, 1.0));
        let integral = (to - from) - (to * to - from * from) / 2.0;
        (y - x).norm() * integral.max(0.0)
    }

    /// Tributary length of each node on the selected line `[m]`. `None` if the selection is not a
    /// line along an edge of the blocks.
    pub(crate) fn lengths(&self, geometry: &Geometry) -> Option<Vec<(u32, f64)>> {
        let [first, second] = self.planes[..] else { return None };
        let line = first.normal.cross(&second.normal).try_normalize(1e-9)?;
        let mut lengths = Vec::new();
        for block in 0..geometry.blocks.len() {
            let lattice = geometry.lattice(block);
            let along = (0..3).find(|&d| lattice.axes[d].dot(&line).abs() > 1.0 - 1e-9);
            let n = lattice.divisions + 1;
            if geometry.is_removed(block) || !self.has_set(geometry.set(block)) {
                continue;
            }
            let unbounded = self.along(&line);
            for local in 0..n * n * n {
                let at = [local % n, local / n % n, local / (n * n)];
                if !unbounded.has_node(geometry, block, at) {
                    continue;
                }
                let d = along?;
                let any = |_| true;
                let length = self.hat(geometry, block, at, (d, -1), &any)
                    + self.hat(geometry, block, at, (d, 1), &any);
                let sharers = (0..3).filter(|&e| e != d).map(|e| {
                    let shared = geometry
                        .partner(block, at, e)
                        .is_some_and(|(other, step)| unbounded.has_node(geometry, other, step));
                    if shared { 0.5 } else { 1.0 }
                });
                let length = length * sharers.product::<f64>();
                if length > 0.0 && self.in_shapes(&geometry.position(block, at)) {
                    lengths.push((geometry.blocks[block].first_node + local as u32, length));
                }
            }
        }
        Some(lengths)
    }

    /// Same selector without shapes and without the ranges that cut lines of a given direction.
    fn along(&self, line: &Vec3) -> Self {
        let ranges = [0, 1, 2].map(|k| self.ranges[k].filter(|_| line[k].abs() < 1e-9));
        let Self { planes, facing, set, tolerance, .. } = self.clone();
        let (half_spaces, terrains) = (Vec::new(), Vec::new());
        let (sphere, cylinder, solid) = (None, None, None);
        Self {
            ranges,
            planes,
            half_spaces,
            sphere,
            cylinder,
            solid,
            terrains,
            facing,
            set,
            tolerance,
        }
    }

    /// True if a range ends inside a face whose edges both have a component along its axis. The
    /// selected part is then not a product of two lengths.
    pub(crate) fn cuts_askew(&self, geometry: &Geometry, face: &BlockFace) -> bool {
        if geometry.part(face.block).is_some() {
            return false;
        }
        let lattice = geometry.lattice(face.block);
        let corners = face.extended_corners(geometry);
        (0..3).any(|axis| {
            let along = |d: usize| d != face.direction() && lattice.axes[d][axis].abs() > 1e-9;
            let ends_inside = self.range(axis).is_some_and(|[from, to]| {
                let (clear, all) = (self.tolerance[axis], corners.iter().map(|x| x[axis]));
                all.clone().any(|x| x < from - clear) || all.clone().any(|x| x > to + clear)
            });
            ends_inside && (0..3).filter(|&d| along(d)).count() > 1
        })
    }

    /// Selected outer faces: they have the given orientation, lie on every given plane and partly
    /// in the ranges, and have their centre in the shapes. Of faces of cells the free parts of the elements
    /// count.
    pub(crate) fn surfaces(&self, geometry: &Geometry) -> Vec<BlockFace> {
        self.sides(geometry, |face| free_centres(geometry, face).iter().any(|x| self.in_shapes(x)))
    }

    /// Faces of lattices that would be selected if another block did not cover a part of them.
    pub(crate) fn covered_in_part(&self, geometry: &Geometry) -> Vec<BlockFace> {
        let touching = TouchingFaces(geometry);
        let covered = touching.covered();
        self.sides(geometry, |face| {
            geometry.part(face.block).is_none()
                && touching.is_covered_in_part(face, &covered)
                && self.in_shapes(&face.centre(geometry))
        })
    }

    fn sides(&self, geometry: &Geometry, wanted: impl Fn(&BlockFace) -> bool) -> Vec<BlockFace> {
        let mut surfaces = Vec::new();
        for block in 0..geometry.blocks.len() {
            if geometry.is_removed(block) || !self.has_set(geometry.set(block)) {
                continue;
            }
            for face in FaceId::all() {
                let face = BlockFace { block, face };
                let corners = face.corners(geometry);
                if corners.iter().all(|x| self.on_planes(x))
                    && self.faces(&face.outward(geometry))
                    && self.ranges_meet(&face.extended_corners(geometry))
                    && wanted(&face)
                {
                    surfaces.push(face);
                }
            }
        }
        surfaces
    }

    fn ranges_meet(&self, points: &[Vec3]) -> bool {
        (0..3).all(|axis| {
            let along = points.iter().map(|x| x[axis]);
            let (low, high) = along.fold((f64::MAX, f64::MIN), |(l, h), x| (l.min(x), h.max(x)));
            let clear = self.tolerance[axis];
            self.range(axis).is_none_or(|[from, to]| high >= from - clear && low <= to + clear)
        })
    }

    /// Tributary area of each node of a surface `[m²]`: half of each neighbouring element and, if
    /// the next block has its face in the same plane, half of each neighbouring gap.
    pub(crate) fn areas(&self, geometry: &Geometry, face: &BlockFace) -> Vec<(u32, f64)> {
        if geometry.part(face.block).is_some() {
            return self.free_areas(geometry, face);
        }
        let area =
            |(node, slant, [e, f]): TributaryLengths| (node, slant * (e[0] + e[1]) * (f[0] + f[1]));
        self.tributary_lengths(geometry, face).into_iter().map(area).collect()
    }

    /// Areas of the nodes of a face of a part `[m²]`: of the free parts of the elements whose centre is
    /// selected.
    fn free_areas(&self, geometry: &Geometry, face: &BlockFace) -> Vec<(u32, f64)> {
        let mut areas: BTreeMap<u32, f64> = BTreeMap::new();
        for FreeElement { centre, areas: own } in face.free_elements(geometry) {
            if self.in_ranges(&centre) && self.in_shapes(&centre) {
                own.into_iter().for_each(|(node, area)| *areas.entry(node).or_default() += area);
            }
        }
        areas.into_iter().collect()
    }

    /// Lengths whose products are the tributary areas.
    pub(crate) fn tributary_lengths(
        &self,
        geometry: &Geometry,
        face: &BlockFace,
    ) -> Vec<TributaryLengths> {
        let BlockFace { block, face } = *face;
        let normal = face.direction;
        let lattice = geometry.lattice(block);
        let (e, f) = ((normal + 1) % 3, (normal + 2) % 3);
        let slant = lattice.axes[e].cross(&lattice.axes[f]).norm();
        let is_outer = |other: usize| BlockFace { block: other, face }.is_outer(geometry);
        let topology = geometry.topology(block);
        let mut lengths = Vec::new();
        for (j, i) in topology.lines().flat_map(|j| topology.lines().map(move |i| (j, i))) {
            let at = topology.on_face(face, [i, j]);
            let length =
                |d: usize| [-1, 1].map(|s| self.hat(geometry, block, at, (d, s), &is_outer));
            let (along_e, along_f) = (length(e), length(f));
            let area = slant * (along_e[0] + along_e[1]) * (along_f[0] + along_f[1]);
            if area > 0.0 {
                lengths.push((geometry.node(block, at) as u32, slant, [along_e, along_f]));
            }
        }
        lengths
    }
}
