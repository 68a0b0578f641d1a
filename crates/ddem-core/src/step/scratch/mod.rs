//! Scratch data; dropping it never changes a result.

mod fields;

use std::ops::Range;
use std::sync::Arc;

use fearless_simd::{Level, dispatch};

use crate::force::neighbour_forces::{NeighbourForces, collect, spread_torque};
use crate::force::rigid::RigidBlock;
use crate::model::Model;
use crate::state::State;
use crate::state::pass::Workspace;
use crate::state::profile::{Clock, Profiler, SpanStart, Stopwatch};
use crate::state::view::StageView;
use crate::step::bodies::{self, BodyStep};
use crate::step::first::FirstPassFields;
use crate::step::frames::{fit_pack, frame_of};
use crate::step::sweep::{Slab, slab_count, slabs};
use crate::step::{Context, PartMoments};
use ddem_joint::broken::{BrokenJoints, BrokenLattices};
use ddem_joint::contact::Contacts;
use ddem_joint::losses::Losses;
use ddem_mechanics::element::corotation::Frame;
use ddem_mechanics::math::exact::sum;
use ddem_mechanics::math::lanes::{LANES, Lanes, load};
use ddem_mechanics::math::sums::StepSums;
use ddem_mechanics::rigid::{Pose, SpatialLanes, SpatialVector};
use ddem_mesh::parallel::{each_pack, node_start, runs};

use fields::BlockMotion;
pub(crate) use fields::{
    Access, FirstPassPack, NeighbourForcesMut, PackFields, PackForces, PackJoints, Relaxing,
    SecondPass,
};

/// Forces, sums and working space.
#[derive(Debug)]
pub(crate) struct Scratch {
    /// Forces on the nodes `[N]`.
    pub(crate) f: Vec<Lanes>,
    /// Sums of the forces on tied nodes `[N]`; empty without ties.
    tied: Vec<[f64; 3]>,
    /// Viscous forces of the blocks against the motion `[N]`; empty if they have never been
    /// viscous.
    viscous: Vec<Lanes>,
    /// Forces of joints on upper neighbours.
    neighbour_forces: Vec<Lanes>,
    /// Residual torques of deformable blocks, wrenches on rigid ones, by pack.
    pub(super) wrenches: Vec<SpatialLanes>,
    /// Frames of the packs at the present displacements.
    pub(crate) frames: Vec<Frame>,
    /// Strain energies of the packs, in blocks and joints `[J]`.
    pub(crate) energies: Vec<[Lanes; 2]>,
    /// Losses of the packs' joints in the last first pass.
    pub(super) losses: Vec<Losses>,
    /// Joints in the last measurement.
    pub(crate) measured_joints: BrokenJoints,
    /// Contacts in the last measurement.
    pub(crate) measured_contacts: Contacts,
    /// Sums of the packs.
    pub(crate) sums: Vec<StepSums>,
    /// Steps of the rigid bodies of several blocks.
    pub(super) bodies: Vec<BodyStep>,
    /// Moments of the sliding cells in each pack, and rigid motions of these cells; empty if none has
    /// slid.
    pub(super) moments: Vec<PartMoments>,
    pub(super) cell_motions: Vec<SpatialVector>,
    /// Reactions of the active supports `[N]`.
    pub(crate) reactions: Vec<f64>,
    /// Forces of the boundary dashpots `[N]`.
    dashpot_forces: Vec<[f64; 3]>,
    /// Runs of packs, one task each, with a working space each.
    runs: Vec<Range<usize>>,
    workspaces: Vec<TaskWorkspaces>,
    /// Slabs of a sweep for a number of threads; `None` if two passes are faster.
    pub(super) slabs: Option<(usize, Option<Arc<[Slab]>>)>,
    /// Instruction set of the kernels.
    pub(crate) level: Level,
    /// Wall times of the phases.
    pub(crate) profiler: Profiler,
}

/// Displacements, velocities and poses of a state: a step changes them, an evaluation only reads
/// them.
pub(super) struct StateMotion<'a> {
    pub(super) u: Access<'a, Lanes>,
    pub(super) v: Access<'a, Lanes>,
    pub(super) poses: Access<'a, [Pose; LANES]>,
}

