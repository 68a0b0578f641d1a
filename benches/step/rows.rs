//! Models that are measured.

use ddem::deck::{Body, Kinematics};

use crate::THREADS;
use crate::models::{
    BenchModel, JointStrength, cells, cubes, forces, lattice, loose, relaxation, springs,
};

/// A model, which is measured on each number of threads.
pub(crate) struct BenchRow {
    pub(crate) kind: &'static str,
    /// Model in words.
    pub(crate) model: String,
    pub(crate) nodes: usize,
    build: Box<dyn Fn() -> BenchModel>,
}

impl BenchRow {
    fn new(
        kind: &'static str,
        model: impl Into<String>,
        nodes: usize,
        build: impl Fn() -> BenchModel + 'static,
    ) -> Self {
        Self { kind, model: model.into(), nodes, build: Box::new(build) }
    }

    /// Model and number of threads.
    pub(crate) fn function(&self, threads: usize) -> String {
        format!("{}/{threads} threads", self.model)
    }

    /// Whole name, as criterion forms it.
    pub(crate) fn name(&self, threads: usize) -> String {
        format!("{}/{}/{}", self.kind, self.function(threads), self.nodes)
    }

    pub(crate) fn names(&self) -> Vec<String> {
        THREADS.map(|threads| self.name(threads)).to_vec()
    }

    pub(crate) fn build(&self) -> BenchModel {
        let model = (self.build)();
        assert_eq!(model.nodes(), self.nodes, "{} {}", self.kind, self.model);
        model
    }
}

/// All models, small ones first in each kind.
pub(crate) fn rows(large: bool) -> Vec<BenchRow> {
    let mut rows = Vec::new();
    let intact = JointStrength::Unbreakable;
    for kinematics in [Kinematics::Small, Kinematics::Corotational] {
        let name = format!("{kinematics:?}").to_lowercase();
        rows.push(BenchRow::new("forces", name.clone(), 8000, move || forces(kinematics)));
        let shapes = [[2, 2, 2], [4, 4, 4], [10, 10, 10], [20, 20, 20], [40, 40, 20]];
        let count = if large { 5 } else { 4 };
        for shape in shapes.into_iter().take(count) {
            let nodes = 125 * shape.into_iter().product::<u32>() as usize;
            let build = move || lattice(shape, kinematics, intact);
            rows.push(BenchRow::new("step", name.clone(), nodes, build));
        }
    }
    let strengths = [
        JointStrength::None,
        JointStrength::Unbreakable,
        JointStrength::Strong,
        JointStrength::Broken,
    ];
    for strength in strengths {
        for count in [2_u32, 4, 10, 20] {
            let nodes = 125 * count.pow(3) as usize;
            let build = move || lattice([count; 3], Kinematics::Corotational, strength);
            rows.push(BenchRow::new("joints", strength.name(), nodes, build));
        }
    }
    for count in [3_u32, 10, 20] {
        let nodes = 27 * count.pow(3) as usize;
        rows.push(BenchRow::new("relaxation", "blocks", nodes, move || relaxation(count)));
    }
    for count in [3_u32, 10] {
        let nodes = 27 * count.pow(3) as usize;
        rows.push(BenchRow::new("contacts", "deformable", nodes, move || loose(count)));
    }
    for count in [3_u32, 30] {
        let nodes = 8 * count.pow(3) as usize;
        rows.push(BenchRow::new("springs", "blocks", nodes, move || springs(count)));
    }
    for (model, body) in [("deformable", Body::Deformable), ("rigid", Body::Rigid)] {
        // Edges of the region `[m]` and the nodes of its cells.
        for (edge, nodes) in [(1.6, 512), (4.0, 7664), (10.0, 69_200)] {
            rows.push(BenchRow::new("cells", model, nodes, move || cells(edge, body)));
        }
    }
    for (kind, joined) in [("joined", true), ("loose", false)] {
        for count in [4_u32, 22] {
            let nodes = 8 * count.pow(3) as usize;
            rows.push(BenchRow::new("rigid", kind, nodes, move || cubes(count, joined)));
        }
    }
    rows
}
