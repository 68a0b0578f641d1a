//! Relative motion of blocks, and the verdict on a stage.

use crate::error::MovingBlock;
use crate::model::Model;
use crate::model::joint_state::JointState;
use crate::state::State;
use crate::state::motion::Motion;
use crate::state::watch::detection_time;
use ddem_joint::contact::Patch;
use ddem_mechanics::math::disjoint_sets::DisjointSets;
use ddem_mesh::Vec3;

/// Fraction of the largest motion of a block from which a block counts as moving.
const MOVES: f64 = 0.01;

/// Blocks on both sides of each contact, without removed blocks.
fn contacts<'a>(model: &'a Model, state: &'a State) -> impl Iterator<Item = [usize; 2]> + use<'a> {
    let points = |patch: &&Patch| patch.bond.is_none() && !patch.points.is_empty();
    let contacts = state.contacts.patches.iter().filter(points);
    let blocks = contacts.map(|patch| patch.blocks.map(|block| block as usize));
    blocks.filter(|blocks| !blocks.iter().any(|&block| model.is_removed(block)))
}

/// Pairs of blocks with a joint, bonded or not, or a contact between them.
fn linked_blocks<'a>(
    model: &'a Model,
    state: &'a State,
) -> impl Iterator<Item = [usize; 2]> + use<'a> {
    let joints = model.joint_states(&state.broken_joints, &state.contacts);
    let joints = joints.filter(|joint| !joint.is_released()).map(|joint| joint.blocks);
    joints.chain(contacts(model, state)).chain(model.tied_blocks())
}

/// Pairs of blocks with failed pairs between them, or in contact; some occur twice.
fn unbonded_neighbours<'a>(
    model: &'a Model,
    state: &'a State,
) -> impl Iterator<Item = [usize; 2]> + use<'a> {
    let joints = model.joint_states(&state.broken_joints, &state.contacts);
    let failed = joints.filter(JointState::has_failed).map(|joint| joint.blocks);
    failed.chain(contacts(model, state))
}

/// Mean displacement of each block `[m]`.
fn displacements(model: &Model, state: &State) -> Vec<[f64; 3]> {
    let displacement_of = |block: usize| {
        let nodes = model.nodes_of(block);
        let weight = 1.0 / nodes.len() as f64;
        let sum = nodes.map(|node| Vec3::from(model.get(&state.u, node))).sum::<Vec3>();
        (sum * weight).into()
    };
    (0..model.n_blocks()).map(displacement_of).collect()
}

impl State {
    /// Restarts the watch of the motion of neighbours: a stage or an increment begins, or pairs
    /// have failed.
    pub(crate) fn restart_watch(&mut self, model: &Model, stage: bool) {
        let displacements = displacements(model, self);
        self.watch.begin(self.steps, stage, displacements);
    }

    /// Records how far blocks have moved against each other since the last event, at the end of each
    /// interval of the watch.
    pub(crate) fn watch_motion(&mut self, model: &Model, ratio: f64, relaxes: bool) {
        if !(self.steps - self.watch.since.min(self.steps)).is_multiple_of(self.watch.interval()) {
            return;
        }
        if relaxes && self.steps == self.watch.since {
            // Nothing has moved since the event.
            return self.watch.add([0.0, ratio, 0.0]);
        }
        let fraction = |(blocks, distance): ([usize; 2], f64)| {
            let [a, b] = blocks.map(|block| model.geometry.shortest_edge(block));
            distance / a.min(b)
        };
        let most = self.relative_motions(model).into_iter().map(fraction).fold(0.0, f64::max);
        // A relaxation has ended by the time that blocks fall.
        let flight = if relaxes { 0.0 } else { self.flight(model) };
        self.watch.add([most, ratio, flight]);
    }

