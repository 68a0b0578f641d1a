//! The lattice of one block set.

use super::region::{Flat, Region};
use super::{Names, Vec3};
use crate::deck::names::segment;
use crate::deck::{BlockSet, Body, Deck, JointChoice};
use crate::error::Fault;

/// No body: there is nothing.
pub(crate) const NONE: u32 = u32::MAX;
/// No body: a coarser or finer lattice has what is there.
pub(crate) const ELSEWHERE: u32 = u32::MAX - 1;
pub(super) const NO_JOINT: u16 = u16::MAX;
/// Nodes are numbered by 32 bits.
pub(super) const MOST_NODES: f64 = u32::MAX as f64;

/// Cells between joint planes; nodes on lines along three edges.
#[derive(Clone, Debug)]
pub(crate) struct Lattice {
    /// The block set that it is of.
    pub(crate) set: usize,
    /// The entry of `refine` that made it of coarser blocks.
    pub(super) refined: Option<usize>,
    pub(crate) origin: Vec3,
    /// Unit vectors along the three edges.
    pub(crate) axes: [Vec3; 3],
    /// Elements along each edge of a block; 1 where blocks are rigid.
    pub(crate) divisions: usize,
    /// Blocks do not deform (§8).
    pub(crate) rigid: bool,
    /// Cells along each edge.
    pub(crate) count: [usize; 3],
    /// Positions of the cuts along each edge, shape `(count + 1)` `[m]`.
    pub(crate) cuts: [Vec<f64>; 3],
    /// Lengths of the cells along each edge, equal where the cuts are evenly spaced `[m]`.
    pub(super) lengths: [Vec<f64>; 3],
    /// Width of the gap at each cut along the edge, shape `(count + 1)` `[m]`.
    pub(crate) gaps: [Vec<f64>; 3],
    /// Body in each cell, or [`NONE`] or [`ELSEWHERE`]; x fastest.
    pub(crate) body: Vec<u32>,
    /// Material of each cell.
    pub(crate) material: Vec<u16>,
    /// Joint at the upper side of each cell, by the direction of its normal.
    pub(super) joint: [Vec<u16>; 3],
    /// The joint that the set has by the direction of the normal: at its outer faces, too.
    pub(super) own_joint: [u16; 3],
}

/// The lattices of all sets, before `assign` and `remove`.
pub(crate) fn lattices(deck: &Deck, names: &Names) -> Result<Vec<Lattice>, Vec<Fault>> {
    let mut lattices = Vec::new();
    let mut nodes = 0.0;
    for (index, set) in deck.blocks.iter().enumerate() {
        let cuts = [0, 1, 2].map(|d| cuts(set, d));
        let cells: f64 = cuts.iter().map(|c| c.count).product();
        nodes += cells * (f64::from(set.elements_along_edge()) + 1.0).powi(3);
        if nodes >= MOST_NODES {
            return Err(too_many(format!("blocks[{index}]"), nodes));
        }
        lattices.push(Lattice::new((index, set), cuts, names));
    }
    Ok(lattices)
}

pub(super) fn too_many(place: String, nodes: f64) -> Vec<Fault> {
    let message = format!("the model would have {nodes:.3e} nodes, more than 4.29e9");
    vec![Fault::new(place, message).help("fewer blocks or divisions")]
}

/// What a set says of one edge.
struct Cuts {
    count: f64,
    length: f64,
    edges: Option<Vec<f64>>,
}

fn cuts(set: &BlockSet, d: usize) -> Cuts {
    let edges = set.edges.as_ref().and_then(|e| [&e.x, &e.y, &e.z][d].clone());
    match edges {
        Some(edges) => Cuts {
            count: edges.len() as f64 - 1.0,
            length: edges.last().unwrap_or(&0.0) - edges.first().unwrap_or(&0.0),
            edges: Some(edges),
        },
        None => Cuts {
            count: set.count.map_or(1.0, |c| f64::from(c[d])),
            length: set.size.map_or(0.0, |s| s[d]),
            edges: None,
        },
    }
}

