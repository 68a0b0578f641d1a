//! A charge in a cavity, in three dimensions.

use ddem_core::Simulation;
use ddem_deck::{
    BlockSet, BuiltDeck, Charge, Deck, Edges, Extent, Fix, Joint, JointChoice, Kinematics,
    Material, Remove, Sphere, Where,
};
use nalgebra::Vector3;

use super::fem::{Formulation, Mesh, OracleLattice, OracleMaterial, System};

const ROCK: OracleMaterial = OracleMaterial { density: 2400.0, young: 18e9, poisson: 0.25 };
const CLAY: OracleMaterial = OracleMaterial { density: 2000.0, young: 3e8, poisson: 0.1 };
/// Pressure so small compared with the stiffness of the rock that it acts on the walls in their
/// initial positions.
const PRESSURE: f64 = 1e3;

/// Blocks in a lattice, some of which are removed, fixed at the lower side.
struct Hollow {
    cuts: [Vec<f64>; 3],
    axes: [Vector3<f64>; 3],
    divisions: usize,
    joint: (f64, OracleMaterial),
    removed: Vec<[usize; 3]>,
}

impl Hollow {
    fn at(&self, along: [f64; 3]) -> Vector3<f64> {
        (0..3).map(|d| self.axes[d] * along[d]).sum()
    }

    fn ball(&self, cell: [usize; 3], radius: f64) -> Where {
        let middle = [0, 1, 2].map(|d| 0.5 * (self.cuts[d][cell[d]] + self.cuts[d][cell[d] + 1]));
        let sphere = Sphere { centre: self.at(middle).into(), radius };
        Where { sphere: Some(sphere), ..Where::default() }
    }

