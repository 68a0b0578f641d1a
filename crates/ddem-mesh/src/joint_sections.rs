//! Sections of the joints between two blocks, four side by side: areas, stiffnesses and gap.

use std::collections::HashMap;

use nalgebra::{Matrix3, Vector3};

use crate::assembly::NO_TABLE;
use crate::numbering::NodePair;
use crate::pack::{Pack, Packs};
use crate::properties::Properties;
use crate::{Geometry, NO_JOINT};
use ddem_mechanics::element::Elastic;
use ddem_mechanics::law::SpringStiffness;
use ddem_mechanics::math::lanes::{LANES, Lanes};

/// Marker for no section: none of the four lanes has a joint.
const NO_SECTION: u32 = u32::MAX;

/// Four face joints side by side, in one direction of a pack.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointSection {
    /// Number of each lane's joint, or [`NO_JOINT`].
    pub joints: [u16; LANES],
    /// Number of each lane's law: that of its joint, or one that is interpolated towards it.
    pub laws: [u16; LANES],
    /// True if the joint of a lane consists of springs from the start.
    pub springs: [bool; LANES],
    /// Axes of the joint as columns: the unit normal from a to b, and two tangents in its plane.
    pub axes: Matrix3<f64>,
    /// True between rigid blocks, whose pairs lie at the quarters of an edge.
    rigid: bool,
    /// Direction across the joint.
    direction: usize,
    /// Edge vectors of one joint element `[m]`; the one across the joint points from side a to side
    /// b.
    pub edges: [[Lanes; 3]; 3],
    /// Quarter of the area of one joint element `[m²]`.
    pub quarter: Lanes,
    /// Inverse of the quarter area `[1/m²]`; 0 without a joint.
    pub per_quarter: Lanes,
    /// Normal and shear stiffness, k_n and k_s `[Pa/m]`.
    stiffness: [Lanes; 2],
    /// Coefficient of the dashpots of failed pairs `[Pa s/m]`.
    pub dashpot: Lanes,
}

/// Sections of all packs; equal sections are stored once.
#[derive(Clone, Debug, Default)]
pub struct JointSections {
    kinds: Vec<JointSection>,
    of_pack: Vec<[u32; 3]>,
}

impl JointSections {
    /// Sections of all packs. `law` returns the number of a joint's law from block, direction and
    /// joint.
    pub fn new(
        properties: &Properties,
        geometry: &Geometry,
        packs: &Packs,
        law: &mut dyn FnMut(usize, usize, u16) -> u16,
    ) -> Self {
        let mut sections = Self::default();
        let mut known: HashMap<Vec<u64>, u32> = HashMap::new();
        for pack in &packs.packs {
            let of_pack = [0, 1, 2].map(|d| {
                let section = JointSection::new(properties, geometry, pack, d, law);
                if section.joints == [NO_JOINT; LANES] {
                    return NO_SECTION;
                }
                let kinds = &mut sections.kinds;
                *known.entry(section.key()).or_insert_with(|| {
                    kinds.push(section);
                    kinds.len() as u32 - 1
                })
            });
            sections.of_pack.push(of_pack);
        }
        sections
    }

    /// Section of a pack across a direction, if there is one.
    #[inline(always)]
    pub fn get(&self, pack: usize, direction: usize) -> Option<&JointSection> {
        self.kinds.get(self.of_pack[pack][direction] as usize)
    }

    /// Upper neighbours, by offset, on which springs or elements of joints exert forces. `tables` has
    /// the tables of the elements of each pack.
    pub(crate) fn loaded_neighbours(&self, tables: &[[u32; 8]]) -> [bool; 8] {
        let mut acts = [false; 8];
        for (index, tables) in tables.iter().enumerate() {
            for (acts, &table) in acts.iter_mut().zip(tables).skip(1) {
                *acts |= table != NO_TABLE;
            }
            (0..3).for_each(|d| acts[1 << d] |= self.get(index, d).is_some());
        }
        // A lattice lies between its own block and those at all subsets of its offset.
        std::array::from_fn(|offset| {
            (1..8).any(|lattice| acts[lattice] && lattice & offset == offset)
        })
    }
}

