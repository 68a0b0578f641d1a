//! Triangles of a surface with shared corners.

use std::collections::{BTreeMap, HashMap};

use ddem_core::problem::Vec3;
use ddem_cut::HeightField;

use super::Triangles;

/// Distance within which corners are merged, as a fraction of the size of the surface.
const WELDED: f64 = 1e-6;

/// Triangles of a surface, given by their corners.
#[derive(Clone, Debug, Default)]
pub(crate) struct SurfaceMesh {
    /// Positions of the corners `[m]`.
    pub(crate) points: Vec<[f64; 3]>,
    /// Triangles with three different corners.
    pub(crate) triangles: Vec<[u32; 3]>,
}

impl Triangles {
    /// Triangles with coinciding corners merged; triangles without three different corners are left
    /// out.
    pub(crate) fn mesh(&self) -> SurfaceMesh {
        let mut welder = Welder::around(self.0.iter().flatten());
        let numbers = self.0.iter().map(|corners| corners.map(|corner| welder.number(corner)));
        let triangles: Vec<[u32; 3]> =
            numbers.filter(|[a, b, c]| a != b && b != c && c != a).collect();
        SurfaceMesh { points: welder.points, triangles }
    }

    /// Ground that the triangles are; `None` for other surfaces.
    pub(crate) fn height_field(&self) -> Option<HeightField> {
        let SurfaceMesh { points, triangles } = self.mesh();
        let points: Vec<Vec3> = points.into_iter().map(Vec3::from).collect();
        HeightField::new(&points, &triangles)
    }
}

/// Points without those that coincide, and the number of its point for each of the given ones.
pub(crate) fn welded(all: &[[f64; 3]]) -> (Vec<[f64; 3]>, Vec<u32>) {
    let mut welder = Welder::around(all.iter());
    let numbers = all.iter().map(|point| welder.number(*point)).collect();
    (welder.points, numbers)
}

/// Corners found so far.
#[derive(Default)]
struct Welder {
    low: [f64; 3],
    reach: f64,
    points: Vec<[f64; 3]>,
    /// Corner numbers by the bits of the coordinates.
    known: HashMap<[u64; 3], u32>,
    /// Corner numbers by the cell of a grid whose width is the merging distance.
    cells: HashMap<[i64; 3], Vec<u32>>,
}

impl Welder {
    /// Corners to find in the box around points.
    fn around<'a>(points: impl Iterator<Item = &'a [f64; 3]>) -> Self {
        let mut low = [f64::INFINITY; 3];
        let mut high = [f64::NEG_INFINITY; 3];
        for point in points {
            low = [0, 1, 2].map(|k| low[k].min(point[k]));
            high = [0, 1, 2].map(|k| high[k].max(point[k]));
        }
        let size = (0..3).fold(0.0_f64, |size, k| libm::hypot(size, high[k] - low[k]));
        Self { low, reach: WELDED * size, ..Self::default() }
    }

    fn number(&mut self, corner: [f64; 3]) -> u32 {
        // Adding 0 removes the sign of zero.
        let bits = corner.map(|x| (x + 0.0).to_bits());
        if let Some(&number) = self.known.get(&bits) {
            return number;
        }
        let width = if self.reach > 0.0 { self.reach } else { 1.0 };
        let cell = [0, 1, 2].map(|k| ((corner[k] - self.low[k]) / width).floor() as i64);
        let number = self.beside(corner, cell).unwrap_or_else(|| {
            let number = self.points.len() as u32;
            self.points.push(corner);
            self.cells.entry(cell).or_default().push(number);
            number
        });
        self.known.insert(bits, number);
        number
    }

    /// Lowest number of a corner within the merging distance.
    fn beside(&self, corner: [f64; 3], cell: [i64; 3]) -> Option<u32> {
        let near = |number: &&u32| {
            let other = self.points[**number as usize];
            (0..3).fold(0.0_f64, |far, k| libm::hypot(far, corner[k] - other[k])) <= self.reach
        };
        let around = (0..27_i64)
            .map(|n| [cell[0] + n % 3 - 1, cell[1] + n / 3 % 3 - 1, cell[2] + n / 9 - 1]);
        let found = around.filter_map(|cell| self.cells.get(&cell));
        found.flat_map(|numbers| numbers.iter().filter(near)).min().copied()
    }
}

impl SurfaceMesh {
    /// Numbers of triangles that pass each edge from the lower node to the higher one, and the
    /// other way.
    fn edges(&self) -> BTreeMap<[u32; 2], [usize; 2]> {
        let mut edges = BTreeMap::new();
        for [a, b, c] in &self.triangles {
            for (from, to) in [(a, b), (b, c), (c, a)] {
                let direction = usize::from(from > to);
                edges.entry([*from.min(to), *from.max(to)]).or_insert([0; 2])[direction] += 1;
            }
        }
        edges
    }

    /// Edges of an odd number of triangles.
    pub(crate) fn open_edges(&self) -> Vec<[u32; 2]> {
        let open = |(_, counts): &([u32; 2], [usize; 2])| (counts[0] + counts[1]) % 2 == 1;
        self.edges().into_iter().filter(open).map(|(edge, _)| edge).collect()
    }

    /// Enclosed volume `[m³]`, negative if the triangles of a closed surface are turned inward.
    pub(crate) fn volume(&self) -> f64 {
        let Some(&origin) = self.points.first() else { return 0.0 };
        let cone = |corners: &[u32; 3]| {
            let [a, b, c] = corners.map(|corner| {
                let x = self.points[corner as usize];
                Vec3::from([0, 1, 2].map(|k| x[k] - origin[k]))
            });
            a.dot(&b.cross(&c)) / 6.0
        };
        self.triangles.iter().map(cone).sum()
    }

    /// True if all triangles are oriented to the same side: equally many pass each edge in both
    /// directions.
    pub(crate) fn is_turned_one_way(&self) -> bool {
        self.edges().values().all(|[there, back]| there == back)
    }
}
