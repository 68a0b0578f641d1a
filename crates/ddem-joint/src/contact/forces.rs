//! Forces of the point pairs of patches.

use fearless_simd::{Simd, dispatch};
use fearless_simd_macros::simd;
use nalgebra::{Matrix3, Vector2};
use rayon::prelude::*;

use super::fixed::PointForces;
use super::four_pairs::{
    ElasticLanes, FourResponses, FourSprings, PairAxes, areas, first_four, first_four_mut,
    from_origins, relative_positions,
};
use super::friction::{BareFaces, Friction};
use super::joint_forces::PatchRun;
use super::{Configuration, ContactPoint, Contacts, Patch, SearchContext};
use crate::losses::{LossSums, Losses};
use crate::point::{JointCheck, PairContext};
use ddem_mechanics::law::springs::PointSprings;
use ddem_mechanics::law::strengths::LaneLaws;
use ddem_mechanics::law::{JointLaw, MohrCoulomb, PointLoss, PointState, Traction};
use ddem_mechanics::math::lanes::LANES;
use ddem_mechanics::rigid::LinearField;
use ddem_mesh::Vec3;

/// Patches per parallel task.
const TOGETHER: usize = 64;

/// Updates the forces of all patches but the joints that hold; returns the losses.
pub(super) fn update(
    search: SearchContext<'_>,
    configuration: Configuration<'_>,
    contacts: &mut Contacts,
) -> Losses {
    let runs = contacts.joint_forces.runs(&mut contacts.patches, TOGETHER);
    let acting = runs.into_par_iter().map(|run| {
        dispatch!(search.level, simd => update_run(simd, run, &configuration, search.context))
    });
    let none = || (LossSums::default(), 0.0);
    let (lost, deepest) = acting.reduce(none, |(lost, deepest), (more, other)| {
        (lost.merge(&more), f64::max(deepest, other))
    });
    contacts.deepest = deepest;
    lost.total()
}

/// Updates the patches of one task. Returns the losses, and the largest penetration `[m]`.
#[simd]
fn update_run<S: Simd>(
    simd: S,
    run: PatchRun<'_>,
    configuration: &Configuration<'_>,
    context: PairContext<'_>,
) -> (LossSums, f64) {
    let (mut lost, mut deepest) = (LossSums::default(), 0.0_f64);
    // Most joints of a task have the same law.
    let mut number = 0;
    let mut law = LaneLaws::new(simd, [number; LANES], |number| context.law(number));
    for (patch, forces) in run.each() {
        match patch.bond {
            Some(_) if patch.holds => {}
            Some(bond) => {
                if bond.law != number {
                    number = bond.law;
                    law = LaneLaws::new(simd, [number; LANES], |number| context.law(number));
                }
                patch.rotate_with_larger(configuration);
                lost.add(&update_pairs(simd, patch, &law, configuration, context, forces));
            }
            None => {
                lost.add(&update_contact(simd, patch, configuration, context, forces));
                deepest = deepest.max(patch.depth());
            }
        }
        if context.relaxing {
            patch.set_equilibrium();
        }
    }
    (lost, deepest)
}

/// Updates the forces of a contact at the present positions. Returns the losses.
#[simd]
pub(super) fn update_contact<S: Simd>(
    simd: S,
    patch: &mut Patch,
    configuration: &Configuration<'_>,
    context: PairContext<'_>,
    forces: &mut [Vec3],
) -> Losses {
    match patch.surface.friction {
        Friction::Angle(tan) => {
            let law = MohrCoulomb { tan_friction: tan, ..MohrCoulomb::default() };
            let law = MohrCoulomb { tan_residual_friction: tan, ..law };
            let law = LaneLaws::new(simd, [0; LANES], |_| Some(&law));
            update_pairs(simd, patch, &law, configuration, context, forces)
        }
        Friction::Laws(strengths) => {
            let law = BareFaces { strengths, laws: context.laws };
            let law = LaneLaws::new(simd, [0; LANES], |_| Some(&law));
            update_pairs(simd, patch, &law, configuration, context, forces)
        }
    }
}

