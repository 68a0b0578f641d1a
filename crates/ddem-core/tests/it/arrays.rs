//! Problems from arrays: same results as from decks, and errors in meshes.

use std::sync::Arc;

use ddem_core::element::Elastic;
use ddem_core::law::{MohrCoulomb, SpringStiffness};
use ddem_core::problem::{
    BuildError, HexMesh, JointElasticity, JointProperties, MeshError, ProblemBuilder, StageRange,
};
use ddem_core::{Damping, Model, Simulation, TimeStep};
use ddem_deck::{BlockMesh, BlockSet, Deck, Fix, Joint, JointChoice, MeshJoint, Where};

use crate::decks::*;

/// Row of blocks along x, each a grid of hexahedra; nodes and hexahedra are numbered out of order.
pub(crate) fn row(blocks: usize, divisions: usize, axes: [[f64; 3]; 3]) -> HexMesh {
    let n = divisions + 1;
    let mut mesh = HexMesh::default();
    for block in 0..blocks {
        let first = mesh.nodes.len() as u32;
        let at = |i: usize, j: usize, k: usize| {
            let along = [
                block as f64 + i as f64 / divisions as f64,
                j as f64 / divisions as f64,
                k as f64 / divisions as f64,
            ];
            [0, 1, 2].map(|c| (0..3).map(|d| along[d] * axes[d][c]).sum::<f64>())
        };
        // Node numbers run backwards, z fastest.
        let number =
            |i: usize, j: usize, k: usize| first + (n * n * n - 1 - (k + n * (j + n * i))) as u32;
        let mut nodes = vec![[0.0; 3]; n * n * n];
        for (i, j, k) in grid(n) {
            nodes[(number(i, j, k) - first) as usize] = at(i, j, k);
        }
        mesh.nodes.extend(nodes);
        for (i, j, k) in grid(divisions) {
            let corner = |(a, b, c): (usize, usize, usize)| number(i + a, j + b, k + c);
            let order = [
                (0, 0, 0),
                (1, 0, 0),
                (1, 1, 0),
                (0, 1, 0),
                (0, 0, 1),
                (1, 0, 1),
                (1, 1, 1),
                (0, 1, 1),
            ];
            mesh.hexes.push(order.map(corner));
            mesh.blocks.push(block as u32);
        }
    }
    mesh
}

fn grid(n: usize) -> impl Iterator<Item = (usize, usize, usize)> {
    (0..n).flat_map(move |k| (0..n).flat_map(move |j| (0..n).map(move |i| (i, j, k))))
}

pub(crate) const UPRIGHT: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
const OBLIQUE: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.2, 1.0, 0.0], [0.1, 0.3, 0.9]];

pub(crate) fn rock() -> Elastic {
    Elastic::new(2400.0, 18e9, 0.25)
}

pub(crate) fn section(cohesion: f64) -> JointProperties {
    let law = MohrCoulomb { cohesion, tension: cohesion, ..MohrCoulomb::default() };
    JointProperties {
        name: "seam".into(),
        thickness: 0.0,
        elasticity: JointElasticity::Springs(SpringStiffness { normal: 1e11, shear: 4e10 }),
        law: Some(Arc::new(law)),
    }
}

/// Nodes of a mesh that satisfy a condition.
pub(crate) fn at(mesh: &HexMesh, found: impl Fn(&[f64; 3]) -> bool) -> Vec<u32> {
    (0..mesh.nodes.len() as u32).filter(|&node| found(&mesh.nodes[node as usize])).collect()
}

/// Hexahedron faces of two neighbouring blocks at their common plane x.
pub(crate) fn faces(mesh: &HexMesh, x: f64, block: u32) -> [[u32; 4]; 2] {
    [block, block + 1].map(|block| {
        let hexes = mesh.hexes.iter().zip(&mesh.blocks).filter(|(_, of)| **of == block);
        let on = |node: &u32| (mesh.nodes[*node as usize][0] - x).abs() < 1e-9;
        let mut four =
            hexes.map(|(hex, _)| hex.iter().copied().filter(|node| on(node)).collect::<Vec<_>>());
        let four = four.find(|four| four.len() == 4).unwrap_or_default();
        four.try_into().unwrap_or_default()
    })
}

