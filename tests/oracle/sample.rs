//! Models, each described twice: as a deck and as an independent mesh.

use ddem_deck::Deck;
use ddem_deck::{
    Assign, BlockSet, Edges, ElementKind, Extent, Fix, Joint, JointChoice, Load, Material, Remove,
    Sphere, Stage, StageKind, Where,
};
use nalgebra::Vector3;

use super::fem::{Face, Formulation, Mesh, OracleLattice, OracleMaterial, System};

const ROCK: OracleMaterial = OracleMaterial { density: 2400.0, young: 18e9, poisson: 0.25 };
const SOFT: OracleMaterial = OracleMaterial { density: 1900.0, young: 18e6, poisson: 0.35 };
const CLAY: OracleMaterial = OracleMaterial { density: 2000.0, young: 3e8, poisson: 0.1 };
const STIFF: OracleMaterial = OracleMaterial { density: 7800.0, young: 210e9, poisson: 0.3 };
const GRAVITY: [f64; 3] = [0.3, -0.2, -9.81];
const TRACTION: [f64; 3] = [2e4, -1e4, -7e4];
const PRESSURE: f64 = 4e4;
const FORCE: [f64; 3] = [-3e3, 2e3, 5e3];
const LINE: [f64; 3] = [1e3, 2e3, -4e3];

/// Lattice of blocks.
#[derive(Clone, Debug)]
pub(crate) struct Sample {
    pub(crate) name: &'static str,
    cuts: [Vec<f64>; 3],
    axes: [Vector3<f64>; 3],
    divisions: usize,
    incompatible: bool,
    /// Thickness and material of the joints across each axis.
    joints: [(f64, OracleMaterial); 3],
    /// Joint of another material.
    patch: Option<(Face, OracleMaterial)>,
    /// Plane of joints across an axis with another thickness and material.
    plane: Option<(usize, usize, f64, OracleMaterial)>,
    /// Block of another material.
    ore: Option<([usize; 3], OracleMaterial)>,
    removed: Vec<[usize; 3]>,
    /// True if fixed at the base and loaded in every way.
    pub(crate) loaded: bool,
}

fn unit() -> [Vector3<f64>; 3] {
    [Vector3::x(), Vector3::y(), Vector3::z()]
}

fn oblique() -> [Vector3<f64>; 3] {
    let z = Vector3::new(0.2, 0.3, 1.0).normalize();
    [Vector3::x(), Vector3::new(0.4, 1.0, 0.0).normalize(), z]
}

/// Equal blocks with joints of rock.
fn plain(name: &'static str, count: [usize; 3], divisions: usize, thickness: f64) -> Sample {
    Sample {
        name,
        cuts: count.map(|n| (0..=n).map(|i| 0.9 * i as f64).collect()),
        axes: unit(),
        divisions,
        incompatible: false,
        joints: [(thickness, ROCK); 3],
        patch: None,
        plane: None,
        ore: None,
        removed: Vec::new(),
        loaded: false,
    }
}

/// All models.
pub(crate) fn samples() -> Vec<Sample> {
    let mixed = [(0.02, SOFT), (0.004, STIFF), (0.01, CLAY)];
    let uneven = [vec![0.0, 0.5, 1.7, 2.0], vec![0.0, 1.1, 1.6], vec![0.0, 0.7, 1.0, 2.2]];
    let face = |axis, cell| Face { axis, cell };
    vec![
        plain("one block", [1, 1, 1], 4, 0.01),
        plain("rock 3 2 5", [3, 2, 5], 2, 0.01),
        plain("rock 4 4 4", [4, 4, 4], 1, 0.02),
        Sample { joints: [(0.01, SOFT); 3], ..plain("soft 1 1 3", [1, 1, 3], 4, 0.01) },
        Sample { joints: [(0.003, STIFF); 3], ..plain("stiff 5 1 1", [5, 1, 1], 3, 0.01) },
        Sample { joints: mixed, ..plain("mixed 2 3 2", [2, 3, 2], 3, 0.01) },
        Sample { joints: mixed, incompatible: true, ..plain("modes 3 2 2", [3, 2, 2], 2, 0.01) },
        Sample { incompatible: true, ..plain("modes 8 1 1", [8, 1, 1], 1, 0.05) },
        Sample {
            patch: Some((face(0, [1, 1, 2]), SOFT)),
            ore: Some(([2, 0, 1], STIFF)),
            ..plain("assigned 4 2 3", [4, 2, 3], 2, 0.01)
        },
        Sample { plane: Some((2, 1, 0.03, CLAY)), ..plain("one weak plane", [2, 2, 4], 2, 0.01) },
        Sample {
            cuts: uneven.clone(),
            removed: vec![[0, 1, 1], [1, 0, 0]],
            joints: mixed,
            ..plain("uneven, removed", [3, 2, 3], 2, 0.01)
        },
        Sample { axes: oblique(), joints: mixed, ..plain("oblique 3 2 2", [3, 2, 2], 2, 0.01) },
        Sample {
            axes: oblique(),
            cuts: uneven,
            incompatible: true,
            removed: vec![[1, 1, 1], [0, 0, 1]],
            patch: Some((face(2, [1, 0, 1]), SOFT)),
            ore: Some(([0, 0, 2], CLAY)),
            ..plain("oblique, everything", [3, 2, 3], 3, 0.008)
        },
    ]
}

