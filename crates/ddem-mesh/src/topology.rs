//! Numbering of the nodes, elements and faces of a block.

use std::ops::RangeInclusive;

use ddem_mechanics::collide::FaceId;

/// Numbering of nodes, elements and faces, shared by blocks with equal divisions. Elements are
/// hexahedra in rows along three edges. Steps count along the edges; the first edge runs fastest in
/// all numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Topology {
    divisions: usize,
}

impl Topology {
    /// Numbering of a block with a number of elements along each edge.
    #[inline]
    #[must_use]
    pub fn lattice(divisions: usize) -> Self {
        Self { divisions }
    }

    /// Elements along each edge.
    #[inline]
    #[must_use]
    pub fn divisions(self) -> usize {
        self.divisions
    }

    /// Number of nodes.
    #[inline]
    #[must_use]
    pub fn nodes(self) -> usize {
        (self.divisions + 1).pow(3)
    }

    /// Number of elements.
    #[inline]
    #[must_use]
    pub fn elements(self) -> usize {
        self.divisions.pow(3)
    }

    /// Number of the node at the given steps.
    #[inline]
    #[must_use]
    pub fn node(self, at: [usize; 3]) -> usize {
        let n = self.divisions + 1;
        at[0] + n * (at[1] + n * at[2])
    }

    /// Steps of a node along the edges.
    #[inline]
    #[must_use]
    pub fn steps(self, node: usize) -> [usize; 3] {
        let n = self.divisions + 1;
        [node % n, node / n % n, node / (n * n)]
    }

    /// Number of the element at the given steps.
    #[inline]
    #[must_use]
    pub fn element(self, at: [usize; 3]) -> usize {
        let n = self.divisions;
        at[0] + n * (at[1] + n * at[2])
    }

    /// Steps of an element along the edges.
    #[inline]
    #[must_use]
    pub fn element_steps(self, element: usize) -> [usize; 3] {
        let n = self.divisions;
        [element % n, element / n % n, element / (n * n)]
    }

    /// Nodes of an element in VTK order.
    #[inline]
    #[must_use]
    pub fn hex(self, element: usize) -> [usize; 8] {
        let [i, j, k] = self.element_steps(element);
        let corners = [[0, 0], [1, 0], [1, 1], [0, 1]];
        std::array::from_fn(|a| {
            let [x, y] = corners[a % 4];
            self.node([i + x, j + y, k + a / 4])
        })
    }

    /// Elements that contain a node.
    #[inline]
    pub fn elements_at(self, node: usize) -> impl Iterator<Item = usize> {
        let at = self.steps(node);
        (0..8).filter_map(move |corner| {
            let lower =
                |d: usize| at[d].checked_sub(corner >> d & 1).filter(|&i| i < self.divisions);
            Some(self.element([lower(0)?, lower(1)?, lower(2)?]))
        })
    }

    /// Steps of the corners of the block, numbered by bits.
    #[inline]
    #[must_use]
    pub fn corners(self) -> [[usize; 3]; 8] {
        let n = self.divisions;
        std::array::from_fn(|k| [(k & 1) * n, (k >> 1 & 1) * n, (k >> 2) * n])
    }

    /// Steps of a node of a face, from its steps along the next two directions.
    #[inline]
    #[must_use]
    pub fn on_face(self, face: FaceId, [i, k]: [usize; 2]) -> [usize; 3] {
        let d = face.direction;
        let mut at = [0; 3];
        at[d] = if face.upper { self.divisions } else { 0 };
        (at[(d + 1) % 3], at[(d + 2) % 3]) = (i, k);
        at
    }

    /// Nodes around an element of a face, from its steps along the next two directions.
    #[inline(always)]
    #[must_use]
    pub fn quad(self, face: FaceId, [i, k]: [usize; 2]) -> [usize; 4] {
        let n = self.divisions;
        let strides = [1, n + 1, (n + 1) * (n + 1)];
        let d = face.direction;
        let [next, last] = [strides[(d + 1) % 3], strides[(d + 2) % 3]];
        let first = if face.upper { n * strides[d] } else { 0 } + i * next + k * last;
        [first, first + next, first + next + last, first + last]
    }

    /// True if the node at the given steps lies on a face.
    #[inline]
    #[must_use]
    pub fn is_on(self, face: FaceId, at: [usize; 3]) -> bool {
        at[face.direction] == if face.upper { self.divisions } else { 0 }
    }

    /// Number of elements of a face that contain one of its nodes, given by its steps.
    #[inline]
    #[must_use]
    pub fn quads_at(self, face: FaceId, at: [usize; 3]) -> usize {
        let inner = |&e: &usize| e != face.direction && at[e] > 0 && at[e] < self.divisions;
        1 << (0..3).filter(inner).count()
    }

    /// Steps along each edge.
    #[inline]
    #[must_use]
    pub fn lines(self) -> RangeInclusive<usize> {
        0..=self.divisions
    }
}
