//! `[[assign]]` in regions: joints and materials of cells in each stage.

use std::collections::BTreeMap;
use std::sync::Arc;

use ddem_core::problem::{BlockFace, FaceId, Geometry, NonconformingJoint, Sets};

use super::CutRock;
use super::blocks::RockBlocks;
use super::joints::{JointOrigin, normal_stiffness};
use crate::build::geometry::{Names, Selector, in_force};
use crate::schema::{Assign, Deck};

/// Joints and materials of cells where nothing is assigned.
pub(in crate::build) struct AssignedRock<'a> {
    pub(in crate::build) deck: &'a Deck,
    pub(in crate::build) names: &'a Names,
    pub(in crate::build) sets: &'a Sets,
    rock: &'a CutRock,
    /// Origins of the joints between cells of one region.
    origins: BTreeMap<JointFaces, JointOrigin>,
}

/// Blocks and faces of a joint.
type JointFaces = ([u32; 2], [FaceId; 2]);

fn face_pair(joint: &NonconformingJoint) -> JointFaces {
    (joint.blocks, joint.faces)
}

impl<'a> AssignedRock<'a> {
    pub(in crate::build) fn new(
        RockBlocks { deck, names, rock, .. }: &RockBlocks<'a>,
        sets: &'a Sets,
        joints: &[(NonconformingJoint, JointOrigin)],
    ) -> Self {
        let origins = joints.iter().map(|(joint, origin)| (face_pair(joint), *origin)).collect();
        Self { deck, names, sets, rock, origins }
    }

    /// Gives the cells of a geometry the joints and materials of a stage. Returns the entries that
    /// select any.
    pub(in crate::build) fn assign(&self, geometry: &mut Geometry, stage: usize) -> Vec<usize> {
        if self.rock.properties.is_empty() {
            return Vec::new();
        }
        let entries: Vec<(usize, &Assign, Selector)> = in_force(self.deck, stage)
            .map(|(index, entry)| (index, entry, Selector::new(&entry.r#where, self.sets)))
            .collect();
        let joints = self.assign_joints(geometry, &entries);
        let materials = self.assign_materials(geometry, &entries);
        let used = entries.iter().zip(joints.into_iter().zip(materials));
        let used = used.filter(|(_, (joint, material))| *joint || *material);
        used.map(|((index, ..), _)| *index).collect()
    }

    /// Returns which entries select joints.
    fn assign_joints(
        &self,
        geometry: &mut Geometry,
        entries: &[(usize, &Assign, Selector)],
    ) -> Vec<bool> {
        let mut used = vec![false; entries.len()];
        let mut joints = geometry.nonconforming_joints.to_vec();
        for joint in &mut joints {
            let Some(origin) = self.origins.get(&face_pair(joint)) else { continue };
            let [a, b] = [0, 1].map(|side| BlockFace {
                block: joint.blocks[side] as usize,
                face: joint.faces[side],
            });
            let exists = ![a.block, b.block].iter().any(|&block| geometry.is_removed(block));
            let mut number = origin.own;
            for (at, (_, entry, selector)) in entries.iter().enumerate() {
                let Some(named) = entry.joint.as_ref().and_then(|name| self.names.joint(name))
                else {
                    continue;
                };
                if !origin.is_rock
                    && self.of_cut(entry, origin)
                    && origin.regions.iter().any(|&region| selector.has_set(region))
                    && selector.contains_face(&a.centre(geometry), &a.outward(geometry))
                {
                    number = named;
                    used[at] |= exists;
                }
            }
            if number != joint.joint {
                (joint.joint, joint.stiffness) = (number, normal_stiffness(self.deck, number));
            }
        }
        geometry.join(joints);
        used
    }

    /// True if an entry may select the joints of an origin by the name of the cut.
    fn of_cut(&self, entry: &Assign, origin: &JointOrigin) -> bool {
        let own = origin.cut.and_then(|cut| self.deck.cut[cut as usize].name.as_ref());
        entry.r#where.cut.as_ref().is_none_or(|name| own == Some(name))
    }

    /// Returns which entries select blocks.
    fn assign_materials(
        &self,
        geometry: &mut Geometry,
        entries: &[(usize, &Assign, Selector)],
    ) -> Vec<bool> {
        let rock = self.rock;
        let mut used = vec![false; entries.len()];
        let materials: Vec<u16> = (0..rock.properties.len())
            .map(|cell| {
                let mut material = &rock.region(cell).material;
                for (at, (_, entry, selector)) in entries.iter().enumerate() {
                    let Some(named) = &entry.material else { continue };
                    if rock.selects(selector, cell) {
                        (material, used[at]) = (named, true);
                    }
                }
                self.names.material(material).unwrap_or_default()
            })
            .collect();
        let own = |geometry: &Geometry, block: usize| {
            geometry.part(block).map(|part| materials[part.cell as usize])
        };
        for block in 0..geometry.blocks.len() {
            let now = geometry.blocks[block].material;
            let Some(material) = own(geometry, block).filter(|material| *material != now) else {
                continue;
            };
            let lattice = geometry.blocks[block].lattice as usize;
            let lattice = Arc::make_mut(&mut geometry.lattices[lattice]);
            Arc::make_mut(&mut lattice.material).fill(material);
            Arc::make_mut(&mut geometry.blocks)[block].material = material;
        }
        used
    }
}
