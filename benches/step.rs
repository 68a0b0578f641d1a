//! Node updates per second of the forces alone and of whole steps, bytes per node, and the memory
//! bandwidth of this machine in the same minute.
//!
//! `cargo bench` measures. Quote ratios from one run; numbers of two runs are not comparable.

use std::hint::black_box;
use std::time::Duration;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use ddem::deck::{BlockSet, Body, Damping, Extent, Fix, Joint, JointChoice, Kinematics, Material};
use ddem::deck::{TimeStep, Where};
use ddem::{Deck, Simulation};

/// Cubes of 1 m with four divisions and joints of rock, 1 cm thick.
fn deck(count: [u32; 3], kinematics: Kinematics) -> Deck {
    let mut deck = Deck::default();
    deck.model.kinematics = kinematics;
    let rock = Material { density: 2400.0, young: 18e9, poisson: 0.25 };
    let seam = Joint { thickness: 0.01, material: Some("rock".into()), ..Joint::default() };
    deck.materials.insert("rock".into(), rock);
    deck.joints.insert("seam".into(), seam);
    deck.blocks.push(BlockSet {
        size: Some(count.map(f64::from)),
        count: Some(count),
        material: "rock".into(),
        joint: Some(JointChoice::All("seam".into())),
        ..BlockSet::default()
    });
    deck
}

/// Strength of the joints in a benchmark.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Joints {
    /// Joints that cannot fail.
    Unbreakable,
    /// Joints that are checked in every step and hold.
    Strong,
    /// Joints of which every pair has failed and slides under pressure.
    Broken,
}

fn simulation(count: [u32; 3], kinematics: Kinematics, joints: Joints) -> Simulation {
    let mut deck = deck(count, kinematics);
    let strength = if joints == Joints::Strong { 1e12 } else { 0.0 };
    if joints != Joints::Unbreakable {
        deck.model.contact = Some(false);
        for joint in deck.joints.values_mut() {
            (joint.cohesion, joint.friction, joint.tension) =
                (Some(strength), Some(2.0), Some(strength));
        }
    }
    let model = deck.build().expect("a deck without faults");
    let mut simulation = Simulation::new(model);
    if joints == Joints::Broken {
        tear(&mut simulation);
    }
    let started = simulation.start(Damping::Ratio(0.05), TimeStep::Auto, None);
    started.expect("a stable step");
    if joints == Joints::Broken {
        while failed(&simulation) < simulation.model().n_pairs() {
            simulation.step().expect("finite numbers");
        }
        simulation.step().expect("finite numbers");
    }
    simulation
}

fn failed(simulation: &Simulation) -> usize {
    simulation.failed_pairs().iter().sum::<u64>() as usize
}

/// Sets velocities that drive the blocks towards and past each other, so that all joints fail.
fn tear(simulation: &mut Simulation) {
    let model = simulation.model();
    let middle = model.point(model.n_nodes() - 1).map(|x| x / 2.0);
    let mut velocities = Vec::with_capacity(model.n_nodes());
    for node in 0..model.n_nodes() {
        let block = model.block_of(node);
        let centre = model.point(block * model.n_nodes() / model.n_blocks());
        let aside = |k: usize| ((block * (7 + 4 * k)) % 5) as f64 - 2.0;
        velocities.push([0, 1, 2].map(|k| 0.02 * aside(k) - 0.05 * (centre[k] - middle[k])));
    }
    simulation.set_velocities(&velocities);
}

fn pool(threads: usize) -> rayon::ThreadPool {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads")
}

/// STREAM triad: the memory bandwidth that limits a step whose data exceed the cache.
fn memory(criterion: &mut Criterion) {
    let n = 1 << 24;
    let (b, c) = (vec![1.0_f64; n], vec![2.0_f64; n]);
    let mut a = vec![0.0_f64; n];
    let mut group = criterion.benchmark_group("memory");
    group.throughput(Throughput::Bytes(24 * n as u64));
    for threads in [1, 2] {
        group.bench_function(BenchmarkId::new("triad", threads), |bencher| {
            pool(threads).install(|| bencher.iter(|| triad(&mut a, black_box(&b), &c, n / 64)));
        });
    }
    group.finish();
}

fn triad(a: &mut [f64], b: &[f64], c: &[f64], grain: usize) {
    if a.len() <= grain {
        a.iter_mut().zip(b).zip(c).for_each(|((a, b), c)| *a = b + 3.0 * c);
        return;
    }
    let half = a.len() / 2;
    let ((a, a_high), (b, b_high), (c, c_high)) =
        (a.split_at_mut(half), b.split_at(half), c.split_at(half));
    rayon::join(|| triad(a, b, c, grain), || triad(a_high, b_high, c_high, grain));
}

