//! Sections of the joints between two blocks, four side by side: areas, stiffnesses, the gap.

use std::collections::HashMap;

use nalgebra::{Matrix3, Vector3};

use crate::pack::{NodePair, Pack, Packs};
use crate::properties::Properties;
use crate::{Geometry, NO_JOINT};
use ddem_mechanics::element::Elastic;
use ddem_mechanics::law::SpringStiffness;
use ddem_mechanics::math::lanes::{LANES, Lanes};

/// No seam: none of the four lanes has a joint.
const NO_SECTION: u32 = u32::MAX;

/// Four face joints side by side, of one direction of a pack.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointSection {
    /// Number of each lane's joint, or [`NO_JOINT`].
    pub joints: [u16; LANES],
    /// Number of each lane's law: that of its joint, or of one that is on its way there.
    pub laws: [u16; LANES],
    /// True if the joint of a lane consists of springs from the start.
    pub springs: [bool; LANES],
    /// The joint's own axes as columns: the unit normal, from a to b, and two in its plane.
    pub axes: Matrix3<f64>,
    /// Between rigid blocks, whose pairs are at the quarters of an edge.
    rigid: bool,
    /// Direction across the joint.
    direction: usize,
    /// Edges of one joint element; the one across the joint goes from side a to side b `[m]`.
    pub edges: [[Lanes; 3]; 3],
    /// A quarter of the area of one joint element `[m²]`.
    pub quarter: Lanes,
    /// One over it; 0 where there is no joint.
    pub per_quarter: Lanes,
    /// k_n and k_s `[Pa/m]`.
    stiffness: [Lanes; 2],
    /// Of the dashpots of failed pairs `[Pa s/m]`.
    pub dashpot: Lanes,
}

/// The seams of all packs, equal ones once.
#[derive(Clone, Debug, Default)]
pub struct JointSections {
    kinds: Vec<JointSection>,
    of_pack: Vec<[u32; 3]>,
}

impl JointSections {
    /// `law` is the number of the law of a joint, above a block along a direction.
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

    /// The seam of a pack across a direction, if there is one.
    #[inline(always)]
    pub fn get(&self, pack: usize, direction: usize) -> Option<&JointSection> {
        self.kinds.get(self.of_pack[pack][direction] as usize)
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
            // Between rigid blocks every joint is springs (§8).
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

    /// From side a to side b at rest `[m]`.
    pub fn gap(&self) -> &[Lanes; 3] {
        &self.edges[self.direction]
    }

    /// Shortest distance of its pairs `[m]`.
    pub fn spacing(&self, lane: usize) -> f64 {
        let edge = |e: usize| self.edges[(self.direction + e) % 3].map(|c| c.0[lane]);
        let length = |edge: [f64; 3]| nalgebra::Vector3::from(edge).norm();
        let part = if self.rigid { 0.5 } else { 1.0 };
        part * length(edge(1)).min(length(edge(2)))
    }

    /// Stiffness of the springs of a quarter of an element along the axes `[N/m]`.
    pub fn diagonal(&self, lane: usize) -> [f64; 3] {
        let SpringStiffness { normal, shear } = self.stiffness(lane);
        [0, 1, 2].map(|c| {
            let n = self.axes[(c, 0)];
            self.quarter.0[lane] * (shear + (normal - shear) * n * n)
        })
    }

    /// Stiffness of the springs of a quarter of an element `[N/m]`.
    pub fn matrix(&self, lane: usize) -> Matrix3<f64> {
        let SpringStiffness { normal, shear } = self.stiffness(lane);
        let n = self.axes.column(0);
        let across = n * n.transpose();
        (Matrix3::identity() * shear + across * (normal - shear)) * self.quarter.0[lane]
    }

    /// Stiffness of the springs of a lane `[Pa/m]`.
    #[inline(always)]
    pub fn stiffness(&self, lane: usize) -> SpringStiffness {
        let [normal, shear] = self.stiffness;
        SpringStiffness { normal: normal.0[lane], shear: shear.0[lane] }
    }
}

/// Mass that vibrates on a joint or contact at a face of a block, for each unit of area.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VibratingMass {
    /// Of the layer of nodes at the face, and of the whole block `[kg/m²]`.
    range: [f64; 2],
    /// Impedance `ρ c_P` `[kg/(m² s)]`.
    impedance: f64,
}

impl VibratingMass {
    /// At the faces of a body across a direction.
    pub fn new(geometry: &Geometry, block: usize, d: usize, elastic: &Elastic) -> Self {
        let height = geometry.height(block, d);
        let whole = elastic.density * height * geometry.topology(block).divisions() as f64;
        let layer = if geometry.is_rigid(block) { whole } else { 0.5 * elastic.density * height };
        Self { range: [layer, whole], impedance: (elastic.density * elastic.p_modulus()).sqrt() }
    }

    /// Mass on springs of a stiffness: as much as a wave reaches in the time of their vibration, `(ρ c_P)²/k`
    /// `[kg/m²]`.
    pub fn mass(&self, stiffness: f64) -> f64 {
        let [layer, whole] = self.range;
        (self.impedance * self.impedance / stiffness).max(layer).min(whole)
    }

    /// Of an edge between two faces.
    pub fn mean(a: Self, b: Self) -> Self {
        let mean = |a: f64, b: f64| 0.5 * (a + b);
        let range = [0, 1].map(|k| mean(a.range[k], b.range[k]));
        Self { range, impedance: mean(a.impedance, b.impedance) }
    }

    /// Its numbers, to tell it from others.
    pub fn numbers(&self) -> [f64; 3] {
        let [layer, whole] = self.range;
        [layer, whole, self.impedance]
    }

    /// Of the layer of nodes alone `[kg/m²]`.
    pub fn layer(&self) -> f64 {
        self.range[0]
    }
}

/// Orthonormal axes from a unit normal and a direction in its plane.
fn own_axes(normal: Vector3<f64>, along: Vector3<f64>) -> Matrix3<f64> {
    let along = (along - normal * normal.dot(&along)).normalize();
    Matrix3::from_columns(&[normal, along, normal.cross(&along)])
}

/// Pairs of a lattice of face joints, and their axes, areas and stiffnesses.
#[derive(Clone, Copy)]
pub struct FaceLattice<'a> {
    /// Its pairs.
    pub node_pairs: &'a [NodePair],
    /// Its areas and stiffnesses.
    pub section: &'a JointSection,
}