    fn deck(&self) -> Deck {
        let mut deck = Deck::default();
        deck.model.kinematics = Kinematics::Small;
        let OracleMaterial { density, young, poisson } = ROCK;
        deck.materials.insert("rock".into(), Material { density, young, poisson });
        let (thickness, OracleMaterial { density, young, poisson }) = self.joint;
        let (density, young, poisson) = (Some(density), Some(young), Some(poisson));
        let joint = Joint { thickness, density, young, poisson, ..Joint::default() };
        deck.joints.insert("seam".into(), joint);
        let [x, y, z] = self.cuts.clone().map(Some);
        deck.blocks.push(BlockSet {
            edges: Some(Edges { x, y, z }),
            divisions: self.divisions as u32,
            material: "rock".into(),
            joint: Some(JointChoice::All("seam".into())),
            axes: self.axes.map(<[f64; 3]>::from),
            ..BlockSet::default()
        });
        for &cell in &self.removed {
            deck.remove.push(Remove { r#where: self.ball(cell, 0.05), ..Remove::default() });
        }
        let base = Where { z: Some(Extent::Plane(0.0)), ..Where::default() };
        deck.fix.push(Fix { r#where: base, axes: "xyz".into(), ..Fix::default() });
        let everywhere = Where { x: Some(Extent::Range([-1e3, 1e3])), ..Where::default() };
        let pressure = Some(PRESSURE);
        deck.charge.push(Charge { r#where: everywhere, pressure, ..Charge::default() });
        deck
    }

    fn mesh(&self) -> Mesh {
        let count = self.cuts.each_ref().map(|cuts| cuts.len() - 1);
        let (thickness, material) = self.joint;
        let mut lattice = OracleLattice::boxed([1.0; 3], count, self.divisions, thickness, ROCK);
        lattice.cuts = self.cuts.clone();
        lattice.axes = self.axes;
        let number = |c: &[usize; 3]| c[0] + count[0] * (c[1] + count[1] * c[2]);
        lattice.removed = self.removed.iter().map(number).collect();
        lattice.joint = Box::new(move |_| Some(material));
        lattice.mesh()
    }

    /// Nodes of the face of a block; the two directions follow that of the normal.
    fn wall(&self, mesh: &Mesh, cell: [usize; 3], d: usize, upper: bool) -> Vec<Vec<usize>> {
        let n = self.divisions;
        let node = |i: usize, k: usize| {
            let mut at = cell.map(|c| c * (n + 1));
            at[d] += if upper { n } else { 0 };
            at[(d + 1) % 3] += i;
            at[(d + 2) % 3] += k;
            mesh.grid_node(at).expect("a wall of the cavity")
        };
        (0..=n).map(|i| (0..=n).map(|k| node(i, k)).collect()).collect()
    }

    /// The walls of one empty cell: the lower and the upper one along each direction.
    fn walls(&self, mesh: &Mesh, cell: [usize; 3]) -> [[Vec<Vec<usize>>; 2]; 3] {
        [0, 1, 2].map(|d| {
            let beside = |step: isize| {
                let mut other = cell;
                other[d] = other[d].checked_add_signed(step).expect("a block");
                other
            };
            [self.wall(mesh, beside(-1), d, true), self.wall(mesh, beside(1), d, false)]
        })
    }

    /// Displacements of the program in equilibrium.
    fn relaxed(&self) -> Vec<f64> {
        let site = BuiltDeck::new(&self.deck()).unwrap_or_else(|error| panic!("{error}"));
        let model = site.model();
        assert_eq!(site.warnings(&model), []);
        let mut simulation = Simulation::new(model);
        simulation.relax(1e-10, 100_000).unwrap_or_else(|error| panic!("{error}"));
        simulation.displacements().into_flattened()
    }

    /// Displacements of the independent model under forces, with the default element of a deck.
    fn solved(&self, mesh: &Mesh, load: &[f64]) -> Vec<f64> {
        let system = System::assemble(mesh, Formulation::Incompatible);
        let mut held = vec![None; mesh.dofs()];
        for node in mesh.select(|at| at.z < 1e-9) {
            held[3 * node..3 * node + 3].fill(Some(0.0));
        }
        system.solve(load, &held).displacement
    }
}

/// Adds the pressure on a flat polygon in equal parts to its corners; its normal points away from a
/// place in the gas.
fn push(mesh: &Mesh, load: &mut [f64], corners: &[usize], gas: Vector3<f64>) {
    let x: Vec<Vector3<f64>> = corners.iter().map(|&node| mesh.nodes[node]).collect();
    let cross = match x[..] {
        [a, b, c] => (b - a).cross(&(c - a)),
        [a, b, c, d] => (c - a).cross(&(d - b)),
        _ => panic!("three or four corners"),
    };
    let sign = (x[0] - gas).dot(&cross).signum();
    let each = cross * (0.5 * sign * PRESSURE / x.len() as f64);
    for &node in corners {
        (0..3).for_each(|c| load[3 * node + c] += each[c]);
    }
}

/// Adds the pressure on the elements of a wall.
fn push_wall(mesh: &Mesh, load: &mut [f64], wall: &[Vec<usize>], gas: Vector3<f64>) {
    let n = wall.len() - 1;
    for (i, k) in (0..n).flat_map(|i| (0..n).map(move |k| (i, k))) {
        let quad = [wall[i][k], wall[i + 1][k], wall[i + 1][k + 1], wall[i][k + 1]];
        push(mesh, load, &quad, gas);
    }
}

fn uniform(count: usize, size: f64) -> Vec<f64> {
    (0..=count).map(|i| i as f64 * size / count as f64).collect()
}

/// Forces of the pressure in one missing block: on its walls, on a strip between each two walls
/// that meet at an edge, and on a triangle between each three at a corner.
fn pushed(hollow: &Hollow, mesh: &Mesh, cell: [usize; 3]) -> Vec<f64> {
    let mut load = vec![0.0; mesh.dofs()];
    let middle = |d: usize| 0.5 * (hollow.cuts[d][cell[d]] + hollow.cuts[d][cell[d] + 1]);
    let gas = hollow.at([0, 1, 2].map(middle));
    let walls = hollow.walls(mesh, cell);
    walls.iter().flatten().for_each(|wall| push_wall(mesh, &mut load, wall, gas));
    let n = hollow.divisions;
    let end = |upper: usize| if upper == 1 { n } else { 0 };
    for d in 0..3 {
        // Along an edge in the direction d, between a wall across e and one across f.
        let (e, f) = ((d + 1) % 3, (d + 2) % 3);
        for (p, q) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            let across_e = |i: usize| walls[e][p][end(q)][i];
            let across_f = |i: usize| walls[f][q][i][end(p)];
            for i in 0..n {
                let strip = [across_e(i), across_e(i + 1), across_f(i + 1), across_f(i)];
                push(mesh, &mut load, &strip, gas);
            }
        }
    }
    for corner in 0..8_usize {
        let upper = [0, 1, 2].map(|d| corner >> d & 1);
        let node = |d: usize| walls[d][upper[d]][end(upper[(d + 1) % 3])][end(upper[(d + 2) % 3])];
        push(mesh, &mut load, &[node(0), node(1), node(2)], gas);
    }
    load
}

#[test]
fn charge_in_missing_block_equals_fem() {
    let unit = [Vector3::x(), Vector3::y(), Vector3::z()];
    let slant = Vector3::new(0.2, 0.3, 1.0).normalize();
    let oblique = [Vector3::x(), Vector3::new(0.4, 1.0, 0.0).normalize(), slant];
    let uneven = [vec![0.0, 0.5, 1.7, 2.2], vec![0.0, 1.1, 1.6, 2.4], vec![0.0, 0.7, 1.5, 2.6]];
    for (axes, cuts) in [
        (unit, [uniform(3, 3.0), uniform(3, 3.0), uniform(3, 3.0)]),
        (unit, uneven.clone()),
        (oblique, uneven),
    ] {
        for joint in [(0.1, ROCK), (0.04, CLAY)] {
            let removed = vec![[1, 1, 1]];
            let hollow = Hollow { cuts: cuts.clone(), axes, divisions: 3, joint, removed };
            let mesh = hollow.mesh();
            let exact = hollow.solved(&mesh, &pushed(&hollow, &mesh, [1, 1, 1]));
            let off = super::error(&hollow.relaxed(), &exact);
            println!("{joint:?}: displacements off by {off:.1e}");
            assert!(off <= 1e-6, "{joint:?}: {off:e}");
        }
    }
}

/// A staircase around a ball, where only the walls carry the pressure. The surfaces that close the
/// gaps between them are as small as the joints are thin, and so is the difference.
#[test]
fn charge_in_staircase_cavity_equals_fem() {
    let (count, size) = (8, 4.0);
    let cuts = [0, 1, 2].map(|_| uniform(count, size));
    let far = |cell: &[usize; 3]| {
        let along = |c: usize| (c as f64 + 0.5) * size / count as f64 - size / 2.0;
        cell.iter().map(|&c| along(c).powi(2)).sum::<f64>().sqrt()
    };
    let cells = (0..count.pow(3)).map(|i| [i % count, i / count % count, i / count / count]);
    let removed: Vec<[usize; 3]> = cells.filter(|cell| far(cell) < 1.2).collect();
    assert_eq!(removed.len(), 56);
    let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
    let errors = [1e-3, 1e-4, 1e-5].map(|thickness| {
        let (joint, removed) = ((thickness, ROCK), removed.clone());
        let hollow = Hollow { cuts: cuts.clone(), axes, divisions: 1, joint, removed };
        let mesh = hollow.mesh();
        let mut load = vec![0.0; mesh.dofs()];
        for cell in &hollow.removed {
            let gas = hollow.at(cell.map(|c| (c as f64 + 0.5) * size / count as f64));
            for (d, step) in (0..3).flat_map(|d| [(d, -1), (d, 1)]) {
                let mut other = *cell;
                other[d] = other[d].checked_add_signed(step).expect("a cell");
                if !hollow.removed.contains(&other) {
                    let wall = hollow.wall(&mesh, other, d, step < 0);
                    push_wall(&mesh, &mut load, &wall, gas);
                }
            }
        }
        let exact = hollow.solved(&mesh, &load);
        let off = super::error(&hollow.relaxed(), &exact);
        println!("joints of {thickness} m: displacements off by {off:.1e}");
        off
    });
    for (coarse, fine) in errors.iter().zip(&errors[1..]) {
        assert!((9.5..10.5).contains(&(coarse / fine)), "it goes with the thickness: {errors:?}");
    }
    assert!(errors[2] < 1e-4, "{errors:?}");
}
