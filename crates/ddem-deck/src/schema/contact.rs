//! Contacts between blocks that no joint holds together.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Deck, Joint, RockRegion};
use ddem_core::problem::DAMPING;

/// Restitution with critical damping if spring and dashpot together never pull, exp(−2).
pub(crate) const CRITICAL: f64 = 0.135_335_283_236_612_7;

/// Properties of contacts between blocks without a joint (docs/method.md, §9). Omitted stiffness
/// and friction are those of the two faces in contact.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ContactTable {
    /// Normal stiffness of all contacts, above 0 `[Pa/m]`; default that of the two faces.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub normal_stiffness: Option<f64>,
    /// Shear stiffness of all contacts, above 0 `[Pa/m]`; default that of the two faces.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shear_stiffness: Option<f64>,
    /// Friction angle of all contacts, in [0, 90) `[degrees]`; default that of the two faces,
    /// 30 if neither has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub friction: Option<f64>,
    /// Damping of contacts, failed pairs and the blocks around them as a fraction of critical, from
    /// 0 to 1; default 0.2, 0 while waves of a charge cross the model.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("default" = DAMPING))]
    pub damping: Option<f64>,
    /// Coefficient of restitution e of two blocks, from 0 to 1, instead of `damping`; default none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub restitution: Option<f64>,
}

impl ContactTable {
    /// True if no key is given.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }

    /// Damping ζ as a fraction of critical: `damping`, or the value that gives the `restitution` e
    /// of a mass on a spring and a dashpot that together never pull, `ln e = −2ζ acos ζ/√(1 − ζ²)`.
    /// Below e = exp(−2) it is critical. `None` if neither is given.
    #[must_use]
    pub fn damping_ratio(&self) -> Option<f64> {
        let Some(restitution) = self.restitution.filter(|_| self.damping.is_none()) else {
            return self.damping;
        };
        let rebound =
            |ratio: f64| libm::exp(-2.0 * ratio * libm::acos(ratio) / (1.0 - ratio * ratio).sqrt());
        if restitution <= CRITICAL {
            return Some(1.0);
        }
        // The rebound decreases monotonically.
        let (mut low, mut high) = (0.0, 1.0);
        while high - low > 1e-15 {
            let middle = 0.5 * (low + high);
            if rebound(middle) > restitution { low = middle } else { high = middle }
        }
        Some(low)
    }
}

impl Deck {
    /// Damping of contacts, failed pairs and the blocks around them, as a fraction of critical:
    /// that of `contact`, or its default. It does not act while waves of charges cross the model.
    #[must_use]
    pub fn damping_ratio(&self) -> f64 {
        self.contact.damping_ratio().unwrap_or(DAMPING)
    }

    /// True if new contacts are searched for. This is `model.contact`; by default it is true with
    /// more than one set of blocks, region or cell of a file, or with a used joint that can fail. A single set whose
    /// joints never fail stays together.
    #[must_use]
    pub fn finds_contacts(&self) -> bool {
        let any_can_fail = || self.used_joints().any(Joint::can_fail);
        let apart = |region: &RockRegion| region.n_file_cells() > 1 && !region.join;
        let found = || {
            self.blocks.len() + self.region.len() > 1
                || self.region.iter().any(apart)
                || any_can_fail()
        };
        self.model.contact.unwrap_or_else(found)
    }

    /// Joints that sets of blocks or assignments name, with repetitions.
    fn used_joints(&self) -> impl Iterator<Item = &Joint> {
        let of_sets = self.blocks.iter().flat_map(|set| set.joints().into_iter().flatten());
        let assigned = self.assign.iter().filter_map(|entry| entry.joint.as_deref());
        let of_cuts = self.cut.iter().filter_map(|cut| cut.joint.as_deref());
        let of_files = self.region.iter().filter_map(|region| region.joint.as_deref());
        of_sets
            .chain(assigned)
            .chain(of_cuts)
            .chain(of_files)
            .filter_map(|name| self.joints.get(name))
    }
}
