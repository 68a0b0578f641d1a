//! Joints between two blocks.

use super::Geometry;

/// One joint between two blocks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Face {
    /// The block on side a.
    pub a: u32,
    /// The block on side b; the normal points to it.
    pub b: u32,
    /// Number of the joint's properties, in sorted order of the names.
    pub joint: u16,
    /// Direction of the lattice that the joint cuts: 0, 1, 2.
    pub direction: u8,
    /// Elements along its two edges; it has `(divisions + 1)²` pairs.
    pub divisions: u16,
    /// Number of its first pair.
    pub first_pair: u32,
}

impl Face {
    /// The joint that is there.
    pub fn at(&self, geometry: &Geometry) -> u16 {
        let cell = geometry.bodies[self.a as usize].cell.map(|c| c as usize);
        geometry.lattice(self.a as usize).joint_above(cell, self.direction.into())
    }

    /// One more than the number of its last pair.
    pub fn end(&self) -> usize {
        self.first_pair as usize + (self.divisions as usize + 1).pow(2)
    }
}

/// All joints, by block a and direction.
pub fn faces(geometry: &Geometry) -> Vec<Face> {
    let mut faces = Vec::new();
    let mut first_pair = 0;
    for a in 0..geometry.bodies.len() {
        let lattice = geometry.lattice(a);
        let cell = geometry.bodies[a].cell.map(|c| c as usize);
        for direction in 0..3 {
            let mut offset = [0; 3];
            offset[direction] = 1;
            let Some(b) = geometry.neighbour(a, offset) else { continue };
            let n = lattice.divisions;
            faces.push(Face {
                a: a as u32,
                b: b as u32,
                joint: lattice.joint_above(cell, direction),
                direction: direction as u8,
                divisions: n as u16,
                first_pair,
            });
            first_pair += ((n + 1) * (n + 1)) as u32;
        }
    }
    faces
}
