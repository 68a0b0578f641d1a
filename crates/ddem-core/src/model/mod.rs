//! Constant data of a model, built once from a problem without faults.

mod access;
mod block_boxes;
pub(crate) mod boundary;
pub(crate) mod charge;
mod computed;
pub(crate) mod conditions;
mod contacts;
pub(crate) mod elements;
mod excavation;
pub(crate) mod history;
pub(crate) mod joint_state;
pub(crate) mod mechanism;
pub(crate) mod pairs;
pub mod problem;
mod ramp;
mod ranges;
pub(crate) mod rules;
pub(crate) mod sliding;
pub(crate) mod stage;
mod whole;

use std::ops::Range;
use std::sync::{Arc, OnceLock};

use block_boxes::BlockBoxes;
use contacts::at_bonds;

use crate::model::boundary::{Boundaries, StageGeometry};
use crate::model::conditions::{ActiveConditions, AppliedForces, Conditions};
use crate::model::problem::Problem;
use crate::model::sliding::SlidingDamping;
use ddem_joint::broken::BrokenJoints;
use ddem_joint::contact::{BondedPatch, ContactModel, ContactPoint, JointLookup, bonded_patches};
use ddem_mechanics::element::Elastic;
use ddem_mechanics::law::Laws;
use ddem_mechanics::math::lanes::{LANES, Lanes};
use ddem_mesh::assembly::{Assembly, NO_TABLE};
use ddem_mesh::in_situ::InSitu;
use ddem_mesh::joint_sections::{JointSection, JointSections};
use ddem_mesh::pack::Packs;
use ddem_mesh::properties::{Kinematics, Properties};
use ddem_mesh::slot::NodeSlot;
use ddem_mesh::{CellCount, ConformingJoint, Geometry, Stages, TiedSlots, faces};

/// Number of crossings of the model's diagonal by a charge's waves before joints and contacts are
/// damped again.
const CROSSINGS: f64 = 10.0;

/// A model: blocks with their elements and joints, supports and loads.
#[derive(Debug)]
pub struct Model {
    pub(crate) geometry: Arc<Geometry>,
    /// Geometries of all stages.
    pub(crate) stages: Stages,
    pub(crate) packs: Packs,
    /// Nodes that move as one.
    pub(crate) ties: TiedSlots,
    cell_count: CellCount,
    pub(crate) assembly: Assembly,
    pub(crate) conditions: Conditions,
    pub(crate) boundaries: Boundaries,
    pub(crate) properties: Properties,
    pub(crate) faces: Vec<ConformingJoint>,
    pub(crate) sections: JointSections,
    pub(crate) laws: Laws,
    /// In-situ stress; `None` if no block has one.
    pub(crate) in_situ: Option<InSitu>,
    /// Data of contacts; `None` without contact search and nonconforming joints.
    pub(crate) contact: Option<ContactModel>,
    /// Nonconforming joints, in the order of their blocks.
    pub(crate) bonded_patches: Vec<BondedPatch>,
    /// Damping of failed pairs, of contacts and of the blocks around them.
    pub(crate) sliding: SlidingDamping,
    pub(crate) problem: Arc<Problem>,
    computed: Vec<String>,
    /// Boxes around the blocks, built at the first search by position.
    boxes: OnceLock<BlockBoxes>,
}

impl Model {
    /// The model of a problem.
    #[must_use]
    pub fn new(problem: Arc<Problem>) -> Self {
        let Problem { properties, stages, conditions, boundaries, stresses, .. } = &*problem;
        let (properties, stages) = (properties.clone(), stages.clone());
        let (conditions, mut boundaries) = (conditions.clone(), boundaries.clone());
        let geometry = stages.at(0).clone();
        let packs = Packs::new(&geometry);
        let faces = faces(&geometry);
        let sections = JointSections::new(&properties, &geometry, &packs, &mut |_, _, joint| joint);
        let mut assembly = Assembly::new(&geometry, &packs, &properties);
        let laws: Laws = properties.joints.iter().map(|joint| joint.law.clone()).collect();
        let meets = properties.contact.search || !geometry.nonconforming_joints.is_empty();
        let contact = meets.then(|| ContactModel::new(&properties, &laws, &geometry, &packs));
        let first = faces.last().map_or(0, ConformingJoint::end);
        let bonded_patches = contact.as_ref().map_or_else(Vec::new, |contact| {
            bonded_patches(contact, &properties, &geometry, &packs, first, stresses)
        });
        let bonds = at_bonds(&properties, &geometry, contact.as_ref(), &bonded_patches);
        assembly.assemble(&geometry, &packs, &properties, &sections, &bonds);
        let sliding = SlidingDamping::new(&laws, contact.as_ref(), &properties, &geometry, &packs);
        let geometries = StageGeometry { now: &geometry, start: &geometry, packs: &packs };
        boundaries.add_tied(&geometry);
        boundaries.note_damping(geometries, &assembly);
        let in_situ = InSitu::new(stresses.clone(), &geometry, &packs, &assembly);
        let ties = TiedSlots::new(&geometry, &packs);
        let cell_count = CellCount::new(&geometry);
        Self {
            packs,
            ties,
            cell_count,
            assembly,
            conditions,
            boundaries,
            properties,
            faces,
            sections,
            laws,
            in_situ,
            contact,
            bonded_patches,
            geometry,
            stages,
            sliding,
            problem,
            computed: Vec::new(),
            boxes: OnceLock::new(),
        }
    }