/// Two jointed blocks, pulled at one end, move as the same two sets of a deck.
#[test]
fn mesh_blocks_move_like_deck_blocks() {
    let mesh = row(2, 2, UPRIGHT);
    let mut builder = ProblemBuilder::new(&mesh, rock()).unwrap();
    let joint = builder.joint(section(1e9));
    builder.join(faces(&mesh, 1.0, 0), joint).unwrap();
    let held = at(&mesh, |x| x[0] == 0.0);
    builder.fix(&held, [true; 3]).unwrap();
    let pulled = at(&mesh, |x| x[0] == 2.0);
    let forces: Vec<_> = pulled.iter().map(|&node| (node, [1e6, 0.0, 3e5])).collect();
    builder.load(&forces).unwrap();
    let (problem, numbers) = builder.build().unwrap();
    let mut simulation = Simulation::new(Model::new(Arc::new(problem)));

    let mut deck = deck([1; 3], [1.0; 3], 2, 0.0);
    let material = deck.blocks[0].material.clone();
    deck.materials
        .insert(material, ddem_deck::Material { density: 2400.0, young: 18e9, poisson: 0.25 });
    deck.joints.clear();
    let springs = Joint {
        normal_stiffness: Some(1e11),
        shear_stiffness: Some(4e10),
        cohesion: Some(1e9),
        tension: Some(1e9),
        ..Joint::default()
    };
    deck.joints.insert("seam".into(), springs);
    deck.blocks[0].joint = Some(JointChoice::All("seam".into()));
    deck.blocks[0].origin = [0.0; 3];
    let mut second = deck.blocks[0].clone();
    second.origin = [1.0, 0.0, 0.0];
    deck.blocks.push(second);
    deck.fix = vec![Fix { r#where: plane(0, 0.0), axes: "xyz".into(), ..Fix::default() }];
    let mut other = Simulation::new(deck.build().unwrap());
    let nodes = plane(0, 2.0).nodes(other.model()).unwrap();
    other.apply_force(&nodes, &vec![[1e6, 0.0, 3e5]; nodes.len()]);

    for both in [&mut simulation, &mut other] {
        both.start(Damping::Ratio(0.05), TimeStep::Seconds(5e-5), None).unwrap();
        (0..200).for_each(|_| both.step().unwrap());
    }
    let mut most = 0.0_f64;
    for (node, x) in mesh.nodes.iter().enumerate() {
        let own = numbers[node].unwrap() as usize;
        assert_eq!(simulation.model().point(own), *x);
        let same = (0..other.model().n_nodes()).find(|&same| {
            other.model().point(same) == *x
                && other.model().block_of(same) == simulation.model().block_of(own)
        });
        let (u, v) = (simulation.displacement(own), other.displacement(same.unwrap()));
        (0..3).for_each(|c| assert!((u[c] - v[c]).abs() < 1e-12, "{x:?}: {u:?} {v:?}"));
        most = most.max(u[0].abs());
    }
    assert!(most > 1e-4, "{most}");
}

/// Blocks of any shape in a row rest under gravity; the reaction is their weight.
#[test]
fn supports_carry_weight_of_mesh_blocks() {
    for axes in [UPRIGHT, OBLIQUE] {
        for rigid in [false, true] {
            let mesh = row(7, 2, axes);
            let mut builder = ProblemBuilder::new(&mesh, rock()).unwrap();
            builder.properties.gravity.z = -9.81;
            if rigid {
                (0..7).for_each(|block| assert!(builder.set_rigid(block).is_ok()));
            }
            let held = at(&mesh, |x| x[2] == 0.0);
            let corners: Vec<u32> =
                held.into_iter().filter(|node| !rigid || is_corner(&mesh, *node, axes)).collect();
            builder.fix(&corners, [true; 3]).unwrap();
            let (problem, numbers) = builder.build().unwrap();
            let mut simulation = Simulation::new(Model::new(Arc::new(problem)));
            simulation.relax(1e-8, 20_000).unwrap();
            let nodes: Vec<u32> =
                corners.iter().map(|node| numbers[*node as usize].unwrap()).collect();
            let volume = 7.0 * if axes == UPRIGHT { 1.0 } else { 0.9 };
            let weight = simulation.reaction(&nodes)[2];
            let exact = 2400.0 * 9.81 * volume;
            assert!((weight / exact - 1.0).abs() < 1e-6, "{weight} for {exact}");
        }
    }
}

fn is_corner(mesh: &HexMesh, node: u32, axes: [[f64; 3]; 3]) -> bool {
    let [x, y, _] = mesh.nodes[node as usize];
    let along = y / axes[1][1];
    let along = [x - along * axes[1][0], along];
    along.iter().all(|x| (x - x.round()).abs() < 1e-9)
}

/// A mesh set, joined by the joint of the set or by pairs of faces, gives the same results as sets
/// of one block each.
#[test]
fn mesh_sets_equal_sets_of_single_blocks() {
    let mesh = row(3, 2, UPRIGHT);
    let springs =
        Joint { normal_stiffness: Some(1e11), shear_stiffness: Some(4e10), ..Joint::default() };
    let mut single = deck([1, 1, 1], [1.0, 1.0, 1.0], 2, 0.0);
    single.joints.insert("seam".into(), springs);
    single.model.gravity = [3.0, 0.0, -9.81];
    single.fix = vec![Fix { r#where: plane(0, 0.0), axes: "xyz".into(), ..Fix::default() }];
    let mut of_mesh = single.clone();
    for x in [1.0, 2.0] {
        let origin = [x, 0.0, 0.0];
        single.blocks.push(BlockSet { origin, ..single.blocks[0].clone() });
    }
    let set = &mut of_mesh.blocks[0];
    (set.size, set.count, set.divisions) = (None, None, BlockSet::default().divisions);
    let HexMesh { nodes, hexes, blocks } = mesh.clone();
    set.mesh = Some(BlockMesh { nodes, hexes, blocks, joints: Vec::new() });
    let mut in_pairs = of_mesh.clone();
    let set = &mut in_pairs.blocks[0];
    set.joint = None;
    let pair = |block: u32| MeshJoint {
        faces: faces(&mesh, f64::from(block) + 1.0, block),
        joint: "seam".into(),
    };
    set.mesh.as_mut().unwrap().joints = vec![pair(0), pair(1)];
    let rest = |deck: &Deck| {
        let mut simulation = Simulation::new(model(deck));
        assert_eq!(simulation.model().n_joints(), 2);
        simulation.relax(1e-10, 20_000).unwrap();
        let end = plane(0, 3.0).nodes(simulation.model()).unwrap();
        let u: Vec<[f64; 3]> =
            end.iter().map(|&node| simulation.displacement(node as usize)).collect();
        let points: Vec<[f64; 3]> =
            end.iter().map(|&node| simulation.model().point(node as usize)).collect();
        (points, u)
    };
    let (places, expected) = rest(&single);
    for deck in [&of_mesh, &in_pairs] {
        let (points, found) = rest(deck);
        assert_eq!(points, places);
        for (u, v) in expected.iter().flatten().zip(found.iter().flatten()) {
            assert!((u - v).abs() < 1e-12 + 1e-6 * v.abs(), "{u} {v}");
        }
    }
    assert!(warnings(&of_mesh).is_empty(), "{:?}", warnings(&of_mesh));

    let refused = |change: &dyn Fn(&mut BlockSet)| {
        let mut deck = in_pairs.clone();
        change(&mut deck.blocks[0]);
        let error = deck.build().map(|_| ()).unwrap_err();
        error.faults[0].to_string()
    };
    let both = refused(&|set| set.size = Some([1.0; 3]));
    assert!(both.starts_with("blocks[0].size: `size` cannot be combined with `mesh`"), "{both}");
    let far = refused(&|set| {
        let [_, other] = faces(&mesh, 2.0, 1);
        set.mesh.as_mut().unwrap().joints[0].faces[1] = other;
    });
    assert!(far.starts_with("blocks[0].mesh.joints[0].faces: the two faces do not face"), "{far}");
    let none = refused(&|set| set.mesh.as_mut().unwrap().joints[1].faces[0] = [0, 1, 2, 40]);
    assert!(none.starts_with("blocks[0].mesh.joints[1].faces: four of the nodes"), "{none}");
    let bent = refused(&|set| set.mesh.as_mut().unwrap().nodes[5][2] += 0.1);
    assert!(bent.starts_with("blocks[0].mesh: block 0 (number of hexahedra: 8)"), "{bent}");
    let name = refused(&|set| set.mesh.as_mut().unwrap().joints[1].joint = "sem".into());
    assert!(name.contains("did you mean `seam`?"), "{name}");
}

#[test]
fn mesh_errors_are_named() {
    let mut mesh = row(2, 1, UPRIGHT);
    let fault = |mesh: &HexMesh| ProblemBuilder::new(mesh, rock()).err();
    mesh.blocks.pop();
    assert_eq!(fault(&mesh), Some(MeshError::Blocks { blocks: 1, hexes: 2 }.into()));
    mesh.blocks.push(5);
    assert_eq!(fault(&mesh), Some(MeshError::NoBlock { block: 1 }.into()));
    mesh.blocks[1] = u32::MAX;
    assert_eq!(fault(&mesh), Some(MeshError::NoBlock { block: 1 }.into()));
    mesh.blocks[1] = 1;
    mesh.hexes[1][3] = 99;
    assert_eq!(fault(&mesh), Some(MeshError::NoNode { hex: 1, node: 99, nodes: 16 }.into()));
    mesh.hexes[1][3] = mesh.hexes[0][3];
    assert!(matches!(
        fault(&mesh),
        Some(BuildError::Mesh(MeshError::Shared { first: 0, second: 1, .. }))
    ));
    assert_eq!(fault(&HexMesh::default()), Some(MeshError::Empty.into()));
    let mut bent = row(1, 2, UPRIGHT);
    bent.nodes[3][1] += 0.01;
    let message = fault(&bent).unwrap().to_string();
    assert!(
        message.contains("block 0 (number of hexahedra: 8)") && message.contains("node 3"),
        "{message}"
    );
    let mut flat = row(1, 1, UPRIGHT);
    flat.nodes.iter_mut().for_each(|x| x[2] = 0.0);
    assert!(fault(&flat).unwrap().to_string().contains("no volume"));
    flat.nodes[0][0] = f64::NAN;
    assert!(matches!(fault(&flat), Some(BuildError::Mesh(MeshError::NotFinite { node: 0, .. }))));
}

#[test]
fn unjoinable_faces_are_named() {
    let mesh = row(3, 2, UPRIGHT);
    let mut builder = ProblemBuilder::new(&mesh, rock()).unwrap();
    let joint = builder.joint(section(1e6));
    let built = |quads: [[u32; 4]; 2]| {
        let mut builder = builder.clone();
        builder.join(quads, joint).unwrap();
        builder.build().map(|_| ()).unwrap_err()
    };
    let [near, _] = faces(&mesh, 1.0, 0);
    let [_, far] = faces(&mesh, 2.0, 1);
    let apart = built([near, far]).to_string();
    assert!(apart.contains("blocks [0, 2]") && apart.contains("1 m apart"), "{apart}");
    let inside = [mesh.hexes[0][0], mesh.hexes[0][1], mesh.hexes[0][6], mesh.hexes[0][7]];
    assert_eq!(built([inside, far]), BuildError::NoFace { quad: inside });
    let one = built([near, near]).to_string();
    assert!(one.contains("both faces are of one block"), "{one}");
    let missing = builder.clone().join([near, far], 3).map(|_| ()).unwrap_err();
    assert_eq!(missing, BuildError::Missing { what: "joint", number: 3, count: 1 });
    let missing = builder.clone().fix(&[0, 999], [true; 3]).map(|_| ()).unwrap_err();
    assert_eq!(missing, BuildError::Missing { what: "node", number: 999, count: 81 });
    let mut hard = builder.clone();
    hard.set_rigid(0).unwrap();
    let middle = at(&mesh, |x| *x == [0.5; 3]);
    hard.fix(&middle, [true; 3]).unwrap().in_force = StageRange::ALWAYS;
    let error = hard.build().map(|_| ()).unwrap_err();
    assert_eq!(error, BuildError::InRigid { node: middle[0], block: 0 });
    // Deck selections also work on meshes.
    let (problem, _) = builder.build().unwrap();
    let model = Model::new(Arc::new(problem));
    let end = Where { x: Some(ddem_deck::Extent::Plane(3.0)), ..Where::default() };
    assert_eq!(end.nodes(&model).unwrap().len(), 9);
}

#[test]
fn too_many_materials_and_joints_are_refused() {
    let mut builder = ProblemBuilder::new(&row(1, 1, UPRIGHT), rock()).unwrap();
    let last = (1..65_535).map(|_| builder.material(rock())).last();
    assert_eq!(last, Some(65_534));
    assert!(builder.clone().build().is_ok());
    builder.material(rock());
    let error = builder.build().map(|_| ()).unwrap_err();
    assert_eq!(error, BuildError::TooMany { what: "materials", count: 65_536 });
}

#[test]
fn laws_of_whole_rock_are_refused() {
    let mut builder = ProblemBuilder::new(&row(1, 1, UPRIGHT), rock()).unwrap();
    let elasticity = JointElasticity::WholeRock(rock());
    builder.joint(JointProperties { elasticity, ..section(1e6) });
    let error = builder.build().map(|_| ()).unwrap_err();
    insta::assert_snapshot!("laws_of_whole_rock_are_refused", error);
}
