mod contact;

use super::check;
use crate::schema::*;

/// Deck with two blocks, a joint, a support, a load, two stages and a probe.
fn good() -> Deck {
    let rock = Material { density: 2400.0, young: 18e9, poisson: 0.25 };
    let seam = Joint { thickness: 0.01, material: Some("rock".into()), ..Joint::default() };
    let top = Where { z: Some(Extent::Plane(1.0)), ..Where::default() };
    Deck {
        materials: [("rock".to_owned(), rock)].into(),
        joints: [("seam".to_owned(), seam)].into(),
        blocks: vec![BlockSet {
            name: Some("beam".into()),
            size: Some([2.0, 1.0, 1.0]),
            count: Some([2, 1, 1]),
            material: "rock".into(),
            joint: Some(JointChoice::All("seam".into())),
            ..BlockSet::default()
        }],
        fix: vec![Fix { axes: "xyz".into(), velocity: Some([0.0; 3]), ..Fix::default() }],
        load: vec![Load { r#where: top, pressure: Some(1e5), ..Load::default() }],
        initial: vec![Initial { spin: Some([0.0, 0.0, 1.0]), ..Initial::default() }],
        stage: vec![
            Stage { name: "load".into(), ..Stage::default() },
            Stage {
                name: "shake".into(),
                kind: StageKind::Dynamic,
                duration: Some(1.0),
                ..Stage::default()
            },
        ],
        probe: vec![Probe { name: "mid".into(), at: Some([1.0; 3]), ..Probe::default() }],
        ..Deck::default()
    }
}

/// Places of the faults of the good deck after a change.
fn places(change: impl FnOnce(&mut Deck)) -> Vec<String> {
    let mut deck = good();
    change(&mut deck);
    check(&deck).into_iter().map(|fault| fault.place).collect()
}

fn joint(change: impl FnOnce(&mut Joint)) -> Vec<String> {
    places(|deck| change(deck.joints.get_mut("seam").expect("the good deck has it")))
}

#[test]
fn good_deck_has_no_faults() {
    assert_eq!(check(&good()), []);
}

#[test]
fn too_many_materials_and_joints_are_refused() {
    let all = |many: u32| {
        places(|deck| {
            let seam = deck.joints["seam"].clone();
            deck.joints.extend((1..many).map(|k| (format!("seam {k}"), seam.clone())));
        })
    };
    assert_eq!(all(65_535), [""; 0]);
    assert_eq!(all(65_536), ["joints"]);
}

#[test]
fn invalid_values_are_refused() {
    let material =
        |change: fn(&mut Material)| places(|deck| deck.materials.values_mut().for_each(change));
    assert_eq!(material(|m| m.density = 0.0), ["materials.rock.density"]);
    assert_eq!(material(|m| m.young = f64::NAN), ["materials.rock.young"]);
    assert_eq!(material(|m| m.poisson = -1.0), ["materials.rock.poisson"]);
    let set = |change: fn(&mut BlockSet)| places(|deck| change(&mut deck.blocks[0]));
    assert_eq!(set(|s| s.divisions = 0), ["blocks[0].divisions"]);
    assert_eq!(set(|s| s.size = Some([2.0, -1.0, 1.0])), ["blocks[0].size[1]"]);
    assert_eq!(set(|s| s.axes[2] = [0.0; 3]), ["blocks[0].axes[2]"]);
    assert_eq!(set(|s| s.origin[2] = f64::INFINITY), ["blocks[0].origin[2]"]);
    assert_eq!(set(|s| s.joint = None), ["blocks[0]"]);
    assert_eq!(set(|s| s.name = Some(String::new())), ["blocks[0].name"]);
    let stage =
        |change: fn(&mut Stage)| places(|deck| deck.stage.iter_mut().take(1).for_each(change));
    assert_eq!(stage(|s| s.tolerance = Some(1.0)), ["stage[0].tolerance"]);
    assert_eq!(stage(|s| s.max_steps = Some(0)), ["stage[0].max_steps"]);
    assert_eq!(stage(|s| s.increments = Some(0)), ["stage[0].increments"]);
    assert_eq!(stage(|s| s.frames = Some(3)), ["stage[0].frames"]);
    assert_eq!(stage(|s| s.name.clear()), ["stage[0].name"]);
    let shake = |change: fn(&mut Stage)| places(|deck| change(&mut deck.stage[1]));
    assert_eq!(shake(|s| s.duration = Some(0.0)), ["stage[1].duration"]);
    assert_eq!(shake(|s| s.tolerance = Some(1e-6)), ["stage[1].tolerance"]);
    assert_eq!(shake(|s| s.time_step = Some(TimeStep::Seconds(0.0))), ["stage[1].time_step"]);
    assert_eq!(shake(|s| s.damping = Some(Damping::Ratio(-0.1))), ["stage[1].damping.ratio"]);
    assert_eq!(shake(|s| s.damping = Some(Damping::Mass(-0.1))), ["stage[1].damping.mass"]);
    let viscous = shake(|s| s.damping = Some(Damping::Stiffness(-1e-5)));
    assert_eq!(viscous, ["stage[1].damping.stiffness"]);
    assert_eq!(shake(|s| s.frames = Some(0)), ["stage[1].frames"]);
    assert_eq!(shake(|s| s.fields_every = Some(0.0)), ["stage[1].fields_every"]);
    let probe = |change: fn(&mut Probe)| places(|deck| change(&mut deck.probe[0]));
    assert_eq!(probe(|p| p.every = Some(-1.0)), ["probe[0].every"]);
    assert_eq!(probe(|p| p.every_steps = Some(0)), ["probe[0].every_steps"]);
}

#[test]
fn invalid_conditions_are_refused() {
    let load = |change: fn(&mut Load)| places(|deck| change(&mut deck.load[0]));
    assert_eq!(load(|l| l.history = Some(History::Ramp(-1.0))), ["load[0].history.ramp"]);
    assert_eq!(load(|l| l.history = Some(History::Table(vec![]))), ["load[0].history.table"]);
    assert_eq!(load(|l| l.from = Some("lode".into())), ["load[0].from"]);
    assert_eq!(load(|l| l.until = Some("load".into())), ["load[0].until"]);
    assert_eq!(load(|l| l.r#where.set = Some("bean".into())), ["load[0].where.set"]);
    let sphere = |l: &mut Load| l.r#where.sphere = Some(Sphere { centre: [0.0; 3], radius: -1.0 });
    assert_eq!(places(|deck| sphere(&mut deck.load[0])), ["load[0].where.sphere.radius"]);
    let fix = |change: fn(&mut Fix)| places(|deck| change(&mut deck.fix[0]));
    assert_eq!(fix(|f| f.axes.clear()), ["fix[0].axes"]);
    assert_eq!(fix(|f| f.velocity = Some([f64::NAN, 0.0, 0.0])), ["fix[0].velocity[0]"]);
    assert_eq!(places(|deck| deck.initial[0].spin = None), ["initial[0]"]);
    let no_support = places(|deck| {
        deck.fix.clear();
        deck.probe[0].quantity = Quantity::Reaction;
    });
    assert_eq!(no_support, ["probe[0].quantity"]);
}

#[test]
fn joint_takes_one_kind_of_stiffness() {
    assert_eq!(joint(|j| j.thickness = 0.0), ["joints.seam.thickness"]);
    assert_eq!(joint(|j| j.thickness = -0.1), ["joints.seam.thickness"]);
    assert_eq!(joint(|j| j.material = None), ["joints.seam"]);
    assert_eq!(joint(|j| j.material = Some("rok".into())), ["joints.seam.material"]);
    assert_eq!(joint(|j| j.normal_stiffness = Some(1e9)), ["joints.seam.normal_stiffness"]);
    let spring = |j: &mut Joint| {
        *j = Joint { normal_stiffness: Some(1e9), shear_stiffness: Some(1e9), ..Joint::default() };
    };
    assert_eq!(joint(spring), [""; 0]);
    let both = |j: &mut Joint| (j.normal_stiffness, j.shear_stiffness) = (Some(1e9), Some(1e9));
    assert_eq!(joint(both), ["joints.seam.normal_stiffness"]);
    let own = |j: &mut Joint| {
        *j = Joint { thickness: 0.1, young: Some(1e9), ..Joint::default() };
    };
    assert_eq!(joint(own), ["joints.seam.density", "joints.seam.poisson"]);
}

#[test]
fn invalid_strengths_are_refused() {
    let one = |change: fn(&mut Joint)| {
        joint(|j| {
            (j.cohesion, j.friction, j.tension) = (Some(1e6), Some(30.0), Some(1e6));
            change(j);
        })
    };
    assert_eq!(one(|_| {}), [""; 0]);
    assert_eq!(one(|j| j.cohesion = Some(-1e6)), ["joints.seam.cohesion"]);
    assert_eq!(one(|j| j.tension = Some(-1.0)), ["joints.seam.tension"]);
    assert_eq!(one(|j| j.friction = Some(90.0)), ["joints.seam.friction"]);
    assert_eq!(one(|j| j.friction = Some(-1.0)), ["joints.seam.friction"]);
    assert_eq!(one(|j| j.residual_friction = Some(90.0)), ["joints.seam.residual_friction"]);
    assert_eq!(one(|j| j.residual_friction = Some(31.0)), ["joints.seam.residual_friction"]);
    assert_eq!(one(|j| j.residual_cohesion = Some(1.1e6)), ["joints.seam.residual_cohesion"]);
    assert_eq!(one(|j| j.residual_cohesion = Some(-1.0)), ["joints.seam.residual_cohesion"]);
    assert_eq!(one(|j| j.dilation = Some(31.0)), ["joints.seam.dilation"]);
    assert_eq!(one(|j| j.dilation = Some(-1.0)), ["joints.seam.dilation"]);
    let residuals = |j: &mut Joint| {
        (j.residual_cohesion, j.residual_friction, j.dilation) =
            (Some(1e6), Some(30.0), Some(30.0));
    };
    assert_eq!(one(residuals), [""; 0]);
    // Missing strengths are 0.
    assert_eq!(joint(|j| j.friction = Some(0.0)), [""; 0]);
    let beyond_nothing = |j: &mut Joint| (j.tension, j.dilation) = (Some(1e6), Some(1.0));
    assert_eq!(joint(beyond_nothing), ["joints.seam.dilation"]);
    assert_eq!(joint(|j| j.residual_cohesion = Some(0.0)), ["joints.seam.residual_cohesion"]);
}

/// The seam is of rock: k_n = 1.2 E/t = 2.16e12 Pa/m, k_s = 0.4 E/t = 7.2e11 Pa/m.
#[test]
fn fracture_energy_below_peak_elastic_energy_is_refused() {
    let energies = |g: [f64; 2], change: fn(&mut Joint)| {
        joint(|j| {
            (j.cohesion, j.friction, j.tension) = (Some(2.4e6), Some(30.0), Some(1.2e6));
            j.fracture_energy = Some(g);
            change(j);
        })
    };
    // σ_t²/(2 k_n) = 1/3, c²/(2 k_s) = 4.
    assert_eq!(energies([0.3334, 4.001], |_| {}), [""; 0]);
    assert_eq!(energies([0.3333, 4.001], |_| {}), ["joints.seam.fracture_energy[0]"]);
    assert_eq!(energies([0.3334, 3.999], |_| {}), ["joints.seam.fracture_energy[1]"]);
    assert_eq!(energies([-1.0, 5.0], |_| {}), ["joints.seam.fracture_energy[0]"]);
    assert_eq!(energies([1.0, f64::INFINITY], |_| {}), ["joints.seam.fracture_energy[1]"]);
    // Only the lost cohesion softens: half of the cohesion takes a quarter of the energy.
    assert_eq!(energies([1.0, 1.001], |j| j.residual_cohesion = Some(1.2e6)), [""; 0]);
    let no_loss = |j: &mut Joint| {
        (j.residual_cohesion, j.tension) = (j.cohesion, None);
    };
    assert_eq!(energies([0.0, 0.0], no_loss), [""; 0]);
    // A thicker joint is softer and holds more.
    assert_eq!(energies([1.0, 5.0], |j| j.thickness = 0.02), ["joints.seam.fracture_energy[1]"]);
    let spring = |j: &mut Joint| {
        (j.material, j.thickness) = (None, 0.0);
        (j.normal_stiffness, j.shear_stiffness) = (Some(1e12), Some(1e13));
    };
    assert_eq!(energies([0.7, 1.0], spring), ["joints.seam.fracture_energy[0]"]);
}

#[test]
fn least_fracture_energy_is_rounded_up_to_four_digits() {
    let mut deck = good();
    if let Some(seam) = deck.joints.get_mut("seam") {
        (seam.cohesion, seam.tension) = (Some(2.4e6), Some(1.2e6));
        seam.fracture_energy = Some([0.1, 4.0]);
    }
    let faults = check(&deck);
    let messages: Vec<_> = faults.iter().map(|fault| fault.message.as_str()).collect();
    assert_eq!(
        messages,
        [
            "`fracture_energy` in opening is 0.1 J/m² but must be above 0.3334 J/m²",
            "`fracture_energy` in sliding is 4 J/m² but must be above 4 J/m²",
        ]
    );
    let help = faults[0].help.as_deref().unwrap_or_default();
    assert!(help.contains("with k_n = 2.16e12 Pa/m"), "{help}");
}

#[test]
fn invalid_roughness_is_refused() {
    let one = |change: fn(&mut Joint)| {
        joint(|j| {
            (j.jrc, j.jcs, j.residual_friction) = (Some(10.0), Some(50e6), Some(30.0));
            change(j);
        })
    };
    let both = |j: &mut Joint| (j.tension, j.dilation) = (Some(1e5), Some(70.0));
    assert_eq!(one(both), [""; 0]);
    assert_eq!(one(|j| j.jrc = Some(20.0)), [""; 0]);
    assert_eq!(one(|j| j.jrc = Some(0.0)), [""; 0]);
    assert_eq!(one(|j| j.jrc = Some(20.1)), ["joints.seam.jrc"]);
    assert_eq!(one(|j| j.jrc = Some(-0.1)), ["joints.seam.jrc"]);
    assert_eq!(one(|j| j.jcs = Some(0.0)), ["joints.seam.jcs"]);
    assert_eq!(one(|j| j.jcs = Some(f64::NAN)), ["joints.seam.jcs"]);
    assert_eq!(one(|j| j.jcs = None), ["joints.seam.jcs"]);
    assert_eq!(one(|j| j.jrc = None), ["joints.seam.jrc"]);
    assert_eq!(one(|j| j.residual_friction = None), ["joints.seam.residual_friction"]);
    assert_eq!(one(|j| j.residual_friction = Some(70.5)), ["joints.seam.residual_friction"]);
    assert_eq!(one(|j| j.dilation = Some(71.0)), ["joints.seam.dilation"]);
    assert_eq!(one(|j| j.dilation = Some(90.0)), ["joints.seam.dilation"]);
    assert_eq!(one(|j| j.cohesion = Some(0.0)), ["joints.seam.cohesion"]);
    assert_eq!(one(|j| j.friction = Some(40.0)), ["joints.seam.friction"]);
    assert_eq!(one(|j| j.residual_cohesion = Some(0.0)), ["joints.seam.residual_cohesion"]);
    assert_eq!(one(|j| j.fracture_energy = Some([1.0; 2])), ["joints.seam.fracture_energy"]);
}

#[test]
fn joint_stiffness_follows_from_its_material() {
    let materials = good().materials;
    let close = |joint: Joint, expected: [f64; 2]| {
        let found = joint.stiffness(&materials).unwrap_or_default();
        let near = |(a, b): (f64, f64)| (a - b).abs() <= 1e-14 * b;
        assert!(found.into_iter().zip(expected).all(near), "{found:?}");
    };
    let seam = good().joints.remove("seam").unwrap_or_default();
    close(seam.clone(), [2.16e12, 7.2e11]);
    let own = Joint {
        material: None,
        young: Some(18e9),
        poisson: Some(0.25),
        thickness: 0.02,
        ..Joint::default()
    };
    close(own.clone(), [1.08e12, 3.6e11]);
    let springs = (Some(2e9), Some(1e9));
    let spring =
        Joint { normal_stiffness: springs.0, shear_stiffness: springs.1, ..Joint::default() };
    close(spring.clone(), [2e9, 1e9]);
    for incomplete in [
        Joint { thickness: 0.0, ..seam.clone() },
        Joint { material: Some("air".into()), ..seam },
        Joint { young: None, ..own },
        Joint { shear_stiffness: None, ..spring },
        Joint::default(),
    ] {
        assert_eq!(incomplete.stiffness(&materials), None);
    }
}

#[test]
fn any_strength_lets_joint_fail() {
    assert!(!Joint::default().can_fail());
    let residual = Joint { residual_friction: Some(1.0), ..Joint::default() };
    assert!(!residual.can_fail());
    for give in [
        |j: &mut Joint| j.cohesion = Some(0.0),
        |j: &mut Joint| j.friction = Some(0.0),
        |j: &mut Joint| j.tension = Some(0.0),
        |j: &mut Joint| j.jrc = Some(0.0),
        |j: &mut Joint| j.jcs = Some(0.0),
    ] {
        let mut joint = Joint::default();
        give(&mut joint);
        assert!(joint.can_fail());
    }
}

#[test]
fn nearest_name_is_suggested() {
    let mut deck = good();
    deck.blocks[0].material = "rocks".into();
    let faults = check(&deck);
    assert_eq!(faults[0].message, "there is no material named `rocks`");
    let help = "did you mean `rock`? materials of this model: `rock`";
    assert_eq!(faults[0].help.as_deref(), Some(help));
}
