//! Snapshots of the messages for programs that build models from arrays or give wrong arguments.

use std::sync::Arc;

use ddem_core::law::MohrCoulomb;
use ddem_core::problem::{HexMesh, JointProperties, ProblemBuilder};
use ddem_core::{FIELDS, Simulation};

use crate::arrays::{UPRIGHT, at, faces, rock, row, section};
use crate::decks::*;
use crate::embedded::{panic_message, pile};

/// Message about a row of blocks after a change of its mesh.
fn of_mesh(blocks: usize, divisions: usize, change: impl FnOnce(&mut HexMesh)) -> String {
    let mut mesh = row(blocks, divisions, UPRIGHT);
    change(&mut mesh);
    ProblemBuilder::new(&mesh, rock()).map(|_| ()).expect_err("refused").to_string()
}

#[test]
fn meshes() {
    let found = [
        of_mesh(1, 1, |mesh| *mesh = HexMesh::default()),
        of_mesh(2, 1, |mesh| mesh.blocks.truncate(1)),
        of_mesh(2, 1, |mesh| mesh.blocks[1] = 5),
        of_mesh(2, 1, |mesh| mesh.hexes[1][3] = 99),
        of_mesh(2, 1, |mesh| mesh.hexes[1][3] = mesh.hexes[0][3]),
        of_mesh(1, 1, |mesh| mesh.nodes[0][0] = f64::NAN),
        of_mesh(1, 1, |mesh| mesh.nodes.iter_mut().for_each(|x| x[2] = 0.0)),
        of_mesh(1, 2, |mesh| mesh.nodes[3][1] += 0.01),
        of_mesh(1, 2, |mesh| mesh.hexes[7] = mesh.hexes[0]),
        of_mesh(1, 3, |mesh| mesh.hexes[13] = mesh.hexes[0]),
        of_mesh(1, 2, |mesh| {
            mesh.hexes.pop();
            mesh.blocks.pop();
        }),
    ];
    insta::assert_snapshot!(found.join("\n"));
}

#[test]
fn problems() {
    let mut mesh = row(3, 2, UPRIGHT);
    mesh.nodes.push([9.0; 3]);
    let loose = mesh.nodes.len() as u32 - 1;
    let of = |change: &dyn Fn(&mut ProblemBuilder)| {
        let mut builder = ProblemBuilder::new(&mesh, rock()).unwrap();
        builder.joint(section(1e6));
        change(&mut builder);
        builder.build().map(|_| ()).expect_err("refused").to_string()
    };
    let [near, beside] = faces(&mesh, 1.0, 0);
    let [_, far] = faces(&mesh, 2.0, 1);
    let [.., p, q, r, t] = mesh.hexes[12];
    let joining = |faces: [[u32; 4]; 2]| {
        of(&|builder| {
            builder.join(faces, 0).unwrap();
        })
    };
    let mut builder = ProblemBuilder::new(&mesh, rock()).unwrap();
    let missing = |done: Result<&mut ProblemBuilder, _>| done.map(|_| ()).unwrap_err();
    let wrong = |change: &dyn Fn(&mut JointProperties)| {
        of(&|builder| change(&mut builder.properties.joints[0]))
    };
    let inside = [mesh.hexes[0][0], mesh.hexes[0][1], mesh.hexes[0][6], mesh.hexes[0][7]];
    let found = [
        missing(builder.set_material(0, 4)).to_string(),
        missing(builder.set_rigid(7)).to_string(),
        missing(builder.join([near, far], 3)).to_string(),
        builder.fix(&[0, 999], [true; 3]).map(|_| ()).unwrap_err().to_string(),
        of(&|builder| {
            builder.fix(&[loose], [true; 3]).unwrap();
        }),
        of(&|builder| {
            builder.set_rigid(0).unwrap();
            builder.fix(&at(&mesh, |x| *x == [0.5; 3]), [true; 3]).unwrap();
        }),
        joining([inside, far]),
        joining([near, near]),
        joining([near, far]),
        joining([near, [p, q, r, t]]),
        of(&|builder| {
            let other = builder.joint(JointProperties { name: "bed".into(), ..section(1e6) });
            builder.join([near, beside], 0).unwrap().join([near, beside], other).unwrap();
        }),
        apart(),
        wrong(&|joint| {
            let law = MohrCoulomb { tension: f64::INFINITY, ..MohrCoulomb::default() };
            joint.law = Some(Arc::new(law));
        }),
        of(&|builder| builder.properties.materials = vec![rock(); 65_536]),
    ];
    insta::assert_snapshot!(found.join("\n"));
}

