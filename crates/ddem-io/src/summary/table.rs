//! Summaries as text: a line for each stage, and the state at the end of a stage.

use std::fmt;

use ddem_core::{
    ContactSummary, Energy, JointSummary, Largest, MovingBlock, Reaction, StateSummary, Verdict,
    counted, undecided,
};

use super::{StageSummary, Summary};

/// Largest number of moving blocks that are listed; the others are counted.
const LISTED: usize = 5;

/// Energies below this are rounding errors `[J]`.
const LEAST_ENERGY: f64 = 1e-12;

/// Width of the label of a line, in columns.
const LABEL: usize = 15;

/// SI prefixes with their factors, from the largest; the smallest prefix of all units is micro.
const PREFIXES: [(f64, &str); 6] =
    [(1e9, "G"), (1e6, "M"), (1e3, "k"), (1.0, ""), (1e-3, "m"), (1e-6, "µ")];

/// Quantity as text, with four digits and the SI prefix of its size; the unit must have no
/// exponent.
pub fn quantity(value: f64, unit: &str) -> String {
    let (factor, prefix) = prefix(value.abs(), unit);
    format!("{} {prefix}{unit}", digits(value / factor))
}

/// Components of a vector as text, with one prefix.
pub(super) fn vector(vector: [f64; 3], unit: &str) -> String {
    let size = vector.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    let (factor, prefix) = prefix(size, unit);
    // Components that are negligible beside the largest are 0; all have as many decimals as the
    // largest.
    let decimals = decimals(size / factor);
    let part = |x: f64| {
        let text = match x / factor {
            x if (0.1..1e6).contains(&(size / factor)) => format!("{x:.decimals$}"),
            _ if x.abs() < 1e-6 * size => return "0".to_owned(),
            x => digits(x),
        };
        // Avoids `-0.000`.
        if text.contains(|c: char| matches!(c, '1'..='9')) { text } else { "0".to_owned() }
    };
    let [x, y, z] = vector.map(part);
    format!("({x}, {y}, {z}) {prefix}{unit}")
}

fn prefix(size: f64, unit: &str) -> (f64, &'static str) {
    // Nobody writes kilometres for large displacements.
    let most = if unit.starts_with('m') { 1.0 } else { f64::INFINITY };
    let found = PREFIXES.iter().find(|(factor, _)| *factor <= most && size >= 0.9995 * factor);
    match found {
        Some(&(factor, prefix)) => (factor, prefix),
        None if size == 0.0 || !size.is_finite() => (1.0, ""),
        None => (1e-6, "µ"),
    }
}

/// Number as text with four digits; with an exponent if there is no suitable prefix.
fn digits(value: f64) -> String {
    let size = value.abs();
    if value == 0.0 {
        "0".to_owned()
    } else if !(0.1..1e6).contains(&size) {
        format!("{value:.2e}")
    } else {
        format!("{value:.*}", decimals(size))
    }
}

/// Number of decimals that give four digits.
fn decimals(size: f64) -> usize {
    3_usize.saturating_sub(size.log10().floor().max(0.0) as usize)
}

fn line(f: &mut fmt::Formatter<'_>, label: &str, text: &str) -> fmt::Result {
    writeln!(f, "{label:<LABEL$}{text}")
}

fn point(point: [f64; 3]) -> String {
    let [x, y, z] = point.map(|x| if x.abs() < 1e-9 { 0.0 } else { (x * 1e4).round() / 1e4 });
    format!("({x}, {y}, {z})")
}

fn largest(Largest { size, block, set, point: at, .. }: &Largest, unit: &str) -> String {
    let of = if set.is_empty() { String::new() } else { format!(" (set `{set}`)") };
    format!("at most {}, in block {block}{of} at {}", quantity(*size, unit), point(*at))
}

fn joint(JointSummary { pairs, shear, tension, open, .. }: &JointSummary) -> String {
    match shear + tension {
        0 => format!("holds, {}", counted(*pairs, "pair")),
        failed => format!(
            "{failed} of {} failed: {shear} in shear, {tension} in tension; {open} open",
            counted(*pairs, "pair")
        ),
    }
}

