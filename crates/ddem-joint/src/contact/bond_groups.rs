//! Nonconforming joints that a contact replaces as one: the joint of two blocks, or all joints
//! between the parts of two cells.

use super::release::{JointLoad, JointStatus, PairMotion};
use super::{Configuration, Contacts, Patch};
use crate::point::PairContext;

/// Numbers of the patches of such joints.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct BondGroups {
    /// Patches with a joint, those of one group after another.
    patches: Vec<u32>,
    /// First of these patches of each group, shape `(groups + 1)`.
    starts: Vec<u32>,
}

impl BondGroups {
    pub(super) fn new(contacts: &Contacts) -> Self {
        let numbered =
            contacts.patches.iter().enumerate().filter(|(_, patch)| patch.bond.is_some());
        let mut keyed: Vec<([u32; 2], u32)> = numbered
            .map(|(i, patch)| (patch.blocks.map(|block| contacts.body(block)), i as u32))
            .collect();
        keyed.sort_unstable();
        let mut groups = Self { patches: Vec::with_capacity(keyed.len()), starts: vec![0] };
        for group in keyed.chunk_by(|a, b| a.0 == b.0) {
            groups.patches.extend(group.iter().map(|(_, patch)| patch));
            groups.starts.push(groups.patches.len() as u32);
        }
        groups
    }

    /// Number of groups.
    pub(super) fn len(&self) -> usize {
        self.starts.len().saturating_sub(1)
    }

    /// Numbers of the patches of a group.
    pub(super) fn of(&self, group: usize) -> &[u32] {
        &self.patches[self.starts[group] as usize..self.starts[group + 1] as usize]
    }
}

/// Status of joints that are replaced as one, according to the motion of all their pairs; `None`
/// unless it has advanced.
pub(super) fn advanced<'a>(
    patches: impl Iterator<Item = &'a Patch> + Clone,
    configuration: &Configuration<'_>,
    context: PairContext<'_>,
) -> Option<JointStatus> {
    // Pairs that have not failed have not moved.
    if patches.clone().all(|patch| patch.holds) {
        return None;
    }
    let (mut moved, mut bonded, mut rigid) = (PairMotion::default(), false, false);
    let (mut spacing, mut known) = (f64::INFINITY, JointStatus::InPlace);
    for patch in patches {
        let Some(bond) = patch.bond else { continue };
        let law = context.law(bond.law);
        let (own, any_bonded) = PairMotion::of(patch.pairs(), law);
        moved.merge(own);
        bonded |= any_bonded && law.is_none_or(|law| law.is_cohesive());
        rigid |= patch.blocks.iter().any(|&block| configuration.blocks[block as usize].rigid);
        spacing = spacing.min(patch.spacing(configuration));
        known = known.max(bond.status);
    }
    Some(moved.status(bonded, rigid, spacing)).filter(|found| *found > known)
}

/// Load of several joints on body a.
pub(super) fn load<'a>(
    patches: impl Iterator<Item = &'a Patch>,
    configuration: &Configuration<'_>,
) -> Option<JointLoad> {
    let mut loads = patches.map(|patch| patch.load(configuration));
    let mut sum = loads.next()?;
    for load in loads {
        sum.moment += load.moment + (load.about - sum.about).cross(&load.force);
        sum.force += load.force;
        sum.area += load.area;
        (0..2).for_each(|k| sum.energy[k] += load.energy[k]);
    }
    Some(sum)
}
