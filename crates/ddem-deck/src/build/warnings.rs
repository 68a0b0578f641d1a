//! Warnings about a model.

use std::collections::{BTreeMap, BTreeSet, HashSet};

use ddem_core::problem::{Conditions, TimeFunction, TimedCharge, Vec3};
use ddem_core::{ConformingJoint, ContactWarning, Model, counted};

use super::BuiltDeck;
use super::geometry::interface::{gaps, interfaces};
use super::geometry::{Interface, coordinates};
use super::rock::much_inertia;
use crate::lint::{Code, Diagnostic, load_at_rest};
use crate::schema::{Deck, StageKind, Where};

/// Pressure above which no gas is stored: such a charge is a blast `[Pa]`.
const BLAST: f64 = 1e8;

impl BuiltDeck {
    /// Diagnostics of a model of this deck, without those that the deck allows.
    #[must_use]
    pub fn warnings(&self, model: &Model) -> Vec<Diagnostic> {
        let mut warnings = Vec::new();
        if !model.can_meet() {
            warnings.extend(self.not_in_contact());
        }
        warnings.extend(self.loads_at_rest(model));
        warnings.extend(self.empty_sets());
        warnings.extend(much_inertia(&self.added_inertia(model)));
        warnings.extend(self.deck.many_triangles());
        warnings.extend(gaps(&self.deck, model.geometry()));
        warnings.extend(super::default_friction::warnings(&self.deck, model.geometry()));
        warnings.extend(self.unbalanced_stress(model));
        warnings.extend(self.unbalanced_weight(model));
        warnings.extend(held_joints(model));
        warnings.extend(self.partly_covered_faces());
        warnings.extend(self.charges.iter().flatten().cloned());
        warnings.extend(self.shared_cavities(model));
        warnings.extend(self.blasts_at_rest(model));
        warnings.extend(self.far_probes(model));
        warnings.extend(super::faces::in_cavities(&self.deck, &self.problem, &self.walls));
        warnings.extend(super::boundaries::warnings(&self.deck, &self.problem, &self.holds));
        warnings.extend(model.contact_warnings().into_iter().map(contact));
        let used = model.joint_numbers().collect();
        warnings.extend(crate::check::warnings(&self.deck, &used));
        warnings.retain(|warning| self.deck.reports(warning));
        warnings
    }

    fn loads_at_rest(&self, model: &Model) -> Vec<Diagnostic> {
        let stages = self.deck.stage.iter().enumerate();
        let relax = stages.filter(|(_, stage)| stage.kind == StageKind::Relax);
        let loads = relax.flat_map(|(index, stage)| {
            let loads = model.conditions().resting(index).into_iter();
            loads.map(|load| load_at_rest(load, &stage.name))
        });
        loads.collect()
    }

    /// Inertia that thin cells and sharp corners add to each set, relative to its mass.
    #[must_use]
    pub fn added_inertia(&self, model: &Model) -> Vec<f64> {
        let mut sums = vec![[0.0; 2]; self.deck.set_names().len()];
        for block in 0..model.n_blocks() {
            let Some(part) = model.geometry().part(block) else { continue };
            let volume = model.volume(block);
            let [added, whole] = &mut sums[model.geometry().set(block)];
            *added += (part.inertia - 1.0) * volume;
            *whole += volume;
        }
        let share = |[added, whole]: [f64; 2]| if added > 0.0 { added / whole } else { 0.0 };
        sums.into_iter().map(share).collect()
    }

    fn empty_sets(&self) -> impl Iterator<Item = Diagnostic> {
        let geometry = self.at_stage(None);
        let there: HashSet<usize> =
            (0..geometry.blocks.len()).map(|block| geometry.set(block)).collect();
        let empty = (0..self.deck.set_names().len()).filter(move |set| !there.contains(set));
        empty.map(|set| {
            let message =
                format!("`[[remove]]` removes all blocks of set `{}`", self.deck.set_name(set));
            let help = "`set` in its `where` limits it to one set";
            Diagnostic::warning(Code::EmptySet, self.deck.set_place(set), message, help)
        })
    }