    /// Keys of the laws and histories that a program computes, as in `load[0].history`.
    #[must_use]
    pub fn computed(&self) -> &[String] {
        &self.computed
    }

    /// True if blocks share nodes, or are parts of rigid bodies.
    pub(crate) fn has_shared_motion(&self) -> bool {
        !self.ties.is_empty() || !self.assembly.bodies.is_empty()
    }

    /// True if any block is a part of a cell.
    pub(crate) fn has_cells(&self) -> bool {
        !self.geometry.ties.is_empty()
    }

    pub(crate) fn corotational(&self) -> bool {
        self.properties.kinematics == Kinematics::Corotational
    }

    /// Joints in their initial state. With `broken`, springs replace all joints that can fail. The
    /// critical time step is computed for both states.
    pub(crate) fn tangent(&self, broken: bool) -> BrokenJoints {
        let springs = |section: &JointSection, lane: usize| {
            section.springs[lane] || (broken && self.laws[section.joints[lane] as usize].is_some())
        };
        BrokenJoints::with(&self.packs, &self.assembly, &self.sections, &springs)
    }

    /// Joints at the start of a run. Joints that consist of springs carry the in-situ stress.
    pub(crate) fn broken_joints(&self) -> BrokenJoints {
        let mut broken_joints = self.tangent(false);
        let Some(in_situ) = &self.in_situ else { return broken_joints };
        for (index, d) in (0..self.packs.packs.len()).flat_map(|i| [0, 1, 2].map(|d| (i, d))) {
            let Some(section) = self.sections.get(index, d) else { continue };
            for lane in (0..self.packs.packs[index].filled).filter(|&lane| section.springs[lane]) {
                let Self { geometry, packs, .. } = self;
                let tractions = in_situ.tractions(geometry, packs, index, section, lane);
                if let Some(broken) = &mut broken_joints.at(index)[1 << d] {
                    broken.preload(section, lane, &tractions);
                }
            }
        }
        broken_joints
    }

