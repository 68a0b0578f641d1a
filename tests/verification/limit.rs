//! Limit strengths: relaxation, local damping and slow loading find the same limit as limit
//! equilibrium.

use ddem_core::{RunError, Simulation};
use ddem_deck::Deck;
use ddem_deck::{Assign, Body, Damping, Extent, History, Joint, Load, Stage, TimeStep, Where};

use super::incline::G;
use super::record::Tolerance::Absolute;
use super::record::{Case, bracket, consistent, of};
use super::shared::{deck, example};
use super::stacks::shifted;

/// Method to find out if a model stands.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Way {
    /// The weight acts at once, and the model relaxes.
    Relaxation,
    /// The weight acts at once, and local damping brings the blocks to rest.
    Local,
    /// The weight is applied slowly, with mass damping.
    Slow,
}

const WAYS: [(Way, &str); 3] =
    [(Way::Relaxation, "relaxation"), (Way::Local, "local damping"), (Way::Slow, "slow loading")];

/// Speed below which blocks stand `[m/s]`: ten times the speed left from the start of a stage, and
/// a sixth of the speed at 0.4 % beyond the limit.
const STILL: f64 = 1e-4;
/// Steps in which a relaxation reaches equilibrium, if there is one.
const STEPS: u64 = 8000;

/// Parts of a model and their weights.
type Weights<'a> = &'a [(Where, f64)];

