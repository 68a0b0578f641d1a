//! What can be seen of a simulation: one table, [`FIELDS`], from which every writer and binding
//! reads, and the functions that fill it.

mod contacts;
mod fragments;
mod momentum;
mod peaks;
mod state;
mod stress;

use crate::breaks::Point;
use crate::geometry::Vec3;
use crate::lanes::{LANES, Lanes};
use crate::law::Mode;
use crate::leapfrog::local_damping;
use crate::pairs::PairAt;
use crate::simulation::Simulation;
use crate::stage::StageKind;
use crate::step::carry;

use fragments::fragment;
use peaks::PEAK_FIELDS;

pub use contacts::{CONTACT_FIELDS, Contact, ContactCounts, ContactField};
pub use fragments::Fragment;
pub use state::{ContactSummary, FragmentSummary, JointSummary, Largest, Reaction, StateSummary};

/// Where a field has its values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum On {
    /// At the nodes.
    Node,
    /// In the hex8 elements of the blocks.
    Element,
    /// At the pairs of facing nodes.
    Pair,
}

/// One output field.
#[derive(Clone, Copy, Debug)]
pub struct Field {
    /// Name in files and bindings.
    pub name: &'static str,
    /// Unit, "1" for a plain number.
    pub unit: &'static str,
    /// Where it has its values.
    pub on: On,
    /// Numbers per value.
    pub components: usize,
    /// All values, one after another.
    pub fill: fn(&mut Simulation) -> Vec<f64>,
}

/// All output fields that change with time, of any model; [`Model::fields`](crate::Model::fields) has
/// those that the deck asks for besides. All components are those of the global axes, also of tractions and slip.
///
/// | On | Fields |
/// |---|---|
/// | nodes | `displacement`, `velocity` |
/// | elements | `stress` (xx yy zz xy yz zx), `fragment` (its number) |
/// | pairs | `displacement` (mean of both sides), `traction`, `slip`, `opening`, `state` (0 bonded, 1 failed in shear, 2 failed in tension), `open`, `released` (a contact has taken the place of the joint), `failure_time`, `damage` |
pub const FIELDS: [Field; 13] = [
    Field { name: "displacement", unit: "m", on: On::Node, components: 3, fill: displacement },
    Field { name: "velocity", unit: "m/s", on: On::Node, components: 3, fill: velocity },
    Field { name: "stress", unit: "Pa", on: On::Element, components: 6, fill: stress },
    Field { name: "fragment", unit: "1", on: On::Element, components: 1, fill: fragment },
    Field { name: "displacement", unit: "m", on: On::Pair, components: 3, fill: mean_displacement },
    Field { name: "traction", unit: "Pa", on: On::Pair, components: 3, fill: traction },
    Field { name: "slip", unit: "m", on: On::Pair, components: 3, fill: slip },
    Field { name: "opening", unit: "m", on: On::Pair, components: 1, fill: opening },
    Field { name: "state", unit: "1", on: On::Pair, components: 1, fill: failure_mode },
    Field { name: "open", unit: "1", on: On::Pair, components: 1, fill: open },
    Field { name: "released", unit: "1", on: On::Pair, components: 1, fill: contacts::released },
    Field { name: "failure_time", unit: "s", on: On::Pair, components: 1, fill: failure_time },
    Field { name: "damage", unit: "1", on: On::Pair, components: 1, fill: damage },
];

/// What a model with excavations has besides.
const EXCAVATION_FIELDS: [Field; 2] = [
    Field { name: "removed", unit: "1", on: On::Element, components: 1, fill: removed_elements },
    Field { name: "removed", unit: "1", on: On::Pair, components: 1, fill: removed_pairs },
];

/// Further fields of a model with a stage that looks for a factor of safety.
const SAFETY_FIELDS: [Field; 1] =
    [Field { name: "unstable", unit: "1", on: On::Element, components: 1, fill: unstable }];

