//! What a deck may say, but perhaps does not mean.

use std::collections::BTreeSet;

use super::shown;
use crate::deck::{Deck, Joint};

/// What is to be said of the joints that a model uses, by their numbers in sorted order of the
/// names.
pub(crate) fn doubts(deck: &Deck, used: &BTreeSet<u16>) -> Vec<String> {
    let numbered = deck.joints.iter().enumerate();
    let breaking: Vec<(&str, &Joint)> = numbered
        .filter(|(i, (_, joint))| {
            joint.breaks() && u16::try_from(*i).is_ok_and(|i| used.contains(&i))
        })
        .map(|(_, (name, joint))| (name.as_str(), joint))
        .collect();
    let mut doubts = Vec::new();
    if let Some((name, _)) = breaking.first()
        && deck.model.contact != Some(false)
    {
        doubts.push(format!(
            "joint `{name}` can fail, but this version finds no new contacts between blocks: the \
             two sides of a failed pair act on each other and on nothing else, however far they \
             move (`contact = false` in [model] says that this is meant)"
        ));
    } else if deck.model.contact == Some(true) {
        doubts.push(
            "`contact = true` has no effect: this version finds no new contacts between blocks"
                .to_owned(),
        );
    }
    for (name, joint) in breaking {
        doubts.extend(tension_out_of_reach(name, joint));
        doubts.extend(steep_dilation(name, joint));
    }
    doubts
}

/// In tension the strength in shear falls by tan φ per unit: at c/tan φ none is left.
fn tension_out_of_reach(name: &str, joint: &Joint) -> Option<String> {
    // Roughness has no cohesion, and gives no strength in shear under tension.
    if joint.jrc.is_some() {
        return None;
    }
    let (tension, cohesion) = (joint.tension?, joint.cohesion.unwrap_or(0.0));
    let slope = joint.friction.unwrap_or(0.0).to_radians().tan();
    let apex = if cohesion > 0.0 { cohesion / slope } else { 0.0 };
    // A tension that is meant to be the apex is off by rounding.
    (tension > apex * (1.0 + 1e-9)).then(|| {
        format!(
            "joint `{name}`: the tensile strength of {} Pa is reached only where nothing shears the \
             joint: no strength in shear is left at a tension of {} Pa, cohesion/tan(friction)",
            shown(tension),
            shown(format!("{apex:.3e}").parse().unwrap_or(apex))
        )
    })
}

/// Work of a slip s against a pressure σ is `σ s (tan φ_r − tan ψ)`.
fn steep_dilation(name: &str, joint: &Joint) -> Option<String> {
    let (dilation, residual) = (joint.dilation?, joint.residual_friction.or(joint.friction)?);
    (dilation > residual).then(|| {
        format!(
            "joint `{name}`: dilation, {} degrees, is above the friction that is left after \
             failure, {} degrees: sliding under pressure would yield energy instead of taking it",
            shown(dilation),
            shown(residual)
        )
    })
}
