//! Variables that change during a run.

pub(crate) mod motion;
pub(crate) mod pass;
mod peaks;
pub(crate) mod profile;
mod relaxation;
pub(crate) mod verdict;
pub(crate) mod view;
pub(crate) mod watch;

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::model::Model;
use crate::model::charge::GasSurfaceState;
use crate::model::conditions::{AppliedForces, FadingForces};
use crate::state::watch::MotionWatch;
use ddem_joint::broken::BrokenJoints;
use ddem_joint::contact::Contacts;
use ddem_mechanics::math::lanes::{LANES, Lanes};
use ddem_mechanics::rigid::{MassProperties, Pose, SpatialVector};
use ddem_mesh::Vec3;
use ddem_mesh::pack::Pack;

pub(crate) use peaks::Peaks;
pub(crate) use relaxation::RelaxationProgress;

/// Work done on the model up to the last step `[J]`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Work {
    /// Work of loads, gravity included.
    pub(crate) loads: f64,
    /// Work of driven supports.
    pub(crate) supports: f64,
    /// Energy dissipated by damping.
    pub(crate) damping: f64,
    /// Energy dissipated by friction on failed joints and contacts.
    pub(crate) friction: f64,
    /// Energy dissipated by fracture of joints.
    pub(crate) fracture: f64,
    /// Energy lost where contacts form, end or change their points.
    pub(crate) contact: f64,
    /// Largest work of loads and supports together so far, of either sign.
    pub(crate) most: f64,
}

/// State of a model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct State {
    /// Simulated time `[s]`; a relaxation takes none. It is counted from `origin`, so that a stage
    /// ends exactly on time.
    pub(crate) time: f64,
    /// Time and step at which the present time step was set.
    pub(crate) origin: (f64, u64),
    /// End time of the started duration `[s]`; infinite without one.
    pub(crate) end: f64,
    /// Number of steps at its end; the largest number without one.
    pub(crate) last_step: u64,
    /// True if the time step was chosen automatically.
    pub(crate) automatic: bool,
    /// Steps since the start of the run.
    pub(crate) steps: u64,
    /// Present stage, by its number in the deck.
    pub(crate) stage: usize,
    /// Entry into the present stage, as long as the stage has not begun to move.
    pub(crate) stage_entry: Option<StageEntry>,
    /// Times at which the stages so far began `[s]`.
    pub(crate) stage_starts: Vec<f64>,
    /// Displacements `[m]`.
    pub(crate) u: Vec<Lanes>,
    /// Velocities `[m/s]`, at half steps within a stage.
    pub(crate) v: Vec<Lanes>,
    /// Poses of the rigid blocks, by rigid pack.
    pub(crate) poses: Vec<[Pose; LANES]>,
    /// Δt⁻, the step of the velocities `[s]`; 0 if they are at the present time, as between stages.
    pub(crate) before: f64,
    /// State of broken joints.
    pub(crate) broken_joints: BrokenJoints,
    /// Contacts and nonconforming joints.
    pub(crate) contacts: Contacts,
    /// Numbers of pairs that failed in shear and in tension.
    pub(crate) failed: [u64; 2],
    pub(crate) work: Work,
    /// Factors of the loads and charges, of the forces of programs, and of gravity, after the last
    /// step or relaxation.
    pub(crate) load_factors: Vec<f64>,
    /// Forces applied by programs.
    pub(crate) applied: AppliedForces,
    /// Reactions locked in when supports ended at a boundary, by node `[N]`.
    pub(crate) locked_reactions: AppliedForces,
    /// Fading forces of removed blocks, by load.
    pub(crate) released: BTreeMap<usize, FadingForces>,
    /// Displacements `[m]` and velocities `[m/s]` of the levels of free-field columns.
    pub(crate) columns: Vec<[Vec3; 2]>,
    /// State of the gas in the gas surfaces of charges, charge by charge.
    pub(crate) gas_surfaces: Vec<GasSurfaceState>,
    /// Path length of relaxation so far, `Σ ‖Δu‖` `[m]`.
    pub(crate) path_length: f64,
    /// Peak values so far.
    pub(crate) peaks: Peaks,
    /// Motion of neighbours since the last event.
    pub(crate) watch: MotionWatch,
}

