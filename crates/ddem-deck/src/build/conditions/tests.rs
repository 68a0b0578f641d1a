use ddem_core::Simulation;
use ddem_core::problem::Vec3;

use crate::schema::*;

/// Deck of 2 × 2 blocks of 2 m × 1 m × 1 m with joints of 0.02 m thickness.
fn deck(load: Load) -> Deck {
    let rock = Material { density: 2400.0, young: 18e9, poisson: 0.25 };
    let seam = Joint { thickness: 0.02, material: Some("rock".into()), ..Joint::default() };
    Deck {
        materials: [("rock".to_owned(), rock)].into(),
        joints: [("seam".to_owned(), seam)].into(),
        blocks: vec![BlockSet {
            size: Some([4.0, 2.0, 1.0]),
            count: Some([2, 2, 1]),
            divisions: 3,
            material: "rock".into(),
            joint: Some(JointChoice::All("seam".into())),
            ..BlockSet::default()
        }],
        load: vec![load],
        ..Deck::default()
    }
}

/// Sum of the nodal forces of the only load, and its moment about the origin.
fn resultant(deck: &Deck) -> (Vec3, Vec3) {
    let model = deck.build().unwrap_or_else(|error| panic!("{error}"));
    let forces = &model.conditions().loaded[0].forces;
    let moment =
        |&(node, force): &(u32, Vec3)| Vec3::from(model.point(node as usize)).cross(&force);
    (forces.iter().map(|(_, force)| force).sum(), forces.iter().map(moment).sum())
}

fn check(deck: &Deck, force: [f64; 3], at: [f64; 3]) {
    let (force, at) = (Vec3::from(force), Vec3::from(at));
    let (sum, moment) = resultant(deck);
    assert!((sum - force).norm() < 1e-12 * force.norm(), "{sum} for {force}");
    let expected = at.cross(&force);
    assert!((moment - expected).norm() < 1e-11 * force.norm(), "{moment} for {expected}");
}

fn planes(extents: [Option<Extent>; 3]) -> Where {
    let [x, y, z] = extents;
    Where { x, y, z, ..Where::default() }
}

const fn plane(at: f64) -> Option<Extent> {
    Some(Extent::Plane(at))
}

const fn range(from: f64, to: f64) -> Option<Extent> {
    Some(Extent::Range([from, to]))
}

const UP: [f64; 3] = [1.0, 2.0, 3.0];

fn times(v: [f64; 3], factor: f64) -> [f64; 3] {
    v.map(|x| x * factor)
}