    pub(crate) fn joint_lookup(&self) -> JointLookup<'_> {
        JointLookup { geometry: &self.geometry, packs: &self.packs, sections: &self.sections }
    }

    /// True if any joint can fail.
    #[must_use]
    pub fn can_fail(&self) -> bool {
        self.laws.iter().any(Option::is_some)
            && self.joint_numbers().any(|joint| self.laws[joint as usize].is_some())
    }

    pub(crate) fn active(&self, stage: usize, applied: &AppliedForces) -> ActiveConditions {
        ActiveConditions::new(&self.conditions, &self.geometry, &self.packs, stage, applied)
    }

    pub(crate) fn geometries(&self) -> StageGeometry<'_> {
        StageGeometry { now: &self.geometry, start: self.stages.at(0), packs: &self.packs }
    }

    /// Number of stages, at least one.
    pub(crate) fn n_stages(&self) -> usize {
        self.problem.kinds.len().max(1)
    }

    /// Number of blocks.
    #[must_use]
    pub fn n_blocks(&self) -> usize {
        self.geometry.blocks.len()
    }

    /// Number of nodes.
    #[must_use]
    pub fn n_nodes(&self) -> usize {
        self.geometry.n_nodes
    }

    /// Number of loads, without the forces of removed blocks.
    #[must_use]
    pub fn n_loads(&self) -> usize {
        self.conditions.loaded.iter().filter(|load| load.fading.is_none()).count()
    }

    /// Number of hex8 elements of all blocks.
    #[must_use]
    pub fn n_elements(&self) -> usize {
        self.geometry.n_elements
    }

    /// Reference position of a node `[m]`.
    ///
    /// # Panics
    ///
    /// If the model has no such node.
    #[must_use]
    pub fn point(&self, node: usize) -> [f64; 3] {
        let (block, at) = self.geometry.locate(node);
        self.geometry.position(block, at).into()
    }

    /// Nodes of the hex8 elements of a block, VTK order, shape `(divisions³, 8)`.
    ///
    /// # Panics
    ///
    /// If the model has no such block.
    pub fn hexes(&self, block: usize) -> impl Iterator<Item = [u32; 8]> + '_ {
        self.geometry.has_block(block);
        let (topology, first) = (self.geometry.topology(block), self.nodes_of(block).start as u32);
        let hexes = (0..topology.elements()).map(move |element| topology.hex(element));
        hexes.map(move |hex| hex.map(|node| first + node as u32))
    }

    /// Name of the set of a block in messages.
    #[must_use]
    pub fn set_name(&self, block: usize) -> String {
        self.problem.sets.list[self.geometry.set(block)].label.clone()
    }

    /// True for a rigid block, which has no stress.
    ///
    /// # Panics
    ///
    /// If the model has no such block.
    #[must_use]
    pub fn is_rigid(&self, block: usize) -> bool {
        self.geometry.has_block(block);
        self.geometry.is_rigid(block)
    }

    /// Number of a block's material, in sorted order of the names.
    ///
    /// # Panics
    ///
    /// If the model has no such block.
    #[must_use]
    pub fn material(&self, block: usize) -> u16 {
        self.geometry.has_block(block);
        self.geometry.blocks[block].material
    }

    /// The block that a node belongs to.
    ///
    /// # Panics
    ///
    /// If the model has no such node.
    #[must_use]
    pub fn block_of(&self, node: usize) -> usize {
        self.geometry.block_of(node)
    }

    /// True while waves of charges cross the model. Failed joints and contacts then have no
    /// damping, unless the deck gives one.
    pub(crate) fn has_blast_waves(&self, time: f64, starts: &[f64]) -> bool {
        if self.conditions.charged.is_empty() || self.properties.contact.damping.is_some() {
            return false;
        }
        let speeds = self.properties.materials.iter().map(Elastic::p_speed);
        let [low, high] = self.geometry.bounds;
        let span = CROSSINGS * (high - low).norm() / speeds.fold(f64::INFINITY, f64::min);
        self.conditions.have_detonated(span, time, starts)
    }

    /// Nodes of a block.
    pub(crate) fn nodes_of(&self, block: usize) -> Range<usize> {
        let first = self.geometry.blocks[block].first_node as usize;
        first..first + self.geometry.topology(block).nodes()
    }

    /// Memory of all data that grow with the model `[bytes]`.
    pub(crate) fn bytes(&self) -> usize {
        let tables: usize = self.assembly.tables.iter().map(|table| table.bytes()).sum();
        let inertia: usize = self.assembly.inertia.iter().map(|i| i.bytes()).sum();
        self.packs.packs.len() * (size_of::<ddem_mesh::pack::Pack>() + 36)
            + self.geometry.blocks.len() * size_of::<u32>()
            + self.stages.bytes()
            + self.faces.len() * size_of::<ConformingJoint>()
            + self.assembly.elements.len() * size_of::<ddem_mesh::assembly::Element>()
            + tables
            + inertia
            + self.in_situ.as_ref().map_or(0, InSitu::bytes)
            + self.ties.bytes()
            + self.assembly.bodies.bytes()
            + self.sliding.bytes()
            + self.bonded_patches.len() * size_of::<BondedPatch>()
            + self.n_nonconforming_pairs() * size_of::<ContactPoint>()
    }

    /// Lumped mass of a node `[kg]`, eq. (3).
    ///
    /// # Panics
    ///
    /// If the model has no such node.
    #[must_use]
    pub fn mass(&self, node: usize) -> f64 {
        let slot = self.node_slot(node);
        let class = self.assembly.pack_inertia[slot.pack] as usize;
        self.assembly.inertia[class].mass[slot.local(&self.packs)].0[slot.lane()]
    }

    /// Diagonal of the assembled stiffness at a node `[N/m]`: block, joints and strips, all intact.
    ///
    /// # Panics
    ///
    /// If the model has no such node.
    #[must_use]
    pub fn stiffness_diagonal(&self, node: usize) -> [f64; 3] {
        let slot = self.node_slot(node);
        let inertia = &self.assembly.inertia[self.assembly.pack_inertia[slot.pack] as usize];
        let first = 3 * slot.local(&self.packs);
        [0, 1, 2].map(|c| inertia.diagonal[first + c].0[slot.lane()])
    }

    /// Storage of a node.
    pub(crate) fn node_slot(&self, node: usize) -> NodeSlot {
        self.packs.node_slot(&self.geometry, node)
    }

    /// Volumes of all blocks, face joints, strips and corners `[m³]`.
    #[must_use]
    pub fn volumes(&self) -> [f64; 4] {
        let mut volumes = [0.0; 4];
        for (pack, tables) in self.packs.packs.iter().zip(&self.assembly.pack_tables) {
            for offset in (0..8).filter(|&offset| tables[offset] != NO_TABLE) {
                let table = &self.assembly.tables[tables[offset] as usize];
                let cells: usize = self.packs.numbering_of(pack).dims(offset).iter().product();
                let kind = (offset as u32).count_ones() as usize;
                for lane in (0..LANES).filter(|&lane| table.elements[lane].is_some()) {
                    volumes[kind] += table.volume(lane, &self.assembly.elements, cells);
                }
            }
        }
        volumes
    }

    /// Value of a nodal field at a node.
    pub(crate) fn get(&self, field: &[Lanes], node: usize) -> [f64; 3] {
        let slot = self.node_slot(node);
        slot.components().map(|at| field[at].0[slot.lane()])
    }

    /// Sets the value of a nodal field at a node.
    pub(crate) fn set(&self, field: &mut [Lanes], node: usize, value: [f64; 3]) {
        let slot = self.node_slot(node);
        for (at, value) in slot.components().into_iter().zip(value) {
            field[at].0[slot.lane()] = value;
        }
    }
}
