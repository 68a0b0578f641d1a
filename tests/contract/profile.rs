//! A profiled run: the same results, and the times of the phases in the summary.

use ddem_io::summary::{StageSummary, Summary};

use super::contacts::rubble;
use super::decks::mixed;
use super::resume::everything;
use super::shared::{How, run_into};

/// All results of a run as bits, and the stages of its summary.
fn results(text: &str, how: How) -> (Vec<(String, Vec<u64>)>, Vec<StageSummary>) {
    let folder = tempfile::tempdir().expect("a folder");
    assert!(run_into(text, folder.path(), how));
    let summary = Summary::read(folder.path().join("summary.json")).expect("a summary");
    (everything(folder.path()), summary.stages)
}

#[test]
fn profile_changes_no_bit() {
    for (what, text) in [("mixed", mixed()), ("rubble", rubble())] {
        let (expected, plain) = results(&text, How::default());
        for threads in [1, 2] {
            let how = How { threads, profile: true, ..How::default() };
            let (found, profiled) = results(&text, how);
            for ((field, expected), (_, found)) in expected.iter().zip(&found) {
                assert!(expected == found, "{what}: {field} differs on {threads} threads");
            }
            let steps = |stages: &[StageSummary]| -> Vec<u64> {
                stages.iter().map(|stage| stage.steps).collect()
            };
            assert_eq!(steps(&plain), steps(&profiled));
            assert!(profiled.iter().all(|stage| stage.profile.is_some()));
        }
        assert!(plain.iter().all(|stage| stage.profile.is_none()));
    }
}

#[test]
fn each_phase_of_a_run_takes_time() {
    let (_, stages) = results(&mixed(), How { profile: true, ..How::default() });
    let profiles = stages.iter().filter_map(|stage| Some((stage, stage.profile?)));
    for (StageSummary { kind, wall_seconds, .. }, profile) in profiles {
        let steps = profile.steps;
        for time in [steps.blocks, steps.joints, steps.nodes, steps.start_up, profile.output] {
            assert!(time > 0.0, "{profile:?}");
        }
        assert_eq!(steps.relaxation > 0.0, kind == "relax", "{profile:?}");
        // The profile has output and start-up besides the time of the steps.
        assert!(profile.other >= 0.0 && profile.total() >= *wall_seconds, "{profile:?}");
    }
    let (_, stages) = results(&rubble(), How { profile: true, ..How::default() });
    assert!(stages.iter().all(|stage| stage.profile.is_some_and(|p| p.steps.contacts > 0.0)));
}