impl Lattice {
    fn new((index, set): (usize, &BlockSet), cuts: [Cuts; 3], names: &Names) -> Self {
        let count = [0, 1, 2].map(|d| cuts[d].count as usize);
        let cells = count.iter().product();
        let (positions, lengths): (Vec<_>, Vec<_>) = cuts.iter().map(positions).unzip();
        let own_joint = [0, 1, 2].map(|d| {
            let name = match &set.joint {
                Some(JointChoice::All(name)) => Some(name),
                Some(JointChoice::ByNormal { x, y, z }) => [x, y, z][d].as_ref(),
                None => None,
            };
            name.and_then(|name| names.joint(name)).unwrap_or(NO_JOINT)
        });
        Self {
            set: index,
            refined: None,
            origin: Vec3::from(set.origin),
            axes: set.directions().map(|a| Vec3::from(a).normalize()),
            divisions: set.elements_along_edge() as usize,
            rigid: set.body == Body::Rigid,
            count,
            gaps: count.map(|n| vec![0.0; n + 1]),
            cuts: positions.try_into().unwrap_or_default(),
            lengths: lengths.try_into().unwrap_or_default(),
            body: vec![0; cells],
            material: vec![names.material(&set.material).unwrap_or(0); cells],
            joint: own_joint.map(|joint| vec![joint; cells]),
            own_joint,
        }
    }

    pub(crate) fn index(&self, cell: [usize; 3]) -> usize {
        cell[0] + self.count[0] * (cell[1] + self.count[1] * cell[2])
    }

    pub(crate) fn cell(&self, index: usize) -> [usize; 3] {
        let [nx, ny, _] = self.count;
        [index % nx, index / nx % ny, index / (nx * ny)]
    }

    /// Whether a block is in a cell.
    pub(crate) fn has_body(&self, index: usize) -> bool {
        self.body[index] < ELSEWHERE
    }

    pub(crate) fn nodes_per_body(&self) -> usize {
        (self.divisions + 1).pow(3)
    }

    /// Element size along an edge in a cell `[m]`.
    pub(crate) fn spacing(&self, d: usize, cell: usize) -> f64 {
        let gaps = self.gaps[d][cell] / 2.0 + self.gaps[d][cell + 1] / 2.0;
        (self.lengths[d][cell] - gaps) / self.divisions as f64
    }

    /// Area of one element of the joint at the upper side of a cell along d `[m²]`. Between rigid
    /// blocks it reaches to the middle of the gaps around, where there are no strips.
    pub(crate) fn joint_area(&self, cell: [usize; 3], d: usize) -> f64 {
        let edge = |e: usize| {
            let whole =
                if self.rigid { self.lengths[e][cell[e]] } else { self.spacing(e, cell[e]) };
            self.axes[e] * whole
        };
        edge((d + 1) % 3).cross(&edge((d + 2) % 3)).norm()
    }

    /// Position along an edge of the i-th line of nodes in a cell `[m]`.
    pub(crate) fn line(&self, d: usize, cell: usize, i: usize) -> f64 {
        if i == self.divisions {
            self.cuts[d][cell + 1] - self.gaps[d][cell + 1] / 2.0
        } else {
            self.cuts[d][cell] + self.gaps[d][cell] / 2.0 + i as f64 * self.spacing(d, cell)
        }
    }

    /// The point with these positions along the three edges `[m]`.
    pub(crate) fn point(&self, along: [f64; 3]) -> Vec3 {
        self.origin + self.axes[0] * along[0] + self.axes[1] * along[1] + self.axes[2] * along[2]
    }

    /// Unit normal of the planes that cut edge d, pointing to its upper end.
    pub(crate) fn normal(&self, d: usize) -> Vec3 {
        let n = self.axes[(d + 1) % 3].cross(&self.axes[(d + 2) % 3]).normalize();
        if n.dot(&self.axes[d]) < 0.0 { -n } else { n }
    }

