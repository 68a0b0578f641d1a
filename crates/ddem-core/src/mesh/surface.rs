//! Faces of bodies.

use super::{Geometry, Vec3};

/// A node of a surface, the sine of the angle between its edges, and the node's lengths along the two
/// edges after the normal, towards their lower and upper ends `[m]`.
pub type Strip = (u32, f64, [[f64; 2]; 2]);

/// An outer face of a body: at the lower (−1) or upper (+1) side of edge `normal`.
#[derive(Clone, Copy, Debug)]
pub struct Surface {
    /// Number of the block.
    pub body: usize,
    /// Edge across the face.
    pub normal: usize,
    /// −1 at the lower end of that edge, +1 at the upper one.
    pub side: i32,
}

impl Surface {
    /// Lattice steps of its four corners.
    pub fn corners(&self, geometry: &Geometry) -> [[usize; 3]; 4] {
        let n = geometry.lattice(self.body).divisions;
        [(0, 0), (n, 0), (0, n), (n, n)].map(|(i, k)| {
            let mut at = [0; 3];
            at[self.normal] = if self.side < 0 { 0 } else { n };
            at[(self.normal + 1) % 3] = i;
            at[(self.normal + 2) % 3] = k;
            at
        })
    }

    /// Centre of the face `[m]`.
    pub fn centre(&self, geometry: &Geometry) -> Vec3 {
        let corners = self.corners(geometry).map(|at| geometry.position(self.body, at));
        corners.iter().sum::<Vec3>() / 4.0
    }

    /// Area of the face `[m²]`.
    pub fn area(&self, geometry: &Geometry) -> f64 {
        let [a, b, c, _] = self.corners(geometry).map(|at| geometry.position(self.body, at));
        (b - a).cross(&(c - a)).norm()
    }

    /// Corners, moved across the gaps beside the face, over which its nodes have areas too.
    pub fn reach(&self, geometry: &Geometry) -> [Vec3; 4] {
        self.corners(geometry).map(|at| {
            let x = geometry.position(self.body, at);
            let beside = (0..3).filter(|&d| d != self.normal).filter_map(|d| {
                let (other, step) = geometry.partner(self.body, at, d)?;
                Some(geometry.position(other, step) - x)
            });
            x + beside.sum::<Vec3>()
        })
    }

    /// True where no block and no joint is on the other side.
    pub fn is_outer(&self, geometry: &Geometry) -> bool {
        let mut offset = [0; 3];
        offset[self.normal] = self.side;
        let face = 2 * self.normal as u8 + u8::from(self.side > 0);
        geometry.neighbour(self.body, offset).is_none()
            && !geometry.abutting.contains_key(&(self.body as u32, face))
    }

    /// Outward unit normal.
    pub fn outward(&self, geometry: &Geometry) -> Vec3 {
        geometry.lattice(self.body).normal(self.normal) * f64::from(self.side)
    }
}
