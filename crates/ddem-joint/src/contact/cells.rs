//! Cells of rock as bodies that meet: convex polyhedra of several blocks.
//!
//! A cell has blocks, its parts, at each vertex. A face of the cell consists of a quadrilateral at each
//! of its vertices, and an edge of the halves of the parts at its two ends. Contacts name a cell by its
//! first block.

use std::collections::HashMap;
use std::sync::{Arc, LazyLock};

use super::{Configuration, ContactBlock};
use ddem_mechanics::collide::{ContactFeature, EdgeId, FaceId, HullEdge, HullTopology};
use ddem_mesh::grid::Bounds;
use ddem_mesh::{Geometry, PartShape, Vec3, bounds_of};

/// Face of a block, as a part of a face of a body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct BodyQuad {
    /// Number of the block after the first one of its body.
    pub(super) part: u16,
    pub(super) face: FaceId,
}

/// Edge of a body. That of a block is one edge, that of a cell two halves, each from its end to the
/// middle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct BodyEdge {
    /// Numbers of the blocks after the first one of the body, and their edges.
    pub(super) halves: [(u16, EdgeId); 2],
    /// True if these are two halves.
    pub(super) is_halved: bool,
}

/// Features of two bodies in contact.
pub(super) enum Features<'a> {
    /// Two faces, the first one that of body a. Body `of` determines the normal.
    Faces { of: usize, quads: [&'a [BodyQuad]; 2] },
    /// Two edges that cross.
    Edges([BodyEdge; 2]),
}

/// Polyhedron of a body.
#[derive(Debug)]
pub(super) struct BodyShape {
    /// Faces and edges.
    pub(super) topology: HullTopology,
    /// Block of a cell whose lowest corner each vertex is.
    vertices: Vec<u16>,
    /// Parts of each face.
    pub(super) quads: Vec<Vec<BodyQuad>>,
    /// Halves of each edge.
    pub(super) edges: Vec<BodyEdge>,
}

/// Convex cell of several blocks.
#[derive(Debug)]
pub(super) struct ContactCell {
    /// First of its blocks.
    pub(super) first: u32,
    /// First block of the whole block that it belongs to.
    pub(super) whole: u32,
    pub(super) shape: BodyShape,
    /// Number of its blocks.
    pub(super) parts: usize,
    /// Edge of an element `[m]`: the width of the cell over the elements across it.
    pub(super) spacing: f64,
    /// Largest distance of a vertex from the centre of the first block `[m]`.
    pub(super) size: f64,
}

/// Faces of a block as faces of a body.
static OF_BLOCK: [[BodyQuad; 1]; 6] = {
    const fn quad(direction: usize, upper: bool) -> [BodyQuad; 1] {
        [BodyQuad { part: 0, face: FaceId { direction, upper } }]
    }
    [quad(0, false), quad(0, true), quad(1, false), quad(1, true), quad(2, false), quad(2, true)]
};

/// Parts of a face of a block: the face itself.
pub(super) fn quads_of_block(face: FaceId) -> &'static [BodyQuad] {
    &OF_BLOCK[usize::from(face.number())]
}

/// Polyhedron of a block.
pub(super) static BLOCK: LazyLock<BodyShape> = LazyLock::new(|| {
    let ring = |FaceId { direction: d, upper }| {
        let [first, second] = [1, 2].map(|next| 1_u32 << ((d + next) % 3));
        let at = u32::from(upper) << d;
        // Outward, the next two directions are clockwise at the lower face.
        let [first, second] = if upper { [first, second] } else { [second, first] };
        vec![at, at + first, at + first + second, at + second]
    };
    let topology = HullTopology::new(FaceId::all().map(ring).collect()).unwrap_or_default();
    let edge = |edge: &HullEdge| {
        let [from, to] = edge.ends;
        let direction = (from ^ to).trailing_zeros() as usize;
        let upper = [1, 2].map(|next| from >> ((direction + next) % 3) & 1 == 1);
        BodyEdge { halves: [(0, EdgeId { direction, upper }); 2], is_halved: false }
    };
    let edges = topology.edges.iter().map(edge).collect();
    let quads = FaceId::all().map(|face| quads_of_block(face).to_vec()).collect();
    BodyShape { topology, vertices: Vec::new(), quads, edges }
});

impl Features<'static> {
    /// Features of two blocks that are bodies of their own.
    pub(super) fn of_blocks(feature: ContactFeature) -> Self {
        match feature {
            ContactFeature::Edges(edges) => {
                Self::Edges(edges.map(|edge| BodyEdge { halves: [(0, edge); 2], is_halved: false }))
            }
            ContactFeature::Face { of, face, other } => {
                let faces = if of == 0 { [face, other] } else { [other, face] };
                Self::Faces { of, quads: faces.map(quads_of_block) }
            }
        }
    }
}

/// Cell of each block; `None` for blocks that are bodies of their own.
pub(super) fn cells(geometry: &Geometry) -> Vec<Option<Arc<ContactCell>>> {
    let n = geometry.blocks.len();
    let (mut cells, mut wholes) = (vec![None; n], HashMap::new());
    let mut first = 0;
    while first < n {
        let number = |block: usize| geometry.part(block).map(|part| part.cell);
        let Some(cell) = number(first) else {
            first += 1;
            continue;
        };
        let end = (first..n).find(|&block| number(block) != Some(cell)).unwrap_or(n);
        let block = geometry.part(first).map_or(0, |part| part.block);
        let whole = *wholes.entry(block).or_insert(first as u32);
        let of_all = ContactCell::new(geometry, first, end, whole).map(Arc::new);
        cells[first..end].iter_mut().for_each(|of_block| of_block.clone_from(&of_all));
        first = end;
    }
    cells
}

