//! Meshes of the result files, with their constant fields.

use ddem_core::Model;

use crate::vtkhdf::{Cells, Constant, Grid, Location};

/// Mesh with constant fields of one whole number each.
pub(super) struct OutputMesh {
    pub(super) grid: Grid,
    fields: Vec<(&'static str, Location, Vec<i32>)>,
}

impl OutputMesh {
    pub(super) fn constants(&self) -> Vec<Constant<'_>> {
        let fields = self.fields.iter();
        fields
            .map(|(name, location, values)| Constant { name, location: *location, values })
            .collect()
    }
}

/// Mesh of the hex8 elements of the blocks; points are reference positions.
pub(super) fn blocks(model: &Model) -> OutputMesh {
    let points = (0..model.n_nodes()).map(|node| model.point(node)).collect();
    let cells = (0..model.n_blocks()).flat_map(|block| model.hexes(block)).collect();
    let per_cell = |value: &dyn Fn(usize) -> i32| -> Vec<i32> {
        let of = |block| std::iter::repeat_n(value(block), model.elements_of(block).len());
        (0..model.n_blocks()).flat_map(of).collect()
    };
    let block = per_cell(&|block| model.whole_block(block) as i32);
    let material = per_cell(&|block| i32::from(model.material(block)));
    let mut fields = vec![("block", Location::Cell, block), ("material", Location::Cell, material)];
    if (0..model.n_blocks()).any(|block| model.is_rigid(block)) {
        let rigid = per_cell(&|block| i32::from(model.is_rigid(block)));
        fields.push(("rigid", Location::Cell, rigid));
    }
    let cell = |block: usize| model.geometry().part(block).map(|part| part.cell);
    if (0..model.n_blocks()).any(|block| cell(block).is_some()) {
        let cell = per_cell(&|block| number(cell(block)));
        fields.push(("cell", Location::Cell, cell));
    }
    OutputMesh { grid: Grid { points, cells: Cells::Hexahedra(cells) }, fields }
}

/// Mesh of the joint elements as seen along their normals; points lie between the nodes of each
/// pair.
pub(super) fn joints(model: &Model) -> OutputMesh {
    let points = model.pairs().map(|pair| pair.point).collect();
    let joint = model.pairs().map(|pair| i32::from(pair.joint)).collect();
    let mut fields = vec![("joint", Location::Point, joint)];
    if model.pairs().any(|pair| pair.cut.is_some()) {
        let cut = model.pairs().map(|pair| number(pair.cut)).collect();
        fields.push(("cut", Location::Point, cut));
    }
    OutputMesh { grid: Grid { points, cells: Cells::Quads(model.quads().collect()) }, fields }
}

/// A number, or −1 if there is none.
fn number(of: Option<u32>) -> i32 {
    of.map_or(-1, |of| of as i32)
}
