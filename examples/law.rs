//! A joint law of the program: saw teeth that hold a block on a slope while the pressure is small.
//!
//! `cargo run --release --example law`

use ddem::deck::{BlockSet, Extent, Fix, Joint, JointChoice, Material, Where};
use ddem::{Deck, RunError, Simulation};

use std::sync::Arc;

use ddem::Model;
use ddem::law::JointLaw;

/// Patton's saw teeth: a block climbs them under a small pressure and shears them off under a large one.
#[derive(Debug)]
struct Patton {
    tan_teeth: f64,
    cohesion: f64,
    tan_friction: f64,
}

impl JointLaw for Patton {
    fn tension(&self) -> f64 {
        0.0
    }

    fn peak(&self, normal: f64) -> f64 {
        let tooth = (-normal * self.tan_teeth).min(self.cohesion - normal * self.tan_friction);
        tooth.max(0.0)
    }

    fn residual(&self, normal: f64) -> f64 {
        (-normal * self.tan_friction).max(0.0)
    }
}

fn with_teeth(deck: &Deck) -> Result<Model, Box<dyn std::error::Error>> {
    let mut model = deck.build()?;
    let teeth = Patton { tan_teeth: 1.2, cohesion: 20e3, tan_friction: 0.6 };
    model.set_law("seam", Arc::new(teeth))?;
    Ok(model)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    for height in [1.0, 6.0] {
        let mut simulation = Simulation::new(with_teeth(&slope(height))?);
        match simulation.relax(1e-5, 20_000) {
            Ok(steps) => println!("{height} m of rock rest after {steps} steps"),
            Err(error @ RunError::NoEquilibrium { .. }) => println!("{height} m of rock: {error}"),
            Err(error) => return Err(error.into()),
        }
    }
    Ok(())
}

/// Block of this height on a fixed block, under gravity as on a slope of 40°.
fn slope(height: f64) -> Deck {
    let (sine, cosine) = 40_f64.to_radians().sin_cos();
    let mut deck = Deck::default();
    deck.model.gravity = [9.81 * sine, 0.0, -9.81 * cosine];
    deck.materials.insert("rock".into(), Material { density: 2400.0, young: 18e9, poisson: 0.25 });
    let (normal, shear) = (Some(1e10), Some(5e9));
    let seam = Joint { normal_stiffness: normal, shear_stiffness: shear, ..Joint::default() };
    deck.joints.insert("seam".into(), seam);
    deck.blocks.push(BlockSet {
        size: Some([20.0, 10.0, 2.0 * height]),
        count: Some([1, 1, 2]),
        material: "rock".into(),
        joint: Some(JointChoice::All("seam".into())),
        ..BlockSet::default()
    });
    let held = Where { z: Some(Extent::Range([0.0, 0.9 * height])), ..Where::default() };
    deck.fix.push(Fix { r#where: held, axes: "xyz".into(), ..Fix::default() });
    deck
}
