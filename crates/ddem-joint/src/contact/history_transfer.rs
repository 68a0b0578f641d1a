//! Transfer of the history of contact points from old points to new ones.

use fearless_simd::dispatch;
use nalgebra::Vector2;

use super::forces::update_contact;
use super::patch_builder::PatchBuilder;
use super::{Configuration, ContactPoint, Patch};
use crate::losses::Losses;
use crate::point::JointPoint;
use ddem_mechanics::law::{Equilibrium, PointState, Traction};
use ddem_mesh::Vec3;

/// Largest factor by which the areas of compressed points may differ from those of the overlap, up
/// or down, to conserve energy.
const SCALE: f64 = 1.25;

/// Patch whose points must be remade.
pub(super) struct OldPatch {
    pub(super) patch: Patch,
    /// Energies of its springs, normal and shear `[J]`.
    spring_energies: [f64; 2],
}

impl OldPatch {
    /// Updates the old points at the present positions. Also returns the losses of this update.
    pub(super) fn new(mut patch: Patch, builder: &PatchBuilder<'_>) -> (Self, Losses) {
        let opening = |pair: &JointPoint| pair.state.gap + pair.state.applied_dilation;
        let mut opening_increments: Vec<f64> = patch.pairs().map(opening).collect();
        let PatchBuilder { configuration, context, level, .. } = builder;
        let losses = dispatch!(*level, simd => {
            update_contact(simd, &mut patch, configuration, *context, &mut [])
        });
        for (increment, pair) in opening_increments.iter_mut().zip(patch.pairs()) {
            *increment = opening(pair) - *increment;
        }
        let spring_energies = patch.spring_energies(&opening_increments);
        (Self { patch, spring_energies }, losses)
    }

    /// Energy in its springs and its reserve `[J]`.
    pub(super) fn conserved_energy(&self) -> f64 {
        self.spring_energies[0] + self.spring_energies[1] + self.patch.reserve()
    }
}

impl Patch {
    /// Energy in the reserve, and energy excess of the points `[J]`.
    pub(super) fn reserve(&self) -> f64 {
        let excess = self.pairs().map(|pair| pair.area * pair.state.energy_excess);
        self.energy_reserve + excess.sum::<f64>()
    }

    /// Opening increments of the points in the last step `[m]`, including the rotation of the
    /// normal.
    fn opening_increments(&self, configuration: &Configuration<'_>) -> Vec<f64> {
        if configuration.start {
            return Vec::new();
        }
        let normal = self.axes_now[0];
        let rotation = configuration.rotation_increment(self.order()[0]);
        let before = normal - rotation.cross(&(normal - rotation.cross(&normal) * 0.5));
        let opening_increment = |(point, relative_position): (&ContactPoint, Vec3)| {
            let du = configuration.relative_displacement_increment(self.blocks, &point.points);
            normal.dot(&relative_position) - before.dot(&(relative_position - du))
        };
        let relative_positions = self.relative_positions(configuration);
        self.points.iter().zip(relative_positions).map(opening_increment).collect()
    }

    /// Energies in the springs, normal and shear `[J]`. The time scheme conserves, as normal
    /// energy, half the present traction times the gap of one step ago.
    pub(super) fn spring_energies(&self, opening_increments: &[f64]) -> [f64; 2] {
        let mut spring_energies = [0.0; 2];
        for (k, JointPoint { area, state, .. }) in self.pairs().enumerate() {
            let PointState { gap, traction: Traction { normal, shear }, .. } = state;
            let before = gap - opening_increments.get(k).copied().unwrap_or(0.0);
            spring_energies[0] += 0.5 * area * normal * before;
            spring_energies[1] += 0.5 * area * shear.norm_squared() / self.surface.stiffness.shear;
        }
        spring_energies
    }

    /// Energy in the springs as the time scheme conserves it, plus the reserve `[J]`.
    pub(super) fn conserved_energy(&self, configuration: &Configuration<'_>) -> f64 {
        let [normal, shear] = self.spring_energies(&self.opening_increments(configuration));
        normal + shear + self.reserve()
    }

