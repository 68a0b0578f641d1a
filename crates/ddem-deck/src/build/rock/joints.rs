//! Joints between the parts of cells.

use ddem_core::Fault;
use ddem_core::element::Elastic;
use ddem_core::problem::{
    BlockFace, FaceId, Geometry, JointElasticity, JointProperties, NonconformingJoint,
};
use ddem_cut::{CellPart, CommonFace, PlaneSource};

use super::blocks::RockBlocks;
use crate::build::geometry::{Selector, nothing};
use crate::schema::RockRegion;

/// Thickness of rock whose compliance the springs between joined cells have where their nodes do not
/// match, as a fraction of the height of an element.
const STIFF: f64 = 0.1;

impl RockBlocks<'_> {
    /// Joints between parts of cells that are not joined, sorted by their blocks.
    pub(super) fn joints(
        &self,
        geometry: &Geometry,
    ) -> Result<Vec<NonconformingJoint>, Vec<Fault>> {
        let assigned: Vec<(usize, u16, Selector)> = self
            .assigned()
            .filter_map(|(index, entry, selector)| {
                Some((index, self.names.joint(entry.joint.as_ref()?)?, selector))
            })
            .collect();
        let mut used = vec![false; assigned.len()];
        let mut joints = Vec::new();
        for face in self.rock.common.iter().filter(|face| self.both_exist(face)) {
            let plane = &self.rock.complex.planes()[face.plane as usize];
            let tied = self.rock.is_joined(face);
            if tied && face.matches {
                continue;
            }
            if tied {
                // Nodes of one side have no partner where a cut ended: stiff springs hold the faces.
                let joint = self.stiff_joint(self.region(face.cells[0] as usize));
                let faces = self.facing(geometry, face).into_iter();
                joints.extend(faces.map(|(faces, area)| self.joint(faces, joint, area)));
                continue;
            }
            let (number, bridge) = match plane.source {
                PlaneSource::Region => continue,
                PlaneSource::Cut(number) => (number, false),
                PlaneSource::Bridge(number) => (number, true),
            };
            let own = self.deck.cut[number as usize].joint.as_ref();
            let Some(own) = own.and_then(|name| self.names.joint(name)) else { continue };
            for (faces, area) in self.facing(geometry, face) {
                let (centre, normal) = (faces[0].centre(geometry), faces[0].outward(geometry));
                if bridge || !self.rock.complex.covers(face.plane, &centre) {
                    let joint = self.bridge(number, face);
                    joints.push(self.joint(faces, joint, area));
                    continue;
                }
                let mut joint = own;
                for (at, (_, other, selector)) in assigned.iter().enumerate() {
                    let in_set =
                        face.cells.iter().any(|&c| selector.has_set(self.region(c as usize)));
                    if in_set
                        && self.of_cut(assigned[at].0, number)
                        && selector.contains_face(&centre, &normal)
                    {
                        (joint, used[at]) = (*other, true);
                    }
                }
                joints.push(self.joint(faces, joint, area));
            }
        }
        let unused = assigned
            .iter()
            .zip(used)
            .filter(|((index, ..), used)| !used && self.deck.assign[*index].material.is_none());
        let faults: Vec<Fault> = unused
            .map(|((index, ..), _)| nothing(format!("assign[{index}].where"), "no joint"))
            .collect();
        joints.sort_by_key(|joint: &NonconformingJoint| joint.blocks);
        if faults.is_empty() { Ok(joints) } else { Err(faults) }
    }

    /// True if an `assign` selects the joints of a cut.
    fn of_cut(&self, entry: usize, cut: u32) -> bool {
        let name = self.deck.assign[entry].r#where.cut.as_ref();
        name.is_none_or(|name| self.deck.cut[cut as usize].name.as_ref() == Some(name))
    }

    /// Number of the joint in the bridges of rock that a cut leaves: that of the deck, or a stiff one.
    fn bridge(&self, cut: u32, face: &CommonFace) -> u16 {
        let named = self.deck.cut[cut as usize].bridge_joint();
        let joint = named.and_then(|name| self.names.joint(name));
        joint.unwrap_or_else(|| self.stiff_joint(self.region(face.cells[0] as usize)))
    }

    /// Number of the joint that holds joined cells of a region where their nodes do not match. Such
    /// joints follow those of the deck.
    fn stiff_joint(&self, region: usize) -> u16 {
        (self.deck.joints.len() + region) as u16
    }

    /// Joints of rock between joined cells whose nodes do not match, one for each region; none
    /// without such cells.
    pub(super) fn stiff_joints(&self, joints: &[NonconformingJoint]) -> Vec<JointProperties> {
        let first = self.stiff_joint(0);
        if joints.iter().all(|joint| joint.joint < first) {
            return Vec::new();
        }
        let of = |(region, entry): (usize, &RockRegion)| {
            let material = self.deck.materials.get(&entry.material);
            let rock = material.map_or(Elastic::new(1.0, 1.0, 0.0), |material| {
                Elastic::new(material.density, material.young, material.poisson)
            });
            let height = self.rock.median_width(region) / f64::from(entry.divisions);
            let elastic = JointElasticity::Layer(rock);
            let name = format!("rock of {}", self.rock.region_name(region));
            JointProperties { name, thickness: STIFF * height, elasticity: elastic, law: None }
        };
        self.deck.region.iter().enumerate().map(of).collect()
    }

    fn joint(&self, faces: [BlockFace; 2], joint: u16, area: f64) -> NonconformingJoint {
        let [a, b] = if faces[0].block < faces[1].block { faces } else { [faces[1], faces[0]] };
        let properties = self.deck.joints.values().nth(joint.into());
        let stiffness = properties.and_then(|joint| joint.stiffness(&self.deck.materials));
        NonconformingJoint {
            blocks: [a.block as u32, b.block as u32],
            faces: [a.face, b.face],
            joint,
            area,
            gap: 0.0,
            stiffness: stiffness.map_or(0.0, |[normal, _]| normal),
        }
    }

    /// Faces of parts that lie on each other in a face of two cells, and their common areas `[m²]`.
    fn facing(&self, geometry: &Geometry, face: &CommonFace) -> Vec<([BlockFace; 2], f64)> {
        let [own, other] = [0, 1].map(|side| self.faces_of(face, side));
        let mut facing = Vec::new();
        for (vertex, a) in &own {
            for (beyond, b) in &other {
                if face.matches {
                    if vertex == beyond {
                        facing.push(([*a, *b], a.area(geometry)));
                    }
                    continue;
                }
                let faces = [*a, *b];
                let rest = faces.map(|face| face.at_rest(geometry));
                let blocks = faces.map(|face| face.block);
                if let Some(overlap) = geometry.face_overlap(blocks, &rest, [0.0; 2]) {
                    facing.push((faces, overlap.area));
                }
            }
        }
        facing
    }

    /// Faces of the parts in a face of one of its two cells, each with the vertex of its part.
    fn faces_of(&self, face: &CommonFace, side: usize) -> Vec<(u32, BlockFace)> {
        let (cell, number) = (face.cells[side] as usize, face.faces[side]);
        let of = |(at, part): (usize, &CellPart)| {
            let direction = part.faces.iter().position(|&face| face == Some(number))?;
            let block = self.first[cell] + at;
            Some((part.vertex, BlockFace { block, face: FaceId { direction, upper: false } }))
        };
        self.parts[cell].iter().enumerate().filter_map(of).collect()
    }
}
