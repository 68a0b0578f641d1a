//! Output of contacts and momenta.

use ddem_core::{FIELDS, FieldLocation, Simulation};
use ddem_deck::Deck;
use ddem_deck::{BlockSet, Body, Damping, Extent, Fix, Joint, JointChoice, TimeStep, Where};
use nalgebra::Rotation3;

use crate::decks::*;
use crate::unbonded_blocks::*;

/// Brick of 1 × 2 × 3 m that translates and spins about z.
fn brick(divisions: u32) -> Piece {
    Piece {
        centre: Vec3::new(4.0, -1.0, 2.0),
        edges: Vec3::new(1.0, 2.0, 3.0),
        divisions,
        velocity: Vec3::new(0.5, 2.0, -1.0),
        spin: Vec3::new(0.0, 0.0, 1.5),
        ..Piece::default()
    }
}

/// A rigid brick has `m v` and `x × m v + I ω` with I of a parallelepiped. For a deformable brick I
/// is that of its lumped masses, `(1 + 2/n²)` times as much.
#[test]
fn momentum_of_brick_is_exact() {
    for divisions in 0..4 {
        let piece = brick(divisions);
        let mut simulation = simulation(&of(&mass_properties(1e9), &[piece]));
        let mass = 2400.0 * 6.0;
        let lumped = if divisions == 0 { 1.0 } else { 1.0 + 2.0 / f64::from(divisions).powi(2) };
        let spin = piece.spin * (mass / 12.0 * (1.0 + 4.0) * lumped);
        let [p, l] = [piece.velocity * mass, piece.centre.cross(&piece.velocity) * mass + spin];
        let check = |simulation: &mut Simulation, tolerance: f64| {
            let computed = [simulation.momentum(), simulation.angular_momentum()].map(Vec3::from);
            assert!(
                (computed[0] - p).norm() < tolerance * p.norm(),
                "{divisions}: {computed:?} {p}"
            );
            assert!(
                (computed[1] - l).norm() < tolerance * l.norm(),
                "{divisions}: {computed:?} {l}"
            );
        };
        check(&mut simulation, 1e-14);
        let started = simulation.start(Damping::None, TimeStep::Auto, None);
        started.unwrap_or_else(|error| panic!("{error}"));
        (0..500).for_each(|_| simulation.step().unwrap_or_else(|error| panic!("{error}")));
        check(&mut simulation, 1e-13);
        simulation.synchronise();
        check(&mut simulation, 1e-13);
    }
}

/// Deck with contacts so soft that blocks of 1 m penetrate by `part` of a metre, so that the points
/// of action of the forces matter.
fn soft(part: f64) -> Deck {
    let mut deck = mass_properties(1e8);
    deck.model.gravity = [0.0, 0.0, -10.0];
    deck.contact.normal_stiffness = Some(2400.0 * 10.0 / part);
    deck.contact.shear_stiffness = Some(2400.0 * 10.0 / part);
    deck.contact.friction = Some(50.0);
    deck
}

fn at_rest(deck: &Deck, time: f64) -> Simulation {
    let mut simulation = simulation(deck);
    let damping = Damping::Local(0.8);
    simulation.start(damping, TimeStep::Auto, Some(time)).unwrap_or_else(|error| panic!("{error}"));
    while simulation.steps_left() != Some(0) {
        simulation.step().unwrap_or_else(|error| panic!("{error}"));
    }
    simulation
}

fn centre_of_mass(simulation: &Simulation, block: usize) -> Vec3 {
    let model = simulation.model();
    let nodes = (0..model.n_nodes()).filter(|&node| model.block_of(node) == block);
    let part = |node: usize| (position(simulation, node) * model.mass(node), model.mass(node));
    let (sum, mass) = nodes.map(part).fold((Vec3::zeros(), 0.0), |(x, m), (y, n)| (x + y, m + n));
    sum / mass
}

/// Force of all contacts on a block, and its moment about the centre of mass.
fn on_block(simulation: &mut Simulation, block: usize) -> [Vec3; 2] {
    let centre = centre_of_mass(simulation, block);
    let mut sums = [Vec3::zeros(); 2];
    for contact in simulation.contacts() {
        let side = contact.blocks.iter().position(|&of| of == block);
        let sign = match side {
            Some(0) => 1.0,
            Some(_) => -1.0,
            None => continue,
        };
        let force = Vec3::from(contact.force) * sign;
        sums[0] += force;
        sums[1] += (Vec3::from(contact.position) - centre).cross(&force);
    }
    sums
}

