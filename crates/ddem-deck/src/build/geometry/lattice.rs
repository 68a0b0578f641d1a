//! Lattices of sets of blocks: their cuts and gaps, and the cells that a `where` selects in them.

use std::sync::Arc;

use super::Names;
use super::mesh;
use super::selector::{PlaneEquation, Selector};
use crate::schema::names::segment;
use crate::schema::{BlockSet, Body, Deck, JointChoice};
use ddem_core::problem::{Lattice, NO_JOINT, NONE, Vec3};
use ddem_core::{ErrorCode, Fault};

/// Largest number of nodes; node numbers have 32 bits.
pub(super) const MOST_NODES: f64 = u32::MAX as f64;

/// Lattices of all sets, before `assign` and `remove`.
pub(super) fn lattices(deck: &Deck, names: &Names) -> Result<Vec<Arc<Lattice>>, Vec<Fault>> {
    let mut lattices = Vec::new();
    let mut nodes = 0.0;
    for (index, set) in deck.blocks.iter().enumerate() {
        if let Some(mesh) = &set.mesh {
            nodes += mesh.nodes.len() as f64;
            lattices.extend(mesh::lattices((deck, index), mesh, names)?);
            continue;
        }
        let cuts = [0, 1, 2].map(|d| cuts(set, d));
        let cells: f64 = cuts.iter().map(|c| c.count).product();
        nodes += cells * (f64::from(set.elements_along_edge()) + 1.0).powi(3);
        if nodes >= MOST_NODES {
            return Err(too_many(format!("blocks[{index}]"), nodes));
        }
        lattices.push(Arc::new(lattice((deck.set_number(index), set), cuts, names)?));
    }
    Ok(lattices)
}

pub(super) fn too_many(place: String, nodes: f64) -> Vec<Fault> {
    let message = format!("the model would have {nodes:.3e} nodes, more than 4.29e9");
    vec![Fault::new(ErrorCode::TooLarge, place, message).help("fewer blocks or divisions")]
}

/// Keys of a block set for one edge.
struct EdgeCuts {
    count: f64,
    length: f64,
    edges: Option<Vec<f64>>,
}

fn cuts(set: &BlockSet, d: usize) -> EdgeCuts {
    let edges = set.edges.as_ref().and_then(|e| [&e.x, &e.y, &e.z][d].clone());
    match edges {
        Some(edges) => EdgeCuts {
            count: edges.len() as f64 - 1.0,
            length: edges.last().unwrap_or(&0.0) - edges.first().unwrap_or(&0.0),
            edges: Some(edges),
        },
        None => EdgeCuts {
            count: f64::from(set.count()[d]),
            length: set.size.map_or(0.0, |s| s[d]),
            edges: None,
        },
    }
}

fn lattice(
    (number, set): (usize, &BlockSet),
    cuts: [EdgeCuts; 3],
    names: &Names,
) -> Result<Lattice, Vec<Fault>> {
    let count = [0, 1, 2].map(|d| cuts[d].count as usize);
    let cells = count.iter().product();
    let (positions, lengths): (Vec<_>, Vec<_>) = cuts.iter().map(positions).unzip();
    let mut own_joint = [NO_JOINT; 3];
    for (d, own) in own_joint.iter_mut().enumerate() {
        let name = match &set.joint {
            Some(JointChoice::All(name)) => Some(name),
            Some(JointChoice::ByNormal { x, y, z }) => [x, y, z][d].as_ref(),
            None => None,
        };
        if let Some(name) = name {
            *own = names.joint_of(name);
        }
    }
    Ok(Lattice {
        set: number,
        refined: None,
        origin: Vec3::from(set.origin),
        axes: set.directions().map(|a| Vec3::from(a).normalize()),
        divisions: set.elements_along_edge() as usize,
        rigid: set.body == Body::Rigid,
        count,
        gaps: count.map(|n| vec![0.0; n + 1]),
        cuts: positions.try_into().unwrap_or_default(),
        lengths: lengths.try_into().unwrap_or_default(),
        block: vec![0; cells].into(),
        material: Arc::new(vec![names.material_of(&set.material); cells]),
        joint: own_joint.map(|joint| Arc::new(vec![joint; cells])),
        own_joint,
        part: None,
    })
}

impl Selector {
    /// True if a cell is selected (§1 of the deck): its centroid lies in the ranges and shapes, and
    /// each plane contains the centroid or touches a face.
    pub(super) fn selects(&self, lattice: &Lattice, cell: [usize; 3]) -> bool {
        let centre = lattice.centre(cell);
        let touches = |plane: &PlaneEquation| {
            (0..3).any(|d| {
                lattice.faces(cell, d).iter().any(|face| face.iter().all(|x| plane.has(x)))
            })
        };
        self.in_ranges(&centre)
            && self.planes.iter().all(|plane| plane.has(&centre) || touches(plane))
    }

    pub(super) fn assign_joint(&self, lattice: &mut Lattice, joint: u16) -> bool {
        let mut found = false;
        for d in 0..3 {
            let normal = lattice.normal(d);
            for index in 0..lattice.block.len() {
                let cell = lattice.cell(index);
                if cell[d] + 1 == lattice.count[d] {
                    continue;
                }
                let centre = lattice.faces(cell, d)[1].iter().sum::<Vec3>() / 4.0;
                if self.contains_face(&centre, &normal) {
                    Arc::make_mut(&mut lattice.joint[d])[index] = joint;
                    found = true;
                }
            }
        }
        found
    }

