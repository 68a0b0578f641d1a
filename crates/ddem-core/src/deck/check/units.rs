//! Numbers that look as if they were meant in another unit.

use crate::deck::{Deck, Joint, Material};

/// Moduli below this are those of jelly `[Pa]`.
const SOFTEST: f64 = 1e5;
/// Densities below this are those of foam `[kg/m³]`.
const LIGHTEST: f64 = 100.0;
/// Angles of friction below this are rather coefficients `[degrees]`.
const SMALLEST: f64 = 2.0;
/// Restitution of critical damping, below which no dashpot that never pulls gets.
const CRITICAL: f64 = 0.135;

/// What is to be said of them.
pub(super) fn units(deck: &Deck) -> Vec<String> {
    let mut doubts = Vec::new();
    for (name, Material { density, young, .. }) in &deck.materials {
        let of = format!("material `{name}`");
        doubts.extend(modulus(&of, *young));
        doubts.extend(mass(&of, *density));
    }
    for (name, joint) in &deck.joints {
        let of = format!("joint `{name}`");
        let Joint { density, young, friction, residual_friction, .. } = joint;
        doubts.extend(young.and_then(|young| modulus(&of, young)));
        doubts.extend(density.and_then(|density| mass(&of, density)));
        doubts.extend(friction.and_then(|angle| coefficient(&of, "friction", angle)));
        doubts.extend(
            residual_friction.and_then(|angle| coefficient(&of, "residual_friction", angle)),
        );
    }
    let contact = &deck.contact;
    doubts.extend(contact.friction.and_then(|angle| coefficient("[contact]", "friction", angle)));
    doubts.extend(contact.restitution.filter(|part| *part < CRITICAL).map(|part| {
        format!(
            "[contact]: no `restitution` below {CRITICAL} can be had, and {part} gives that: what is \
             to come to rest wants a stage with `damping = {{ local = 0.8 }}`"
        )
    }));
    doubts
}

fn modulus(of: &str, young: f64) -> Option<String> {
    let meant = format!("{:e}", young * if young < 1e3 { 1e9 } else { 1e6 });
    let unit = if young < 1e3 { "GPa" } else { "MPa" };
    (young < SOFTEST)
        .then(|| format!("{of}: `young` is {young} Pa: {young} {unit} would be written {meant}"))
}

fn mass(of: &str, density: f64) -> Option<String> {
    let meant = 1e3 * density;
    (density < LIGHTEST).then(|| {
        format!("{of}: `density` is {density} kg/m³: {density} t/m³ would be written {meant}")
    })
}

fn coefficient(of: &str, key: &str, angle: f64) -> Option<String> {
    let meant = angle.atan().to_degrees();
    (0.0 < angle && angle < SMALLEST).then(|| {
        format!(
            "{of}: `{key}` is an angle, {angle} degrees: a coefficient of {angle} would be written \
             {meant:.1}"
        )
    })
}
