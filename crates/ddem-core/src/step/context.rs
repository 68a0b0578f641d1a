//! Data that a step reads besides the state: model, conditions and settings.

use super::Poses;
use super::first::FirstPass;
use crate::force::boundary::Dashpots;
use crate::force::support::Supports;
use crate::model::Model;
use crate::state::State;
use crate::state::motion::{Coefficients, Motion};
use crate::state::pass::Viscous;
use crate::state::view::StageView;
use ddem_joint::point::FailureCheck;
use ddem_mechanics::math::lanes::{LANES, Lanes};
use ddem_mesh::pack::Pack;

/// Model, conditions and settings of a step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Context<'a> {
    pub(crate) model: &'a Model,
    pub(crate) view: &'a StageView,
    pub(crate) motion: &'a Motion,
    /// Gravity times its factor `[m/s²]`.
    pub(super) gravity: [f64; 3],
    /// True if failed pairs and contacts have no dashpots, as in [`FirstPass`].
    pub(super) undamped: bool,
    /// Check of the bonded pairs for failure.
    pub(crate) failure_check: FailureCheck<'a>,
    /// True if rotated joints release their bonded pairs, as in [`FirstPass`].
    pub(crate) releases_rotated_joints: bool,
    /// True if a step in which pairs fail is not taken.
    pub(crate) waits: bool,
    /// True if strain energies are requested.
    pub(crate) energies: bool,
    /// Present time `[s]`.
    pub(super) time: f64,
}

impl<'a> Context<'a> {
    /// Context in which pairs fail, unless `failure_suspended`.
    pub(crate) fn new(
        model: &'a Model,
        state: &State,
        view: &'a StageView,
        motion: &'a Motion,
        failure_suspended: bool,
    ) -> Self {
        let gravity = view.factors.last().copied().unwrap_or(1.0);
        Self {
            model,
            view,
            motion,
            gravity: (model.properties.gravity * gravity).into(),
            failure_check: match motion.fictitious || failure_suspended {
                true => FailureCheck::None,
                false => FailureCheck::Overloaded,
            },
            releases_rotated_joints: model.can_meet(),
            undamped: model.has_blast_waves(state.time, &state.stage_starts),
            waits: false,
            energies: false,
            time: state.time,
        }
    }

    pub(crate) fn pass<'b>(
        &self,
        u: &'b [Lanes],
        v: &'b [Lanes],
        poses: &'b [Poses],
    ) -> FirstPass<'b>
    where
        'a: 'b,
    {
        let motion = self.motion;
        // At the start of a stage the former step counts as being as long as the next one.
        let du = match motion.before {
            _ if motion.fictitious => 0.0,
            0.0 => motion.time_step,
            before => before,
        };
        FirstPass {
            model: self.model,
            first: 0,
            u,
            poses,
            failure_check: self.failure_check,
            releases_rotated_joints: self.releases_rotated_joints,
            undamped: self.undamped,
            relaxing: self.motion.fictitious,
            waits: self.waits,
            time: self.time,
            last: (motion.before > 0.0).then_some((v, motion.before)),
            du: (v, du),
            viscous: self.viscous(v),
            held: &self.view.conditions.held_blocks,
            linear: false,
            energies: self.energies,
        }
    }

    /// Supports of a pack.
    pub(super) fn supports(&self, pack: usize) -> Supports<'a> {
        let StageView { conditions, velocities, .. } = self.view;
        let first = 3 * self.model.packs.packs[pack].start;
        Supports { list: &conditions.supports[conditions.supports_of(pack)], velocities, first }
    }

    fn viscous<'b>(&self, v: &'b [Lanes]) -> Option<Viscous<'b>> {
        let stiffness = self.motion.stiffness;
        (stiffness > 0.0).then_some(Viscous { v, stiffness })
    }

    /// α of the blocks of a pack, if any of them slides `[1/s]`.
    pub(super) fn slides(&self, pack: usize) -> Option<Lanes> {
        self.view.sliding.get(pack).copied().filter(|&alpha| alpha != Lanes::ZERO)
    }

    /// True if any deformable cell slides.
    pub(super) fn slides_cells(&self) -> bool {
        let cells = &self.model.sliding.cells;
        let mut packs = self.view.sliding.iter().enumerate();
        !cells.is_empty() && packs.any(|(pack, alpha)| *alpha != Lanes::ZERO && cells.has(pack))
    }

    /// True if no pair can fail, no blocks can meet and no energies are requested. Then a pack
    /// needs nothing from packs that come after it but their positions.
    pub(super) fn is_unbreakable(&self) -> bool {
        let checked = !matches!(self.failure_check, FailureCheck::None);
        let fails = checked && self.model.laws.iter().any(Option::is_some);
        let alone = self.model.contact.is_none() && !self.model.has_shared_motion();
        !fails && alone && !self.energies
    }

    pub(super) fn has_viscous(&self) -> bool {
        self.motion.stiffness > 0.0 || !self.view.sliding.is_empty()
    }

    pub(super) fn is_viscous(&self, pack: usize) -> bool {
        self.motion.stiffness > 0.0 || self.slides(pack).is_some()
    }
}

/// Data of one pack that a step reads.
#[derive(Clone, Copy)]
pub(super) struct PackContext<'a> {
    pub(super) step: Context<'a>,
    pub(super) index: usize,
    pub(super) pack: &'a Pack,
    pub(super) divisions: usize,
    pub(super) class: &'a Coefficients,
    /// Masses of its nodes `[kg]`.
    pub(super) mass: &'a [Lanes],
    /// Part of these masses that has weight, if it is not all.
    pub(super) weight: Option<Lanes>,
    /// Part of each node in the mass that is tied to it, if nodes are tied.
    pub(super) share: Option<&'a [Lanes]>,
    pub(super) supports: Supports<'a>,
    pub(super) dashpots: Dashpots<'a>,
}

impl<'a> PackContext<'a> {
    pub(super) fn new(step: Context<'a>, index: usize) -> Self {
        let Context { model, view, .. } = step;
        let StageView { boundaries, boundary_forces, velocities, .. } = view;
        let pack = &model.packs.packs[index];
        let class = model.assembly.pack_inertia[index] as usize;
        let first = 3 * pack.start;
        let dashpots = boundaries.of(index);
        let (list, boundary_forces) =
            (&boundaries.dashpots[dashpots.clone()], &boundary_forces[dashpots]);
        Self {
            step,
            index,
            pack,
            divisions: model.packs.numbering_of(pack).divisions,
            class: &step.motion.classes[class],
            mass: &model.assembly.inertia[class].mass,
            weight: pack_weight(model, index),
            share: model.assembly.shares(index),
            supports: step.supports(index),
            dashpots: Dashpots { list, boundary_forces, velocities, first },
        }
    }

    pub(super) fn is_rigid(&self) -> bool {
        self.pack.rigid
    }

    /// Number of nodes along an edge of a block.
    pub(super) fn side(&self) -> usize {
        self.divisions + 1
    }
}

/// Part of the masses of a pack that has weight, if it is not all.
fn pack_weight(model: &Model, index: usize) -> Option<Lanes> {
    let table = model.assembly.tables.get(model.assembly.pack_tables[index][0] as usize)?;
    Some(table.weight).filter(|weight| *weight != Lanes([1.0; LANES]))
}