/// Message about a joint between faces in one plane that are 5 m apart.
fn apart() -> String {
    let mut mesh = row(2, 1, UPRIGHT);
    let [near, beside] = faces(&mesh, 1.0, 0);
    for node in &mesh.hexes[1] {
        mesh.nodes[*node as usize][1] += 5.0;
    }
    let mut builder = ProblemBuilder::new(&mesh, rock()).unwrap();
    let joint = builder.joint(section(1e6));
    builder.join([near, beside], joint).unwrap();
    builder.build().map(|_| ()).expect_err("refused").to_string()
}

/// A block without joints.
fn bare() -> ddem_core::Model {
    let mut deck = deck([1; 3], [1.0; 3], 1, 0.0);
    deck.joints.clear();
    deck.blocks[0].joint = None;
    model(&deck)
}

#[test]
fn laws_and_histories_of_programs() {
    let mut model = model(&pile());
    let half: Arc<ddem_core::Function> = Arc::new(|_| Ok(0.5));
    let mut found: Vec<String> = [
        bare().set_law("seam", Arc::new(MohrCoulomb::default())),
        model.set_law("sem", Arc::new(MohrCoulomb::default())),
        model.set_load_history(3, half.clone()),
        model.set_charge_history(0, half.clone()),
        model.set_fix_history(1, half.clone()),
        model.set_fix_history(0, half.clone()),
        model.set_boundary_history(0, half),
    ]
    .map(|fault| fault.expect_err("refused").to_string())
    .into();
    let mut deck = pile();
    deck.load = vec![ddem_deck::Load {
        r#where: plane(2, 2.0),
        pressure: Some(1e5),
        ..ddem_deck::Load::default()
    }];
    for function in [Ok(f64::NAN), Err("the table ends at 2 s".to_owned())] {
        let mut model = crate::decks::model(&deck);
        model.set_load_history(0, Arc::new(move |_| function.clone())).unwrap();
        found.push(Simulation::new(model).step().expect_err("no value").to_string());
    }
    deck.model.contact = Some(false);
    let fault = crate::decks::model(&deck).without_strength("stage[0].kind");
    found.push(fault.expect("nothing fails").to_string());
    insta::assert_snapshot!(found.join("\n"));
}

/// Supports at two corners leave a rotation about the line through them; three pairs of sliding edges
/// leave a screw about it.
#[test]
fn oblique_free_motions() {
    let at = |[x, y, z]: [Option<f64>; 3]| {
        let [x, y, z] = [x, y, z].map(|at| at.map(ddem_deck::Extent::Plane));
        ddem_deck::Where { x, y, z, ..ddem_deck::Where::default() }
    };
    let mut deck = deck([1; 3], [1.0; 3], 2, 0.0);
    deck.joints.clear();
    deck.blocks[0].joint = None;
    deck.stage = vec![relax_stage("static")];
    let message = |deck: &ddem_deck::Deck| deck.build().map(|_| ()).expect_err("free").to_string();
    deck.fix = [0.0, 1.0].map(|x| fix(at([Some(x); 3]), "xyz")).into();
    let turns = message(&deck);
    let edges = [(Some(1.0), Some(0.5)), (Some(0.5), Some(0.0))];
    let sliding = edges.map(|(a, b)| {
        [fix(at([None, a, b]), "x"), fix(at([b, None, a]), "y"), fix(at([a, b, None]), "z")]
    });
    deck.fix = sliding.concat();
    insta::assert_snapshot!([turns, message(&deck)].join("\n"));
}

/// Numbers that do not exist are faults of the program, which panics.
#[test]
fn panics() {
    let model = model(&pile());
    let mut found = vec![
        panic_message(|| model.point(9999)),
        panic_message(|| model.volume(2)),
        panic_message(|| model.nearest_node([f64::NAN; 3])),
        panic_message(|| model.element_at([0.0, f64::INFINITY, 0.0])),
    ];
    let mut simulation = Simulation::new(model);
    found.extend([
        panic_message(|| simulation.stress(0, [0, 2, 0])),
        panic_message(|| simulation.enter(99)),
        panic_message(|| simulation.apply_force(&[0, 1, 2], &[[0.0; 3]])),
        panic_message(|| simulation.set_velocities(&[[0.0; 3]; 55])),
    ]);
    let field = FIELDS.iter().find(|field| field.name == "displacement").unwrap();
    let snapshot = simulation.snapshot();
    found.extend([
        panic_message(|| snapshot.fill(field, 50..60, &mut [0.0; 30])),
        panic_message(|| snapshot.fill(field, 0..2, &mut [0.0; 5])),
    ]);
    insta::assert_snapshot!(found.join("\n"));
}
