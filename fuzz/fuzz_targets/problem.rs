//! Problems from arrays.

#![no_main]

use std::sync::Arc;

use ddem_core::element::Elastic;
use ddem_core::problem::{HexMesh, ProblemBuilder};
use ddem_core::{Model, Simulation};
use libfuzzer_sys::arbitrary::{self, Arbitrary};
use libfuzzer_sys::fuzz_target;

/// Arrays as a program gives them.
#[derive(Arbitrary, Debug)]
struct Arrays {
    nodes: Vec<[f64; 3]>,
    hexes: Vec<[u8; 8]>,
    blocks: Vec<u8>,
    material: [f64; 3],
    rigid: Vec<u8>,
    fixed: Vec<u8>,
}

fuzz_target!(|arrays: Arrays| {
    let mut mesh = HexMesh::default();
    mesh.nodes = arrays.nodes;
    mesh.hexes = arrays.hexes.iter().map(|hex| hex.map(u32::from)).collect();
    mesh.blocks = arrays.blocks.into_iter().map(u32::from).collect();
    let [density, young, poisson] = arrays.material;
    let Ok(mut builder) = ProblemBuilder::new(&mesh, Elastic::new(density, young, poisson)) else {
        return;
    };
    for block in arrays.rigid {
        let _ = builder.set_rigid(block.into());
    }
    let fixed: Vec<u32> = arrays.fixed.into_iter().map(u32::from).collect();
    let _ = builder.fix(&fixed, [true; 3]);
    if let Ok((problem, _)) = builder.build() {
        let _ = Simulation::new(Model::new(Arc::new(problem))).step();
    }
});