#[test]
fn line_load_has_exact_length_and_centre() {
    let line =
        |selector: Where| deck(Load { r#where: selector, line: Some(UP), ..Load::default() });
    // Lines along y on the top, across a gap: at an edge and inside a gap. Then a line along x
    // inside a gap.
    check(&line(planes([plane(0.0), None, plane(1.0)])), times(UP, 2.0), [0.0, 1.0, 1.0]);
    check(&line(planes([plane(2.0), None, plane(1.0)])), times(UP, 2.0), [2.0, 1.0, 1.0]);
    check(&line(planes([None, plane(1.0), plane(1.0)])), times(UP, 4.0), [2.0, 1.0, 1.0]);
}

#[test]
fn range_cuts_line_exactly() {
    for (from, to) in [(0.3, 1.7), (0.0, 0.1), (0.5, 1.0), (0.995, 1.003), (-3.0, 0.77), (0.4, 0.5)]
    {
        let selector = planes([plane(0.0), range(from, to), plane(1.0)]);
        let (sum, _) =
            resultant(&deck(Load { r#where: selector, line: Some(UP), ..Load::default() }));
        let length = to - f64::max(from, 0.0);
        assert!((sum - Vec3::from(UP) * length).norm() < 1e-12, "{from}…{to}: {sum}");
    }
}

#[test]
fn face_load_has_exact_area_and_centroid() {
    let traction =
        |selector: Where| deck(Load { r#where: selector, traction: Some(UP), ..Load::default() });
    check(&traction(planes([None, None, plane(1.0)])), times(UP, 8.0), [2.0, 1.0, 1.0]);
    check(&traction(planes([plane(4.0), None, None])), times(UP, 2.0), [4.0, 1.0, 0.5]);
    check(&traction(planes([None, plane(0.0), None])), times(UP, 4.0), [2.0, 0.0, 0.5]);
}

#[test]
fn ranges_cut_face_exactly() {
    for [from, to, low, high] in [
        [0.5, 3.1, 0.0, 2.0],
        [0.1, 0.2, 0.3, 0.4],
        [1.9, 2.1, 0.9, 1.1],
        [1.995, 2.004, 0.2, 1.9],
        [1.995, 3.0, 0.0, 1.0],
    ] {
        let selector = planes([range(from, to), range(low, high), plane(1.0)]);
        let (sum, _) =
            resultant(&deck(Load { r#where: selector, traction: Some(UP), ..Load::default() }));
        let area = (to - from) * (high - low);
        assert!((sum - Vec3::from(UP) * area).norm() < 1e-12, "{from} {to} {low} {high}: {sum}");
    }
}

#[test]
fn pressure_on_all_faces_has_no_resultant() {
    let mut deck = deck(Load { pressure: Some(1e5), ..Load::default() });
    deck.blocks[0].axes = [[1.0, 0.1, 0.0], [0.3, 1.0, -0.2], [0.2, 0.2, 1.0]];
    let (sum, moment) = resultant(&deck);
    assert!(sum.norm() < 1e-9 && moment.norm() < 1e-9, "{sum} {moment}");
}

#[test]
fn pressure_acts_inward() {
    let selector = planes([None, None, plane(1.0)]);
    let pressed = deck(Load { r#where: selector, pressure: Some(5.0), ..Load::default() });
    check(&pressed, [0.0, 0.0, -40.0], [2.0, 1.0, 1.0]);
}

#[test]
fn force_is_shared_by_tributary_size() {
    let force =
        |selector: Where| deck(Load { r#where: selector, force: Some(UP), ..Load::default() });
    check(&force(Where::default()), UP, [2.0, 1.0, 0.5]);
    check(&force(planes([None, None, plane(1.0)])), UP, [2.0, 1.0, 1.0]);
    check(&force(planes([plane(2.0), None, plane(1.0)])), UP, [2.0, 1.0, 1.0]);
    check(&force(planes([plane(2.0), plane(1.0), plane(1.0)])), UP, [2.0, 1.0, 1.0]);
}

#[test]
fn later_supports_override_earlier_ones() {
    let mut deck = deck(Load { traction: Some(UP), ..Load::default() });
    let fix = |velocity: f64| Fix {
        axes: "x".into(),
        velocity: Some([velocity, 0.0, 0.0]),
        ..Fix::default()
    };
    deck.fix = vec![fix(1.0), fix(2.0)];
    let mut simulation = Simulation::new(deck.build().unwrap_or_else(|error| panic!("{error}")));
    simulation.step().unwrap_or_else(|error| panic!("{error}"));
    let n = simulation.model().n_nodes();
    assert!((0..n).all(|node| simulation.displacement(node)[0] == 2.0 * simulation.time_step()));
}

#[test]
fn conditions_act_within_their_stages() {
    let mut deck = deck(Load {
        traction: Some(UP),
        history: Some(History::Ramp(2.0)),
        from: Some("b".into()),
        until: Some("c".into()),
        ..Load::default()
    });
    let stage = |name: &str| Stage {
        name: name.into(),
        kind: StageKind::Dynamic,
        duration: Some(1.0),
        ..Stage::default()
    };
    deck.stage = ["a", "b", "c"].map(stage).to_vec();
    let model = deck.build().unwrap_or_else(|error| panic!("{error}"));
    let conditions = model.conditions();
    assert_eq!(
        [0, 1, 2].map(|stage| conditions.loaded[0].in_force.has(stage)),
        [false, true, false]
    );
    // The ramp counts from the start of `b`, at 10 s.
    let at = |stage: usize, time: f64| {
        let factors = conditions.factors(stage, time, &[0.0, 10.0, 20.0]);
        factors.map_or(f64::NAN, |factors| factors[0])
    };
    assert_eq!(
        [at(0, 5.0), at(1, 10.0), at(1, 11.0), at(1, 19.0), at(2, 21.0)],
        [0.0, 0.0, 0.5, 1.0, 0.0]
    );
}

#[test]
fn half_space_cuts_face_like_range() {
    let below = |z: f64| Where { below: Some(Sheet::Level(z)), ..planes([plane(0.0), None, None]) };
    let traction =
        |selector: Where| deck(Load { r#where: selector, traction: Some(UP), ..Load::default() });
    // Each nodal force acts at its node, so only the resultant force is exact, not its moment.
    for z in [0.1, 0.37, 0.9, 7.0] {
        let (sum, _) = resultant(&traction(below(z)));
        assert!((sum - Vec3::from(UP) * 2.0 * z.min(1.0)).norm() < 1e-12, "{z}: {sum}");
    }
}

/// A line where a plane meets a side of a rotated set, in a gap and at an edge; faces by their dip.
#[test]
fn rotated_set_has_exact_lines_and_faces() {
    let turned = |mut deck: Deck| {
        (deck.blocks[0].dip, deck.blocks[0].dip_direction) = (Some(30.0), Some(90.0));
        deck
    };
    let (s, c) = 30_f64.to_radians().sin_cos();
    // Coordinates of a point that is given along the axes of the set.
    let at = |x: f64, y: f64, z: f64| [x * c + z * s, y, z * c - x * s];
    for x in [2.0, 4.0] {
        let across =
            Plane { point: at(x, 0.0, 0.0), normal: Some(at(-2.0, 0.0, 0.0)), ..Plane::default() };
        let side = Some(Side::HighZ);
        let selector = Where { plane: Some(across), side, ..Where::default() };
        let line = Load { r#where: selector, line: Some(UP), ..Load::default() };
        check(&turned(deck(line)), times(UP, 2.0), at(x, 1.0, 1.0));
    }
    let selector = Where { dip: Some(30.0), dip_direction: Some(90.0), ..Where::default() };
    let both = Load { r#where: selector.clone(), traction: Some(UP), ..Load::default() };
    check(&turned(deck(both)), times(UP, 16.0), at(2.0, 1.0, 0.5));
    let selector = Where { above: Some(Sheet::Level(0.0)), side: Some(Side::HighZ), ..selector };
    let top = Load { r#where: selector, pressure: Some(5.0), ..Load::default() };
    // The half-space cuts the upper side along the set's y axis, at z = 0.
    let (sum, _) = resultant(&turned(deck(top)));
    let length = c / s;
    assert!((sum.norm() - 5.0 * 2.0 * length).abs() < 1e-9, "{sum}");
}
