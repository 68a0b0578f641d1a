//! Tests of warnings while a deck runs: they reach the observer and the summary.

use ddem_io::run::{Event, Observer, Options, Outcome, run};

const BLAST: &str = "
title = 'a blast in a block that comes apart'
[materials.rock]
density = 2400
young = 18e9
poisson = 0.25
[joints.seam]
normal_stiffness = 1e10
shear_stiffness = 1e10
friction = 35
[[blocks]]
size = [3, 3, 3]
count = [3, 3, 3]
divisions = 1
body = 'rigid'
material = 'rock'
joint = 'seam'
[[remove]]
where = { x = [1, 2], y = [1, 2], z = [1, 2] }
[[charge]]
where = { sphere = { centre = [1.5, 1.5, 1.5], radius = 0.7 } }
pressure = 1e6
delay = 0.05
[[initial]]
where = { z = [2, 3] }
velocity = [0, 0, 4]
[[stage]]
name = 'blast'
kind = 'dynamic'
duration = 0.06
";

#[derive(Default)]
struct WarningListener(Vec<String>);

impl Observer for WarningListener {
    fn event(&mut self, event: Event<'_>) {
        if let Event::Warning(warning) = event {
            self.0.push(warning.to_string());
        }
    }
}

/// Warnings of a run, and the codes of those in its summary.
fn warnings(deck: &str) -> [Vec<String>; 2] {
    let (deck, source) = ddem_deck::parse(deck, "deck.toml").unwrap();
    source.check(&deck).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let mut listener = WarningListener::default();
    let options = Options::new(folder.path().join("out"));
    let outcome = run(&deck, &source, &options, &mut listener).unwrap();
    assert!(matches!(outcome, Outcome::Done(_)));
    let text = std::fs::read(folder.path().join("out/summary.json")).unwrap();
    let summary: serde_json::Value = serde_json::from_slice(&text).unwrap();
    let recorded = summary["warnings"].as_array().unwrap().iter();
    let codes = recorded.map(|warning| format!("[{}]", warning["code"].as_str().unwrap()));
    [listener.0, codes.collect()]
}

#[test]
fn charge_in_opened_cavity_warns() {
    let [observed, recorded] = warnings(BLAST);
    assert!(observed.iter().any(|text| text.ends_with("[cavity-changed]")), "{observed:?}");
    assert!(observed.iter().any(|text| text.contains("120 % of its cavity")), "{observed:?}");
    assert!(recorded.contains(&"[cavity-changed]".to_owned()), "{recorded:?}");
    let late = BLAST.replace("[0, 0, 4]", "[0, 0, 40]");
    let [observed, recorded] = warnings(&late);
    assert!(observed.iter().any(|text| text.ends_with("[vented-charge]")), "{observed:?}");
    assert!(recorded.contains(&"[vented-charge]".to_owned()), "{recorded:?}");
    let [observed, recorded] = warnings(&format!("{late}[lint]\nallow = ['vented-charge']\n"));
    assert!(
        !observed.iter().chain(&recorded).any(|text| text.contains("vented")),
        "{observed:?} {recorded:?}"
    );
}

#[test]
fn time_step_unstable_after_failure_warns() {
    let critical = {
        let (deck, _) = ddem_deck::parse(BLAST, "deck.toml").unwrap();
        ddem_core::Simulation::new(deck.build().unwrap()).critical_step().unwrap()
    };
    let deck = BLAST.replace("delay = 0.05\n", "") + &format!("time_step = {}\n", 0.95 * critical);
    let deck = deck.replace("duration = 0.06", &format!("duration = {}", 10.0 * critical));
    let [observed, recorded] = warnings(&deck);
    assert!(observed.iter().any(|text| text.ends_with("[unsafe-time-step]")), "{observed:?}");
    assert!(recorded.contains(&"[unsafe-time-step]".to_owned()), "{recorded:?}");
}