impl StateMotion<'_> {
    /// The same data, only to be read.
    pub(super) fn read(&self) -> StateMotion<'_> {
        StateMotion {
            u: Access::Read(self.u.get()),
            v: Access::Read(self.v.get()),
            poses: Access::Read(self.poses.get()),
        }
    }
}

/// Data of the second pass, or of a sweep.
pub(super) struct StepFields<'a> {
    pub(super) forces: PackForces<'a>,
    pub(super) joints: PackJoints<'a>,
    pub(super) on_neighbours: &'a mut [Lanes],
    pub(super) second: SecondPass<'a>,
    /// Steps of the rigid bodies of several blocks.
    pub(super) bodies: &'a [BodyStep],
    /// Sums of the forces on tied nodes `[N]`; empty without ties.
    pub(super) tied: &'a [[f64; 3]],
    /// Rigid motions of the sliding cells.
    pub(super) cells: &'a [SpatialVector],
    /// Runs of packs, one task each.
    pub(super) runs: &'a [Range<usize>],
}

/// Working spaces of one task.
#[derive(Debug, Default)]
pub(crate) struct TaskWorkspaces {
    pub(super) elements: Workspace,
    /// Loads on one pack, or its accelerations in relaxation.
    pub(super) q: Vec<Lanes>,
    /// Forces on one pack, in a sweep.
    pub(super) f: Vec<Lanes>,
    /// Working space for a nodal field of one pack.
    pub(super) buffer: Vec<Lanes>,
}

impl TaskWorkspaces {
    fn with_clock(clock: Option<Clock>) -> Self {
        let mut workspaces = Self::default();
        workspaces.elements.stopwatch = Stopwatch::new(clock);
        workspaces
    }
}

impl Scratch {
    /// Scratch data of a model, with the frames of a state.
    pub(crate) fn new(model: &Model, state: &State, level: Level) -> Self {
        let packs = &model.packs;
        let n = packs.packs.len();
        let runs = runs(packs);
        let mut scratch = Self {
            f: vec![Lanes::ZERO; 3 * packs.nodes],
            tied: Vec::new(),
            viscous: Vec::new(),
            neighbour_forces: vec![Lanes::ZERO; 3 * packs.neighbour_forces],
            wrenches: vec![SpatialLanes::default(); n],
            frames: vec![Frame::REST; n],
            energies: vec![[Lanes::ZERO; 2]; n],
            losses: vec![Losses::default(); n],
            measured_joints: BrokenJoints::default(),
            measured_contacts: Contacts::default(),
            sums: vec![StepSums::default(); n],
            bodies: Vec::new(),
            moments: Vec::new(),
            cell_motions: Vec::new(),
            reactions: Vec::new(),
            dashpot_forces: Vec::new(),
            workspaces: runs.iter().map(|_| TaskWorkspaces::default()).collect(),
            runs,
            slabs: None,
            level,
            profiler: Profiler::default(),
        };
        scratch.fit(model, state);
        scratch
    }

    /// Memory in use `[bytes]`, without the working spaces of the tasks.
    pub(crate) fn bytes(&self) -> usize {
        let lanes = self.f.len()
            + self.viscous.len()
            + self.neighbour_forces.len()
            + 8 * self.wrenches.len();
        lanes * size_of::<Lanes>()
            + size_of_val(&self.tied[..])
            + size_of_val(&self.moments[..])
            + size_of_val(&self.cell_motions[..])
            + self.frames.len() * size_of::<Frame>()
            + self.sums.len() * (size_of::<StepSums>() + size_of::<Losses>())
            + self.measured_joints.bytes()
            + self.measured_contacts.bytes()
    }

    /// Updates the frames to displacements that a step has not made.
    pub(crate) fn fit(&mut self, model: &Model, state: &State) {
        let packs = &model.packs;
        for (index, frame) in self.frames.iter_mut().enumerate() {
            let pack = &packs.packs[index];
            if pack.rigid {
                *frame = frame_of(&state.poses[pack.rigid_start]);
                continue;
            }
            if !model.corotational() {
                continue;
            }
            let u = &state.u[node_start(packs, index)..node_start(packs, index + 1)];
            *frame = dispatch!(self.level, simd => fit_pack(simd, model, index, u));
        }
    }