/// 1 in blocks that have been taken out.
fn removed_elements(simulation: &mut Simulation) -> Vec<f64> {
    marked(&simulation.model, |block| simulation.model.is_removed(block))
}

/// 1 in blocks that move in the failing trial of a factor of safety.
fn unstable(simulation: &mut Simulation) -> Vec<f64> {
    let mut moves = vec![false; simulation.model.n_blocks()];
    if simulation.failing {
        simulation.moving_blocks().iter().for_each(|moving| moves[moving.block] = true);
    }
    marked(&simulation.model, |block| moves[block])
}

/// 1 in the elements of some blocks, 0 in others.
fn marked(model: &crate::model::Model, marked: impl Fn(usize) -> bool) -> Vec<f64> {
    let of = |block: usize| {
        let elements = model.geometry.lattice(block).divisions.pow(3);
        std::iter::repeat_n(f64::from(u8::from(marked(block))), elements)
    };
    (0..model.n_blocks()).flat_map(of).collect()
}

/// 1 at joints one of whose blocks has been taken out.
fn removed_pairs(simulation: &mut Simulation) -> Vec<f64> {
    let model = &simulation.model;
    let number = |blocks: [u32; 2], pairs: usize| {
        let gone = blocks.iter().any(|&block| model.is_removed(block as usize));
        std::iter::repeat_n(f64::from(u8::from(gone)), pairs)
    };
    let matching = model.faces().iter();
    let matching =
        matching.flat_map(|face| number([face.a, face.b], (face.divisions as usize + 1).pow(2)));
    let seated = model.seated.iter();
    let seated = seated.flat_map(|joint| number(joint.patch.blocks, joint.patch.points.len()));
    matching.chain(seated).collect()
}

fn displacement(simulation: &mut Simulation) -> Vec<f64> {
    simulation.displacements().into_flattened()
}

fn velocity(simulation: &mut Simulation) -> Vec<f64> {
    simulation.velocities().into_flattened()
}

fn stress(simulation: &mut Simulation) -> Vec<f64> {
    simulation.stresses().into_flattened()
}

fn traction(simulation: &mut Simulation) -> Vec<f64> {
    simulation.tractions().into_flattened()
}

fn slip(simulation: &mut Simulation) -> Vec<f64> {
    let mut slips = vec![[0.0; 3]; simulation.model.n_pairs()];
    simulation.see_present(|pair, seen| {
        if let Some(point) = seen.point {
            let slip = point.memory.slip;
            slips[pair] = (seen.axes * Vec3::new(0.0, slip.x, slip.y)).into();
        }
    });
    slips.into_flattened()
}

/// What slip over the roughness has opened, and the gap beyond it.
fn opening(simulation: &mut Simulation) -> Vec<f64> {
    simulation.failed(0.0, |point| point.memory.dilation + point.memory.gap.max(0.0))
}

fn failure_mode(simulation: &mut Simulation) -> Vec<f64> {
    simulation.failed(0.0, |point| if point.mode == Some(Mode::Tension) { 2.0 } else { 1.0 })
}

fn open(simulation: &mut Simulation) -> Vec<f64> {
    simulation.failed(0.0, |point| f64::from(u8::from(point.memory.gap > 0.0)))
}

fn failure_time(simulation: &mut Simulation) -> Vec<f64> {
    let mut times = vec![f64::NAN; simulation.model.n_pairs()];
    simulation.present_points(|pair, point, time| {
        if point.mode.is_some() {
            times[pair] = time;
        }
    });
    times
}

fn damage(simulation: &mut Simulation) -> Vec<f64> {
    simulation.failed(0.0, |point| point.memory.damage.min(1.0))
}

fn mean_displacement(simulation: &mut Simulation) -> Vec<f64> {
    let simulation = &*simulation;
    let model = &simulation.model;
    let mean = model.pairs().flat_map(|PairAt { nodes: [a, b], .. }| {
        let (a, b) = (simulation.displacement(a as usize), simulation.displacement(b as usize));
        [0, 1, 2].map(|c| 0.5 * (a[c] + b[c]))
    });
    mean.collect()
}

