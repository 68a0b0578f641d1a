//! Part of one face that lies over another, with its points.

use super::ContactPoint;
use super::side::{ContactSide, are_disjoint, are_parallel, node_at};
use ddem_mechanics::collide::{self, OverlapPoint, Vertex};
use ddem_mesh::SurfacePoint;

/// Fraction of an element's face area below which a point is ignored.
const NOTHING: f64 = 1e-9;

/// Callback that receives the corners of polygons and the points inside.
pub(super) type Polygons<'a> = &'a mut dyn FnMut(&[u32], &[u32]);

/// Part of the finer of two faces that lies over the other.
struct ClippedOverlap<'a> {
    /// Finer side and coarser side.
    sides: [&'a ContactSide<'a>; 2],
    /// Block of the finer face, 0 or 1.
    fine: usize,
    /// Number of the point at each node of the finer side, or `usize::MAX`.
    at_node: Vec<usize>,
    points: OverlapPoints,
}

/// Points of a part of two faces.
#[derive(Default)]
pub(super) struct OverlapPoints {
    pub(super) points: Vec<ContactPoint>,
    /// Coordinates of each point in the elements of both sides. Points have them in single precision.
    pub(super) on: Vec<[[f64; 2]; 2]>,
}

/// Pairs of points of the part of a finer face, that of body `fine`, that lies over another face. The
/// sides are the finer and the coarser one. See [`PatchBuilder`](super::patch_builder::PatchBuilder)
/// for `visit`.
pub(super) fn overlap(
    sides: [&ContactSide<'_>; 2],
    fine: usize,
    visit: &mut Option<Polygons<'_>>,
) -> OverlapPoints {
    let [own, coarse] = sides;
    let [n, m] = sides.map(|side| side.contact_block.topology.divisions());
    let at_node = vec![usize::MAX; (n + 1) * (n + 1)];
    let mut overlap = ClippedOverlap { sides, fine, at_node, points: OverlapPoints::default() };
    for (k, i) in (0..n).flat_map(|k| (0..n).map(move |i| (k, i))) {
        let quad = own.quad([i, k]);
        if are_disjoint(&quad, &coarse.outline) {
            continue;
        }
        let Some(visit) = visit else {
            overlap.add([i, k], &quad, &coarse.outline);
            continue;
        };
        for element in (0..m).flat_map(|l| (0..m).map(move |j| [j, l])) {
            let outline = coarse.quad(element);
            if are_disjoint(&quad, &outline) {
                continue;
            }
            let (corners, inside) = if sides.iter().any(|side| side.contact_block.is_part()) {
                overlap.add_exact([[i, k], element], [&quad, &outline])
            } else {
                overlap.add_inside([i, k], &quad, &outline)
            };
            visit(&corners, &inside);
        }
    }
    overlap.points
}

impl ClippedOverlap<'_> {
    /// Adds the part of an element that lies over an outline.
    fn add(&mut self, element: [usize; 2], quad: &[[f64; 2]; 4], outline: &[[f64; 2]; 4]) {
        for vertex in collide::overlap(quad, outline).as_slice() {
            self.put(element, vertex);
        }
    }

    /// Adds the part of an element over an outline. It also adds inner points where areas at the
    /// corners do not integrate the shape functions of both sides exactly. Returns the corners and
    /// the inner points.
    fn add_inside(
        &mut self,
        element: [usize; 2],
        quad: &[[f64; 2]; 4],
        outline: &[[f64; 2]; 4],
    ) -> (Vec<u32>, Vec<u32>) {
        let part = collide::overlap(quad, outline);
        if are_parallel(quad, outline) {
            let corners = part.as_slice().iter().filter_map(|vertex| self.put(element, vertex));
            return (corners.collect(), Vec::new());
        }
        let (corners, inside) = part.squares();
        let mut put = |vertices: &[Vertex]| {
            vertices.iter().filter_map(|vertex| self.put(element, vertex)).collect()
        };
        (put(&corners), put(&inside))
    }

    /// Adds the part of an element of the finer side over one of the coarser side, with points that
    /// integrate the shape functions of both exactly. Returns the corners and the inner points.
    fn add_exact(
        &mut self,
        elements: [[usize; 2]; 2],
        quads: [&[[f64; 2]; 4]; 2],
    ) -> (Vec<u32>, Vec<u32>) {
        let part = collide::overlap(quads[0], quads[1]);
        let corners = part.as_slice();
        let area: f64 = corners.iter().map(|vertex| vertex.area).sum();
        if area <= NOTHING * self.sides[0].element {
            return (Vec::new(), Vec::new());
        }
        let points = collide::exact_areas(corners, quads);
        let mut numbers = points.iter().map(|OverlapPoint { on, area, .. }| {
            let at = [0, 1].map(|k| self.sides[k].point(elements[k], on[k]));
            self.put_point(elements[0], *area, at, *on)
        });
        let corners = numbers.by_ref().take(corners.len()).collect();
        (corners, numbers.collect())
    }

    /// Adds a point, or adds its area to the point at the same node. Returns the point's number.
    fn put(&mut self, element: [usize; 2], vertex: &Vertex) -> Option<u32> {
        let [fine, coarse] = self.sides;
        if vertex.area <= NOTHING * fine.element {
            return None;
        }
        let points = [fine.point(element, vertex.on), coarse.surface_point(vertex.at)];
        let on = [vertex.on, points[1].on.map(f64::from)];
        Some(self.put_point(element, vertex.area, points, on))
    }

    /// Adds a point, given on the finer and on the coarser side, or adds its area to the point at the
    /// same node.
    fn put_point(
        &mut self,
        [i, k]: [usize; 2],
        area: f64,
        mut points: [SurfacePoint; 2],
        mut on: [[f64; 2]; 2],
    ) -> u32 {
        let n = self.sides[0].contact_block.topology.divisions();
        let node = node_at(on[0]).map(|[a, b]| i + a + (n + 1) * (k + b));
        let OverlapPoints { points: all, on: all_on } = &mut self.points;
        if let Some(known) = node.map(|node| self.at_node[node]).filter(|&p| p != usize::MAX) {
            all[known].pair.area += area;
            return known as u32;
        }
        if let Some(node) = node {
            self.at_node[node] = all.len();
        }
        if self.fine == 1 {
            points.reverse();
            on.reverse();
        }
        all.push(ContactPoint::new(points, area));
        all_on.push(on);
        all.len() as u32 - 1
    }
}