impl JointSection {
    fn new(
        properties: &Properties,
        geometry: &Geometry,
        pack: &Pack,
        d: usize,
        law: &mut dyn FnMut(usize, usize, u16) -> u16,
    ) -> Self {
        let lattice = geometry.lattice(pack.blocks[0] as usize);
        let mut section = Self {
            joints: [NO_JOINT; LANES],
            laws: [NO_JOINT; LANES],
            springs: [false; LANES],
            axes: own_axes(lattice.normal(d), lattice.axes[(d + 1) % 3]),
            rigid: lattice.rigid,
            direction: d,
            edges: [[Lanes::ZERO; 3]; 3],
            quarter: Lanes::ZERO,
            per_quarter: Lanes::ZERO,
            stiffness: [Lanes::ZERO; 2],
            dashpot: Lanes::ZERO,
        };
        for lane in 0..pack.filled {
            let block = pack.blocks[lane] as usize;
            let Some(other) = geometry.above(block, d) else { continue };
            let joint = geometry.joint_above(block, d);
            let found = &properties.joints[usize::from(joint)];
            // Between rigid blocks every joint consists of springs (§8).
            (section.joints[lane], section.springs[lane]) =
                (joint, found.layer().is_none() || lattice.rigid);
            section.laws[lane] = law(block, d, joint);
            let edges = [0, 1, 2].map(|e| {
                let across = e == d;
                let size =
                    if across { geometry.gap_above(block, d) } else { geometry.spacing(block, e) };
                lattice.axes[e] * size
            });
            for (lanes, edge) in section.edges.iter_mut().zip(&edges) {
                (0..3).for_each(|c| lanes[c].0[lane] = edge[c]);
            }
            let quarter = geometry.joint_quarter(block, d);
            section.quarter.0[lane] = quarter;
            section.per_quarter.0[lane] = 1.0 / quarter;
            let SpringStiffness { normal, shear } = found.stiffness();
            let [a, b] = [block, other].map(|block| {
                let elastic = &properties.materials[usize::from(geometry.blocks[block].material)];
                VibratingMass::new(geometry, block, d, elastic).mass(normal)
            });
            section.dashpot.0[lane] =
                2.0 * properties.contact.damping_ratio() * (normal * a * b / (a + b)).sqrt();
            for (lanes, k) in section.stiffness.iter_mut().zip([normal, shear]) {
                lanes.0[lane] = k;
            }
        }
        section
    }

    fn key(&self) -> Vec<u64> {
        let flags =
            self.joints.iter().zip(&self.springs).map(|(j, s)| u64::from(*j) << 1 | u64::from(*s));
        let lanes = self.edges.iter().flatten().chain(&self.stiffness).chain([&self.dashpot]);
        let numbers = lanes.flat_map(|lanes| lanes.0).chain(self.axes.iter().copied());
        let laws = self.laws.map(u64::from);
        flags.chain(laws).chain([u64::from(self.rigid)]).chain(numbers.map(f64::to_bits)).collect()
    }

    /// Direction across the joint.
    pub fn direction(&self) -> usize {
        self.direction
    }

    /// Vector from side a to side b at rest `[m]`.
    pub fn gap(&self) -> &[Lanes; 3] {
        &self.edges[self.direction]
    }

    /// Shortest distance between pairs of a lane `[m]`.
    pub fn spacing(&self, lane: usize) -> f64 {
        let edge = |e: usize| self.edges[(self.direction + e) % 3].map(|c| c.0[lane]);
        let length = |edge: [f64; 3]| nalgebra::Vector3::from(edge).norm();
        let part = if self.rigid { 0.5 } else { 1.0 };
        part * length(edge(1)).min(length(edge(2)))
    }