/// True if a model stands; dynamic methods take this duration `[s]`.
fn is_stable(mut deck: Deck, way: Way, weights: Weights<'_>, duration: f64) -> bool {
    if way == Way::Slow {
        let along = deck.model.gravity;
        for (region, mass) in weights {
            let force = Some(along.map(|g| mass * g));
            let history = Some(History::Ramp(0.5 * duration));
            deck.load.push(Load { r#where: region.clone(), force, history, ..Load::default() });
        }
        deck.model.gravity = [0.0; 3];
    }
    let model = deck.build().unwrap_or_else(|error| panic!("{error}"));
    let mut simulation = Simulation::new(model);
    let damping = match way {
        Way::Relaxation => return relaxes(&mut simulation),
        Way::Local => Damping::Local(0.8),
        Way::Slow => Damping::Mass(30.0),
    };
    let begun = simulation.start(damping, TimeStep::Auto, Some(duration));
    begun.unwrap_or_else(|error| panic!("{error}"));
    while simulation.steps_left() > Some(0) {
        simulation.step().unwrap_or_else(|error| panic!("{error}"));
    }
    speed(&mut simulation) < STILL
}

/// True if a relaxation finds an equilibrium.
fn relaxes(simulation: &mut Simulation) -> bool {
    use RunError::{DeepPenetration, NoEquilibrium, NotConverged};
    match simulation.relax(1e-6, STEPS) {
        Ok(_) => true,
        Err(NoEquilibrium { .. } | NotConverged { .. } | DeepPenetration { .. }) => false,
        Err(error) => panic!("{error}"),
    }
}

/// Speed of the fastest node `[m/s]`.
fn speed(simulation: &mut Simulation) -> f64 {
    let speed = |v: &[f64; 3]| v.iter().map(|v| v * v).sum::<f64>().sqrt();
    simulation.velocities().iter().map(speed).fold(0.0, f64::max)
}

/// Finds the limit by all methods: `at` is the model at a part of the exact limit.
fn find((case, what): (Case, &str), weights: Weights<'_>, duration: f64, at: &dyn Fn(f64) -> Deck) {
    for (way, name) in WAYS {
        let (mut low, mut high) = (0.96, 1.03);
        for _ in 0..3 {
            let middle = 0.5 * (low + high);
            let standing = is_stable(at(middle), way, weights, duration);
            *(if standing { &mut low } else { &mut high }) = middle;
        }
        assert!(low > 0.96 && high < 1.03, "{what}, {name}: an end of the bracket is not tried");
        let what = format!("limit by {name}, {what} [part of the exact one]");
        bracket(case, &what, 1.0, [low, high]);
    }
}

fn set(name: &str) -> Where {
    Where { set: Some(name.to_owned()), ..Where::default() }
}

fn between(low: f64, high: f64) -> Where {
    Where { z: Some(Extent::Range([low, high])), ..Where::default() }
}

pub(super) fn with_body(mut deck: Deck, sets: &[&str], body: Body) -> Deck {
    let moves = |name: &Option<String>| sets.iter().any(|set| name.as_deref() == Some(*set));
    deck.blocks.iter_mut().filter(|set| moves(&set.name)).for_each(|set| set.body = body);
    deck
}

/// The model with contacts instead of joints, with the stiffness and friction of one of the joints.
pub(super) fn in_contact(mut deck: Deck, joint: &str) -> Deck {
    let joint = deck.joints[joint].clone();
    deck.blocks.iter_mut().for_each(|set| set.joint = None);
    deck.contact.friction = joint.friction;
    deck.contact.normal_stiffness = joint.normal_stiffness;
    deck.contact.shear_stiffness = joint.shear_stiffness;
    deck
}

/// Angle whose tangent is that of another angle divided by a factor, both `[degrees]`.
fn reduced(angle: f64, factor: f64) -> f64 {
    (angle.to_radians().tan() / factor).atan().to_degrees()
}

/// The block on the plane, with strengths at a part of their limit.
pub(super) fn plane([cohesion, friction]: [f64; 2], part: f64) -> Deck {
    let slope = 30_f64.to_radians();
    let holds = cohesion / (1200.0 * G * slope.sin()) + friction.to_radians().tan() / slope.tan();
    let factor = part * holds;
    let mut deck = deck(&example("limit_plane"));
    let joint = deck.joints.get_mut("plane").expect("the plane");
    joint.friction = Some(reduced(friction, factor));
    if cohesion > 0.0 {
        joint.cohesion = Some(cohesion / factor);
        joint.residual_cohesion = joint.cohesion;
        joint.tension = Some(0.1 * cohesion / factor);
    }
    deck
}

/// Both blocks in one set; their joint is a layer with a modulus `[Pa]`.
pub(super) fn layered(mut deck: Deck, young: f64) -> Deck {
    let joint = deck.joints.get_mut("plane").expect("the plane");
    joint.thickness = 0.01;
    (joint.density, joint.young, joint.poisson) = (Some(2400.0), Some(young), Some(0.25));
    (joint.normal_stiffness, joint.shear_stiffness) = (None, None);
    deck.blocks.truncate(1);
    let both = &mut deck.blocks[0];
    (both.size, both.count) = (Some([1.0; 3]), Some([1, 1, 2]));
    both.body = Body::Deformable;
    deck.fix[0].r#where = between(-0.5, -0.004);
    deck.probe.clear();
    deck
}

pub(super) const STRENGTHS: [([f64; 2], &str); 3] =
    [([0.0, 35.0], "friction"), ([12e3, 0.0], "cohesion"), ([6e3, 20.0], "both")];

#[test]
fn block_on_plane_slides_at_limit() {
    let case = of("limit_plane");
    for (strengths, what) in STRENGTHS {
        for body in [Body::Rigid, Body::Deformable] {
            let what = format!("{what}, {body:?}").to_lowercase();
            find((case, &what), &[(set("block"), 1200.0)], 0.3, &|part| {
                with_body(plane(strengths, part), &["block"], body)
            });
        }
    }
}

#[test]
fn block_on_layer_or_contact_slides_at_limit() {
    let case = of("limit_plane");
    for (strengths, what) in STRENGTHS {
        let what = format!("{what}, layer");
        find((case, &what), &[(between(0.004, 0.5), 1200.0)], 0.3, &|part| {
            layered(plane(strengths, part), 18e9)
        });
    }
    for body in [Body::Rigid, Body::Deformable] {
        let what = format!("contact, {body:?}").to_lowercase();
        find((case, &what), &[(set("block"), 1200.0)], 0.3, &|part| {
            in_contact(with_body(plane([0.0, 35.0], part), &["block"], body), "plane")
        });
    }
}

#[test]
fn column_topples_at_limit() {
    let case = of("limit_column");
    let weights = [(set("block"), 2400.0)];
    let at = |part: f64| {
        let mut deck = deck(&example(case.deck));
        let slope = (0.25 * part).atan();
        deck.model.gravity = [G * slope.sin(), 0.0, -G * slope.cos()];
        deck
    };
    find((case, "contact, rigid"), &weights, 0.3, &|part| in_contact(at(part), "foot"));
    // Half a percent below the limit it leans for 0.6 s before it comes to rest.
    find((case, "joint, deformable"), &weights, 0.8, &|part| {
        with_body(at(part), &["block"], Body::Deformable)
    });
}

#[test]
fn corbelled_stack_falls_at_limit() {
    let case = of("v04_corbel");
    let sets = ["fourth", "third", "second", "top"];
    let weights = sets.map(|name| (set(name), 300.0));
    let at = |part: f64| deck(&shifted(&example(case.deck), part));
    find((case, "rigid"), &weights, 0.4, &at);
    find((case, "deformable"), &weights, 0.4, &|part| {
        let mut deck = with_body(at(part), &sets, Body::Deformable);
        deck.blocks.iter_mut().for_each(|set| set.divisions = 1);
        deck
    });
}

/// The two blocks, with strengths at a part of their limit; contacts have 35° everywhere.
pub(super) fn wedges(part: f64, contact: bool) -> Deck {
    let mut deck = deck(&example("limit_wedges"));
    let (factor, side) = if contact { (2.415359, 35.0) } else { (2.268822, 20.0) };
    for (name, friction) in [("plane", 35.0), ("side", side)] {
        let joint = deck.joints.get_mut(name).expect("a joint");
        joint.friction = Some(reduced(friction, part * factor));
    }
    if contact { in_contact(deck, "plane") } else { deck }
}

#[test]
fn two_blocks_slide_at_limit() {
    let case = of("limit_wedges");
    let weights = [(set("active"), 9600.0), (set("passive"), 14400.0)];
    find((case, "joints, rigid"), &weights, 0.4, &|part| wedges(part, false));
    find((case, "contacts, deformable"), &weights, 0.4, &|part| {
        with_body(wedges(part, true), &["active", "passive"], Body::Deformable)
    });
}

/// The slope with its strengths divided by one factor after the other, one stage for each.
fn slope(factors: &[f64]) -> Simulation {
    let mut deck = deck(&example("limit_slope"));
    let whole = deck.joints["joint"].clone();
    for (i, factor) in factors.iter().enumerate() {
        let name = format!("divided {i}");
        let divided = |strength: Option<f64>| strength.map(|strength| strength / factor);
        let joint = Joint {
            cohesion: divided(whole.cohesion),
            tension: divided(whole.tension),
            friction: whole.friction.map(|friction| reduced(friction, *factor)),
            ..whole.clone()
        };
        deck.joints.insert(name.clone(), joint);
        let (joint, from) = (Some(name.clone()), Some(name.clone()));
        deck.assign.push(Assign { joint, from, ..Assign::default() });
        deck.stage.push(Stage { name, ..deck.stage[0].clone() });
    }
    let model = deck.build().unwrap_or_else(|error| panic!("{error}"));
    let mut simulation = Simulation::new(model);
    simulation.relax(1e-6, STEPS).unwrap_or_else(|error| panic!("{error}"));
    simulation
}

/// True if the slope comes to rest.
fn rests(simulation: &mut Simulation, way: Way) -> bool {
    let damping = match way {
        Way::Relaxation => return relaxes(simulation),
        Way::Local => Damping::Local(0.8),
        Way::Slow => Damping::Mass(60.0),
    };
    let begun = simulation.start(damping, TimeStep::Auto, Some(0.6));
    begun.unwrap_or_else(|error| panic!("{error}"));
    let first = simulation.time();
    while simulation.steps_left() > Some(0) {
        simulation.step().unwrap_or_else(|error| panic!("{error}"));
        let looks = simulation.steps().is_multiple_of(100) && simulation.time() > first + 0.05;
        if looks && speed(simulation) < STILL {
            return true;
        }
    }
    false
}

#[test]
fn all_procedures_find_the_same_slope_limit() {
    let case = of("limit_slope");
    let factors: Vec<f64> = (0..16).map(|i| 1.3 + 0.01 * f64::from(i)).collect();
    let limits = WAYS.map(|(way, _)| {
        let mut simulation = slope(&factors);
        let stays = factors.iter().enumerate().take_while(|(i, _)| {
            simulation.enter(i + 1).unwrap_or_else(|error| panic!("{error}"));
            rests(&mut simulation, way)
        });
        stays.map(|(_, factor)| factor + 0.005).last().expect("the first one holds")
    });
    for ((_, name), limit) in WAYS.into_iter().zip(limits).skip(1) {
        let what = format!("factor at the limit by {name}, expected: by relaxation");
        consistent(case, &what, limits[0], limit, Absolute(2e-2));
    }
    for (way, name) in [WAYS[0], WAYS[1]] {
        let once = |part: f64| {
            let mut simulation = slope(&[part * limits[0]]);
            simulation.enter(1).unwrap_or_else(|error| panic!("{error}"));
            rests(&mut simulation, way)
        };
        assert!(once(0.98) && !once(1.02), "{name}");
        let what = format!("limit at once by {name} [part of the limit by steps and relaxation]");
        bracket(case, &what, 1.0, [0.98, 1.02]);
    }
}

/// Without a joint, or after a contact has replaced it, the block slides on and finally off the
/// base. A relaxation stops long before its last step.
#[test]
fn relaxation_reports_missing_equilibrium() {
    for body in [Body::Rigid, Body::Deformable] {
        let joined = with_body(plane([0.0, 35.0], 2.0), &["block"], body);
        let touching = in_contact(joined.clone(), "plane");
        for deck in [joined, touching, layered(plane([0.0, 35.0], 2.0), 20e6)] {
            let model = deck.build().unwrap_or_else(|error| panic!("{error}"));
            let relaxed = Simulation::new(model).relax(1e-6, 200_000);
            assert!(matches!(relaxed, Err(RunError::NoEquilibrium { .. })), "{relaxed:?}");
        }
    }
}
