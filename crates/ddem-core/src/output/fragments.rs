//! Fragments: groups of blocks that bonded joints hold together.

use std::cmp::Reverse;
use std::ops::Range;

use super::Snapshot;
use crate::model::joint_state::JointState;
use ddem_mechanics::math::disjoint_sets::DisjointSets;
use ddem_mesh::Vec3;

/// Number of steps into which the volume of the model is divided to compare fragments. Fragments of
/// equal blocks differ only by rounding.
const VOLUME_STEPS: f64 = 1e12;

/// Group of blocks that joints hold together and that no joint holds to other blocks.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Fragment {
    /// Numbers of its blocks, in order.
    pub blocks: Vec<usize>,
    /// Volume of its blocks in the reference position, without joints `[m³]`.
    pub volume: f64,
    /// Mass, including half the mass of the joints around each block `[kg]`.
    pub mass: f64,
    /// Cumulative passing: fraction of the model's mass in fragments that are not larger.
    pub passing: f64,
    /// Present centre of mass `[m]`.
    pub centroid: [f64; 3],
    /// Present velocity of the centre of mass `[m/s]`; zero in a relaxation.
    pub velocity: [f64; 3],
}

impl Fragment {
    /// Names of [`values`](Self::values).
    pub const NAMES: [&'static str; 11] = [
        "blocks",
        "volume",
        "mass",
        "size",
        "passing",
        "centroid.x",
        "centroid.y",
        "centroid.z",
        "velocity.x",
        "velocity.y",
        "velocity.z",
    ];

    /// Equivalent size: edge of a cube of equal volume, `V^(1/3)` `[m]`.
    #[must_use]
    pub fn size(&self) -> f64 {
        libm::cbrt(self.volume)
    }

    /// Number of blocks and the other values, in the order of [`NAMES`](Self::NAMES).
    #[must_use]
    pub fn values(&self) -> [f64; 11] {
        let ([x, y, z], [u, v, w]) = (self.centroid, self.velocity);
        let blocks = self.blocks.len() as f64;
        [blocks, self.volume, self.mass, self.size(), self.passing, x, y, z, u, v, w]
    }
}

/// Writes the fragment number of each element.
pub(super) fn fragment(snapshot: &Snapshot<'_>, range: Range<usize>, out: &mut [f64]) {
    let numbers = snapshot.numbers();
    snapshot.model.fill_elements(range, out, |block| {
        let number = numbers[block] as f64;
        move |_| [number]
    });
}

impl Snapshot<'_> {
    /// Implements [`Simulation::fragments`](crate::Simulation::fragments).
    pub(crate) fn fragments(&self) -> Vec<Fragment> {
        let mut fragments = self.bare_fragments();
        let mut numbers = vec![fragments.len(); self.model.n_blocks()];
        for (number, fragment) in fragments.iter().enumerate() {
            fragment.blocks.iter().for_each(|&block| numbers[block] = number);
        }
        let mut sums = vec![(0.0, [Vec3::zeros(); 2]); fragments.len()];
        self.each_mass(|block, mass, x, v, _| {
            let Some((all, [first, momentum])) = sums.get_mut(numbers[block]) else { return };
            *all += mass;
            *first += x * mass;
            *momentum += v * mass;
        });
        for (fragment, (mass, sums)) in fragments.iter_mut().zip(sums) {
            fragment.mass = mass;
            [fragment.centroid, fragment.velocity] = sums.map(|sum| (sum / mass).into());
        }
        self.pass(&mut fragments);
        for fragment in &mut fragments {
            let parts = std::mem::take(&mut fragment.blocks);
            fragment.blocks = parts.into_iter().map(|part| self.model.whole_block(part)).collect();
            fragment.blocks.sort_unstable();
            fragment.blocks.dedup();
        }
        fragments
    }

    /// Implements [`Simulation::block_fragments`](crate::Simulation::block_fragments).
    pub(crate) fn block_fragments(&self) -> Vec<usize> {
        let fragments = self.bare_fragments();
        let mut numbers = vec![fragments.len(); self.model.n_blocks()];
        for (number, fragment) in fragments.into_iter().enumerate() {
            fragment.blocks.into_iter().for_each(|block| numbers[block] = number);
        }
        numbers
    }

    /// Fragments by decreasing volume, with only their blocks and volumes set.
    fn bare_fragments(&self) -> Vec<Fragment> {
        let n = self.model.n_blocks();
        let mut groups = DisjointSets::new(n);
        let joint_states =
            self.model.joint_states(&self.scratch.measured_joints, &self.scratch.measured_contacts);
        joint_states.filter(JointState::holds).for_each(|joint| groups.join(joint.blocks));
        self.model.tied_blocks().for_each(|blocks| groups.join(blocks));
        let mut fragments: Vec<Fragment> = vec![Fragment::default(); n];
        for block in (0..n).filter(|&block| !self.model.is_removed(block)) {
            let fragment = &mut fragments[groups.lowest(block)];
            fragment.volume += self.model.volume(block);
            fragment.blocks.push(block);
        }
        fragments.retain(|fragment| !fragment.blocks.is_empty());
        // The sort is stable: equal fragments stay in the order of their lowest blocks.
        let step = self.volume_step();
        fragments.sort_by_key(|fragment| Reverse(rank(fragment, step)));
        fragments
    }

    /// Sets the cumulative mass passing of each fragment.
    fn pass(&self, fragments: &mut [Fragment]) {
        let step = self.volume_step();
        let ranks: Vec<u64> = fragments.iter().map(|fragment| rank(fragment, step)).collect();
        let mut sums = vec![0.0; fragments.len()];
        let mut sum = 0.0;
        for (at, fragment) in fragments.iter().enumerate().rev() {
            sum += fragment.mass;
            sums[at] = sum;
        }
        for (at, fragment) in fragments.iter_mut().enumerate() {
            // Equal fragments follow each other, and the first has the sum of all of them.
            sums[at] = if at > 0 && ranks[at] == ranks[at - 1] { sums[at - 1] } else { sums[at] };
            fragment.passing = sums[at] / sum;
        }
    }

    fn volume_step(&self) -> f64 {
        self.model.volumes()[0] / VOLUME_STEPS
    }
}

/// Volume in steps, so that rounding does not separate equal fragments.
fn rank(fragment: &Fragment, step: f64) -> u64 {
    (fragment.volume / step).round() as u64
}
