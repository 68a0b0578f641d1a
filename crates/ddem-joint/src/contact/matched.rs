//! Joints between faces of two parts of cells that have equal corners.
//!
//! The pairs are the facing nodes, and the area of each is the integral of its shape functions. A
//! uniform traction therefore gives the nodes of both sides exactly the forces of a uniform stress.

use super::patch_builder::PatchBuilder;
use super::{ContactBlock, ContactPoint};
use ddem_mechanics::collide::FaceId;
use ddem_mesh::in_situ::QuadIntegral;
use ddem_mesh::{NonconformingJoint, SurfacePoint, Vec3, quad_points};

/// Distance within which two nodes face each other, as a fraction of the root of the area.
const SAME: f64 = 1e-5;

/// Pairs of two matching faces.
pub(super) struct MatchedFaces {
    /// Unit normal from the first block to the second.
    pub(super) normal: Vec3,
    pub(super) points: Vec<ContactPoint>,
    /// Points around each element of the first face.
    pub(super) quads: Vec<[u32; 4]>,
    /// Shape functions times areas at the Gauss points of the elements.
    pub(super) integrals: Vec<QuadIntegral>,
}

impl PatchBuilder<'_> {
    /// Pairs of the faces of a joint; `None` unless these are equal faces of parts of cells.
    pub(super) fn matched(&self, joint_pair: &NonconformingJoint) -> Option<MatchedFaces> {
        let NonconformingJoint { blocks, faces, .. } = *joint_pair;
        let [a, b] = blocks.map(|block| &self.configuration.blocks[block as usize]);
        let normal = a.part_normal(faces[0])?;
        b.part_normal(faces[1])?;
        let n = a.topology.divisions();
        if b.topology.divisions() != n {
            return None;
        }
        let side = n + 1;
        let mut nodes = vec![Vec3::zeros(); side * side];
        let mut areas = vec![0.0; side * side];
        let (mut quads, mut integrals) = (Vec::new(), Vec::new());
        for element in (0..n).flat_map(|k| (0..n).map(move |i| [i, k])) {
            let quad = a.part_quad(faces[0], element);
            quad.iter().for_each(|&(node, x)| nodes[node] = x);
            quads.push(quad.map(|(node, _)| node as u32));
            for integral in integrals_over(&quad) {
                let QuadIntegral { points, weights, .. } = &integral;
                points.iter().zip(weights).for_each(|(node, w)| areas[*node as usize] += w);
                integrals.push(integral);
            }
        }
        let near = SAME * a.element_area(faces[0]).sqrt();
        let facing = facing(b, faces[1], &nodes, near)?;
        let point = |node: usize| {
            let own = on_face(faces[0], node, n);
            ContactPoint::new([own, on_face(faces[1], facing[node], n)], areas[node])
        };
        let points = (0..side * side).map(point).collect();
        Some(MatchedFaces { normal, points, quads, integrals })
    }
}

/// Node of a face that lies at each of some points; `None` if one has no node there.
fn facing(b: &ContactBlock, face: FaceId, nodes: &[Vec3], near: f64) -> Option<Vec<usize>> {
    let n = b.topology.divisions();
    let mut own = vec![Vec3::zeros(); (n + 1) * (n + 1)];
    for element in (0..n).flat_map(|k| (0..n).map(move |i| [i, k])) {
        b.part_quad(face, element).iter().for_each(|&(node, x)| own[node] = x);
    }
    let at = |x: &Vec3| own.iter().position(|y| (x - y).norm() <= near);
    nodes.iter().map(at).collect()
}

/// Node of a face with `n` elements along its edges, as a point of the face.
fn on_face(face: FaceId, node: usize, n: usize) -> SurfacePoint {
    let at = [node % (n + 1), node / (n + 1)];
    let element = at.map(|i| i.min(n - 1));
    SurfacePoint::new(face, element, [0, 1].map(|k| (at[k] - element[k]) as f64))
}

/// Shape functions times areas at the four Gauss points of a quadrilateral.
fn integrals_over(quad: &[(usize, Vec3); 4]) -> [QuadIntegral; 4] {
    let corners = quad.map(|(_, x)| x);
    quad_points(&corners).map(|(shape, area)| QuadIntegral {
        points: quad.map(|(node, _)| node as u32),
        weights: shape.map(|n| n * area),
        at: corners.iter().zip(shape).map(|(x, n)| x * n).sum(),
    })
}
