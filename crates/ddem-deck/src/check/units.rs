//! Warnings about numbers that look as if they were given in another unit.

use std::f64::consts::FRAC_PI_2;

use crate::lint::{Code, Diagnostic};
use crate::schema::decimal::shifted;
use crate::schema::names::segment;
use crate::schema::{BlockSet, CRITICAL, Damping, Deck, History, Joint, Material};

/// Moduli below this are those of jelly `[Pa]`.
const SOFTEST: f64 = 1e5;
/// Densities below this are those of foam `[kg/m³]`.
const LIGHTEST: f64 = 100.0;
/// Standard gravity `[m/s²]`.
const GRAVITY: f64 = 9.81;
/// Friction angles below this are probably coefficients `[degrees]`.
const SMALLEST: f64 = 2.0;
/// Strengths, tractions and pressures below this are implausibly small `[Pa]`.
const WEAKEST: f64 = 1e3;
/// Stiffnesses of joints below this are those of cushions `[Pa/m]`.
const SLACKEST: f64 = 1e5;
/// Blocks whose shortest edge is longer than this are larger than any in rock engineering `[m]`.
const LONGEST: f64 = 300.0;

fn suspicious(at: impl Into<String>, message: String, help: String) -> Diagnostic {
    Diagnostic::warning(Code::SuspiciousUnit, at, message, help)
}

/// Warnings about units.
pub(super) fn units(deck: &Deck) -> Vec<Diagnostic> {
    let mut warnings = Vec::new();
    for (name, Material { density, young, .. }) in &deck.materials {
        let at = format!("materials.{}", segment(name));
        warnings.extend(modulus(&at, *young));
        warnings.extend(mass(&at, *density));
    }
    for (name, joint) in &deck.joints {
        let at = format!("joints.{}", segment(name));
        let Joint { density, young, friction, residual_friction, .. } = joint;
        warnings.extend(young.and_then(|young| modulus(&at, young)));
        warnings.extend(density.and_then(|density| mass(&at, density)));
        warnings.extend(strengths(&at, joint));
        warnings.extend(friction.and_then(|angle| coefficient(&at, "friction", angle)));
        warnings.extend(
            residual_friction.and_then(|angle| coefficient(&at, "residual_friction", angle)),
        );
    }
    for (index, set) in deck.blocks.iter().enumerate() {
        warnings.extend(lengths(&format!("blocks[{index}]"), set));
    }
    warnings.extend(loads(deck));
    for (index, stage) in deck.stage.iter().enumerate() {
        if let Some(Damping::Ratio(ratio)) = stage.damping
            && ratio > 1.0
        {
            let message = format!("a damping `ratio` of {ratio} is above 1, critical damping");
            let at = format!("stage[{index}].damping.ratio");
            let help = format!("{ratio} % is {}", shifted(ratio, -2));
            warnings.push(Diagnostic::warning(Code::Overdamped, at, message, help));
        }
    }
    let contact = &deck.contact;
    warnings.extend(contact.friction.and_then(|angle| coefficient("contact", "friction", angle)));
    let least = (1e3 * CRITICAL).floor() / 1e3;
    warnings.extend(contact.restitution.filter(|part| *part < least).map(|part| {
        let message =
            format!("a `restitution` below {least} is not possible; {part} gives {least}");
        let help = "a stage with `damping = { local = 0.8 }` brings blocks to rest";
        Diagnostic::warning(Code::InfeasibleRestitution, "contact.restitution", message, help)
    }));
    warnings
}

/// Warning about the edges of the blocks of a lattice.
fn lengths(at: &str, set: &BlockSet) -> Option<Diagnostic> {
    let (size, count) = (set.size?, set.count());
    let shortest =
        (0..3).map(|k| size[k] / f64::from(count[k].max(1))).fold(f64::INFINITY, f64::min);
    (shortest > LONGEST).then(|| {
        let message = format!("the shortest edge of the blocks is {shortest} m");
        let help = format!("{shortest} mm are {} m", shifted(shortest, -3));
        suspicious(format!("{at}.size"), message, help)
    })
}

