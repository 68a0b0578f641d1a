//! Problems from arrays: hexahedra by block, joints by pairs of faces.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::build_error::BuildError;
use super::{Problem, Set, Sets, StartMotion};
use crate::model::boundary::Boundaries;
use crate::model::conditions::{Conditions, LoadPattern, SupportGroup};
use crate::model::history::TimeFunction;
use crate::model::rules::shown;
use crate::model::stage::{StageKind, StageRange};
use ddem_mechanics::collide::FaceId;
use ddem_mechanics::element::{Elastic, ElementKind};
use ddem_mechanics::law;
use ddem_mesh::in_situ::Stress;
use ddem_mesh::properties::{ContactProperties, JointProperties, Kinematics, Properties};
use ddem_mesh::{
    BlockFace, Geometry, HexMesh, MeshBlock, MeshFaces, NonconformingJoint, Stages, Topology, Vec3,
    bounds,
};

/// A joint between two faces of blocks.
#[derive(Clone, Copy, Debug)]
struct FacePair {
    quads: [[u32; 4]; 2],
    joint: u16,
}

/// Blocks, joints, supports and loads as arrays, with the numbers of a mesh.
///
/// Blocks and nodes have the numbers of the mesh. [`build`](Self::build) renumbers the nodes by
/// block and returns the new numbers.
#[derive(Clone, Debug)]
pub struct ProblemBuilder {
    /// Settings, contacts, materials and joints. Blocks have the first material by default.
    pub properties: Properties,
    /// Kinds of the stages; empty for one stage.
    pub stages: Vec<StageKind>,
    blocks: Vec<MeshBlock>,
    n_nodes: usize,
    materials: Vec<u16>,
    rigid: Vec<bool>,
    pairs: Vec<FacePair>,
    fixed: Vec<SupportGroup>,
    loaded: Vec<LoadPattern>,
    motions: Vec<StartMotion>,
    stresses: Vec<Option<Stress>>,
}

impl ProblemBuilder {
    /// Builder with the blocks of a mesh, all of one material.
    ///
    /// # Errors
    ///
    /// Faults of the mesh.
    pub fn new(mesh: &HexMesh, material: Elastic) -> Result<Self, BuildError> {
        let blocks = mesh.parallelepipeds()?;
        Ok(Self {
            properties: Properties {
                gravity: Vec3::zeros(),
                kinematics: Kinematics::default(),
                element: ElementKind::default(),
                peaks: false,
                contact: ContactProperties { search: true, ..ContactProperties::default() },
                materials: vec![material],
                joints: Vec::new(),
            },
            stages: Vec::new(),
            materials: vec![0; blocks.len()],
            rigid: vec![false; blocks.len()],
            stresses: Vec::new(),
            n_nodes: mesh.nodes.len(),
            blocks,
            pairs: Vec::new(),
            fixed: Vec::new(),
            loaded: Vec::new(),
            motions: Vec::new(),
        })
    }

    /// Adds a material and returns its number. [`build`](Self::build) allows at most 65 535.
    pub fn material(&mut self, material: Elastic) -> u16 {
        self.properties.materials.push(material);
        u16::try_from(self.properties.materials.len() - 1).unwrap_or(u16::MAX)
    }

    /// Adds a joint and returns its number. [`build`](Self::build) allows at most 65 535.
    pub fn joint(&mut self, joint: JointProperties) -> u16 {
        self.properties.joints.push(joint);
        u16::try_from(self.properties.joints.len() - 1).unwrap_or(u16::MAX)
    }

    /// Gives a block another material.
    pub fn set_material(&mut self, block: usize, material: u16) -> Result<&mut Self, BuildError> {
        self.has("block", block, self.blocks.len())?;
        self.has("material", material.into(), self.properties.materials.len())?;
        self.materials[block] = material;
        Ok(self)
    }

    /// Makes a block rigid. Of its nodes only the corners remain.
    pub fn set_rigid(&mut self, block: usize) -> Result<&mut Self, BuildError> {
        self.has("block", block, self.blocks.len())?;
        self.rigid[block] = true;
        Ok(self)
    }

    /// Sets the stress of a block at the start `[Pa]`.
    pub fn set_stress(&mut self, block: usize, stress: Stress) -> Result<&mut Self, BuildError> {
        self.has("block", block, self.blocks.len())?;
        self.stresses.resize(self.blocks.len(), None);
        self.stresses[block] = Some(stress);
        Ok(self)
    }

    /// Joins two faces of blocks, each given by four nodes, such as those of one of its elements.
    pub fn join(&mut self, quads: [[u32; 4]; 2], joint: u16) -> Result<&mut Self, BuildError> {
        self.has("joint", joint.into(), self.properties.joints.len())?;
        self.pairs.push(FacePair { quads, joint });
        Ok(self)
    }

