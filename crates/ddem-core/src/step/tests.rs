//! Comparison of the strips and corners removed with a pair with all elements that hold both nodes,
//! of a sweep with two passes, and of the motion of failed pairs as a step finds it with a look at
//! all pairs.

use std::collections::BTreeSet;
use std::sync::Arc;

use crate::model::Model;
use crate::model::problem::*;
use crate::model::stage::{Damping, TimeStep};
use crate::run::Simulation;
use crate::state::State;
use ddem_joint::broken::BrokenLattice;
use ddem_joint::broken::strips::StripElement;
use ddem_mechanics::element::{Elastic, ElementKind};
use ddem_mechanics::law::MohrCoulomb;
use ddem_mechanics::math::lanes::{LANES, Lanes};
use ddem_mechanics::math::simd::Simd;
use ddem_mesh::assembly::NO_TABLE;
use ddem_mesh::pack::JointLattice;
use ddem_mesh::properties::Kinematics;

/// Pack, lane and local number of a node.
type Node = (usize, usize, usize);

/// Model of blocks of 1 m with joints of 0.02 m between them; the block `removed` is left out.
fn model(count: [usize; 3], divisions: usize, removed: Option<[usize; 3]>) -> Model {
    let rock = Elastic::new(2400.0, 18e9, 0.25);
    let section = JointProperties {
        name: "seam".into(),
        thickness: 0.02,
        elasticity: JointElasticity::Layer(rock),
        law: None,
    };
    let cells = count.iter().product();
    let inner = |at: usize, end: usize| if at == 0 || at == end { 0.0 } else { 0.02 };
    let mut lattice = Lattice {
        set: 0,
        refined: None,
        origin: Vec3::zeros(),
        axes: [0, 1, 2].map(|d| Vec3::ith(d, 1.0)),
        divisions,
        rigid: false,
        count,
        cuts: count.map(|n| (0..=n).map(|at| at as f64).collect()),
        lengths: count.map(|n| vec![1.0; n]),
        gaps: count.map(|n| (0..=n).map(|at| inner(at, n)).collect()),
        block: vec![0; cells].into(),
        material: Arc::new(vec![0; cells]),
        joint: [0; 3].map(|joint| Arc::new(vec![joint; cells])),
        own_joint: [0; 3],
        part: None,
    };
    if let Some(cell) = removed {
        let at = lattice.index(cell);
        lattice.block[at] = NONE;
    }
    let bounds = [Vec3::zeros(), Vec3::from(count.map(|n| n as f64))];
    let geometry = Geometry::new(vec![Arc::new(lattice)], bounds);
    Model::new(Arc::new(Problem {
        properties: Properties {
            gravity: Vec3::zeros(),
            kinematics: Kinematics::Corotational,
            element: ElementKind::Incompatible,
            peaks: false,
            contact: ContactProperties::default(),
            materials: vec![rock],
            joints: vec![section],
        },
        stages: Stages {
            geometries: vec![(0, Arc::new(geometry))],
            assigns: vec![],
            excavated: false,
        },
        conditions: Conditions::default(),
        boundaries: Boundaries::default(),
        stresses: Vec::new(),
        motions: Vec::new(),
        kinds: Vec::new(),
        sets: Sets { bounds, list: Vec::new() },
    }))
}

/// Node of a joint lattice, given by its place there.
fn node(model: &Model, pack: usize, lane: usize, offset: usize, node_pair: usize) -> Node {
    let packs = &model.packs;
    let node = packs.numbering_of(&packs.packs[pack]).joints[offset][node_pair];
    let upper = packs.packs[pack].upper[node.offset].at(lane);
    let (pack, lane) = if node.offset == 0 { (pack, lane) } else { upper.expect("a neighbour") };
    (pack, lane, node.local)
}

/// All strip and corner elements with their eight nodes.
fn cells(model: &Model) -> Vec<(StripElement, Vec<Node>)> {
    let mut cells = Vec::new();
    for pack in 0..model.packs.packs.len() {
        for (offset, lane) in [3, 5, 6, 7].into_iter().flat_map(|o| (0..LANES).map(move |l| (o, l)))
        {
            let table = model.assembly.pack_tables[pack][offset];
            if table == NO_TABLE || model.assembly.tables[table as usize].elements[lane].is_none() {
                continue;
            }
            let [nx, ny, nz] = model.packs.numbering_of(&model.packs.packs[pack]).dims(offset);
            for element in 0..nx * ny * nz {
                let at = [element % nx, element / nx % ny, element / (nx * ny)];
                let corner = |c: usize| {
                    let [x, y, z] = [at[0] + (c & 1), at[1] + (c >> 1 & 1), at[2] + (c >> 2)];
                    node(model, pack, lane, offset, x + (nx + 1) * (y + (ny + 1) * z))
                };
                let lattice = JointLattice { pack, offset };
                let cell = StripElement { lattice, element, lane };
                cells.push((cell, (0..8).map(corner).collect()));
            }
        }
    }
    cells
}