/// Warnings about strengths and stiffnesses of a joint.
fn strengths<'a>(at: &'a str, joint: &'a Joint) -> impl Iterator<Item = Diagnostic> + 'a {
    let Joint { cohesion, tension, residual_cohesion, jcs, .. } = joint;
    let strengths = [
        ("cohesion", cohesion),
        ("tension", tension),
        ("residual_cohesion", residual_cohesion),
        ("jcs", jcs),
    ];
    let weak = strengths.into_iter().filter_map(move |(key, value)| pressure(at, key, (*value)?));
    let Joint { normal_stiffness, shear_stiffness, .. } = joint;
    let stiffnesses =
        [("normal_stiffness", normal_stiffness), ("shear_stiffness", shear_stiffness)];
    let slack = stiffnesses.into_iter().filter_map(move |(key, value)| {
        let value = value.filter(|value| *value < SLACKEST)?;
        let (unit, power) = if value < 1e3 { ("GPa/m", 9) } else { ("MPa/m", 6) };
        let message = format!("`{key}` is {value} Pa/m");
        let help = format!("{value} {unit} is {:e}", shifted(value, power));
        Some(suspicious(format!("{at}.{key}"), message, help))
    });
    weak.chain(slack)
}

/// Warnings about loads, charges and in-situ stresses. A load of 1 may be a unit that a history
/// multiplies.
fn loads(deck: &Deck) -> Vec<Diagnostic> {
    let largest = |values: &[f64]| values.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    let mut warnings = Vec::new();
    for (index, load) in deck.load.iter().enumerate() {
        let scaled = matches!(load.history, Some(History::Table(_)));
        let traction = load.traction.map(|traction| ("traction", largest(&traction)));
        let normal = load.pressure.map(|pressure| ("pressure", pressure.abs()));
        for (key, size) in [traction, normal].into_iter().flatten() {
            if !scaled && size != 1.0 {
                warnings.extend(pressure(&format!("load[{index}]"), key, size));
            }
        }
    }
    for (index, charge) in deck.charge.iter().enumerate() {
        let at = format!("charge[{index}]");
        warnings.extend(charge.pressure.and_then(|size| pressure(&at, "pressure", size)));
    }
    for (index, initial) in deck.initial.iter().enumerate() {
        let Some(stress) = initial.stress.filter(|_| initial.gradient.is_none()) else { continue };
        warnings.extend(pressure(&format!("initial[{index}]"), "stress", largest(&stress)));
    }
    warnings
}

fn pressure(at: &str, key: &str, size: f64) -> Option<Diagnostic> {
    let [kilo, mega] = [3, 6].map(|power| shifted(size, power));
    (0.0 < size && size < WEAKEST).then(|| {
        let message = format!("`{key}` is only {size} Pa");
        let help = format!("{size} kPa is {kilo:e}, {size} MPa is {mega:e}");
        suspicious(format!("{at}.{key}"), message, help)
    })
}

fn modulus(at: &str, young: f64) -> Option<Diagnostic> {
    let (unit, power) = if young < 1e3 { ("GPa", 9) } else { ("MPa", 6) };
    (young < SOFTEST).then(|| {
        let help = format!("{young} {unit} is {:e}", shifted(young, power));
        suspicious(format!("{at}.young"), format!("`young` is only {young} Pa"), help)
    })
}

fn mass(at: &str, density: f64) -> Option<Diagnostic> {
    let (unit, meant) = match density {
        // Rock weighs 15 to 35 kN/m³, and no more than 8 t/m³.
        ..10.0 => ("t/m³", shifted(density, 3)),
        _ => ("kN/m³", (density * 1e3 / GRAVITY).round()),
    };
    (density < LIGHTEST).then(|| {
        let help = format!("{density} {unit} is {meant}");
        suspicious(format!("{at}.density"), format!("`density` is only {density} kg/m³"), help)
    })
}

fn coefficient(at: &str, key: &str, angle: f64) -> Option<Diagnostic> {
    let meant = libm::atan(angle).to_degrees();
    let rounded = (angle * 1e4).round() / 1e4;
    let short = if rounded > 0.0 { rounded } else { angle };
    let radians = if angle < FRAC_PI_2 {
        format!(", {short} rad are {:.1}", angle.to_degrees())
    } else {
        String::new()
    };
    (0.0 < angle && angle < SMALLEST).then(|| {
        let message = format!("`{key}` is an angle of only {short} degrees");
        let help = format!("a coefficient of {short} is {meant:.1} degrees{radians}");
        suspicious(format!("{at}.{key}"), message, help)
    })
}
