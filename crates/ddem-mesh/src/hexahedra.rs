//! Elements of the parts of cells.

use nalgebra::{Point3, Vector3};

use crate::assembly::{Assembly, ElementPack, NO_TABLE};
use crate::pack::Pack;
use crate::properties::Properties;
use crate::{Geometry, PartShape, Vec3};
use ddem_mechanics::element::Elastic;
use ddem_mechanics::element::hex8::lumped_mass;
use ddem_mechanics::element::hexahedron::HexahedronElement;
use ddem_mechanics::element::table::ElementTable;
use ddem_mechanics::math::lanes::{LANES, Lanes};

impl Geometry {
    /// Corners of an element of a block in VTK's order `[m]`.
    #[must_use]
    pub fn element_corners(&self, block: usize, element: usize) -> [Vec3; 8] {
        let topology = self.topology(block);
        topology.hex(element).map(|node| self.position(block, topology.steps(node)))
    }

    /// Elements of a part, x fastest.
    fn hexahedra(&self, block: usize, properties: &Properties) -> Vec<HexahedronElement> {
        let elastic = self.elastic(block, properties);
        let element = |element: usize| {
            let corners = self.element_corners(block, element);
            let made = HexahedronElement::new(&corners, elastic, properties.element);
            made.unwrap_or_else(|| unreachable!("parts whose elements have no volume are refused"))
        };
        (0..self.topology(block).elements()).map(element).collect()
    }

    fn elastic<'a>(&self, block: usize, properties: &'a Properties) -> &'a Elastic {
        &properties.materials[usize::from(self.blocks[block].material)]
    }

    /// Adds mass and stiffness diagonal of the elements of a part to its nodes. A rigid one has only
    /// mass.
    pub(crate) fn scatter_part(
        &self,
        block: usize,
        properties: &Properties,
        nodes: &mut [[f64; 4]],
    ) {
        let (topology, first) = (self.topology(block), self.blocks[block].first_node as usize);
        let inertia = self.part(block).map_or(1.0, |part| part.inertia);
        let stiffness = if self.is_rigid(block) { 0.0 } else { 1.0 };
        let density = inertia * self.elastic(block, properties).density;
        for (number, element) in self.hexahedra(block, properties).iter().enumerate() {
            let corners = self.element_corners(block, number).map(Point3::from);
            let (mass, diagonal) = (lumped_mass(&corners, density), element.diagonal());
            for (corner, node) in topology.hex(number).into_iter().enumerate() {
                let sums = &mut nodes[first + node];
                sums[0] += mass[corner];
                (0..3).for_each(|c| sums[1 + c] += stiffness * diagonal[corner][c]);
            }
        }
    }
}

impl Assembly {
    /// Tables of a pack of parts, which have no joint lattices.
    pub(crate) fn tables_of_parts(
        &mut self,
        geometry: &Geometry,
        properties: &Properties,
        pack: &Pack,
    ) -> [u32; 8] {
        let own = |lane: usize| (lane < pack.filled).then_some(pack.blocks[lane] as usize);
        let hexahedra: [Vec<HexahedronElement>; LANES] = std::array::from_fn(|lane| {
            own(lane).map_or_else(Vec::new, |block| geometry.hexahedra(block, properties))
        });
        let table = ElementTable::hexahedra(hexahedra.each_ref().map(|lattice| &lattice[..]));
        let elements = std::array::from_fn(|lane| {
            let elastic = *geometry.elastic(own(lane)?, properties);
            Some(self.element(
                [Vector3::x(), Vector3::y(), Vector3::z()],
                elastic,
                properties.element,
            ))
        });
        let edges = pack.blocks.map(|block| geometry.element_edges(block as usize));
        let edges = std::array::from_fn(|d| {
            std::array::from_fn(|k| Lanes(std::array::from_fn(|lane| edges[lane][d][k])))
        });
        let warp = warp(geometry, pack);
        let weight = pack
            .blocks
            .map(|block| geometry.part(block as usize).map_or(1.0, |part| 1.0 / part.inertia));
        self.tables.push(ElementPack { edges, table, elements, warp, weight: Lanes(weight) });
        let mut tables = [NO_TABLE; 8];
        tables[0] = self.tables.len() as u32 - 1;
        tables
    }
}

/// Deviations of the nodes of a pack of parts from those of the parallelepipeds `[m]`.
fn warp(geometry: &Geometry, pack: &Pack) -> Vec<[Lanes; 3]> {
    let topology = geometry.topology(pack.blocks[0] as usize);
    let of = |node: usize, lane: usize| {
        let block = pack.blocks[lane] as usize;
        let steps = topology.steps(node);
        let half = 0.5 * topology.divisions() as f64;
        let edges = geometry.element_edges(block);
        let far = (0..3).map(|d| edges[d] * (steps[d] as f64 - half)).sum::<Vec3>();
        let middle = geometry.part(block).map_or_else(Vec3::zeros, PartShape::middle);
        geometry.position(block, steps) - middle - far
    };
    let of_node = |node: usize| {
        let lanes: [Vec3; LANES] = std::array::from_fn(|lane| of(node, lane));
        [0, 1, 2].map(|c| Lanes(lanes.map(|x| x[c])))
    };
    (0..topology.nodes()).map(of_node).collect()
}
