//! Contacts that are allowed but perhaps not meant: far stiffer or softer than the blocks.

use super::{Skins, Surfaces, bound};
use crate::assembly::Assembly;
use crate::geometry::Geometry;
use crate::pack::Packs;
use crate::properties::Properties;

/// Times the blocks' own stiffness above which a given one only shortens the step.
const STIFF: f64 = 100.0;
/// Part by which it may shorten the step before something is said.
const SHORT: f64 = 0.1;
/// Times the blocks' own stiffness below which the blocks are no longer what they look like.
const SOFT: f64 = 1e-3;
/// Part of its edge by which a block may sink in under its own weight.
const SINKS: f64 = 0.01;

/// What is fixed in a model.
type Fixed<'a> = (&'a Geometry, &'a Packs, &'a Assembly);

impl Surfaces {
    /// What is to be said of the stiffness of contacts.
    pub(crate) fn doubts(&self, properties: &Properties, of: Fixed<'_>) -> Vec<String> {
        let contact = &properties.contact;
        let mut doubts = Vec::new();
        let sinks = self.skins.sinks(properties.gravity.norm(), SINKS);
        for (direction, key, given) in [
            (0, "normal_stiffness", contact.normal_stiffness),
            (1, "shear_stiffness", contact.shear_stiffness),
        ] {
            let Some(given) = given else { continue };
            let without = self.skins.without(direction);
            let [least, most] = without.range(direction);
            let own = if given > most { most } else { least };
            let times = given / own;
            let said = format!(
                "`{key}` in [contact], {given:e} Pa/m, is {times:.1e} times that of the \
                 faces that meet, {own:.2e} Pa/m"
            );
            let [step, before] = [&self.skins, &without].map(|skins| longest_step(skins, of));
            if times > STIFF || (times > 1.0 && step < SHORT * before) {
                doubts.push(format!(
                    "{said}: no time step may be longer than {step:.2e} s, without it {before:.2e} s"
                ));
            } else if times < SOFT && (direction == 1 || sinks.is_none()) {
                doubts.push(format!("{said}: blocks sink into each other where they meet"));
            }
        }
        doubts.extend(sinks.map(|[part, density, stiffness]| {
            format!(
                "contacts of {stiffness:.2e} Pa/m are soft: under its own weight a block of \
                 {density} kg/m³ sinks {:.1} % of its edge into what is below it",
                100.0 * part
            )
        }));
        doubts
    }
}

/// Longest step that undamped contacts leave, whatever the blocks are `[s]`.
fn longest_step(skins: &Skins, of: Fixed<'_>) -> f64 {
    let [more, rigid] = bound(skins, of);
    2.0 / more.max(rigid).sqrt()
}