/// At each level of a column the contacts carry the weight above.
#[test]
fn column_contacts_carry_weight_above() {
    for divisions in [[0; 4], [0, 2, 0, 3], [1, 3, 2, 2]] {
        let pieces = [0, 1, 2, 3].map(|i: usize| Piece {
            centre: Vec3::new(0.02, 0.01, 1.0) * i as f64,
            divisions: divisions[i],
            held: i == 0,
            ..Piece::default()
        });
        let mut simulation = at_rest(&of(&soft(0.005), &pieces), 16.0);
        let contacts = simulation.contacts();
        let weight = 2400.0 * 10.0;
        for level in 0..3 {
            let here = contacts.iter().filter(|contact| contact.blocks == [level, level + 1]);
            let force: Vec3 = here.clone().map(|contact| Vec3::from(contact.force)).sum();
            let above = (3 - level) as f64 * weight;
            // The force on the block below, which is block a, points down; the normal points up.
            assert!((force + Vec3::z() * above).norm() < 1e-5 * above, "{divisions:?} {force}");
            for contact in here.clone() {
                let normal = Vec3::from(contact.normal);
                assert!((normal - Vec3::z()).norm() < 0.05, "{normal}");
                let pressure = -Vec3::from(contact.traction()).dot(&normal);
                assert!(pressure > 0.0 && contact.gap < 0.0 && !contact.sliding, "{contact:?}");
                // The difference is the offset of springs that were created again.
                let spring = -weight / 0.005 * contact.gap;
                assert!((pressure / spring - 1.0).abs() < 1e-2, "{pressure} {spring}");
            }
            let area: f64 = here.map(|contact| contact.area).sum();
            assert!((area / (0.98 * 0.99) - 1.0).abs() < 0.02, "{area}");
        }
        let counts = simulation.contact_counts();
        assert_eq!((counts.near, counts.block_pairs, counts.points), (3, 3, contacts.len()));
        assert_eq!(simulation.touching_blocks(), 3);
        let deepest = contacts.iter().fold(0.0_f64, |most, contact| most.max(-contact.gap));
        assert!((counts.deepest / deepest - 1.0).abs() < 1e-12, "{counts:?} {deepest}");
        assert!(deepest > 0.0149 && deepest < 0.025, "{deepest}");
    }
}

/// A block on a slope is in equilibrium, moments included, if forces act at the given points.
#[test]
fn contact_forces_and_points_give_equilibrium() {
    for (divisions, first) in [(0, true), (0, false), (2, true)] {
        let angle = 0.5_f64;
        let turn = Rotation3::from_axis_angle(&Vec3::y_axis(), angle);
        let slope = Piece {
            edges: Vec3::new(6.0, 6.0, 1.0),
            turn,
            held: true,
            centre: turn * Vec3::new(0.0, 0.0, -0.5),
            ..Piece::default()
        };
        let block = Piece { turn, centre: turn * Vec3::z() * 0.5, divisions, ..Piece::default() };
        let pieces = if first { [slope, block] } else { [block, slope] };
        let mut simulation = at_rest(&of(&soft(0.03), &pieces), 10.0);
        let number = usize::from(first);
        let weight = 2400.0 * 10.0;
        let [force, moment] = on_block(&mut simulation, number);
        assert!((force - Vec3::z() * weight).norm() < 1e-6 * weight, "{first} {divisions} {force}");
        assert!(moment.norm() < 1e-6 * weight, "{first} {divisions} {moment}");
        // Shear W sin α at a distance W cos α / k.
        let contact = simulation.contacts()[0];
        assert!(!contact.sliding && contact.gap < -0.01, "{contact:?}");
    }
}

