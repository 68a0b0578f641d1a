//! Modes of rigid blocks in the iteration for the critical step.

use nalgebra::{Matrix3, Vector3};

use crate::model::Model;
use ddem_mechanics::math::lanes::{LANES, Lanes};
use ddem_mesh::pack::Pack;

/// Inverse roots `I^{-½}` of the inertias of rigid blocks. Such a block has six values in the first
/// slots of its corners: translation and rotation, scaled by `m^{-½}` and `I^{-½}`. Parts of bodies
/// have zeros: only nonconforming joints act on them, whose stiffness is bounded, not computed.
pub(super) struct RigidModes(Vec<[Matrix3<f64>; LANES]>);

impl RigidModes {
    pub(super) fn new(model: &Model) -> Self {
        let rigid = model.assembly.rigid.iter();
        Self(rigid.map(|pack| std::array::from_fn(|lane| pack[lane].inverse_root())).collect())
    }

    /// Computes the displacements of the corners from the six values.
    pub(super) fn corners(&self, model: &Model, pack: usize, six: &[Lanes], u: &mut [Lanes]) {
        let Pack { rigid_start, filled, .. } = model.packs.packs[pack];
        for lane in 0..filled {
            let mass_properties = &model.assembly.rigid[rigid_start][lane];
            let [shift, turn] = [0, 3].map(|first| three(six, first, lane));
            let (shift, turn) =
                (shift / mass_properties.mass.sqrt(), self.0[rigid_start][lane] * turn);
            for corner in 0..8 {
                let value = shift + turn.cross(&mass_properties.arm(corner));
                (0..3).for_each(|c| u[3 * corner + c].0[lane] = value[c]);
            }
        }
    }

    /// Replaces the forces on the corners by the six values.
    pub(super) fn resultants(&self, model: &Model, pack: usize, f: &mut [Lanes]) {
        let Pack { rigid_start, filled, .. } = model.packs.packs[pack];
        for lane in 0..filled {
            let mass_properties = &model.assembly.rigid[rigid_start][lane];
            let (mut force, mut torque) = (Vector3::zeros(), Vector3::zeros());
            for corner in 0..8 {
                let on = three(f, 3 * corner, lane);
                force += on;
                torque += mass_properties.arm(corner).cross(&on);
            }
            let six = [force / mass_properties.mass.sqrt(), self.0[rigid_start][lane] * torque];
            f.iter_mut().for_each(|f| f.0[lane] = 0.0);
            for c in 0..3 {
                (f[c].0[lane], f[3 + c].0[lane]) = (six[0][c], six[1][c]);
            }
        }
    }
}

fn three(field: &[Lanes], first: usize, lane: usize) -> Vector3<f64> {
    Vector3::from([0, 1, 2].map(|c| field[first + c].0[lane]))
}
