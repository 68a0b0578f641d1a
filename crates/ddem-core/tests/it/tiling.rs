//! §1: blocks, joints, strips and corners tile the region exactly for any lattice.

use ddem_core::Model;
use ddem_deck::{BlockSet, Deck, Edges, Joint, JointChoice, Material, Remove, Sphere, Where};
use nalgebra::Matrix3;
use proptest::prelude::*;

use crate::decks::*;

/// Random lattice: cuts along each edge, joint thickness for each normal, and removed cells.
#[derive(Clone, Debug)]
struct RandomLattice {
    cuts: [Vec<f64>; 3],
    thickness: [f64; 3],
    divisions: u32,
    axes: [[f64; 3]; 3],
    removed: Vec<[usize; 3]>,
    seed: u64,
}

fn cuts() -> impl Strategy<Value = Vec<f64>> {
    (-5.0..5.0, prop::collection::vec(0.5..2.0, 1..=4)).prop_map(|(start, lengths)| {
        let mut cuts = vec![start];
        for length in lengths {
            cuts.push(cuts[cuts.len() - 1] + length);
        }
        cuts
    })
}

fn axes() -> impl Strategy<Value = [[f64; 3]; 3]> {
    let tilt = || -0.3..0.3_f64;
    let oblique = [tilt(), tilt(), tilt(), tilt(), tilt(), tilt()]
        .prop_map(|[a, b, c, d, e, f]| [[1.0, a, b], [c, 2.0, d], [e, f, 0.5]]);
    prop_oneof![Just(BOX), oblique]
}

fn sample() -> impl Strategy<Value = RandomLattice> {
    let cell = || [0..4usize, 0..4usize, 0..4usize];
    (
        [cuts(), cuts(), cuts()],
        [0.001..0.2, 0.001..0.2, 0.001..0.2],
        1..=3u32,
        axes(),
        prop::collection::vec(cell(), 0..4),
        any::<u64>(),
    )
        .prop_map(|(cuts, thickness, divisions, axes, removed, seed)| {
            let inside = |cell: &[usize; 3]| (0..3).all(|d| cell[d] + 1 < cuts[d].len());
            let mut removed: Vec<_> = removed.into_iter().filter(inside).collect();
            // A cell can be removed only once.
            removed.sort_unstable();
            removed.dedup();
            RandomLattice { cuts, thickness, divisions, axes, removed, seed }
        })
}

impl RandomLattice {
    fn count(&self) -> [usize; 3] {
        [0, 1, 2].map(|d| self.cuts[d].len() - 1)
    }

    fn units(&self) -> [Vec3; 3] {
        self.axes.map(|axis| Vec3::from(axis).normalize())
    }

    fn is_there(&self, cell: [usize; 3]) -> bool {
        !self.removed.contains(&cell)
    }

    fn n_blocks(&self) -> usize {
        let [nx, ny, nz] = self.count();
        let cells =
            (0..nz).flat_map(|z| (0..ny).flat_map(move |y| (0..nx).map(move |x| [x, y, z])));
        cells.filter(|&cell| self.is_there(cell)).count()
    }