    /// Supports nodes along some axes.
    pub fn fix(&mut self, nodes: &[u32], axes: [bool; 3]) -> Result<&mut SupportGroup, BuildError> {
        self.has_nodes(nodes.iter())?;
        self.fixed.push(SupportGroup {
            nodes: nodes.to_vec(),
            removed: Vec::new(),
            axes,
            velocity: None,
            displacement: [0.0; 3],
            history: TimeFunction::Constant,
            in_force: StageRange::ALWAYS,
        });
        let last = self.fixed.len() - 1;
        Ok(&mut self.fixed[last])
    }

    /// Adds a load: nodal forces at factor 1 `[N]`.
    pub fn load(&mut self, forces: &[(u32, [f64; 3])]) -> Result<&mut LoadPattern, BuildError> {
        self.has_nodes(forces.iter().map(|(node, _)| node))?;
        let forces = forces.iter().map(|&(node, force)| (node, Vec3::from(force))).collect();
        let (history, in_force) = (TimeFunction::Constant, StageRange::ALWAYS);
        self.loaded.push(LoadPattern { forces, history, in_force, fading: None });
        let last = self.loaded.len() - 1;
        Ok(&mut self.loaded[last])
    }

    /// Adds a motion of nodes at the start. Later motions replace earlier ones.
    pub fn motion(&mut self, motion: StartMotion) -> Result<&mut Self, BuildError> {
        self.has_nodes(motion.nodes.iter())?;
        self.motions.push(motion);
        Ok(self)
    }

    /// Problem, and the number in it of each mesh node. Nodes without a block and nodes of rigid
    /// blocks that are not corners have none.
    ///
    /// # Errors
    ///
    /// More than 65 535 materials or joints; laws that [`Model::set_law`](crate::Model::set_law)
    /// refuses; faces that a joint cannot join; supports, loads or motions at nodes without a
    /// number.
    pub fn build(self) -> Result<(Problem, Vec<Option<u32>>), BuildError> {
        let Properties { materials, joints, .. } = &self.properties;
        for (what, count) in [("materials", materials.len()), ("joints", joints.len())] {
            if count > usize::from(u16::MAX) {
                return Err(BuildError::TooMany { what, count });
            }
        }
        for joint in joints {
            let checked = match &joint.law {
                None => Ok(()),
                Some(_) if joint.is_whole_rock() => Err("whole rock cannot fail".to_owned()),
                Some(law) => law::check(&**law),
            };
            checked.map_err(|why| BuildError::Law { joint: joint.name.clone(), why })?;
        }
        let lattice = |(k, block): (usize, &MeshBlock)| {
            Arc::new(block.lattice(0, self.materials[k], self.rigid[k]))
        };
        let lattices: Vec<_> = self.blocks.iter().enumerate().map(lattice).collect();
        let bounds = bounds(&lattices);
        let mut geometry = Geometry::new(lattices, bounds);
        geometry.join(self.nonconforming_joints(&geometry)?);
        geometry.touching = Arc::new(geometry.in_touch());
        let numbers = self.numbers(&geometry);
        let Self { properties, stages: kinds, fixed, loaded, motions, stresses, .. } = &self;
        let mut conditions =
            Conditions { fixed: fixed.clone(), loaded: loaded.clone(), ..Conditions::default() };
        let mut motions = motions.clone();
        let at = |node: u32| self.number(&numbers, node);
        for nodes in conditions
            .fixed
            .iter_mut()
            .map(|fix| &mut fix.nodes)
            .chain(motions.iter_mut().map(|motion| &mut motion.nodes))
        {
            *nodes = nodes.iter().map(|&node| at(node)).collect::<Result<_, _>>()?;
            nodes.sort_unstable();
            nodes.dedup();
        }
        for (node, _) in conditions.loaded.iter_mut().flat_map(|load| &mut load.forces) {
            *node = at(*node)?;
        }
        let problem = Problem {
            properties: properties.clone(),
            stages: Stages {
                geometries: vec![(0, Arc::new(geometry))],
                assigns: Vec::new(),
                excavated: false,
            },
            conditions,
            boundaries: Boundaries::default(),
            stresses: stresses.clone(),
            motions,
            kinds: kinds.clone(),
            sets: sets(bounds),
        };
        Ok((problem, numbers))
    }

    fn has(&self, what: &'static str, number: usize, count: usize) -> Result<(), BuildError> {
        if number < count { Ok(()) } else { Err(BuildError::Missing { what, number, count }) }
    }

