//! Cells of regions before they are cut.

use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

use nalgebra::Vector3;

use crate::cell::{CellFace, ConvexCell};
use crate::complex::{CellComplex, MOST_CELLS, ON_PLANE, bounds};
use crate::coplanar;
use crate::measure;
use crate::polyhedron::Polyhedron;
use crate::tree::CellTree;

/// Convex parts of a region.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RegionParts {
    /// Parts, which may share faces but no rock.
    pub parts: Vec<Polyhedron>,
    /// Joints between the parts; without them they are one block.
    pub jointed: bool,
    /// Distance within which faces of parts lie in one plane `[m]`; `None` if parts have whole faces in
    /// common.
    pub coplanar: Option<f64>,
}

impl From<Vec<Polyhedron>> for RegionParts {
    fn from(parts: Vec<Polyhedron>) -> Self {
        Self { parts, jointed: false, coplanar: None }
    }
}

/// Faces and points of a complex that is being made.
#[derive(Default)]
struct KnownParts {
    /// Numbers of the points, by their bits.
    points: HashMap<[u64; 3], u32>,
    /// Planes and regions, by the corners of their faces.
    sides: HashMap<Vec<u32>, (u32, u32)>,
}

impl CellComplex {
    /// Cells of regions, each of which is a list of convex parts. Parts of one region that share a
    /// face are joined there.
    #[must_use]
    pub fn new(regions: &[Vec<Polyhedron>]) -> Self {
        let regions: Vec<RegionParts> = regions.iter().cloned().map(Into::into).collect();
        Self::of_regions(&regions)
    }

    /// Cells of regions.
    #[must_use]
    pub fn of_regions(regions: &[RegionParts]) -> Self {
        let parts = || regions.iter().flat_map(|region| &region.parts);
        let all = || parts().flat_map(|part| part.points.iter());
        let far = Vector3::repeat(f64::INFINITY);
        let (low, high) = all().fold((far, -far), |(low, high), x| (low.inf(x), high.sup(x)));
        let diagonal = if low <= high { (high - low).norm() } else { 0.0 };
        let mut complex = Self {
            points: Vec::new(),
            planes: Vec::new(),
            cells: Vec::new(),
            tree: CellTree::default(),
            tolerance: ON_PLANE * diagonal,
            most: MOST_CELLS,
            counter: Arc::default(),
            n_uncut: 0,
            fractures: BTreeMap::new(),
        };
        let mut known = KnownParts::default();
        for (number, region) in regions.iter().enumerate() {
            let first = complex.cells.len();
            for part in &region.parts {
                complex.add(part, number as u32, !region.jointed, &mut known);
            }
            if let Some(distance) = region.coplanar {
                let distance = distance.max(complex.tolerance);
                coplanar::unite(&mut complex, first, distance, !region.jointed);
            }
        }
        if regions.len() > 1 {
            let distance = complex.tolerance;
            coplanar::unite(&mut complex, 0, distance, false);
        }
        complex
    }

    /// Adds a part of a region, joined to others at faces that they share or not.
    fn add(&mut self, part: &Polyhedron, region: u32, joined: bool, known: &mut KnownParts) {
        let points = &mut self.points;
        let mut number = |x: &Vector3<f64>| {
            // Adding zero turns −0 into 0.
            let bits = [x.x, x.y, x.z].map(|part| (part + 0.0).to_bits());
            *known.points.entry(bits).or_insert_with(|| {
                points.push(*x);
                points.len() as u32 - 1
            })
        };
        let numbers: Vec<u32> = part.points.iter().map(&mut number).collect();
        let mut faces = Vec::with_capacity(part.faces.len());
        for corners in &part.faces {
            let corners = corners.iter().map(|&corner| numbers[corner]).collect();
            let mut face = CellFace { plane: self.planes.len() as u32, corners };
            match known.sides.get(&face.sorted_corners()) {
                Some(&(plane, other)) => {
                    face.plane = plane;
                    self.planes[plane as usize].joined = joined && other == region;
                }
                None => {
                    known.sides.insert(face.sorted_corners(), (face.plane, region));
                    self.planes.push(measure::plane_of(&face, &self.points));
                }
            }
            faces.push(face);
        }
        let cell = ConvexCell { faces, region };
        self.tree.add_root(self.cells.len() as u32, bounds(&self.points, &cell.faces));
        self.cells.push(cell);
    }

    /// Polyhedron of a cell.
    #[must_use]
    pub fn polyhedron(&self, cell: usize) -> Polyhedron {
        let cell = &self.cells[cell];
        let vertices = cell.vertices();
        let local = |corner: &u32| vertices.binary_search(corner).unwrap_or_default();
        Polyhedron {
            points: vertices.iter().map(|&vertex| self.points[vertex as usize]).collect(),
            faces: cell.faces.iter().map(|face| face.corners.iter().map(local).collect()).collect(),
        }
    }
}