    fn shared_cavities(&self, model: &Model) -> impl Iterator<Item = Diagnostic> {
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
        pairs.into_iter().map(|(first, second)| {
            let message = format!(
                "charges {first} and {second} push walls of one cavity; their gases are not coupled"
            );
            let help = "one charge with the mass of both exerts more pressure than the two";
            let at = format!("charge[{second}].where");
            Diagnostic::warning(Code::SharedCavity, at, message, help)
        })
    }

    fn blasts_at_rest(&self, model: &Model) -> impl Iterator<Item = Diagnostic> {
        in_statics(model.conditions(), &self.deck).into_iter().map(|(index, stage)| {
            let pressure = model.conditions().charged[index].charge.size.pressure;
            let stage = &self.deck.stage[stage].name;
            let message = format!("the charge exerts {pressure:.3e} Pa in relax stage `{stage}`");
            let help = "`from` names the stage at whose start it detonates";
            Diagnostic::warning(Code::BlastAtRest, format!("charge[{index}]"), message, help)
        })
    }

    fn far_probes(&self, model: &Model) -> impl Iterator<Item = Diagnostic> {
        self.deck.probe.iter().enumerate().filter_map(|(index, probe)| {
            let at = Vec3::from(probe.at?);
            let node = model.nearest_node(at.into());
            let found = Vec3::from(model.point(node));
            let (distance, edge) =
                ((found - at).norm(), model.geometry().longest_edge(model.block_of(node)));
            (distance > edge).then(|| {
                let message = format!(
                    "probe `{}` has no block at {}; it records the nearest node, at {}, {distance:.4} m away",
                    probe.name,
                    coordinates(at),
                    coordinates(found)
                );
                let help = "give a point of a block, in metres";
                Diagnostic::warning(Code::FarProbe, format!("probe[{index}].at"), message, help)
            })
        })
    }

    /// Sets that touch at the start: those that joints join, and those whose blocks meet as
    /// contacts.
    #[must_use]
    pub fn interfaces(&self) -> Vec<Interface> {
        interfaces(self.at_stage(None), &self.deck)
    }

