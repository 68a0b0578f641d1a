//! Tests of the warnings of a run, from numbers that a run may give, and of its files.

use ddem_core::{Energy, Profile, RunError, Safety, SafetySearch, SafetyTrial, Verdict};
use ddem_deck::{BuildProgress, Deck, Stage, StageKind};

use super::RunFailure;
use super::files::keep;
use super::mesh::{OutputMesh, blocks, joints};
use super::report::build;
use super::safety::warnings;
use super::warnings::energy_imbalance;
use crate::OutputError;
use crate::vtkhdf::{FieldSpec, Writer};

const CUBE: &str = "
    [materials.rock]
    density = 2400
    young = 18e9
    poisson = 0.25
    [[blocks]]
    size = [1, 1, 1]
    material = 'rock'
    ";

fn deck() -> Deck {
    ddem_deck::parse_alone(CUBE, "cube.toml").unwrap().0
}

#[test]
fn energy_loss_warns() {
    let energy = |balance: f64, contact: f64| Energy {
        balance,
        contact,
        largest: 100.0,
        ..Energy::default()
    };
    let stage = Stage { name: "fall".into(), kind: StageKind::Dynamic, ..Stage::default() };
    let warning = |energy: Energy| energy_imbalance(&energy, 0.0, &stage, &deck());
    assert_eq!(warning(energy(0.9, 0.0)), None);
    let found = [energy(2.0, 0.0), energy(-2.0, 3.0), energy(-2.0, 0.0)].map(warning);
    let found: Vec<String> = found.into_iter().flatten().map(|w| w.to_string()).collect();
    insta::assert_snapshot!(found.join("\n"));
}

/// A step that becomes unstable ends a run that has begun: its results are there.
#[test]
fn failure_of_a_stage_has_the_status_of_failed_runs() {
    let error = RunError::UnstableTimeStep { time_step: 2.0, critical: 1.0 };
    assert_eq!(RunFailure::Stage { stage: "later".to_owned(), error }.exit_status(), 1);
    assert_eq!(RunFailure::Stopped.exit_status(), 2);
}

/// Warnings about results of searches in the present state of a simulation.
fn of_searches(simulation: &mut ddem_core::Simulation, found: Vec<Safety>) -> String {
    let mut messages = |found: &Safety| warnings(found, &SafetySearch::default(), simulation);
    let all: Vec<String> = found.iter().flat_map(&mut messages).map(|w| w.to_string()).collect();
    all.join("\n")
}

#[test]
fn doubtful_factors_of_safety_warn() {
    let trial = |factor: f64, verdict: Verdict| SafetyTrial { factor, verdict, steps: 40 };
    let long =
        |trial: SafetyTrial| SafetyTrial { steps: SafetySearch::default().max_steps, ..trial };
    let safety = |bracket: [Option<f64>; 2], trials: Vec<SafetyTrial>| Safety {
        factor: None,
        bracket,
        trials,
        failing: None,
        profile: Profile::default(),
    };
    let (rests, open) = (Verdict::AtRest, Verdict::Undecided);
    let mut simulation = ddem_core::Simulation::new(deck().build().unwrap());
    let found = vec![
        safety(
            [Some(1.0), Some(2.0)],
            vec![trial(1.0, rests), trial(2.0, open), trial(3.0, rests)],
        ),
        safety([None, None], vec![long(trial(0.5, open))]),
        safety([None, Some(0.5)], vec![]),
        safety([Some(4.0), None], vec![]),
    ];
    let undecided = of_searches(&mut simulation, found);
    // Blocks with a joint that never fails, before anything has moved.
    let jointed = CUBE.to_owned()
        + "count = [1, 1, 2]\njoint = 'seam'\n[model]\ngravity = [0, 0, -10]\n[[fix]]\nwhere = { z = 0.0 }\n\
           axes = 'xyz'\n[joints.seam]\nnormal_stiffness = 1e10\nshear_stiffness = 1e10\n";
    let held = jointed.replace("z = 0.0", "z = [0, 1]");
    let holds = [jointed, held].map(|text| {
        let (deck, _) = ddem_deck::parse_alone(&text, "blocks.toml").unwrap();
        let mut simulation = ddem_core::Simulation::new(deck.build().unwrap());
        of_searches(&mut simulation, vec![safety([Some(4.0), None], vec![])])
    });
    insta::assert_snapshot!([undecided, holds.join("\n")].join("\n"));
}

/// Discs of a network whose cells nobody can predict: the cut stops at the memory, and names the cut.
#[test]
fn fracture_networks_stop_at_the_memory() {
    let network = "
        [joints.j]
        normal_stiffness = 1e10
        shear_stiffness = 5e9
        [[region]]
        box = { from = [0, 0, 0], to = [10, 10, 10] }
        material = 'rock'
        [[cut]]
        dfn = { number = 100000, size = 5.0, dip = 45, dip_direction = 0, fisher = 1 }
        joint = 'j'
        ";
    let rock = CUBE.split("[[blocks]]").next().unwrap_or_default();
    let (deck, _) = ddem_deck::parse_alone(&format!("{rock}{network}"), "rock.toml").unwrap();
    let refused = build(&deck, 100_000_000, &BuildProgress::default()).err().unwrap();
    insta::assert_snapshot!(refused.to_string());
}