/// Origin of a stage that has just been entered.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct StageEntry {
    /// Stage that was left.
    pub(crate) from_stage: usize,
    /// First of the stages that begin; programs may skip some.
    pub(crate) first: usize,
}

impl State {
    /// State at the start of a run: no displacement, initial velocities, no load.
    pub(crate) fn new(model: &Model) -> Self {
        let n = 3 * model.packs.nodes;
        let mut state = Self {
            time: 0.0,
            origin: (0.0, 0),
            end: f64::INFINITY,
            last_step: u64::MAX,
            automatic: false,
            steps: 0,
            stage: 0,
            stage_entry: Some(StageEntry { from_stage: 0, first: 0 }),
            stage_starts: vec![0.0],
            u: vec![Lanes::ZERO; n],
            v: vec![Lanes::ZERO; n],
            poses: vec![[Pose::default(); LANES]; model.packs.rigid],
            before: 0.0,
            broken_joints: model.broken_joints(),
            contacts: model.contacts(),
            failed: [0; 2],
            work: Work::default(),
            load_factors: vec![0.0; model.conditions.n_factors()],
            applied: AppliedForces::default(),
            locked_reactions: AppliedForces::default(),
            released: BTreeMap::new(),
            columns: vec![[Vec3::zeros(); 2]; model.boundaries.column_nodes()],
            gas_surfaces: vec![GasSurfaceState::default(); model.conditions.n_gas_surfaces()],
            path_length: 0.0,
            peaks: Peaks::new(model),
            watch: MotionWatch::default(),
        };
        for motion in &model.problem.motions {
            for &node in &motion.nodes {
                let arm = Vec3::from(model.point(node as usize)) - motion.centre;
                let v = motion.velocity + motion.spin.cross(&arm);
                model.set(&mut state.v, node as usize, v.into());
            }
        }
        state.move_rigid(model);
        state.peaks.note_velocities(&state.v);
        state
    }

    /// Counts a time step and advances the time.
    pub(crate) fn count_step(&mut self, time_step: f64) {
        self.steps += 1;
        let (time, step) = self.origin;
        self.time = time + (self.steps - step) as f64 * time_step;
        self.before = time_step;
    }

    /// Brings everything to rest.
    pub(crate) fn rest(&mut self) {
        self.v.fill(Lanes::ZERO);
        self.poses.iter_mut().flatten().for_each(|pose| *pose = pose.resting());
        self.columns.fill([Vec3::zeros(); 2]);
    }

    /// Places rigid blocks as near as possible to the displacements that their corners were given.
    pub(crate) fn place_rigid(&mut self, model: &Model) {
        self.each_rigid(model, |mass_properties, pose, [u, _]| {
            *pose = pose.from_corners(mass_properties, u);
            *u = std::array::from_fn(|corner| pose.displacement(&mass_properties.arm(corner)));
        });
        self.each_body(model, |_, arms, pose, [u, _]| {
            *pose = pose.from_points(arms, u);
            u.iter_mut().zip(arms).for_each(|(u, arm)| *u = pose.displacement(arm));
        });
    }

