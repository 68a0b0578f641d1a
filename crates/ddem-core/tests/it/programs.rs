//! Features for programs beyond decks: own forces, computed histories, and stopping long
//! operations.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use ddem_core::law::{JointLaw, Softening};
use ddem_core::{Function, Model, Relaxed, RunError, Simd, Simulation};
use ddem_deck::*;

use crate::cavities::{everywhere, gas, hollow};
use crate::decks::*;

/// Pillar of three blocks on a fixed base, with a traction at its top.
fn pillar(history: Option<History>) -> Deck {
    let mut deck = deck([1, 1, 3], [1.0, 1.0, 3.0], 2, 0.01);
    deck.model.gravity = [0.0, 0.0, -9.81];
    deck.fix = vec![fix(plane(2, 0.0), "xyz")];
    let push = Some([2e5, 0.0, 0.0]);
    deck.load = vec![Load { r#where: plane(2, 3.0), traction: push, history, ..Load::default() }];
    deck
}

fn started(model: Model) -> Simulation {
    let mut simulation = Simulation::new(model);
    let damping = Damping::Ratio(0.01);
    simulation.start(damping, TimeStep::Auto, None).unwrap_or_else(|error| panic!("{error}"));
    simulation
}

fn steps(simulation: &mut Simulation, count: usize) {
    for _ in 0..count {
        simulation.step().unwrap_or_else(|error| panic!("{error}"));
    }
}

/// Top nodes, and nodal forces equal to the load of the deck.
fn push(model: &Model) -> (Vec<u32>, Vec<[f64; 3]>) {
    let nodes = plane(2, 3.0).nodes(model).unwrap();
    // Corner, edge and middle nodes of 2 × 2 elements.
    let share = |node: u32| {
        let [x, y, _] = model.point(node as usize);
        let inner = [x, y].iter().filter(|&&x| x == 0.5).count();
        [2e5 / 16.0 * f64::from(1u32 << inner), 0.0, 0.0]
    };
    let forces = nodes.iter().map(|&node| share(node)).collect();
    (nodes, forces)
}

#[test]
fn applied_forces_equal_a_load() {
    let mut loaded = started(model(&pillar(None)));
    let free = Deck { load: Vec::new(), ..pillar(None) };
    let mut pushed = started(model(&free));
    let (nodes, forces) = push(loaded.model());
    pushed.apply_force(&nodes, &forces);
    for _ in 0..5 {
        steps(&mut loaded, 40);
        steps(&mut pushed, 40);
        let size =
            1e-12 * loaded.displacements().iter().flatten().fold(0.0, |m, u| f64::max(m, u.abs()));
        for (a, b) in loaded.displacements().iter().zip(pushed.displacements()) {
            assert!((0..3).all(|c| (a[c] - b[c]).abs() <= size), "{a:?} {b:?}");
        }
        let (a, b) = (loaded.energy(), pushed.energy());
        assert!((a.external_work - b.external_work).abs() < 1e-10 * a.external_work.abs());
        assert!((a.balance - b.balance).abs() < 1e-10 * b.external_work.abs(), "{a:?} {b:?}");
    }
}

#[test]
fn applied_forces_replace_earlier_ones() {
    let free = Deck { load: Vec::new(), ..pillar(None) };
    let mut simulation = started(model(&free));
    let top = plane(2, 3.0).nodes(simulation.model()).unwrap()[0];
    let pull = |simulation: &mut Simulation| simulation.forces()[top as usize][1];
    let before = pull(&mut simulation);
    // Entries of one call add up.
    simulation.apply_force(&[top, top], &[[0.0, 5.0, 0.0], [0.0, 2.0, 0.0]]);
    assert!((pull(&mut simulation) - before - 7.0).abs() < 1e-9);
    // Those of another call replace them, also when a stage begins.
    simulation.apply_force(&[top], &[[0.0, 3.0, 0.0]]);
    simulation.enter(0).unwrap_or_else(|error| panic!("{error}"));
    assert!((pull(&mut simulation) - before - 3.0).abs() < 1e-9);
    // They are also part of a saved simulation.
    let saved = simulation.save();
    let mut restored = Simulation::restore(model(&free), Simd::default(), &saved)
        .unwrap_or_else(|error| panic!("{error}"));
    assert!((pull(&mut restored) - before - 3.0).abs() < 1e-9);
    simulation.apply_force(&[top], &[[0.0; 3]]);
    assert!((pull(&mut simulation) - before).abs() < 1e-9);
}

/// The reaction of the base balances the forces of the program.
#[test]
fn relaxation_balances_applied_forces() {
    let mut free = Deck { load: Vec::new(), ..pillar(None) };
    free.model.gravity = [0.0; 3];
    let mut simulation = Simulation::new(model(&free));
    let (nodes, forces) = push(simulation.model());
    simulation.apply_force(&nodes, &forces);
    simulation.relax(1e-9, 20_000).unwrap_or_else(|error| panic!("{error}"));
    let base = plane(2, 0.0).nodes(simulation.model()).unwrap();
    let reaction = simulation.reaction(&base);
    assert!((reaction[0] + 2e5).abs() < 1e-2, "{reaction:?}");
}

#[test]
fn computed_history_equals_its_table() {
    let ramp = History::Ramp(2e-3);
    let mut given = started(model(&pillar(Some(ramp.clone()))));
    let mut model = model(&pillar(None));
    let function: Arc<Function> = Arc::new(move |time| Ok(ramp.factor(time)));
    model.set_load_history(0, function.clone()).unwrap_or_else(|fault| panic!("{fault}"));
    assert_eq!(model.computed(), ["load[0].history"]);
    assert!(model.set_load_history(1, function.clone()).is_err());
    assert!(model.set_fix_history(1, function).is_err());
    let mut computed = started(model);
    steps(&mut given, 150);
    steps(&mut computed, 150);
    assert_eq!(given.displacements(), computed.displacements());
}

#[test]
fn failing_history_moves_nothing() {
    let mut deck = pillar(None);
    deck.stage = vec![relax_stage("only")];
    let mut model = model(&deck);
    let until: Arc<Function> =
        Arc::new(|time| if time < 1e-4 { Ok(1.0) } else { Err("it is late".into()) });
    model.set_load_history(0, until).unwrap_or_else(|fault| panic!("{fault}"));
    let mut simulation = started(model);
    let error = loop {
        let before = simulation.displacements();
        if let Err(error) = simulation.step() {
            assert_eq!(simulation.displacements(), before);
            break error;
        }
    };
    let RunError::HistoryFailed { entry, time, message } = &error else { panic!("{error}") };
    assert_eq!((entry.as_str(), message.as_str()), ("load[0]", "it is late"));
    assert!(*time >= 1e-4);
    // Evaluating the energy is no step and gives no error.
    assert!(simulation.energy().balance.is_finite());
    assert_eq!(simulation.start_relaxation(1), Err(error));
}

#[test]
fn long_operations_can_be_stopped() {
    let mut simulation = Simulation::new(model(&pillar(None)));
    let before = simulation.save();
    simulation.stop_when(Arc::new(AtomicBool::new(true)));
    assert_eq!(simulation.critical_step(), Err(RunError::Stopped));
    assert_eq!(simulation.start(Damping::None, TimeStep::Auto, None), Err(RunError::Stopped));
    assert_eq!(simulation.save(), before);
    assert_eq!(simulation.start_relaxation(1), Err(RunError::Stopped));
    simulation.stop_when(Arc::default());
    simulation.relax(1e-6, 20_000).unwrap_or_else(|error| panic!("{error}"));
}

#[test]
fn far_too_short_steps_are_refused() {
    let mut simulation = Simulation::new(model(&pillar(None)));
    let mut start = |step, duration| simulation.start(Damping::None, step, duration);
    let is_short = |started| matches!(started, Err(RunError::TooShort { .. }));
    assert!(is_short(start(TimeStep::Seconds(1e-320), None)));
    assert!(is_short(start(TimeStep::Auto, Some(1e-300))));
    assert!(start(TimeStep::Seconds(1e-7), None).is_ok());
}

/// A relaxation does not ask again for known factors. Resumed from a checkpoint, it continues
/// although the program has no more factors.
#[test]
fn relaxation_resumes_without_history_calls() {
    let mut deck = hollow(BOX, &[[1.0; 3]], 0.1);
    deck.fix = vec![fix(plane(2, 0.0), "xyz")];
    deck.charge = vec![gas(everywhere(), 1e6)];
    let mute = Arc::new(AtomicBool::new(false));
    let computed = || {
        let mut model = model(&deck);
        let mute = mute.clone();
        let function: Arc<Function> = Arc::new(move |_| match mute.load(Ordering::Relaxed) {
            true => Err("no factor any more".to_owned()),
            false => Ok(0.5),
        });
        let set = model.set_charge_history(0, function);
        set.unwrap_or_else(|fault| panic!("{fault}"));
        model
    };
    let on = |simulation: &mut Simulation| {
        for _ in 0..5000 {
            let relaxed = simulation.relax_step(1e-6).unwrap_or_else(|error| panic!("{error}"));
            if relaxed != Relaxed::Moving {
                return relaxed;
            }
        }
        panic!("no equilibrium")
    };
    let mut whole = Simulation::new(computed());
    whole.start_relaxation(3).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(on(&mut whole), Relaxed::Increment(1));
    let saved = whole.save();
    let model = computed();
    mute.store(true, Ordering::Relaxed);
    let parts = Simulation::restore(model, Simd::default(), &saved);
    let mut parts = parts.unwrap_or_else(|error| panic!("{error}"));
    for simulation in [&mut whole, &mut parts] {
        assert_eq!(on(simulation), Relaxed::Increment(2));
        assert_eq!(on(simulation), Relaxed::Done);
    }
    assert_eq!(bits(&whole.displacements()), bits(&parts.displacements()));
}

/// Dry friction as a law of the program.
#[derive(Debug)]
pub(crate) struct DryFriction(pub(crate) f64);

impl JointLaw for DryFriction {
    fn tension(&self) -> f64 {
        0.0
    }

    fn peak(&self, normal: f64) -> f64 {
        (-normal * self.0).max(0.0)
    }

    fn residual(&self, normal: f64) -> f64 {
        self.peak(normal)
    }
}

/// Cohesion as a law of the program.
#[derive(Debug)]
struct Cohesion(f64);

impl JointLaw for Cohesion {
    fn tension(&self) -> f64 {
        0.0
    }

    fn peak(&self, _: f64) -> f64 {
        self.0
    }

    fn residual(&self, _: f64) -> f64 {
        0.0
    }
}

#[test]
fn laws_with_invalid_strength_are_refused() {
    let mut model = model(&deck([1, 1, 2], [2.0, 2.0, 1.0], 1, 0.01));
    for (cohesion, reported) in [(f64::NAN, "NaN"), (-2.5, "-2.5")] {
        let refused =
            model.set_law("seam", Arc::new(Cohesion(cohesion))).map_err(|e| e.to_string());
        let expected =
            format!("joints.seam: peak(0) is {reported}, expected 0 Pa or more [invalid-law]");
        assert_eq!(refused, Err(expected));
    }
    assert!(model.set_law("seam", Arc::new(Cohesion(f64::INFINITY))).is_ok());
}

/// Law made of functions that the test replaces by wrong ones, one at a time.
#[derive(Clone, Copy, Debug)]
struct Odd {
    tension: f64,
    peak: fn(f64) -> f64,
    residual: fn(f64) -> f64,
    dilation: f64,
    contact: fn(f64) -> f64,
    tan: Option<f64>,
    softening: Option<Softening>,
    sees: Option<bool>,
}

fn half(normal: f64) -> f64 {
    (-normal * 0.5).max(0.0)
}

const SOUND: Odd = Odd {
    tension: 1e3,
    peak: |normal| (1e3 - normal * 0.5).max(0.0),
    residual: half,
    dilation: 0.5,
    contact: half,
    tan: Some(0.5),
    softening: None,
    sees: None,
};

impl JointLaw for Odd {
    fn tension(&self) -> f64 {
        self.tension
    }

    fn peak(&self, normal: f64) -> f64 {
        (self.peak)(normal)
    }

    fn residual(&self, normal: f64) -> f64 {
        (self.residual)(normal)
    }

    fn tan_dilation(&self) -> f64 {
        self.dilation
    }

    fn contact_strength(&self, normal: f64) -> f64 {
        (self.contact)(normal)
    }

    fn tan_contact_friction(&self) -> Option<f64> {
        self.tan
    }

    fn softening(&self) -> Option<Softening> {
        self.softening
    }

    fn any_failure(&self, normal: &[f64], shear_squared: &[f64]) -> bool {
        let mut points = normal.iter().zip(shear_squared);
        self.sees.unwrap_or_else(|| {
            points.any(|(&n, &s)| n > self.tension || s > (self.peak)(n).powi(2))
        })
    }
}

/// Law with tensile strength only.
#[derive(Debug)]
struct Frictionless;

impl JointLaw for Frictionless {
    fn tension(&self) -> f64 {
        1e12
    }

    fn peak(&self, _: f64) -> f64 {
        0.0
    }

    fn residual(&self, _: f64) -> f64 {
        0.0
    }
}

#[test]
fn laws_that_create_energy_or_never_fail_are_refused() {
    let mut model = model(&deck([1, 1, 2], [2.0, 2.0, 1.0], 1, 0.01));
    let softening = |opening, sliding| Some(Softening { opening, sliding });
    let odd = [
        Odd { tension: f64::INFINITY, ..SOUND },
        Odd { dilation: 0.51, ..SOUND },
        Odd { dilation: f64::NAN, ..SOUND },
        Odd { dilation: -0.1, ..SOUND },
        Odd { peak: |n| 1e3 - n * 0.5 - 4.0 * n.max(0.0), ..SOUND },
        Odd { residual: |n| if n < -1e9 { f64::NAN } else { half(n) }, ..SOUND },
        Odd { residual: |_| f64::INFINITY, ..SOUND },
        Odd { peak: |_| -2.5, ..SOUND },
        Odd { contact: |n| 10.0 + half(n), ..SOUND },
        Odd { contact: |n| -half(n), ..SOUND },
        Odd { tan: Some(0.6), ..SOUND },
        Odd { tan: Some(-0.5), ..SOUND },
        Odd { softening: softening(-1e-3, 10.0), ..SOUND },
        Odd { softening: softening(1e-3, f64::NAN), ..SOUND },
        Odd { sees: Some(false), ..SOUND },
        Odd { sees: Some(true), ..SOUND },
    ];
    let refused = odd.map(|law| {
        let refused = model.set_law("seam", Arc::new(law)).err();
        refused.unwrap_or_else(|| panic!("{law:?} is accepted")).to_string()
    });
    insta::assert_snapshot!(refused.join("\n"));
    for law in [SOUND, Odd { tan: None, ..SOUND }] {
        assert!(model.set_law("seam", Arc::new(law)).is_ok());
    }
    // The check finds no failure unless the shear exceeds rounding, so it accepts this law.
    assert!(model.set_law("seam", Arc::new(Frictionless)).is_ok());
}

/// A block that slides until contacts replace its joint keeps the friction of the program's law.
#[test]
fn contacts_have_friction_of_program_law() {
    let mut deck = deck([1, 1, 2], [2.0, 2.0, 1.0], 4, 0.01);
    let held = Where { z: Some(Extent::Range([0.0, 0.499])), ..Where::default() };
    deck.fix = vec![fix(held, "xyz")];
    let (sine, cosine) = 30_f64.to_radians().sin_cos();
    deck.model.gravity = [9.81 * sine, 0.0, -9.81 * cosine];
    let mut model = model(&deck);
    let set = model.set_law("seam", Arc::new(DryFriction(0.3)));
    set.unwrap_or_else(|fault| panic!("{fault}"));
    let mut simulation = Simulation::new(model);
    let start = simulation.start(Damping::None, TimeStep::Auto, Some(0.75));
    for _ in 0..start.unwrap_or_else(|error| panic!("{error}")) {
        simulation.step().unwrap_or_else(|error| panic!("{error}"));
    }
    assert!(!simulation.contacts().is_empty(), "the joint is still there");
    let exact = 9.81 * (sine - 0.3 * cosine) * simulation.time();
    let top = simulation.model().nearest_node([1.0, 1.0, 1.0]);
    let speed = simulation.velocity(top)[0];
    assert!((speed / exact - 1.0).abs() < 5e-3, "{speed}, not {exact}");
}
