use ddem_core::deck::*;
use ddem_core::*;
fn deck(count: [u32; 3], size: [f64; 3], n: u32, t: f64) -> Deck {
    let mut deck = Deck::default();
    deck.materials.insert("rock".into(), Material { density: 2400.0, young: 18e9, poisson: 0.25 });
    deck.joints.insert(
        "seam".into(),
        Joint { thickness: t, material: Some("rock".into()), ..Default::default() },
    );
    deck.blocks.push(BlockSet {
        size: Some(size),
        count: Some(count),
        divisions: n,
        material: "rock".into(),
        joint: Some(JointChoice::All("seam".into())),
        ..Default::default()
    });
    deck
}
fn p(x: f64) -> Option<Extent> {
    Some(Extent::Plane(x))
}
fn main() {
    let mut d = deck([12, 3, 3], [12.0, 3.0, 3.0], 4, 0.01);
    d.fix.push(Fix {
        region: Where { x: p(0.0), z: p(0.0), ..Default::default() },
        axes: "xz".into(),
        ..Default::default()
    });
    d.fix.push(Fix {
        region: Where { x: p(12.0), z: p(0.0), ..Default::default() },
        axes: "z".into(),
        ..Default::default()
    });
    d.fix.push(Fix {
        region: Where { x: p(0.0), y: p(0.0), z: p(0.0), ..Default::default() },
        axes: "y".into(),
        ..Default::default()
    });
    d.fix.push(Fix {
        region: Where { x: p(12.0), y: p(0.0), z: p(0.0), ..Default::default() },
        axes: "y".into(),
        ..Default::default()
    });
    d.load.push(Load {
        region: Where { x: p(6.0), z: p(3.0), ..Default::default() },
        line: Some([0.0, 0.0, -600e3]),
        ..Default::default()
    });
    d.stage.push(Stage { name: "load".into(), ..Default::default() });
    for kin in [Kinematics::Small, Kinematics::Corotational] {
        d.model.kinematics = kin;
        let model = Model::new(&d).unwrap();
        println!("{} nodes {:?}", model.n_nodes(), model.volumes());
        let node = model.nearest_node([6.0, 1.5, 0.0]);
        let mut sim = Simulation::new(model);
        println!("critical {}", sim.critical_step());
        for tol in [1e-6, 1e-8, 1e-10] {
            let t = std::time::Instant::now();
            let steps = sim.relax(tol, 100000);
            println!("{tol} {steps:?} {:?} {:?}", sim.displacement(node), t.elapsed());
        }
        println!("{:?}", sim.energy());
    }
    for (count, steps) in [([4, 4, 4], 8000u64), ([10, 10, 10], 300), ([20, 20, 20], 60)] {
        for kin in [Kinematics::Small, Kinematics::Corotational] {
            let mut d = deck(count, count.map(|c| c as f64), 4, 0.01);
            d.model.kinematics = kin;
            let t = std::time::Instant::now();
            let mut sim = Simulation::new(Model::new(&d).unwrap());
            let b = t.elapsed();
            let c = sim.critical_step();
            println!("build {b:?} crit {:?} {c}", t.elapsed() - b);
            for threads in [1, 2] {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                sim.start(Damping::None, TimeStep::Auto, None).unwrap();
                sim.step().unwrap();
                let t = std::time::Instant::now();
                pool.install(|| {
                    for _ in 0..steps {
                        sim.step().unwrap();
                    }
                });
                let n = sim.model().n_nodes() as f64 * steps as f64;
                println!(
                    "{kin:?} {threads} threads {:.1} M/s",
                    n / t.elapsed().as_secs_f64() / 1e6
                );
            }
        }
    }
}