    /// Moves rigid blocks as near as possible to the velocities that their corners were given.
    pub(crate) fn move_rigid(&mut self, model: &Model) {
        self.each_rigid(model, |mass_properties, pose, [_, v]| {
            *pose = pose.with_corner_velocities(mass_properties, v);
            let twist = pose.twist(mass_properties);
            let arm = |corner| pose.turn * mass_properties.arm(corner);
            *v = std::array::from_fn(|corner| twist.linear + twist.angular.cross(&arm(corner)));
        });
        self.each_body(model, |mass_properties, arms, pose, [_, v]| {
            let mut sums = SpatialVector::default();
            for (arm, v) in arms.iter().zip(&*v) {
                sums.linear += v;
                sums.angular += (pose.turn * arm).cross(v);
            }
            *pose = pose.with_velocity_sums(mass_properties, sums);
            let twist = pose.twist(mass_properties);
            for (v, arm) in v.iter_mut().zip(arms) {
                *v = twist.linear + twist.angular.cross(&(pose.turn * arm));
            }
        });
    }

    /// Calls `change` with each rigid block that is a body of its own, and with the displacements and
    /// velocities of its corners.
    fn each_rigid(
        &mut self,
        model: &Model,
        change: impl Fn(&MassProperties, &mut Pose, [&mut [Vec3; 8]; 2]),
    ) {
        for (index, pack) in model.packs.packs.iter().enumerate().filter(|(_, pack)| pack.rigid) {
            for lane in 0..pack.filled {
                if model.assembly.bodies.body(index, lane).is_some() {
                    continue;
                }
                let mass_properties = &model.assembly.rigid[pack.rigid_start][lane];
                let slot = |corner: usize, c: usize| 3 * (pack.start + corner) + c;
                let get = |field: &[Lanes]| {
                    let at = |corner| [0, 1, 2].map(|c| field[slot(corner, c)].0[lane]);
                    std::array::from_fn(|corner| Vec3::from(at(corner)))
                };
                let (mut u, mut v) = (get(&self.u), get(&self.v));
                change(mass_properties, &mut self.poses[pack.rigid_start][lane], [&mut u, &mut v]);
                for (corner, c) in (0..8).flat_map(|corner| [0, 1, 2].map(|c| (corner, c))) {
                    self.u[slot(corner, c)].0[lane] = u[corner][c];
                    self.v[slot(corner, c)].0[lane] = v[corner][c];
                }
            }
        }
    }

    /// Calls `change` with each rigid body of several blocks: its mass properties, the vectors from its
    /// centre of mass to the corners of its blocks at rest, and their displacements and velocities.
    fn each_body(
        &mut self,
        model: &Model,
        change: impl Fn(&MassProperties, &[Vec3], &mut Pose, [&mut [Vec3]; 2]),
    ) {
        let bodies = &model.assembly.bodies;
        for body in 0..bodies.len() {
            let parts =
                bodies.parts(body).iter().map(|part| (&model.packs.packs[part.pack], part.lane));
            let corners =
                parts.clone().flat_map(|(pack, lane)| (0..8).map(move |k| (pack, lane, k)));
            let of = |(pack, lane): (&Pack, usize)| &model.assembly.rigid[pack.rigid_start][lane];
            let arms: Vec<Vec3> =
                corners.clone().map(|(pack, lane, k)| of((pack, lane)).arm(k)).collect();
            let get = |field: &[Lanes]| -> Vec<Vec3> {
                let at = |(pack, lane, k): (&Pack, usize, usize)| {
                    [0, 1, 2].map(|c| field[3 * (pack.start + k) + c].0[lane]).into()
                };
                corners.clone().map(at).collect()
            };
            let Some((first, lane)) = parts.clone().next() else { continue };
            let (mut u, mut v) = (get(&self.u), get(&self.v));
            let mut pose = self.poses[first.rigid_start][lane];
            change(of((first, lane)), &arms, &mut pose, [&mut u, &mut v]);
            for (pack, lane) in parts {
                self.poses[pack.rigid_start][lane] = pose;
            }
            for ((pack, lane, k), (u, v)) in corners.zip(u.iter().zip(&v)) {
                for c in 0..3 {
                    self.u[3 * (pack.start + k) + c].0[lane] = u[c];
                    self.v[3 * (pack.start + k) + c].0[lane] = v[c];
                }
            }
        }
    }
}
