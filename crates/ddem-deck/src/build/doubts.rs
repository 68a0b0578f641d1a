//! Warnings about a model.

use std::collections::{BTreeMap, BTreeSet, HashSet};

use ddem_core::problem::{Conditions, TimeFunction, TimedCharge, Vec3};
use ddem_core::{ConformingJoint, ContactWarning, Model};

use super::BuiltDeck;
use super::geometry::interface::{ajar, interfaces};
use super::geometry::{Interface, place};
use crate::schema::{Deck, StageKind, Where};

/// A pressure above which no gas is stored `[Pa]`.
const BLAST: f64 = 1e8;

impl BuiltDeck {
    /// Warnings: settings that are allowed but perhaps not meant, of a model of this site.
    #[must_use]
    pub fn warnings(&self, model: &Model) -> Vec<String> {
        let mut warnings = Vec::new();
        if !model.can_meet() {
            warnings.extend(self.apart());
        }
        for (index, stage) in self.deck.stage.iter().enumerate() {
            if stage.kind != StageKind::Relax {
                continue;
            }
            for load in model.conditions().resting(index) {
                warnings.push(format!(
                    "load {load} does not act in relax stage `{}`: time stands still there, and \
                     its history begins at 0",
                    stage.name
                ));
            }
        }
        warnings.extend(self.empty());
        warnings.extend(ajar(&self.deck, model.geometry()));
        warnings.extend(self.unbalanced(model));
        warnings.extend(self.unborne(model));
        warnings.extend(glued(model));
        warnings.extend(self.left_out());
        let charges = self.charges.iter().enumerate();
        warnings.extend(charges.flat_map(|(index, doubts)| {
            doubts.iter().map(move |doubt| format!("charge {index}: {doubt}"))
        }));
        warnings.extend(self.crowded(model));
        warnings.extend(self.blasts_at_rest(model));
        warnings.extend(self.far_probes(model));
        warnings.extend(super::boundaries::doubts(&self.deck, &self.problem, &self.holds));
        warnings.extend(model.contact_doubts().into_iter().map(contact_doubt));
        let used = model.joint_numbers().collect();
        warnings.extend(crate::check::doubts(&self.deck, &used));
        warnings
    }

    /// Sets of which no block is left.
    fn empty(&self) -> impl Iterator<Item = String> {
        let geometry = self.at_stage(None);
        let there: HashSet<usize> =
            (0..geometry.blocks.len()).map(|block| geometry.set(block)).collect();
        let empty = (0..self.deck.blocks.len()).filter(move |set| !there.contains(set));
        empty.map(|set| {
            format!(
                "no block of set `{}` is left: `[[remove]]` takes them all out (`set` in its `where` keeps \
                 it to one set)",
                self.deck.set_name(set)
            )
        })
    }

    /// Charges in one cavity.
    fn crowded(&self, model: &Model) -> Vec<String> {
        let mut whose: BTreeMap<Vec<u32>, usize> = BTreeMap::new();
        let mut pairs = BTreeSet::new();
        let charges = model.conditions().charged.iter().zip(&self.deck.charge).enumerate();
        for (index, (charged, _)) in charges.filter(|(_, (_, entry))| entry.until.is_none()) {
            for wall in charged.charge.walls() {
                let first = *whose.entry(wall).or_insert(index);
                if first != index {
                    pairs.insert((first, index));
                }
            }
        }
        let said = pairs.into_iter().map(|(i, j)| {
            format!(
                "charges {i} and {j} push walls of one cavity: each expands as if it were alone there; one \
                 charge with the mass of both is stronger than the two"
            )
        });
        said.collect()
    }

    /// Blasts in relax stages that only want to bring the weight on.
    fn blasts_at_rest(&self, model: &Model) -> impl Iterator<Item = String> {
        in_statics(model.conditions(), &self.deck).into_iter().map(|(index, stage)| {
            let pressure = model.conditions().charged[index].charge.size.pressure;
            format!(
                "charge {index} pushes with {pressure:.3e} Pa in relax stage `{}` already: `from` names the \
                 stage at whose start it goes off",
                self.deck.stage[stage].name
            )
        })
    }

    /// Probes at places where nothing is.
    fn far_probes(&self, model: &Model) -> impl Iterator<Item = String> {
        self.deck.probe.iter().filter_map(|probe| {
            let at = Vec3::from(probe.at?);
            let node = model.nearest_node(at.into());
            let found = Vec3::from(model.point(node));
            let (distance, edge) =
                ((found - at).norm(), model.geometry().longest_edge(model.block_of(node)));
            (distance > edge).then(|| {
                format!(
                    "probe `{}`: there is nothing at {}: it looks at the nearest node, at {}, {distance:.4} m \
                     away",
                    probe.name,
                    place(at),
                    place(found)
                )
            })
        })
    }

    /// Sets that touch at the start: those that joints join, and those whose blocks meet as contacts.
    #[must_use]
    pub fn interfaces(&self) -> Vec<Interface> {
        interfaces(self.at_stage(None), &self.deck)
    }

