//! A block on a slope: results in a folder, a copy of a state in memory, and a sweep over friction
//! angles.
//!
//! `cargo run --release --example study`

use std::error::Error;
use std::path::Path;

use rayon::prelude::*;

use ddem::deck::{
    BlockSet, Damping, Extent, Fix, Joint, JointChoice, Material, SafetySearch, Stage, StageKind,
    TimeStep, Where,
};
use ddem::io::run::{Event, Observer, RunFailure, Session};
use ddem::{Deck, RunError, Simd, Simulation};

/// Receives warnings, stages, frames, samples of probes and progress.
struct Listener;

impl Observer for Listener {
    fn event(&mut self, event: Event<'_>) {
        if let Event::StageDone(stage) = event {
            println!("{} took {} steps", stage.name, stage.steps);
        }
    }
}

fn write_results(deck: &Deck, folder: &Path) -> Result<(), RunFailure> {
    let mut session = Session::new(deck, Simd::default())?;
    let weight = Stage { name: "weight".into(), kind: StageKind::Relax, ..Stage::default() };
    session.stage(&weight, Some(folder), &mut Listener)?;
    println!("{}", session.summary());
    Ok(())
}

fn copy(simulation: &Simulation) -> Result<Simulation, RunError> {
    let saved = simulation.save();
    simulation.back_to(&saved)
}

fn sweep(frictions: &[f64]) -> Result<Vec<f64>, Box<dyn Error + Send + Sync>> {
    let factor = |friction: &f64| {
        let mut simulation = Simulation::new(slope(*friction).build()?);
        simulation.relax(1e-5, 20_000)?;
        let safety = simulation.factor_of_safety(&SafetySearch::default(), &|_| {})?;
        Ok(safety.factor.unwrap_or(f64::NAN))
    };
    frictions.par_iter().map(factor).collect()
}

fn main() -> Result<(), Box<dyn Error + Send + Sync>> {
    write_results(&slope(35.0), Path::new("results/study"))?;

    // Two runs from one equilibrium, without and with a push.
    let mut simulation = Simulation::new(slope(35.0).build()?);
    simulation.relax(1e-5, 20_000)?;
    let top = simulation.model().nearest_node([2.0, 2.0, 2.0]);
    for push in [0.0, 10e3] {
        let mut copy = copy(&simulation)?;
        copy.apply_force(&[top as u32], &[[push, 0.0, 0.0]]);
        copy.start(Damping::Ratio(0.1), TimeStep::Auto, None)?;
        copy.run(200, |_| std::ops::ControlFlow::Continue(()))?;
        let [x, ..] = copy.displacement(top).map(|u| 1e3 * u);
        println!("with a push of {push} N the corner is at {x:.4} mm");
    }

    let frictions = [27.0, 30.0, 35.0, 40.0];
    for (friction, factor) in frictions.iter().zip(sweep(&frictions)?) {
        println!("friction of {friction} degrees: factor of safety {factor:.2}");
    }
    Ok(())
}

/// Two blocks, one on the other, under gravity as on a slope of 25°.
fn slope(friction: f64) -> Deck {
    let (sine, cosine) = 25_f64.to_radians().sin_cos();
    let mut deck = Deck::default();
    deck.model.gravity = [9.81 * sine, 0.0, -9.81 * cosine];
    deck.materials.insert("rock".into(), Material { density: 2400.0, young: 18e9, poisson: 0.25 });
    let seam = Joint {
        normal_stiffness: Some(1e10),
        shear_stiffness: Some(5e9),
        friction: Some(friction),
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
    let floor = Where { z: Some(Extent::Plane(0.0)), ..Where::default() };
    deck.fix.push(Fix { r#where: floor, axes: "xyz".into(), ..Fix::default() });
    deck
}