fn contacts(ContactSummary { block_pairs, sliding, open, .. }: &ContactSummary) -> String {
    let pairs = counted(*block_pairs, "pair");
    format!(
        "{pairs} of blocks in contact, {sliding} sliding; {open} near each other without touching"
    )
}

fn energy(energy: &Energy) -> String {
    let Energy {
        kinetic,
        strain_bodies,
        strain_joints,
        friction,
        fracture,
        contact,
        damping,
        external_work,
        ..
    } = *energy;
    let parts = [
        ("kinetic", kinetic),
        ("strain", strain_bodies + strain_joints),
        ("friction", friction),
        ("fracture", fracture),
        ("contact", contact),
        ("damping", damping),
        ("external work", external_work),
    ];
    let least = (1e-9 * energy.largest).max(LEAST_ENERGY);
    let there = parts.iter().filter(|(_, value)| value.abs() > least);
    let parts: Vec<String> =
        there.map(|(name, value)| format!("{name} {}", quantity(*value, "J"))).collect();
    if parts.is_empty() {
        return "none".to_owned();
    }
    format!("{}; off by {:.1e} of the largest", parts.join(", "), energy.imbalance())
}

fn moving(f: &mut fmt::Formatter<'_>, moving: &[MovingBlock]) -> fmt::Result {
    for MovingBlock { set, block, distance, direction } in moving.iter().take(LISTED) {
        let of = if set.is_empty() { String::new() } else { format!(" (set `{set}`)") };
        let [x, y, z] = direction.map(|d| (d * 100.0).round() / 100.0 + 0.0);
        let distance = quantity(*distance, "m");
        line(f, "moving", &format!("block {block}{of}: {distance} along ({x}, {y}, {z})"))?;
    }
    match moving.len().saturating_sub(LISTED) {
        0 => Ok(()),
        more => line(f, "", &format!("and {more} more")),
    }
}

/// State at the end of a stage, a line for each quantity.
impl fmt::Display for StageSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let StateSummary {
            time,
            displacement,
            velocity,
            joints,
            contacts: met,
            fragments,
            reactions,
            energy: energies,
        } = &self.state;
        match self.kind.as_str() {
            "dynamic" => {
                writeln!(f, "at the end of `{}`, t = {}:", self.name, quantity(*time, "s"))?
            }
            _ => writeln!(f, "at the end of `{}`:", self.name)?,
        }
        if self.kind == "safety" {
            line(f, "safety", &self.safety())?;
            if let [_, Some(unstable)] = self.bracket.unwrap_or_default() {
                let trial =
                    if undecided(&self.trials, Some(unstable)) { "undecided" } else { "failing" };
                line(f, "last frame", &format!("{trial} trial, strengths / {unstable:.4}"))?;
            }
            moving(f, &self.moving)?;
            // Without an equilibrium before the search there is no state worth a description.
            if self.verdict != Verdict::AtRest {
                return line(f, "verdict", &format!("{} with its own strengths", self.verdict));
            }
            line(f, "verdict", "at rest; the lines below describe the state before the search")?;
        } else {
            line(f, "verdict", &self.verdict.to_string())?;
            moving(f, &self.moving)?;
        }
        if let Some(displacement) = displacement {
            line(f, "displacement", &largest(displacement, "m"))?;
        }
        if let Some(velocity) = velocity {
            line(f, "velocity", &largest(velocity, "m/s"))?;
        }
        for summary in joints {
            line(f, "joint", &format!("`{}`: {}", summary.joint, joint(summary)))?;
        }
        if met.block_pairs + met.open > 0 {
            line(f, "contacts", &contacts(met))?;
        }
        if fragments.number > 1 {
            let volume = digits(fragments.largest_volume);
            line(f, "fragments", &format!("{}, the largest of {volume} m³", fragments.number))?;
        }
        for Reaction { fix, force } in reactions {
            line(f, "reaction", &format!("of fix[{fix}]: {}", vector(*force, "N")))?;
        }
        line(f, "energy", &energy(energies))
    }
}