    /// Diagonal of the spring stiffness of a quarter of an element in space axes `[N/m]`.
    pub fn diagonal(&self, lane: usize) -> [f64; 3] {
        let SpringStiffness { normal, shear } = self.stiffness(lane);
        [0, 1, 2].map(|c| {
            let n = self.axes[(c, 0)];
            self.quarter.0[lane] * (shear + (normal - shear) * n * n)
        })
    }

    /// Spring stiffness of a quarter of an element in space axes `[N/m]`.
    pub fn matrix(&self, lane: usize) -> Matrix3<f64> {
        self.stiffness(lane).matrix(&self.axes.column(0).into()) * self.quarter.0[lane]
    }

    /// Normal and shear stiffness of the springs in all lanes, k_n and k_s `[Pa/m]`.
    #[inline(always)]
    pub fn stiffnesses(&self) -> [Lanes; 2] {
        self.stiffness
    }

    /// Spring stiffness of a lane `[Pa/m]`.
    #[inline(always)]
    pub fn stiffness(&self, lane: usize) -> SpringStiffness {
        let [normal, shear] = self.stiffness;
        SpringStiffness { normal: normal.0[lane], shear: shear.0[lane] }
    }
}

/// Mass that vibrates on a joint or contact at a face of a block, per unit area.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VibratingMass {
    /// Masses of the layer of nodes at the face and of the whole block `[kg/m²]`.
    range: [f64; 2],
    /// Impedance `ρ c_P` `[kg/(m² s)]`.
    impedance: f64,
}

impl VibratingMass {
    /// Vibrating mass at the faces of a block across a direction.
    pub fn new(geometry: &Geometry, block: usize, d: usize, elastic: &Elastic) -> Self {
        let height = geometry.surface_height(block, d);
        let n = geometry.topology(block).divisions() as f64;
        let depth = geometry.part(block).map_or(height * n, |part| part.width);
        let whole = elastic.density * depth;
        let layer = if geometry.is_rigid(block) { whole } else { 0.5 * elastic.density * height };
        Self { range: [layer, whole], impedance: (elastic.density * elastic.p_modulus()).sqrt() }
    }

    /// Mass on springs of a stiffness `[kg/m²]`. It is the mass that a wave reaches during their
    /// vibration, `(ρ c_P)²/k`, at least the layer of nodes and at most the block.
    pub fn mass(&self, stiffness: f64) -> f64 {
        let [layer, whole] = self.range;
        (self.impedance * self.impedance / stiffness).max(layer).min(whole)
    }

    /// Mean of the masses of two faces, for the edge between them.
    pub fn mean(a: Self, b: Self) -> Self {
        let mean = |a: f64, b: f64| 0.5 * (a + b);
        let range = [0, 1].map(|k| mean(a.range[k], b.range[k]));
        Self { range, impedance: mean(a.impedance, b.impedance) }
    }

    /// Numbers that distinguish it from others.
    pub fn numbers(&self) -> [f64; 3] {
        let [layer, whole] = self.range;
        [layer, whole, self.impedance]
    }

    /// Mass of the layer of nodes alone `[kg/m²]`.
    pub fn layer(&self) -> f64 {
        self.range[0]
    }
}

/// Orthonormal axes from a unit normal and a direction in its plane.
fn own_axes(normal: Vector3<f64>, along: Vector3<f64>) -> Matrix3<f64> {
    let along = (along - normal * normal.dot(&along)).normalize();
    Matrix3::from_columns(&[normal, along, normal.cross(&along)])
}

/// Pairs of a lattice of face joints, with their axes, areas and stiffnesses.
#[derive(Clone, Copy)]
pub struct FaceLattice<'a> {
    /// Pairs of the lattice.
    pub node_pairs: &'a [NodePair],
    /// Axes, areas and stiffnesses.
    pub section: &'a JointSection,
}