    /// Largest motion since the last event of blocks that fly or fall, relative to the largest
    /// group of linked blocks, as a fraction of an edge. Nothing links these blocks to that group.
    fn flight(&self, model: &Model) -> f64 {
        let n = model.n_blocks();
        let mut groups = DisjointSets::new(n);
        linked_blocks(model, self).for_each(|blocks| groups.join(blocks));
        let mut volumes = vec![0.0; n];
        for block in (0..n).filter(|&block| !model.is_removed(block)) {
            volumes[groups.lowest(block)] += model.volume(block);
        }
        let largest = (0..n).reduce(|a, b| if volumes[b] > volumes[a] { b } else { a });
        let Some(largest) = largest else { return 0.0 };
        let (now, then) = (displacements(model, self), &self.watch.displacements[1]);
        let motion = |block: usize| Vec3::from(now[block]) - displacement_of(then, block);
        let ground = motion(largest);
        let free =
            (0..n).filter(|&block| !model.is_removed(block) && groups.lowest(block) != largest);
        let fraction =
            |block| (motion(block) - ground).norm() / model.geometry.shortest_edge(block);
        free.map(fraction).fold(0.0, f64::max)
    }

    /// Relative motion of neighbours with failed pairs or in contact since the last event, with
    /// their blocks `[m]`.
    fn relative_motions(&self, model: &Model) -> Vec<([usize; 2], f64)> {
        let (now, then) = (displacements(model, self), &self.watch.displacements[1]);
        let motion = |block: usize| Vec3::from(now[block]) - displacement_of(then, block);
        unbonded_neighbours(model, self)
            .map(|[a, b]| ([a, b], (motion(b) - motion(a)).norm()))
            .collect()
    }

    /// True if blocks that could move have been watched for long enough to detect their motion.
    pub(crate) fn is_known(&self, model: &Model, motion: &Motion) -> bool {
        let edge = |blocks: [usize; 2]| {
            let [a, b] = blocks.map(|block| model.geometry.shortest_edge(block));
            a.min(b)
        };
        let edge = unbonded_neighbours(model, self).map(edge).fold(0.0, f64::max);
        let gravity = model.properties.gravity.norm();
        let watched = (self.steps - self.watch.since.min(self.steps)) as f64 * motion.time_step;
        watched >= detection_time(edge, gravity, motion.local)
    }

    /// The two blocks that have moved farthest against each other since the last event, and their
    /// relative motion `[m]`.
    pub(crate) fn farthest(&self, model: &Model) -> ([usize; 2], f64) {
        let farthest = self.relative_motions(model).into_iter().max_by(|a, b| a.1.total_cmp(&b.1));
        farthest.unwrap_or_default()
    }

    /// Blocks that have moved since the last event, by decreasing displacement in the stage, with the direction of the
    /// motion since the event.
    pub(crate) fn moving(&self, model: &Model) -> Vec<MovingBlock> {
        let [first, last] = &self.watch.displacements;
        let now = displacements(model, self);
        let motion =
            |from: &[[f64; 3]], block: usize| Vec3::from(now[block]) - displacement_of(from, block);
        let existing = || (0..now.len()).filter(|&block| !model.is_removed(block));
        let most = existing().map(|block| motion(last, block).norm()).fold(0.0, f64::max);
        let moves =
            existing().filter(|&block| most > 0.0 && motion(last, block).norm() >= MOVES * most);
        let mut moving: Vec<MovingBlock> = moves
            .map(|block| {
                let direction = motion(last, block).try_normalize(0.0).unwrap_or_default();
                // This avoids −0.00 in messages.
                let direction = direction.map(|d| if d.abs() < 5e-3 { 0.0 } else { d }).into();
                MovingBlock {
                    set: model.set_name(block),
                    block,
                    distance: motion(first, block).norm(),
                    direction,
                }
            })
            .collect();
        moving.sort_by(|a, b| b.distance.total_cmp(&a.distance).then(a.block.cmp(&b.block)));
        moving
    }
}

/// Former displacement of a block `[m]`; zero in a state that was saved without it.
fn displacement_of(displacements: &[[f64; 3]], block: usize) -> Vec3 {
    displacements
        .get(block)
        .map_or_else(Vec3::zeros, |displacement_of| Vec3::from(*displacement_of))
}