impl StageSummary {
    /// Factor of safety as text.
    #[must_use]
    pub fn safety(&self) -> String {
        let [stable, unstable] = self.bracket.unwrap_or_default();
        match (self.factor, stable, unstable) {
            (Some(factor), Some(stable), Some(unstable)) => {
                let end =
                    if undecided(&self.trials, Some(unstable)) { "undecided" } else { "unstable" };
                format!(
                    "factor of safety {factor:.3}, stable at {stable:.4}, {end} at {unstable:.4}"
                )
            }
            (_, None, Some(unstable)) => format!("factor of safety below {unstable}"),
            (_, Some(stable), _) => format!("factor of safety above {stable}"),
            (_, None, None) => {
                let least = self.trials.first().map_or(f64::NAN, |trial| trial.factor);
                format!("no factor of safety: the trial with strengths / {least:.4} was undecided")
            }
        }
    }
}

impl Summary {
    /// Limits of the time step of each dynamic stage, and the shape of cells.
    fn limits(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let limited =
            || self.stages.iter().filter_map(|stage| Some((stage, stage.limit.as_ref()?)));
        if limited().next().is_some() || self.worst_element.is_some() {
            writeln!(f)?;
        }
        for (StageSummary { name, .. }, limit) in limited() {
            let step = limit.step;
            line(f, "critical step", &format!("{step:.6e} s in `{name}`, limited by {limit}"))?;
        }
        if let Some(worst) = &self.worst_element {
            line(f, "worst element", &worst.to_string())?;
        }
        for added in &self.added_inertia {
            line(f, "added inertia", &added.to_string())?;
        }
        Ok(())
    }
}

/// Size of the model, its warnings, its stages, and the state at the end of the last one.
impl fmt::Display for Summary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if !self.title.is_empty() {
            writeln!(f, "{}", self.title)?;
        }
        let Self { blocks, nodes, elements, pairs, .. } = self;
        writeln!(f, "{blocks} blocks, {elements} elements, {nodes} nodes, {pairs} pairs\n")?;
        for warning in &self.warnings {
            writeln!(f, "warning: {warning}")?;
        }
        if !self.warnings.is_empty() {
            writeln!(f)?;
        }
        let name = |stage: &StageSummary| stage.name.chars().count();
        let width = self.stages.iter().map(name).max().unwrap_or(0).max(5) + 2;
        let head = ["kind", "verdict", "steps", "wall time"];
        let [kind, verdict, steps, seconds] = head;
        writeln!(f, "{:<width$}{kind:<9}{verdict:<11}{steps:>9}{seconds:>12}", "stage")?;
        for stage in &self.stages {
            let StageSummary { name, kind, verdict, steps, wall_seconds, .. } = stage;
            let verdict = verdict.to_string();
            writeln!(f, "{name:<width$}{kind:<9}{verdict:<11}{steps:>9}{wall_seconds:>10.1} s")?;
        }
        self.limits(f)?;
        self.stages.last().map_or(Ok(()), |last| write!(f, "\n{last}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantities_have_si_prefixes() {
        let shown = |values: &[f64], unit: &str| -> Vec<String> {
            values.iter().map(|&value| quantity(value, unit)).collect()
        };
        assert_eq!(
            shown(&[0.0, 1.2345e-3, -0.05, 2.0, 12_345.0, 3e-9], "m"),
            ["0 m", "1.234 mm", "-50.00 mm", "2.000 m", "12345 m", "3.00e-3 µm"]
        );
        assert_eq!(
            shown(&[999.99, 12.5e6, 4e9, -101_300.0], "Pa"),
            ["1.000 kPa", "12.50 MPa", "4.000 GPa", "-101.3 kPa"]
        );
        assert_eq!(vector([1500.0, -20.0, 1e-9], "N"), "(1.500, -0.020, 0) kN");
        assert_eq!(vector([1500.0, -0.1, 0.6], "N"), "(1.500, 0, 0.001) kN");
        assert_eq!(vector([0.0; 3], "N"), "(0, 0, 0) N");
    }

    #[test]
    fn absent_energies_are_omitted() {
        let none = Energy::default();
        assert_eq!(energy(&none), "none");
        let some = Energy { kinetic: 2.0, largest: 2.0, ..none };
        assert_eq!(energy(&some), "kinetic 2.000 J; off by 0.0e0 of the largest");
    }
}
