//! Joints between the parts of cells.

use ddem_core::element::Elastic;
use ddem_core::problem::{
    BlockFace, FaceId, Geometry, JointElasticity, JointProperties, NonconformingJoint, Vec3,
};
use ddem_cut::{CellPart, CommonFace, PlaneSource};

use super::blocks::RockBlocks;
use crate::schema::{Deck, RockRegion};

/// Thickness of rock whose compliance the springs between joined cells have where their nodes do not
/// match, as a fraction of the height of an element.
const STIFF: f64 = 0.1;

/// Origin of a joint: what holds where nothing is assigned.
#[derive(Clone, Copy, Debug)]
pub(in crate::build) struct JointOrigin {
    /// Number of the joint.
    pub(super) own: u16,
    /// Number of the cut; `None` between cells of a file.
    pub(super) cut: Option<u32>,
    /// Regions on both sides.
    pub(super) regions: [usize; 2],
    /// True for rock, which no entry replaces.
    pub(super) is_rock: bool,
}

impl RockBlocks<'_> {
    /// Joints between parts of cells of one region that are not joined, sorted by their blocks, before
    /// anything is assigned.
    pub(in crate::build) fn joints(
        &self,
        geometry: &Geometry,
    ) -> Vec<(NonconformingJoint, JointOrigin)> {
        let mut joints = Vec::new();
        for face in self.rock.common.iter().filter(|face| self.both_exist(face)) {
            let Some(origin) = self.origin(face) else { continue };
            for (faces, area) in self.facing(geometry, face) {
                let origin = self.beside_fracture(origin, face, &faces[0].centre(geometry));
                joints.push((self.joint(faces, &origin, area), origin));
            }
        }
        joints.sort_by_key(|(joint, _)| joint.blocks);
        joints
    }

    /// Origin of the joints in a common face; `None` if there are none.
    fn origin(&self, face: &CommonFace) -> Option<JointOrigin> {
        let regions = face.cells.map(|cell| self.region(cell as usize));
        if self.rock.is_joined(face) {
            // Nodes of one side have no partner where a cut ended: stiff springs hold the faces.
            let own = self.stiff_joint(regions[0]);
            return (!face.matches).then_some(JointOrigin {
                own,
                cut: None,
                regions,
                is_rock: true,
            });
        }
        // Cells of a file have no cut.
        let (cut, is_rock) = match self.rock.complex.planes()[face.plane as usize].source {
            PlaneSource::Region => (None, false),
            PlaneSource::Cut(cut) => (Some(cut), false),
            PlaneSource::Bridge(cut) => (Some(cut), true),
        };
        let own = match cut {
            Some(cut) => self.deck.cut[cut as usize].joint.as_ref(),
            // Sets that touch give the joints between regions.
            None if regions[0] != regions[1] => None,
            None => self.rock.region_joint(face),
        };
        let own = self.names.joint(own?)?;
        let own = cut.filter(|_| is_rock).map_or(own, |cut| self.bridge(cut, regions[0]));
        Some(JointOrigin { own, cut, regions, is_rock })
    }

    /// Origin of a joint at a point: a bridge of rock, if a fracture does not reach there.
    fn beside_fracture(&self, origin: JointOrigin, face: &CommonFace, at: &Vec3) -> JointOrigin {
        match origin.cut.filter(|_| !self.rock.complex.covers(face.plane, at)) {
            Some(cut) => {
                let own = self.bridge(cut, origin.regions[0]);
                JointOrigin { own, is_rock: true, ..origin }
            }
            None => origin,
        }
    }

    /// Number of the joint in the bridges of rock that a cut leaves: that of the deck, or a stiff one.
    fn bridge(&self, cut: u32, region: usize) -> u16 {
        let named = self.deck.cut[cut as usize].bridge_joint();
        let joint = named.and_then(|name| self.names.joint(name));
        joint.unwrap_or_else(|| self.stiff_joint(region))
    }

    /// Number of the joint that holds joined cells of a region where their nodes do not match. Such
    /// joints follow those of the deck.
    fn stiff_joint(&self, region: usize) -> u16 {
        (self.deck.joints.len() + region) as u16
    }

    /// Joints of rock between joined cells whose nodes do not match, one for each region; none
    /// without such cells.
    pub(in crate::build) fn stiff_joints(
        &self,
        joints: &[NonconformingJoint],
    ) -> Vec<JointProperties> {
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
            let elastic = JointElasticity::WholeRock(rock);
            let name = format!("rock of {}", self.rock.region_name(region));
            JointProperties { name, thickness: STIFF * height, elasticity: elastic, law: None }
        };
        self.deck.region.iter().enumerate().map(of).collect()
    }

    fn joint(&self, faces: [BlockFace; 2], origin: &JointOrigin, area: f64) -> NonconformingJoint {
        let [a, b] = if faces[0].block < faces[1].block { faces } else { [faces[1], faces[0]] };
        NonconformingJoint {
            blocks: [a.block as u32, b.block as u32],
            faces: [a.face, b.face],
            joint: origin.own,
            area,
            gap: 0.0,
            stiffness: normal_stiffness(self.deck, origin.own),
            cut: origin.cut,
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

/// Normal stiffness of a joint of the deck `[Pa/m]`, 0 for others.
pub(super) fn normal_stiffness(deck: &Deck, joint: u16) -> f64 {
    let properties = deck.joints.values().nth(joint.into());
    let stiffness = properties.and_then(|joint| joint.stiffness(&deck.materials));
    stiffness.map_or(0.0, |[normal, _]| normal)
}
