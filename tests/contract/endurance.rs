//! Long runs: nothing drifts, grows or slows down over millions of steps.

use std::sync::Arc;

use ddem_core::{Damping, Model, Simd, Simulation, TimeStep};

use super::HEAP;
use super::memory::status;
use super::shared::deck;

/// Two cubes, one on the other and joined at first, on a floor that shakes with more than gravity. The joint fails in the
/// first shock. From then on the cubes bounce, turn and slide on the floor and on each other, without end.
const SHAKEN: &str = "
[model]
gravity = [0.0, 0.0, -9.81]
[materials.rock]
density = 2400.0
young = 2e8
poisson = 0.25
[joints.weak]
thickness = 0.01
material = 'rock'
cohesion = 2e4
friction = 30.0
tension = 1e4
[[blocks]]
name = 'floor'
origin = [-200.0, -200.0, -1.0]
size = [400.0, 400.0, 1.0]
material = 'rock'
body = 'rigid'
[[blocks]]
name = 'cubes'
origin = [0.0, 0.0, 0.02]
size = [1.0, 1.0, 2.0]
count = [1, 1, 2]
divisions = 1
material = 'rock'
joint = 'weak'
[[fix]]
where = { set = 'floor' }
axes = 'xy'
velocity = [1.0, 0.5, 0.0]
[[fix]]
where = { set = 'floor' }
axes = 'z'
velocity = [0.0, 0.0, 1.0]
[[stage]]
name = 'shake'
kind = 'dynamic'
duration = 1.0
";

const STEPS: u64 = 10_000_000;
const BATCHES: u64 = 1000;
/// Energy imbalance, relative to the largest energy since the start, above which a run warns.
const MOST_IMBALANCE: f64 = 0.01;
/// Relative changes of the allocated memory and of the time of a step.
const MORE_MEMORY: f64 = 0.01;
const MORE_TIME: f64 = 0.05;

/// Processor time of this thread `[s]`.
fn processor_time() -> f64 {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").expect("Linux");
    let nanoseconds = text.split(' ').next().expect("a number");
    1e-9 * nanoseconds.parse::<f64>().expect("nanoseconds")
}

fn shaken() -> Simulation {
    let mut model: Model = deck(SHAKEN).build().expect("a model");
    for (fix, frequency) in [(0, 1.3), (1, 2.1)] {
        let angular = 2.0 * std::f64::consts::PI * frequency;
        let factor = Arc::new(move |time: f64| Ok(libm::sin(angular * time)));
        model.set_fix_history(fix, factor).expect("a driven support");
    }
    let mut simulation = Simulation::with_simd(model, Simd::default());
    simulation.start(Damping::None, TimeStep::Auto, None).expect("a time step");
    simulation
}

#[cfg(target_os = "linux")]
#[test]
#[ignore = "measures its process, in which it must run alone"]
fn ten_million_steps_neither_drift_nor_grow() {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    pool.install(|| {
        let mut simulation = shaken();
        let [mut times, mut live, mut resident] = [(); 3].map(|()| Vec::with_capacity(1000));
        let (mut imbalance, mut met) = (0.0_f64, 0);
        for _ in 0..BATCHES {
            let start = processor_time();
            for _ in 0..STEPS / BATCHES {
                simulation.step().expect("a step");
            }
            times.push(processor_time() - start);
            live.push(HEAP.allocated() as f64);
            resident.push(status("VmRSS"));
            imbalance = imbalance.max(simulation.energy().imbalance());
            met += u64::from(simulation.touching_blocks() > 0);
        }
        let quarter = times.len() / 4;
        // Other programs only slow a batch down.
        let least = |part: &[f64]| part.iter().copied().fold(f64::INFINITY, f64::min);
        let [first, last] = [least(&times[..quarter]), least(&times[3 * quarter..])];
        let energy = simulation.energy();
        // The first tenth fills the tables of contacts.
        let most = |of: &[f64]| of.iter().copied().fold(0.0, f64::max);
        let [early, all] = [&live[..live.len() / 10], &live[..]].map(most);
        let [early_resident, all_resident] = [&resident[..live.len() / 10], &resident[..]].map(most);
        let failed: u64 = simulation.failed_pairs().iter().sum();
        println!(
            "{STEPS} steps, {:.0} s simulated, {:.0} MJ of work, {failed} failed pairs: imbalance \
             {imbalance:.1e}, {early:.0} B allocated, then at most {:+.2} %, {:.1} MB resident, then at most \
             {:+.2} %, step {:.2} µs, then {:+.1} %",
            simulation.time(),
            1e-6 * energy.external_work,
            100.0 * (all / early - 1.0),
            1e-6 * early_resident,
            100.0 * (all_resident / early_resident - 1.0),
            1e6 * first * BATCHES as f64 / STEPS as f64,
            100.0 * (last / first - 1.0),
        );
        println!("{met} of {BATCHES} looks found contact");
        assert!(failed > 0 && met > 0 && met < BATCHES && energy.friction > 0.0);
        assert!(imbalance <= MOST_IMBALANCE, "{imbalance}");
        for [early, all] in [[early, all], [early_resident, all_resident]] {
            assert!(all <= (1.0 + MORE_MEMORY) * early, "{early} B, then {all} B");
        }
        assert!((last / first - 1.0).abs() <= MORE_TIME, "{first} s, then {last} s");
    });
}