impl Simulation {
    /// Displacement of a node `[m]`.
    ///
    /// # Panics
    ///
    /// If the model has no such node.
    #[must_use]
    pub fn displacement(&self, node: usize) -> [f64; 3] {
        self.model.get(&self.state.u, node)
    }

    /// Displacements of all nodes `[m]`, shape `(n_nodes, 3)`.
    #[must_use]
    pub fn displacements(&self) -> Vec<[f64; 3]> {
        self.model.plain(&self.state.u)
    }

    /// Velocities of all nodes at the present time `[m/s]`, shape `(n_nodes, 3)`; zero in a
    /// relaxation.
    pub fn velocities(&mut self) -> Vec<[f64; 3]> {
        self.measure_once();
        let velocities = self.present_velocities();
        self.model.plain(&velocities)
    }

    /// Velocity of a node at the present time `[m/s]`.
    ///
    /// # Panics
    ///
    /// If the model has no such node.
    pub fn velocity(&mut self, node: usize) -> [f64; 3] {
        self.measure_once();
        let (pack, local, lane) = self.model.place(node);
        if self.model.packs.packs[pack].rigid {
            let mut corners = [Lanes::ZERO; 24];
            let poses = self.present_pose(pack);
            carry(&self.model, pack, &poses, &mut corners);
            return [0, 1, 2].map(|c| corners[3 * local + c].0[lane]);
        }
        [0, 1, 2].map(|c| self.present_velocity(pack, 3 * local + c, lane))
    }

    /// Velocities at the present time in the layout of the state.
    pub(crate) fn present_velocities(&self) -> Vec<Lanes> {
        let mut velocities = self.state.v.clone();
        let poses = self.present_poses();
        for (index, pack) in self.model.packs.packs.iter().enumerate() {
            if pack.rigid {
                let nodes = 3 * pack.start..3 * (pack.start + 8);
                carry(&self.model, index, &poses[pack.rigid_start], &mut velocities[nodes]);
                continue;
            }
            for at in 0..3 * self.model.packs.shape_of(pack).nodes {
                let v = |lane| self.present_velocity(index, at, lane);
                velocities[3 * pack.start + at] = Lanes(std::array::from_fn(v));
            }
        }
        velocities
    }

    /// Between `v⁻` and `v⁺`, with the forces that were last measured.
    fn present_velocity(&self, pack: usize, at: usize, lane: usize) -> f64 {
        let place = 3 * self.model.packs.packs[pack].start + at;
        let v = self.state.v[place].0[lane];
        if self.motion.fictitious {
            return 0.0;
        }
        if self.state.before == 0.0 {
            return v;
        }
        let class = &self.motion.classes[self.model.assembly.pack_inertia[pack] as usize];
        let [a, b, _] = class.at(at, lane);
        let f = self.scratch.f[place].0[lane];
        let (force, r) = (f - local_damping(self.motion.local, f, v), self.motion.behind());
        0.5 * ((2.0 - r) * v + r * (a * v) + r * (b * force))
    }

    /// Internal force `f = K u` of the bodies and joints on every node `[N]`, shape
    /// `(n_nodes, 3)`, eq. (8) and eq. (11); of joints between faces that do not match there is nothing in it.
    pub fn internal_forces(&mut self) -> Vec<[f64; 3]> {
        self.evaluate_forces();
        self.scratch.collect(&self.model, &self.state.poses, false);
        let forces = self.model.plain(&self.scratch.f);
        forces.into_iter().map(|f| f.map(|x| -x)).collect()
    }

