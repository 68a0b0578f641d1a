//! Surface of a gas: facets between nodes, their present areas, and the enclosed volume.

use ddem_mesh::Vec3;

/// Surface of a gas, or of a separate part of it.
#[derive(Clone, Debug)]
pub struct GasSurface {
    /// Three corners of each facet, as indices into the nodes of the charge, and its weight.
    facets: Vec<([u32; 3], f64)>,
    /// Nodes of each wall; a wall is one face of a block.
    walls: Vec<Vec<u32>>,
    /// Enclosed volume at the start `[m³]`.
    pub volume: f64,
    /// Displacement of a wall, relative to the others, at which the gas vents `[m]`.
    pub venting_displacement: f64,
}

impl GasSurface {
    /// Surface of polygons. Their corners and the nodes of `walls` are indices into the nodes of a
    /// charge.
    pub fn new(
        polygons: impl Iterator<Item = Vec<u32>>,
        walls: Vec<Vec<u32>>,
        volume: f64,
        venting_displacement: f64,
    ) -> Self {
        let mut surface = Self { facets: Vec::new(), walls, volume, venting_displacement };
        polygons.for_each(|corners| surface.add(&corners));
        surface
    }

    /// Nodes of each wall, as indices into the nodes of the charge.
    pub(super) fn walls(&self) -> impl Iterator<Item = &[u32]> {
        self.walls.iter().map(Vec::as_slice)
    }

    /// Adds a polygon as the mean of its fans of triangles, so that all corners count equally.
    fn add(&mut self, corners: &[u32]) {
        let n = corners.len();
        let fans = if n == 3 { 1 } else { n };
        for first in 0..fans {
            let corner = |i: usize| corners[(first + i) % n];
            let fan = (1..n - 1).map(|i| [corner(0), corner(i), corner(i + 1)]);
            self.facets.extend(fan.map(|facet| (facet, 1.0 / fans as f64)));
        }
    }

    /// Volume enclosed by a closed surface `[m³]`, by the divergence theorem.
    pub fn enclosed(&self, x: &[Vec3]) -> f64 {
        let Some(([first, ..], _)) = self.facets.first() else { return 0.0 };
        let origin = x[*first as usize];
        let cone = |(facet, weight): &([u32; 3], f64)| {
            let [a, b, c] = facet.map(|node| x[node as usize] - origin);
            weight * a.dot(&b.cross(&c)) / 6.0
        };
        self.facets.iter().map(cone).sum()
    }

    /// Enclosed volume at displacements u `[m³]`: the initial volume plus the exact volume that the
    /// facets sweep on straight paths. For a closed surface the divergence theorem gives the same
    /// volume.
    pub(super) fn volume(&self, x: &[Vec3], u: &[Vec3]) -> f64 {
        let swept = |(facet, weight): &([u32; 3], f64)| {
            let [a, b, c] = facet.map(|node| x[node as usize]);
            let [p, q, r] = facet.map(|node| u[node as usize]);
            let ([e, f], [g, h]) = ([b - a, c - a], [q - p, r - p]);
            let area = e.cross(&f) + (e.cross(&h) + g.cross(&f)) / 2.0 + g.cross(&h) / 3.0;
            weight * (p + q + r).dot(&area) / 6.0
        };
        self.volume + self.facets.iter().map(swept).sum::<f64>()
    }

    /// Adds the present area vectors of the nodes, which point into the rock `[m²]`.
    pub(super) fn add_areas(&self, x: &[Vec3], u: &[Vec3], areas: &mut [Vec3]) {
        for (facet, weight) in &self.facets {
            let [a, b, c] = facet.map(|node| x[node as usize] + u[node as usize]);
            let share = (b - a).cross(&(c - a)) * (weight / 6.0);
            for node in facet {
                areas[*node as usize] += share;
            }
        }
    }

    /// True if the gas vents: the centre of a wall has moved by more than `venting_displacement`
    /// against the mean displacement of all walls. The motion of a single wall counts from its
    /// start.
    pub(super) fn is_open(&self, u: &[Vec3]) -> bool {
        let mean = |wall: &Vec<u32>| {
            wall.iter().map(|node| u[*node as usize]).sum::<Vec3>() / wall.len() as f64
        };
        let moved: Vec<Vec3> = self.walls.iter().map(mean).collect();
        let all = match moved.len() {
            0 | 1 => Vec3::zeros(),
            walls => moved.iter().sum::<Vec3>() / walls as f64,
        };
        moved.iter().any(|moved| (moved - all).norm() > self.venting_displacement)
    }
}