    fn not_in_contact(&self) -> impl Iterator<Item = Diagnostic> {
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
            let message = format!(
                "sets `{}` and `{}` touch, but no joint joins them and no contacts are searched for",
                self.deck.set_name(i),
                self.deck.set_name(j)
            );
            let help = "`contact = true` lets their blocks meet";
            Diagnostic::warning(Code::SetsNotInContact, "model.contact", message, help)
        })
    }

    fn partly_covered_faces(&self) -> Vec<Diagnostic> {
        let loads = self.deck.load.iter().enumerate();
        let loads = loads.filter(|(_, load)| load.traction.is_some() || load.pressure.is_some());
        let loads =
            loads.map(|(index, load)| (format!("load[{index}].where"), &load.r#where, &load.from));
        let boundaries = self.deck.boundary.iter().enumerate();
        let boundaries = boundaries.map(|(index, entry)| {
            (format!("boundary[{index}].where"), &entry.r#where, &entry.from)
        });
        let left_out = |(at, selector, from): (String, &Where, &Option<String>)| {
            let geometry = self.at_stage(from.as_ref());
            let faces = self.selector(selector).covered_in_part(geometry);
            let [x, y, z] = faces.first()?.centre(geometry).into();
            let count = match faces.len() {
                1 => "1 face is left out, because other blocks cover it in part; it".to_owned(),
                n => format!(
                    "{n} faces are left out, because other blocks cover them in part; the first"
                ),
            };
            let message = format!("{count} is at ({x:.4}, {y:.4}, {z:.4})");
            let help = "cut the blocks so that each face is free or fully covered";
            Some(Diagnostic::warning(Code::PartlyCoveredFaces, at, message, help))
        };
        loads.chain(boundaries).filter_map(left_out).collect()
    }
}

/// Warnings about supports that hold both sides of joints that can fail, unless they hold both
/// blocks entirely. A plane or a range that reaches a joint selects the nodes on both of its sides.
fn held_joints(model: &Model) -> Vec<Diagnostic> {
    let mut warnings = Vec::new();
    let holds_all = |held: &HashSet<u32>, block: u32| {
        model.hexes(block as usize).flatten().all(|node| held.contains(&node))
    };
    for (index, nodes) in model.conditions().clamped() {
        let held: HashSet<u32> = nodes.iter().copied().collect();
        let is_held = |joint: &&ConformingJoint| {
            model.joint_can_fail(joint.joint)
                && joint
                    .pairs(model.geometry())
                    .all(|pair| pair.iter().all(|node| held.contains(node)))
                && [joint.a, joint.b].iter().any(|&block| !holds_all(&held, block))
        };
        let joints: Vec<&ConformingJoint> = model.faces().iter().filter(is_held).collect();
        if let Some(first) = joints.first() {
            let message = format!(
                "the fix holds both sides of {} that can fail, first between blocks {} and {}: they cannot slide \
                 or open",
                counted(joints.len(), "joint"),
                first.a,
                first.b
            );
            let at = format!("fix[{index}].where");
            let help = "a range that ends before the joint holds one side";
            warnings.push(Diagnostic::warning(Code::HeldJoint, at, message, help));
        }
    }
    warnings
}

/// Warning about a stiffness of contacts.
fn contact(warning: ContactWarning) -> Diagnostic {
    let given = |code: Code, shear: bool, given: f64, own: f64, effect: String| {
        let key = if shear { "shear_stiffness" } else { "normal_stiffness" };
        let help = format!(
            "leave out `{key}`, and contacts are as stiff as the faces; stiffnesses are in Pa/m"
        );
        let message = format!(
            "{given:e} Pa/m is {:.1e} times the stiffness of the faces in contact, {own:.2e} Pa/m: {effect}",
            given / own
        );
        Diagnostic::warning(code, format!("contact.{key}"), message, help)
    };
    match warning {
        ContactWarning::Stiff { shear, given: stiffness, own, step, without } => {
            let effect =
                format!("it limits the time step to {step:.2e} s ({without:.2e} s otherwise)");
            given(Code::StiffContact, shear, stiffness, own, effect)
        }
        ContactWarning::Soft { shear, given: stiffness, own } => {
            let effect = "blocks in contact sink into each other".to_owned();
            given(Code::SoftContact, shear, stiffness, own, effect)
        }
        ContactWarning::Sinks { fraction, density, stiffness } => {
            let message = format!(
                "under its own weight a block of {density} kg/m³ sinks {:.1} % of its edge into the one below: \
                 contacts have {stiffness:.2e} Pa/m",
                100.0 * fraction
            );
            let help = "check the units of `young` (Pa), `density` (kg/m³) and lengths (m), or increase \
                        `normal_stiffness`";
            Diagnostic::warning(Code::SoftContact, "contact.normal_stiffness", message, help)
        }
    }
}

/// Blasts without `from` that detonate in a relax stage before a dynamic one, each with that relax
/// stage.
fn in_statics(conditions: &Conditions, deck: &Deck) -> Vec<(usize, usize)> {
    let moves = |stage: &usize| deck.stage[*stage].kind == StageKind::Dynamic;
    let last = (0..deck.stage.len()).rfind(moves).unwrap_or(0);
    let time = |stage: usize| {
        let before = (0..stage).filter(moves);
        before.filter_map(|stage| deck.stage[stage].duration).sum::<f64>()
    };
    // A charge that has detonated earlier did so in a dynamic stage.
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
