//! Free parts of the faces of parts of cells.
//!
//! The face of a cell may reach beyond an opening, where other cells cover it. Faces of lattices are
//! free as a whole or not at all.

use super::{BlockFace, Geometry, Vec3, quad_points};
use ddem_mechanics::collide::{OverlapPoint, exact_areas, overlap, weights};

/// Least free part of a face or an element. Smaller ones are rounding, or small overlaps that are no joints.
const LEAST: f64 = 1e-5;

/// Part of the face of an element that no other block covers.
#[derive(Clone, Copy, Debug)]
pub struct FreeElement {
    /// Centroid; for a whole face the mean of its corners `[m]`.
    pub centre: Vec3,
    /// Nodes with the integrals of their shape functions `[m²]`.
    pub areas: [(u32, f64); 4],
}

impl BlockFace {
    /// Free parts of the elements of a face of a part; empty if other blocks cover all of it.
    #[must_use]
    pub fn free_elements(&self, geometry: &Geometry) -> Vec<FreeElement> {
        let joints = || geometry.joined_at(self.block, self.face.number());
        let covered: f64 = joints().map(|joint_pair| joint_pair.area).sum();
        if self.is_tied(geometry) || covered > (1.0 - LEAST) * self.area(geometry) {
            return Vec::new();
        }
        let sides = joints().flat_map(|joint_pair| joint_pair.sides());
        let others = sides.filter(|side| side.block != self.block);
        let covers: Vec<[Vec3; 4]> = others.map(|side| side.at_rest(geometry).whole).collect();
        let n = geometry.topology(self.block).divisions();
        let elements = (0..n).flat_map(|k| (0..n).map(move |i| [i, k]));
        elements.filter_map(|element| self.free_element(geometry, element, &covers)).collect()
    }

    /// Free part of an element, given the corners of the faces that cover parts of the face.
    fn free_element(
        &self,
        geometry: &Geometry,
        element: [usize; 2],
        covers: &[[Vec3; 4]],
    ) -> Option<FreeElement> {
        let topology = geometry.topology(self.block);
        let nodes = topology.quad(self.face, element);
        let corners = nodes.map(|node| geometry.position(self.block, topology.steps(node)));
        let mut areas = [0.0; 4];
        let mut add = |shape: [f64; 4], area: f64| (0..4).for_each(|k| areas[k] += shape[k] * area);
        quad_points(&corners).into_iter().for_each(|(shape, area)| add(shape, area));
        let along = (corners[1] - corners[0]).normalize();
        let across = self.outward(geometry).cross(&along);
        let flat = |x: Vec3| [along.dot(&(x - corners[0])), across.dot(&(x - corners[0]))];
        let (quad, mut covered) = (corners.map(flat), 0.0);
        for cover in covers.iter().map(|cover| cover.map(flat)) {
            let part = overlap(&quad, &cover);
            if part.as_slice().is_empty() {
                continue;
            }
            for OverlapPoint { on, area, .. } in exact_areas(part.as_slice(), [&quad, &cover]) {
                add(weights(on[0]), -area);
                covered += area;
            }
        }
        let first = geometry.blocks[self.block].first_node;
        let of_nodes = std::array::from_fn(|k| (first + nodes[k] as u32, areas[k]));
        if covered == 0.0 {
            let centre = corners.iter().sum::<Vec3>() / 4.0;
            return Some(FreeElement { centre, areas: of_nodes });
        }
        let free: f64 = areas.iter().sum();
        let moment: Vec3 = corners.iter().zip(areas).map(|(x, area)| x * area).sum();
        (free > LEAST * (free + covered))
            .then(|| FreeElement { centre: moment / free, areas: of_nodes })
    }
}
