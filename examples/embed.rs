//! A block on a slope: its settlement, its factor of safety, and a push that makes it slide.
//!
//! `cargo run --release --example embed`

use ddem::deck::{
    BlockSet, Damping, Extent, Fix, Joint, JointChoice, Material, SafetySearch, TimeStep, Where,
};
use ddem::{Deck, Simulation};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // Two blocks, one on the other; gravity leans by 25°, as on a slope.
    let lean = 25_f64.to_radians();
    let mut deck = Deck::default();
    deck.model.gravity = [9.81 * lean.sin(), 0.0, -9.81 * lean.cos()];
    deck.materials.insert("rock".into(), Material { density: 2400.0, young: 18e9, poisson: 0.25 });
    let seam = Joint {
        normal_stiffness: Some(1e10),
        shear_stiffness: Some(5e9),
        friction: Some(35.0),
        ..Joint::default()
    };
    deck.joints.insert("seam".into(), seam);
    deck.blocks.push(BlockSet {
        size: Some([2.0, 2.0, 2.0]),
        count: Some([1, 1, 2]),
        material: "rock".into(),
        joint: Some(JointChoice::All("seam".into())),
        ..BlockSet::default()
    });
    let level = |z| Where { z: Some(Extent::Plane(z)), ..Where::default() };
    deck.fix.push(Fix { r#where: level(0.0), axes: "xyz".into(), ..Fix::default() });

    let model = deck.build()?;
    let (corner, top) = (model.nearest_node([2.0, 2.0, 2.0]), level(2.0).nodes(&model)?);
    let mut simulation = Simulation::new(model);
    simulation.relax(1e-5, 20_000)?;
    let [x, y, z] = simulation.displacement(corner).map(|u| 1e3 * u);
    println!("the corner moves by ({x:.4}, {y:.4}, {z:.4}) mm");
    let safety = simulation.factor_of_safety(&SafetySearch::default(), &|_| {})?;
    println!("factor of safety {:.2}", safety.factor.unwrap_or(f64::NAN));

    // A push of 30 kN, until the block has slid by a centimetre.
    let push = vec![[30e3 / top.len() as f64, 0.0, 0.0]; top.len()];
    simulation.apply_force(&top, &push);
    simulation.start(Damping::None, TimeStep::Auto, None)?;
    while simulation.displacement(corner)[0] < 0.01 {
        simulation.step()?;
    }
    let (time, state) = (simulation.time(), simulation.state_summary());
    println!("it has slid by a centimetre after {time:.3} s");
    println!("{} of {} pairs have failed", state.joints[0].shear, state.joints[0].pairs);
    Ok(())
}