fn joint(thickness: f64, of: OracleMaterial) -> Joint {
    let OracleMaterial { density, young, poisson } = of;
    let (density, young, poisson) = (Some(density), Some(young), Some(poisson));
    Joint { thickness, density, young, poisson, ..Joint::default() }
}

fn material(of: OracleMaterial) -> Material {
    Material { density: of.density, young: of.young, poisson: of.poisson }
}

fn ball(centre: Vector3<f64>) -> Where {
    let sphere = Sphere { centre: centre.into(), radius: 0.02 };
    Where { sphere: Some(sphere), ..Where::default() }
}

impl Sample {
    pub(crate) fn formulation(&self) -> Formulation {
        if self.incompatible { Formulation::Incompatible } else { Formulation::Standard }
    }

    /// Number of cells.
    pub(crate) fn cells(&self) -> usize {
        self.cuts.iter().map(|cuts| cuts.len() - 1).product()
    }

    fn at(&self, along: [f64; 3]) -> Vector3<f64> {
        (0..3).map(|d| self.axes[d] * along[d]).sum()
    }

    fn middle(&self, cell: [usize; 3]) -> [f64; 3] {
        [0, 1, 2].map(|d| 0.5 * (self.cuts[d][cell[d]] + self.cuts[d][cell[d] + 1]))
    }

