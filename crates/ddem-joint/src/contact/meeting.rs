//! Separation of two bodies, and the features with which they meet.

use nalgebra::Vector3;

use super::cells::{BLOCK, BodyShape, Features};
use super::patch_builder::PatchBuilder;
use ddem_mechanics::collide::{
    ConvexHull, HullFeature, HullSeparation, Parallelepiped, Separation, hull_separation,
    separation,
};
use ddem_mesh::Vec3;

/// Separation of two bodies, and the features in contact.
pub(super) struct Meeting<'a> {
    /// Distance along the normal, negative where they overlap `[m]`.
    pub(super) distance: f64,
    /// Distance minus the largest distance along face normals in other directions `[m]`.
    pub(super) margin: f64,
    /// Unit vector from a to b.
    pub(super) normal: Vec3,
    pub(super) features: Features<'a>,
}

impl<'a> PatchBuilder<'a> {
    /// Combined travel of two bodies that cannot bring them within contact distance `[m]`; 0 if
    /// they need a patch. The gap of their boxes changes no faster than the bodies travel. The
    /// height of one block over a face of the other changes at most by `lever` times the travel. So
    /// the patches found do not depend on the time of the check. Cells are checked by the distance
    /// along the present axis, which changes no faster than they travel.
    pub(super) fn separation_budget(&self, bodies: [u32; 2]) -> f64 {
        let thickness = |&body: &u32| {
            let blocks = self.configuration.blocks_of(body);
            blocks.map(|block| self.surfaces.thickness(block as u32)).fold(0.0, f64::max)
        };
        let near = self.contact_distance(bodies) + bodies.iter().map(thickness).sum::<f64>();
        let [a, b] = bodies.map(|body| self.configuration.bounds(body, 0.0));
        let gap = (0..3).map(|d| (a[0][d] - b[1][d]).max(b[0][d] - a[1][d]));
        let gap = gap.fold(f64::NEG_INFINITY, f64::max) - near;
        if gap > 0.0 {
            return gap;
        }
        let meeting = self.meeting(bodies);
        if meeting.distance <= near {
            return 0.0;
        }
        let height = if bodies.iter().any(|&body| self.configuration.cell_of(body).is_some()) {
            meeting.distance - near
        } else {
            // With crossed edges the best face normal has less separation, by the margin.
            let height = match meeting.features {
                Features::Faces { .. } => meeting.distance,
                Features::Edges(_) => meeting.distance - meeting.margin,
            };
            (height - near).max(0.0) / lever(&bodies.map(|body| self.parallelepiped(body)))
        };
        height.max(f64::MIN_POSITIVE)
    }

    /// Separation of two bodies and the features in contact.
    pub(super) fn meeting(&self, bodies: [u32; 2]) -> Meeting<'a> {
        if bodies.iter().all(|&body| self.configuration.cell_of(body).is_none()) {
            let [a, b] = bodies.map(|body| self.parallelepiped(body));
            let Separation { distance, margin, normal, feature } = separation(&a, &b);
            return Meeting { distance, margin, normal, features: Features::of_blocks(feature) };
        }
        let [(a, points), (b, points_b)] = bodies.map(|body| self.shape(body));
        let HullSeparation { distance, margin, normal, feature } = hull_separation(
            ConvexHull { topology: &a.topology, points: &points },
            ConvexHull { topology: &b.topology, points: &points_b },
        );
        let features = match feature {
            HullFeature::Edges([i, j]) => Features::Edges([a.edges[i], b.edges[j]]),
            HullFeature::Face { of, face, other } => {
                let [i, j] = if of == 0 { [face, other] } else { [other, face] };
                Features::Faces { of, quads: [&a.quads[i], &b.quads[j]] }
            }
        };
        Meeting { distance, margin, normal, features }
    }

    /// Polyhedron of a body and the present positions of its vertices `[m]`.
    fn shape(&self, body: u32) -> (&'a BodyShape, Vec<Vec3>) {
        match self.configuration.cell_of(body) {
            Some(cell) => (&cell.shape, cell.vertices(&self.configuration)),
            None => {
                let contact_block = &self.configuration.blocks[body as usize];
                (&*BLOCK, contact_block.corners(self.configuration.u).to_vec())
            }
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