    pub(super) fn assign_material(&self, lattice: &mut Lattice, material: u16) -> bool {
        let mut found = false;
        for index in 0..lattice.block.len() {
            if self.selects(lattice, lattice.cell(index)) {
                Arc::make_mut(&mut lattice.material)[index] = material;
                found = true;
            }
        }
        found
    }

    pub(super) fn remove(&self, lattice: &mut Lattice) -> bool {
        let mut found = false;
        for index in 0..lattice.block.len() {
            if lattice.has_block(index) && self.selects(lattice, lattice.cell(index)) {
                lattice.block[index] = NONE;
                found = true;
            }
        }
        found
    }
}

/// Sets the gaps of the joints. All joints of a lattice plane share one thickness, which is
/// measured along the normal.
pub(super) fn open_gaps(lattice: &mut Lattice, deck: &Deck, names: &Names) -> Vec<Fault> {
    let mut faults = Vec::new();
    let place = deck.set_place(lattice.set);
    let thickness: Vec<f64> = deck.joints.values().map(|joint| joint.thickness).collect();
    for d in 0..3 {
        let slant = lattice.normal(d).dot(&lattice.axes[d]);
        let mut first = vec![NO_JOINT; lattice.count[d] + 1];
        for index in 0..lattice.block.len() {
            let plane = lattice.cell(index)[d] + 1;
            if plane == lattice.count[d] {
                continue;
            }
            let joint = lattice.joint[d][index];
            if first[plane] == NO_JOINT {
                first[plane] = joint;
                lattice.gaps[d][plane] = thickness[joint as usize] / slant;
            } else if thickness[joint as usize] != thickness[first[plane] as usize] {
                let other = names.joint_name(first[plane]);
                faults.push(
                    Fault::new(
                        ErrorCode::ThickJoint,
                        format!("joints.{}.thickness", segment(names.joint_name(joint))),
                        format!(
                            "{} m, but joint `{other}` on the same plane ({} = {} of {place}) \
                             has {} m: thickness belongs to a lattice plane",
                            thickness[joint as usize],
                            ["x", "y", "z"][d],
                            lattice.cuts[d][plane],
                            thickness[first[plane] as usize],
                        ),
                    )
                    .help("give all joints on one plane the same thickness"),
                );
                // One such fault is enough.
                return faults;
            }
        }
        for cell in 0..lattice.count[d] {
            let gaps = (lattice.gaps[d][cell] + lattice.gaps[d][cell + 1]) / 2.0;
            let edge = lattice.lengths[d][cell];
            if gaps >= edge && lattice.count[d] > 1 {
                faults.push(too_thick(lattice, d, cell, deck, names, edge));
                break;
            }
        }
    }
    faults
}

fn too_thick(
    lattice: &Lattice,
    d: usize,
    cell: usize,
    deck: &Deck,
    names: &Names,
    edge: f64,
) -> Fault {
    let plane = if lattice.gaps[d][cell] > lattice.gaps[d][cell + 1] { cell } else { cell + 1 };
    let above = (0..lattice.block.len()).find(|&i| lattice.cell(i)[d] + 1 == plane);
    let name = above.map_or("", |i| names.joint_name(lattice.joint[d][i]));
    let thickness = deck.joints.get(name).map_or(0.0, |joint| joint.thickness);
    let axis = ["x", "y", "z"][d];
    if let Some(index) = lattice.refined {
        let message = format!(
            "parts of {edge} m along {axis} leave no room for joint `{name}` of {thickness} m"
        );
        return Fault::new(ErrorCode::ThickJoint, format!("refine[{index}].factor"), message)
            .help("a smaller factor, or a thinner joint");
    }
    Fault::new(
        ErrorCode::ThickJoint,
        format!("joints.{}.thickness", segment(name)),
        format!(
            "{thickness} m is not smaller than the block edge {edge} m that it narrows along \
             {axis}"
        ),
    )
    .help("the joints on both sides must leave a part of the block between them")
}

/// Positions of the cuts and lengths of the cells between them.
fn positions(cuts: &EdgeCuts) -> (Vec<f64>, Vec<f64>) {
    if let Some(edges) = &cuts.edges {
        let mut lengths: Vec<f64> = edges.windows(2).map(|w| w[1] - w[0]).collect();
        // Lengths that differ only by rounding become equal, so that equal blocks share their
        // tables.
        let mut order: Vec<usize> = (0..lengths.len()).collect();
        order.sort_by(|&a, &b| lengths[a].total_cmp(&lengths[b]));
        for pair in order.windows(2) {
            if lengths[pair[1]] - lengths[pair[0]] <= 1e-13 * cuts.length {
                lengths[pair[1]] = lengths[pair[0]];
            }
        }
        return (edges.clone(), lengths);
    }
    let n = cuts.count as usize;
    let at = |i: usize| cuts.length * i as f64 / cuts.count;
    ((0..=n).map(at).collect(), vec![cuts.length / cuts.count; n])
}