    /// Independent description of the sample.
    pub(crate) fn lattice(&self) -> OracleLattice<'_> {
        let count = [0, 1, 2].map(|d| self.cuts[d].len() - 1);
        let mut lattice = OracleLattice::boxed([1.0; 3], count, self.divisions, 0.0, ROCK);
        lattice.cuts = self.cuts.clone();
        lattice.axes = self.axes;
        lattice.thickness = [0, 1, 2].map(|d| vec![self.joints[d].0; count[d] - 1]);
        if let Some((axis, plane, thickness, _)) = self.plane {
            lattice.thickness[axis][plane] = thickness;
        }
        let number = |c: &[usize; 3]| c[0] + count[0] * (c[1] + count[1] * c[2]);
        lattice.removed = self.removed.iter().map(number).collect();
        lattice.body = Box::new(|cell| match self.ore {
            Some((at, ore)) if at == cell => ore,
            _ => ROCK,
        });
        lattice.joint = Box::new(|face| match (self.patch, self.plane) {
            (Some((at, patch)), _) if at == face => Some(patch),
            (_, Some((axis, plane, _, other))) if axis == face.axis && plane == face.cell[axis] => {
                Some(other)
            }
            _ => Some(self.joints[face.axis].1),
        });
        lattice
    }

    /// Deck of the sample.
    pub(crate) fn deck(&self) -> Deck {
        let mut deck = Deck::default();
        if !self.incompatible {
            deck.model.element = ElementKind::Standard;
        }
        deck.materials.insert("rock".into(), material(ROCK));
        let names = ["across_x", "across_y", "across_z"].map(String::from);
        for (name, (thickness, of)) in names.iter().zip(self.joints) {
            deck.joints.insert(name.clone(), joint(thickness, of));
        }
        let [x, y, z] = names.map(Some);
        let [ex, ey, ez] = self.cuts.clone().map(Some);
        deck.blocks.push(BlockSet {
            edges: Some(Edges { x: ex, y: ey, z: ez }),
            divisions: self.divisions as u32,
            material: "rock".into(),
            joint: Some(JointChoice::ByNormal { x, y, z }),
            // Axes may have any length.
            axes: [0, 1, 2].map(|d| (self.axes[d] * (1.0 + d as f64)).into()),
            ..BlockSet::default()
        });
        self.assign(&mut deck);
        for &cell in &self.removed {
            let region = ball(self.at(self.middle(cell)));
            deck.remove.push(Remove { r#where: region, ..Remove::default() });
        }
        if self.loaded {
            self.load(&mut deck);
        }
        let (kind, duration) = (StageKind::Dynamic, Some(1.0));
        deck.stage.push(Stage { name: "move".into(), kind, duration, ..Stage::default() });
        deck
    }

    fn assign(&self, deck: &mut Deck) {
        if let Some((axis, plane, thickness, of)) = self.plane {
            deck.joints.insert("plane".into(), joint(thickness, of));
            let at = Some(Extent::Plane(self.cuts[axis][plane + 1]));
            let mut region = Where::default();
            *[&mut region.x, &mut region.y, &mut region.z][axis] = at;
            deck.assign.push(Assign {
                r#where: region,
                joint: Some("plane".into()),
                ..Assign::default()
            });
        }
        if let Some((face, of)) = self.patch {
            deck.joints.insert("patch".into(), joint(self.joints[face.axis].0, of));
            let mut middle = self.middle(face.cell);
            middle[face.axis] = self.cuts[face.axis][face.cell[face.axis] + 1];
            let region = ball(self.at(middle));
            deck.assign.push(Assign {
                r#where: region,
                joint: Some("patch".into()),
                ..Assign::default()
            });
        }
        if let Some((cell, of)) = self.ore {
            deck.materials.insert("ore".into(), material(of));
            let (region, ore) = (ball(self.at(self.middle(cell))), Some("ore".into()));
            deck.assign.push(Assign { r#where: region, material: ore, ..Assign::default() });
        }
    }

    fn height(&self) -> f64 {
        self.at([0.0, 0.0, *self.cuts[2].last().expect("cuts")]).z
    }

    /// Adds supports at z = 0; gravity, traction and pressure on the top, a force on a corner, and
    /// a line load.
    fn load(&self, deck: &mut Deck) {
        deck.model.gravity = GRAVITY;
        let plane = |z: f64| Where { z: Some(Extent::Plane(z)), ..Where::default() };
        deck.fix.push(Fix { r#where: plane(0.0), axes: "xyz".into(), ..Fix::default() });
        let top = plane(self.height());
        let entry = Load { r#where: top.clone(), ..Load::default() };
        deck.load.push(Load { traction: Some(TRACTION), ..entry.clone() });
        deck.load.push(Load { pressure: Some(PRESSURE), ..entry.clone() });
        let corner = self.at(self.cuts.each_ref().map(|c| *c.last().expect("cuts")));
        deck.load.push(Load { r#where: ball(corner), force: Some(FORCE), ..entry.clone() });
        let y = Some(Extent::Plane(self.at([0.0, 0.0, self.cuts[2][self.cuts[2].len() - 1]]).y));
        let region = Where { y, ..top };
        deck.load.push(Load { r#where: region, line: Some(LINE), ..entry });
    }

    /// Loads and supports of the independent model, from the mesh alone.
    pub(crate) fn load_and_supports(
        &self,
        mesh: &Mesh,
        system: &System,
    ) -> (Vec<f64>, Vec<Option<f64>>) {
        let mut load = vec![0.0; mesh.dofs()];
        let mut held = vec![None; mesh.dofs()];
        if !self.loaded {
            return (load, held);
        }
        let mut push = |node: usize, force: Vector3<f64>| {
            (0..3).for_each(|c| load[3 * node + c] += force[c]);
        };
        for (node, &mass) in system.mass.iter().enumerate() {
            push(node, Vector3::from(GRAVITY) * mass);
        }
        let length = |d: usize| *self.cuts[d].last().expect("cuts");
        let area = (self.axes[0] * length(0)).cross(&(self.axes[1] * length(1))).norm();
        let on_top = Vector3::from(TRACTION) - Vector3::z() * PRESSURE;
        for (node, share) in mesh.outer_face(2, true) {
            push(node, on_top * (area * share));
        }
        push(mesh.nearest(self.at([0, 1, 2].map(length))), Vector3::from(FORCE));
        let top = mesh.grid_size()[2] - 1;
        for (column, length) in mesh.tributary_lengths(0).iter().enumerate() {
            let node = mesh.grid_node([column, 0, top]).expect("the top is whole");
            push(node, Vector3::from(LINE) * *length);
        }
        for node in mesh.select(|at| at.z < 1e-9) {
            held[3 * node..3 * node + 3].fill(Some(0.0));
        }
        (load, held)
    }
}
