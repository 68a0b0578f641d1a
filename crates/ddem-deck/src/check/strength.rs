//! Checks of joint strengths: ranges of numbers, combinations of keys, and residual values below
//! peaks.

use super::{ErrorCode, Faults, Rule, shown};
use crate::schema::{Deck, Joint};
/// Largest friction angle that roughness gives `[degrees]` (Barton's limit).
const STEEPEST: f64 = 70.0;

pub(super) fn check(deck: &Deck, at: &str, joint: &Joint, faults: &mut Faults) {
    let sound = ranges(at, joint, faults);
    if !joint.can_fail() {
        without_strength(at, joint, faults);
    } else if joint.jrc.is_some() || joint.jcs.is_some() {
        barton(at, &sound, faults);
    } else {
        residuals(at, &sound, faults);
        softening(deck, at, &sound, faults);
    }
}

/// Checks each number alone. Returns the joint with NaN in place of numbers that break their rule.
/// Comparisons with NaN are false, so a mistake is not reported twice.
fn ranges(at: &str, joint: &Joint, faults: &mut Faults) -> Joint {
    let mut sound = joint.clone();
    let angle = Rule::From(0.0, 90.0);
    for (key, value, rule) in [
        ("cohesion", &mut sound.cohesion, Rule::ZeroOrMore),
        ("friction", &mut sound.friction, angle),
        ("tension", &mut sound.tension, Rule::ZeroOrMore),
        ("residual_cohesion", &mut sound.residual_cohesion, Rule::ZeroOrMore),
        ("residual_friction", &mut sound.residual_friction, angle),
        ("dilation", &mut sound.dilation, angle),
        ("jrc", &mut sound.jrc, Rule::Within(0.0, 20.0)),
        ("jcs", &mut sound.jcs, Rule::AboveZero),
    ] {
        if !faults.optional(format!("{at}.{key}"), *value, rule) {
            *value = Some(f64::NAN);
        }
    }
    for (i, energy) in sound.fracture_energy.iter_mut().flatten().enumerate() {
        if !faults.number(format!("{at}.fracture_energy[{i}]"), *energy, Rule::ZeroOrMore) {
            *energy = f64::NAN;
        }
    }
    sound
}

