//! The surface of a gas: facets between nodes, their present areas, and the volume within.

use std::collections::{BTreeMap, BTreeSet};

use crate::geometry::{Geometry, Surface, Vec3};

/// A surface being built: polygons of nodes, each turned so that its normal points into the rock.
#[derive(Debug, Default)]
pub(super) struct Mesh {
    polygons: Vec<Vec<u32>>,
    /// How often each directed edge goes round a polygon, less how often its reverse does.
    edges: BTreeMap<(u32, u32), i32>,
    /// Nodes of each wall, which belongs to one block.
    walls: Vec<BTreeSet<u32>>,
}

impl Mesh {
    pub(super) fn add(&mut self, polygon: Vec<u32>) {
        for (i, &a) in polygon.iter().enumerate() {
            let b = polygon[(i + 1) % polygon.len()];
            *self.edges.entry((a, b)).or_default() += 1;
            *self.edges.entry((b, a)).or_default() -= 1;
        }
        self.polygons.push(polygon);
    }

    /// A polygon beside others: turned so that it goes along its first edge against its neighbour.
    pub(super) fn add_beside(&mut self, mut polygon: Vec<u32>) {
        if self.edges.get(&(polygon[0], polygon[1])).is_some_and(|&count| count > 0) {
            polygon.reverse();
        }
        self.add(polygon);
    }

    /// All of a face of a block.
    pub(super) fn add_wall(&mut self, geometry: &Geometry, surface: &Surface) {
        let Surface { body, normal, side } = *surface;
        let lattice = geometry.lattice(body);
        let (e, f) = ((normal + 1) % 3, (normal + 2) % 3);
        let n = lattice.divisions;
        let outward = lattice.axes[e].cross(&lattice.axes[f]).dot(&surface.outward(geometry)) > 0.0;
        let node = |i: usize, j: usize| {
            let mut at = [0; 3];
            at[normal] = if side < 0 { 0 } else { n };
            (at[e], at[f]) = (i, j);
            geometry.node(body, at) as u32
        };
        let mut wall = BTreeSet::new();
        for (j, i) in (0..n).flat_map(|j| (0..n).map(move |i| (j, i))) {
            let mut quad = vec![node(i, j), node(i + 1, j), node(i + 1, j + 1), node(i, j + 1)];
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

    /// As part of a charge whose nodes are these, in order, at these places. `volume` is that of what
    /// is not closed.
    pub(super) fn shell(
        &self,
        nodes: &[u32],
        start: &[Vec3],
        (volume, reach): (f64, f64),
    ) -> Shell {
        // Every node is one of them.
        let local = |node: &u32| nodes.binary_search(node).unwrap_or(0) as u32;
        let mut shell = Shell { facets: Vec::new(), walls: Vec::new(), volume, reach };
        for polygon in &self.polygons {
            let corners: Vec<u32> = polygon.iter().map(local).collect();
            shell.add(&corners);
        }
        let wall = |wall: &BTreeSet<u32>| wall.iter().map(local).collect();
        shell.walls = self.walls.iter().map(wall).collect();
        if self.is_closed() {
            shell.volume = shell.enclosed(start);
        }
        shell
    }
}

/// The surface of a gas, or of a part of it that is apart from the others.
#[derive(Clone, Debug)]
pub(crate) struct Shell {
    /// Three corners each, as places in the nodes of the charge, and what part of it counts.
    facets: Vec<([u32; 3], f64)>,
    /// Nodes of the faces of blocks that it has.
    walls: Vec<Vec<u32>>,
    /// Volume within it at the start `[m³]`.
    pub(crate) volume: f64,
    /// How far a wall may go from the others before the gas gets out `[m]`.
    pub(super) reach: f64,
}

impl Shell {
    /// Nodes of the faces of blocks that it has, as places in the nodes of the charge.
    pub(super) fn walls(&self) -> impl Iterator<Item = &[u32]> {
        self.walls.iter().map(Vec::as_slice)
    }

    /// A polygon as the mean of its fans of triangles: every corner counts alike.
    fn add(&mut self, corners: &[u32]) {
        let n = corners.len();
        let fans = if n == 3 { 1 } else { n };
        for first in 0..fans {
            let corner = |i: usize| corners[(first + i) % n];
            let fan = (1..n - 1).map(|i| [corner(0), corner(i), corner(i + 1)]);
            self.facets.extend(fan.map(|facet| (facet, 1.0 / fans as f64)));
        }
    }

    /// Volume within a closed surface, by the divergence theorem.
    fn enclosed(&self, x: &[Vec3]) -> f64 {
        let Some(([first, ..], _)) = self.facets.first() else { return 0.0 };
        let origin = x[*first as usize];
        let cone = |(facet, part): &([u32; 3], f64)| {
            let [a, b, c] = facet.map(|node| x[node as usize] - origin);
            part * a.dot(&b.cross(&c)) / 6.0
        };
        self.facets.iter().map(cone).sum()
    }

    /// Volume within it after these displacements: what facets sweep on straight ways is added to that
    /// at the start, exactly; of a closed surface it is what the divergence theorem gives.
    pub(super) fn volume(&self, x: &[Vec3], u: &[Vec3]) -> f64 {
        let swept = |(facet, part): &([u32; 3], f64)| {
            let [a, b, c] = facet.map(|node| x[node as usize]);
            let [p, q, r] = facet.map(|node| u[node as usize]);
            let ([e, f], [g, h]) = ([b - a, c - a], [q - p, r - p]);
            let area = e.cross(&f) + (e.cross(&h) + g.cross(&f)) / 2.0 + g.cross(&h) / 3.0;
            part * (p + q + r).dot(&area) / 6.0
        };
        self.volume + self.facets.iter().map(swept).sum::<f64>()
    }

    /// Adds the present areas that belong to the nodes, as vectors into the rock `[m²]`.
    pub(super) fn add_areas(&self, x: &[Vec3], u: &[Vec3], areas: &mut [Vec3]) {
        for (facet, part) in &self.facets {
            let [a, b, c] = facet.map(|node| x[node as usize] + u[node as usize]);
            let share = (b - a).cross(&(c - a)) * (part / 6.0);
            for node in facet {
                areas[*node as usize] += share;
            }
        }
    }

    /// Whether the centre of a wall has moved so far from where the walls have gone on average that
    /// the gas gets out; of a single wall, from its own start.
    pub(super) fn is_open(&self, u: &[Vec3]) -> bool {
        let mean = |wall: &Vec<u32>| {
            wall.iter().map(|node| u[*node as usize]).sum::<Vec3>() / wall.len() as f64
        };
        let moved: Vec<Vec3> = self.walls.iter().map(mean).collect();
        let all = match moved.len() {
            0 | 1 => Vec3::zeros(),
            walls => moved.iter().sum::<Vec3>() / walls as f64,
        };
        moved.iter().any(|moved| (moved - all).norm() > self.reach)
    }
}
