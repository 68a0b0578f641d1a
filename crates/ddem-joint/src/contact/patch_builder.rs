//! Pairs of points of a patch, from the positions of two blocks.
//!
//! The axis of largest separation determines the reference face. Each element face of the finer
//! side is clipped by the outline of the other face. The corners of the resulting polygons become
//! pairs. So every area counts once, and corners, edges and crossed faces need no special case. Two
//! edges that cross at an angle to all faces form one pair.

use fearless_simd::Level;
use nalgebra::Vector2;

use super::cells::{BodyEdge, BodyQuad, Features, quads_of_block};
use super::clipped::{OverlapPoints, Polygons, overlap};
use super::history_transfer::{OldPatch, PatchHistory, PointHistory};
use super::matched::MatchedFaces;
use super::meeting::Meeting;
use super::side::{ContactSide, edge_node, edge_point};
use super::surfaces::{ContactSurface, sides_of};
use super::{
    CONTACT_DISTANCE, CombinedSurface, Configuration, ContactBlock, ContactPoint, ContactSurfaces,
    Patch,
};
use crate::point::PairContext;
use ddem_mechanics::collide::{self, Parallelepiped};
use ddem_mechanics::law::{Equilibrium, PointState, Traction};
use ddem_mesh::{NonconformingJoint, SurfacePoint, Vec3};

/// Least limit of a patch, as a fraction of the contact distance.
const SHORTEST: f64 = 0.01;

/// Patch with the coordinates of its points in the elements of both sides.
pub(super) type FixedPatch = (Patch, Vec<[[f64; 2]; 2]>);

/// Context in which patches are built.
#[derive(Clone, Copy)]
pub(super) struct PatchBuilder<'a> {
    pub(super) configuration: Configuration<'a>,
    pub(super) surfaces: &'a ContactSurfaces,
    pub(super) context: PairContext<'a>,
    /// Instruction set.
    pub(super) level: Level,
    /// Blocks that have supports.
    pub(super) held: &'a [[bool; ddem_mechanics::math::lanes::LANES]],
}

