//! Tree of the boxes of cells: a cell that is cut keeps its box, below which its two parts hang.

use std::collections::HashMap;

use nalgebra::Vector3;

use crate::plane::CutPlane;

/// Box along the axes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AxisBox {
    centre: Vector3<f64>,
    half: Vector3<f64>,
}

impl AxisBox {
    /// Smallest box around points.
    pub(crate) fn around<'a>(points: impl Iterator<Item = &'a Vector3<f64>>) -> Self {
        let far = Vector3::repeat(f64::INFINITY);
        let (low, high) = points.fold((far, -far), |(low, high), x| (low.inf(x), high.sup(x)));
        Self { centre: (low + high) / 2.0, half: (high - low) / 2.0 }
    }

    /// Smallest box around the boxes of cells.
    fn of(parts: &[(u32, Self)]) -> Self {
        let far = Vector3::repeat(f64::INFINITY);
        let (low, high) = parts.iter().fold((far, -far), |(low, high), (_, part)| {
            (low.inf(&part.low()), high.sup(&part.high()))
        });
        Self { centre: (low + high) / 2.0, half: (high - low) / 2.0 }
    }

    pub(crate) fn low(&self) -> Vector3<f64> {
        self.centre - self.half
    }

    pub(crate) fn high(&self) -> Vector3<f64> {
        self.centre + self.half
    }

    /// True if another box comes nearer than `margin`.
    pub(crate) fn overlaps(&self, other: &Self, margin: f64) -> bool {
        let apart = (self.centre - other.centre).abs() - self.half - other.half;
        apart.max() <= margin
    }

    /// True if a plane comes nearer than `margin`.
    fn meets(&self, plane: &CutPlane, margin: f64) -> bool {
        plane.height(&self.centre).abs() <= plane.normal.abs().dot(&self.half) + margin
    }
}

/// Node of the tree.
#[derive(Clone, Copy, Debug)]
struct TreeNode {
    bounds: AxisBox,
    below: Below,
}

/// Contents of a node.
#[derive(Clone, Copy, Debug)]
enum Below {
    /// A cell that exists.
    Cell(u32),
    /// Two nodes, the first of which has this number.
    Nodes(u32),
}

/// Tree of boxes. A plane visits only the branches whose boxes it meets.
#[derive(Clone, Debug, Default)]
pub(crate) struct CellTree {
    nodes: Vec<TreeNode>,
    n_roots: usize,
}

impl CellTree {
    /// Adds a cell that is part of no other. All such cells come before the first division.
    pub(crate) fn add_root(&mut self, cell: u32, bounds: AxisBox) {
        self.nodes.push(TreeNode { bounds, below: Below::Cell(cell) });
        self.n_roots = self.nodes.len();
    }

    /// Number of a node and of its cell, for all cells whose boxes a plane meets, and a box around
    /// its part if it has one.
    pub(crate) fn met(
        &self,
        plane: &CutPlane,
        part: Option<&AxisBox>,
        margin: f64,
        met: &mut Vec<(u32, u32)>,
    ) {
        met.clear();
        let mut open: Vec<u32> = (0..self.n_roots as u32).rev().collect();
        while let Some(number) = open.pop() {
            let node = &self.nodes[number as usize];
            let beside = part.is_some_and(|part| !node.bounds.overlaps(part, margin));
            if beside || !node.bounds.meets(plane, margin) {
                continue;
            }
            match node.below {
                Below::Cell(cell) => met.push((number, cell)),
                Below::Nodes(first) => open.extend([first + 1, first]),
            }
        }
    }

    /// Node of each cell.
    pub(crate) fn leaves(&self) -> HashMap<u32, u32> {
        let nodes = self.nodes.iter().zip(0..);
        let leaf = |(node, number): (&TreeNode, u32)| match node.below {
            Below::Cell(cell) => Some((cell, number)),
            Below::Nodes(_) => None,
        };
        nodes.filter_map(leaf).collect()
    }

    /// Replaces the cell of a node by several parts, halved along the longest side of their box.
    pub(crate) fn replace(&mut self, node: u32, parts: Vec<(u32, AxisBox)>) {
        let mut open = vec![(node, parts)];
        while let Some((node, mut parts)) = open.pop() {
            let bounds = AxisBox::of(&parts);
            if let [(cell, own)] = parts[..] {
                self.nodes[node as usize] = TreeNode { bounds: own, below: Below::Cell(cell) };
                continue;
            }
            let axis = bounds.half.imax();
            parts.sort_by(|a, b| a.1.centre[axis].total_cmp(&b.1.centre[axis]).then(a.0.cmp(&b.0)));
            let upper = parts.split_off(parts.len() / 2);
            let first = self.nodes.len() as u32;
            self.nodes[node as usize] = TreeNode { bounds, below: Below::Nodes(first) };
            // Both are replaced below.
            let empty = TreeNode { bounds, below: Below::Cell(0) };
            self.nodes.extend([empty, empty]);
            open.extend([(first, parts), (first + 1, upper)]);
        }
    }

    /// Replaces the cell of a node by its two parts.
    pub(crate) fn divide(&mut self, node: u32, parts: [(u32, AxisBox); 2]) {
        self.nodes[node as usize].below = Below::Nodes(self.nodes.len() as u32);
        self.nodes
            .extend(parts.map(|(cell, bounds)| TreeNode { bounds, below: Below::Cell(cell) }));
    }
}
