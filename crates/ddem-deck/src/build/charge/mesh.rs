//! Surface of a gas under construction, as polygons of nodes.

use std::collections::{BTreeMap, BTreeSet};

use ddem_core::problem::GasSurface;
use ddem_core::problem::{BlockFace, Geometry, Vec3};

/// Surface under construction: polygons of nodes, oriented so that their normals point into the
/// rock.
#[derive(Debug, Default)]
pub(super) struct SurfaceBuilder {
    polygons: Vec<Vec<u32>>,
    /// Net number of times that each directed edge occurs in the polygons.
    edges: BTreeMap<(u32, u32), i32>,
    /// Nodes of each wall, which belongs to one block.
    walls: Vec<BTreeSet<u32>>,
}

impl SurfaceBuilder {
    pub(super) fn add(&mut self, polygon: Vec<u32>) {
        for (i, &a) in polygon.iter().enumerate() {
            let b = polygon[(i + 1) % polygon.len()];
            *self.edges.entry((a, b)).or_default() += 1;
            *self.edges.entry((b, a)).or_default() -= 1;
        }
        self.polygons.push(polygon);
    }

    /// Adds a polygon beside others. Its orientation makes it pass its first edge in the opposite
    /// direction of its neighbour.
    pub(super) fn add_beside(&mut self, mut polygon: Vec<u32>) {
        if self.edges.get(&(polygon[0], polygon[1])).is_some_and(|&count| count > 0) {
            polygon.reverse();
        }
        self.add(polygon);
    }

    /// Adds a whole face of a block.
    pub(super) fn add_wall(&mut self, geometry: &Geometry, face: &BlockFace) {
        let lattice = geometry.lattice(face.block);
        let d = face.direction();
        let (e, f) = ((d + 1) % 3, (d + 2) % 3);
        let topology = geometry.topology(face.block);
        let n = topology.divisions();
        let first = geometry.blocks[face.block].first_node;
        let outward = lattice.axes[e].cross(&lattice.axes[f]).dot(&face.outward(geometry)) > 0.0;
        let mut wall = BTreeSet::new();
        for (j, i) in (0..n).flat_map(|j| (0..n).map(move |i| (j, i))) {
            let quad = topology.quad(face.face, [i, j]);
            let mut quad = quad.map(|node| first + node as u32).to_vec();
            wall.extend(&quad);
            if outward {
                quad.reverse();
            }
            self.add(quad);
        }
        self.walls.push(wall);
    }

    /// Edges with a polygon on one side only.
    pub(super) fn rim(&self) -> impl Iterator<Item = (u32, u32)> + '_ {
        self.edges.iter().filter(|(_, count)| **count > 0).map(|(edge, _)| *edge)
    }

    pub(super) fn is_closed(&self) -> bool {
        self.rim().next().is_none()
    }

    pub(super) fn nodes(&self) -> impl Iterator<Item = u32> + '_ {
        self.polygons.iter().flatten().copied()
    }

    /// Gas surface of a charge whose sorted nodes are `nodes`, at the positions `start`. `volume`
    /// is used if the surface is not closed.
    pub(super) fn gas_surface(
        &self,
        nodes: &[u32],
        start: &[Vec3],
        (volume, venting_displacement): (f64, f64),
    ) -> GasSurface {
        // `nodes` contains every node of the surface.
        let local = |node: &u32| nodes.partition_point(|before| before < node) as u32;
        let polygons = self.polygons.iter().map(|corners| corners.iter().map(local).collect());
        let wall = |wall: &BTreeSet<u32>| wall.iter().map(local).collect();
        let walls = self.walls.iter().map(wall).collect();
        let mut surface = GasSurface::new(polygons, walls, volume, venting_displacement);
        if self.is_closed() {
            surface.volume = surface.enclosed(start);
        }
        surface
    }
}
