//! Pairs of points of a patch, from the positions of two blocks.
//!
//! The axis of largest separation determines the reference face. Each element face of the finer
//! side is clipped by the outline of the other face. The corners of the resulting polygons become
//! pairs. So every area counts once, and corners, edges and crossed faces need no special case. Two
//! edges that cross at an angle to all faces form one pair.

use nalgebra::{Vector2, Vector3};

use super::clipped::{ClippedOverlap, Polygons};
use super::history_transfer::{OldPatch, PatchHistory, PointHistory};
use super::matched::MatchedFaces;
use super::side::{ContactSide, are_disjoint, edge_node, edge_point};
use super::surfaces::sides_of;
use super::{
    CONTACT_DISTANCE, CombinedSurface, Configuration, ContactBlock, ContactPoint, ContactSurfaces,
    Patch,
};
use crate::point::PairContext;
use ddem_mechanics::collide::{self, ContactFeature, EdgeId, FaceId, Parallelepiped, Separation};
use ddem_mechanics::law::{Equilibrium, PointState, Traction};
use ddem_mesh::{NonconformingJoint, SurfacePoint, Vec3};

/// Least limit of a patch, as a fraction of the contact distance.
const SHORTEST: f64 = 0.01;

/// Context in which patches are built.
#[derive(Clone, Copy)]
pub(super) struct PatchBuilder<'a> {
    pub(super) configuration: Configuration<'a>,
    pub(super) surfaces: &'a ContactSurfaces,
    pub(super) context: PairContext<'a>,
    /// Blocks that have supports.
    pub(super) held: &'a [[bool; ddem_mechanics::math::lanes::LANES]],
}