    /// Adds the forces and torques of the joints at the lower sides of each pack to its forces.
    pub(crate) fn collect(&mut self, model: &Model, poses: &[[Pose; LANES]], linear: bool) {
        let (packs, level) = (&model.packs, self.level);
        let Self { f, neighbour_forces, wrenches, frames, .. } = self;
        let joints = NeighbourForces::all(neighbour_forces);
        each_pack(packs, [f], wrenches, |index, [f], SpatialLanes { angular: torque, .. }| {
            let assembly = &model.assembly;
            dispatch!(level, simd => collect(simd, packs, assembly, index, joints, f, torque));
            let pack = &packs.packs[index];
            if pack.rigid && !linear {
                let poses = poses[pack.rigid_start].iter().take(pack.filled);
                for (lane, pose) in poses.enumerate() {
                    let mass_properties = &model.assembly.rigid[pack.rigid_start][lane];
                    RigidBlock { mass_properties, pose, lane }.add_torque(torque, f);
                }
            } else if model.corotational() && !linear {
                let frame = &frames[index];
                dispatch!(level, simd => {
                    let torque = load(simd, torque);
                    spread_torque(simd, packs, &model.assembly, index, frame, torque, None, f)
                });
            }
        });
        self.share_ties(model);
    }

    /// Gives all copies of tied nodes the sum of their forces.
    pub(super) fn share_ties(&mut self, model: &Model) {
        let Model { packs, ties, .. } = model;
        if ties.is_empty() {
            return;
        }
        self.sum_ties(model);
        let (tied, f, mut none) = (&self.tied, &mut self.f, vec![(); packs.packs.len()]);
        each_pack(packs, [&mut f[..]], &mut none, |pack, [own], ()| {
            ties.share(pack, tied, node_start(packs, pack), own);
        });
    }

    /// Sums the forces over tied nodes.
    pub(super) fn sum_ties(&mut self, model: &Model) {
        model.ties.sum(&self.f, &mut self.tied);
    }

    /// Computes the steps of the rigid bodies of several blocks under complete forces.
    pub(super) fn step_bodies(&mut self, context: Context<'_>, poses: &[[Pose; LANES]]) {
        let Self { wrenches, reactions, bodies, .. } = self;
        bodies::advance(context, poses, wrenches, reactions, bodies);
    }

    /// Adds the distances that the blocks have moved with the velocities of the last second pass to
    /// the travel in `contacts`.
    pub(super) fn add_travel(&self, contacts: &mut Contacts, time_step: f64) {
        for (pack, sums) in self.sums.iter().enumerate() {
            // The speed is at most √3 times its largest component.
            contacts.add_travel(pack, sums.fastest.0.map(|v| 1.733 * time_step * v));
        }
    }

    /// Strain energy of blocks and joints `[J]`, summed over the packs in order.
    pub(crate) fn strain_energy(&self) -> [f64; 2] {
        [0, 1].map(|part| sum(self.energies.iter().map(|energy| energy[part].sum())))
    }