impl ContactCell {
    /// Cell of the blocks from `first` to `end`; `None` if they do not form a polyhedron.
    fn new(geometry: &Geometry, first: usize, end: usize, whole: u32) -> Option<Self> {
        let parts: Vec<_> =
            (first..end).map(|block| geometry.part(block)).collect::<Option<_>>()?;
        let shape = BodyShape::new(&parts)?;
        let (part, n) = (parts[0], geometry.topology(first).divisions());
        let middle = part.middle();
        let distance = |part: &&PartShape| (part.corners[0] - middle).norm();
        Some(Self {
            first: first as u32,
            whole,
            shape,
            parts: parts.len(),
            spacing: part.width / (2 * n) as f64,
            size: parts.iter().map(distance).fold(0.0, f64::max),
        })
    }

    /// Present positions of its vertices `[m]`.
    pub(super) fn vertices(&self, configuration: &Configuration<'_>) -> Vec<Vec3> {
        let block = |part: &u16| &configuration.blocks[self.first as usize + usize::from(*part)];
        self.shape.vertices.iter().map(|part| block(part).node(configuration.u, [0; 3])).collect()
    }
}

impl BodyShape {
    /// Polyhedron of these parts of a cell.
    fn new(parts: &[&PartShape]) -> Option<Self> {
        let mut numbers: Vec<u32> = parts.iter().map(|part| part.vertex).collect();
        numbers.sort_unstable();
        numbers.dedup();
        let vertex = |number: &u32| parts.iter().position(|part| part.vertex == *number);
        let vertices: Vec<u16> =
            numbers.iter().map(|number| Some(vertex(number)? as u16)).collect::<Option<_>>()?;
        let mut faces: Vec<u32> = parts.iter().flat_map(|part| part.faces).flatten().collect();
        faces.sort_unstable();
        faces.dedup();
        let around = |face: &u32| quads_around(*face, parts);
        let quads: Vec<Vec<BodyQuad>> = faces.iter().map(around).collect::<Option<_>>()?;
        let at = |quad: &BodyQuad| {
            numbers.partition_point(|&other| other < parts[usize::from(quad.part)].vertex) as u32
        };
        let rings = quads.iter().map(|ring| ring.iter().map(at).collect()).collect();
        let topology = HullTopology::new(rings)?;
        let edge = |HullEdge { ends, .. }: &HullEdge| {
            let [a, b] = ends.map(|end| numbers[end as usize]);
            let halves = [half(parts, a, b)?, half(parts, b, a)?];
            Some(BodyEdge { halves, is_halved: true })
        };
        let edges = topology.edges.iter().map(edge).collect::<Option<_>>()?;
        Some(Self { topology, vertices, quads, edges })
    }
}

/// Parts around a face, counter-clockwise from outside.
fn quads_around(face: u32, parts: &[&PartShape]) -> Option<Vec<BodyQuad>> {
    let of = |part: usize| parts[part].faces.iter().position(|&own| own == Some(face));
    let start = (0..parts.len()).find(|&part| of(part).is_some())?;
    let (mut ring, mut part) = (Vec::new(), start);
    loop {
        let direction = of(part)?;
        ring.push(BodyQuad { part: part as u16, face: FaceId { direction, upper: false } });
        // The outward normal of the lower face across d is against the product of edges d + 1 and
        // d + 2, so that the face continues along edge d + 2.
        let next = parts[part].ends[(direction + 2) % 3]?;
        part =
            (0..parts.len()).find(|&other| parts[other].vertex == next && of(other).is_some())?;
        if part == start {
            return Some(ring);
        }
        if ring.len() > parts.len() {
            return None;
        }
    }
}

/// Half of the edge of a cell between two vertices, at the first of them.
fn half(parts: &[&PartShape], from: u32, to: u32) -> Option<(u16, EdgeId)> {
    let numbered = parts.iter().enumerate().filter(|(_, part)| part.vertex == from);
    let mut along = numbered.filter_map(|(number, part)| {
        let direction = part.ends.iter().position(|&end| end == Some(to))?;
        Some((number as u16, EdgeId { direction, upper: [false; 2] }))
    });
    along.next()
}

impl ContactBlock {
    /// First block of its body: of its cell, or the block itself.
    pub(super) fn body(&self, block: u32) -> u32 {
        self.polyhedron.as_ref().map_or(block, |cell| cell.first)
    }
}

impl<'a> Configuration<'a> {
    /// Cell of a body; `None` if it is a block.
    pub(super) fn cell_of(&self, body: u32) -> Option<&'a ContactCell> {
        self.blocks[body as usize].polyhedron.as_deref()
    }

    /// Blocks of a body.
    pub(super) fn blocks_of(&self, body: u32) -> std::ops::Range<usize> {
        let first = body as usize;
        first..first + self.cell_of(body).map_or(1, |cell| cell.parts)
    }

    /// Bounding box of a body, enlarged by a margin `[m]`.
    pub(super) fn bounds(&self, body: u32, margin: f64) -> Bounds {
        let Some(cell) = self.cell_of(body) else {
            return self.blocks[body as usize].bounds(self.u, margin);
        };
        let [low, high] = bounds_of(&cell.vertices(self));
        [low.add_scalar(-margin), high.add_scalar(margin)]
    }
}
