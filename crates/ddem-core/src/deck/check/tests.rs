use super::check;
use crate::deck::*;

/// Two blocks, a joint, a support, a load, two stages and a probe.
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
        load: vec![Load { region: top, pressure: Some(1e5), ..Load::default() }],
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

/// The places of the faults of the good deck after a change.
fn places(change: impl FnOnce(&mut Deck)) -> Vec<String> {
    let mut deck = good();
    change(&mut deck);
    check(&deck).into_iter().map(|fault| fault.place).collect()
}

fn joint(change: impl FnOnce(&mut Joint)) -> Vec<String> {
    places(|deck| change(deck.joints.get_mut("seam").expect("the good deck has it")))
}

#[test]
fn a_good_deck_has_no_faults() {
    assert_eq!(check(&good()), []);
}

#[test]
fn values_have_rules() {
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
    assert_eq!(shake(|s| s.frames = Some(0)), ["stage[1].frames"]);
    assert_eq!(shake(|s| s.fields_every = Some(0.0)), ["stage[1].fields_every"]);
    let probe = |change: fn(&mut Probe)| places(|deck| change(&mut deck.probe[0]));
    assert_eq!(probe(|p| p.every = Some(-1.0)), ["probe[0].every"]);
    assert_eq!(probe(|p| p.every_steps = Some(0)), ["probe[0].every_steps"]);
}

#[test]
fn conditions_have_rules() {
    let load = |change: fn(&mut Load)| places(|deck| change(&mut deck.load[0]));
    assert_eq!(load(|l| l.history = Some(History::Ramp(-1.0))), ["load[0].history.ramp"]);
    assert_eq!(load(|l| l.history = Some(History::Table(vec![]))), ["load[0].history.table"]);
    assert_eq!(load(|l| l.from = Some("lode".into())), ["load[0].from"]);
    assert_eq!(load(|l| l.until = Some("load".into())), ["load[0].until"]);
    assert_eq!(load(|l| l.region.set = Some("bean".into())), ["load[0].where.set"]);
    let sphere = |l: &mut Load| l.region.sphere = Some(Sphere { centre: [0.0; 3], radius: -1.0 });
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
fn a_joint_has_one_stiffness() {
    assert_eq!(joint(|j| j.thickness = 0.0), ["joints.seam.thickness"]);
    assert_eq!(joint(|j| j.thickness = -0.1), ["joints.seam.thickness"]);
    assert_eq!(joint(|j| j.material = None), ["joints.seam"]);
    assert_eq!(joint(|j| j.material = Some("rok".into())), ["joints.seam.material"]);
    assert_eq!(joint(|j| j.normal_stiffness = Some(1e9)), ["joints.seam.normal_stiffness"]);
    let spring = |j: &mut Joint| {
        *j = Joint { normal_stiffness: Some(1e9), shear_stiffness: Some(1e9), ..Joint::default() };
    };
    assert_eq!(joint(spring), ["joints.seam.normal_stiffness"]);
    let own = |j: &mut Joint| {
        *j = Joint { thickness: 0.1, young: Some(1e9), ..Joint::default() };
    };
    assert_eq!(joint(own), ["joints.seam.density", "joints.seam.poisson"]);
}

#[test]
fn the_nearest_name_is_said() {
    let mut deck = good();
    deck.blocks[0].material = "rocks".into();
    let faults = check(&deck);
    assert_eq!(faults[0].message, "there is no material named `rocks`");
    let help = "did you mean `rock`? materials of this deck: `rock`";
    assert_eq!(faults[0].help.as_deref(), Some(help));
}
