//! `[[assign]]`: joints and materials of parts of the model in each stage.

use std::sync::Arc;

use super::empty_selection::{no_block, no_joint, nothing};
use super::mesh;
use super::touching::{TouchingFaces, nonconforming_joints};
use super::{Names, Selector};
use crate::build::rock::AssignedRock;
use crate::schema::names::segment;
use crate::schema::{Assign, Deck, Joint};
use ddem_core::problem::{Geometry, Lattice, NO_JOINT, NonconformingJoint};
use ddem_core::{ErrorCode, Fault};

/// Entries in force in a stage, with their numbers.
pub(in crate::build) fn in_force(
    deck: &Deck,
    stage: usize,
) -> impl Iterator<Item = (usize, &Assign)> {
    let now = move |entry: &Assign| {
        deck.stage_range(entry.from.as_ref(), entry.until.as_ref()).has(stage)
    };
    deck.assign.iter().enumerate().filter(move |(_, entry)| now(entry))
}

/// True if an entry begins or ends at the start of a stage.
pub(super) fn changes(deck: &Deck, stage: usize) -> bool {
    let name = deck.stage.get(stage).map(|entry| &entry.name);
    let at = |entry: &&Assign| [entry.from.as_ref(), entry.until.as_ref()].contains(&name);
    stage > 0 && deck.assign.iter().any(|entry| at(&entry))
}

/// Assigns the joints and materials in force in a stage to lattices. Returns the entries that
/// select neither a joint nor a block of them.
pub(super) fn assign(
    lattices: &mut [Arc<Lattice>],
    (deck, names): (&Deck, &Names),
    stage: usize,
    selector: &dyn Fn(&Assign) -> Selector,
) -> Vec<usize> {
    let mut unused = Vec::new();
    for (index, entry) in in_force(deck, stage) {
        let selector = selector(entry);
        let mut found = false;
        for lattice in lattices.iter_mut().filter(|lattice| selector.has_set(lattice.set)) {
            let lattice = Arc::make_mut(lattice);
            if let Some(joint) = entry.joint.as_ref().and_then(|name| names.joint(name)) {
                found |= selector.assign_joint(lattice, joint);
            }
            if let Some(material) = entry.material.as_ref().and_then(|n| names.material(n)) {
                found |= selector.assign_material(lattice, material);
            }
        }
        if !found {
            unused.push(index);
        }
    }
    unused
}

