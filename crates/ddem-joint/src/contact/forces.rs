//! Forces of the point pairs of patches.

use nalgebra::Vector2;
use rayon::prelude::*;

use super::fixed::PointForces;
use super::friction::{BareFaces, Friction};
use super::{Configuration, ContactPoint, Contacts, Patch};
use crate::losses::{LossSums, Losses};
use crate::point::PairContext;
use ddem_mechanics::law::springs::PointSprings;
use ddem_mechanics::law::{JointLaw, MohrCoulomb, PointLoss, PointState};
use ddem_mesh::Vec3;

/// Patches per parallel task.
const TOGETHER: usize = 64;

/// Updates the forces of all patches but the joints that hold; returns the losses.
pub(super) fn update(
    configuration: Configuration<'_>,
    context: PairContext<'_>,
    contacts: &mut Contacts,
) -> Losses {
    let runs = contacts.joint_forces.runs(&mut contacts.patches, TOGETHER);
    let acting = runs.into_par_iter().map(|mut run| {
        let (mut lost, mut deepest) = (LossSums::default(), 0.0_f64);
        run.each(|patch, forces| {
            if !patch.holds {
                lost.add(&patch.update(&configuration, context, forces));
            }
            if patch.bond.is_none() {
                deepest = deepest.max(patch.depth());
            }
            if context.relaxing {
                patch.set_equilibrium();
            }
        });
        (lost, deepest)
    });
    let none = || (LossSums::default(), 0.0);
    let (lost, deepest) = acting.reduce(none, |(lost, deepest), (more, other)| {
        (lost.merge(&more), f64::max(deepest, other))
    });
    contacts.deepest = deepest;
    lost.total()
}

impl Patch {
    /// Updates the forces at the present positions, also those of a joint that nodes collect (`forces`).
    /// Returns the losses.
    pub(super) fn update(
        &mut self,
        configuration: &Configuration<'_>,
        context: PairContext<'_>,
        forces: &mut [Vec3],
    ) -> Losses {
        if let Some(bond) = self.bond {
            if self.pairs().all(|pair| pair.failure.is_some()) {
                self.rotate_with_larger(configuration);
            }
            return self.update_with_law(context.law(bond.law), configuration, context, forces);
        }
        match self.surface.friction {
            Friction::Angle(tan) => {
                let law = MohrCoulomb { tan_friction: tan, ..MohrCoulomb::default() };
                let law = MohrCoulomb { tan_residual_friction: tan, ..law };
                self.update_with_law(Some(&law), configuration, context, forces)
            }
            Friction::Laws(strengths) => self.update_with_law(
                Some(&BareFaces { strengths, laws: context.laws }),
                configuration,
                context,
                forces,
            ),
        }
    }

    fn update_with_law<L: JointLaw + ?Sized>(
        &mut self,
        law: Option<&L>,
        configuration: &Configuration<'_>,
        context: PairContext<'_>,
        forces: &mut [Vec3],
    ) -> Losses {
        self.update_axes(configuration);
        let axes = self.frame();
        let mut springs = context.springs(self.surface.stiffness, self.surface.dashpot);
        if std::mem::take(&mut self.renewed) {
            // The new points have inherited the dashpot tractions of the old ones.
            springs.time_step = None;
        }
        let check = self.bond.map(|_| self.check(configuration, context));
        let (blocks, spacing) = (self.blocks, self.spacing(configuration));
        let has_friction = self.surface.friction.has_friction();
        debug_assert_eq!(self.points.len(), self.fixed.len());
        let motions = self.rigid_motions(configuration);
        let (mut forces, mut losses) = (PointForces::new(forces), Losses::default());
        for (number, (point, fixed)) in self.points.iter_mut().zip(&*self.fixed).enumerate() {
            let relative_position = fixed.relative_position(configuration.u, &motions);
            let own = axes.tr_mul(&relative_position);
            let loss = if let Some(check) = check {
                let pair = &mut point.pair;
                let elastic = pair.elastic(self.surface.stiffness, own);
                let fails = law
                    .is_some_and(|law| pair.fail(law, check, elastic, context.time, &mut losses));
                let du = fails.then(|| {
                    pair.begin(elastic, own.x - pair.origin.x);
                    axes.tr_mul(
                        &configuration.relative_displacement_increment(blocks, &point.points),
                    )
                });
                pair.update(law.filter(|_| pair.failure.is_some()), &springs, own, du)
            } else {
                point.update_contact(law, &springs, own, has_friction, spacing)
            };
            losses.add_point(point.pair.area, loss);
            let force = Self::force_along(&axes, point);
            forces.add(number, fixed, &motions, &relative_position, force);
        }
        self.set_forces(forces);
        losses
    }
}

impl ContactPoint {
    /// Updates the tractions of a contact point for the vector `relative_position` between its
    /// sides `[m]`. Returns the loss `[J/m²]`.
    #[inline(always)]
    fn update_contact<L: JointLaw + ?Sized>(
        &mut self,
        law: Option<&L>,
        springs: &PointSprings,
        relative_position: Vec3,
        has_friction: bool,
        spacing: f64,
    ) -> PointLoss {
        let PointState { slip: slip_before, gap: gap_before, .. } = self.pair.state;
        let mut loss = self.pair.update(law, springs, relative_position, None);
        let state = &mut self.pair.state;
        let slipped = (state.slip - slip_before).norm();
        // In relaxation slip is measured from the last equilibrium.
        let from = state.equilibrium.map_or(slip_before, |equilibrium| equilibrium.slip);
        let slip_path =
            |gap: f64, slip: Vector2<f64>| if gap < 0.0 { (slip - from).norm() } else { 0.0 };
        self.slip_path += slip_path(state.gap, state.slip) - slip_path(gap_before, slip_before);
        // Slip over half an element removes the whole offset.
        let fraction = (slipped / (0.5 * spacing)).min(1.0);
        let gap = relative_position.x - self.pair.origin.x;
        self.relax_offset(springs.stiffness[0], gap, fraction, loss.friction);
        if !has_friction {
            // Without friction the work of a vanishing offset is a numerical loss.
            loss.contact += std::mem::take(&mut loss.friction);
        }
        loss
    }

    /// Reduces the offset, the gap at which the springs carry nothing, towards zero. It follows the
    /// gap while the faces separate. While they slide it shrinks with the slip, as far as the
    /// friction loss covers it.
    fn relax_offset(&mut self, stiffness: f64, gap: f64, fraction: f64, friction: f64) {
        let PointState { dilation: offset, gap: pressed, traction, .. } = &mut self.pair.state;
        if *offset == 0.0 {
            return;
        }
        if *pressed > 0.0 {
            *offset = if *offset < 0.0 { offset.max(gap.min(0.0)) } else { 0.0 };
            return;
        }
        let back = *offset * fraction;
        let pressure = -traction.normal;
        // Energy that the springs gain as the offset shrinks and their pressure grows.
        let work = |back: f64| -back * pressure + 0.5 * stiffness * back * back;
        if back > 0.0 || work(back) <= friction {
            *offset -= back;
        } else if friction > 0.0 {
            let root = (pressure * pressure + 2.0 * stiffness * friction).sqrt();
            *offset += (root - pressure) / stiffness;
        }
    }
}
