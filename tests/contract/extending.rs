//! Programs add a joint law, a load, an output field and a block shape: one of each, only with
//! items that the crate exports.

use std::ops::Range;
use std::sync::Arc;

use ddem::element::Elastic;
use ddem::law::{JointLaw, SpringStiffness};
use ddem::problem::{HexMesh, JointElasticity, JointProperties, ProblemBuilder};
use ddem::{FIELDS, Field, FieldLocation, Model, Simulation, Snapshot};

/// Shift of the upper edge of each bar along x, for an edge of 1 m.
const SLANT: f64 = 0.3;
/// Tension along the bars `[Pa]`.
const TENSION: f64 = 1e6;
/// Allowed relative error: bars rotate by a part of their strain of 6e-5, and tractions rotate with
/// them.
const ERROR: f64 = 2e-5;

/// Block shape: two slanted bars one after the other along x, with edges of 1 m along x and z.
fn slanted_bars() -> HexMesh {
    let mut mesh = HexMesh::default();
    for bar in 0..2 {
        let first = mesh.nodes.len() as u32;
        for corner in [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]] {
            let [x, y, _] = corner.map(f64::from);
            mesh.nodes.push([f64::from(bar) + x + SLANT * y, y, 0.0]);
        }
        for corner in 0..4 {
            let [x, y, _] = mesh.nodes[first as usize + corner];
            mesh.nodes.push([x, y, 1.0]);
        }
        mesh.hexes.push(std::array::from_fn(|corner| first + corner as u32));
        mesh.blocks.push(bar as u32);
    }
    mesh
}

/// Quadrilaterals at the lower and the upper end of a bar.
fn ends(bar: u32) -> [[u32; 4]; 2] {
    [[0, 3, 7, 4], [1, 2, 6, 5]].map(|end: [u32; 4]| end.map(|node| 8 * bar + node))
}

/// Joint law that fails at one shear traction, for any normal traction.
#[derive(Debug)]
struct Glue {
    shear: f64,
}

impl JointLaw for Glue {
    fn tension(&self) -> f64 {
        1e12
    }

    fn peak(&self, _normal: f64) -> f64 {
        self.shear
    }

    fn residual(&self, _normal: f64) -> f64 {
        0.0
    }
}

/// Load: a traction times the area of a parallelogram, in equal parts at its nodes.
fn traction(mesh: &HexMesh, quad: [u32; 4], traction: [f64; 3]) -> Vec<(u32, [f64; 3])> {
    let [a, b, _, d] = quad.map(|node| nalgebra::Vector3::from(mesh.nodes[node as usize]));
    let area = (b - a).cross(&(d - a)).norm();
    quad.map(|node| (node, traction.map(|t| t * area / 4.0))).to_vec()
}

/// Output field: von Mises stress at the centres of the elements.
const VON_MISES: Field = Field::new("von_mises", "Pa", FieldLocation::Element, 1, von_mises);

fn von_mises(snapshot: &Snapshot<'_>, range: Range<usize>, out: &mut [f64]) {
    let stress = FIELDS.iter().find(|field| field.name == "stress").expect("a field");
    let mut stresses = vec![0.0; 6 * out.len()];
    snapshot.fill(stress, range, &mut stresses);
    for (out, stress) in out.iter_mut().zip(stresses.as_chunks::<6>().0) {
        let [xx, yy, zz, xy, yz, zx] = stress;
        let normal = (xx - yy).powi(2) + (yy - zz).powi(2) + (zz - xx).powi(2);
        *out = (0.5 * normal + 3.0 * (xy * xy + yz * yz + zx * zx)).sqrt();
    }
}

/// Bars under tension in equilibrium, glued with a shear strength.
fn pulled(shear: f64) -> Simulation {
    let mesh = slanted_bars();
    let mut builder = ProblemBuilder::new(&mesh, Elastic::new(2400.0, 18e9, 0.25)).unwrap();
    let glue = builder.joint(JointProperties {
        name: "glue".into(),
        thickness: 0.0,
        elasticity: JointElasticity::Springs(SpringStiffness { normal: 1e11, shear: 4e10 }),
        law: Some(Arc::new(Glue { shear })),
    });
    builder.join([ends(0)[1], ends(1)[0]], glue).unwrap();
    // The tension acts along x alone; on an end it is smaller by the cosine of the slant.
    let along = TENSION / (1.0 + SLANT * SLANT).sqrt();
    for (end, pull) in [(ends(0)[0], -along), (ends(1)[1], along)] {
        builder.load(&traction(&mesh, end, [pull, 0.0, 0.0])).unwrap();
    }
    // Only as many supports as two joined bars need.
    builder.fix(&[0], [true; 3]).unwrap();
    builder.fix(&[1], [false, true, true]).unwrap();
    builder.fix(&[4], [false, true, false]).unwrap();
    let (problem, _) = builder.build().unwrap();
    let mut simulation = Simulation::new(Model::new(Arc::new(problem)));
    // Bars that separate never come to rest.
    let _ = simulation.relax(1e-9, 20_000);
    simulation
}

#[test]
fn program_adds_law_load_field_and_shape() {
    // Tractions on a plane with the normal (1, −s, 0)/√(1 + s²) under a tension along x.
    let shear = TENSION * SLANT / (1.0 + SLANT * SLANT);
    let mut holds = pulled(1.02 * shear);
    assert_eq!(holds.failed_pairs(), [0, 0]);
    for stress in holds.snapshot().values(&VON_MISES) {
        assert!((stress / TENSION - 1.0).abs() < ERROR, "{stress}");
    }
    for found in holds.tractions().into_iter().map(nalgebra::Vector3::from) {
        let exact = TENSION / (1.0 + SLANT * SLANT).sqrt();
        assert!((found.norm() / exact - 1.0).abs() < ERROR, "{found}");
    }
    let fails = pulled(0.98 * shear);
    assert_eq!(fails.failed_pairs(), [4, 0]);
}
