//! Faces of a polyhedron made whole: triangles in one plane are one face.

use std::collections::HashMap;

use nalgebra::Vector3;

use crate::polyhedron::Polyhedron;

/// Cosine of the largest angle between the normals of two parts of a face: the distance of their corners
/// from its plane decides.
const PARALLEL: f64 = 0.9;

impl Polyhedron {
    /// Same polyhedron with faces that touch in one plane made one, and without corners in the middle
    /// of an edge. Points within the distance `same` of a plane lie in it `[m]`.
    ///
    /// A polyhedron whose parts of a face have no simple outline stays as it is.
    #[must_use]
    pub fn with_whole_faces(self, same: f64) -> Self {
        let groups = self.groups(same);
        let n = groups.iter().max().map_or(0, |last| last + 1);
        let outlines: Option<Vec<_>> = (0..n).map(|group| self.outline(&groups, group)).collect();
        let Some(mut outlines) = outlines else { return self };
        drop_middles(&mut outlines);
        if outlines.iter().any(|outline| outline.len() < 3) {
            return self;
        }
        let mut numbers = HashMap::new();
        let mut points = Vec::new();
        let mut number = |corner: usize| {
            *numbers.entry(corner).or_insert_with(|| {
                points.push(self.points[corner]);
                points.len() - 1
            })
        };
        let faces =
            outlines.into_iter().map(|outline| outline.into_iter().map(&mut number).collect());
        let faces = faces.collect();
        Self { points, faces }
    }

    /// Number of the whole face of each face. The largest part gives its plane.
    fn groups(&self, same: f64) -> Vec<usize> {
        let mut beside: HashMap<(usize, usize), Vec<usize>> = HashMap::new();
        for (face, corners) in self.faces.iter().enumerate() {
            for edge in edges(corners) {
                beside.entry(edge).or_default().push(face);
            }
        }
        let areas: Vec<Vector3<f64>> = (0..self.faces.len()).map(|face| self.area(face)).collect();
        let mut order: Vec<usize> = (0..areas.len()).collect();
        order.sort_by(|&a, &b| areas[b].norm().total_cmp(&areas[a].norm()).then(a.cmp(&b)));
        let far = self.points.iter().map(|x| (x - self.points[0]).norm()).fold(0.0, f64::max);
        let (mut groups, mut n) = (vec![usize::MAX; areas.len()], 0);
        for first in order {
            if groups[first] != usize::MAX {
                continue;
            }
            let normal = areas[first] / areas[first].norm();
            let offset = normal.dot(&self.points[self.faces[first][0]]);
            let lies_in = |face: usize| {
                // A triangle without area has no normal of its own.
                let flat = areas[face].norm() <= same * far;
                (flat || normal.dot(&areas[face]) >= PARALLEL * areas[face].norm())
                    && self.faces[face]
                        .iter()
                        .all(|&corner| (normal.dot(&self.points[corner]) - offset).abs() <= same)
            };
            groups[first] = n;
            let mut open = vec![first];
            while let Some(face) = open.pop() {
                for (a, b) in edges(&self.faces[face]) {
                    for &other in beside.get(&(b, a)).into_iter().flatten() {
                        if groups[other] == usize::MAX && lies_in(other) {
                            groups[other] = n;
                            open.push(other);
                        }
                    }
                }
            }
            n += 1;
        }
        groups
    }

    /// Corners around a whole face; `None` if its outline is not one loop.
    fn outline(&self, groups: &[usize], group: usize) -> Option<Vec<usize>> {
        let mut inner = HashMap::new();
        for (face, corners) in
            self.faces.iter().enumerate().filter(|(face, _)| groups[*face] == group)
        {
            for edge in edges(corners) {
                inner.insert(edge, face);
            }
        }
        let mut next = HashMap::new();
        for &(a, b) in inner.keys().filter(|(a, b)| !inner.contains_key(&(*b, *a))) {
            if next.insert(a, b).is_some() {
                return None;
            }
        }
        let first = *next.keys().min()?;
        let mut outline = vec![first];
        let mut at = next[&first];
        while at != first {
            outline.push(at);
            at = *next.get(&at)?;
            if outline.len() > next.len() {
                return None;
            }
        }
        (outline.len() == next.len()).then_some(outline)
    }
}

/// Drops corners that only two faces have: they lie in the middle of an edge.
fn drop_middles(outlines: &mut [Vec<usize>]) {
    let mut uses: HashMap<usize, usize> = HashMap::new();
    for &corner in outlines.iter().flatten() {
        *uses.entry(corner).or_default() += 1;
    }
    for outline in outlines {
        outline.retain(|corner| uses[corner] > 2);
    }
}

/// Directed edges around a face.
fn edges(corners: &[usize]) -> impl Iterator<Item = (usize, usize)> {
    (0..corners.len()).map(move |i| (corners[i], corners[(i + 1) % corners.len()]))
}