/// Keys of the behaviour after failure, each with true if it is given.
fn keys_of_failure(joint: &Joint) -> [(&'static str, bool); 4] {
    [
        ("residual_cohesion", joint.residual_cohesion.is_some()),
        ("residual_friction", joint.residual_friction.is_some()),
        ("dilation", joint.dilation.is_some()),
        ("fracture_energy", joint.fracture_energy.is_some()),
    ]
}

fn without_strength(at: &str, joint: &Joint, faults: &mut Faults) {
    for (key, _) in keys_of_failure(joint).iter().filter(|(_, given)| *given) {
        faults.add_help(
            ErrorCode::IneffectiveKey,
            format!("{at}.{key}"),
            format!("`{key}` has no effect: the joint never fails"),
            "a joint with none of `cohesion`, `friction`, `tension`, `jrc` and `jcs` never fails",
        );
    }
}

/// Checks that residual strength and dilation do not exceed the peak strength.
fn residuals(at: &str, joint: &Joint, faults: &mut Faults) {
    for (key, value, peak_key, peak) in [
        ("residual_cohesion", joint.residual_cohesion, "cohesion", joint.cohesion),
        ("residual_friction", joint.residual_friction, "friction", joint.friction),
        ("dilation", joint.dilation, "friction", joint.friction),
    ] {
        let Some(value) = value.filter(|value| *value > peak.unwrap_or(0.0)) else { continue };
        let peak = match peak {
            Some(peak) => format!("which is {}", shown(peak)),
            None => "which is 0 if not given".to_owned(),
        };
        let message = format!("`{key}` is {}, above `{peak_key}`, {peak}", shown(value));
        faults.add(ErrorCode::OutOfRange, format!("{at}.{key}"), message);
    }
}

/// Checks the keys of Barton's law: three numbers that need each other and exclude the
/// keys of the Mohr–Coulomb law.
fn barton(at: &str, joint: &Joint, faults: &mut Faults) {
    let first = if joint.jrc.is_some() { "jrc" } else { "jcs" };
    let law = "with `jrc` and `jcs` the strength in shear is \
               σ_n tan(φ_r + JRC log10(JCS/σ_n)), and `residual_friction` is φ_r; only `tension` \
               and `dilation` may be given besides";
    for (key, given) in [
        ("cohesion", joint.cohesion.is_some()),
        ("friction", joint.friction.is_some()),
        ("residual_cohesion", joint.residual_cohesion.is_some()),
        ("fracture_energy", joint.fracture_energy.is_some()),
    ] {
        if given {
            let message = format!("`{key}` cannot be combined with `{first}`");
            faults.add_help(ErrorCode::ConflictingKeys, format!("{at}.{key}"), message, law);
        }
    }
    for (key, value) in
        [("jrc", joint.jrc), ("jcs", joint.jcs), ("residual_friction", joint.residual_friction)]
    {
        if value.is_none() {
            let message = format!("key `{key}` is missing: it is needed with `{first}`");
            faults.add_help(ErrorCode::MissingKey, format!("{at}.{key}"), message, law);
        }
    }
    for (key, value) in
        [("residual_friction", joint.residual_friction), ("dilation", joint.dilation)]
    {
        if let Some(value) = value.filter(|value| *value > STEEPEST) {
            let message = format!(
                "`{key}` is {}, above the largest angle of friction that `jrc` gives, {STEEPEST}",
                shown(value)
            );
            faults.add(ErrorCode::OutOfRange, format!("{at}.{key}"), message);
        }
    }
}

/// Checks the fracture energies. Softening begins at the elastic limit, where the joint already
/// holds energy. A joint that dissipates no more than that would have to close or slide back as it
/// loses strength.
fn softening(deck: &Deck, at: &str, joint: &Joint, faults: &mut Faults) {
    let (Some(energies), Some([normal, shear])) =
        (joint.fracture_energy, joint.stiffness(&deck.materials))
    else {
        return;
    };
    let lost = joint.cohesion.unwrap_or_default() - joint.residual_cohesion.unwrap_or_default();
    let modes = [
        ("opening", "tension²/(2 k_n)", joint.tension.unwrap_or_default(), ("k_n", normal)),
        ("sliding", "(cohesion − residual_cohesion)²/(2 k_s)", lost, ("k_s", shear)),
    ];
    for (i, (mode, formula, strength, (name, stiffness))) in modes.into_iter().enumerate() {
        let least = strength * strength / (2.0 * stiffness);
        if strength > 0.0 && energies[i] <= least {
            let (least, stiffness) = (shown(rounded_up(least)), shown(four_digits(stiffness)));
            faults.add_help(
                ErrorCode::OutOfRange,
                format!("{at}.fracture_energy[{i}]"),
                format!(
                    "`fracture_energy` in {mode} is {} J/m² but must be above {least} J/m²",
                    shown(energies[i])
                ),
                format!(
                    "the joint holds {formula} when it begins to soften, with {name} = \
                     {stiffness} Pa/m; to lose no more than that it would have to snap back: \
                     give a larger energy, or a stiffer or thinner joint"
                ),
            );
        }
    }
}

fn four_digits(value: f64) -> f64 {
    format!("{value:.3e}").parse().unwrap_or(value)
}

/// Number with four digits that is not below `value`, except for rounding.
fn rounded_up(value: f64) -> f64 {
    let near = four_digits(value);
    if near >= value * (1.0 - 1e-12) {
        return near;
    }
    let unit = 10.0_f64.powi(libm::log10(value).floor() as i32 - 3);
    four_digits(near + unit)
}
