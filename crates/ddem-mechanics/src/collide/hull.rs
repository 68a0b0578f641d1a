//! Distance of two convex polyhedra, its direction and the features in contact, by separating axes.
//!
//! The axes are the normals of all faces, and the products of those edges that lie opposite each
//! other: two edges give a face of the Minkowski difference only if their product points between
//! the normals beside each of them.

use nalgebra::Vector3;

use super::separation::{EQUAL, NEAR_FACE, PARALLEL};

/// Edge of a convex polyhedron.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HullEdge {
    /// Numbers of its vertices.
    pub ends: [u32; 2],
    /// Faces beside it. The first one has the edge in this direction around it, the second in the
    /// opposite direction.
    pub faces: [u32; 2],
}

/// Faces and edges of a convex polyhedron, by the numbers of its vertices.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct HullTopology {
    /// Vertices around each face, counter-clockwise from outside.
    pub faces: Vec<Vec<u32>>,
    /// Edges.
    pub edges: Vec<HullEdge>,
}

impl HullTopology {
    /// Topology of a polyhedron with these vertices around each face, counter-clockwise from outside;
    /// `None` if an edge does not lie between two faces.
    #[must_use]
    pub fn new(faces: Vec<Vec<u32>>) -> Option<Self> {
        let edges_of = |face: &Vec<u32>| {
            (0..face.len()).map(|k| [face[k], face[(k + 1) % face.len()]]).collect()
        };
        let sides: Vec<Vec<[u32; 2]>> = faces.iter().map(edges_of).collect();
        let mut edges = Vec::new();
        for (face, own) in sides.iter().enumerate() {
            for &[from, to] in own.iter().filter(|[from, to]| from < to) {
                let other = sides.iter().position(|other| other.contains(&[to, from]))?;
                edges.push(HullEdge { ends: [from, to], faces: [face as u32, other as u32] });
            }
        }
        Some(Self { faces, edges })
    }
}

/// Convex polyhedron.
#[derive(Clone, Copy, Debug)]
pub struct ConvexHull<'a> {
    /// Faces and edges.
    pub topology: &'a HullTopology,
    /// Positions of the vertices `[m]`.
    pub points: &'a [Vector3<f64>],
}

/// Features of two polyhedra in contact.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HullFeature {
    /// A face of one polyhedron against any feature of the other.
    Face {
        /// Polyhedron that owns the face: 0 is a, 1 is b.
        of: usize,
        /// Face of that polyhedron towards the other one.
        face: usize,
        /// Face of the other polyhedron that points most against it, at its deepest vertex.
        other: usize,
    },
    /// An edge of a and an edge of b that cross.
    Edges([usize; 2]),
}

/// Separation of two polyhedra.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HullSeparation {
    /// Distance along the normal, negative where they overlap `[m]`.
    pub distance: f64,
    /// Distance minus the largest distance along face normals in other directions `[m]`.
    pub margin: f64,
    /// Unit vector from a to b.
    pub normal: Vector3<f64>,
    /// Features in contact.
    pub feature: HullFeature,
}

/// Polyhedron with the directions that its axes need.
struct HullAxes<'a> {
    points: &'a [Vector3<f64>],
    topology: &'a HullTopology,
    /// Outward unit normals; zero for faces without area.
    normals: Vec<Vector3<f64>>,
    /// Vector along each edge, and directions from it into the two faces beside it.
    edges: Vec<[Vector3<f64>; 3]>,
    size: f64,
}

impl<'a> HullAxes<'a> {
    fn new(ConvexHull { topology, points }: ConvexHull<'a>) -> Self {
        let at = |vertex: u32| points[vertex as usize];
        let normal = |face: &Vec<u32>| {
            let start = face.first().map_or_else(Vector3::zeros, |&vertex| at(vertex));
            let pairs = face.windows(2).map(|pair| (at(pair[0]) - start, at(pair[1]) - start));
            let area: Vector3<f64> = pairs.map(|(a, b)| a.cross(&b)).sum();
            area.try_normalize(0.0).unwrap_or_default()
        };
        let mut normals: Vec<Vector3<f64>> = topology.faces.iter().map(normal).collect();
        let edge = |edge: &HullEdge| {
            let along = at(edge.ends[1]) - at(edge.ends[0]);
            let [a, b] = edge.faces.map(|face| normals[face as usize]);
            [along, a.cross(&along), -b.cross(&along)]
        };
        let edges = topology.edges.iter().map(edge).collect();
        let first = points.first().copied().unwrap_or_default();
        // Blocks may be mirrored: then the faces have the opposite order.
        let out = |(normal, face): (&Vector3<f64>, &Vec<u32>)| {
            face.first().map_or(0.0, |&vertex| normal.dot(&(at(vertex) - first)))
        };
        if normals.iter().zip(&topology.faces).map(out).sum::<f64>() < 0.0 {
            normals.iter_mut().for_each(|normal| *normal = -*normal);
        }
        let size = points.iter().map(|x| (x - first).norm()).fold(0.0, f64::max);
        Self { points, topology, normals, edges, size }
    }

    /// Largest coordinate of a face's vertices along an axis `[m]`.
    fn top(&self, face: usize, axis: &Vector3<f64>) -> f64 {
        let vertices = self.topology.faces[face].iter();
        vertices.map(|&v| self.points[v as usize].dot(axis)).fold(f64::NEG_INFINITY, f64::max)
    }

