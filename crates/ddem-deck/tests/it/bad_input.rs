//! A deck with any error gives a list of errors, never a panic.

use ddem_deck::Size;
use ddem_deck::*;
use toml::Value;

use crate::decks::*;

/// Valid deck that uses every part of the format that this version computes.
fn rich() -> Deck {
    let mut deck = with_axes(deck([2, 2, 1], [2.0, 2.0, 1.0], 1, 0.01), OBLIQUE);
    deck.title = "everything".into();
    deck.contact = ContactTable {
        normal_stiffness: Some(1e9),
        shear_stiffness: Some(5e8),
        friction: Some(35.0),
        damping: Some(0.1),
        restitution: None,
    };
    deck.model.gravity = [0.0, 0.0, -9.81];
    let own = Joint {
        thickness: 0.01,
        density: Some(2000.0),
        young: Some(1e9),
        poisson: Some(0.2),
        cohesion: Some(1e5),
        friction: Some(40.0),
        tension: Some(5e4),
        residual_cohesion: Some(1e4),
        residual_friction: Some(30.0),
        dilation: Some(5.0),
        fracture_energy: Some([10.0, 20.0]),
        ..Joint::default()
    };
    deck.joints.insert("own".into(), own);
    deck.joints.insert("rough".into(), Joint { dilation: Some(5.0), ..rough() });
    deck.blocks[0].name = Some("pile".into());
    let cuts = |cuts: &[f64]| Some(cuts.to_vec());
    deck.blocks.push(BlockSet {
        name: Some("far".into()),
        origin: [10.0, 0.0, 0.0],
        edges: Some(Edges {
            x: cuts(&[0.0, 1.0, 3.0]),
            y: cuts(&[0.0, 1.0]),
            z: cuts(&[0.0, 2.0]),
        }),
        divisions: 2,
        material: "rock".into(),
        joint: Some(JointChoice::ByNormal { x: Some("own".into()), y: None, z: None }),
        ..BlockSet::default()
    });
    let set = |name: &str| Where { set: Some(name.into()), ..Where::default() };
    let range = |axis: usize, from: f64, to: f64| {
        let mut region = plane(axis, 0.0);
        *[&mut region.x, &mut region.y, &mut region.z][axis] = Some(Extent::Range([from, to]));
        region
    };
    let sphere = Some(Sphere { centre: [1.0, 1.0, 0.5], radius: 4.0 });
    deck.assign = vec![
        Assign { r#where: set("pile"), joint: Some("own".into()), ..Assign::default() },
        Assign { r#where: set("far"), material: Some("clay".into()), ..Assign::default() },
    ];
    deck.remove = vec![Remove { r#where: range(0, 11.5, 12.5), ..Remove::default() }];
    deck.fix = vec![
        Fix {
            velocity: Some([0.1, 0.0, 0.0]),
            history: Some(History::Ramp(0.1)),
            until: Some("shake".into()),
            ..fix(set("pile"), "xyz")
        },
        fix(set("far"), "xyz"),
    ];
    let table = Some(History::Table(vec![[0.0, 0.0], [1.0, 2.0]]));
    let load = |load: Load| load;
    deck.load = vec![
        load(Load { r#where: set("far"), pressure: Some(1e5), history: table, ..Load::default() }),
        load(Load { r#where: set("far"), traction: Some([1.0, 2.0, 3.0]), ..Load::default() }),
        load(Load {
            r#where: Where { sphere, ..Where::default() },
            force: Some([1.0, 2.0, 3.0]),
            from: Some("shake".into()),
            ..Load::default()
        }),
        load(Load {
            r#where: Where { x: Some(Extent::Plane(10.0)), ..plane(2, 2.0) },
            line: Some([0.0, 0.0, -1.0]),
            ..Load::default()
        }),
    ];
    deck.boundary = vec![Boundary {
        r#where: set("pile"),
        kind: BoundaryKind::Viscous,
        velocity: Some([0.0, 0.1, 0.2]),
        history: Some(History::Ramp(0.05)),
        from: Some("shake".into()),
        until: None,
    }];
    deck.initial = vec![Initial {
        velocity: Some([1.0, 0.0, 0.0]),
        spin: Some([0.0, 0.0, 1.0]),
        centre: Some([0.5; 3]),
        ..Initial::default()
    }];
    deck.stage = vec![
        Stage {
            tolerance: Some(1e-4),
            max_steps: Some(1000),
            increments: Some(2),
            ..relax_stage("weight")
        },
        Stage {
            kind: StageKind::Dynamic,
            duration: Some(0.1),
            damping: Some(Damping::Ratio(0.1)),
            time_step: Some(TimeStep::Seconds(1e-6)),
            fields_every: Some(0.05),
            ..relax_stage("shake")
        },
    ];
    deck.probe = vec![
        Probe { name: "a".into(), at: Some([1.0; 3]), every: Some(0.1), ..Probe::default() },
        Probe {
            name: "b".into(),
            r#where: Some(set("far")),
            quantity: Quantity::Reaction,
            every_steps: Some(3),
            ..Probe::default()
        },
    ];
    deck
}

/// Paths of all leaves of a value.
fn leaves(value: &Value, path: &mut Vec<Step>, out: &mut Vec<Vec<Step>>) {
    let children: Vec<(Step, &Value)> = match value {
        Value::Table(table) => table.iter().map(|(key, v)| (Step::Key(key.clone()), v)).collect(),
        Value::Array(array) => array.iter().enumerate().map(|(i, v)| (Step::At(i), v)).collect(),
        _ => {
            out.push(path.clone());
            return;
        }
    };
    for (step, child) in children {
        path.push(step);
        leaves(child, path, out);
        path.pop();
    }
}

#[derive(Clone, Debug)]
enum Step {
    Key(String),
    At(usize),
}

fn at<'a>(value: &'a mut Value, path: &[Step]) -> &'a mut Value {
    path.iter().fold(value, |value, step| match step {
        Step::Key(key) => &mut value[key.as_str()],
        Step::At(i) => &mut value[*i],
    })
}

/// Wrong values that replace a leaf.
fn wrong(value: &Value) -> Vec<Value> {
    match value {
        Value::Float(x) => {
            let numbers =
                [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 0.0, -x, 1e-300, 1e300, -1e300, 1e17];
            numbers.map(Value::Float).to_vec()
        }
        Value::Integer(_) => [0, -1, i64::from(u32::MAX), i64::MAX].map(Value::Integer).to_vec(),
        Value::String(_) => ["", "x", "nobody"].map(|s| Value::String(s.into())).to_vec(),
        _ => Vec::new(),
    }
}

/// Checks that errors have a place and a message, and that a built model has nodes.
fn try_deck(deck: &Deck, what: &str) -> bool {
    match deck.build() {
        Ok(model) => {
            assert!(model.n_nodes() > 0, "{what}");
            true
        }
        Err(error) => {
            assert!(!error.faults.is_empty(), "{what}: no fault");
            for fault in &error.faults {
                assert!(!fault.place.is_empty() && !fault.message.is_empty(), "{what}: {fault}");
            }
            false
        }
    }
}

/// Few enough nodes to build, or so many that `ddem-io` refuses them by [`Size`] before it builds.
fn is_small(deck: &Deck) -> bool {
    Size::of(deck).nodes < 1e6 || Size::of(deck).nodes > f64::from(u32::MAX)
}

fn value(deck: &Deck) -> Value {
    Value::try_from(deck).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn one_invalid_value_never_panics() {
    let deck = rich();
    model(&deck);
    let good = value(&deck);
    let mut paths = Vec::new();
    leaves(&good, &mut Vec::new(), &mut paths);
    let (mut built, mut refused, mut unread) = (0, 0, 0);
    for path in &paths {
        for other in wrong(at(&mut good.clone(), path)) {
            let mut changed = good.clone();
            *at(&mut changed, path) = other.clone();
            let Ok(deck) = changed.try_into::<Deck>() else {
                unread += 1;
                continue;
            };
            if is_small(&deck) {
                let ok = try_deck(&deck, &format!("{path:?} = {other}"));
                if ok {
                    built += 1
                } else {
                    refused += 1
                }
                let finite = other.as_float().is_none_or(f64::is_finite);
                assert!(finite || !ok, "{path:?} = {other} is taken");
            }
        }
    }
    println!("{} leaves: {built} built, {refused} refused, {unread} not read", paths.len());
    assert!(paths.len() > 100 && refused > 300);
}

#[test]
fn two_invalid_values_never_panic() {
    let good = value(&rich());
    let mut paths = Vec::new();
    leaves(&good, &mut Vec::new(), &mut paths);
    let mut random = Random::new(3);
    let mut pick = |n: usize| (((random.next() + 1.0) / 2.0) * n as f64) as usize % n.max(1);
    for _ in 0..1500 {
        let mut changed = good.clone();
        let mut what = String::new();
        for _ in 0..2 {
            let path = &paths[pick(paths.len())];
            let others = wrong(at(&mut changed, path));
            if others.is_empty() {
                continue;
            }
            let other = others[pick(others.len())].clone();
            what += &format!("{path:?} = {other}; ");
            *at(&mut changed, path) = other;
        }
        if let Ok(deck) = changed.try_into::<Deck>()
            && is_small(&deck)
        {
            try_deck(&deck, &what);
        }
    }
}

#[test]
fn empty_models_are_refused() {
    assert!(!try_deck(&Deck::default(), "empty"));
    let mut all_removed = deck([2, 1, 1], [2.0, 1.0, 1.0], 1, 0.01);
    all_removed.remove.push(Remove::default());
    assert!(!try_deck(&all_removed, "all removed"));
    let mut nothing = deck([1; 3], [1.0; 3], 1, 0.0);
    nothing.joints.clear();
    nothing.blocks[0].joint = None;
    nothing.fix.push(fix(plane(0, 0.4), "x"));
    let places = nothing.build().err().map(|error| error.faults[0].place.clone());
    assert_eq!(places.as_deref(), Some("fix[0].where"));
}

/// Springs need no thickness; layers do.
#[test]
fn layer_joints_need_thickness_and_springs_do_not() {
    let mut flat = deck([2, 1, 1], [2.0, 1.0, 1.0], 1, 0.0);
    let places = flat.build().err().map(|error| error.faults[0].place.clone());
    assert_eq!(places.as_deref(), Some("joints.seam.thickness"));
    flat.joints.insert("seam".into(), spring());
    assert_eq!(model(&flat).n_pairs(), 4);
}

#[test]
fn warnings_about_failing_joints() {
    let mut deck = deck([3, 1, 1], [3.0, 1.0, 1.0], 1, 0.01);
    let strong = Joint {
        cohesion: Some(1e6),
        friction: Some(45.0),
        residual_friction: Some(30.0),
        tension: Some(1e6),
        dilation: Some(30.0),
        ..deck.joints["seam"].clone()
    };
    deck.joints.insert("unused".into(), strong.clone());
    assert_eq!(warnings(&deck), [""; 0]);
    deck.joints.insert("seam".into(), strong.clone());
    for contact in [None, Some(true), Some(false)] {
        deck.model.contact = contact;
        assert_eq!(warnings(&deck), [""; 0]);
    }

    let mut one = |joint: Joint| {
        deck.joints.insert("seam".into(), joint);
        warnings(&deck)
    };
    let beyond = one(Joint { tension: Some(1.1e6), ..strong.clone() });
    assert_eq!(
        beyond,
        [
            "joints.seam.tension: the tensile strength of 1.1e6 Pa is reached only without any shear: the shear \
             strength is zero at a tension of 1e6 Pa, cohesion/tan(friction); lower `tension` to that, or raise `cohesion` \
             [unreachable-tension]"
        ]
    );
    let no_cohesion = one(Joint { cohesion: None, friction: None, ..spring_with_tension() });
    assert!(no_cohesion[0].contains("zero at a tension of 0 Pa"), "{no_cohesion:?}");
    // Without friction the strength in shear has no limit, and a rough joint has no tension.
    assert_eq!(one(Joint { cohesion: Some(1e3), ..spring_with_tension() }), [""; 0]);
    assert_eq!(one(Joint { tension: Some(1e6), ..rough() }), [""; 0]);
    let steep = one(Joint { dilation: Some(31.0), ..strong });
    assert!(
        steep[0].starts_with("joints.seam.dilation: a dilation of 31 degrees exceeds"),
        "{steep:?}"
    );
}

fn spring() -> Joint {
    Joint { normal_stiffness: Some(1e9), shear_stiffness: Some(1e9), ..Joint::default() }
}

fn spring_with_tension() -> Joint {
    Joint { thickness: 0.01, tension: Some(1e6), ..spring() }
}

fn rough() -> Joint {
    let jcs = Some(50e6);
    Joint { thickness: 0.01, jrc: Some(10.0), jcs, residual_friction: Some(30.0), ..spring() }
}

#[test]
fn warnings_about_supports_on_both_sides_of_joint() {
    let warns = |joint: Joint, to: f64| {
        let mut deck = deck([1, 1, 2], [1.0, 1.0, 2.0], 2, 0.0);
        deck.joints.insert("seam".into(), joint);
        let z = Some(Extent::Range([0.0, to]));
        deck.fix = vec![fix(Where { z, ..Where::default() }, "xyz")];
        let warnings = warnings(&deck);
        warnings
            .iter()
            .any(|text| text.contains("the fix holds both sides of 1 joint that can fail"))
    };
    let weak = || Joint { tension: Some(1e6), ..spring() };
    // Without thickness, a range that ends at the joint includes both of its sides.
    assert!(warns(weak(), 1.0));
    assert!(!warns(weak(), 0.9));
    assert!(!warns(spring(), 1.0), "it never fails");
    assert!(!warns(spring_with_tension(), 1.0), "with thickness it has one side");
    // With both blocks fixed the joint cannot carry anything anyway.
    assert!(!warns(weak(), 2.0));
}

#[test]
fn warnings_about_units() {
    let mut deck = deck([1, 1, 2], [1.0, 1.0, 2.0], 2, 0.01);
    let stuff = Material { density: 2.4, young: 18.0, poisson: 0.25 };
    deck.materials.insert("light".into(), stuff);
    let weighed = Material { density: 26.0, young: 18e9, poisson: 0.25 };
    deck.materials.insert("weighed".into(), weighed);
    let joint = Joint { friction: Some(0.6), ..spring_with_tension() };
    deck.joints.insert("smooth".into(), joint);
    let joint = Joint {
        cohesion: Some(0.5),
        tension: Some(0.0),
        normal_stiffness: Some(20.0),
        ..spring_with_tension()
    };
    deck.joints.insert("weak".into(), joint);
    let load = |size: f64, history: Option<History>| Load {
        traction: Some([0.0, 0.0, -size]),
        history,
        ..Load::default()
    };
    let table = History::Table(vec![[0.0, 0.0], [1.0, 1e6]]);
    deck.load = vec![load(1.0, None), load(2.0, Some(table)), load(2.0, None)];
    let stage = |ratio: f64| Stage {
        name: format!("at {ratio}"),
        kind: StageKind::Dynamic,
        duration: Some(1.0),
        damping: Some(Damping::Ratio(ratio)),
        ..Stage::default()
    };
    deck.stage = vec![stage(1.0), stage(5.0)];
    (deck.contact.friction, deck.contact.restitution) = (Some(1.0), Some(0.0));
    deck.model.contact = Some(true);
    let warnings = warnings(&deck);
    let expected = [
        "materials.light.young: `young` is only 18 Pa; 18 GPa is 1.8e10 [suspicious-unit]",
        "materials.light.density: `density` is only 2.4 kg/m³; 2.4 t/m³ is 2400 [suspicious-unit]",
        "materials.weighed.density: `density` is only 26 kg/m³; 26 kN/m³ is 2650 [suspicious-unit]",
        "joints.smooth.friction: `friction` is an angle of only 0.6 degrees; a coefficient of 0.6 is 31.0 degrees, 0.6 rad \
         are 34.4 [suspicious-unit]",
        "joints.weak.cohesion: `cohesion` is only 0.5 Pa; 0.5 kPa is 5e2, 0.5 MPa is 5e5 [suspicious-unit]",
        "joints.weak.normal_stiffness: `normal_stiffness` is 20 Pa/m; 20 GPa/m is 2e10 [suspicious-unit]",
        "load[2].traction: `traction` is only 2 Pa; 2 kPa is 2e3, 2 MPa is 2e6 [suspicious-unit]",
        "stage[1].damping.ratio: a damping `ratio` of 5 is above 1, critical damping; 5 % is 0.05 [overdamped]",
        "contact.friction: `friction` is an angle of only 1 degrees; a coefficient of 1 is 45.0 degrees, 1 rad are 57.3 \
         [suspicious-unit]",
        "contact.restitution: a `restitution` below 0.135 is not possible; 0 gives 0.135; a stage with \
         `damping = { local = 0.8 }` brings blocks to rest [infeasible-restitution]",
    ];
    assert_eq!(warnings, expected);
}

#[test]
fn warnings_about_lengths_in_millimetres() {
    let of_edge = |edge: f64| {
        let mut deck = deck([1, 1, 2], [edge, edge, 2.0 * edge], 2, 0.01);
        deck.joints.values_mut().for_each(|joint| joint.thickness = 0.01 * edge);
        let about = warnings(&deck).into_iter().filter(|warning| warning.contains("shortest edge"));
        about.collect::<Vec<_>>()
    };
    assert!(of_edge(300.0).is_empty(), "{:?}", of_edge(300.0));
    let expected = "blocks[0].size: the shortest edge of the blocks is 1500 m; 1500 mm are 1.5 m \
                    [suspicious-unit]";
    assert_eq!(of_edge(1500.0), [expected]);
}