    fn deck(&self) -> Deck {
        let joint = |k: usize| Joint {
            thickness: self.thickness[k],
            density: Some(1900.0),
            young: Some(1e9 * (k + 1) as f64),
            poisson: Some(0.2),
            ..Joint::default()
        };
        let units = self.units();
        let remove = self.removed.iter().map(|cell| {
            let middle = |d: usize| (self.cuts[d][cell[d]] + self.cuts[d][cell[d] + 1]) / 2.0;
            let centre = (0..3).map(|d| units[d] * middle(d)).sum::<Vec3>();
            let sphere = Some(Sphere { centre: centre.into(), radius: 1e-3 });
            Remove { r#where: Where { sphere, ..Where::default() }, ..Remove::default() }
        });
        let [x, y, z] = self.cuts.clone();
        Deck {
            materials: [(
                "rock".to_owned(),
                Material { density: 2600.0, young: 30e9, poisson: 0.2 },
            )]
            .into(),
            joints: [0, 1, 2].map(|k| (format!("j{k}"), joint(k))).into(),
            blocks: vec![BlockSet {
                edges: Some(Edges { x: Some(x), y: Some(y), z: Some(z) }),
                divisions: self.divisions,
                material: "rock".into(),
                joint: Some(JointChoice::ByNormal {
                    x: Some("j0".into()),
                    y: Some("j1".into()),
                    z: Some("j2".into()),
                }),
                axes: self.axes,
                ..BlockSet::default()
            }],
            remove: remove.collect(),
            ..Deck::default()
        }
    }

    /// Blocks and gaps in turn along edge d: the length, and the cells to which it belongs.
    fn segments(&self, d: usize) -> Vec<(f64, std::ops::RangeInclusive<usize>)> {
        let units = self.units();
        let normal = units[(d + 1) % 3].cross(&units[(d + 2) % 3]).normalize();
        let gap = self.thickness[d] / normal.dot(&units[d]).abs();
        let n = self.count()[d];
        let mut segments = Vec::new();
        for cell in 0..n {
            let sides = usize::from(cell > 0) + usize::from(cell + 1 < n);
            let length = self.cuts[d][cell + 1] - self.cuts[d][cell];
            segments.push((length - gap * sides as f64 / 2.0, cell..=cell));
            if cell + 1 < n {
                segments.push((gap, cell..=cell + 1));
            }
        }
        segments
    }

    /// Volumes of blocks, joints, strips and corners; a piece counts if all its blocks are present.
    fn volumes(&self) -> [f64; 4] {
        let slant = Matrix3::from_columns(&self.units()).determinant().abs();
        let [xs, ys, zs] = [0, 1, 2].map(|d| self.segments(d));
        let mut volumes = [0.0; 4];
        for (lx, x) in &xs {
            for (ly, y) in &ys {
                for (lz, z) in &zs {
                    let complete = x
                        .clone()
                        .all(|i| y.clone().all(|j| z.clone().all(|k| self.is_there([i, j, k]))));
                    let kind = [x, y, z].iter().filter(|s| s.start() != s.end()).count();
                    if complete {
                        volumes[kind] += lx * ly * lz * slant;
                    }
                }
            }
        }
        volumes
    }
}

fn close(a: f64, b: f64, tolerance: f64) -> bool {
    (a - b).abs() <= tolerance * b.abs()
}

fn check_volumes(sample: &RandomLattice, model: &Model) -> Result<(), TestCaseError> {
    let (volumes, expected) = (model.volumes(), sample.volumes());
    let total: f64 = volumes.iter().sum();
    for kind in 0..4 {
        prop_assert!((volumes[kind] - expected[kind]).abs() <= 1e-12 * total, "{kind}");
    }
    if sample.removed.is_empty() {
        let slant = Matrix3::from_columns(&sample.units()).determinant().abs();
        let edges = sample.cuts.iter().map(|cuts| cuts[cuts.len() - 1] - cuts[0]);
        prop_assert!(close(total, slant * edges.product::<f64>(), 1e-12));
    }
    let mass: f64 = (0..model.n_nodes()).map(|node| model.mass(node)).sum();
    let weight = 2600.0 * volumes[0] + 1900.0 * (volumes[1] + volumes[2] + volumes[3]);
    prop_assert!(close(mass, weight, 1e-12), "{mass} {weight}");
    Ok(())
}

/// Pairs face each other across the gap, and their areas add up to the area of the joint.
fn check_faces(sample: &RandomLattice, model: &Model) -> Result<(), TestCaseError> {
    let units = sample.units();
    let mut pairs = 0;
    let mut volume = 0.0;
    for face in model.faces() {
        let d = face.direction as usize;
        let areas: Vec<f64> = face.areas(model.geometry()).collect();
        let area: f64 = areas.iter().sum();
        prop_assert_eq!(face.first_pair as usize, pairs);
        pairs += areas.len();
        volume += area * sample.thickness[d];
        let ends: Vec<[u32; 2]> = face.pairs(model.geometry()).collect();
        prop_assert_eq!(ends.len(), areas.len());
        let normal = Vec3::from(face.normal(model.geometry()));
        for &[a, b] in &ends {
            let across = Vec3::from(model.point(b as usize)) - Vec3::from(model.point(a as usize));
            prop_assert!(close(across.dot(&normal), sample.thickness[d], 1e-9));
            prop_assert!(across.cross(&units[d]).norm() < 1e-12);
            prop_assert_eq!(model.block_of(a as usize), face.a as usize);
            prop_assert_eq!(model.block_of(b as usize), face.b as usize);
        }
        let far = |i: usize| Vec3::from(model.point(ends[i][0] as usize));
        let n = face.divisions as usize;
        let edges = [far(n) - far(0), far(n * (n + 1)) - far(0)];
        prop_assert!(close(area, edges[0].cross(&edges[1]).norm(), 1e-12));
    }
    prop_assert_eq!(model.n_pairs(), pairs);
    let joints = model.volumes()[1];
    prop_assert!((volume - joints).abs() <= 1e-12 * joints);
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]

    #[test]
    fn cells_tile_the_region(sample in sample()) {
        prop_assume!(sample.n_blocks() > 0);
        let deck = sample.deck();
        let mut simulation = simulation(&deck);
        let model = simulation.model();
        let blocks = sample.n_blocks();
        prop_assert_eq!(model.n_blocks(), blocks);
        prop_assert_eq!(model.n_nodes(), blocks * (sample.divisions as usize + 1).pow(3));
        prop_assert_eq!(model.n_elements(), blocks * (sample.divisions as usize).pow(3));
        check_volumes(&sample, model)?;
        check_faces(&sample, model)?;
        let points = points(model);
        let mut random = Random::new(sample.seed);
        let u: Vec<[f64; 3]> = points.iter().map(|_| (random.vector() * 1e-3).into()).collect();
        simulation.set_displacements(&u);
        let [force, moment] = sums(&points, &u, &simulation.internal_forces(), Vec3::zeros());
        prop_assert!(force < 1e-12, "sum of forces {:e}", force);
        prop_assert!(moment < 1e-12, "sum of moments {:e}", moment);
    }
}
