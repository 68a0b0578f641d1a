//! Loose blocks: their decks, positions and penetrations.

use ddem_core::{FIELDS, Model, Simulation};
use ddem_deck::{BlockSet, Body, ContactTable, Deck, Fix, Initial, Material, Where};
use nalgebra::Rotation3;

use crate::decks::*;

/// One block as a set of its own.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Piece {
    pub(crate) centre: Vec3,
    pub(crate) edges: Vec3,
    pub(crate) turn: Rotation3<f64>,
    /// Divisions of a deformable block; 0: rigid.
    pub(crate) divisions: u32,
    pub(crate) velocity: Vec3,
    pub(crate) spin: Vec3,
    pub(crate) held: bool,
}

impl Default for Piece {
    fn default() -> Self {
        Self {
            centre: Vec3::zeros(),
            edges: Vec3::repeat(1.0),
            turn: Rotation3::identity(),
            divisions: 0,
            velocity: Vec3::zeros(),
            spin: Vec3::zeros(),
            held: false,
        }
    }
}

/// Deck without blocks, with one material and undamped contacts.
pub(crate) fn mass_properties(young: f64) -> Deck {
    let stuff = Material { density: 2400.0, young, poisson: 0.25 };
    let contact = ContactTable { damping: Some(0.0), ..ContactTable::default() };
    Deck { materials: [("stuff".to_owned(), stuff)].into(), contact, ..Deck::default() }
}

pub(crate) fn add(deck: &mut Deck, piece: &Piece) {
    let name = format!("piece {}", deck.blocks.len());
    let region = Where { set: Some(name.clone()), ..Where::default() };
    let Piece { centre, edges, turn, divisions, velocity, spin, held } = *piece;
    deck.blocks.push(BlockSet {
        name: Some(name),
        origin: (centre - turn * edges * 0.5).into(),
        axes: [0, 1, 2].map(|d| <[f64; 3]>::from(turn.matrix().column(d))),
        size: Some(edges.into()),
        divisions: divisions.max(1),
        body: if divisions == 0 { Body::Rigid } else { Body::Deformable },
        material: "stuff".into(),
        ..BlockSet::default()
    });
    if held {
        deck.fix.push(Fix { r#where: region, axes: "xyz".into(), ..Fix::default() });
    } else if velocity != Vec3::zeros() || spin != Vec3::zeros() {
        deck.initial.push(Initial {
            r#where: region,
            velocity: Some(velocity.into()),
            spin: Some(spin.into()),
            centre: Some(centre.into()),
            ..Initial::default()
        });
    }
}

pub(crate) fn of(deck: &Deck, pieces: &[Piece]) -> Deck {
    let mut deck = deck.clone();
    pieces.iter().for_each(|piece| add(&mut deck, piece));
    deck
}

/// First node of a block, and number of its nodes along an edge.
fn mesh(model: &Model, block: usize) -> (usize, usize) {
    let first = model.hexes(block).flatten().min().unwrap_or_default() as usize;
    let elements = model.hexes(block).count();
    let along = (1..).find(|n| n * n * n >= elements).unwrap_or(1);
    (first, along + 1)
}

fn nodes_of(model: &Model, block: usize) -> std::ops::Range<usize> {
    let (first, n) = mesh(model, block);
    first..first + n * n * n
}

pub(crate) fn position(simulation: &Simulation, node: usize) -> Vec3 {
    Vec3::from(simulation.model().point(node)) + Vec3::from(simulation.displacement(node))
}

/// Positions of the corners of a block.
pub(crate) fn corners(simulation: &Simulation, block: usize) -> [Vec3; 8] {
    let (first, n) = mesh(simulation.model(), block);
    std::array::from_fn(|corner| {
        let at = [0, 1, 2].map(|d| if corner >> d & 1 == 1 { n - 1 } else { 0 });
        position(simulation, first + at[0] + n * (at[1] + n * at[2]))
    })
}

pub(crate) fn all_corners(simulation: &Simulation) -> Vec<[Vec3; 8]> {
    (0..simulation.model().n_blocks()).map(|block| corners(simulation, block)).collect()
}

pub(crate) fn middle(corners: &[Vec3; 8]) -> Vec3 {
    corners.iter().sum::<Vec3>() / 8.0
}

/// Penetration of two hulls of eight corners: the smallest overlap along their face normals and
/// along the cross products of their edges; negative if they are apart.
pub(crate) fn overlap(a: &[Vec3; 8], b: &[Vec3; 8]) -> f64 {
    let edges = |x: &[Vec3; 8]| {
        [x[1] - x[0] + x[7] - x[6], x[2] - x[0] + x[7] - x[5], x[4] - x[0] + x[7] - x[3]]
    };
    let (of_a, of_b) = (edges(a), edges(b));
    let normals = |e: [Vec3; 3]| [e[0].cross(&e[1]), e[1].cross(&e[2]), e[2].cross(&e[0])];
    let crossed = of_a.iter().flat_map(|x| of_b.iter().map(move |y| x.cross(y)));
    let axes = normals(of_a).into_iter().chain(normals(of_b)).chain(crossed);
    let mut least = f64::INFINITY;
    for axis in axes {
        let Some(axis) = axis.try_normalize(1e-6) else { continue };
        let range = |x: &[Vec3; 8]| {
            x.iter()
                .map(|x| axis.dot(x))
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)))
        };
        let ((low_a, high_a), (low_b, high_b)) = (range(a), range(b));
        least = least.min((high_a - low_b).min(high_b - low_a));
    }
    least
}