    /// Least coordinate of all vertices along an axis `[m]`, and the first vertex that has it.
    fn bottom(&self, axis: &Vector3<f64>) -> (f64, u32) {
        let mut least = (f64::INFINITY, 0);
        for (vertex, x) in self.points.iter().enumerate() {
            let along = x.dot(axis);
            if along < least.0 {
                least = (along, vertex as u32);
            }
        }
        least
    }

    /// Face at the deepest vertex along an axis that points most against the axis.
    fn against(&self, axis: &Vector3<f64>) -> usize {
        let (_, deepest) = self.bottom(axis);
        let (mut most, mut found) = (f64::NEG_INFINITY, 0);
        for (face, vertices) in self.topology.faces.iter().enumerate() {
            let cosine = -self.normals[face].dot(axis);
            if vertices.contains(&deepest) && cosine > most + EQUAL {
                (most, found) = (cosine, face);
            }
        }
        found
    }
}

/// Axis of a face.
struct FaceAxis {
    distance: f64,
    /// Unit vector from a to b.
    normal: Vector3<f64>,
    of: usize,
    face: usize,
}

/// Axis of largest distance among face normals and products of edges of two polyhedra. If they do
/// not overlap its distance is a lower bound of the true one.
pub fn hull_separation(a: ConvexHull<'_>, b: ConvexHull<'_>) -> HullSeparation {
    let both = [HullAxes::new(a), HullAxes::new(b)];
    let equal = EQUAL * (both[0].size + both[1].size);
    let mut axes = Vec::with_capacity(both[0].normals.len() + both[1].normals.len());
    for of in 0..2 {
        let (own, other) = (&both[of], &both[1 - of]);
        for (face, outward) in own.normals.iter().enumerate() {
            if *outward == Vector3::zeros() {
                continue;
            }
            let distance = other.bottom(outward).0 - own.top(face, outward);
            let normal = if of == 0 { *outward } else { -outward };
            axes.push(FaceAxis { distance, normal, of, face });
        }
    }
    let mut best: Option<&FaceAxis> = None;
    for axis in &axes {
        if best.is_none_or(|best| axis.distance > best.distance + equal) {
            best = Some(axis);
        }
    }
    let Some(best) = best else { return shapeless(&a, &b) };
    // Largest distance along normals in other directions than a given one.
    let second = |normal: &Vector3<f64>| {
        let others = axes.iter().filter(|axis| axis.normal.dot(normal).abs() < NEAR_FACE);
        others.map(|axis| axis.distance).fold(f64::NEG_INFINITY, f64::max)
    };
    if let Some((distance, normal, edges)) = crossed(&both, best, equal) {
        let margin = distance - second(&normal);
        return HullSeparation { distance, margin, normal, feature: HullFeature::Edges(edges) };
    }
    let FaceAxis { distance, normal, of, face } = *best;
    let outward = if of == 0 { normal } else { -normal };
    let other = both[1 - of].against(&outward);
    let feature = HullFeature::Face { of, face, other };
    HullSeparation { distance, margin: distance - second(&normal), normal, feature }
}

/// Best axis across an edge of a and an edge of b: distance, axis from a to b, and the edges. `None`
/// if the best face normal gives at least the same distance, or if the axis is close to it.
fn crossed(
    [a, b]: &[HullAxes<'_>; 2],
    best: &FaceAxis,
    equal: f64,
) -> Option<(f64, Vector3<f64>, [usize; 2])> {
    let (mut beat, mut found) = (best.distance + equal, None);
    for (i, [along, into, into_other]) in a.edges.iter().enumerate() {
        let start = a.points[a.topology.edges[i].ends[0] as usize];
        for (j, [along_b, into_b, into_other_b]) in b.edges.iter().enumerate() {
            let axis = along.cross(along_b);
            // Both edges must be the farthest of their polyhedra along the axis.
            let own = [axis.dot(into), axis.dot(into_other)];
            let other = [axis.dot(into_b), axis.dot(into_other_b)];
            let ahead = own.iter().all(|x| *x < 0.0) && other.iter().all(|x| *x > 0.0);
            let behind = own.iter().all(|x| *x > 0.0) && other.iter().all(|x| *x < 0.0);
            let square = axis.norm_squared();
            if !(ahead || behind)
                || square <= PARALLEL * along.norm_squared() * along_b.norm_squared()
            {
                continue;
            }
            let unit = axis * (if ahead { 1.0 } else { -1.0 } / square.sqrt());
            let distance = unit.dot(&(b.points[b.topology.edges[j].ends[0] as usize] - start));
            if distance > beat {
                beat = distance + equal;
                let apart_from_face = unit.dot(&best.normal).abs() < NEAR_FACE;
                found = apart_from_face.then_some((distance, unit, [i, j]));
            }
        }
    }
    found
}

/// Separation of polyhedra without any face normal, along the line of their first vertices.
#[cold]
fn shapeless(a: &ConvexHull<'_>, b: &ConvexHull<'_>) -> HullSeparation {
    let [from, to] = [a, b].map(|hull| hull.points.first().copied().unwrap_or_default());
    let normal = (to - from).try_normalize(0.0).unwrap_or_else(Vector3::x);
    let along =
        |hull: &ConvexHull<'_>| hull.points.iter().map(|x| x.dot(&normal)).collect::<Vec<_>>();
    let low = along(b).into_iter().fold(f64::INFINITY, f64::min);
    let high = along(a).into_iter().fold(f64::NEG_INFINITY, f64::max);
    let feature = HullFeature::Face { of: 0, face: 0, other: 0 };
    HullSeparation { distance: low - high, margin: 0.0, normal, feature }
}