    /// Sets that touch where no contacts are found.
    fn apart(&self) -> impl Iterator<Item = String> {
        let geometry = self.at_stage(None);
        let sets = |[a, b]: [u32; 2]| [a, b].map(|block| geometry.set(block as usize));
        let joined: HashSet<[usize; 2]> =
            geometry.joined().map(|joint_pair| sets(joint_pair.blocks)).collect();
        let touching = geometry.touching.iter().copied();
        let touching: BTreeSet<[usize; 2]> =
            touching.map(|(i, j)| [i, j].map(|at| geometry.lattices[at].set)).collect();
        let apart = touching.into_iter().filter(move |&[i, j]| {
            i != j && !joined.contains(&[i, j]) && !joined.contains(&[j, i])
        });
        apart.map(|[i, j]| {
            format!(
                "sets `{}` and `{}` touch, but their blocks are not joined and do not meet: \
                 `contact = false` in [model] says that no contacts are looked for",
                self.deck.set_name(i),
                self.deck.set_name(j)
            )
        })
    }

    /// Faces that loads and boundaries leave out, because other blocks abut on a part of them.
    fn left_out(&self) -> Vec<String> {
        let loads = self.deck.load.iter().enumerate();
        let loads = loads.filter(|(_, load)| load.traction.is_some() || load.pressure.is_some());
        let loads =
            loads.map(|(index, load)| (format!("load {index}"), &load.region, load.from.as_ref()));
        let boundaries = self.deck.boundary.iter().enumerate();
        let boundaries = boundaries.map(|(index, entry)| {
            (format!("boundary {index}"), &entry.region, entry.from.as_ref())
        });
        let left_out = |(name, region, from): (String, &Where, Option<&String>)| {
            let geometry = self.at_stage(from);
            let faces = self.region(region).covered_in_part(geometry);
            let [x, y, z] = faces.first()?.centre(geometry).into();
            Some(format!(
                "{name} leaves out {} faces on a part of which other blocks stand, first that at ({x:.4}, \
                 {y:.4}, {z:.4}): cut the blocks so that their faces are free or covered as a whole",
                faces.len()
            ))
        };
        loads.chain(boundaries).filter_map(left_out).collect()
    }
}

/// Supports that hold both sides of joints which can fail, where one of the blocks is free
/// otherwise: a plane or a range that reaches a joint selects the nodes on both of its sides.
fn glued(model: &Model) -> Vec<String> {
    let mut warnings = Vec::new();
    let holds_all = |held: &HashSet<u32>, block: u32| {
        model.hexes(block as usize).flatten().all(|node| held.contains(&node))
    };
    for (index, nodes) in model.conditions().clamped() {
        let held: HashSet<u32> = nodes.iter().copied().collect();
        let is_held = |face: &&ConformingJoint| {
            model.joint_can_fail(face.joint)
                && face
                    .pairs(model.geometry())
                    .all(|pair| pair.iter().all(|node| held.contains(node)))
                && [face.a, face.b].iter().any(|&block| !holds_all(&held, block))
        };
        let glued: Vec<&ConformingJoint> = model.faces().iter().filter(is_held).collect();
        if let Some(first) = glued.first() {
            warnings.push(format!(
                "fix {index} holds both sides of {} joints that can fail, first between blocks \
                 {} and {}: they cannot slide or open (a range that ends before the joint holds \
                 one side)",
                glued.len(),
                first.a,
                first.b
            ));
        }
    }
    warnings
}

/// Warning about a stiffness of contacts.
fn contact_doubt(doubt: ContactWarning) -> String {
    let said = |shear: bool, given: f64, own: f64| {
        let key = if shear { "shear_stiffness" } else { "normal_stiffness" };
        format!(
            "`{key}` in [contact], {given:e} Pa/m, is {:.1e} times that of the \
             faces that meet, {own:.2e} Pa/m",
            given / own
        )
    };
    match doubt {
        ContactWarning::Stiff { shear, given, own, step, without } => format!(
            "{}: no time step may be longer than {step:.2e} s, without it {without:.2e} s",
            said(shear, given, own)
        ),
        ContactWarning::Soft { shear, given, own } => {
            format!("{}: blocks sink into each other where they meet", said(shear, given, own))
        }
        ContactWarning::Sinks { part, density, stiffness } => format!(
            "contacts of {stiffness:.2e} Pa/m are soft: under its own weight a block of \
             {density} kg/m³ sinks {:.1} % of its edge into what is below it",
            100.0 * part
        ),
    }
}

/// Blasts that are in force from the start and go off in a relax stage before a dynamic one: each with
/// that stage.
fn in_statics(conditions: &Conditions, deck: &Deck) -> Vec<(usize, usize)> {
    let moves = |stage: &usize| deck.stage[*stage].kind == StageKind::Dynamic;
    let last = (0..deck.stage.len()).rfind(moves).unwrap_or(0);
    let time = |stage: usize| {
        let before = (0..stage).filter(moves);
        before.filter_map(|stage| deck.stage[stage].duration).sum::<f64>()
    };
    // One that has gone off before has done so in motion.
    let goes_off = |charged: &TimedCharge, stage: usize| {
        let acts = match &charged.history {
            TimeFunction::Constant => true,
            TimeFunction::Given(history) => history.factor(0.0) != 0.0,
            TimeFunction::Computed(_) => false,
        };
        charged.in_force.has(stage) && time(stage) == charged.delay && acts
    };
    let first = |(index, charged): (usize, &TimedCharge)| {
        let size = &charged.charge.size;
        let blast = size.mass.is_some() || size.pressure >= BLAST;
        let mut still = (0..last).filter(|stage| !moves(stage));
        let found = still.find(|&stage| goes_off(charged, stage));
        found.filter(|_| blast && charged.in_force.from.is_none()).map(|stage| (index, stage))
    };
    conditions.charged.iter().enumerate().filter_map(first).collect()
}
