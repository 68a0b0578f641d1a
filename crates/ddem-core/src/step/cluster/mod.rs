//! §7: fictitious masses of relaxation, coupled across the gaps.
//!
//! The nodes that face each other across one, two or three gaps are a cluster of 2, 4 or 8, held
//! together by thin and therefore stiff cells. The mass of a cluster is its own block of the
//! stiffness, one component at a time, scaled so that Δt = 1 is stable for the whole: then the
//! number of steps does not depend on the thickness. A node inside a body is a cluster of one.

mod meeting;
mod rigid;
mod turning;

use std::collections::HashMap;

use fearless_simd::Simd;
use fearless_simd_macros::simd;
use nalgebra::SMatrix;
use rayon::prelude::*;

use crate::error::RunError;
use crate::model::Model;
use crate::state::Memory;
use ddem_joint::contact::Surfaces;
use ddem_mechanics::collide::FaceOf;
use ddem_mechanics::element::corotation::Frame;
use ddem_mechanics::math::lanes::{LANES, Lanes, load_at, store_at, zero};
use ddem_mechanics::rigid::Pose;
use ddem_mesh::assembly::{Element, NO_TABLE};
use ddem_mesh::pack::Neighbours;

pub(crate) use meeting::Meeting;
use meeting::contact_diagonal;
pub(crate) use turning::has_turned;

/// Partner of a node across the directions of `part`, bits 1 = x, 2 = y, 4 = z.
#[derive(Clone, Copy, Debug)]
pub(super) struct Partner {
    /// Directions that are crossed.
    part: usize,
    /// Where the partner's body is: place in [`Clusters::beside`].
    beside: usize,
    /// Local number in the partner's body.
    local: usize,
}

/// Rows of the inverse masses of a pack's nodes.
#[derive(Clone, Debug, Default)]
pub(super) struct InverseMass {
    /// First row of each node, shape `(nodes + 1)`.
    pub(super) start: Vec<u32>,
    /// Partners of each row; the first row of a node is its own.
    pub(super) partner: Vec<Partner>,
    /// Three components a row `[m/N]`.
    pub(super) rows: Vec<Lanes>,
    /// Part of the rotation of each row's body in the mean of its cluster.
    shares: Vec<Lanes>,
}

/// How a relaxation is going.
#[derive(Clone, Debug)]
pub(crate) struct Relaxation {
    pub(crate) memory: Memory,
    pub(crate) clusters: Clusters,
}

/// Packs whose masses are made together.
const TOGETHER: usize = 1024;

/// `K[(a, c), (a ^ r, c)]` of one element: by corner a, partner bits r, component c.
type Coupling = [[[f64; 3]; 8]; 8];

/// What the masses of a node or a block follow from.
#[derive(Clone, Copy)]
struct Around<'a> {
    model: &'a Model,
    couplings: &'a [Coupling],
    /// Degrees of freedom that are held.
    held: &'a HashMap<u32, [bool; 3]>,
    /// Where blocks may meet.
    surfaces: Option<&'a Surfaces>,
    meeting: Meeting,
}

/// Inverse masses of one pack.
enum Masses {
    Deformable(InverseMass),
    Rigid(Box<rigid::Inverses>),
}

impl Masses {
    fn new(around: Around<'_>, pack: usize) -> Result<Self, RunError> {
        if around.model.packs.packs[pack].rigid {
            return Ok(Self::Rigid(Box::new(rigid::inverses(around, pack))));
        }
        InverseMass::new(around, pack).map(Self::Deformable)
    }
}

/// Inverse masses of all packs, equal ones once.
#[derive(Clone, Debug, Default)]
pub(crate) struct Clusters {
    pub(super) classes: Vec<InverseMass>,
    pub(super) of_pack: Vec<u32>,
    /// Of rigid bodies, pack by pack of these.
    rigid: Vec<rigid::Inverses>,
    pub(crate) meeting: Meeting,
    /// The bodies around those of each pack: by place, three times as many from direction to direction (0: the
    /// same cell, 1: the one above, 2: the one below).
    beside: Vec<[Neighbours; 27]>,
    /// Frames of the packs, where masses turn with them.
    pub(crate) turned: Vec<Frame>,
}

