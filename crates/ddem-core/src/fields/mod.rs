//! What can be seen of a simulation: one table, [`FIELDS`], from which every writer and binding
//! reads, and the functions that fill it, a range at a time.

mod contacts;
mod fragments;
mod momentum;
mod pairs;
mod peaks;
mod ranges;
mod snapshot;
mod state;
mod stress;

use std::ops::Range;

use crate::lanes::Lanes;
use crate::leapfrog::local_damping;
use crate::simulation::Simulation;
use crate::stage::StageKind;
use crate::step::carry;

use peaks::PEAK_FIELDS;

pub use contacts::{CONTACT_FIELDS, Contact, ContactCounts, ContactField};
pub use fragments::Fragment;
pub use snapshot::Snapshot;
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

/// Kind of the numbers of a field.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FieldKind {
    /// Real numbers.
    Real,
    /// Whole numbers.
    Whole,
    /// One of a few states, from 0 up.
    State,
    /// 0 or 1.
    Flag,
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
    /// Kind of the numbers.
    pub kind: FieldKind,
    fill: Fill,
}

/// Writes the numbers of a range of values, one value after another.
type Fill = fn(&mut Snapshot<'_>, Range<usize>, &mut [f64]);

impl Field {
    const fn new(name: &'static str, unit: &'static str, on: On, n: usize, fill: Fill) -> Self {
        Self { name, unit, on, components: n, kind: FieldKind::Real, fill }
    }

    const fn kind(self, kind: FieldKind) -> Self {
        Self { kind, ..self }
    }
}

/// All output fields that change with time, of any model; [`Model::fields`](crate::Model::fields) has
/// those that the deck asks for besides. All components are those of the global axes, also of tractions and slip.
/// [`Simulation::snapshot`] gives their values.
///
/// | On | Fields |
/// |---|---|
/// | nodes | `displacement`, `velocity` |
/// | elements | `stress` (xx yy zz xy yz zx), `fragment` (its number) |
/// | pairs | `displacement` (mean of both sides), `traction`, `slip`, `opening`, `state` (0 bonded, 1 failed in shear, 2 failed in tension), `open`, `released` (a contact has taken the place of the joint), `failure_time`, `damage` |
pub const FIELDS: [Field; 13] = [
    Field::new("displacement", "m", On::Node, 3, displacement),
    Field::new("velocity", "m/s", On::Node, 3, velocity),
    Field::new("stress", "Pa", On::Element, 6, stress::stress),
    Field::new("fragment", "1", On::Element, 1, fragments::fragment).kind(FieldKind::Whole),
    Field::new("displacement", "m", On::Pair, 3, pairs::displacement),
    Field::new("traction", "Pa", On::Pair, 3, pairs::traction),
    Field::new("slip", "m", On::Pair, 3, pairs::slip),
    Field::new("opening", "m", On::Pair, 1, pairs::opening),
    Field::new("state", "1", On::Pair, 1, pairs::failure_mode).kind(FieldKind::State),
    Field::new("open", "1", On::Pair, 1, pairs::open).kind(FieldKind::Flag),
    Field::new("released", "1", On::Pair, 1, pairs::released).kind(FieldKind::Flag),
    Field::new("failure_time", "s", On::Pair, 1, pairs::failure_time),
    Field::new("damage", "1", On::Pair, 1, pairs::damage),
];

/// Force that accelerates every node, [`Simulation::forces`]; it is not in the files.
pub const FORCE: Field = Field::new("force", "N", On::Node, 3, force);

/// Further fields of a model with excavations.
const EXCAVATION_FIELDS: [Field; 2] = [
    Field::new("removed", "1", On::Element, 1, removed).kind(FieldKind::Flag),
    Field::new("removed", "1", On::Pair, 1, pairs::removed).kind(FieldKind::Flag),
];

/// Further fields of a model with a stage that looks for a factor of safety.
const SAFETY_FIELDS: [Field; 1] = [Field::new("unstable", "1", On::Element, 1, unstable)];

/// 1 in blocks that have been taken out.
fn removed(snapshot: &mut Snapshot<'_>, range: Range<usize>, out: &mut [f64]) {
    let model = &snapshot.simulation.model;
    model.fill_elements(range, out, |block| {
        let removed = model.is_removed(block);
        move |_| [f64::from(u8::from(removed))]
    });
}

/// 1 in blocks that move in the failing trial of a factor of safety.
fn unstable(snapshot: &mut Snapshot<'_>, range: Range<usize>, out: &mut [f64]) {
    let (simulation, moving) = snapshot.moving();
    simulation.model.fill_elements(range, out, |block| {
        let moving = moving[block];
        move |_| [f64::from(u8::from(moving))]
    });
}

fn displacement(snapshot: &mut Snapshot<'_>, range: Range<usize>, out: &mut [f64]) {
    let simulation = &*snapshot.simulation;
    simulation.model.fill_nodal(&simulation.state.u, range, out);
}

fn velocity(snapshot: &mut Snapshot<'_>, range: Range<usize>, out: &mut [f64]) {
    snapshot.simulation.fill_velocities(range, out);
}

fn force(snapshot: &mut Snapshot<'_>, range: Range<usize>, out: &mut [f64]) {
    snapshot.simulation.measure_once();
    let simulation = &*snapshot.simulation;
    simulation.model.fill_nodal(&simulation.scratch.f, range, out);
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

    /// Displacement `[m]` and velocity at the last half step `[m/s]` of each level of the free-field columns, shape
    /// `(levels, 2, 3)`.
    #[must_use]
    pub fn column_levels(&self) -> Vec<[[f64; 3]; 2]> {
        self.state.columns.iter().map(|level| level.map(Into::into)).collect()
    }

    /// Velocities of all nodes at the present time `[m/s]`, shape `(n_nodes, 3)`; zero in a
    /// relaxation.
    pub fn velocities(&mut self) -> Vec<[f64; 3]> {
        let n = self.model.n_nodes();
        let mut velocities = vec![[0.0; 3]; n];
        self.fill_velocities(0..n, velocities.as_flattened_mut());
        velocities
    }

    /// Velocity of a node at the present time `[m/s]`.
    ///
    /// # Panics
    ///
    /// If the model has no such node.
    pub fn velocity(&mut self, node: usize) -> [f64; 3] {
        let mut velocity = [0.0; 3];
        self.model.geometry.has_node(node);
        self.fill_velocities(node..node + 1, &mut velocity);
        velocity
    }

    /// Velocities of a range of nodes at the present time `[m/s]`.
    fn fill_velocities(&mut self, range: Range<usize>, out: &mut [f64]) {
        self.measure_once();
        let blocks = self.model.blocks_of(range.clone());
        let mut rigid: Vec<usize> = blocks.map(|block| self.model.packs.slot(block).0).collect();
        rigid.retain(|&pack| self.model.packs.packs[pack].rigid);
        rigid.sort_unstable();
        rigid.dedup();
        let poses = self.present_poses_of(&rigid);
        let (this, model) = (&*self, &self.model);
        model.fill_nodes(range, out, |block| {
            let (pack, lane) = model.packs.slot(block);
            let corners = rigid.binary_search(&pack).ok().map(|at| {
                let mut corners = [Lanes::ZERO; 24];
                carry(model, pack, &poses[at], &mut corners);
                corners
            });
            move |node| {
                [0, 1, 2].map(|c| match &corners {
                    Some(corners) => corners[3 * node + c].0[lane],
                    None => this.present_velocity(pack, 3 * node + c, lane),
                })
            }
        });
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
}
