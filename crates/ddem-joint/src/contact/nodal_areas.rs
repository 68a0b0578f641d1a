//! Areas of the points of joints between faces that do not match.
//!
//! The quadrature over the overlap of two faces does not integrate the shape functions of kites exactly,
//! so that a uniform traction would not give their nodes the forces of a uniform stress. The areas $w$ of
//! the points become $w (1 + C^T λ)$, with the shape functions $C$ of the nodes of all faces that are
//! covered as a whole: the least relative change after which $C w$ are the areas of the nodes.

use std::collections::BTreeMap;

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use super::{BondedPatch, ContactBlock, ContactPoint};
use ddem_mechanics::collide::FaceId;
use ddem_mesh::{BlockFace, Geometry};

/// Largest error of a nodal area relative to that of its face that stays: points have their
/// coordinates in single precision.
const ROUNDING: f64 = 1e-7;
/// Largest error of the area of a face that is covered as a whole.
const COVERED: f64 = 1e-6;
/// Part of the diagonal that is added to it. Both sides have the same area and centre, so that some
/// equations follow from others up to the rounding of coordinates.
const DAMPING: f64 = 1e-6;
/// Bounds of the factors. Beyond them a face only seems to be covered: slivers are missing, and others
/// count twice.
const FACTORS: [f64; 2] = [0.5, 2.0];
/// Largest number of steps of the conjugate gradients.
const MOST_STEPS: usize = 200;

/// Number of a block and of its face.
type NumberedFace = (u32, u8);

/// Nodes of a face.
struct FaceNodes {
    /// Numbers of the nodes in the block, in increasing order, and the integrals of their shape
    /// functions `[m²]`.
    exact: Vec<(usize, f64)>,
    /// Sums over the points `[m²]`.
    sums: Vec<f64>,
    /// Number of the first equation; `None` if the face has none.
    first: Option<usize>,
}

impl FaceNodes {
    fn new(geometry: &Geometry, (block, face): NumberedFace) -> Self {
        let block = block as usize;
        let first = geometry.blocks[block].first_node;
        let face = BlockFace { block, face: FaceId::from_number(face) };
        let areas = face.node_areas(geometry).into_iter();
        let exact: Vec<_> = areas.map(|(node, area)| ((node - first) as usize, area)).collect();
        Self { sums: vec![0.0; exact.len()], exact, first: None }
    }

    /// Place of a node.
    fn at(&self, node: usize) -> Option<usize> {
        self.exact.binary_search_by_key(&node, |(own, _)| *own).ok()
    }

    fn area(&self) -> f64 {
        self.exact.iter().map(|(_, area)| area).sum()
    }

    /// True if joints cover the whole face.
    fn is_covered(&self) -> bool {
        (self.sums.iter().sum::<f64>() - self.area()).abs() <= COVERED * self.area()
    }

    fn is_inexact(&self) -> bool {
        let most = ROUNDING * self.area();
        self.exact.iter().zip(&self.sums).any(|((_, exact), sum)| (exact - sum).abs() > most)
    }
}

/// Makes the areas of points such that a uniform traction gives each node of a part of a cell exactly
/// its force, up to the rounding of coordinates.
pub(super) fn correct(bonded: &mut [BondedPatch], blocks: &[ContactBlock], geometry: &Geometry) {
    let mut faces: BTreeMap<NumberedFace, FaceNodes> = BTreeMap::new();
    for patch in bonded.iter().map(|joint| &joint.patch) {
        if patch.blocks.iter().any(|&block| blocks[block as usize].is_part()) {
            for key in faces_of(patch.blocks, &patch.points) {
                faces.entry(key).or_insert_with(|| FaceNodes::new(geometry, key));
            }
        }
    }
    for patch in bonded.iter().map(|joint| &joint.patch) {
        for point in &patch.points {
            for (key, node, n) in shares(point, patch.blocks, blocks) {
                let Some(face) = faces.get_mut(&key) else { continue };
                if let Some(at) = face.at(node) {
                    face.sums[at] += n * point.pair.area;
                }
            }
        }
    }
    let mut inexact: Vec<&mut BondedPatch> = bonded
        .iter_mut()
        .filter(|BondedPatch { patch, .. }| {
            let own = |key| faces.get(&key);
            let mut of = faces_of(patch.blocks, &patch.points).into_iter().filter_map(own);
            of.any(|face| face.is_covered() && face.is_inexact())
        })
        .collect();
    let mut equations = Equations::default();
    for BondedPatch { patch, .. } in &inexact {
        for key in faces_of(patch.blocks, &patch.points) {
            if let Some(face) = faces.get_mut(&key) {
                equations.add_face(face);
            }
        }
    }
    for BondedPatch { patch, .. } in &inexact {
        for point in &patch.points {
            let shares = shares(point, patch.blocks, blocks);
            equations.add_point(
                point.pair.area,
                shares.filter_map(|(key, node, n)| {
                    let face = faces.get(&key)?;
                    Some((face.first? + face.at(node)?, n))
                }),
            );
        }
    }
    let mut factors = equations.factors().into_iter();
    for point in inexact.iter_mut().flat_map(|joint| &mut joint.patch.points) {
        point.pair.area *= factors.next().unwrap_or(1.0);
    }
}

