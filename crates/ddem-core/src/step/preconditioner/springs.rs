//! Stiffness of the springs around a body: its joints and contacts.

use nalgebra::{Matrix3, Matrix3x6, Matrix6};

use super::MassContext;
use super::contact_masses::of_contacts;
use super::rigid::part_properties;
use crate::model::Model;
use ddem_joint::contact::{ContactBlock, ContactSurfaces, Patch};
use ddem_mechanics::collide::FaceId;
use ddem_mechanics::law::SpringStiffness;
use ddem_mesh::{BodyPart, CellBodies, Vec3};

/// Nonconforming joint of a cell.
#[derive(Clone, Copy, Debug)]
pub(super) struct BodyPatch {
    /// Number of the joint.
    pub(super) joint: u32,
    /// Side of the cell in it.
    pub(super) side: u8,
    /// Cell on the other side, if it is one of the same cells.
    pub(super) other: Option<u32>,
    /// True if both sides are cells. The search for the largest eigenvalue has these joints.
    joins_cells: bool,
}

/// Stiffness of the springs around a body.
#[derive(Clone, Debug, Default)]
pub(super) struct SpringSum {
    /// Stiffness against the six motions of the body with its neighbours at rest. Rotations are
    /// multiplied by its size.
    pub(super) stiffness: Matrix6<f64>,
    /// Stiffness against a uniform strain `(xx, yy, zz, xy, xz, yz)` in which the body and its
    /// neighbours move as rigid bodies, the part of this body `[N m]`.
    pub(super) moduli: Matrix6<f64>,
    /// Stiffness of the elements at held nodes against the six motions.
    pub(super) held: Matrix6<f64>,
}

impl SpringSum {
    /// Springs of a rigid block of a set.
    pub(super) fn of_block(around: MassContext<'_>, part: &BodyPart) -> Self {
        let model = around.model;
        let block = part.block;
        let size = part_properties(model, part).size();
        let half = model.geometry.element_edges(block).map(|edge| edge * 0.5);
        let mut sum = Self::default();
        for face in FaceId::all() {
            let (d, side) = (face.direction, face.side());
            let Some(other) = model.geometry.beyond(block, face) else { continue };
            let owner = if face.upper { block } else { other };
            let (pack, lane) = model.packs.slot(owner);
            let Some(section) = model.sections.get(pack, d) else { continue };
            let k = section.matrix(lane);
            for (e, f) in [(-0.5, -0.5), (0.5, -0.5), (-0.5, 0.5), (0.5, 0.5)] {
                let arm = half[d] * f64::from(side) + half[(d + 1) % 3] * e + half[(d + 2) % 3] * f;
                sum.add(&k, &arm, size);
            }
        }
        if let Some(contact_model) = around.contact_model {
            let released = around.contact_masses.released;
            sum.add_contacts(&contact_model.surfaces, released, block, &half, size);
        }
        sum
    }

