//! Contacts that replace a joint carry the strength that its law leaves to bare faces.

use std::sync::Arc;

use ddem_core::law::JointLaw;
use ddem_core::{Simd, Simulation};
use ddem_deck::*;

use crate::decks::*;

/// Slope of all sliding blocks, steeper than any friction `[degrees]`.
const SLOPE: f64 = 60.0;
/// Density of the blocks times their height `[kg/m²]`.
const HEAVY: f64 = 2400.0 * 0.1;
const JRC: f64 = 8.0;
const JCS: f64 = 30e6;
const BASIC: f64 = 26.0;

/// Barton's law: τ = σ tan(JRC log10(JCS/σ) + φ_r).
fn barton(pressure: f64) -> f64 {
    pressure * (JRC * (JCS / pressure).log10() + BASIC).to_radians().tan()
}

/// Law with roughness that sliding does not wear, and cohesion that opening removes.
#[derive(Debug)]
struct Rough {
    cohesion: f64,
}

impl JointLaw for Rough {
    fn tension(&self) -> f64 {
        0.0
    }

    fn peak(&self, normal: f64) -> f64 {
        self.residual(normal)
    }

    fn residual(&self, normal: f64) -> f64 {
        self.cohesion + if normal < 0.0 { barton(-normal) } else { 0.0 }
    }
}

fn section(normal: f64) -> Joint {
    Joint { normal_stiffness: Some(normal), shear_stiffness: Some(normal), ..Joint::default() }
}

/// Rigid slab of 2 × 2 × 0.1 m on a fixed bed of 4 × 4 m, which it does not leave; gravity pulls it
/// down a slope. The slab is so flat that the pressure below it is almost uniform. Slab and bed are
/// two sets, so their overlap is constant.
fn slab(gravity: f64, joint: Joint) -> Deck {
    let mut deck = deck([1, 1, 1], [2.0, 2.0, 0.1], 1, 0.0);
    deck.joints = [("seam".to_owned(), joint)].into();
    deck.blocks[0].body = Body::Rigid;
    let (origin, count) = ([0.0, 0.0, -0.5], Some([2, 2, 1]));
    deck.blocks.push(BlockSet {
        origin,
        size: Some([4.0, 4.0, 0.5]),
        count,
        ..deck.blocks[0].clone()
    });
    let bed = Where { z: Some(Extent::Range([-0.5, 0.0])), ..Where::default() };
    deck.fix.push(fix(bed, "xyz"));
    let (sine, cosine) = SLOPE.to_radians().sin_cos();
    deck.model.gravity = [gravity * sine, 0.0, -gravity * cosine];
    deck
}

fn pressure(gravity: f64) -> f64 {
    HEAVY * gravity * SLOPE.to_radians().cos()
}

fn until(simulation: &mut Simulation, x: f64) -> [f64; 2] {
    let top = simulation.model().nearest_node([1.0, 1.0, 0.1]);
    for _ in 0..200_000 {
        if simulation.displacement(top)[0] > x {
            return [simulation.time(), simulation.velocity(top)[0]];
        }
        simulation.step().unwrap_or_else(|error| panic!("{error}"));
    }
    panic!("it does not slide: {:?}", simulation.displacement(top));
}

/// Shear strength of the contacts from the acceleration of the slab between 1.2 and 1.7 m. Its
/// joint is released after 1 m.
fn resistance(model: ddem_core::Model, gravity: f64) -> f64 {
    let mut simulation = Simulation::new(model);
    let started = simulation.start(Damping::None, TimeStep::Auto, None);
    started.unwrap_or_else(|error| panic!("{error}"));
    let [t, v] = until(&mut simulation, 1.2);
    assert!(simulation.contact_counts().block_pairs > 0, "the joint is still there");
    let [later, faster] = until(&mut simulation, 1.7);
    let energy = simulation.energy();
    assert!(energy.balance.abs() < 1e-4 * energy.friction, "{energy:?}");
    let acceleration = (faster - v) / (later - t);
    HEAVY * (gravity * SLOPE.to_radians().sin() - acceleration)
}

/// Pressures of 7 kPa, 70 kPa and 1.1 MPa: no constant friction fits two of them.
#[test]
fn contacts_have_roughness_of_program_law() {
    for gravity in [60.0, 600.0, 9000.0] {
        for cohesion in [0.0, 500.0] {
            let mut model = model(&slab(gravity, section(1e10)));
            let set = model.set_law("seam", Arc::new(Rough { cohesion }));
            set.unwrap_or_else(|fault| panic!("{fault}"));
            let (found, exact) = (resistance(model, gravity), barton(pressure(gravity)));
            println!(
                "{gravity} m/s², cohesion {cohesion} Pa: {found:.4e} Pa, exact {exact:.4e} Pa"
            );
            assert!((found / exact - 1.0).abs() < 2e-3, "{gravity}: {found} Pa, not {exact} Pa");
        }
    }
}

/// A joint with Barton's law drops to σ tan φ_r at failure, and its contact keeps this
/// strength.
#[test]
fn contacts_of_barton_joint_have_residual_strength() {
    for gravity in [60.0, 9000.0] {
        let joint = Joint {
            jrc: Some(JRC),
            jcs: Some(JCS),
            residual_friction: Some(BASIC),
            ..section(1e10)
        };
        let found = resistance(model(&slab(gravity, joint)), gravity);
        let exact = pressure(gravity) * BASIC.to_radians().tan();
        assert!((found / exact - 1.0).abs() < 2e-3, "{gravity}: {found} Pa, not {exact} Pa");
    }
}

/// Two blocks of one set; the upper one slides until its joint is released. At every contact point
/// friction follows the pressure there, and a state saved during sliding continues with the same
/// bits.
#[test]
fn contact_takes_over_law_of_released_joint() {
    let mut deck = slab(600.0, section(1e10));
    deck.blocks.truncate(1);
    deck.blocks[0].count = Some([1, 1, 2]);
    (deck.blocks[0].body, deck.blocks[0].divisions) = (Body::Deformable, 4);
    deck.fix = vec![fix(plane(2, 0.0), "xyz")];
    let rough = || {
        let mut model = model(&deck);
        let set = model.set_law("seam", Arc::new(Rough { cohesion: 0.0 }));
        set.unwrap_or_else(|fault| panic!("{fault}"));
        model
    };
    let mut whole = Simulation::new(rough());
    let started = whole.start(Damping::None, TimeStep::Auto, None);
    started.unwrap_or_else(|error| panic!("{error}"));
    until(&mut whole, 0.3);
    let parts = Simulation::restore(rough(), Simd::default(), &whole.save());
    let mut parts = parts.unwrap_or_else(|error| panic!("{error}"));
    for simulation in [&mut whole, &mut parts] {
        until(simulation, 0.4);
    }
    assert_eq!(bits(&whole.displacements()), bits(&parts.displacements()));
    let contacts = whole.contacts();
    assert!(contacts.len() >= 4, "the joint is still there");
    // Areas are scaled slightly where the energy of the springs requires it.
    let area: f64 = contacts.iter().map(|contact| contact.area).sum();
    let top = whole.model().nearest_node([1.0, 1.0, 0.2]);
    let overlap = 2.0 * (2.0 - whole.displacement(top)[0]);
    for contact in contacts {
        let traction = contact.traction().map(|x| x * area / overlap);
        let exact = barton(traction[2].abs());
        assert!((traction[0].abs() / exact - 1.0).abs() < 2e-3, "{traction:?}, not {exact}");
    }
}
