//! Lines about the progress of a run.

use super::*;

fn relaxing(unbalanced: f64) -> Progress {
    Progress {
        stage: "load".into(),
        stage_index: (0, 2),
        relax: true,
        step: 1200,
        steps: 200_000,
        time: 1.234e-3,
        unbalanced,
        tolerance: 1e-6,
        failed_pairs: 0,
        contacts: 0,
        fastest: None,
        updates_per_second: 48.23e6,
        seconds_left: Some(80.0),
        search: None,
    }
}

#[test]
fn progress_line_shows_step_rate_and_time_left() {
    let mut progress = relaxing(3.2e-4);
    insta::assert_snapshot!(
        figures(&progress).join("  "),
        @"1200  unbalanced 3.2e-4 → 1e-6  48.2 million node updates/s  1 min 20 s left"
    );
    progress = Progress {
        failed_pairs: 7,
        contacts: 12,
        fastest: Some(FastestBlock { block: 7, set: "slope".into(), speed: 0.25 }),
        relax: false,
        seconds_left: None,
        ..progress
    };
    insta::assert_snapshot!(
        figures(&progress).join("  "),
        @"1200/200000  t 1.2340e-3 s  unbalanced 3.2e-4  7 failed  12 contacts  block 7 at 2.5e-1 m/s  48.2 million node updates/s"
    );
}

#[test]
fn first_line_shows_model_size() {
    let line = |breakable_pairs| {
        model(&Report { blocks: 3, nodes: 81, pairs: 18, breakable_pairs, ..Report::default() })
    };
    insta::assert_snapshot!(line(0), @"model: 3 blocks, 81 nodes, 18 pairs");
    insta::assert_snapshot!(line(9), @"model: 3 blocks, 81 nodes, 18 pairs, of which 9 can fail");
    insta::assert_snapshot!(line(18), @"model: 3 blocks, 81 nodes, 18 pairs, which can all fail");
}

#[test]
fn each_stage_prints_first_and_last_line() {
    let progress = Progress { step: 0, ..relaxing(1.0) };
    insta::assert_snapshot!(
        beginning(&progress),
        @"load (1/2): relaxation to an unbalanced ratio of 1e-6"
    );
    let progress = Progress { relax: false, stage_index: (0, 1), ..relaxing(1.0) };
    insta::assert_snapshot!(beginning(&progress), @"load: 200000 steps, from step 1200 on");
    let stage = StageSummary {
        name: "load".into(),
        verdict: Verdict::AtRest,
        steps: 1234,
        wall_seconds: 12.3,
        unbalanced: 9.81e-7,
        node_updates_per_second: 48.23e6,
        ..StageSummary::default()
    };
    insta::assert_snapshot!(
        end(&stage, 0), @"load: at rest after 1234 steps and 12 s, unbalanced 9.8e-7, 48.2 million node updates/s"
    );
    let stage = StageSummary { imbalance: 3.4e-5, ..stage };
    insta::assert_snapshot!(
        end(&stage, 7),
        @"load: at rest after 1234 steps and 12 s, unbalanced 9.8e-7, energy off by 3e-5, 7 pairs failed, 48.2 million node updates/s"
    );
}

#[test]
fn relaxation_bar_follows_log_of_unbalanced_ratio() {
    let part = |unbalanced| relaxing(unbalanced).part(1.0);
    assert_eq!(part(1.0), 0.0);
    assert!((part(1e-3) - 0.5).abs() < 1e-12);
    assert_eq!(part(1e-6), 1.0);
    assert_eq!(part(0.0), 1.0);
    assert_eq!((part(2.0), part(f64::NAN), part(f64::INFINITY)), (0.0, 0.0, 0.0));
    assert_eq!(relaxing(1e-8).part(1e-7), 0.0);
}

#[test]
fn dynamic_bar_follows_steps() {
    let part = |step, steps| Progress { relax: false, step, steps, ..relaxing(1.0) }.part(1.0);
    assert_eq!((part(1, 4), part(4, 4), part(0, 0)), (0.25, 1.0, 0.0));
}

#[test]
fn rates_and_times_are_short() {
    let rates = [48.2e6, 999.96e3, 1.25e3, 2e9, 0.0, f64::NAN].map(rate);
    let shown = rates.iter().map(Option::as_deref).collect::<Vec<_>>();
    assert_eq!(
        shown,
        [
            Some("48.2 million node updates/s"),
            Some("1.0 million node updates/s"),
            Some("1.2 thousand node updates/s"),
            Some("2.0 billion node updates/s"),
            None,
            None
        ]
    );
    let times = [0.26, 59.6, 3725.0, 90_000.0, -1.0, f64::INFINITY].map(clock);
    let shown = times.iter().map(Option::as_deref).collect::<Vec<_>>();
    assert_eq!(
        shown,
        [Some("0.3 s"), Some("1 min 0 s"), Some("1 h 2 min"), Some("1 d 1 h"), None, None]
    );
}

#[test]
fn search_shows_the_trials_that_run() {
    let trial =
        |trial, factor| TrialProgress { trial, factor, step: 1234, unbalanced: Some(3.2e-4) };
    let running = vec![trial(3, 1.4422), TrialProgress { unbalanced: None, ..trial(4, 2.0801) }];
    let search = SearchProgress { done: 2, most: 16, running };
    let progress = Progress { search: Some(search.clone()), ..relaxing(3.2e-4) };
    insta::assert_snapshot!(
        beginning(&progress),
        @"load (1/2): search for the factor of safety, at most 16 trials, of which 2 are done"
    );
    insta::assert_snapshot!(trials(&search, 1e-5).join("\n"), @r"
    trial 3 of at most 16, strengths / 1.4422: step 1234, unbalanced 3.2e-4 → 1e-5
    trial 4 of at most 16, strengths / 2.0801: step 1234, unbalanced – → 1e-5
    ");
    assert_eq!(progress.part(1.0), 0.125);
}
