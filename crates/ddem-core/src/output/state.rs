//! Summary of a state: largest motions, failed joints, contacts, fragments, reactions and energies.

use std::ops::Range;

use serde::{Deserialize, Serialize};

use super::Snapshot;
use super::energy::Energy;
use ddem_joint::point::{JointPoint, PairFailure};
use ddem_mechanics::law::FailureMode;
use ddem_mesh::Vec3;

/// Number of nodes that are processed at once.
const PIECE: usize = 65_536;

/// Summary of a state.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StateSummary {
    /// Time `[s]`.
    pub time: f64,
    /// Largest displacement `[m]`; `None` without blocks.
    pub displacement: Option<Largest>,
    /// Largest velocity `[m/s]`; `None` in a relaxation, and if nothing moves.
    pub velocity: Option<Largest>,
    /// Joints that can fail, by name.
    pub joints: Vec<JointSummary>,
    /// Pairs of blocks in contact.
    pub contacts: ContactSummary,
    /// Fragments.
    pub fragments: FragmentSummary,
    /// Force of each active support of the deck on the model.
    pub reactions: Vec<Reaction>,
    /// Energies.
    pub energy: Energy,
}

/// Largest vector at a node.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Largest {
    /// Magnitude of the vector.
    pub size: f64,
    /// The vector.
    pub vector: [f64; 3],
    /// Name of the block's set.
    pub set: String,
    /// Number of the block.
    #[serde(rename = "index")]
    pub block: usize,
    /// Reference position of the node `[m]`.
    pub point: [f64; 3],
}

/// Numbers of pairs of one joint of the deck.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct JointSummary {
    /// Name of the joint.
    pub joint: String,
    /// Number of its pairs.
    pub pairs: u64,
    /// Pairs that failed in shear.
    pub shear: u64,
    /// Pairs that failed in tension.
    pub tension: u64,
    /// Failed pairs that are open now.
    pub open: u64,
}

/// Present contacts; all zero if no blocks meet.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ContactSummary {
    /// Pairs of blocks that press on each other.
    pub block_pairs: u64,
    /// Pairs of blocks that slide over each other: friction is fully mobilised at one of their
    /// points.
    #[serde(default)]
    pub sliding: u64,
    /// Pairs of blocks that are near each other but not in contact.
    #[serde(default)]
    pub open: u64,
    /// Pairs of points that press on each other.
    pub points: u64,
    /// Largest penetration `[m]`.
    pub deepest: f64,
}

/// Present fragments: groups of blocks that bonded joints hold together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FragmentSummary {
    /// Number of fragments.
    pub number: u64,
    /// Volume of the largest fragment `[m³]`.
    pub largest_volume: f64,
}

/// Force of a support.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Reaction {
    /// Number of the support in the deck.
    pub fix: usize,
    /// Force on the model `[N]`.
    pub force: [f64; 3],
}

impl Snapshot<'_> {
    /// Implements [`Simulation::state_summary`](crate::Simulation::state_summary).
    pub(crate) fn state_summary(&self, energy: Energy) -> StateSummary {
        let displacement = |snapshot: &Self, range: Range<usize>, out: &mut [f64]| {
            snapshot.model.fill_nodal(&snapshot.state.u, range, out);
        };
        StateSummary {
            time: self.state.time,
            displacement: self.largest(displacement),
            velocity: self.largest(Self::fill_velocities).filter(|largest| largest.size > 0.0),
            joints: self.joint_summaries(),
            contacts: self.contact_summary(),
            fragments: self.fragment_summary(),
            reactions: self.reactions(),
            energy,
        }
    }

    /// Largest of the nodal vectors that `fill` writes; the first if several are equal.
    fn largest(&self, fill: fn(&Self, Range<usize>, &mut [f64])) -> Option<Largest> {
        let (n, mut most, mut vectors) = (self.model.n_nodes(), None, Vec::new());
        for first in (0..n).step_by(PIECE) {
            let range = first..n.min(first + PIECE);
            vectors.resize(range.len(), [0.0; 3]);
            fill(self, range.clone(), vectors.as_flattened_mut());
            let existing = range.filter(|&node| !self.model.is_removed(self.model.block_of(node)));
            let sized = existing.map(|node| {
                let vector = vectors[node - first];
                (Vec3::from(vector).norm(), vector, node)
            });
            let all = most.into_iter().chain(sized);
            most = all.reduce(|most, next| if next.0 > most.0 { next } else { most });
        }
        let ((size, vector, node), model) = (most?, self.model);
        let block = model.block_of(node);
        let (set, point) = (model.set_name(block), model.point(node));
        Some(Largest { size, vector, set, block: model.whole_block(block), point })
    }

    fn joint_summaries(&self) -> Vec<JointSummary> {
        let model = self.model;
        let joints = model.properties.joints.iter();
        let mut joints: Vec<JointSummary> = joints
            .map(|joint| JointSummary { joint: joint.name.clone(), ..JointSummary::default() })
            .collect();
        let removed =
            |joint: &usize| model.joint(*joint).blocks().iter().any(|&b| model.is_removed(b));
        for joint in model.joints().filter(|joint| !removed(joint)) {
            let (pairs, joint_state) = (model.pairs_of(joint).len(), self.joint_state(joint));
            let joint = &mut joints[usize::from(model.joint(joint).number())];
            joint.pairs += pairs as u64;
            for JointPoint { failure, state, .. } in joint_state.points() {
                let Some(PairFailure { mode, .. }) = failure else { continue };
                joint.tension += u64::from(mode == FailureMode::Tension);
                joint.shear += u64::from(mode != FailureMode::Tension);
                joint.open += u64::from(state.gap > 0.0);
            }
        }
        let known = joints.into_iter().zip(&self.model.laws);
        let known = known.filter(|(joint, law)| joint.pairs > 0 && law.is_some());
        known.map(|(joint, _)| joint).collect()
    }

    /// Implements [`Simulation::contact_summary`](crate::Simulation::contact_summary).
    pub(crate) fn contact_summary(&self) -> ContactSummary {
        let counts = self.contact_counts();
        let mut slide: Vec<[usize; 2]> =
            self.contacts().iter().filter(|c| c.sliding).map(|c| c.blocks).collect();
        slide.dedup();
        ContactSummary {
            block_pairs: counts.block_pairs as u64,
            sliding: slide.len() as u64,
            open: (counts.near - counts.block_pairs) as u64,
            points: counts.points as u64,
            deepest: counts.deepest,
        }
    }

    /// Implements [`Simulation::fragment_summary`](crate::Simulation::fragment_summary).
    pub(crate) fn fragment_summary(&self) -> FragmentSummary {
        let fragments = self.fragments();
        FragmentSummary {
            number: fragments.len() as u64,
            largest_volume: fragments.first().map_or(0.0, |largest| largest.volume),
        }
    }

    fn reactions(&self) -> Vec<Reaction> {
        let mut forces = std::collections::BTreeMap::<usize, [f64; 3]>::new();
        for (support, reaction) in
            self.context.view.conditions.supports.iter().zip(&self.scratch.reactions)
        {
            forces.entry(support.fix as usize).or_default()[support.axis as usize] += reaction;
        }
        forces.into_iter().map(|(fix, force)| Reaction { fix, force }).collect()
    }
}
