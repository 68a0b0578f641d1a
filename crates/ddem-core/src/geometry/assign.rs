//! `[[assign]]`: the joints and materials that a part of the model has, in each stage.

use super::lattice::{Lattice, NO_JOINT};
use super::nothing::{no_block, no_joint};
use super::{Geometry, Names, Region, abut, nothing};
use crate::deck::names::segment;
use crate::deck::{Assign, Deck, Joint};
use crate::error::Fault;
use crate::touch::FaceOf;

/// The entries in force in a stage, with their numbers.
pub(super) fn in_force(deck: &Deck, stage: usize) -> impl Iterator<Item = (usize, &Assign)> {
    let now =
        move |entry: &Assign| deck.period(entry.from.as_ref(), entry.until.as_ref()).has(stage);
    deck.assign.iter().enumerate().filter(move |(_, entry)| now(entry))
}

/// Whether other entries are in force in a stage than in the one before.
pub(super) fn changes(deck: &Deck, stage: usize) -> bool {
    let name = deck.stage.get(stage).map(|entry| &entry.name);
    let at = |entry: &&Assign| [entry.from.as_ref(), entry.until.as_ref()].contains(&name);
    stage > 0 && deck.assign.iter().any(|entry| at(&entry))
}

/// Gives lattices the joints and materials that are in force in a stage. Returns the entries that found
/// neither a joint nor a block in them.
pub(super) fn assign(
    lattices: &mut [Lattice],
    (deck, names): (&Deck, &Names),
    stage: usize,
    region: &dyn Fn(&Assign) -> Region,
) -> Vec<usize> {
    let mut unused = Vec::new();
    for (index, entry) in in_force(deck, stage) {
        let region = region(entry);
        let mut found = false;
        for lattice in lattices.iter_mut().filter(|lattice| region.has_set(lattice.set)) {
            if let Some(joint) = entry.joint.as_ref().and_then(|name| names.joint(name)) {
                found |= lattice.assign_joint(&region, joint);
            }
            if let Some(material) = entry.material.as_ref().and_then(|n| names.material(n)) {
                found |= lattice.assign_material(&region, material);
            }
        }
        if !found {
            unused.push(index);
        }
    }
    unused
}

impl Geometry {
    /// Takes the joints and materials of a stage from `lattices`, which have none assigned yet. `self`
    /// has what was taken out by then.
    pub(super) fn assign_anew(
        &mut self,
        mut lattices: Vec<Lattice>,
        (deck, names): (&Deck, &Names),
        stage: usize,
    ) -> Vec<Fault> {
        let frame = self.frame.clone();
        let region = |entry: &Assign| Region::new(&entry.region, &frame);
        let unused = assign(&mut lattices, (deck, names), stage, &region);
        let before = self.clone();
        for (own, new) in self.lattices.iter_mut().zip(lattices) {
            (own.joint, own.material) = (new.joint, new.material);
        }
        for body in &mut self.bodies {
            let lattice = &self.lattices[body.lattice as usize];
            body.material = lattice.material[lattice.index(body.cell.map(|c| c as usize))];
        }
        [self.abutments, self.apart] = abut::abutments(self, (deck, names, stage));
        // Joints do not come, nor back, in a run: what is in contact stays so.
        self.abutments.retain(|abutment| before.joint_of(abutment.blocks).is_some());
        self.abutting = abut::abutting(&self.abutments);
        let mut faults = self.unused(deck, &unused, &region);
        faults.extend(self.changed(&before, (deck, names), stage));
        faults
    }

    /// Whether a block has another material or other joints than before.
    pub(crate) fn differs(&self, before: &Self, block: usize) -> bool {
        let joints = |geometry: &Self| {
            let number = |k: u8| {
                let abuts = geometry.abutting.get(&(block as u32, k));
                abuts
                    .map(|abuts| abuts.joint)
                    .or_else(|| geometry.joint_at(block, FaceOf::of_number(k)))
            };
            [0, 1, 2, 3, 4, 5].map(number)
        };
        self.bodies[block].material != before.bodies[block].material
            || joints(self) != joints(before)
    }

    /// The joint of two blocks whose faces do not match, if there is one.
    pub(crate) fn joint_of(&self, blocks: [u32; 2]) -> Option<u16> {
        let at = self.abutments.binary_search_by_key(&blocks, |abutment| abutment.blocks);
        at.ok().map(|at| self.abutments[at].joint)
    }

    /// Takes joints and materials from what is where in another stage.
    pub(super) fn assign_as(&mut self, other: &Self) {
        for (own, other) in self.lattices.iter_mut().zip(&other.lattices) {
            (own.joint, own.material) = (other.joint.clone(), other.material.clone());
        }
        for (own, other) in self.bodies.iter_mut().zip(&other.bodies) {
            own.material = other.material;
        }
        for abutment in &mut self.abutments {
            abutment.joint = other.joint_of(abutment.blocks).unwrap_or(abutment.joint);
        }
        self.abutting = abut::abutting(&self.abutments);
    }