/// Updates the pairs of a patch by its law, four at a time. Returns the losses.
#[simd]
fn update_pairs<S: Simd>(
    simd: S,
    patch: &mut Patch,
    law: &LaneLaws<'_, S>,
    configuration: &Configuration<'_>,
    context: PairContext<'_>,
    forces: &mut [Vec3],
) -> Losses {
    patch.update_axes(configuration);
    debug_assert_eq!(patch.points.len(), patch.fixed.len());
    let springs = patch.take_springs(context);
    let update = PairUpdate::new(simd, patch, springs, law, configuration, context);
    let Patch { points, fixed, .. } = patch;
    let (mut forces, mut losses) = (PointForces::new(forces), Losses::default());
    for number in 0..points.len().div_ceil(LANES) {
        let first = LANES * number;
        let (mut own_points, mut own_fixed) = (None, None);
        let n = LANES.min(points.len() - first);
        let fixed = first_four(&fixed[first..], &mut own_fixed);
        let four = first_four_mut(&mut points[first..], &mut own_points);
        let relative = relative_positions(fixed, configuration, &update.motions);
        let each = update.four(simd, four, n, &relative, &mut losses);
        for lane in 0..n {
            forces.add(first + lane, &fixed[lane], &update.motions, &relative[lane], each[lane]);
        }
        if let Some(four) = own_points {
            points[first..].copy_from_slice(&four[..n]);
        }
    }
    patch.set_forces(forces);
    losses
}

/// Update of the pairs of a patch.
struct PairUpdate<'a, S: Simd> {
    configuration: &'a Configuration<'a>,
    context: PairContext<'a>,
    blocks: [u32; 2],
    /// Axes of the patch as columns.
    frame: Matrix3<f64>,
    axes: PairAxes<S>,
    motions: [LinearField; 2],
    springs: PointSprings,
    four_springs: FourSprings<'a, S>,
    law: Option<&'a dyn JointLaw>,
    kind: PatchKind,
}

impl<'a, S: Simd> PairUpdate<'a, S> {
    #[inline(always)]
    fn new(
        simd: S,
        patch: &Patch,
        springs: PointSprings,
        law: &'a LaneLaws<'a, S>,
        configuration: &'a Configuration<'a>,
        context: PairContext<'a>,
    ) -> Self {
        let frame = patch.frame();
        let kind = match patch.bond {
            Some(_) => PatchKind::Joint(patch.check(configuration, context)),
            None => PatchKind::Contact(ContactSlide {
                stiffness: springs.stiffness[0],
                spacing: patch.spacing(configuration),
                has_friction: patch.surface.friction.has_friction(),
            }),
        };
        Self {
            configuration,
            context,
            blocks: patch.blocks,
            frame,
            axes: PairAxes::new(simd, &frame),
            motions: patch.rigid_motions(configuration),
            springs,
            four_springs: FourSprings::new(simd, &springs, law),
            law: law.of_all(),
            kind,
        }
    }

    /// Updates the first `n` of four pairs for the vectors between their sides; the others repeat the
    /// last one. Pairs that have just failed are computed one by one, and so are those that failed
    /// under a law of an earlier stage. Returns their forces on sides a `[N]`.
    #[inline(always)]
    fn four(
        &self,
        simd: S,
        points: &mut [ContactPoint; LANES],
        n: usize,
        relative: &[Vec3; LANES],
        losses: &mut Losses,
    ) -> [Vec3; LANES] {
        let own = from_origins(simd, points, self.axes.along(simd, relative));
        let traction = self.four_springs.elastic(own);
        let elastic = ElasticLanes::new(traction, own);
        let kinds = match self.kind {
            PatchKind::Joint(check) => self.classify(&mut points[..n], check, &elastic, losses),
            PatchKind::Contact(_) => [PairKind::Slides; LANES],
        };
        let before = before(points);
        let slides = kinds.map(|kind| kind == PairKind::Slides);
        let FourResponses { traction, losses: lost } =
            self.four_springs.slide(simd, points, slides, own, traction);
        let mut forces = self.axes.forces(traction, areas(simd, points));
        for (lane, point) in points[..n].iter_mut().enumerate() {
            let mut loss = lost[lane];
            if let PatchKind::Contact(slide) = &self.kind {
                slide.follow(point, &before[lane], elastic.gap(lane), &mut loss);
            }
            if let PairKind::Alone { fails } = kinds[lane] {
                loss = self.one(point, &relative[lane], fails.then(|| elastic.of(lane)));
                forces[lane] = Patch::force_along(&self.frame, point);
            }
            losses.add_point(point.pair.area, loss);
        }
        forces
    }