impl PatchBuilder<'_> {
    /// Distance at which two blocks get a patch `[m]`.
    pub(super) fn contact_distance(&self, [a, b]: [u32; 2]) -> f64 {
        let spacing = |block: u32| self.configuration.blocks[block as usize].spacing;
        CONTACT_DISTANCE * spacing(a).min(spacing(b))
    }

    /// Present parallelepiped of a block, or of the first block of a cell.
    pub(super) fn parallelepiped(&self, block: u32) -> Parallelepiped {
        self.configuration.blocks[block as usize].cell(self.configuration.u)
    }

    /// Patch of two bodies; `None` if they are far apart. `old` is their updated previous patch.
    pub(super) fn patch(&self, bodies: [u32; 2], old: Option<&OldPatch>) -> Option<Patch> {
        let meeting = self.meeting(bodies);
        let contact_distance = self.contact_distance(bodies);
        let held = bodies.map(|body| self.is_held(body));
        let surfaces = self.surfaces_of(bodies, &meeting.features);
        let surface = self.surfaces.combined([&surfaces[0], &surfaces[1]], held);
        if meeting.distance > surface.thickness + 2.0 * contact_distance {
            return None;
        }
        let mut patch = self.empty(bodies, &meeting, surface, contact_distance);
        let axes = patch.frame();
        let frame = [0, 1, 2].map(|k| Vec3::from(axes.column(k)));
        match meeting.features {
            Features::Faces { quads, .. } => drop(self.face(&mut patch, &frame, quads, None)),
            Features::Edges(edges) => self.edges(&mut patch, edges),
        }
        patch.fix(self.configuration.blocks);
        self.transfer_history(&mut patch, &frame, old);
        Some(patch)
    }

    /// True if a block of a body has supports.
    fn is_held(&self, body: u32) -> bool {
        self.configuration.blocks_of(body).any(|block| {
            let ContactBlock { pack, lane, .. } = self.configuration.blocks[block];
            self.held.get(pack).is_some_and(|lanes| lanes[lane])
        })
    }

    /// Surfaces of two features.
    fn surfaces_of(&self, bodies: [u32; 2], features: &Features<'_>) -> [ContactSurface; 2] {
        [0, 1].map(|side| match features {
            Features::Faces { quads, .. } => {
                let BodyQuad { part, face } = quads[side][0];
                *self.surfaces.of(bodies[side] + u32::from(part), face)
            }
            Features::Edges(edges) => {
                let (part, edge) = edges[side].halves[0];
                self.surfaces.of_edge(bodies[side] + u32::from(part), edge)
            }
        })
    }

    /// Patch of the two faces of a nonconforming joint; its points have no history. `visit`
    /// receives the corners of the overlap polygons and the points inside them.
    pub(super) fn by_face(
        &self,
        joint_pair: &NonconformingJoint,
        visit: Polygons<'_>,
    ) -> FixedPatch {
        let NonconformingJoint { blocks, faces, .. } = *joint_pair;
        // The finer side determines the normal, that of parts of cells the first face.
        let of = usize::from(
            self.configuration.blocks[blocks[1] as usize].element_area(faces[1])
                < self.configuration.blocks[blocks[0] as usize].element_area(faces[0]),
        );
        let face = faces[of];
        let half = self.parallelepiped(blocks[of]).half;
        let (d, e, f) = (face.direction, (face.direction + 1) % 3, (face.direction + 2) % 3);
        let cross = half[e].cross(&half[f]);
        let out = if face.upper { half[d] } else { -half[d] };
        let sign = if (cross.dot(&out) > 0.0) == (of == 0) { 1.0 } else { -1.0 };
        let own = self.configuration.blocks[blocks[0] as usize].part_normal(faces[0]);
        let normal = own.unwrap_or_else(|| cross.try_normalize(0.0).unwrap_or_default() * sign);
        let mut patch = self.empty_joint(joint_pair, of, normal);
        let axes = patch.frame();
        let frame = [0, 1, 2].map(|k| Vec3::from(axes.column(k)));
        let on = self.face(&mut patch, &frame, faces.map(quads_of_block), Some(visit));
        (patch, on)
    }

    /// Patch of a nonconforming joint whose faces match node by node.
    pub(super) fn by_nodes(
        &self,
        joint_pair: &NonconformingJoint,
        matched: &MatchedFaces,
    ) -> FixedPatch {
        let mut patch = self.empty_joint(joint_pair, 0, matched.normal);
        patch.points = matched.points.clone().into();
        let on = |point: &ContactPoint| point.points.map(|on_side| on_side.on.map(f64::from));
        let on = patch.points.iter().map(on).collect();
        (patch, on)
    }

    /// Patch of a nonconforming joint without points; the face of block `of` determines the axes.
    fn empty_joint(&self, joint_pair: &NonconformingJoint, of: usize, normal: Vec3) -> Patch {
        let NonconformingJoint { blocks, faces, .. } = *joint_pair;
        let features = Features::Faces { of, quads: faces.map(quads_of_block) };
        let meeting = Meeting { distance: 0.0, margin: f64::INFINITY, normal, features };
        let contact_distance = self.contact_distance(blocks);
        self.empty(blocks, &meeting, CombinedSurface::default(), contact_distance)
    }

    fn empty(
        &self,
        blocks: [u32; 2],
        meeting: &Meeting<'_>,
        surface: CombinedSurface,
        contact_distance: f64,
    ) -> Patch {
        let reference = match meeting.features {
            Features::Faces { of, .. } => of,
            Features::Edges(_) => 0,
        };
        let mut patch = Patch { blocks, reference: reference as u8, surface, ..Patch::default() };
        let [own, other] = patch.order().map(|block| self.configuration.rotation(block));
        let normal = meeting.normal;
        // The tangent runs along an edge of the reference block.
        let half = self.parallelepiped(blocks[reference]).half;
        let along = (0..3).map(|d| half[d] - normal * normal.dot(&half[d]));
        let along = along.max_by(|x, y| x.norm_squared().total_cmp(&y.norm_squared()));
        let along = along.and_then(|x| x.try_normalize(0.0)).unwrap_or_default();
        patch.axes = [own.tr_mul(&normal), own.tr_mul(&along)];
        patch.axes_now = [normal, along];
        patch.axes_in_other = patch.axes_now.map(|axis| other.tr_mul(&axis).map(|x| x as f32));
        patch.relative_position = own.tr_mul(&self.relative_position(blocks));
        // If another axis is almost as good, the patch is checked again soon.
        patch.limit =
            contact_distance.min(0.5 * meeting.margin).max(SHORTEST * contact_distance) as f32;
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

    /// Adds the pairs of points of two faces. Over each quadrilateral of the coarser one they follow
    /// its outline; with `visit` they are made over each of its elements, so that the shape functions
    /// of both sides are integrated exactly. `visit` receives the corners of the polygons and the
    /// points inside them. Returns the coordinates of the points in the elements of both sides.
    fn face(
        &self,
        patch: &mut Patch,
        frame: &[Vec3; 3],
        quads: [&[BodyQuad]; 2],
        mut visit: Option<Polygons<'_>>,
    ) -> Vec<[[f64; 2]; 2]> {
        let [own, other] = [0, 1].map(|side| -> Vec<ContactSide<'_>> {
            let of = |quad| ContactSide::new(&self.configuration, patch.blocks[side], quad, frame);
            quads[side].iter().map(of).collect()
        });
        let mut all = OverlapPoints::default();
        for (a, b) in own.iter().flat_map(|a| other.iter().map(move |b| (a, b))) {
            let fine = usize::from(b.element < a.element);
            let sides = if fine == 0 { [a, b] } else { [b, a] };
            let OverlapPoints { mut points, mut on } = overlap(sides, fine, &mut visit);
            all.points.append(&mut points);
            all.on.append(&mut on);
        }
        patch.points = all.points.into();
        all.on
    }

    /// Makes the pair of points at the crossing of two edges.
    fn edges(&self, patch: &mut Patch, edges: [BodyEdge; 2]) {
        let ends = [0, 1].map(|side| self.ends(patch.blocks[side], &edges[side]));
        let along = collide::nearest(ends[0], ends[1]);
        let (mut points, mut least) = ([SurfacePoint::default(); 2], f64::INFINITY);
        for side in 0..2 {
            let BodyEdge { halves, is_halved } = edges[side];
            // A half runs from its end to the middle.
            let (part, edge, fraction) = match along[side] {
                at if !is_halved => (halves[0].0, halves[0].1, at),
                at if at < 0.5 => (halves[0].0, halves[0].1, 2.0 * at),
                at => (halves[1].0, halves[1].1, 2.0 * (1.0 - at)),
            };
            let block = patch.blocks[side] as usize + usize::from(part);
            let contact_block = &self.configuration.blocks[block];
            points[side] = SurfacePoint { part, ..edge_point(contact_block, edge, fraction) };
            let area = sides_of(edge).map(|face| contact_block.element_area(face));
            least = least.min(0.25 * 0.5 * (area[0] + area[1]));
        }
        patch.points = [ContactPoint::new(points, least)].into();
    }

    /// Present ends of an edge of a body `[m]`.
    fn ends(&self, body: u32, edge: &BodyEdge) -> [Vec3; 2] {
        let node = |half: usize, i: usize| {
            let (part, edge) = edge.halves[half];
            let contact_block = &self.configuration.blocks[body as usize + usize::from(part)];
            contact_block.node(self.configuration.u, edge_node(contact_block, edge, i))
        };
        let (part, _) = edge.halves[0];
        let n = self.configuration.blocks[body as usize + usize::from(part)].topology.divisions();
        if edge.is_halved { [node(0, 0), node(1, 0)] } else { [node(0, 0), node(0, n)] }
    }

    /// Initialises the points and passes on the history of old points nearby.
    fn transfer_history(&self, patch: &mut Patch, frame: &[Vec3; 3], old: Option<&OldPatch>) {
        let known = old.map(|old| PatchHistory::new(&self.configuration, &old.patch));
        let last = if old.is_some() { 0.0 } else { 1.0 };
        // Areas change little. With a ratio of 1, friction would drop with every new patch.
        let stretch = old.map_or(1.0, |old| old.patch.surface.friction.stretch());
        patch.surface.friction.set_stretch(stretch);
        let CombinedSurface { thickness, stiffness, .. } = patch.surface;
        let blocks = patch.blocks;
        let relative_positions = patch.relative_positions(&self.configuration);
        for (point, relative_position) in patch.points.iter_mut().zip(relative_positions) {
            let ContactPoint { points, pair, slip_path } = point;
            let own = |v: Vec3| [0, 1, 2].map(|k| frame[k].dot(&v));
            let x = self.configuration.position(blocks[0], &points[0]);
            let [gap, sx, sy] = own(relative_position);
            let [opening_increment, wx, wy] =
                own(self.configuration.relative_displacement_increment(blocks, points));
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