    /// Faults of entries that found nothing in the lattices, nor between two of them.
    pub(super) fn unused(
        &self,
        deck: &Deck,
        unused: &[usize],
        region: &dyn Fn(&Assign) -> Region,
    ) -> Vec<Fault> {
        let fault = |&index: &usize| {
            let (entry, region) = (&deck.assign[index], region(&deck.assign[index]));
            (self.joins_at(&region) == 0).then(|| self.assigns_nothing(index, entry, &region))
        };
        unused.iter().filter_map(fault).collect()
    }

    /// What is said of an entry of `assign` without anything in its region.
    fn assigns_nothing(&self, index: usize, entry: &Assign, region: &Region) -> Fault {
        let place = format!("assign[{index}].where");
        match (&entry.joint, &entry.material) {
            (Some(_), Some(_)) => {
                no_block(nothing(place, "no joint and no block"), region, &self.lattices)
            }
            (Some(_), None) => no_joint(nothing(place, "no joint"), region, &self.lattices),
            _ => no_block(nothing(place, "no block"), region, &self.lattices),
        }
    }

    /// A fault where a joint becomes one of another thickness or elasticity: blocks, layers and springs
    /// stay what they are.
    fn changed(
        &self,
        before: &Self,
        (deck, names): (&Deck, &Names),
        stage: usize,
    ) -> Option<Fault> {
        let lattices = self.lattices.iter().zip(&before.lattices);
        let inside = lattices.flat_map(|(new, old)| {
            (0..3).flat_map(|d| old.joint[d].iter().copied().zip(new.joint[d].iter().copied()))
        });
        let number = |geometry: &Self, blocks| geometry.joint_of(blocks).unwrap_or(NO_JOINT);
        let blocks = self.abutments.iter().chain(&before.abutments).map(|a| a.blocks);
        let between = blocks.map(|blocks| (number(before, blocks), number(self, blocks)));
        let joint = |number: u16| deck.joints.values().nth(number.into());
        let (old, new) = inside.chain(between).find(|&(old, new)| {
            let same = |(a, b): (&Joint, &Joint)| {
                matter(deck, a) == matter(deck, b) && (b.breaks() || !a.breaks())
            };
            old != new && !joint(old).zip(joint(new)).is_some_and(same)
        })?;
        let now = Some(&deck.stage[stage].name);
        let changes = |entry: &Assign, joint: u16| {
            let number = entry.joint.as_ref().and_then(|name| names.joint(name));
            let begins = entry.from.as_ref() == now && number == Some(new);
            begins || (entry.until.as_ref() == now && number == Some(joint))
        };
        let any = |entry: &Assign| {
            entry.joint.is_some() && (entry.from.as_ref() == now || entry.until.as_ref() == now)
        };
        let all = || deck.assign.iter();
        let entry = all().position(|entry| changes(entry, old)).or_else(|| all().position(any));
        let place = entry.map_or("assign".to_owned(), |entry| format!("assign[{entry}].joint"));
        let [Some(old), Some(new)] = [old, new].map(|joint| (joint != NO_JOINT).then_some(joint))
        else {
            let message = "joints do not come and go in a run: blocks that touch without one of their own \
                           are in contact";
            let help = "give the sets a `joint`, or assign one without `until`";
            return Some(Fault::new(place, message).help(help));
        };
        let said = |number: u16| {
            let (thickness, stiffness, density, _) = matter(deck, joint(number)?);
            let [normal, shear] = stiffness.unwrap_or_default();
            let density = density.map_or_else(String::new, |density| format!(", {density} kg/m³"));
            let name = segment(names.joint_name(number));
            Some(format!("`{name}` ({thickness} m, {normal:e} and {shear:e} Pa/m{density})"))
        };
        let [old_number, new_number] = [old, new];
        let [old, new] = [old, new].map(|number| said(number).unwrap_or_default());
        let stage = &deck.stage[stage].name;
        let message = format!("{new} takes the place of {old} as stage `{stage}` begins");
        let stay = joint(old_number).zip(joint(new_number));
        let help = if stay.is_some_and(|(a, b)| matter(deck, a) == matter(deck, b)) {
            "a joint that can fail cannot become one that never does: give that one a cohesion, a friction and \
             a tension, so that it is known what failed pairs bear"
        } else {
            "only strengths of joints change as a run goes: thickness, stiffness and density stay"
        };
        Some(Fault::new(place, message).help(help))
    }
}

/// Thickness `[m]`, stiffnesses `[Pa/m]` and density `[kg/m³]` of a joint, and whether it is springs.
fn matter(deck: &Deck, joint: &Joint) -> (f64, Option<[f64; 2]>, Option<f64>, bool) {
    let named = joint.material.as_ref().and_then(|name| deck.materials.get(name));
    let density = named.map(|material| material.density).or(joint.density);
    (joint.thickness, joint.stiffness(&deck.materials), density, joint.normal_stiffness.is_some())
}
