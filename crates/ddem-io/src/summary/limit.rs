//! Block, joint or contact that limits the time step, and the shape of cells.

use std::fmt;

use ddem_core::{Limiter, Model, StepLimit};
use ddem_deck::{BuiltDeck, Deck};
use serde::{Deserialize, Serialize};

use super::table::{quantity, vector};

/// Limit of the critical time step.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TimeStepLimit {
    /// Kind of the part of the model: `block`, `joint`, `contacts`, `rigid block` or `charge`.
    pub kind: String,
    /// Numbers of its blocks.
    pub blocks: Vec<u64>,
    /// Names of the sets of these blocks.
    pub sets: Vec<String>,
    /// Name of the joint.
    pub joint: Option<String>,
    /// Number of the charge.
    pub charge: Option<u64>,
    /// Material of the block.
    pub material: Option<String>,
    /// Shortest edge of the block `[m]`.
    pub shortest_edge: Option<f64>,
    /// Least width of a block of a region `[m]`.
    pub width: Option<f64>,
    /// Critical step `[s]`.
    pub step: f64,
}

impl TimeStepLimit {
    pub(crate) fn new(limit: StepLimit, model: &Model, deck: &Deck) -> Self {
        let StepLimit { limiter, step } = limit;
        let found = Self { step, ..Self::default() };
        let one = |kind: &str, block: usize| {
            let width = model.geometry().part(block).map(|part| part.width);
            let edge = model.geometry().shortest_edge(block);
            let material = deck.materials.keys().nth(usize::from(model.material(block))).cloned();
            let shortest_edge = Some(edge).filter(|_| width.is_none());
            Self { kind: kind.to_owned(), material, shortest_edge, width, ..found.clone() }
                .of_blocks(model, &[block])
        };
        match limiter {
            Limiter::Block(block) => one("block", block),
            Limiter::RigidBlock(block) => one("rigid block", block),
            Limiter::Contacts(block) => one("contacts", block),
            Limiter::Joint { joint, blocks } => {
                let joint = model.problem().properties.joints.get(usize::from(joint));
                let joint = joint.map(|joint| joint.name.clone());
                Self { kind: "joint".to_owned(), joint, ..found }.of_blocks(model, &blocks)
            }
            Limiter::Charge(charge) => {
                Self { kind: "charge".to_owned(), charge: Some(charge as u64), ..found }
            }
        }
    }

    fn of_blocks(self, model: &Model, blocks: &[usize]) -> Self {
        let sets = blocks.iter().map(|&block| model.set_name(block)).collect();
        let blocks = blocks.iter().map(|&block| model.whole_block(block) as u64).collect();
        Self { blocks, sets, ..self }
    }

    /// Name of the part of the model.
    fn part(&self) -> String {
        let of = |(number, set): (&u64, &String)| format!("block {number} (set `{set}`)");
        let blocks: Vec<String> = self.blocks.iter().zip(&self.sets).map(of).collect();
        let blocks = blocks.join(" and ");
        match (&*self.kind, &self.joint, self.charge) {
            ("joint", Some(joint), _) => format!("joint `{joint}` between {blocks}"),
            ("charge", _, Some(charge)) => format!("the gas of charge {charge}"),
            ("contacts", ..) => format!("contacts of {blocks}"),
            ("rigid block", ..) => format!("joints and contacts of rigid {blocks}"),
            _ => blocks,
        }
    }
}

impl fmt::Display for TimeStepLimit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.part())?;
        if let Some(width) = self.width {
            write!(f, ", width {}", quantity(width, "m"))?;
        }
        if let Some(edge) = self.shortest_edge {
            write!(f, ", shortest edge {}", quantity(edge, "m"))?;
        }
        if let Some(material) = &self.material {
            write!(f, ", material `{material}`")?;
        }
        Ok(())
    }
}

/// Element with the least scaled Jacobian of all cells of regions and slanted blocks.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct WorstElement {
    /// Least scaled Jacobian at its corners: 1 with right angles, 0 without volume.
    pub scaled_jacobian: f64,
    /// Number of its block.
    pub block: u64,
    /// Name of the set of its block.
    pub set: String,
    /// Mean of its corners `[m]`.
    pub point: [f64; 3],
}

impl WorstElement {
    pub(crate) fn new(model: &Model) -> Option<Self> {
        let worst = model.worst_element()?;
        Some(Self {
            scaled_jacobian: worst.scaled_jacobian,
            block: model.whole_block(worst.block) as u64,
            set: model.set_name(worst.block),
            point: worst.point,
        })
    }
}

impl fmt::Display for WorstElement {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { scaled_jacobian, block, set, point } = self;
        let at = vector(*point, "m");
        write!(f, "scaled Jacobian {scaled_jacobian:.4} in block {block} (set `{set}`) at {at}")
    }
}

/// Inertia that thin cells and sharp corners of a region have beside their mass.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct AddedInertia {
    /// Name of the region.
    pub region: String,
    /// Added inertia, as a part of the mass of the region.
    pub share: f64,
}

impl AddedInertia {
    /// Added inertia of each region that has any.
    pub(crate) fn of_regions(site: &BuiltDeck, model: &Model) -> Vec<Self> {
        let each = site.added_inertia(model).into_iter().enumerate();
        let each = each.filter(|(_, share)| *share > 0.0);
        let name = |set: usize| model.problem().sets.list[set].label.clone();
        each.map(|(set, share)| Self { region: name(set), share }).collect()
    }
}

impl fmt::Display for AddedInertia {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:.3} % of the mass of `{}`", 100.0 * self.share, self.region)
    }
}