/// First pass of a step: elastic forces of blocks and joints.
fn forces(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("forces");
    for kinematics in [Kinematics::Small, Kinematics::Corotational] {
        let mut simulation = simulation([4, 4, 4], kinematics, Joints::Unbreakable);
        group.throughput(Throughput::Elements(simulation.model().n_nodes() as u64));
        group.bench_function(BenchmarkId::new(format!("{kinematics:?}"), 8000), |bencher| {
            pool(1).install(|| bencher.iter(|| simulation.evaluate_forces()));
        });
    }
    group.finish();
}

fn steps(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("step");
    group.warm_up_time(Duration::from_secs(1)).sample_size(20);
    for count in [4, 10, 20] {
        for kinematics in [Kinematics::Small, Kinematics::Corotational] {
            let mut simulation = simulation([count; 3], kinematics, Joints::Unbreakable);
            let nodes = simulation.model().n_nodes();
            let bytes = simulation.bytes() as f64 / nodes as f64;
            eprintln!("{kinematics:?}, {nodes} nodes: {bytes:.0} bytes per node");
            group.throughput(Throughput::Elements(nodes as u64));
            for threads in [1, 2] {
                let id = BenchmarkId::new(format!("{kinematics:?}/{threads} threads"), nodes);
                group.bench_function(id, |bencher| {
                    pool(threads).install(|| bencher.iter(|| simulation.step()));
                });
            }
        }
    }
    group.finish();
}

/// Steps with joints that cannot fail, that could fail, and that have failed.
fn joints(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("joints");
    group.warm_up_time(Duration::from_secs(1)).sample_size(20);
    for count in [4, 10] {
        for joints in [Joints::Unbreakable, Joints::Strong, Joints::Broken] {
            let mut simulation = simulation([count; 3], Kinematics::Corotational, joints);
            let nodes = simulation.model().n_nodes();
            let bytes = simulation.bytes() as f64 / nodes as f64;
            eprintln!("{joints:?}, {nodes} nodes: {bytes:.0} bytes per node");
            group.throughput(Throughput::Elements(nodes as u64));
            group.bench_function(BenchmarkId::new(format!("{joints:?}"), nodes), |bencher| {
                pool(1).install(|| bencher.iter(|| simulation.step()));
            });
        }
    }
    group.finish();
}

/// Rigid cubes of 1 m, face to face: in one lattice with joints, or each as its own set in contact.
fn cubes(count: u32, joined: bool) -> Simulation {
    let mut deck = deck([count; 3], Kinematics::Corotational);
    deck.blocks[0].body = Body::Rigid;
    deck.model.gravity = [0.0, 0.0, -9.81];
    if !joined {
        let all = deck.blocks.remove(0);
        for k in 0..count.pow(3) {
            let cell = [k % count, k / count % count, k / count.pow(2)];
            let origin = cell.map(f64::from);
            let (size, count) = (Some([1.0; 3]), None);
            deck.blocks.push(BlockSet { origin, size, count, joint: None, ..all.clone() });
        }
    }
    let held = Where { z: Some(Extent::Plane(0.0)), ..Where::default() };
    deck.fix.push(Fix { region: held, axes: "xyz".into(), ..Fix::default() });
    let mut simulation = Simulation::new(deck.build().expect("a deck without faults"));
    let started = simulation.start(Damping::Local(0.8), TimeStep::Auto, None);
    started.expect("a stable step");
    for _ in 0..200 {
        simulation.step().expect("finite numbers");
    }
    simulation
}

/// Rigid cubes in face contact: time and memory per point of a joint or a contact.
fn rigid(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("rigid");
    group.warm_up_time(Duration::from_secs(1)).sample_size(10);
    for joined in [true, false] {
        let mut simulation = cubes(22, joined);
        let [contacts, _] = simulation.contact_points();
        let points = if joined { simulation.model().n_pairs() } else { contacts };
        let blocks = simulation.model().n_blocks();
        let what = if joined { "joints" } else { "contacts" };
        if !joined {
            let bytes = simulation.contact_bytes() as f64 / points as f64;
            eprintln!("{blocks} cubes, {points} points of {what}: {bytes:.0} bytes per point");
        }
        group.throughput(Throughput::Elements(points as u64));
        for threads in [1, 2] {
            let id = BenchmarkId::new(format!("{what}/{threads} threads"), blocks);
            group.bench_function(id, |bencher| {
                pool(threads).install(|| bencher.iter(|| simulation.step()));
            });
        }
    }
    group.finish();
}

criterion_group!(benches, memory, forces, steps, joints, rigid);
criterion_main!(benches);