impl Clusters {
    /// Of a model some of whose degrees of freedom are held: those have no inverse mass.
    pub(crate) fn new(
        model: &Model,
        held: &HashMap<u32, [bool; 3]>,
        meeting: Meeting,
        stop: &dyn Fn() -> bool,
    ) -> Result<Self, RunError> {
        let couplings: Vec<Coupling> = model.assembly.elements.iter().map(coupling).collect();
        let surfaces = model.contact.as_ref().filter(|_| meeting.any);
        let around = Around { model, couplings: &couplings, held, surfaces, meeting };
        let packs = 0..model.packs.packs.len();
        let beside = packs.into_par_iter().map(|pack| beside(model, pack)).collect();
        let mut clusters = Self { meeting, beside, ..Self::default() };
        let mut known: HashMap<Vec<u64>, u32> = HashMap::new();
        let packs: Vec<usize> = (0..model.packs.packs.len()).collect();
        for packs in packs.chunks(TOGETHER) {
            if stop() {
                return Err(RunError::Stopped);
            }
            // Many at a time, of which equal ones are then left out: memory stays small.
            let made = packs.par_iter().map(|&pack| Masses::new(around, pack));
            for masses in made.collect::<Result<Vec<_>, _>>()? {
                clusters.take(masses, &mut known);
            }
        }
        Ok(clusters)
    }

    fn take(&mut self, masses: Masses, known: &mut HashMap<Vec<u64>, u32>) {
        match masses {
            Masses::Rigid(inverses) => {
                self.rigid.push(*inverses);
                self.of_pack.push(u32::MAX);
            }
            Masses::Deformable(mass) => {
                let parts = mass.partner.iter().map(|p| p.part as u64);
                let numbers = mass.rows.iter().flat_map(|row| row.0.map(f64::to_bits));
                let key = parts.chain(numbers).collect();
                let classes = &mut self.classes;
                self.of_pack.push(*known.entry(key).or_insert_with(|| {
                    classes.push(mass);
                    classes.len() as u32 - 1
                }));
            }
        }
    }

    /// Multiplies all inverse masses.
    pub(crate) fn scale(&mut self, factor: f64) {
        for row in self.classes.iter_mut().flat_map(|class| &mut class.rows) {
            row.0.iter_mut().for_each(|x| *x *= factor);
        }
        self.rigid.iter_mut().flatten().for_each(|inverse| *inverse *= factor);
    }
}

/// Places of the cells above in [`Clusters::beside`], by direction.
const POWERS: [usize; 3] = [1, 3, 9];

/// As in [`Clusters::beside`].
fn beside(model: &Model, pack: usize) -> [Neighbours; 27] {
    std::array::from_fn(|place| {
        let step = POWERS.map(|power| [0, 1, -1][place / power % 3]);
        model.packs.neighbours(&model.geometry, &model.packs.packs[pack], step)
    })
}

fn coupling(element: &Element) -> Coupling {
    // Corners with x fastest, to VTK order.
    const VTK: [usize; 8] = [0, 1, 3, 2, 4, 5, 7, 6];
    let dense = element.modal.dense();
    std::array::from_fn(|a| {
        std::array::from_fn(|r| [0, 1, 2].map(|c| dense[(3 * VTK[a] + c, 3 * VTK[a ^ r] + c)]))
    })
}