    /// Borrows the data for the first pass: fields, frames and runs of packs.
    pub(super) fn forces<'a>(
        &'a mut self,
        broken_joints: &'a mut BrokenJoints,
        energies: bool,
        viscous: bool,
    ) -> (FirstPassFields<'a>, &'a [Frame], &'a [Range<usize>]) {
        self.has_viscous(viscous);
        let forces = PackForces {
            first: 0,
            f: &mut self.f,
            viscous: &mut self.viscous,
            wrenches: &mut self.wrenches,
            workspaces: &mut self.workspaces,
        };
        let joints = PackJoints {
            first: 0,
            energies: if energies { &mut self.energies } else { &mut [] },
            broken_joints: &mut broken_joints.packs,
            losses: &mut self.losses,
        };
        let on_neighbours = NeighbourForcesMut { first: 0, forces: &mut self.neighbour_forces };
        ((forces, (joints, on_neighbours)), &self.frames, &self.runs)
    }

    /// Slabs of a sweep; `None` if the step takes two passes.
    pub(super) fn slabs(&mut self, context: Context<'_>) -> Option<Arc<[Slab]>> {
        if !context.is_unbreakable() {
            return None;
        }
        let (packs, threads) = (&context.model.packs, rayon::current_num_threads());
        if self.slabs.as_ref().is_none_or(|(known, _)| *known != threads) {
            let count = slab_count(packs, threads);
            self.slabs = Some((threads, count.map(|count| slabs(packs, count))));
        }
        let slabs = self.slabs.as_ref()?.1.clone()?;
        let tasks = slabs.len().max(self.workspaces.len());
        let clock = self.profiler.clock;
        self.workspaces.resize_with(tasks, || TaskWorkspaces::with_clock(clock));
        Some(slabs)
    }

    /// Sets the clock with which the phases are measured.
    pub(crate) fn set_clock(&mut self, clock: Option<Clock>) {
        self.profiler = Profiler { clock, ..Profiler::default() };
        for workspace in &mut self.workspaces {
            workspace.elements.stopwatch = Stopwatch::new(clock);
        }
    }

    /// Ends a span in which the tasks have measured their phases.
    pub(super) fn end_tasks(&mut self, span: SpanStart) {
        let tasks = self.workspaces.iter_mut().map(|task| &mut task.elements.stopwatch);
        self.profiler.end_tasks(span, tasks);
    }

    /// Allocates viscous forces if there are any.
    fn has_viscous(&mut self, viscous: bool) {
        let places = if viscous { self.f.len() } else { self.viscous.len() };
        self.viscous.resize(places, Lanes::ZERO);
    }

    /// Borrows the data for the second pass, or for a sweep with `broken_joints`.
    pub(super) fn second<'a>(
        &'a mut self,
        view: &'a StageView,
        viscous: bool,
        motions: StateMotion<'a>,
        broken_joints: &'a mut [BrokenLattices],
    ) -> StepFields<'a> {
        self.has_viscous(viscous);
        let StageView { conditions, boundaries, .. } = view;
        self.reactions.resize(conditions.supports.len(), 0.0);
        self.dashpot_forces.resize(boundaries.dashpots.len(), [0.0; 3]);
        let StateMotion { u, v, poses } = motions;
        let frames = match u {
            Access::Write(_) => Access::Write(&mut self.frames[..]),
            Access::Read(_) => Access::Read(&self.frames[..]),
        };
        let forces = PackForces {
            first: 0,
            f: &mut self.f,
            viscous: &mut self.viscous,
            wrenches: &mut self.wrenches,
            workspaces: &mut self.workspaces,
        };
        let second = SecondPass {
            first: 0,
            conditions,
            boundaries,
            blocks: BlockMotion { frames, u, v, poses },
            sums: &mut self.sums,
            moments: &mut self.moments,
            reactions: &mut self.reactions,
            dashpot_forces: &mut self.dashpot_forces,
        };
        let losses = &mut self.losses;
        let joints = PackJoints { first: 0, energies: &mut [], broken_joints, losses };
        let (on_neighbours, runs) = (&mut self.neighbour_forces, &self.runs);
        let (bodies, tied, cells) = (&self.bodies[..], &self.tied[..], &self.cell_motions[..]);
        StepFields { forces, joints, on_neighbours, second, bodies, tied, cells, runs }
    }

    /// Borrows the data for the second pass of relaxation; the forces are complete and only read.
    pub(super) fn relaxing<'a>(
        &'a mut self,
        state: &'a mut State,
    ) -> (Relaxing<'a>, &'a [Lanes], &'a [Range<usize>], Level) {
        let fields = Relaxing {
            frames: &mut self.frames,
            sums: &mut self.sums,
            workspaces: &mut self.workspaces,
            u: &mut state.u,
            v: &mut state.v,
            poses: &mut state.poses,
        };
        (fields, &self.f, &self.runs, self.level)
    }
}