/// Deepest overlap of all blocks, and the two blocks; the first `walls` blocks may overlap each
/// other.
pub(crate) fn deepest(all: &[[Vec3; 8]], walls: usize) -> (f64, [usize; 2]) {
    let size = |x: &[Vec3; 8]| x.iter().map(|y| (y - middle(x)).norm()).fold(0.0, f64::max);
    let balls: Vec<(Vec3, f64)> = all.iter().map(|x| (middle(x), size(x))).collect();
    let mut worst = (f64::NEG_INFINITY, [0; 2]);
    for i in 0..all.len() {
        for k in (i + 1).max(walls)..all.len() {
            if (balls[i].0 - balls[k].0).norm() < balls[i].1 + balls[k].1 {
                let depth = overlap(&all[i], &all[k]);
                if depth > worst.0 {
                    worst = (depth, [i, k]);
                }
            }
        }
    }
    worst
}

/// Momentum and angular momentum about the origin, with the sums of the sizes of their parts. The
/// eight corners of a rigid block have three times the rotational inertia of the block.
pub(crate) fn momenta(simulation: &mut Simulation) -> ([Vec3; 2], [f64; 2]) {
    let (mut sums, mut sizes) = ([Vec3::zeros(); 2], [0.0; 2]);
    let velocities = simulation.velocities();
    let model = simulation.model();
    for block in 0..model.n_blocks() {
        let nodes = nodes_of(model, block);
        let count = nodes.len() as f64;
        let rigid = model.is_rigid(block);
        let v = |node: usize| Vec3::from(velocities[node]);
        let centre = nodes.clone().map(|node| position(simulation, node)).sum::<Vec3>() / count;
        let mean = nodes.clone().map(v).sum::<Vec3>() / count;
        for node in nodes {
            let mass = model.mass(node);
            let x = position(simulation, node);
            let moment = if rigid {
                let turning = (x - centre).cross(&(v(node) - mean)) / 3.0;
                (centre.cross(&mean) + turning) * mass
            } else {
                x.cross(&v(node)) * mass
            };
            for (k, part) in [v(node) * mass, moment].into_iter().enumerate() {
                sums[k] += part;
                sizes[k] += part.norm();
            }
        }
    }
    let computed = [simulation.momentum(), simulation.angular_momentum()].map(Vec3::from);
    for k in 0..2 {
        assert!(
            (computed[k] - sums[k]).norm() <= 1e-12 * sizes[k],
            "{computed:?} instead of {sums:?}"
        );
    }
    (sums, sizes)
}

/// Number of block pairs with contact points, and of lattice joints that were released.
pub(crate) fn contacts(simulation: &mut Simulation) -> [usize; 2] {
    let released = FIELDS.iter().find(|field| field.name == "released");
    let pairs = released.map(|field| simulation.snapshot().values(field)).unwrap_or_default();
    let faces = simulation.model().faces().iter();
    let released = faces.filter(|face| pairs[face.first_pair as usize] == 1.0).count();
    [simulation.contact_counts().near, released]
}

/// Random number from 0 to 1.
pub(crate) fn part(random: &mut Random) -> f64 {
    0.5 + 0.5 * random.next()
}

/// Random rotation.
pub(crate) fn any_turn(random: &mut Random) -> Rotation3<f64> {
    let angle = std::f64::consts::PI * random.next();
    random.rotation(angle)
}