impl InverseMass {
    fn new(around: Around<'_>, index: usize) -> Result<Self, RunError> {
        let model = around.model;
        let pack = &model.packs.packs[index];
        let n = model.packs.shape_of(pack).divisions;
        let mut mass = Self { start: vec![0], ..Self::default() };
        let steps =
            (0..=n).flat_map(|k| (0..=n).flat_map(move |j| (0..=n).map(move |i| [i, j, k])));
        for at in steps {
            let mut rows = [[[0.0; 3]; 8]; LANES];
            for (row, &body) in rows.iter_mut().zip(&pack.bodies).take(pack.filled) {
                *row = inverse_row(around, body as usize, at)?;
            }
            let first = mass.partner.len();
            for part in 0..8 {
                let used = rows.iter().any(|row| row[part] != [0.0; 3]);
                if part != 0 && !used {
                    continue;
                }
                let crossed = (0..3).filter(|d| part >> d & 1 == 1);
                let beside = crossed.map(|d| POWERS[d] * if at[d] == n { 1 } else { 2 }).sum();
                let there = across(at, part, n);
                let local = there[0] + (n + 1) * (there[1] + (n + 1) * there[2]);
                mass.partner.push(Partner { part, beside, local });
                mass.rows.extend((0..3).map(|c| Lanes(rows.map(|row| row[part][c]))));
            }
            debug_assert!(first < mass.partner.len());
            mass.start.push(mass.partner.len() as u32);
        }
        mass.share_rotations();
        Ok(mass)
    }
}

/// Lattice steps of the partner across the directions of `part`.
fn across(at: [usize; 3], part: usize, n: usize) -> [usize; 3] {
    [0, 1, 2].map(|d| if part & (1 << d) == 0 { at[d] } else { n - at[d] })
}

/// The body and the step of a node's partner, if the node lies at those gaps and it exists.
fn partner(model: &Model, body: usize, at: [usize; 3], part: usize) -> Option<(usize, [usize; 3])> {
    let n = model.geometry.topology(body).divisions();
    let mut offset = [0; 3];
    for d in (0..3).filter(|d| part & (1 << d) != 0) {
        offset[d] = match at[d] {
            0 => -1,
            i if i == n => 1,
            _ => return None,
        };
    }
    Some((model.geometry.neighbour(body, offset)?, across(at, part, n)))
}

/// The row of a node in the inverse of its cluster's block, by partner and component.
fn inverse_row(around: Around<'_>, body: usize, at: [usize; 3]) -> Result<[[f64; 3]; 8], RunError> {
    let Around { model, held, .. } = around;
    let members: [Option<(usize, [usize; 3])>; 8] =
        std::array::from_fn(|part| partner(model, body, at, part));
    let blocks: [[[f64; 3]; 8]; 8] = std::array::from_fn(|part| match members[part] {
        Some((body, at)) => node_coupling(around, body, at),
        None => [[0.0; 3]; 8],
    });
    let is_held = |part: usize, c: usize| {
        members[part].is_none_or(|(body, at)| {
            held.get(&(model.geometry.node(body, at) as u32)).is_some_and(|axes| axes[c])
        })
    };
    let mut row = [[0.0; 3]; 8];
    for c in 0..3 {
        if is_held(0, c) {
            continue;
        }
        let free: [bool; 8] = std::array::from_fn(|part| !is_held(part, c));
        let matrix = SMatrix::<f64, 8, 8>::from_fn(|p, q| match (free[p] && free[q], p == q) {
            (true, _) => 0.5 * (blocks[p][p ^ q][c] + blocks[q][p ^ q][c]),
            (false, same) => f64::from(u8::from(same)),
        });
        let unit = SMatrix::<f64, 8, 1>::from_fn(|p, _| f64::from(u8::from(p == 0)));
        // Nodes of blocks that are gone have no stiffness, and no mass.
        if matrix[(0, 0)] == 0.0 {
            continue;
        }
        // A principal block of a positive definite stiffness, unless rounding has taken the difference.
        let Some(solution) = matrix.cholesky().map(|factors| factors.solve(&unit)) else {
            let node = model.geometry.node(body, at);
            return Err(RunError::NoMass { block: body, node });
        };
        (0..8).filter(|&p| free[p]).for_each(|p| row[p][c] = solution[p]);
    }
    Ok(row)
}