/// Cube of 10 m with joints each metre in three directions: 1000 cells of 8 parts with one element. The
/// prediction counts cells that planes make on average over all their positions: 1331.
#[test]
fn regions_beyond_the_memory_are_refused_before_they_are_cut() {
    let text = |spacing: f64| {
        let set = |dip: f64, direction: f64| {
            format!(
                "[[cut]]\nset = {{ dip = {dip}, dip_direction = {direction}, spacing = {spacing} }}\njoint = 'j'\n"
            )
        };
        let sets = [set(0.0, 0.0), set(90.0, 0.0), set(90.0, 90.0)].concat();
        let rock = CUBE.split("[[blocks]]").next().unwrap_or_default();
        format!(
            "{rock}[joints.j]\nnormal_stiffness = 1e10\nshear_stiffness = 5e9\n[[region]]\n\
             box = {{ from = [0, 0, 0], to = [10, 10, 10] }}\nmaterial = 'rock'\ndivisions = 2\n{sets}"
        )
    };
    let message = |spacing: f64, available: u64| {
        let (deck, _) = ddem_deck::parse_alone(&text(spacing), "rock.toml").unwrap();
        build(&deck, available, &BuildProgress::default())
            .map_or_else(|failure| failure.to_string(), |_| String::new())
    };
    // 1331 cells with 8 parts of 8 nodes, one element and 6 pairs each: 16000 + 8 ⋅ 340 + 700 + 6 ⋅ 900 B
    // each, 264.3 MB.
    assert_eq!(message(1.0, 264_284_000), "");
    let refused = [(1.0, 264_283_000), (0.05, 16_000_000_000), (0.001, u64::MAX)];
    let messages = refused.map(|(spacing, available)| message(spacing, available));
    insta::assert_snapshot!(messages.join("\n"));
}

/// Two cells side by side, divided at half their height into joined ones, on a block of a set.
#[test]
fn fields_of_regions_name_cells_and_cuts() {
    let rock = "
        size = [2, 1, 1]
        origin = [0, 0, -1]
        joint = 'seam'
        [joints.seam]
        normal_stiffness = 1e10
        shear_stiffness = 5e9
        [[region]]
        box = { from = [0, 0, 0], to = [2, 1, 1] }
        material = 'rock'
        joint = 'seam'
        [[cut]]
        plane = { dip = 0, dip_direction = 0, through = [0, 0, 0.5] }
        join = true
        [[cut]]
        plane = { dip = 90, dip_direction = 90, through = [1, 0, 0] }
        joint = 'seam'
        ";
    let text = format!("{}{rock}", CUBE.replace("size = [1, 1, 1]", ""));
    let (deck, _) = ddem_deck::parse_alone(&text, "rock.toml").unwrap();
    let model = build(&deck, u64::MAX, &BuildProgress::default())
        .unwrap_or_else(|failure| panic!("{failure}"))
        .model;
    let values = |mesh: &OutputMesh, wanted: &str| {
        let field = mesh.constants().into_iter().find(|field| field.name == wanted).unwrap();
        let mut values = field.values.to_vec();
        values.sort_unstable();
        values.dedup();
        values
    };
    assert_eq!(values(&blocks(&model), "block"), [0, 1, 2]);
    assert_eq!(values(&blocks(&model), "cell"), [-1, 0, 1, 2, 3]);
    // No cut made the joint on the set.
    assert_eq!(values(&joints(&model), "cut"), [-1, 1]);
}

/// If one of the files cannot have a frame, the others lose it: their frames stay those of the same steps.
#[test]
fn frame_is_in_all_files_or_in_none() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("contacts.vtkhdf");
    let mut cloud = Writer::create_cloud(&path, &[FieldSpec::point("force", 3)]).unwrap();
    let append =
        |cloud: &mut Writer| cloud.append(0.0, Some(vec![[1.0; 3]; 5]), &|_, _, out| out.fill(2.0));
    let whole = append(&mut cloud);
    keep(vec![(&mut cloud, whole)]).unwrap();
    let before = std::fs::read(&path).unwrap();
    let mut blocks = Writer::create_cloud(folder.path().join("blocks.vtkhdf"), &[]).unwrap();
    for _ in 0..2 {
        let appended = append(&mut cloud);
        let full = OutputError::mismatch(&path, "the disk is full");
        let error = keep(vec![(&mut cloud, appended), (&mut blocks, Err(full))]).unwrap_err();
        assert!(error.to_string().contains("the disk is full"), "{error}");
        assert!(cloud.steps() == 1 && std::fs::read(&path).unwrap() == before);
    }
}
