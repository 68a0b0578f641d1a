//! Ties of the nodes that parts of cells share.

use std::collections::{BTreeSet, HashMap};

use ddem_core::problem::{Geometry, Ties};
use ddem_cut::{CommonFace, PartPoint};

use super::blocks::{RockBlocks, VTK};

/// Points of cells, each of which is one with those of the cells that are joined around it.
struct JoinedPoints<'a> {
    /// Number of each point of each cell.
    numbers: HashMap<(u32, &'a PartPoint), u32>,
    /// Another number of the same point, or the number itself.
    parents: Vec<u32>,
}

impl RockBlocks<'_> {
    /// Ties of the nodes of parts that share them: of one cell, and of cells that are joined at faces
    /// around the node. Both sides of a joint that ends within a block stay apart.
    pub(in crate::build) fn ties(&self, geometry: &Geometry) -> Ties {
        let mut points = self.joined_points();
        let mut nodes: HashMap<Vec<(u32, u64)>, Vec<u32>> = HashMap::new();
        for (cell, parts) in self.parts.iter().enumerate() {
            let n = self.rock.divisions(cell) as u64;
            for (number, part) in parts.iter().enumerate() {
                let block = self.first[cell] + number;
                let topology = geometry.topology(block);
                let corners = VTK.map(|corner| points.root(cell as u32, &part.points[corner]));
                for node in 0..topology.nodes() {
                    let steps = topology.steps(node).map(|at| at as u64);
                    // Inside the part no node has another one at its place.
                    if steps.iter().all(|&at| 0 < at && at < n) {
                        continue;
                    }
                    let key = place(&corners, steps, n);
                    nodes
                        .entry(key)
                        .or_default()
                        .push(geometry.blocks[block].first_node + node as u32);
                }
            }
        }
        Ties::new(nodes.into_values())
    }

    fn joined_points(&self) -> JoinedPoints<'_> {
        let mut points = JoinedPoints { numbers: HashMap::new(), parents: Vec::new() };
        for (cell, parts) in self.parts.iter().enumerate() {
            for point in parts.iter().flat_map(|part| &part.points) {
                let new = points.parents.len() as u32;
                if *points.numbers.entry((cell as u32, point)).or_insert(new) == new {
                    points.parents.push(new);
                }
            }
        }
        let joined = self.rock.common.iter().filter(|face| self.rock.is_joined(face));
        for face in joined.filter(|face| self.both_exist(face)) {
            for point in self.shared(face) {
                let [a, b] = face.cells.map(|cell| points.root(cell, point));
                points.parents[a.max(b) as usize] = a.min(b);
            }
        }
        points
    }

    /// Points that the two cells of a common face have in the face.
    fn shared(&self, face: &CommonFace) -> BTreeSet<&PartPoint> {
        let [own, other] = [0, 1].map(|side| self.points_of(face, side));
        own.intersection(&other).copied().collect()
    }

    /// Points of one of the two cells of a common face in the face.
    fn points_of(&self, face: &CommonFace, side: usize) -> BTreeSet<&PartPoint> {
        let (cell, number) = (face.cells[side] as usize, face.faces[side]);
        let of = &self.rock.complex.cells()[cell].faces[number as usize];
        let sorted = of.sorted_corners();
        let on = |point: &&PartPoint| match point {
            PartPoint::Vertex(vertex) => sorted.contains(vertex),
            PartPoint::Edge(a, b) => {
                of.edges().any(|(from, to)| (from, to) == (*a, *b) || (from, to) == (*b, *a))
            }
            PartPoint::Face(corners) => *corners == sorted,
            PartPoint::Cell(_) => false,
        };
        self.parts[cell].iter().flat_map(|part| &part.points).filter(on).collect()
    }
}

impl<'a> JoinedPoints<'a> {
    /// Lowest number of the points that are one with a point of a cell; shortens the path to it.
    fn root(&mut self, cell: u32, point: &'a PartPoint) -> u32 {
        let mut at = self.numbers[&(cell, point)];
        while self.parents[at as usize] != at {
            self.parents[at as usize] = self.parents[self.parents[at as usize] as usize];
            at = self.parents[at as usize];
        }
        at
    }
}

/// Place of a node on the surface of a part: the corners around it with their weights, which are
/// the same in every part that has the node.
fn place(corners: &[u32; 8], steps: [u64; 3], n: u64) -> Vec<(u32, u64)> {
    let weight = |corner: usize| -> u64 {
        (0..3).map(|d| if corner >> d & 1 == 1 { steps[d] } else { n - steps[d] }).product()
    };
    let all = corners.iter().enumerate().map(|(corner, &id)| (id, weight(corner)));
    let mut place: Vec<(u32, u64)> = all.filter(|(_, weight)| *weight > 0).collect();
    place.sort_unstable();
    place
}