    /// Updates a failed pair for the vector between its sides. `elastic` are its traction and its opening
    /// if it has just failed. Returns the loss.
    #[cold]
    fn one(
        &self,
        point: &mut ContactPoint,
        relative: &Vec3,
        elastic: Option<(Traction, f64)>,
    ) -> PointLoss {
        let Self { configuration, blocks, frame, .. } = self;
        let du = elastic.map(|(traction, gap)| {
            point.pair.begin(traction, gap);
            frame.tr_mul(&configuration.relative_displacement_increment(*blocks, &point.points))
        });
        point.pair.update(self.law, &self.springs, frame.tr_mul(relative), du)
    }

    /// Kinds of up to four pairs of a joint. Overloaded pairs fail; those that hold get their
    /// tractions.
    fn classify(
        &self,
        points: &mut [ContactPoint],
        check: JointCheck,
        elastic: &ElasticLanes,
        losses: &mut Losses,
    ) -> [PairKind; LANES] {
        let mut kinds = [PairKind::Holds; LANES];
        for (lane, point) in points.iter_mut().enumerate() {
            let has_failed = point.pair.failure.is_some();
            kinds[lane] = match self.law {
                Some(_) if has_failed => PairKind::Slides,
                None if has_failed => PairKind::Alone { fails: false },
                law => {
                    let (traction, gap) = elastic.of(lane);
                    let time = self.context.time;
                    let fails =
                        law.is_some_and(|law| point.pair.fail(law, check, traction, time, losses));
                    if fails {
                        PairKind::Alone { fails }
                    } else {
                        (point.pair.state.traction, point.pair.state.gap) = (traction, gap);
                        PairKind::Holds
                    }
                }
            };
        }
        kinds
    }
}

impl Patch {
    /// Springs and dashpots of its pairs in this update. New points are no longer new after it.
    fn take_springs(&mut self, context: PairContext<'_>) -> PointSprings {
        let mut springs = context.springs(self.surface.stiffness, self.surface.dashpot);
        if std::mem::take(&mut self.renewed) {
            // The new points have inherited the dashpot tractions of the old ones.
            springs.time_step = None;
        }
        springs
    }
}

/// Check of a joint for failure, or the sliding of a contact.
enum PatchKind {
    Joint(JointCheck),
    Contact(ContactSlide),
}

/// Kind of update of a pair.
#[derive(Clone, Copy, Debug, PartialEq)]
enum PairKind {
    /// Elastic, because it holds. It has no added tractions.
    Holds,
    /// With others at once, because it has failed before.
    Slides,
    /// On its own, because it fails now, or failed under a law that the joint no longer has.
    Alone { fails: bool },
}

/// Point before an update of its springs.
#[derive(Clone, Copy, Debug, Default)]
struct PointBefore {
    /// Slip `[m]`.
    slip: Vector2<f64>,
    /// Distance of the faces `[m]`.
    gap: f64,
}

/// Four points before an update of their springs.
#[inline(always)]
fn before(points: &[ContactPoint; LANES]) -> [PointBefore; LANES] {
    let mut before = [PointBefore::default(); LANES];
    for (before, point) in before.iter_mut().zip(points) {
        *before = PointBefore { slip: point.pair.state.slip, gap: point.pair.state.gap };
    }
    before
}

/// Data with which the points of a contact follow its sliding.
struct ContactSlide {
    /// Normal stiffness `[Pa/m]`.
    stiffness: f64,
    /// Shortest element edge of the two blocks `[m]`.
    spacing: f64,
    has_friction: bool,
}

impl ContactSlide {
    /// Updates the slip path and the offset of a point whose springs have been updated. `gap` is that
    /// without offset `[m]`.
    #[inline(always)]
    fn follow(
        &self,
        point: &mut ContactPoint,
        before: &PointBefore,
        gap: f64,
        loss: &mut PointLoss,
    ) {
        let state = &mut point.pair.state;
        let slipped = (state.slip - before.slip).norm();
        // In relaxation slip is measured from the last equilibrium.
        let from = state.equilibrium.map_or(before.slip, |equilibrium| equilibrium.slip);
        let slip_path =
            |gap: f64, slip: Vector2<f64>| if gap < 0.0 { (slip - from).norm() } else { 0.0 };
        point.slip_path += slip_path(state.gap, state.slip) - slip_path(before.gap, before.slip);
        // Slip over half an element removes the whole offset.
        let fraction = (slipped / (0.5 * self.spacing)).min(1.0);
        point.relax_offset(self.stiffness, gap, fraction, loss.friction);
        if !self.has_friction {
            // Without friction the work of a vanishing offset is a numerical loss.
            loss.contact += std::mem::take(&mut loss.friction);
        }
    }
}

impl ContactPoint {
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
