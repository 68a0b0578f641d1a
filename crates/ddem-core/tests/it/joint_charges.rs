//! Invalid charges, and charges in joints that have closed.

use ddem_core::Simulation;
use ddem_deck::*;

use crate::cavities::*;
use crate::decks::*;

#[test]
fn invalid_charges_are_refused() {
    let hole = ball([1.5; 3], 0.7);
    let plain = hollow(BOX, &[[1.0; 3]], 0.1);
    let with = |charge: Charge| Deck { charge: vec![charge], ..plain.clone() };
    let good = gas(hole.clone(), 1e6);
    model(&with(good.clone()));
    let mass =
        Charge { mass: Some(1.0), pressure: None, gamma: None, history: None, ..good.clone() };
    let named = |name: &str| Some(Explosive::Named(name.into()));
    refused(&with(mass.clone()), &["charge[0].mass", "needs `explosive`", "anfo"]);
    let wrong = Charge { explosive: named("amfo"), ..mass.clone() };
    refused(&with(wrong), &["charge[0].explosive", "amfo", "did you mean `anfo`"]);
    let flat = Detonation { density: 1000.0, detonation_velocity: 4e3, gamma: 1.0 };
    let own = |numbers| Charge { explosive: Some(Explosive::Given(numbers)), ..mass.clone() };
    refused(&with(own(flat)), &["charge[0].explosive.gamma", "above 1"]);
    let light = Detonation { density: 1.6, gamma: 3.0, ..flat };
    refused(&with(own(light)), &["charge[0].explosive.density", "kg/m³"]);
    refused(&with(Charge { mass: Some(1.0), ..good.clone() }), &["charge[0].pressure", "`mass`"]);
    refused(&with(Charge { pressure: None, ..good.clone() }), &["charge[0]", "no strength"]);
    refused(&with(Charge { gamma: Some(0.9), ..good.clone() }), &["charge[0].gamma", "above 1"]);
    refused(&with(Charge { gamma: None, ..good.clone() }), &["charge[0].history", "needs `gamma`"]);
    refused(&with(Charge { delay: Some(-1.0), ..good.clone() }), &["charge[0].delay", "0 or more"]);
    let everywhere = Charge { r#where: Where::default(), ..good.clone() };
    refused(&with(everywhere), &["charge[0].where", "names no part"]);
    let away = Charge { r#where: ball([9.0; 3], 0.5), ..good.clone() };
    refused(&with(away), &["charge[0].where", "selects nothing", "nearest is a joint"]);
    let beside = Charge { r#where: ball([1.5; 3], 0.2), ..good.clone() };
    refused(&with(beside), &["nearest is a wall of a cavity"]);
    let mut timed = with(Charge { delay: Some(1.0), ..good.clone() });
    timed.stage =
        vec![Stage { kind: StageKind::Dynamic, duration: Some(0.1), ..relax_stage("blast") }];
    refused(&timed, &["charge[0].delay", "never detonates"]);
    let slow = History::Duvall(Duvall { alpha: 2e3, beta: 1e3 });
    refused(&with(given(hole.clone(), 1e6, slow)), &["charge[0].history.duvall.beta", "above"]);
    let both = Triangle { rise: 1.0, fall: Some(1.0), duration: Some(3.0) };
    refused(
        &with(given(hole.clone(), 1e6, History::Triangle(both))),
        &["charge[0].history.triangle.duration", "cannot be combined with `fall`"],
    );
    let line = Cylinder { from: [1.0; 3], to: [1.0; 3], radius: 1.0 };
    let region = Where { cylinder: Some(line), ..Where::default() };
    refused(&with(gas(region, 1e6)), &["charge[0].where.cylinder.to", "no length"]);
    let mut open = hollow(BOX, &[[0.0, 1.0, 1.0]], 0.1);
    open.charge = vec![gas(ball([0.5, 1.5, 1.5], 0.7), 1e6)];
    let warnings = crate::decks::warnings(&open);
    assert!(warnings.iter().any(|w| w.contains("open to the outside")), "{warnings:?}");
}

/// Gas without volume is refused for any axes, and so is gas that would never expand.
#[test]
fn gas_needs_volume_and_expansion() {
    let mut deck = with_axes(deck([2, 2, 1], [2.0, 2.0, 1.0], 2, 0.0), BOX);
    let stiff = Some(1e10);
    let springs = Joint { normal_stiffness: stiff, shear_stiffness: stiff, ..Joint::default() };
    deck.joints.insert("seam".into(), springs);
    deck.charge = vec![gas(everywhere(), 1e8)];
    for axes in [BOX, LEANING, OBLIQUE] {
        refused(&with_axes(deck.clone(), axes), &["charge[0].history", "no volume to expand from"]);
    }
    let hole = hollow(BOX, &[[1.0; 3]], 0.1);
    let constant = Charge { history: None, ..gas(ball([1.5; 3], 0.7), 1e6) };
    refused(&Deck { charge: vec![constant], ..hole }, &["charge[0].gamma", "has no effect"]);
}

/// Explosive in a joint starts at its detonation pressure, however far the weight has closed the
/// joint before.
#[test]
fn explosive_in_closed_joint_starts_at_detonation_pressure() {
    let mut deck = deck([1, 1, 2], [1.0, 1.0, 2.0], 1, 0.0);
    let springs =
        Joint { normal_stiffness: Some(1e9), shear_stiffness: Some(1e9), ..Joint::default() };
    deck.joints.insert("seam".into(), springs);
    deck.fix = vec![fix(plane(2, 0.0), "xyz")];
    let traction = Some([0.0, 0.0, -5e5]);
    deck.load = vec![Load { r#where: plane(2, 2.0), traction, ..Load::default() }];
    let dynamic =
        |name: &str| Stage { kind: StageKind::Dynamic, duration: Some(1e-3), ..relax_stage(name) };
    deck.stage = vec![relax_stage("weight"), dynamic("blast")];
    // The load closes the joint by 0.5 mm; the explosive fills 0.1 mm.
    deck.charge = vec![Charge {
        mass: Some(0.16),
        explosive: Some(Explosive::Named("tnt".into())),
        r#where: plane(2, 1.0),
        from: Some("blast".into()),
        ..Charge::default()
    }];
    let mut simulation = Simulation::new(model(&deck));
    simulation.relax(1e-6, 20_000).unwrap_or_else(|error| panic!("{error}"));
    simulation.enter(1).unwrap_or_else(|error| panic!("{error}"));
    let went_off = state(&simulation, 0).pressure;
    let Some(tnt) = Explosive::Named("tnt".into()).detonation() else {
        panic!("no such explosive")
    };
    assert!((went_off / tnt.pressure() - 1.0).abs() < 1e-12, "{went_off:e}");
    simulation
        .start(Damping::None, TimeStep::Seconds(1e-8), None)
        .unwrap_or_else(|error| panic!("{error}"));
    let start = state(&simulation, 0).volume;
    for _ in 0..200 {
        simulation.step().unwrap_or_else(|error| panic!("{error}"));
    }
    let now = state(&simulation, 0);
    let own = 0.16 / tnt.density;
    let exact = went_off * (own / (own + now.volume - start)).powf(tnt.gamma);
    assert!(now.pressure < 0.999 * went_off, "{now:?}");
    assert!((now.pressure / exact - 1.0).abs() < 1e-9, "{now:?} {exact:e}");
}

/// A warning counts the walls of a hole that `where` does not reach.
#[test]
fn walls_outside_charge_region_warn() {
    let mut deck = hollow(BOX, &[[1.0; 3]], 0.1);
    let line = Cylinder { from: [1.5, 1.5, 0.9], to: [1.5, 1.5, 2.1], radius: 0.2 };
    let region = Where { cylinder: Some(line), ..Where::default() };
    deck.charge = vec![gas(region, 1e6)];
    let warnings = crate::decks::warnings(&deck);
    assert!(warnings.iter().any(|w| w.contains("pushes 2 of the 6 walls")), "{warnings:?}");
}

/// Gas much stiffer than its joint: `p₀ (1 + x)^−γ = (E_j + E t/2L) x`. Here x is the opening
/// divided by the thickness t, and L is the length of each block.
#[test]
fn joint_relaxes_under_stiffer_gas() {
    let t = 1e-3;
    for parts in [1, 4] {
        let mut deck = deck([1, 1, 2], [1.0, 1.0, 2.0], 2, t);
        for (name, young) in [("rock", 18e9), ("clay", 1e8)] {
            let stuff = Material { density: 2400.0, young, poisson: 0.0 };
            deck.materials.insert(name.into(), stuff);
        }
        deck.model.kinematics = Kinematics::Small;
        deck.fix = vec![fix(Where::default(), "xy")];
        deck.fix.extend([0.0, 2.0].map(|z| fix(plane(2, z), "z")));
        deck.charge = vec![gas(plane(2, 1.0), 2e8)];
        let mut simulation = simulation(&deck);
        simulation.start_relaxation(parts).unwrap_or_else(|error| panic!("{error}"));
        let done = (0..20_000).find(|_| {
            let relaxed = simulation.relax_step(1e-9).unwrap_or_else(|error| panic!("{error}"));
            relaxed == ddem_core::Relaxed::Done
        });
        assert!(done.is_some(), "no equilibrium");
        let (mut low, mut high) = (0.0_f64, 2.0_f64);
        for _ in 0..60 {
            let x = 0.5 * (low + high);
            let pressed = 2e8 * (1.0 + x).powi(-3);
            let borne = (1e8 + 18e9 * t / (2.0 * (1.0 - t / 2.0))) * x;
            (low, high) = if pressed > borne { (x, high) } else { (low, x) };
        }
        let ways = [[0.5, 0.5, 0.9995], [0.5, 0.5, 1.0005]].map(|at| {
            let node = simulation.model().nearest_node(at);
            simulation.displacement(node)[2]
        });
        let found = (ways[1] - ways[0]) / t;
        println!("{parts} parts: opening {found}, exact {low}, {done:?} steps");
        assert!((found / low - 1.0).abs() < 1e-6, "{found} {low}");
    }
}

/// A cavity that has narrowed before its charge detonates: p = p_d (V_e/V)^γ with the remaining
/// volume, at most the detonation pressure. The work is at most p_d V_e/(γ − 1). A given pressure
/// is the pressure at which the gas starts. Time steps shorten as stiffer gas requires.
#[test]
fn squeezed_cavity_work_is_bounded_by_explosive_energy() {
    let numbers = Detonation { density: 1000.0, detonation_velocity: 4e3, gamma: 3.0 };
    let (peak, own) = (1000.0 * 16e6 / 8.0, 0.3);
    let hole = || ball([1.5; 3], 0.7);
    let explosive = Charge {
        r#where: hole(),
        mass: Some(1000.0 * own),
        explosive: Some(Explosive::Given(numbers)),
        ..Charge::default()
    };
    // The six blocks around the cavity move inwards; springs of negligible stiffness join the
    // blocks.
    let squeezed = |charge: &Charge, way: f64| {
        let mut deck = Deck { charge: vec![charge.clone()], ..hollow(BOX, &[[1.0; 3]], 0.0) };
        (deck.blocks[0].body, deck.blocks[0].divisions) = (Body::Rigid, 1);
        let (normal_stiffness, shear_stiffness) = (Some(1e3), Some(1e3));
        let soft = Joint { normal_stiffness, shear_stiffness, ..Joint::default() };
        deck.joints.insert("seam".into(), soft);
        let mut simulation = simulation(&deck);
        let model = simulation.model();
        let u = |node: usize| {
            let block = model.block_of(node);
            let first = Vec3::from(model.point(block * 8));
            let centre = first + Vec3::repeat(0.5) - Vec3::repeat(1.5);
            let beside = (centre.norm() - 1.0).abs() < 1e-9;
            (if beside { centre * -way } else { Vec3::zeros() }).into()
        };
        let u: Vec<[f64; 3]> = (0..model.n_nodes()).map(u).collect();
        simulation.set_displacements(&u);
        simulation
    };
    let given = gas(hole(), 1e6);
    let mut volumes = Vec::new();
    for way in [0.0, 0.1, 0.2] {
        let now = state(&squeezed(&explosive, way), 0);
        let exact = peak * (own / now.volume).min(1.0).powi(3);
        assert!((now.pressure / exact - 1.0).abs() < 1e-12, "{way}: {now:?} {exact:e}");
        assert_eq!(now.detonation_volume, None);
        let given = state(&squeezed(&given, way), 0);
        assert!((given.pressure / 1e6 - 1.0).abs() < 1e-12, "{way}: {given:?}");
        volumes.push(now.volume);
    }
    assert!(
        (volumes[0] - 1.0).abs() < 1e-12 && volumes[1] > own && volumes[2] < own,
        "{volumes:?}"
    );
    let go = |way: f64| {
        let mut simulation = squeezed(&explosive, way);
        simulation.start(Damping::None, TimeStep::Auto, None).unwrap_or_else(|e| panic!("{e}"));
        let first = simulation.time_step();
        (0..2).for_each(|_| simulation.step().unwrap_or_else(|error| panic!("{error}")));
        (simulation, first)
    };
    let (wide, first) = go(0.0);
    assert_eq!(wide.time_step().to_bits(), first.to_bits());
    let (mut simulation, first) = go(0.2);
    assert!(simulation.time_step() < 0.5 * first, "{} {first}", simulation.time_step());
    assert!(
        (state(&simulation, 0).detonation_volume.unwrap_or(0.0) / volumes[2] - 1.0).abs() < 1e-9
    );
    // Continue until the gas vents.
    for _ in 0..200 {
        simulation.step().unwrap_or_else(|error| panic!("{error}"));
    }
    let (energy, most) = (simulation.energy(), peak * own / 2.0);
    assert!(
        energy.external_work > 0.5 * most && energy.external_work < most,
        "{most:e}: {energy:?}"
    );
    assert!(energy.balance.abs() < 1e-9 * most, "{energy:?}");
}
