//! Blocks of regions at the limit of equilibrium: in a roof, in the walls of a tunnel, in an arch.

use ddem_core::{Relaxed, RunError, Simulation};
use ddem_deck::{BlockMode, Body};
use nalgebra::Vector3;

use super::record::Tolerance::{Absolute, Relative};
use super::record::{at_most, check, consistent, least, of};
use super::shared::{deck, edited, example, root, simulation};

/// Error of a simulation that finds no equilibrium; `None` if it comes to rest.
fn failure(simulation: &mut Simulation, increments: u32) -> Option<RunError> {
    simulation.start_relaxation(increments).unwrap_or_else(|error| panic!("{error}"));
    loop {
        match simulation.relax_step(1e-6) {
            Ok(Relaxed::Done) => return None,
            Ok(_) => {}
            Err(error @ RunError::NoEquilibrium { .. }) => return Some(error),
            Err(error) => panic!("{error}"),
        }
    }
}

#[test]
fn roof_wedge_falls_below_its_friction() {
    let case = of("cells_roof");
    let rock = "material = \"rock\"\n\n[[cut]]";
    let rigid = edited(&example(case.deck), rock, &format!("body = \"rigid\"\n{rock}"));
    for ((body, text), (ratio, shear, exact)) in
        [("", example(case.deck)), (", rigid", rigid)].into_iter().flat_map(|body| {
            [("1", "1e8", 35.393), ("0.1", "1e7", 36.076), ("0.01", "1e6", 36.390)]
                .map(|limit| (body.clone(), limit))
        })
    {
        let stands = |friction: f64| {
            let text = edited(&text, "friction = 35.5", &format!("friction = {friction}"));
            let text =
                edited(&text, "shear_stiffness = 1e8", &format!("shear_stiffness = {shear}"));
            let mut simulation = simulation(&text);
            assert!(failure(&mut simulation, 1).is_none(), "the rock itself");
            simulation.enter(1).unwrap_or_else(|error| panic!("{error}"));
            failure(&mut simulation, 100).is_none()
        };
        let (low, high) = (exact - 0.05, exact + 0.05);
        assert!(!stands(low) && stands(high), "{ratio}{body}");
        let quantity = format!("least friction, k_s / k_n = {ratio}{body} [degrees]");
        least(case, &quantity, exact, [low, high]);
    }
}

#[test]
fn block_of_the_table_moves_first() {
    let case = of("cells_tunnel");
    let text = example(case.deck);
    let rock = deck(&text).cut_regions().expect("cells");
    let verdicts = rock.verdicts();
    // Friction at which the factor is 1: the factor grows with tan φ.
    let tangent = 35.8_f64.to_radians().tan();
    let limit = |cell: usize| {
        verdicts[cell].factor.map_or(0.0, |factor| (tangent / factor).atan().to_degrees())
    };
    let first = (0..verdicts.len())
        .max_by(|&a, &b| limit(a).total_cmp(&limit(b)))
        .expect("a block that can move");
    assert!(verdicts.iter().all(|of| of.mode != BlockMode::Falls));
    let (dip, turn) = (50_f64.to_radians(), 45_f64.to_radians());
    let plunge = (dip.tan() * turn.cos()).atan();
    let pressing = dip.sin() * turn.cos() * plunge.sin() + dip.cos() * plunge.cos();
    let exact = (plunge.tan() * pressing).atan().to_degrees();
    check(case, "least friction by the table [degrees]", exact, limit(first), Relative(1e-12));
    let second = (0..verdicts.len()).filter(|&cell| cell != first).map(limit);
    let second = second.fold(0.0, f64::max);
    check(case, "that of the next block [degrees]", 20.0, second, Relative(1e-12));

    let at = |friction: f64| {
        let text = edited(&text, "friction = 35.8", &format!("friction = {friction}"));
        let mut simulation = simulation(&text);
        let failure = failure(&mut simulation, 1);
        (simulation, failure)
    };
    let (low, high) = (exact - 0.3, exact + 0.3);
    let (simulation, above) = at(high);
    assert!(above.is_none(), "{above:?}");
    let size = |u: &[f64; 3]| Vector3::from(*u).norm();
    let most = simulation.displacements().iter().map(size).fold(0.0, f64::max);
    at_most(case, "largest displacement just above [m]", 2e-4, most);
    let (_, below) = at(low);
    let Some(RunError::NoEquilibrium { moving, .. }) = below else { panic!("it stands") };
    least(case, "least friction in a run [degrees]", exact, [low, high]);
    let [block] = &moving[..] else { panic!("{moving:?}") };
    consistent(case, "block that moves first", first as f64, block.block as f64, Absolute(0.0));
    // The springs of the joints yield by a hundredth of the way.
    let moved = Vector3::from(block.direction);
    let line = Vector3::new(-plunge.cos(), 0.0, -plunge.sin());
    let off = moved.cross(&line).norm().asin().to_degrees();
    check(case, "angle between its way and that of the table [degrees]", 0.0, off, Absolute(1.0));
}

/// Factors on the least thickness at which the arch falls and stands.
#[test]
fn arch_stands_at_the_thickness_of_heyman() {
    let case = of("cells_arch");
    let heyman = 0.1075;
    let stands = |ratio: f64, body: Body| {
        let thickness = ratio / (1.0 - ratio / 2.0);
        // The folder of the deck has the way to the surface.
        let path = root(&format!("examples/verification/{}.toml", case.deck));
        let (mut deck, _) = ddem_deck::read(&path).unwrap_or_else(|error| panic!("{error}"));
        deck.region[0].body = body;
        let prism = deck.region[0].prism.as_mut().expect("a prism");
        let before = prism.outline.iter().map(|corner| corner[0]).fold(0.0, f64::max);
        for corner in &mut prism.outline {
            let scale = (1.0 + thickness) / before;
            corner[0] *= scale;
            // The feet of the abutments keep their level.
            corner[1] *= if corner[1] > 0.0 { scale } else { 1.0 };
        }
        let mut simulation =
            Simulation::new(deck.build().unwrap_or_else(|error| panic!("{error}")));
        match simulation.relax(1e-5, 100_000) {
            Ok(_) => true,
            Err(RunError::NoEquilibrium { .. }) => false,
            Err(error) => panic!("{error}"),
        }
    };
    let [low, high] = [0.98, 1.02].map(|part| part * heyman);
    for (what, body) in [("", Body::Deformable), (", rigid", Body::Rigid)] {
        assert!(!stands(low, body) && stands(high, body));
        least(case, &format!("least thickness / radius{what}"), heyman, [low, high]);
    }
}
