//! A wall of blocks is pushed at its top until it leans by a tenth of a millimetre.
//!
//! `cargo run --release --example embed`

use ddem::deck::{BlockSet, Damping, Extent, Fix, History, Joint, JointChoice, Load, Material};
use ddem::deck::{TimeStep, Where};
use ddem::{Deck, Model, Simulation};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let plane = |z| Where { z: Some(Extent::Plane(z)), ..Where::default() };
    let mut deck = Deck { title: "wall".into(), ..Deck::default() };
    let rock = Material { density: 2400.0, young: 18e9, poisson: 0.25 };
    let seam = Joint { thickness: 0.01, material: Some("rock".into()), ..Joint::default() };
    deck.materials.insert("rock".into(), rock);
    deck.joints.insert("seam".into(), seam);
    deck.blocks.push(BlockSet {
        size: Some([1.0, 4.0, 3.0]),
        count: Some([1, 4, 3]),
        material: "rock".into(),
        joint: Some(JointChoice::All("seam".into())),
        ..BlockSet::default()
    });
    deck.fix.push(Fix { region: plane(0.0), axes: "xyz".into(), ..Fix::default() });
    let (push, ramp) = (Some([2e5, 0.0, 0.0]), Some(History::Ramp(0.05)));
    deck.load.push(Load { region: plane(3.0), traction: push, history: ramp, ..Load::default() });

    let model = Model::new(&deck)?;
    let top = model.nearest_node([0.5, 2.0, 3.0]);
    let mut simulation = Simulation::new(model);
    simulation.start(Damping::Ratio(0.05), TimeStep::Auto, None)?;
    while simulation.displacement(top)[0] < 1e-4 && simulation.time() < 0.1 {
        simulation.step()?;
    }
    let lean = 1e3 * simulation.displacement(top)[0];
    println!("leans by {lean:.4} mm at {:.4} s", simulation.time());
    Ok(())
}
