//! V11: energy balance.

use super::record::Tolerance::{Of, Relative};
use super::record::{Case, at_least, check, consistent, of};
use super::shared::{Run, example, run};

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |most: f64, value| most.max(value.abs()))
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// `kinetic + strain + damping + friction + fracture + contact − external work` minus its first
/// value, for each row.
fn sum_of_energies(run: &Run) -> Vec<f64> {
    let column = |name| run.energy.column(name);
    let kept = ["kinetic", "strain_bodies", "strain_joints"];
    let taken = ["damping", "friction", "fracture", "contact"];
    let parts: Vec<_> = kept.into_iter().chain(taken).map(column).collect();
    let external = column("external_work");
    let row = |i: usize| parts.iter().map(|part| part[i]).sum::<f64>() - external[i];
    (0..external.len()).map(|i| row(i) - row(0)).collect()
}

/// The same sum, which equals the balance in the table if the time step is constant.
fn balance(run: &Run) -> Vec<f64> {
    let balance = sum_of_energies(run);
    let (written, external) = (run.energy.column("balance"), run.energy.column("external_work"));
    let off: Vec<f64> = balance.iter().zip(&written).map(|(a, b)| a - b).collect();
    assert!(largest(&off) <= 1e-9 * largest(&external), "the balance is not that of its row");
    balance
}

/// Checks that the energies of a run with breaking joints balance to 1 %.
pub(crate) fn closes(case: Case, what: &str, run: &Run) {
    let exchanged = ["kinetic", "external_work", "damping", "friction", "fracture"];
    let peak = exchanged.map(|name| largest(&run.energy.column(name)));
    let error = largest(&sum_of_energies(run)) / peak.into_iter().fold(0.0, f64::max);
    consistent(
        case,
        &format!("V11 largest balance / peak exchange{what}"),
        0.0,
        error,
        Of(1.0, 1e-2),
    );
}

#[test]
fn undamped_bar_keeps_energy_for_100_000_steps() {
    let case = of("v11_energy");
    let run = run(&example(case.deck));
    at_least(case, "steps", 1e5, run.steps() as f64);
    let balance = balance(&run);
    let peak = largest(&run.energy.column("external_work"));
    let what = "largest balance / peak external work";
    consistent(case, what, 0.0, largest(&balance) / peak, Of(1.0, 1e-7));
    let tenth = balance.len() / 10;
    let drift = mean(&balance[balance.len() - tenth..]) - mean(&balance[..tenth]);
    consistent(case, "drift, last tenth − first / peak", 0.0, drift / peak, Of(1.0, 1e-6));
    let end = mean(&run.probes.column("end.x"));
    check(case, "mean u_x of the end [m]", 1e6 * 2.0 / 18e9, end, Relative(1e-2));
}

#[test]
fn damping_absorbs_work_of_load() {
    let case = of("v11_damped");
    let run = run(&example(case.deck));
    let external = run.energy.column("external_work");
    let what = "largest balance / external work";
    consistent(case, what, 0.0, largest(&balance(&run)) / largest(&external), Of(1.0, 1e-7));
    let last = |column: &str| *run.energy.column(column).last().expect("a row");
    check(case, "energy taken by damping [J]", 1e3 / 18.0, last("damping"), Relative(1e-2));
    let end = run.last("end.x");
    check(case, "u_x of the end at rest [m]", 1e6 * 2.0 / 18e9, end, Relative(1e-2));
}