    /// Whether elements are boxes along the coordinate axes.
    pub(crate) fn is_box(&self) -> bool {
        (0..3).all(|d| (0..3).all(|k| d == k || self.axes[d][k] == 0.0))
    }

    /// Joint at the upper side of a cell along d.
    pub(crate) fn joint_above(&self, cell: [usize; 3], d: usize) -> u16 {
        self.joint[d][self.index(cell)]
    }

    /// Centre of a cell `[m]`.
    pub(crate) fn centre(&self, cell: [usize; 3]) -> Vec3 {
        self.point([0, 1, 2].map(|d| (self.cuts[d][cell[d]] + self.cuts[d][cell[d] + 1]) / 2.0))
    }

    /// Corners of the lower (0) and upper (1) nominal faces of a cell along d.
    pub(super) fn faces(&self, cell: [usize; 3], d: usize) -> [[Vec3; 4]; 2] {
        let (e, f) = ((d + 1) % 3, (d + 2) % 3);
        [0, 1].map(|side| {
            [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(i, k)| {
                let mut along = [0.0; 3];
                along[d] = self.cuts[d][cell[d] + side];
                along[e] = self.cuts[e][cell[e] + i];
                along[f] = self.cuts[f][cell[f] + k];
                self.point(along)
            })
        })
    }

    /// Cells selected as §1 of the deck says: the centroid lies inside, or a plane touches a face.
    pub(super) fn selects(&self, region: &Region, cell: [usize; 3]) -> bool {
        let centre = self.centre(cell);
        let touches = |plane: &Flat| {
            (0..3).any(|d| self.faces(cell, d).iter().any(|face| face.iter().all(|x| plane.has(x))))
        };
        region.in_ranges(&centre)
            && region.planes.iter().all(|plane| plane.has(&centre) || touches(plane))
    }

    pub(super) fn assign_joint(&mut self, region: &Region, joint: u16) -> bool {
        let mut found = false;
        for d in 0..3 {
            let normal = self.normal(d);
            for index in 0..self.body.len() {
                let cell = self.cell(index);
                if cell[d] + 1 == self.count[d] {
                    continue;
                }
                let centre = self.faces(cell, d)[1].iter().sum::<Vec3>() / 4.0;
                if region.contains_face(&centre, &normal) {
                    self.joint[d][index] = joint;
                    found = true;
                }
            }
        }
        found
    }

    pub(super) fn assign_material(&mut self, region: &Region, material: u16) -> bool {
        let mut found = false;
        for index in 0..self.body.len() {
            if self.selects(region, self.cell(index)) {
                self.material[index] = material;
                found = true;
            }
        }
        found
    }

    pub(super) fn remove(&mut self, region: &Region) -> bool {
        let mut found = false;
        for index in 0..self.body.len() {
            if self.has_body(index) && self.selects(region, self.cell(index)) {
                self.body[index] = NONE;
                found = true;
            }
        }
        found
    }

    /// Opens the gaps: thickness belongs to a plane, and is measured along its normal.
    pub(super) fn open_gaps(&mut self, deck: &Deck, names: &Names) -> Vec<Fault> {
        let mut faults = Vec::new();
        let place = format!("blocks[{}]", self.set);
        let thickness: Vec<f64> = deck.joints.values().map(|joint| joint.thickness).collect();
        for d in 0..3 {
            let slant = self.normal(d).dot(&self.axes[d]);
            let mut first = vec![NO_JOINT; self.count[d] + 1];
            for index in 0..self.body.len() {
                let plane = self.cell(index)[d] + 1;
                if plane == self.count[d] {
                    continue;
                }
                let joint = self.joint[d][index];
                if first[plane] == NO_JOINT {
                    first[plane] = joint;
                    self.gaps[d][plane] = thickness[joint as usize] / slant;
                } else if thickness[joint as usize] != thickness[first[plane] as usize] {
                    let other = names.joint_name(first[plane]);
                    faults.push(
                        Fault::new(
                            format!("joints.{}.thickness", segment(names.joint_name(joint))),
                            format!(
                                "{} m, but joint `{other}` on the same plane ({} = {} of {place}) \
                                 has {} m: thickness belongs to a lattice plane",
                                thickness[joint as usize],
                                ["x", "y", "z"][d],
                                self.cuts[d][plane],
                                thickness[first[plane] as usize],
                            ),
                        )
                        .help("give all joints on one plane the same thickness"),
                    );
                    // One such fault says it all.
                    return faults;
                }
            }
            for cell in 0..self.count[d] {
                let gaps = (self.gaps[d][cell] + self.gaps[d][cell + 1]) / 2.0;
                let edge = self.lengths[d][cell];
                if gaps >= edge && self.count[d] > 1 {
                    faults.push(self.too_thick(d, cell, deck, names, edge));
                    break;
                }
            }
        }
        faults
    }

