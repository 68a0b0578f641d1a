//! Faults of a `where` that selects nothing.

use std::sync::Arc;

use super::select::free_centres;
use super::selector::Selector;
use ddem_core::problem::{BlockFace, CellCount, FaceId, Geometry, Lattice, Vec3, moved_to};
use ddem_core::{ErrorCode, Fault};

/// Fault of a `where` that selects nothing.
pub(crate) fn nothing(place: String, what: &str) -> Fault {
    Fault::new(ErrorCode::EmptySelection, place, format!("selects nothing: {what} there"))
        .help(RULES)
}

/// Rules by which planes and ranges select.
const RULES: &str = "planes are met within 1e-6 of the model's size; ranges include their ends";

/// Position as text, in the notation of a deck.
pub(crate) fn coordinates(x: Vec3) -> String {
    // Rounding errors become 0, not -0.
    let [x, y, z] = <[f64; 3]>::from(x).map(|x| (x * 1e6).round() / 1e6 + 0.0);
    format!("[{x}, {y}, {z}]")
}

/// Fault of a selection without blocks; it names the nearest block.
pub(super) fn no_block(fault: Fault, selector: &Selector, lattices: &[Arc<Lattice>]) -> Fault {
    let centres = lattices.iter().filter(|lattice| selector.has_set(lattice.set)).flat_map(|l| {
        let blocks = (0..l.block.len()).filter(|&at| l.has_block(at));
        blocks.map(|at| l.part.as_ref().map_or_else(|| l.centre(l.cell(at)), |part| part.centroid))
    });
    let what = "blocks count by their centroid: that of the nearest is";
    nearest(fault, selector, centres, what)
}

/// Fault of a selection without joints; it names the nearest joint.
pub(super) fn no_joint(fault: Fault, selector: &Selector, lattices: &[Arc<Lattice>]) -> Fault {
    let centres = lattices.iter().filter(|lattice| selector.has_set(lattice.set)).flat_map(|l| {
        let cells = (0..l.block.len()).filter(|&at| l.has_block(at)).map(|at| l.cell(at));
        let sides = cells.flat_map(|cell| (0..3).map(move |d| (cell, d)));
        let next = |cell: [usize; 3], d: usize| {
            let next = moved_to(cell, d, cell[d] + 1);
            next[d] < l.count[d] && l.has_block(l.index(next))
        };
        let inner = sides.filter(move |(cell, d)| next(*cell, *d));
        inner.map(|(cell, d)| l.faces(cell, d)[1].iter().sum::<Vec3>() / 4.0)
    });
    nearest_joint(fault, selector, centres)
}

/// Adds the centre of the nearest of these joints.
pub(crate) fn nearest_joint(
    fault: Fault,
    selector: &Selector,
    centres: impl Iterator<Item = Vec3>,
) -> Fault {
    nearest(fault, selector, centres, "joints count by their centre: that of the nearest is")
}

fn nearest(
    fault: Fault,
    selector: &Selector,
    all: impl Iterator<Item = Vec3>,
    what: &str,
) -> Fault {
    let far = |x: &Vec3| selector.distance(x, x);
    match all.min_by(|a, b| far(a).total_cmp(&far(b))) {
        Some(at) => fault.help(format!("{RULES}; {what} at {}", coordinates(at))),
        None => fault,
    }
}

/// Fault of a selection without outer faces; it names the nearest one.
pub(crate) fn no_face(fault: Fault, selector: &Selector, geometry: &Geometry) -> Fault {
    let blocks = (0..geometry.blocks.len())
        .filter(|&block| !geometry.is_removed(block) && selector.has_set(geometry.set(block)));
    let faces = blocks.flat_map(|block| FaceId::all().map(move |face| BlockFace { block, face }));
    let centres = faces.flat_map(|face| free_centres(geometry, &face));
    nearest(fault, selector, centres, "the nearest outer face has its centre")
}

/// Fault of a selection without nodes; it names the nearest node.
pub(crate) fn no_node(place: String, selector: &Selector, geometry: &Geometry) -> Fault {
    let mut help = RULES.to_owned();
    if let Some((block, node)) = selector.nearest(geometry) {
        let size = (geometry.bounds[1] - geometry.bounds[0]).norm();
        let digits = (4.0 - libm::log10(size).floor()).clamp(0.0, 12.0) as usize;
        let show = |x: Vec3| {
            let [x, y, z] = <[f64; 3]>::from(x).map(|x| format!("{x:.digits$}"));
            format!("[{x}, {y}, {z}]")
        };
        help += &if geometry.is_rigid(block) {
            let centre = show(geometry.centroid(block));
            let block = CellCount::new(geometry).whole_block(geometry, block);
            format!(
                "; ranges take rigid blocks as a whole, by their centroid: the nearest, block {block}, has \
                 it at {centre} and a corner at {}",
                show(node)
            )
        } else {
            format!("; the nearest node is at {}", show(node))
        };
    }
    Fault::new(ErrorCode::EmptySelection, place, "selects nothing: no node there").help(help)
}

impl Selector {
    /// Nearest node and its block, for a `where` that selects nothing.
    pub(crate) fn nearest(&self, geometry: &Geometry) -> Option<(usize, Vec3)> {
        let mut nearest: Option<(f64, (usize, Vec3))> = None;
        for block in 0..geometry.blocks.len() {
            if !self.has_set(geometry.set(block)) {
                continue;
            }
            let lattice = geometry.lattice(block);
            let n = lattice.divisions + 1;
            for local in 0..n * n * n {
                let x = geometry.position(block, [local % n, local / n % n, local / (n * n)]);
                let point = if lattice.rigid { geometry.centroid(block) } else { x };
                let far = self.distance(&x, &point);
                if nearest.is_none_or(|(least, _)| far < least) {
                    nearest = Some((far, (block, x)));
                }
            }
        }
        nearest.map(|(_, found)| found)
    }

    /// Distance of a node from the selector `[m]`: of the node `x` from the planes, and of the point
    /// `point` that counts for it from ranges and shapes.
    pub(crate) fn distance(&self, x: &Vec3, point: &Vec3) -> f64 {
        let out = |axis: usize| {
            // Unlike `clamp`, this accepts any range.
            self.ranges[axis].map_or(0.0, |[from, to]| point[axis] - point[axis].min(to).max(from))
        };
        let off = self.planes.iter().map(|plane| plane.signed_distance(x));
        let all: f64 = off.chain((0..3).map(out)).map(|far| far * far).sum();
        libm::hypot(all.sqrt(), self.beyond_shapes(point))
    }

    /// Distance of a point from the centre of the sphere or the axis of the cylinder, and the radius `[m]`.
    pub(crate) fn off_middle(&self, x: &Vec3) -> Option<[f64; 2]> {
        let sphere = self.sphere.map(|(centre, radius)| [(x - centre).norm(), radius]);
        let cylinder = self.cylinder.map(|([from, to], radius)| {
            let axis = (to - from).normalize();
            [(x - from - axis * (x - from).dot(&axis)).norm(), radius]
        });
        sphere.or(cylinder)
    }
}
