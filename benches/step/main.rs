//! Rates of this machine and of ddem in one run: memory bandwidth, peaks of the arithmetic units,
//! node updates per second of many models, and bytes per node.
//!
//! `cargo bench --bench step` measures everything, with `-- joints` at its end the rows whose names
//! contain that word, and with `-- --large` also models of four million nodes. Criterion writes the
//! times below `target/criterion`, and the models are listed in `target/bench/models.json`;
//! `benches/report.py` reads both. Quote ratios from one run; numbers of two runs are not comparable.

mod limits;
mod models;
mod rows;

use std::path::PathBuf;
use std::time::Duration;

use criterion::{
    BenchmarkId, Criterion, SamplingMode, Throughput, criterion_group, criterion_main,
};
use serde_json::{Value, json};

// The one of the command line.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

/// Numbers of threads.
const THREADS: [usize; 2] = [1, 2];

/// Nodes of the largest model of `cargo test`, which only tries each row.
const TRIED: usize = 1000;

fn pool(threads: usize) -> rayon::ThreadPool {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads")
}

/// Samples are short and many, so that other programs leave some of them undisturbed. The best one
/// counts.
fn config() -> Criterion {
    Criterion::default()
        .sample_size(60)
        .nresamples(1000)
        .warm_up_time(Duration::from_millis(200))
        .measurement_time(Duration::from_secs(2))
}

/// Steps of all models.
fn models(criterion: &mut Criterion) {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let has = |option: &str| arguments.iter().any(|word| word == option);
    let measures = has("--bench");
    let word = arguments.iter().find(|word| !word.starts_with('-'));
    let mut list = Vec::new();
    for row in rows::rows(has("--large")) {
        // Models that are not measured are not built.
        let wanted = word.is_none_or(|word| row.names().iter().any(|name| name.contains(word)));
        if wanted && (measures || row.nodes <= TRIED) {
            list.extend(measure(criterion, &row));
        }
    }
    if measures {
        write(&list);
    }
}

/// Measures the steps of one model, on each number of threads. Returns its entries of the list.
fn measure(criterion: &mut Criterion, row: &rows::BenchRow) -> Vec<Value> {
    let mut model = row.build();
    let units = model.units() as u64;
    let mut group = criterion.benchmark_group(row.kind);
    group.sampling_mode(SamplingMode::Flat).throughput(Throughput::Elements(units));
    for threads in THREADS {
        let pool = pool(threads);
        let id = BenchmarkId::new(row.function(threads), row.nodes);
        group.bench_function(id, |bencher| pool.install(|| bencher.iter(|| model.step())));
    }
    group.finish();
    let bytes = model.bytes() as f64 / units as f64;
    let entry = |threads: usize| {
        json!({
            "group": row.kind, "name": row.name(threads), "model": row.model, "threads": threads,
            "nodes": row.nodes, "units": units, "bytes": bytes,
        })
    };
    THREADS.map(entry).to_vec()
}

/// Writes the list of models below the target folder.
fn write(list: &[Value]) {
    let target = std::env::var_os("CARGO_TARGET_DIR").map(PathBuf::from);
    let target = target.unwrap_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("target"));
    let folder = target.join("bench");
    std::fs::create_dir_all(&folder).expect("a folder for the results");
    let text = serde_json::to_string_pretty(list).expect("numbers");
    std::fs::write(folder.join("models.json"), text + "\n").expect("a file for the results");
}

criterion_group! { name = benches; config = config(); targets = limits::memory, limits::arithmetic, models }
criterion_main!(benches);
