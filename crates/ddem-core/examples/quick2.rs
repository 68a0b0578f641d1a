use ddem_core::deck::*;
use ddem_core::*;
fn main() {
    let c = 4u32;
    let mut deck = Deck::default();
    if std::env::args().nth(1).is_some() {
        deck.model.kinematics = Kinematics::Small;
    }
    deck.materials.insert("rock".into(), Material { density: 2400.0, young: 18e9, poisson: 0.25 });
    deck.joints.insert(
        "seam".into(),
        Joint { thickness: 0.01, material: Some("rock".into()), ..Default::default() },
    );
    deck.blocks.push(BlockSet {
        size: Some([c as f64; 3]),
        count: Some([c; 3]),
        divisions: 4,
        material: "rock".into(),
        joint: Some(JointChoice::All("seam".into())),
        ..Default::default()
    });
    let mut sim = Simulation::new(Model::new(&deck).unwrap());
    sim.start(Damping::None, TimeStep::Auto, None).unwrap();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    pool.install(|| {
        for _ in 0..3 {
            let t = std::time::Instant::now();
            for _ in 0..4000 {
                sim.step().unwrap();
            }
            println!("{:.1} M/s", 4000.0 * 8.0 / 1e3 / t.elapsed().as_secs_f64());
            let t = std::time::Instant::now();
            for _ in 0..4000 {
                sim.evaluate_forces();
            }
            println!("forces {:.1} M/s", 4000.0 * 8.0 / 1e3 / t.elapsed().as_secs_f64());
        }
    });
}