/// Diagonal of the stiffness at a node (r = 0) and its coupling with the partners.
fn node_coupling(around: Around<'_>, body: usize, at: [usize; 3]) -> [[f64; 3]; 8] {
    let Around { model, couplings, .. } = around;
    let n = model.geometry.topology(body).divisions();
    let mut sum = [[0.0; 3]; 8];
    // The cell in each octant: bit set on the upper side of the node.
    for octant in 0..8 {
        let (mut offset, mut owner) = (0, [0; 3]);
        for d in 0..3 {
            let upper = octant & (1 << d) != 0;
            if upper && at[d] == n {
                offset |= 1 << d;
            } else if !upper && at[d] == 0 {
                offset |= 1 << d;
                owner[d] = -1;
            }
        }
        let Some(owner) = model.geometry.neighbour(body, owner) else { continue };
        let (pack, lane) = model.packs.slot(owner);
        let table = model.assembly.pack_tables[pack][offset];
        if table == NO_TABLE {
            continue;
        }
        let Some(element) = model.assembly.tables[table as usize].elements[lane] else { continue };
        // A node on the lower side of its octant's cell is that cell's lower corner.
        let corner = 7 ^ octant;
        let coupling = &couplings[element as usize][corner];
        for part in (0..8).filter(|part| part & !offset == 0) {
            (0..3).for_each(|c| sum[part][c] += coupling[part][c]);
        }
    }
    spring_coupling(model, body, at, &mut sum);
    if let Some(surfaces) = around.surfaces {
        contact_diagonal(&around, surfaces, body, at, &mut sum[0]);
    }
    sum
}

/// Adds the springs of joints that are springs from the start.
fn spring_coupling(model: &Model, body: usize, at: [usize; 3], sum: &mut [[f64; 3]; 8]) {
    let topology = model.geometry.topology(body);
    for face in FaceOf::all().filter(|&face| topology.is_on(face, at)) {
        let below = if face.upper { Some(body) } else { model.geometry.beyond(body, face) };
        let (d, Some(owner)) = (face.direction, below) else { continue };
        let (pack, lane) = model.packs.slot(owner);
        let Some(seam) = model.seams.get(pack, d).filter(|seam| seam.springs[lane]) else {
            continue;
        };
        let quarters = topology.quads_at(face, at) as f64;
        for (c, k) in seam.diagonal(lane).into_iter().enumerate() {
            sum[0][c] += quarters * k;
            sum[1 << d][c] -= quarters * k;
        }
    }
}

/// `M⁻¹ F` at the nodes of a pack: `f` holds the forces of all nodes, `poses` are those of its bodies
/// where they are rigid and have turned.
#[simd]
pub(super) fn accelerations<S: Simd>(
    simd: S,
    model: &Model,
    poses: Option<&[Pose; LANES]>,
    clusters: &Clusters,
    index: usize,
    f: &[Lanes],
    out: &mut [Lanes],
) {
    let packs = &model.packs;
    let pack = &packs.packs[index];
    if pack.rigid {
        let inverses = &clusters.rigid[pack.rigid_start];
        return rigid::accelerations(model, poses, inverses, index, f, out);
    }
    if !clusters.turned.is_empty() {
        return turning::accelerations(simd, model, &clusters.turned, clusters, index, f, out);
    }
    let class = &clusters.classes[clusters.of_pack[index] as usize];
    for node in 0..out.len() / 3 {
        let mut sum = zero(simd);
        for row in class.start[node] as usize..class.start[node + 1] as usize {
            let Partner { part, beside, local } = class.partner[row];
            let force = if part == 0 {
                load_at(simd, f, 3 * (pack.start + node))
            } else {
                let mut there = [Lanes::ZERO; 3];
                let bodies = &clusters.beside[index][beside];
                for lane in 0..LANES {
                    let Some((other, lane_there)) = bodies.at(lane) else { continue };
                    let place = 3 * (packs.packs[other].start + local);
                    for c in 0..3 {
                        there[c].0[lane] = f[place + c].0[lane_there];
                    }
                }
                load_at(simd, &there, 0)
            };
            let inverse = load_at(simd, &class.rows, 3 * row);
            for c in 0..3 {
                sum[c] += inverse[c] * force[c];
            }
        }
        store_at(out, 3 * node, sum);
    }
}
