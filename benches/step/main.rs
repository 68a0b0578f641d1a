//! Rates of this machine and of ddem in one run: memory bandwidth, peaks of the arithmetic units,
//! node updates per second of many models, and bytes per node.
//!
//! `cargo bench --bench step` measures everything, with `-- joints` at its end the rows whose names
//! contain a word.
//! Results are printed, and written to `target/bench/step.json` for `benches/report.py`. Quote
//! ratios from one run; numbers of two runs are not comparable.

mod machine;
mod models;
mod rows;
mod timing;

use std::path::PathBuf;

use serde_json::{Value, json};

use rows::RowGroup;
use timing::Pace;

/// Options of the command line.
struct BenchOptions {
    /// Words of which a row must contain one; all rows without words.
    words: Vec<String>,
    /// True to add the model of four million nodes.
    large: bool,
    /// Effort of each measurement.
    pace: Pace,
}

impl BenchOptions {
    /// Options of the command line; `cargo test` gives no `--bench` and only tries the smallest models.
    fn read() -> Self {
        let all: Vec<String> = std::env::args().skip(1).collect();
        let has = |option: &str| all.iter().any(|word| word == option);
        let pace = match (has("--bench"), has("--quick")) {
            (false, _) => Pace::TRIAL,
            (true, true) => Pace::QUICK,
            (true, false) => Pace::FULL,
        };
        let words = all.iter().filter(|word| !word.starts_with('-')).cloned().collect();
        Self { words, large: has("--large"), pace }
    }

    fn wants(&self, name: &str) -> bool {
        self.words.is_empty() || self.words.iter().any(|word| name.contains(word))
    }
}

fn main() {
    let options = BenchOptions::read();
    let mut machine = machine::Machine::new(options.pace);
    let mut found = Vec::new();
    for group in rows::groups(options.large) {
        if group.nodes > options.pace.most_nodes {
            continue;
        }
        let names: Vec<String> = group.names().into_iter().filter(|n| options.wants(n)).collect();
        if !names.is_empty() {
            measure(&group, &names, &options, &mut machine, &mut found);
        }
    }
    let limits = machine.limits();
    for (name, value) in limits.as_object().into_iter().flatten() {
        println!("{name:<40}{:>12.2} G/s", value.as_f64().unwrap_or(f64::NAN));
    }
    if options.pace.records {
        write(&json!({ "limits": limits, "rows": found }));
    }
}

/// Measures the rows of one model, which is built once.
fn measure(
    group: &RowGroup,
    names: &[String],
    options: &BenchOptions,
    machine: &mut machine::Machine,
    found: &mut Vec<Value>,
) {
    let mut model = group.build();
    for threads in [1, 2] {
        let name = group.name(threads);
        if !names.contains(&name) {
            continue;
        }
        let measured = machine
            .beside(threads, |pool| timing::rates(options.pace, || pool.install(|| model.step())));
        let units = model.units() as f64;
        let [best, median] = [measured.best, measured.median].map(|rate| rate * units);
        let bytes = model.bytes() as f64 / units;
        println!("{name:<40}{:>12.2} M/s  {bytes:>6.0} bytes", best / 1e6);
        found.push(json!({
            "group": group.kind, "name": name, "model": group.model, "threads": threads,
            "nodes": model.nodes(), "unit": group.unit, "units": units, "best": best,
            "median": median, "bytes": bytes, "triad": measured.triad,
        }));
    }
}

/// Writes the results below the target folder.
fn write(results: &Value) {
    let target = std::env::var_os("CARGO_TARGET_DIR").map(PathBuf::from);
    let target = target.unwrap_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("target"));
    let folder = target.join("bench");
    std::fs::create_dir_all(&folder).expect("a folder for the results");
    let text = serde_json::to_string_pretty(results).expect("numbers");
    let path = folder.join("step.json");
    std::fs::write(&path, text + "\n").expect("a file for the results");
    println!("results are in {}", path.display());
}
