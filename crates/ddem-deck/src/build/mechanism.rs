//! Check for relax stages whose supports leave a rigid motion free.

use ddem_core::problem::{CellCount, FreeMotion, Geometry};
use ddem_core::{ErrorCode, Fault, Problem, Simulation};

use super::BuiltDeck;
use super::geometry::interface::gaps;
use crate::schema::{Deck, StageKind};

/// Faults of the relax stages in which a group of joined blocks can move as a rigid body.
pub(super) fn check(deck: &Deck, problem: &Problem) -> Vec<Fault> {
    let (mut faults, mut known) = (Vec::new(), None);
    for (stage, entry) in deck.stage.iter().enumerate() {
        known = known.filter(|_| problem.is_unchanged(stage));
        if entry.kind != StageKind::Relax {
            continue;
        }
        if let Some(motion) = known.get_or_insert_with(|| problem.free_motion(stage)) {
            let whose = format!("of relax stage `{}`", entry.name);
            faults.push(fault(deck, problem.stages.at(stage), motion, (stage, &whose)));
        }
    }
    faults
}

impl BuiltDeck {
    /// Fault of a relaxation if the supports in force leave a rigid motion free.
    #[must_use]
    pub fn free_motion(&self, simulation: &Simulation) -> Option<Fault> {
        let motion = simulation.free_motion()?;
        Some(fault(&self.deck, simulation.model().geometry(), &motion, (0, "in force")))
    }
}

/// Fault of a stage; `whose` names the supports in the message.
fn fault(
    deck: &Deck,
    geometry: &Geometry,
    motion: &FreeMotion,
    (stage, whose): (usize, &str),
) -> Fault {
    let who = match motion.block {
        None => "the model".to_owned(),
        Some(block) => {
            let set = deck.set_name(geometry.set(block));
            let block = CellCount::new(geometry).whole_block(geometry, block);
            format!("block {block} of the set `{set}`, with what is joined to it,")
        }
    };
    let motions = motion.motions.join(", ");
    let message = format!("the supports {whose} let {who} move as a rigid body: {motions}");
    Fault::new(ErrorCode::Mechanism, format!("stage[{stage}]"), message).help(help(
        deck,
        geometry,
        motion.block.is_some(),
    ))
}

/// Advice on supports or, if only a part of the model moves, on joints that may be missing.
fn help(deck: &Deck, geometry: &Geometry, part: bool) -> String {
    let advice = if deck.boundary.is_empty() {
        "prevent this motion with `[[fix]]`, or make the stage dynamic"
    } else {
        "a `[[boundary]]` holds nothing at rest: prevent this motion with `[[fix]]`, `until` the stage from \
         which the boundary is there; it keeps the reaction of the support"
    };
    let gaps = gaps(deck, geometry).into_iter().map(|gap| gap.message);
    let units = part.then(|| {
        "if a joint should hold it, check its place and that all lengths are in metres".to_owned()
    });
    gaps.chain([advice.to_owned()]).chain(units).collect::<Vec<_>>().join("; ")
}