/// A block slides on a slope that is too steep for its friction.
#[test]
fn sliding_contacts_are_marked() {
    let mut deck = soft(0.01);
    deck.contact.friction = Some(10.0);
    let turn = Rotation3::from_axis_angle(&Vec3::y_axis(), 0.5);
    let slope = Piece { edges: Vec3::new(9.0, 9.0, 1.0), turn, held: true, ..Piece::default() };
    let block = Piece { turn, centre: turn * Vec3::z(), ..Piece::default() };
    let mut simulation = simulation(&of(&deck, &[slope, block]));
    let started = simulation.start(Damping::Mass(5.0), TimeStep::Auto, Some(0.7));
    started.unwrap_or_else(|error| panic!("{error}"));
    while simulation.steps_left() != Some(0) {
        simulation.step().unwrap_or_else(|error| panic!("{error}"));
    }
    // The whole displacement along the slope, except the elastic part before sliding.
    let moved = (turn * Vec3::x()).dot(&Vec3::from(simulation.displacement(8)));
    let contacts = simulation.contacts();
    let slip = contacts.iter().fold(0.0_f64, |most, contact| most.max(contact.slip));
    assert!(moved > 0.3 && slip <= moved && slip > 0.97 * moved, "{slip} of {moved}");
    assert!(!contacts.is_empty() && contacts.iter().all(|contact| contact.sliding), "{contacts:?}");
    for contact in contacts {
        let (traction, normal) = (Vec3::from(contact.traction()), Vec3::from(contact.normal));
        let pressure = -traction.dot(&normal);
        let shear = (traction + normal * pressure).norm();
        assert!((shear / pressure / 10_f64.to_radians().tan() - 1.0).abs() < 1e-9, "{contact:?}");
    }
}

fn pair_field(simulation: &mut Simulation, name: &str) -> Vec<f64> {
    let field = FIELDS.iter().find(|field| field.on == FieldLocation::Pair && field.name == name);
    field.map_or_else(Vec::new, |field| simulation.snapshot().values(field))
}

/// The upper of two blocks with a weak joint slides off. After the release its pairs are marked as
/// released, and the contact has the forces.
#[test]
fn released_pairs_are_marked() {
    let mut deck = mass_properties(1e8);
    // A slope of 30°, and friction of 20°.
    deck.model.gravity = [5.0, 0.0, -8.66];
    let weak = Joint {
        normal_stiffness: Some(1e8),
        shear_stiffness: Some(1e8),
        cohesion: Some(1e3),
        friction: Some(20.0),
        tension: Some(1e3),
        ..Joint::default()
    };
    deck.joints.insert("weak".into(), weak);
    deck.blocks.push(BlockSet {
        size: Some([1.0, 1.0, 1.0]),
        count: Some([1, 1, 2]),
        material: "stuff".into(),
        joint: Some(JointChoice::All("weak".into())),
        body: Body::Rigid,
        ..BlockSet::default()
    });
    let region = Where { z: Some(Extent::Plane(0.0)), ..Where::default() };
    deck.fix.push(Fix { r#where: region, axes: "xyz".into(), ..Fix::default() });
    let mut simulation = simulation(&deck);
    assert_eq!(pair_field(&mut simulation, "released"), [0.0; 4]);
    let started = simulation.start(Damping::Mass(1.0), TimeStep::Auto, Some(0.9));
    started.unwrap_or_else(|error| panic!("{error}"));
    let (mut slid_before, mut pressed) = (false, Vec::new());
    while simulation.steps_left() != Some(0) {
        simulation.step().unwrap_or_else(|error| panic!("{error}"));
        if simulation.steps().is_multiple_of(20) {
            let released = pair_field(&mut simulation, "released");
            let contacts = simulation.contacts();
            slid_before |= pair_field(&mut simulation, "state") == [1.0; 4] && released == [0.0; 4];
            // Either the joint or a contact acts.
            assert!(released == [0.0; 4] && contacts.is_empty() || released == [1.0; 4]);
            if simulation.time() > 0.5 {
                pressed.push(contacts.iter().map(|contact| contact.force[2]).sum::<f64>());
            }
        }
    }
    assert!(slid_before, "the joint was let go before it slid");
    assert_eq!(pair_field(&mut simulation, "released"), [1.0; 4]);
    assert_eq!(pair_field(&mut simulation, "state"), [1.0; 4]);
    assert_eq!(pair_field(&mut simulation, "traction"), [0.0; 12]);
    // The weight is applied at once, so the block rocks.
    let mean = pressed.iter().sum::<f64>() / pressed.len() as f64;
    let weight = 2400.0 * 0.5 * 8.66;
    assert!((mean / weight + 1.0).abs() < 0.1, "{mean} {weight}");
}