/// Faces of the two sides of a joint; none without points.
fn faces_of(blocks: [u32; 2], points: &[ContactPoint]) -> Vec<NumberedFace> {
    let first = points.first();
    let of = |point: &ContactPoint| [0, 1].map(|side| (blocks[side], point.points[side].face));
    first.map(of).into_iter().flatten().collect()
}

/// Faces and nodes of a point on both sides, with the shape functions there.
fn shares<'a>(
    point: &'a ContactPoint,
    sides: [u32; 2],
    blocks: &'a [ContactBlock],
) -> impl Iterator<Item = (NumberedFace, usize, f64)> + 'a {
    (0..2).flat_map(move |side| {
        let (block, at) = (sides[side], &point.points[side]);
        let weights = blocks[block as usize].weights(at);
        weights.into_iter().map(move |(node, n)| ((block, at.face), node, n))
    })
}

/// Equations $C w = a$ for the areas of points.
#[derive(Default)]
struct Equations {
    /// Deviations of the nodal areas from the sums over the points, $a - C w$ `[m²]`.
    missing: Vec<f64>,
    /// First equation of each face.
    firsts: Vec<usize>,
    /// Areas of the points `[m²]`.
    areas: Vec<f64>,
    /// Equations of each point, and the shape functions there.
    entries: Vec<(usize, f64)>,
    /// End of the entries of each point.
    ends: Vec<usize>,
}

impl Equations {
    /// Adds the nodes of a face, if it is covered.
    fn add_face(&mut self, face: &mut FaceNodes) {
        if face.first.is_none() && face.is_covered() {
            face.first = Some(self.missing.len());
            self.firsts.push(self.missing.len());
            let missing = face.exact.iter().zip(&face.sums).map(|((_, exact), sum)| exact - sum);
            self.missing.extend(missing);
        }
    }

    fn add_point(&mut self, area: f64, entries: impl Iterator<Item = (usize, f64)>) {
        self.areas.push(area);
        self.entries.extend(entries);
        self.ends.push(self.entries.len());
    }

    /// Calls `visit` with the number, the area and the entries of each point.
    fn each_point(&self, mut visit: impl FnMut(usize, f64, &[(usize, f64)])) {
        let mut from = 0;
        for (point, (&area, &to)) in self.areas.iter().zip(&self.ends).enumerate() {
            visit(point, area, &self.entries[from..to]);
            from = to;
        }
    }

    /// Diagonal of $C W C^T$, with the areas $W$ of the points.
    fn diagonal(&self) -> Vec<f64> {
        let mut diagonal = vec![0.0; self.missing.len()];
        self.each_point(|_, area, entries| {
            entries.iter().for_each(|(row, n)| diagonal[*row] += area * n * n);
        });
        diagonal
    }

    /// Product $C W C^T λ$ with the damped diagonal.
    fn product(&self, diagonal: &[f64], of: &[f64]) -> Vec<f64> {
        let mut product: Vec<f64> =
            diagonal.iter().zip(of).map(|(d, of)| DAMPING * d * of).collect();
        self.each_point(|_, area, entries| {
            let sum: f64 = entries.iter().map(|(row, n)| n * of[*row]).sum();
            entries.iter().for_each(|(row, n)| product[*row] += area * n * sum);
        });
        product
    }