#[test]
fn failed_pair_removes_its_strips_and_corners() {
    let lattices = [
        ([3, 3, 3], 2, None),
        ([4, 2, 3], 1, None),
        ([2, 3, 4], 3, Some([0, 1, 2])),
        ([3, 3, 3], 2, Some([1, 1, 1])),
    ];
    for (count, divisions, removed) in lattices {
        let model = model(count, divisions, removed);
        let (packs, assembly) = (&model.packs, &model.assembly);
        let all = cells(&model);
        let mut removed = 0;
        for (pack, d) in (0..packs.packs.len()).flat_map(|pack| (0..3).map(move |d| (pack, d))) {
            let Some(section) = model.sections.get(pack, d) else { continue };
            let node_pairs = &packs.numbering_of(&packs.packs[pack]).pairs[d];
            for lane in (0..LANES).filter(|&lane| section.joints[lane] != NO_JOINT) {
                for (p, node_pair) in node_pairs.iter().enumerate() {
                    let ends = node_pair.sides.map(|side| node(&model, pack, lane, 1 << d, side));
                    let holds = |(_, nodes): &&(StripElement, Vec<Node>)| {
                        ends.iter().all(|end| nodes.contains(end))
                    };
                    let expected: BTreeSet<StripElement> =
                        all.iter().filter(holds).map(|(cell, _)| *cell).collect();
                    let mut broken_joints = model.broken_joints();
                    let tables = assembly.pack_tables[pack];
                    let mut lattice =
                        BrokenLattice::intact(packs, &packs.packs[pack], tables, 1 << d);
                    lattice.set_failed(node_pairs, p, lane);
                    broken_joints.at(pack)[1 << d] = Some(Box::new(lattice));
                    let found: BTreeSet<StripElement> =
                        broken_joints.strips_around_failures(packs, assembly).into_iter().collect();
                    assert_eq!(
                        found, expected,
                        "pack {pack}, direction {d}, lane {lane}, pair {p}"
                    );
                    removed += found.len();
                }
            }
        }
        assert!(removed > 0, "{count:?}");
    }
}

/// Bits of displacements and velocities, the losses and the largest velocity after some steps, in a
/// sweep over `slabs` slabs or in two passes.
fn moved(
    count: [usize; 3],
    divisions: usize,
    removed: Option<[usize; 3]>,
    slabs: Option<usize>,
) -> (Vec<u64>, String) {
    let mut simulation = Simulation::new(model(count, divisions, removed));
    for (i, v) in simulation.state.v.iter_mut().enumerate() {
        *v = Lanes(std::array::from_fn(|lane| (0.1 * (LANES * i + lane) as f64).sin()));
    }
    simulation.start(Damping::Ratio(0.05), TimeStep::Auto, None).expect("a stable step");
    let packs = &simulation.model.packs;
    let slabs = slabs.map(|count| super::sweep::slabs(packs, count));
    for _ in 0..5 {
        simulation.scratch.slabs = Some((rayon::current_num_threads(), slabs.clone()));
        simulation.step().expect("finite numbers");
    }
    let State { u, v, .. } = &*simulation.state;
    assert!(u.iter().any(|u| u.sum() != 0.0), "nothing moves");
    let bits = u.iter().chain(v).flat_map(|lanes| lanes.0).map(f64::to_bits).collect();
    (bits, format!("{:?}", simulation.last))
}

#[test]
fn sweep_gives_bits_of_two_passes() {
    let lattices = [
        ([4, 3, 5], 2, None),
        ([8, 8, 8], 1, None),
        ([5, 3, 4], 4, Some([2, 1, 2])),
        ([3, 3, 6], 3, None),
    ];
    for (count, divisions, removed) in lattices {
        let expected = moved(count, divisions, removed, None);
        for slabs in [1, 2, 3, 7] {
            let found = moved(count, divisions, removed, Some(slabs));
            assert_eq!(found.1, expected.1, "{count:?}, {slabs} slabs");
            assert!(found.0 == expected.0, "{count:?}, {slabs} slabs: other bits");
        }
    }
}

/// Model whose joints break under little load and then slide.
fn weak() -> Model {
    let mut model = model([4, 3, 2], 2, None);
    let law = MohrCoulomb { tan_residual_friction: 0.3, ..MohrCoulomb::default() };
    model.set_law("seam", Arc::new(law)).expect("a sound law");
    model
}

/// A restored state looks at all pairs.
#[test]
fn steps_know_how_far_failed_pairs_have_moved() {
    let mut simulation = Simulation::new(weak());
    for (i, v) in simulation.state.v.iter_mut().enumerate() {
        *v = Lanes(std::array::from_fn(|lane| (0.1 * (LANES * i + lane) as f64).sin()));
    }
    simulation.start(Damping::Ratio(0.05), TimeStep::Auto, None).expect("a stable step");
    for _ in 0..20 {
        simulation.step().expect("finite numbers");
        let restored = Simulation::restore(weak(), Simd::default(), &simulation.save()).unwrap();
        let mut known = simulation.state.broken_joints.clone();
        // A restored state also checks all pairs for failure.
        known.recheck();
        assert!(restored.state.broken_joints == known);
    }
    assert!(simulation.failed_pairs().iter().sum::<u64>() > 100);
}