    fn has_nodes<'a>(&self, mut nodes: impl Iterator<Item = &'a u32>) -> Result<(), BuildError> {
        nodes.try_for_each(|&node| self.has("node", node as usize, self.n_nodes))
    }

    /// Number of each node of the mesh in the problem.
    fn numbers(&self, geometry: &Geometry) -> Vec<Option<u32>> {
        let mut numbers = vec![None; self.n_nodes];
        for (block, found) in self.blocks.iter().enumerate() {
            let topology = Topology::lattice(found.divisions);
            let step = found.divisions / geometry.topology(block).divisions();
            for (local, &node) in found.nodes.iter().enumerate() {
                let at = topology.steps(local);
                if at.iter().all(|i| i.is_multiple_of(step)) {
                    let at = at.map(|i| i / step);
                    numbers[node as usize] = Some(geometry.node(block, at) as u32);
                }
            }
        }
        numbers
    }

    fn number(&self, numbers: &[Option<u32>], node: u32) -> Result<u32, BuildError> {
        let inside = || {
            let block = self.blocks.iter().position(|block| block.nodes.contains(&node));
            match block {
                Some(block) => BuildError::InRigid { node, block },
                None => BuildError::Loose { node },
            }
        };
        numbers[node as usize].ok_or_else(inside)
    }

    /// Nonconforming joints, sorted by their blocks.
    fn nonconforming_joints(
        &self,
        geometry: &Geometry,
    ) -> Result<Vec<NonconformingJoint>, BuildError> {
        let faces = MeshFaces::new(&self.blocks);
        let mut joined: BTreeMap<[u32; 2], NonconformingJoint> = BTreeMap::new();
        for &FacePair { quads, joint } in &self.pairs {
            let mut sides = Vec::with_capacity(2);
            for quad in quads {
                sides.push(faces.of(quad).ok_or(BuildError::NoFace { quad })?);
            }
            sides.sort_by_key(|(block, _)| *block);
            let [(a, face_a), (b, face_b)] = sides[..] else { continue };
            let joint_pair = self.joint_pair(geometry, [a, b], [face_a, face_b], joint)?;
            let known = joined.entry(joint_pair.blocks).or_insert(joint_pair);
            if *known != joint_pair {
                return Err(self.no_joint(
                    [a, b],
                    joint,
                    "another joint or pair of faces joins them already".into(),
                ));
            }
        }
        Ok(joined.into_values().collect())
    }

    fn no_joint(&self, blocks: [usize; 2], joint: u16, why: String) -> BuildError {
        let joint = self.properties.joints[usize::from(joint)].name.clone();
        BuildError::NoJoint { blocks, joint, why }
    }

    fn joint_pair(
        &self,
        geometry: &Geometry,
        blocks: [usize; 2],
        faces: [FaceId; 2],
        joint: u16,
    ) -> Result<NonconformingJoint, BuildError> {
        let refuse = |why: &str| self.no_joint(blocks, joint, why.into());
        if blocks[0] == blocks[1] {
            return Err(refuse("both faces are of one block: give faces of two"));
        }
        let properties = &self.properties.joints[usize::from(joint)];
        let sides = [0, 1].map(|side| BlockFace { block: blocks[side], face: faces[side] });
        let Some(rest) = geometry.opposed(sides) else {
            return Err(refuse("the faces do not face each other: give two that do"));
        };
        let range = [-properties.thickness, f64::INFINITY];
        let Some(overlap) = geometry.face_overlap(blocks, &rest, range) else {
            return Err(refuse("the faces do not overlap: give two that do"));
        };
        let misses = geometry.misses(blocks);
        if overlap.gap > misses && (overlap.gap - properties.thickness).abs() > misses {
            return Err(refuse(&format!(
                "the faces are {} m apart and the joint is {} m thick: move the blocks, or give the joint this \
                 thickness",
                shown(overlap.gap),
                shown(properties.thickness)
            )));
        }
        Ok(NonconformingJoint {
            blocks: blocks.map(|block| block as u32),
            faces,
            joint,
            area: overlap.area,
            gap: overlap.gap,
            stiffness: properties.stiffness().normal,
            cut: None,
        })
    }
}

/// One set of all blocks, whose sides are those of the box around it.
fn sets(bounds: [Vec3; 2]) -> Sets {
    let [low, high] = bounds;
    let corner =
        |k: usize| Vec3::from([0, 1, 2].map(|d| if k >> d & 1 == 1 { high[d] } else { low[d] }));
    let set = Set {
        name: None,
        label: "mesh".into(),
        ends: [0, 1, 2].map(|d| (Vec3::ith(d, 1.0), [low[d], high[d]])),
        corners: std::array::from_fn(corner),
    };
    Sets { bounds, list: vec![set] }
}