impl PatchBuilder<'_> {
    /// Distance at which two blocks get a patch `[m]`.
    pub(super) fn contact_distance(&self, [a, b]: [u32; 2]) -> f64 {
        let spacing = |block: u32| self.configuration.blocks[block as usize].spacing;
        CONTACT_DISTANCE * spacing(a).min(spacing(b))
    }

    fn cell(&self, block: u32) -> Parallelepiped {
        self.configuration.blocks[block as usize].cell(self.configuration.u)
    }

    /// Combined travel of two blocks that cannot bring them within contact distance `[m]`; 0 if
    /// they need a patch. The gap of their boxes changes no faster than the blocks travel. The
    /// height of one block over a face of the other changes at most by `lever` times the travel. So
    /// the patches found do not depend on the time of the check.
    pub(super) fn separation_budget(&self, blocks: [u32; 2]) -> f64 {
        let thickness: f64 = blocks.iter().map(|&block| self.surfaces.thickness(block)).sum();
        let near = self.contact_distance(blocks) + thickness;
        let [a, b] = blocks.map(|block| {
            self.configuration.blocks[block as usize].bounds(self.configuration.u, 0.0)
        });
        let gap = (0..3).map(|d| (a[0][d] - b[1][d]).max(b[0][d] - a[1][d]));
        let gap = gap.fold(f64::NEG_INFINITY, f64::max) - near;
        if gap > 0.0 {
            return gap;
        }
        let cells = blocks.map(|block| self.cell(block));
        let separation = collide::separation(&cells[0], &cells[1]);
        if separation.distance <= near {
            return 0.0;
        }
        // With crossed edges the best face normal has less separation, by the margin.
        let height = match separation.feature {
            ContactFeature::Face { .. } => separation.distance,
            ContactFeature::Edges(_) => separation.distance - separation.margin,
        };
        let height = (height - near).max(0.0) / lever(&cells);
        height.max(f64::MIN_POSITIVE)
    }

    /// Patch of two blocks; `None` if they are far apart. `old` is their updated previous patch.
    pub(super) fn patch(&self, blocks: [u32; 2], old: Option<&OldPatch>) -> Option<Patch> {
        let cells = blocks.map(|block| self.cell(block));
        let separation = collide::separation(&cells[0], &cells[1]);
        let contact_distance = self.contact_distance(blocks);
        let (surfaces, faces) = match separation.feature {
            ContactFeature::Edges(edges) => (
                [0, 1].map(|side| self.surfaces.of_edge(blocks[side], edges[side])),
                edges.map(|edge| sides_of(edge)[0]),
            ),
            ContactFeature::Face { of, face, other } => {
                let faces = if of == 0 { [face, other] } else { [other, face] };
                ([0, 1].map(|side| *self.surfaces.of(blocks[side], faces[side])), faces)
            }
        };
        let held = blocks.map(|block| {
            let ContactBlock { pack, lane, .. } = self.configuration.blocks[block as usize];
            self.held.get(pack).is_some_and(|lanes| lanes[lane])
        });
        let surface = self.surfaces.combined([&surfaces[0], &surfaces[1]], held);
        if separation.distance > surface.thickness + 2.0 * contact_distance {
            return None;
        }
        let mut patch = self.empty(blocks, &cells, &separation, surface, contact_distance);
        patch.faces = faces.map(FaceId::number);
        let axes = patch.frame();
        let frame = [0, 1, 2].map(|k| Vec3::from(axes.column(k)));
        match separation.feature {
            ContactFeature::Face { .. } => self.face(&mut patch, &frame, None),
            ContactFeature::Edges(edges) => self.edges(&mut patch, edges),
        }
        self.transfer_history(&mut patch, &frame, old);
        Some(patch)
    }

    /// Patch of the two faces of a nonconforming joint; its points have no history. `visit`
    /// receives the corners of the overlap polygons and the points inside them.
    pub(super) fn by_face(&self, joint_pair: &NonconformingJoint, visit: Polygons<'_>) -> Patch {
        let NonconformingJoint { blocks, faces, .. } = *joint_pair;
        let cells = blocks.map(|block| self.cell(block));
        // The finer side determines the normal, that of parts of cells the first face.
        let of = usize::from(
            self.configuration.blocks[blocks[1] as usize].element_area(faces[1])
                < self.configuration.blocks[blocks[0] as usize].element_area(faces[0]),
        );
        let face = faces[of];
        let half = &cells[of].half;
        let (d, e, f) = (face.direction, (face.direction + 1) % 3, (face.direction + 2) % 3);
        let cross = half[e].cross(&half[f]);
        let out = if face.upper { half[d] } else { -half[d] };
        let sign = if (cross.dot(&out) > 0.0) == (of == 0) { 1.0 } else { -1.0 };
        let own = self.configuration.blocks[blocks[0] as usize].part_normal(faces[0]);
        let normal = own.unwrap_or_else(|| cross.try_normalize(0.0).unwrap_or_default() * sign);
        let mut patch = self.empty_joint(joint_pair, &cells, of, normal);
        let axes = patch.frame();
        let frame = [0, 1, 2].map(|k| Vec3::from(axes.column(k)));
        self.face(&mut patch, &frame, Some(visit));
        patch
    }

    /// Patch of a nonconforming joint whose faces match node by node.
    pub(super) fn by_nodes(
        &self,
        joint_pair: &NonconformingJoint,
        matched: &MatchedFaces,
    ) -> Patch {
        let cells = joint_pair.blocks.map(|block| self.cell(block));
        let mut patch = self.empty_joint(joint_pair, &cells, 0, matched.normal);
        patch.points = matched.points.clone().into();
        patch
    }

    /// Patch of a nonconforming joint without points; the face of block `of` determines the axes.
    fn empty_joint(
        &self,
        joint_pair: &NonconformingJoint,
        cells: &[Parallelepiped; 2],
        of: usize,
        normal: Vec3,
    ) -> Patch {
        let NonconformingJoint { blocks, faces, .. } = *joint_pair;
        let feature = ContactFeature::Face { of, face: faces[of], other: faces[1 - of] };
        let separation = Separation { distance: 0.0, margin: f64::INFINITY, normal, feature };
        let contact_distance = self.contact_distance(blocks);
        let mut patch =
            self.empty(blocks, cells, &separation, CombinedSurface::default(), contact_distance);
        patch.faces = faces.map(FaceId::number);
        patch
    }

    fn empty(
        &self,
        blocks: [u32; 2],
        cells: &[Parallelepiped; 2],
        separation: &Separation,
        surface: CombinedSurface,
        contact_distance: f64,
    ) -> Patch {
        let reference = match separation.feature {
            ContactFeature::Face { of, .. } => of,
            ContactFeature::Edges(_) => 0,
        };
        let mut patch = Patch { blocks, reference: reference as u8, surface, ..Patch::default() };
        let [own, other] = patch.order().map(|block| self.configuration.rotation(block));
        let normal = separation.normal;
        // The tangent runs along an edge of the reference block.
        let half = &cells[reference].half;
        let along = (0..3).map(|d| half[d] - normal * normal.dot(&half[d]));
        let along = along.max_by(|x, y| x.norm_squared().total_cmp(&y.norm_squared()));
        let along = along.and_then(|x| x.try_normalize(0.0)).unwrap_or_default();
        patch.axes = [own.tr_mul(&normal), own.tr_mul(&along)];
        patch.axes_now = [normal, along];
        patch.axes_in_other = patch.axes_now.map(|axis| other.tr_mul(&axis).map(|x| x as f32));
        patch.relative_position = own.tr_mul(&self.relative_position(blocks));
        // If another axis is almost as good, the patch is checked again soon.
        patch.limit =
            contact_distance.min(0.5 * separation.margin).max(SHORTEST * contact_distance) as f32;
        patch
    }

    fn relative_position(&self, [a, b]: [u32; 2]) -> Vec3 {
        self.configuration.centre(b as usize) - self.configuration.centre(a as usize)
    }

    /// True if two blocks have moved so far against each other that their points must be remade.
    pub(super) fn has_moved(&self, patch: &Patch) -> bool {
        let [own, other] = patch.order().map(|block| self.configuration.rotation(block));
        let relative_position = own.tr_mul(&self.relative_position(patch.blocks));
        let axis_change =
            |k: usize| (other * patch.axes_in_other[k].map(f64::from) - own * patch.axes[k]).norm();
        let [a, b] = patch.blocks.map(|block| self.configuration.blocks[block as usize].size);
        let motion = (relative_position - patch.relative_position).norm()
            + a.min(b) * (axis_change(0) + axis_change(1));
        motion > f64::from(patch.limit) || !motion.is_finite()
    }

    /// Adds the pairs of points of two faces, over the outline of the coarser one. With `visit`
    /// they are made over each of its elements, so that the shape functions of both sides are
    /// integrated exactly. `visit` receives the corners of the polygons and the points inside them.
    fn face(&self, patch: &mut Patch, frame: &[Vec3; 3], mut visit: Option<Polygons<'_>>) {
        let faces = patch.faces();
        let sides = [0, 1].map(|side| {
            ContactSide::new(&self.configuration, patch.blocks[side] as usize, faces[side], frame)
        });
        let fine = usize::from(sides[1].element < sides[0].element);
        let (fine_side, coarse) = (&sides[fine], &sides[1 - fine]);
        let (n, m) = (
            fine_side.contact_block.topology.divisions(),
            coarse.contact_block.topology.divisions(),
        );
        let at_node = vec![usize::MAX; (n + 1) * (n + 1)];
        let mut overlap =
            ClippedOverlap { sides: [fine_side, coarse], fine, at_node, points: Vec::new() };
        for (k, i) in (0..n).flat_map(|k| (0..n).map(move |i| (k, i))) {
            let quad = fine_side.quad([i, k]);
            if are_disjoint(&quad, &coarse.outline) {
                continue;
            }
            let Some(visit) = &mut visit else {
                overlap.add([i, k], &quad, &coarse.outline);
                continue;
            };
            for element in (0..m).flat_map(|l| (0..m).map(move |j| [j, l])) {
                let outline = coarse.quad(element);
                if are_disjoint(&quad, &outline) {
                    continue;
                }
                let (corners, inside) = overlap.add_inside([i, k], &quad, &outline);
                visit(&corners, &inside);
            }
        }
        patch.points = overlap.points.into();
    }

    /// Makes the pair of points at the crossing of two edges.
    fn edges(&self, patch: &mut Patch, edges: [EdgeId; 2]) {
        let ends = [0, 1].map(|side| {
            let contact_block = &self.configuration.blocks[patch.blocks[side] as usize];
            [0, contact_block.topology.divisions()].map(|i| {
                contact_block.node(self.configuration.u, edge_node(contact_block, edges[side], i))
            })
        });
        let along = collide::nearest(ends[0], ends[1]);
        let (mut points, mut least) = ([SurfacePoint::default(); 2], f64::INFINITY);
        for side in 0..2 {
            let contact_block = &self.configuration.blocks[patch.blocks[side] as usize];
            points[side] = edge_point(contact_block, edges[side], along[side]);
            let area = sides_of(edges[side]).map(|face| contact_block.element_area(face));
            least = least.min(0.25 * 0.5 * (area[0] + area[1]));
        }
        patch.points = [ContactPoint::new(points, least)].into();
    }

    /// Initialises the points and passes on the history of old points nearby.
    fn transfer_history(&self, patch: &mut Patch, frame: &[Vec3; 3], old: Option<&OldPatch>) {
        let known = old.map(|old| PatchHistory::new(&self.configuration, &old.patch));
        let last = if old.is_some() { 0.0 } else { 1.0 };
        // Areas change little. With a ratio of 1, friction would drop with every new patch.
        let stretch = old.map_or(1.0, |old| old.patch.surface.friction.stretch());
        patch.surface.friction.set_stretch(stretch);
        let CombinedSurface { thickness, stiffness, .. } = patch.surface;
        let (blocks, faces) = (patch.blocks, patch.faces());
        for ContactPoint { points, pair, slip_path } in &mut patch.points {
            let own = |v: Vec3| [0, 1, 2].map(|k| frame[k].dot(&v));
            let x = self.configuration.position(blocks[0] as usize, faces[0], &points[0]);
            let [gap, sx, sy] = own(self.configuration.relative_position(blocks, faces, points));
            let [opening_increment, wx, wy] =
                own(self.configuration.relative_displacement_increment(blocks, faces, points));
            // A new contact begins with the gap of one step ago, before the last increment.
            let before = gap - thickness - opening_increment * last;
            let transferred = known.as_ref().and_then(|old| old.nearest(x)).unwrap_or_else(|| {
                // Blocks that overlap when they meet get an offset and are not pushed apart.
                PointHistory { offset: before.min(0.0), ..PointHistory::default() }
            });
            let PointHistory { offset, added_tractions, .. } = transferred;
            let gap = before - offset;
            let normal = (stiffness.normal * gap).min(0.0);
            let limit = patch.surface.friction.strength(self.context.laws, normal);
            let [_, s, t] = own(transferred.shear);
            let mut shear = Vector2::new(s, t);
            let sticks = Vector2::new(sx - wx * last, sy - wy * last);
            let equilibrium = transferred.equilibrium.map(|(equilibrium, since)| {
                let [_, s, t] = own(since);
                let slip = sticks - shear / stiffness.shear - Vector2::new(s, t);
                Equilibrium { slip, ..equilibrium }
            });
            let size = shear.norm();
            if size > limit {
                shear *= limit / size;
            }
            let slip = sticks - shear / stiffness.shear;
            pair.origin.x = thickness;
            pair.state = PointState {
                slip,
                dilation: offset,
                applied_dilation: offset,
                damage: 1.0,
                gap,
                traction: Traction { normal, shear },
                added_tractions,
                energy_excess: 0.0,
                equilibrium,
            };
            *slip_path = transferred.slip_path;
        }
        if let Some(old) = old {
            patch.transfer_energy(&self.configuration, old);
            patch.renewed = true;
        }
    }
}

/// Upper bound of the displacement of a corner of one cell normal to a face of the other, per unit
/// of their combined travel.
fn lever(cells: &[Parallelepiped; 2]) -> f64 {
    let size = |cell: &Parallelepiped| cell.half.iter().map(Vector3::norm).sum::<f64>();
    let reach = (cells[1].centre - cells[0].centre).norm() + size(&cells[0]).max(size(&cells[1]));
    // Half the least width of a face: a tilt moves a point at this distance from the middle by as
    // much as the face travels.
    let width = |cell: &Parallelepiped| {
        let of = |d: usize| {
            let (x, y) = (cell.half[(d + 1) % 3], cell.half[(d + 2) % 3]);
            x.cross(&y).norm() / x.norm().max(y.norm())
        };
        of(0).min(of(1)).min(of(2))
    };
    1.0 + 1.5 * reach / width(&cells[0]).min(width(&cells[1]))
}