    /// The first pass of a step alone: elastic forces of bodies and joints. Nothing moves.
    pub fn evaluate_forces(&mut self) {
        let (context, state, scratch) = self.parts();
        let mut trial = std::mem::take(&mut scratch.trial);
        trial.clone_from(&state.breaks);
        let pass = context.pass(&state.u, &state.v);
        let pass = crate::step::Pass { viscous: None, ..pass };
        crate::step::forces(pass, &mut trial, None, scratch);
        scratch.trial = trial;
    }

    /// What accelerates every node `[N]`, shape `(n_nodes, 3)`: loads and support forces less the
    /// internal ones, `F = Q + R − f`; zero in equilibrium.
    pub fn forces(&mut self) -> Vec<[f64; 3]> {
        self.measure_once();
        self.model.plain(&self.scratch.f)
    }

    /// Memory that stepping this simulation keeps in use `[bytes]`.
    #[must_use]
    pub fn bytes(&self) -> usize {
        let lanes = self.state.u.len() + self.state.v.len();
        lanes * size_of::<Lanes>()
            + self.scratch.bytes()
            + self.state.breaks.bytes()
            + self.state.contacts.bytes()
            + self.state.peaks.bytes()
            + size_of_val(&self.state.poses[..])
            + self.model.bytes()
            + self.motion.classes.iter().map(|c| 3 * c.a.len() * size_of::<Lanes>()).sum::<usize>()
    }

    /// Sum of the support forces on some nodes, as they act on the model `[N]`. Their order does not
    /// matter, and a node that is given twice counts once.
    ///
    /// # Panics
    ///
    /// If the model has no such node.
    pub fn reaction(&mut self, nodes: &[u32]) -> [f64; 3] {
        let mut nodes = nodes.to_vec();
        nodes.sort_unstable();
        if let Some(&last) = nodes.last() {
            self.model.geometry.has_node(last as usize);
        }
        self.measure_once();
        let mut sum = [0.0; 3];
        for (support, reaction) in self.view.active.supports.iter().zip(&self.scratch.reactions) {
            if nodes.binary_search(&support.node).is_ok() {
                sum[support.axis as usize] += reaction;
            }
        }
        sum
    }

    /// A number of each failed pair, and another of the bonded ones.
    fn failed(&mut self, bonded: f64, number: impl Fn(&Point) -> f64) -> Vec<f64> {
        let mut numbers = vec![bonded; self.model.n_pairs()];
        self.present_points(|pair, point, _| {
            if point.mode.is_some() {
                numbers[pair] = number(point);
            }
        });
        numbers
    }
}

impl crate::model::Model {
    /// All output fields that change with time: [`FIELDS`], and `peak_velocity`, `peak_tension` and
    /// `peak_compression` where the deck has `peaks`, `removed` where blocks are taken out, `unstable`
    /// where a stage looks for a factor of safety.
    pub fn fields(&self) -> impl Iterator<Item = &'static Field> + use<> {
        let peaks: &[Field] = if self.properties.peaks { &PEAK_FIELDS } else { &[] };
        let removed: &[Field] = if self.has_excavations() { &EXCAVATION_FIELDS } else { &[] };
        let searches = self.problem.kinds.contains(&StageKind::Safety);
        let safety: &[Field] = if searches { &SAFETY_FIELDS } else { &[] };
        FIELDS.iter().chain(peaks).chain(removed).chain(safety)
    }

    /// A nodal field in the order of the nodes, shape `(n_nodes, 3)`.
    pub(crate) fn plain(&self, field: &[Lanes]) -> Vec<[f64; 3]> {
        let mut plain = Vec::with_capacity(self.n_nodes());
        for body in 0..self.n_blocks() {
            let (pack, lane) = self.packs.slot(body);
            debug_assert!(lane < LANES);
            let pack = &self.packs.packs[pack];
            let nodes = self.packs.shape_of(pack).nodes;
            let lanes = &field[3 * pack.start..3 * (pack.start + nodes)];
            plain.extend(lanes.as_chunks::<3>().0.iter().map(|v| v.map(|x| x.0[lane])));
        }
        plain
    }
}