    /// Adds contacts at the corners of faces. Contacts in place of joints resist rotation more than
    /// the joints did, whose points are at the quarters.
    fn add_contacts(
        &mut self,
        surfaces: &ContactSurfaces,
        released: bool,
        block: usize,
        half: &[Vec3; 3],
        size: f64,
    ) {
        for face in FaceId::all() {
            let d = face.direction;
            let (e, f) = (half[(d + 1) % 3], half[(d + 2) % 3]);
            let area = e.cross(&f);
            let normal = area.try_normalize(0.0).unwrap_or_default();
            let [stiff, shear] = of_contacts(surfaces, block, face, released);
            let k = SpringStiffness { normal: stiff, shear }.matrix(&normal) * area.norm();
            let side = half[d] * if face.upper { 1.0 } else { -1.0 };
            for (i, j) in [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)] {
                self.add(&k, &(side + e * i + f * j), size);
            }
        }
    }

    /// Springs of a rigid cell: the points of its joints, and contacts at its nodes.
    pub(super) fn of_cell(
        around: MassContext<'_>,
        parts: &[BodyPart],
        patches: &[BodyPatch],
    ) -> Self {
        let MassContext { model, bonds, .. } = around;
        let first = part_properties(model, &parts[0]);
        let size = first.size();
        let centre = centre(model, parts);
        let mut sum = Self::default();
        let blocks = model.contact.as_ref().map_or(&[][..], |contact| &contact.blocks);
        for &patch in patches {
            sum.add_patch(model, patch, blocks, &centre, size);
        }
        for part in parts {
            let first = model.geometry.blocks[part.block].first_node as usize;
            let properties = part_properties(model, part);
            for corner in 0..8 {
                let k = bonds.get(first + corner).copied().unwrap_or_default();
                if k > 0.0 {
                    sum.add(&(Matrix3::identity() * k), &properties.arm(corner), size);
                }
            }
        }
        sum
    }

    /// Adds the points of a joint. Joints to others than cells count twice, for the motion of the other
    /// side, because the largest eigenvalue is found without them.
    pub(super) fn add_patch(
        &mut self,
        model: &Model,
        BodyPatch { joint, side, joins_cells, .. }: BodyPatch,
        blocks: &[ContactBlock],
        centre: &Vec3,
        size: f64,
    ) {
        let patch = &model.bonded_patches[joint as usize].patch;
        let side = usize::from(side);
        let per_area = per_area(patch) * if joins_cells { 1.0 } else { 2.0 };
        for point in &patch.points {
            let on = &point.points[side];
            let (at, _) = blocks[on.block(patch.blocks[side])].rest_point(on);
            self.add(&(per_area * point.pair.area), &(at - centre), size);
        }
    }

    /// Adds a spring with the stiffness `k` at the end of an arm from the centre.
    pub(super) fn add(&mut self, k: &Matrix3<f64>, arm: &Vec3, size: f64) {
        let moved = point_motion(arm, size);
        self.stiffness += moved.transpose() * k * moved;
        // A neighbour is twice as far as the spring. Each of the two has half of the energy.
        let [x, y, z] = (*arm).into();
        #[rustfmt::skip]
        let strained = Matrix3x6::new(
            x, 0.0, 0.0, y, z, 0.0,
            0.0, y, 0.0, x, 0.0, z,
            0.0, 0.0, z, 0.0, x, y,
        );
        self.moduli += strained.transpose() * k * strained * 2.0;
    }

    /// Adds a held node with the stiffnesses `k` along the axes at the end of an arm.
    pub(super) fn hold(&mut self, k: Vec3, arm: &Vec3, size: f64) {
        let moved = point_motion(arm, size);
        let own = moved.transpose() * Matrix3::from_diagonal(&k) * moved;
        self.stiffness += own;
        self.held += own;
    }
}

/// Displacement of the point at the end of an arm by the six motions of a body, whose rotations are
/// multiplied by `size`.
pub(super) fn point_motion(arm: &Vec3, size: f64) -> Matrix3x6<f64> {
    let mut moved = Matrix3x6::zeros();
    moved.fixed_view_mut::<3, 3>(0, 0).copy_from(&Matrix3::identity());
    moved.fixed_view_mut::<3, 3>(0, 3).copy_from(&(arm.cross_matrix() / -size));
    moved
}

/// Centre of mass of a body at rest `[m]`.
pub(super) fn centre(model: &Model, parts: &[BodyPart]) -> Vec3 {
    model.geometry.corners(parts[0].block)[0] - part_properties(model, &parts[0]).arm(0)
}

/// Stiffness of a joint per unit of area `[Pa/m]`.
pub(super) fn per_area(patch: &Patch) -> Matrix3<f64> {
    patch.surface.stiffness.matrix(&patch.axes[0])
}

/// Nonconforming joints of each of some cells.
pub(super) fn patches_of(model: &Model, cells: &CellBodies) -> Vec<Vec<BodyPatch>> {
    let mut patches = vec![Vec::new(); cells.len()];
    if cells.is_empty() {
        return patches;
    }
    for (number, joint) in model.bonded_patches.iter().enumerate() {
        let blocks = joint.patch.blocks.map(|block| block as usize);
        if blocks.iter().any(|&block| model.geometry.is_removed(block)) {
            continue;
        }
        let joins_cells = joins_cells(model, blocks);
        let both = blocks.map(|block| {
            let (pack, lane) = model.packs.slot(block);
            cells.body(pack, lane).map(|cell| cell as u32)
        });
        for side in 0..2 {
            if let Some(own) = both[side] {
                patches[own as usize].push(BodyPatch {
                    joint: number as u32,
                    side: side as u8,
                    other: both[1 - side],
                    joins_cells,
                });
            }
        }
    }
    patches
}

/// True if both blocks of a joint are parts of cells.
pub(super) fn joins_cells(model: &Model, blocks: [usize; 2]) -> bool {
    blocks.iter().all(|&block| model.geometry.part(block).is_some())
}
