//! Conforming joints between two blocks.

use super::Geometry;
use ddem_mechanics::collide::FaceId;

/// Joint between two blocks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConformingJoint {
    /// Block on side a.
    pub a: u32,
    /// Block on side b; the normal points to it.
    pub b: u32,
    /// Number of the joint's properties, in sorted order of the names.
    pub joint: u16,
    /// Direction of the lattice that the joint cuts: 0, 1 or 2.
    pub direction: u8,
    /// Elements along its two edges; it has `(divisions + 1)²` pairs.
    pub divisions: u16,
    /// Number of its first pair.
    pub first_pair: u32,
}

impl ConformingJoint {
    /// Number of the joint's properties in a geometry.
    pub fn at(&self, geometry: &Geometry) -> u16 {
        geometry.joint_above(self.a as usize, self.direction.into())
    }

    /// Number after that of its last pair.
    pub fn end(&self) -> usize {
        self.first_pair as usize + (self.divisions as usize + 1).pow(2)
    }
}

/// All joints, by block a and direction.
pub fn faces(geometry: &Geometry) -> Vec<ConformingJoint> {
    let mut faces = Vec::new();
    let mut first_pair = 0;
    for a in 0..geometry.blocks.len() {
        for direction in 0..3 {
            let Some(b) = geometry.above(a, direction) else { continue };
            let n = geometry.topology(a).divisions();
            // Nodes have numbers of 32 bits, so that no block has more divisions.
            debug_assert!(n <= usize::from(u16::MAX));
            faces.push(ConformingJoint {
                a: a as u32,
                b: b as u32,
                joint: geometry.joint_above(a, direction),
                direction: direction as u8,
                divisions: n as u16,
                first_pair,
            });
            first_pair += ((n + 1) * (n + 1)) as u32;
        }
    }
    faces
}

impl ConformingJoint {
    /// Lattice steps in block a of the pairs in order. The first edge after the normal's direction,
    /// cyclically, runs fastest.
    fn steps(&self) -> impl Iterator<Item = [usize; 3]> + use<> {
        let (n, d) = (self.divisions as usize, self.direction as usize);
        (0..=n).flat_map(move |k| {
            (0..=n).map(move |i| {
                let mut at = [0; 3];
                at[(d + 1) % 3] = i;
                at[(d + 2) % 3] = k;
                at
            })
        })
    }

    /// Nodes on sides a and b of each pair, in order.
    pub fn pairs<'a>(&self, geometry: &'a Geometry) -> impl Iterator<Item = [u32; 2]> + use<'a> {
        let (face, n) = (*self, self.divisions as usize);
        self.steps().map(move |at| {
            let (mut on_a, mut on_b) = (at, at);
            on_a[face.direction as usize] = n;
            on_b[face.direction as usize] = 0;
            [
                geometry.node(face.a as usize, on_a) as u32,
                geometry.node(face.b as usize, on_b) as u32,
            ]
        })
    }

    /// Pairs at the corners of each joint element, around it.
    pub fn quads(&self) -> impl Iterator<Item = [u32; 4]> + use<> {
        let (n, first) = (u32::from(self.divisions), self.first_pair);
        (0..n).flat_map(move |k| {
            (0..n).map(move |i| {
                let at = |i: u32, k: u32| first + i + (n + 1) * k;
                [at(i, k), at(i + 1, k), at(i + 1, k + 1), at(i, k + 1)]
            })
        })
    }

    /// Unit normal, from a to b, in the reference position.
    #[must_use]
    pub fn normal(&self, geometry: &Geometry) -> [f64; 3] {
        geometry.lattice(self.a as usize).normal(self.direction as usize).into()
    }

    /// Area `A_p` of each pair `[m²]`: a quarter of each joint element that it belongs to.
    pub fn areas(&self, geometry: &Geometry) -> impl Iterator<Item = f64> + use<> {
        let (a, face) = (self.a as usize, FaceId { direction: self.direction.into(), upper: true });
        let (quarter, topology) = (geometry.joint_quarter(a, face.direction), geometry.topology(a));
        self.steps().map(move |at| quarter * topology.quads_at(face, at) as f64)
    }
}
