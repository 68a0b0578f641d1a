//! Part of one face that lies over another, with its points.

use super::ContactPoint;
use super::side::{ContactSide, are_disjoint, are_parallel, node_at};
use ddem_mechanics::collide::{self, Vertex};

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
    points: Vec<ContactPoint>,
}

/// Pairs of points of the part of a finer face, that of body `fine`, that lies over another face. The
/// sides are the finer and the coarser one. See [`PatchBuilder`](super::patch_builder::PatchBuilder)
/// for `visit`.
pub(super) fn overlap(
    sides: [&ContactSide<'_>; 2],
    fine: usize,
    visit: &mut Option<Polygons<'_>>,
) -> Vec<ContactPoint> {
    let [own, coarse] = sides;
    let [n, m] = sides.map(|side| side.contact_block.topology.divisions());
    let at_node = vec![usize::MAX; (n + 1) * (n + 1)];
    let mut overlap = ClippedOverlap { sides, fine, at_node, points: Vec::new() };
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
            let (corners, inside) = overlap.add_inside([i, k], &quad, &outline);
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
        let of_part = self.sides[0].contact_block.is_part();
        if !of_part && are_parallel(quad, outline) {
            let corners = part.as_slice().iter().filter_map(|vertex| self.put(element, vertex));
            return (corners.collect(), Vec::new());
        }
        let (corners, inside) =
            if of_part { quarters(part.as_slice(), quad) } else { part.squares() };
        let mut put = |vertices: &[Vertex]| {
            vertices.iter().filter_map(|vertex| self.put(element, vertex)).collect()
        };
        (put(&corners), put(&inside))
    }

    /// Adds a point, or adds its area to the point at the same node. Returns the point's number.
    fn put(&mut self, [i, k]: [usize; 2], vertex: &Vertex) -> Option<u32> {
        let [fine, coarse] = self.sides;
        let n = fine.contact_block.topology.divisions();
        if vertex.area <= NOTHING * fine.element {
            return None;
        }
        let node = node_at(vertex.on).map(|[a, b]| i + a + (n + 1) * (k + b));
        if let Some(known) = node.map(|node| self.at_node[node]).filter(|&p| p != usize::MAX) {
            self.points[known].pair.area += vertex.area;
            return Some(known as u32);
        }
        if let Some(node) = node {
            self.at_node[node] = self.points.len();
        }
        let mut points = [fine.point([i, k], vertex.on); 2];
        points[1 - self.fine] = coarse.surface_point(vertex.at);
        self.points.push(ContactPoint::new(points, vertex.area));
        Some(self.points.len() as u32 - 1)
    }
}

/// Corners and inner points of a part of a face of any shape. Each quarter of a triangle gives 1/12 of
/// its area to each of its corners and 3/4 to its centroid.
fn quarters(polygon: &[Vertex], quad: &[[f64; 2]; 4]) -> (Vec<Vertex>, Vec<Vertex>) {
    let mut corners: Vec<Vertex> =
        polygon.iter().map(|vertex| Vertex { area: 0.0, ..*vertex }).collect();
    let mut inside = Vec::new();
    let mean =
        |of: &[[f64; 2]]| [0, 1].map(|k| of.iter().map(|at| at[k]).sum::<f64>() / of.len() as f64);
    let mut put = |at: [f64; 2], area: f64| {
        let on = collide::bilinear(quad, at).map(|x| x.clamp(0.0, 1.0));
        inside.push(Vertex { at, on, area });
    };
    for i in 1..polygon.len().saturating_sub(1) {
        let triangle = [0, i, i + 1];
        let [a, b, c] = triangle.map(|k| polygon[k].at);
        let cross = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        let quarter = 0.125 * cross.abs();
        triangle.into_iter().for_each(|k| corners[k].area += quarter / 12.0);
        let [ab, bc, ca] = [mean(&[a, b]), mean(&[b, c]), mean(&[c, a])];
        // The middle of an edge belongs to three quarters.
        [ab, bc, ca].into_iter().for_each(|at| put(at, quarter / 4.0));
        let all = [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]];
        all.into_iter().for_each(|of| put(mean(&of), 0.75 * quarter));
    }
    (corners, inside)
}
