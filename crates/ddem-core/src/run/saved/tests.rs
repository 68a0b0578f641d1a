//! Messages about saved states whose contents contradict each other or the model.

use std::sync::Arc;

use super::*;
use crate::model::conditions::FadingForces;
use crate::model::problem::{HexMesh, JointElasticity, JointProperties, ProblemBuilder, Vec3};
use crate::state::StageEntry;
use ddem_mechanics::element::Elastic;
use ddem_mechanics::law::SpringStiffness;
use ddem_mechanics::math::lanes::Lanes;

const CUBE: [[f64; 3]; 8] = [
    [0.0, 0.0, 0.0],
    [1.0, 0.0, 0.0],
    [1.0, 1.0, 0.0],
    [0.0, 1.0, 0.0],
    [0.0, 0.0, 1.0],
    [1.0, 0.0, 1.0],
    [1.0, 1.0, 1.0],
    [0.0, 1.0, 1.0],
];

/// A rigid cube beside a deformable one, before `change`.
fn pair(change: impl FnOnce(&mut ProblemBuilder)) -> Model {
    let beside = CUBE.map(|[x, y, z]| [x + 1.0, y, z]);
    let mesh = HexMesh {
        nodes: [CUBE, beside].concat(),
        hexes: vec![[0, 1, 2, 3, 4, 5, 6, 7], [8, 9, 10, 11, 12, 13, 14, 15]],
        blocks: vec![0, 1],
    };
    let mut builder = ProblemBuilder::new(&mesh, Elastic::new(2400.0, 18e9, 0.25)).unwrap();
    builder.set_rigid(0).unwrap();
    change(&mut builder);
    Model::new(Arc::new(builder.build().unwrap().0))
}

fn joined() -> Model {
    pair(|builder| {
        let stiffness = SpringStiffness { normal: 1e9, shear: 1e9 };
        let joint = builder.joint(JointProperties {
            name: "seam".into(),
            thickness: 0.0,
            elasticity: JointElasticity::Springs(stiffness),
            law: None,
        });
        builder.join([[1, 2, 6, 5], [8, 11, 15, 12]], joint).unwrap();
    })
}

fn without_contact() -> Model {
    pair(|builder| builder.properties.contact.search = false)
}

/// Bytes of a state, with other numbers of the model if given.
fn encoded(model: [u64; 9], state: &State, run: RunState) -> Vec<u8> {
    postcard::to_stdvec(&(FORMAT, model, Image { state, run })).unwrap()
}

fn message(model: Model, bytes: Vec<u8>) -> String {
    let restored = Simulation::restore(model, Simd::default(), &bytes.into());
    restored.map(|_| ()).expect_err("refused").to_string()
}

/// Message about the state of a model after a change.
fn changed(model: fn() -> Model, change: &dyn Fn(&mut State, &mut RunState)) -> String {
    let simulation = Simulation::new(model());
    let Image { mut state, mut run } = simulation.save().decode(&model()).unwrap();
    change(&mut state, &mut run);
    let numbers = counts(&model()).map(|(_, count)| count as u64);
    message(model(), encoded(numbers, &state, run))
}

type StateChange = &'static dyn Fn(&mut State, &mut RunState);

#[test]
fn states_that_contradict_themselves() {
    let of_pair: [StateChange; 20] = [
        &|state, _| state.stage = 7,
        &|state, _| state.stage_entry = Some(StageEntry { from_stage: 9, first: 9 }),
        &|state, _| state.released.extend([(0, FadingForces::default())]),
        &|state, _| state.u.truncate(3),
        &|state, _| state.load_factors.clear(),
        &|state, _| state.applied.extend([(99, [0.0; 3])]),
        &|state, _| state.columns.push([Vec3::zeros(); 2]),
        &|state, _| state.peaks.speeds.push(Lanes::ZERO),
        &|state, _| state.poses[0][0].shift.x = f64::NAN,
        &|state, _| state.broken_joints.packs.push(None),
        &|state, _| {
            let mut lattices = [const { None }; 8];
            lattices[1] = Some(Box::default());
            state.broken_joints.packs[0] = Some(Box::new(lattices));
        },
        &|state, _| state.contacts.travel.push(Lanes::ZERO),
        &|state, _| state.contacts.travel[0].0[0] = f64::NAN,
        &|state, _| state.contacts.patches[0].blocks = [1, 0],
        &|state, _| state.contacts.patches[0].energy_reserve = f64::NAN,
        &|state, _| state.contacts.patches.clear(),
        &|_, run| run.time_step = f64::NAN,
        &|state, _| state.steps = u64::MAX,
        &|state, _| state.failed[0] = 1000,
        &|_, run| run.relaxation = Some(RelaxationProgress::default()),
    ];
    let mut found: Vec<String> = of_pair.iter().map(|change| changed(joined, change)).collect();
    found.push(changed(without_contact, &|state, _| {
        state.contacts.patches.clone_from(&Simulation::new(joined()).state.contacts.patches);
    }));
    insta::assert_snapshot!(found.join("\n"));
}

#[test]
fn states_of_other_models_and_cut_bytes() {
    let whole = Simulation::new(joined()).save().bytes().to_vec();
    let mut found = vec![
        message(joined(), [&whole[..], &[0]].concat()),
        message(joined(), whole[..whole.len() - 1].to_vec()),
        message(joined(), [&[FORMAT as u8 - 1], &whole[1..]].concat()),
    ];
    let known = counts(&joined()).map(|(_, count)| count as u64);
    for index in 0..known.len() {
        let Image { state, run } = Simulation::new(joined()).save().decode(&joined()).unwrap();
        let mut other = known;
        other[index] += 2;
        found.push(message(joined(), encoded(other, &state, run)));
    }
    insta::assert_snapshot!(found.join("\n"));
}