    /// Factored matrices of the equations of each face alone.
    fn of_faces(&self, diagonal: &[f64]) -> Vec<Cholesky<f64, Dyn>> {
        let ends = self.firsts.iter().skip(1).copied().chain([self.missing.len()]);
        let sizes = self.firsts.iter().zip(ends).map(|(first, end)| end - first);
        let mut matrices: Vec<DMatrix<f64>> = sizes.map(|n| DMatrix::zeros(n, n)).collect();
        self.each_point(|_, area, entries| {
            for (row, n) in entries {
                let face = self.firsts.partition_point(|first| first <= row) - 1;
                let (first, size) = (self.firsts[face], matrices[face].nrows());
                let own = |(other, m): &(usize, f64)| {
                    (first..first + size).contains(other).then(|| (other - first, *m))
                };
                for (other, m) in entries.iter().filter_map(own) {
                    matrices[face][(row - first, other)] += area * n * m;
                }
            }
        });
        let factored = |(first, mut matrix): (&usize, DMatrix<f64>)| {
            for row in 0..matrix.nrows() {
                let own = diagonal[first + row];
                // An equation without points has no effect.
                matrix[(row, row)] += if own > 0.0 { DAMPING * own } else { 1.0 };
            }
            matrix.cholesky()
        };
        self.firsts.iter().zip(matrices).filter_map(factored).collect()
    }

    /// Factors of the areas, by conjugate gradients for $C W C^T λ = a - C w$. The equations of each
    /// face alone precondition them.
    fn factors(&self) -> Vec<f64> {
        let mut factors = vec![1.0; self.areas.len()];
        let diagonal = self.diagonal();
        let faces = self.of_faces(&diagonal);
        if faces.len() < self.firsts.len() {
            return factors;
        }
        let precondition = |rest: &[f64]| -> Vec<f64> {
            let solve = |(first, face): (&usize, &Cholesky<f64, Dyn>)| {
                let of = DVector::from_column_slice(&rest[*first..first + face.l_dirty().nrows()]);
                face.solve(&of).data.as_vec().clone()
            };
            self.firsts.iter().zip(&faces).flat_map(solve).collect()
        };
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let solvable = |(missing, own): (&f64, &f64)| if *own > 0.0 { *missing } else { 0.0 };
        let mut rest: Vec<f64> = self.missing.iter().zip(&diagonal).map(solvable).collect();
        let mut multipliers = vec![0.0; rest.len()];
        let mut direction = precondition(&rest);
        let mut size = dot(&rest, &direction);
        let enough = size * ROUNDING * ROUNDING;
        for _ in 0..MOST_STEPS {
            if size <= enough {
                break;
            }
            let product = self.product(&diagonal, &direction);
            let curvature = dot(&direction, &product);
            if curvature <= 0.0 {
                break;
            }
            let length = size / curvature;
            for (row, change) in product.iter().enumerate() {
                multipliers[row] += length * direction[row];
                rest[row] -= length * change;
            }
            let next = precondition(&rest);
            let part = dot(&rest, &next) / size;
            direction.iter_mut().zip(&next).for_each(|(d, z)| *d = z + part * *d);
            size *= part;
        }
        self.each_point(|point, _, entries| {
            let change: f64 = entries.iter().map(|(row, n)| n * multipliers[*row]).sum();
            factors[point] = (1.0 + change).clamp(FACTORS[0], FACTORS[1]);
        });
        factors
    }
}

#[cfg(test)]
mod tests {
    use super::Equations;
    use ddem_mechanics::collide::weights;

    /// Nodal areas of a square of 4 m² by points with wrong areas, and a node without a point.
    #[test]
    fn factors_give_each_node_its_area() {
        let points = [[0.25, 0.25], [0.75, 0.25], [0.75, 0.75], [0.25, 0.75], [0.5, 0.5]];
        let areas = [0.9, 0.75, 0.8, 0.8, 0.75];
        let sums = |areas: &[f64]| -> Vec<f64> {
            let of = |node: usize| {
                points.iter().zip(areas).map(|(at, area)| weights(*at)[node] * area).sum()
            };
            (0..4).map(of).collect()
        };
        let missing = sums(&areas).iter().map(|sum| 1.0 - sum).chain([0.1]).collect();
        let mut equations = Equations { missing, firsts: vec![0], ..Equations::default() };
        for (at, area) in points.iter().zip(areas) {
            equations.add_point(area, weights(*at).into_iter().enumerate());
        }
        let factors = equations.factors();
        assert!(factors.iter().any(|factor| (factor - 1.0).abs() > 0.05), "{factors:?}");
        let changed: Vec<f64> = areas.iter().zip(factors).map(|(area, f)| area * f).collect();
        assert!(sums(&changed).iter().all(|sum| (sum - 1.0).abs() < 1e-6), "{changed:?}");
    }
}