/// Assigns the joints and materials of a stage to a geometry in which blocks may have been removed.
/// `lattices` are those of sets of blocks before any assignment.
pub(super) fn reassign(
    geometry: &mut Geometry,
    mut lattices: Vec<Arc<Lattice>>,
    rock: &AssignedRock<'_>,
    stage: usize,
) -> Vec<Fault> {
    let AssignedRock { deck, names, sets, .. } = *rock;
    let selector = |entry: &Assign| Selector::new(&entry.r#where, sets);
    let mut unused = assign(&mut lattices, (deck, names), stage, &selector);
    let before = geometry.clone();
    let mut other_materials = false;
    let of_sets = geometry.lattices.iter_mut().filter(|lattice| lattice.part.is_none());
    for (own, new) in of_sets.zip(lattices) {
        if own.joint == new.joint && own.material == new.material {
            continue;
        }
        let own = Arc::make_mut(own);
        for (own, new) in own.joint.iter_mut().zip(&new.joint).filter(|(own, new)| own != new) {
            own.clone_from(new);
        }
        if own.material != new.material {
            (own.material, other_materials) = (new.material.clone(), true);
        }
    }
    if other_materials {
        for block in Arc::make_mut(&mut geometry.blocks) {
            let lattice = &geometry.lattices[block.lattice as usize];
            block.material = lattice.material[lattice.index(block.cell.map(|c| c as usize))];
        }
    }
    let pairs = match mesh::joints(geometry, deck, names) {
        Ok(pairs) => pairs,
        Err(faults) => return faults,
    };
    let pairs = pairs.into_iter().map(|(blocks, (joint, _))| (blocks, joint)).collect();
    let [mut joined, unjoined] = nonconforming_joints(geometry, (deck, names, stage), sets, &pairs);
    // A run neither adds nor restores joints: blocks in contact stay in contact.
    joined.retain(|joint_pair| before.joint_of(joint_pair.blocks).is_some());
    join(geometry, joined);
    geometry.unjoined_faces = Arc::new(unjoined);
    let used = rock.assign(geometry, stage);
    unused.retain(|entry| !used.contains(entry));
    let mut faults = unused_faults(geometry, deck, &unused, &selector);
    faults.extend(changed(geometry, &before, (deck, names), stage));
    faults
}

/// Sets the joints between lattices, beside those between the cells of regions.
pub(super) fn join(geometry: &mut Geometry, between: Vec<NonconformingJoint>) {
    let touching = TouchingFaces(geometry);
    let within = geometry.nonconforming_joints.iter().copied();
    let within = within.filter(|joint_pair| touching.in_one_region(joint_pair.blocks));
    let mut joints: Vec<NonconformingJoint> = within.chain(between).collect();
    joints.sort_by_key(|joint_pair| joint_pair.blocks);
    geometry.join(joints);
}

/// Faults of entries that select nothing, neither in the lattices nor between two of them.
pub(super) fn unused_faults(
    geometry: &Geometry,
    deck: &Deck,
    unused: &[usize],
    selector: &dyn Fn(&Assign) -> Selector,
) -> Vec<Fault> {
    let fault = |&index: &usize| {
        let (entry, selector) = (&deck.assign[index], selector(&deck.assign[index]));
        (TouchingFaces(geometry).joins_at(&selector) == 0)
            .then(|| assigns_nothing(geometry, index, entry, &selector))
    };
    unused.iter().filter_map(fault).collect()
}

/// Fault of an `assign` that finds nothing.
fn assigns_nothing(
    geometry: &Geometry,
    index: usize,
    entry: &Assign,
    selector: &Selector,
) -> Fault {
    let place = format!("assign[{index}].where");
    match (&entry.joint, &entry.material) {
        (Some(_), Some(_)) => {
            no_block(nothing(place, "no joint and no block"), selector, &geometry.lattices)
        }
        (Some(_), None) => no_joint(nothing(place, "no joint"), selector, &geometry.lattices),
        _ => no_block(nothing(place, "no block"), selector, &geometry.lattices),
    }
}

/// Fault of a joint that is replaced by one of another thickness or elasticity. Blocks, layers and
/// springs cannot change.
fn changed(
    geometry: &Geometry,
    before: &Geometry,
    (deck, names): (&Deck, &Names),
    stage: usize,
) -> Option<Fault> {
    let lattices = geometry.lattices.iter().zip(&before.lattices);
    let inside = lattices.flat_map(|(new, old)| {
        (0..3).flat_map(|d| old.joint[d].iter().copied().zip(new.joint[d].iter().copied()))
    });
    let number = |geometry: &Geometry, blocks| geometry.joint_of(blocks).unwrap_or(NO_JOINT);
    let blocks = geometry.joined().chain(before.joined()).map(|a| a.blocks);
    let between = blocks.map(|blocks| (number(before, blocks), number(geometry, blocks)));
    let joint = |number: u16| deck.joints.values().nth(number.into());
    let (old, new) = inside.chain(between).find(|&(old, new)| {
        let same = |(a, b): (&Joint, &Joint)| {
            matter(deck, a) == matter(deck, b) && (b.can_fail() || !a.can_fail())
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
        let message = "a run cannot add or remove joints: blocks that touch without a joint \
                       are in contact";
        let help = "give the sets a `joint`, or assign one without `until`";
        return Some(Fault::new(ErrorCode::NotSupported, place, message).help(help));
    };
    let described = |number: u16| {
        let (thickness, stiffness, density, _) = matter(deck, joint(number)?);
        let [normal, shear] = stiffness.unwrap_or_default();
        let density = density.map_or_else(String::new, |density| format!(", {density} kg/m³"));
        let name = segment(names.joint_name(number));
        Some(format!("`{name}` ({thickness} m, {normal:e} and {shear:e} Pa/m{density})"))
    };
    let [old_number, new_number] = [old, new];
    let [old, new] = [old, new].map(|number| described(number).unwrap_or_default());
    let stage = &deck.stage[stage].name;
    let message = format!("{new} takes the place of {old} as stage `{stage}` begins");
    let stay = joint(old_number).zip(joint(new_number));
    let help = if stay.is_some_and(|(a, b)| matter(deck, a) == matter(deck, b)) {
        "a joint that can fail cannot become one that never does: give that one a cohesion, a friction and \
         a tension, so that the strength of failed pairs is known"
    } else {
        "only strengths of joints can change during a run: thickness, stiffness and density cannot"
    };
    Some(Fault::new(ErrorCode::NotSupported, place, message).help(help))
}

/// Thickness `[m]`, stiffnesses `[Pa/m]` and density `[kg/m³]` of a joint; true if it consists of
/// springs.
fn matter(deck: &Deck, joint: &Joint) -> (f64, Option<[f64; 2]>, Option<f64>, bool) {
    let named = joint.material.as_ref().and_then(|name| deck.materials.get(name));
    let density = named.map(|material| material.density).or(joint.density);
    (joint.thickness, joint.stiffness(&deck.materials), density, joint.normal_stiffness.is_some())
}
