//! Numbers that look as if they were meant in another unit.

use std::f64::consts::FRAC_PI_2;

use crate::schema::decimal::shifted;
use crate::schema::{Damping, Deck, History, Joint, Material};

/// Moduli below this are those of jelly `[Pa]`.
const SOFTEST: f64 = 1e5;
/// Densities below this are those of foam `[kg/m³]`.
const LIGHTEST: f64 = 100.0;
/// Standard gravity `[m/s²]`.
const GRAVITY: f64 = 9.81;
/// Angles of friction below this are rather coefficients `[degrees]`.
const SMALLEST: f64 = 2.0;
/// Strengths, tractions and pressures below this are next to nothing `[Pa]`.
const WEAKEST: f64 = 1e3;
/// Stiffnesses of joints below this are those of cushions `[Pa/m]`.
const SLACKEST: f64 = 1e5;
/// Restitution of critical damping, below which no dashpot that never pulls gets.
const CRITICAL: f64 = 0.135;

/// Warnings about units.
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
        doubts.extend(strengths(&of, joint));
        doubts.extend(friction.and_then(|angle| coefficient(&of, "friction", angle)));
        doubts.extend(
            residual_friction.and_then(|angle| coefficient(&of, "residual_friction", angle)),
        );
    }
    doubts.extend(loads(deck));
    for stage in &deck.stage {
        if let Some(Damping::Ratio(ratio)) = stage.damping
            && ratio > 1.0
        {
            let of = format!("stage `{}`", stage.name);
            doubts.push(format!(
                "{of}: a damping `ratio` of {ratio} is beyond critical damping, 1: {ratio} % would be written {}",
                shifted(ratio, -2)
            ));
        }
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

/// Strengths and stiffnesses of a joint.
fn strengths<'a>(of: &'a str, joint: &'a Joint) -> impl Iterator<Item = String> + 'a {
    let Joint { cohesion, tension, residual_cohesion, jcs, .. } = joint;
    let strengths = [
        ("cohesion", cohesion),
        ("tension", tension),
        ("residual_cohesion", residual_cohesion),
        ("jcs", jcs),
    ];
    let weak = strengths.into_iter().filter_map(move |(key, value)| pressure(of, key, (*value)?));
    let Joint { normal_stiffness, shear_stiffness, .. } = joint;
    let stiffnesses =
        [("normal_stiffness", normal_stiffness), ("shear_stiffness", shear_stiffness)];
    let slack = stiffnesses.into_iter().filter_map(move |(key, value)| {
        let value = value.filter(|value| *value < SLACKEST)?;
        let (unit, power) = if value < 1e3 { ("GPa/m", 9) } else { ("MPa/m", 6) };
        let meant = shifted(value, power);
        Some(format!("{of}: `{key}` is {value} Pa/m: {value} {unit} would be written {meant:e}"))
    });
    weak.chain(slack)
}

/// Loads, charges and stresses at the start. A load of 1 may be a unit that a history multiplies.
fn loads(deck: &Deck) -> Vec<String> {
    let largest = |values: &[f64]| values.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    let mut doubts = Vec::new();
    for (index, load) in deck.load.iter().enumerate() {
        let scaled = matches!(load.history, Some(History::Table(_)));
        let traction = load.traction.map(|traction| ("traction", largest(&traction)));
        let normal = load.pressure.map(|pressure| ("pressure", pressure.abs()));
        for (key, size) in [traction, normal].into_iter().flatten() {
            if !scaled && size != 1.0 {
                doubts.extend(pressure(&format!("load {index}"), key, size));
            }
        }
    }
    for (index, charge) in deck.charge.iter().enumerate() {
        let of = format!("charge {index}");
        doubts.extend(charge.pressure.and_then(|size| pressure(&of, "pressure", size)));
    }
    for (index, initial) in deck.initial.iter().enumerate() {
        let Some(stress) = initial.stress.filter(|_| initial.gradient.is_none()) else { continue };
        doubts.extend(pressure(&format!("initial {index}"), "stress", largest(&stress)));
    }
    doubts
}

fn pressure(of: &str, key: &str, size: f64) -> Option<String> {
    let [kilo, mega] = [3, 6].map(|power| shifted(size, power));
    (0.0 < size && size < WEAKEST).then(|| {
        format!(
            "{of}: `{key}` is {size} Pa, next to nothing: {size} kPa would be written {kilo:e}, \
             {size} MPa {mega:e}"
        )
    })
}

fn modulus(of: &str, young: f64) -> Option<String> {
    let (unit, power) = if young < 1e3 { ("GPa", 9) } else { ("MPa", 6) };
    let meant = shifted(young, power);
    (young < SOFTEST)
        .then(|| format!("{of}: `young` is {young} Pa: {young} {unit} would be written {meant:e}"))
}

fn mass(of: &str, density: f64) -> Option<String> {
    let (unit, meant) = match density {
        // Rock weighs 15 to 35 kN/m³, and no more than 8 t/m³.
        ..10.0 => ("t/m³", shifted(density, 3)),
        _ => ("kN/m³", (density * 1e3 / GRAVITY).round()),
    };
    (density < LIGHTEST).then(|| {
        format!("{of}: `density` is {density} kg/m³: {density} {unit} would be written {meant}")
    })
}

fn coefficient(of: &str, key: &str, angle: f64) -> Option<String> {
    let meant = libm::atan(angle).to_degrees();
    let rounded = (angle * 1e4).round() / 1e4;
    let short = if rounded > 0.0 { rounded } else { angle };
    let radians = if angle < FRAC_PI_2 {
        format!(", {short} rad {:.1}", angle.to_degrees())
    } else {
        String::new()
    };
    (0.0 < angle && angle < SMALLEST).then(|| {
        format!(
            "{of}: `{key}` is an angle, {short} degrees: a coefficient of {short} would be written \
             {meant:.1}{radians}"
        )
    })
}
