//! V6: harmonic plane waves through one elastic joint.

use std::f64::consts::TAU;

use super::record::Tolerance::Relative;
use super::record::{check, of};
use super::shared::{example, run};

/// Amplitude of the harmonic of a record that starts and ends at rest.
fn harmonic(samples: &[[f64; 2]], frequency: f64) -> f64 {
    let [mut real, mut imaginary] = [0.0; 2];
    for pair in samples.windows(2) {
        let step = pair[1][0] - pair[0][0];
        for [time, value] in pair {
            let phase = TAU * frequency * time;
            real += 0.5 * step * value * phase.cos();
            imaginary += 0.5 * step * value * phase.sin();
        }
    }
    real.hypot(imaginary)
}

/// Checks waves of the speed `speed` in the columns of a deck, 12 m long and twice as long.
fn passes(deck: &str, axis: &str, speed: f64) {
    let case = of(deck);
    let run = run(&example(case.deck));
    let record = |column: &str, side: &str| run.probes.series(&format!("{column}_{side}.{axis}"));
    let plain = ["before", "behind"].map(|side| record("plain", side));
    for (column, stiffness) in [("quarter", 0.25), ("half", 0.5), ("one", 1.0), ("two", 2.0)] {
        let behind = record(column, "behind");
        let less = |(a, b): (&[f64; 2], &[f64; 2])| [a[0], a[1] - b[1]];
        let returned: Vec<_> = record(column, "before").iter().zip(&plain[0]).map(less).collect();
        for waves in [1.0, 2.0] {
            let frequency = speed / (12.0 * waves);
            let x = stiffness * waves;
            if x > 2.0 {
                continue;
            }
            let part = |samples: &[[f64; 2]], of: &[[f64; 2]]| {
                harmonic(samples, frequency) / harmonic(of, frequency)
            };
            let exact = [4.0 * x * x, 1.0].map(|above| (above / (4.0 * x * x + 1.0)).sqrt());
            let found = [part(&behind, &plain[1]), part(&returned, &plain[0])];
            let at = format!("x = {x}, {frequency:.0} Hz");
            check(case, &format!("transmitted part, {at}"), exact[0], found[0], Relative(1e-2));
            check(case, &format!("reflected part, {at}"), exact[1], found[1], Relative(1e-2));
        }
    }
}

#[test]
fn compression_wave_passes_spring_joint() {
    passes("v06_p_spring", "x", 3000.0);
}

#[test]
fn compression_wave_passes_nonconforming_joint() {
    passes("v06_refined", "x", 3000.0);
}

#[test]
fn compression_wave_passes_joint_of_cells() {
    passes("cells_joint", "x", 3000.0);
}

#[test]
fn compression_wave_passes_thick_joint() {
    passes("v06_p_thick", "x", 3000.0);
}

#[test]
fn shear_wave_passes_spring_joint() {
    passes("v06_s_spring", "y", (7.2e9_f64 / 2400.0).sqrt());
}

#[test]
fn shear_wave_passes_thick_joint() {
    passes("v06_s_thick", "y", (7.2e9_f64 / 2400.0).sqrt());
}