    fn too_thick(&self, d: usize, cell: usize, deck: &Deck, names: &Names, edge: f64) -> Fault {
        let plane = if self.gaps[d][cell] > self.gaps[d][cell + 1] { cell } else { cell + 1 };
        let above = (0..self.body.len()).find(|&i| self.cell(i)[d] + 1 == plane);
        let name = above.map_or("", |i| names.joint_name(self.joint[d][i]));
        let thickness = deck.joints.get(name).map_or(0.0, |joint| joint.thickness);
        let axis = ["x", "y", "z"][d];
        if let Some(index) = self.refined {
            let message = format!(
                "parts of {edge} m along {axis} leave no room for joint `{name}` of {thickness} m"
            );
            return Fault::new(format!("refine[{index}].factor"), message)
                .help("a smaller factor, or a thinner joint");
        }
        Fault::new(
            format!("joints.{}.thickness", segment(name)),
            format!(
                "{thickness} m is not smaller than the block edge {edge} m that it narrows along \
                 {axis}"
            ),
        )
        .help("the joints on both sides must leave a body between them")
    }

    /// Memory `[bytes]`.
    pub(super) fn bytes(&self) -> usize {
        let numbers = [&self.cuts, &self.lengths, &self.gaps].into_iter().flatten();
        let joints = self.joint.iter().map(|joint| size_of_val(&joint[..])).sum::<usize>();
        numbers.map(|numbers| size_of_val(&numbers[..])).sum::<usize>()
            + joints
            + size_of_val(&self.body[..])
            + size_of_val(&self.material[..])
    }

    /// Shortest edge of a cell `[m]`.
    pub(super) fn shortest(&self) -> f64 {
        self.lengths.iter().flatten().copied().fold(f64::INFINITY, f64::min)
    }

    /// The eight corners of a range of cells.
    pub(super) fn corners_of(&self, from: [usize; 3], to: [usize; 3]) -> [Vec3; 8] {
        std::array::from_fn(|k| {
            let end = |d: usize| if k & (1 << d) == 0 { from[d] } else { to[d] };
            self.point([0, 1, 2].map(|d| self.cuts[d][end(d)]))
        })
    }

    pub(super) fn corners(&self) -> [Vec3; 8] {
        self.corners_of([0; 3], self.count)
    }
}

/// Positions of the cuts and lengths of the cells between them.
fn positions(cuts: &Cuts) -> (Vec<f64>, Vec<f64>) {
    if let Some(edges) = &cuts.edges {
        let mut lengths: Vec<f64> = edges.windows(2).map(|w| w[1] - w[0]).collect();
        // Lengths equal to rounding become equal, so that equal blocks share their tables.
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

pub(super) fn bounds_of(points: &[Vec3]) -> [Vec3; 2] {
    let start = [Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY)];
    points.iter().fold(start, |[low, high], x| [low.inf(x), high.sup(x)])
}

/// Corners of the box around all lattices.
pub(super) fn bounds(lattices: &[Lattice]) -> [Vec3; 2] {
    bounds_of(&lattices.iter().flat_map(Lattice::corners).collect::<Vec<_>>())
}
