//! Projection of faces and edges onto the plane of a patch.

use super::cells::BodyQuad;
use super::{Configuration, ContactBlock};
use ddem_mechanics::collide::{self, EdgeId, FaceId};
use ddem_mesh::{SurfacePoint, Vec3};

/// Sine of the angle below which edges count as parallel.
const PARALLEL: f64 = 1e-9;

/// One side of a face contact, projected along the normal.
pub(super) struct ContactSide<'a> {
    pub(super) contact_block: &'a ContactBlock,
    quad: BodyQuad,
    /// Positions of its nodes in the plane `[m]`.
    nodes: Vec<[f64; 2]>,
    pub(super) outline: [[f64; 2]; 4],
    /// Area of one element's face `[m²]`.
    pub(super) element: f64,
}

impl<'a> ContactSide<'a> {
    pub(super) fn new(
        configuration: &Configuration<'a>,
        body: u32,
        quad: &BodyQuad,
        frame: &[Vec3; 3],
    ) -> Self {
        let BodyQuad { part, face } = *quad;
        let contact_block = &configuration.blocks[body as usize + usize::from(part)];
        let n = contact_block.topology.divisions();
        let mut nodes = Vec::with_capacity((n + 1) * (n + 1));
        for (k, i) in (0..=n).flat_map(|k| (0..=n).map(move |i| (k, i))) {
            let x =
                contact_block.node(configuration.u, contact_block.topology.on_face(face, [i, k]));
            nodes.push([frame[1].dot(&x), frame[2].dot(&x)]);
        }
        let m = n + 1;
        let outline = [0, n, n + m * n, m * n].map(|at| nodes[at]);
        let element = contact_block.element_area(face);
        Self { contact_block, quad: *quad, nodes, outline, element }
    }

    /// Point of an element of the face.
    pub(super) fn point(&self, element: [usize; 2], on: [f64; 2]) -> SurfacePoint {
        let BodyQuad { part, face } = self.quad;
        SurfacePoint { part, ..SurfacePoint::new(face, element, on) }
    }

    pub(super) fn quad(&self, [i, k]: [usize; 2]) -> [[f64; 2]; 4] {
        let m = self.contact_block.topology.divisions() + 1;
        [[i, k], [i + 1, k], [i + 1, k + 1], [i, k + 1]].map(|[i, k]| self.nodes[i + m * k])
    }

    /// Point of the face over a point of the plane.
    pub(super) fn surface_point(&self, at: [f64; 2]) -> SurfacePoint {
        let n = self.contact_block.topology.divisions();
        let whole = collide::bilinear(&self.outline, at);
        let mut element = whole.map(|x| ((x * n as f64) as usize).min(n - 1));
        let mut on = collide::bilinear(&self.quad(element), at);
        // Faces are not quite flat, so the adjacent element may hold the point.
        for axis in 0..2 {
            if on[axis] < 0.0 && element[axis] > 0 {
                element[axis] -= 1;
            } else if on[axis] > 1.0 && element[axis] + 1 < n {
                element[axis] += 1;
            } else {
                continue;
            }
            on = collide::bilinear(&self.quad(element), at);
        }
        self.point(element, on.map(|x| x.clamp(0.0, 1.0)))
    }
}

/// True if the boxes around two quadrilaterals are disjoint.
pub(super) fn are_disjoint(a: &[[f64; 2]; 4], b: &[[f64; 2]; 4]) -> bool {
    (0..2).any(|c| {
        let range = |quad: &[[f64; 2]; 4]| {
            let along = quad.iter().map(|x| x[c]);
            along.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)))
        };
        let ((low_a, high_a), (low_b, high_b)) = (range(a), range(b));
        low_a > high_b || low_b > high_a
    })
}

/// Node of an element at bilinear coordinates, if they are those of a node.
pub(super) fn node_at(on: [f64; 2]) -> Option<[usize; 2]> {
    let end = |x: f64| if x == 0.0 { Some(0) } else { (x == 1.0).then_some(1) };
    Some([end(on[0])?, end(on[1])?])
}

/// Lattice steps of the i-th node along an edge.
pub(super) fn edge_node(contact_block: &ContactBlock, edge: EdgeId, i: usize) -> [usize; 3] {
    let mut at = [0; 3];
    at[edge.direction] = i;
    for (next, upper) in edge.upper.into_iter().enumerate() {
        at[(edge.direction + 1 + next) % 3] =
            if upper { contact_block.topology.divisions() } else { 0 };
    }
    at
}

/// Point at a fraction of an edge, on the adjacent face across its next direction.
pub(super) fn edge_point(
    contact_block: &ContactBlock,
    edge: EdgeId,
    fraction: f64,
) -> SurfacePoint {
    let n = contact_block.topology.divisions();
    let along = fraction * n as f64;
    let i = (along as usize).min(n - 1);
    // Across direction d + 1, the face's own directions are d + 2 and d.
    let (k, on) = if edge.upper[1] { (n - 1, 1.0) } else { (0, 0.0) };
    let face = FaceId { direction: (edge.direction + 1) % 3, upper: edge.upper[0] };
    SurfacePoint::new(face, [k, i], [on, along - i as f64])
}

/// True if the edges of two parallelograms have equal directions.
pub(super) fn are_parallel(a: &[[f64; 2]; 4], b: &[[f64; 2]; 4]) -> bool {
    let edge = |quad: &[[f64; 2]; 4], to: usize| [0, 1].map(|c| quad[to][c] - quad[0][c]);
    let sine = |x: [f64; 2], y: [f64; 2]| {
        let cross = x[0] * y[1] - x[1] * y[0];
        cross.abs() / (libm::hypot(x[0], x[1]) * libm::hypot(y[0], y[1]))
    };
    let same = |along: usize, other: usize| sine(edge(a, along), edge(b, other)) < PARALLEL;
    (same(1, 1) && same(3, 3)) || (same(1, 3) && same(3, 1))
}