    /// Transfers the energy of the old points. Areas change as blocks turn and slide under
    /// pressure, so new points may hold no more normal energy than the old ones did.
    ///
    /// The areas of compressed points compensate by a factor of [`SCALE`], or up to the area of an
    /// element. Excess energy becomes an offset, a part of the gap that springs do not carry. A
    /// deficit goes to the reserve. Shear energy only decreases.
    pub(super) fn transfer_energy(&mut self, configuration: &Configuration<'_>, old: &OldPatch) {
        // Rounding, and faces that have just met, may give negative values.
        let [normal, shear] = old.spring_energies.map(|energy| energy.max(0.0));
        let before = [(normal + old.patch.reserve()).max(0.0), shear];
        let opening_increments = self.opening_increments(configuration);
        let natural = self.spring_energies(&opening_increments)[0];
        let mut scale = 1.0;
        if natural > 0.0 {
            let pressed = |pair: &JointPoint| pair.state.gap < 0.0;
            let area: f64 = self.pairs().filter(|p| pressed(p)).map(|pair| pair.area).sum();
            let most = SCALE.max(self.spacing(configuration).powi(2) / area);
            scale = (before[0] / natural).clamp(1.0 / SCALE, most);
            let pairs = self.points.iter_mut().map(|point| &mut point.pair);
            pairs.filter(|pair| pressed(pair)).for_each(|pair| pair.area *= scale);
        }
        self.surface.friction.set_stretch(scale);
        self.limit_energy(before, &opening_increments);
        // Energy of separated faces is not returned.
        let now = self.spring_energies(&opening_increments)[0];
        self.energy_reserve = if now > 0.0 { (before[0] - now).max(0.0) } else { 0.0 };
    }

    /// Removes the energy that the springs hold in excess of `before`, normal and shear.
    pub(super) fn limit_energy(&mut self, before: [f64; 2], opening_increments: &[f64]) {
        let now = self.spring_energies(opening_increments);
        let shear_factor = if now[1] > before[1] { (before[1] / now[1]).sqrt() } else { 1.0 };
        // With all gaps scaled by p the energy is p² gg − p gw. Here gg is half the traction times
        // the gap, and gw half the traction times the displacement increment.
        let normal_factor = if now[0] > before[0] {
            let square = self.spring_energies(&[])[0];
            let work = square - now[0];
            let root = (work * work + 4.0 * square * before[0]).max(0.0).sqrt();
            ((work + root) / (2.0 * square)).clamp(0.0, 1.0)
        } else {
            1.0
        };
        if normal_factor == 1.0 && shear_factor == 1.0 {
            return;
        }
        let soft = self.surface.stiffness.shear;
        for point in &mut self.points {
            let PointState { gap, dilation, applied_dilation, slip, traction, .. } =
                &mut point.pair.state;
            if *gap < 0.0 {
                let less = (1.0 - normal_factor) * *gap;
                *gap -= less;
                *dilation += less;
                *applied_dilation = *dilation;
                traction.normal *= normal_factor;
            }
            // Friction decreases with the pressure.
            let factor = shear_factor.min(normal_factor);
            *slip += traction.shear * ((1.0 - factor) / soft);
            traction.shear *= factor;
        }
    }
}

/// History of the points of a patch.
pub(super) struct PatchHistory {
    points: Vec<(Vec3, PointHistory)>,
    /// Distance within which a point passes on its history `[m]`.
    near: f64,
}

#[derive(Clone, Copy, Default)]
pub(super) struct PointHistory {
    /// Gap at which the springs carry nothing `[m]`.
    pub(super) offset: f64,
    /// Shear traction in space `[Pa]`.
    pub(super) shear: Vec3,
    pub(super) added_tractions: [f64; 2],
    pub(super) slip_path: f64,
    /// Last equilibrium of a relaxation, and the slip since then in space `[m]`.
    pub(super) equilibrium: Option<(Equilibrium, Vec3)>,
}

impl PatchHistory {
    pub(super) fn new(configuration: &Configuration<'_>, old: &Patch) -> Self {
        let axes = old.frame();
        let a = old.blocks[0];
        let of_point = |&ContactPoint { points, pair, slip_path }: &ContactPoint| {
            let in_space = |v: Vector2<f64>| axes * Vec3::new(0.0, v.x, v.y);
            let x = configuration.position(a, &points[0]);
            let PointState {
                added_tractions, dilation: offset, traction, slip, equilibrium, ..
            } = pair.state;
            let shear = in_space(traction.shear);
            let equilibrium = equilibrium.map(|last| (last, in_space(slip - last.slip)));
            (x, PointHistory { offset, shear, added_tractions, slip_path, equilibrium })
        };
        Self { points: old.points.iter().map(of_point).collect(), near: old.spacing(configuration) }
    }

    /// History of the nearest old point. It is empty if that point is too far away: the new point
    /// has just come within contact distance, without a jump. `None` if there are no old points.
    pub(super) fn nearest(&self, x: Vec3) -> Option<PointHistory> {
        let mut best: (f64, Option<PointHistory>) = (f64::INFINITY, None);
        for (at, transferred) in &self.points {
            let distance = (at - x).norm_squared();
            if distance < best.0 {
                best = (distance, Some(*transferred));
            }
        }
        let empty = PointHistory::default();
        if best.0 > self.near * self.near { Some(empty) } else { best.1 }
    }
}
