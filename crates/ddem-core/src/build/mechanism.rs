//! Relax stages whose supports leave a rigid motion free.

use super::Site;
use super::geometry::interface::ajar;
use crate::conditions::{Active, Applied, Conditions};
use crate::deck::{Stage, StageKind};
use crate::error::Fault;
use crate::geometry::{Geometry, Stages};
use crate::mechanism::{FreeMotion, free_motion};
use crate::model::Model;
use crate::pack::Packs;
use crate::simulation::Simulation;

/// A fault for each relax stage in which a group of joined blocks can move as a rigid body.
pub(super) fn check(
    site: &Site,
    stages: &Stages,
    conditions: &Conditions,
    packs: &Packs,
) -> Vec<Fault> {
    let deck = &site.deck;
    let relax = deck.stage.iter().enumerate().filter(|(_, stage)| stage.kind == StageKind::Relax);
    let found = |(stage, entry): (usize, &Stage)| {
        let geometry = stages.at(stage);
        let active = Active::new(conditions, geometry, packs, stage, &Applied::default());
        let motion = free_motion(geometry, &active, deck.finds_contacts())?;
        let whose = format!("of relax stage `{}`", entry.name);
        Some(fault(site, geometry, &motion, (stage, &whose)))
    };
    relax.filter_map(found).collect()
}

impl Simulation {
    /// What is wrong with a relaxation under the supports in force: a rigid motion that they leave
    /// free.
    #[must_use]
    pub fn free_motion(&self) -> Option<Fault> {
        let Model { geometry, properties, .. } = &*self.model;
        let motion = free_motion(geometry, &self.view.active, properties.contact.search)?;
        Some(fault(self.model.site(), geometry, &motion, (0, "in force")))
    }
}

/// The fault of a stage; `whose` supports they are is for the message.
fn fault(
    site: &Site,
    geometry: &Geometry,
    motion: &FreeMotion,
    (stage, whose): (usize, &str),
) -> Fault {
    let who = match motion.block {
        None => "the model".to_owned(),
        Some(block) => {
            let set = site.deck.set_name(geometry.set(block));
            format!("block {block} of the set `{set}`, with what is joined to it,")
        }
    };
    let motions = motion.motions.join(", ");
    let message = format!("the supports {whose} let {who} move as a rigid body: {motions}");
    Fault::new(format!("stage[{stage}]"), message).help(help(site, geometry))
}

/// Suggests supports or joints that may be missing.
fn help(site: &Site, geometry: &Geometry) -> String {
    let hold = if site.deck.boundary.is_empty() {
        "hold that motion with [[fix]], or make the stage dynamic"
    } else {
        "a [[boundary]] holds nothing at rest: hold that motion with [[fix]], `until` the stage from \
         which the boundary is there; it keeps what the fix bore"
    };
    let mut help = ajar(site, geometry);
    help.push(hold.to_owned());
    help.join("; ")
}
