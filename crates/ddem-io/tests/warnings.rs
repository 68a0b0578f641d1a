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
struct Listener(Vec<String>);

impl Observer for Listener {
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
    let mut listener = Listener::default();
    let options = Options::new(folder.path().join("out"));
    let outcome = run(&deck, &source, &options, &mut listener).unwrap();
    assert!(matches!(outcome, Outcome::Done(_)));
    let text = std::fs::read(folder.path().join("out/summary.json")).unwrap();
    let summary: serde_json::Value = serde_json::from_slice(&text).unwrap();
    let kept = summary["warnings"].as_array().unwrap().iter();
    let codes = kept.map(|warning| format!("[{}]", warning["code"].as_str().unwrap()));
    [listener.0, codes.collect()]
}

#[test]
fn a_charge_detonates_in_a_cavity_that_has_opened() {
    let [said, kept] = warnings(BLAST);
    assert!(said.iter().any(|text| text.ends_with("[cavity-changed]")), "{said:?}");
    assert!(said.iter().any(|text| text.contains("120 % of its cavity")), "{said:?}");
    assert!(kept.contains(&"[cavity-changed]".to_owned()), "{kept:?}");
    let late = BLAST.replace("[0, 0, 4]", "[0, 0, 40]");
    let [said, kept] = warnings(&late);
    assert!(said.iter().any(|text| text.ends_with("[vented-charge]")), "{said:?}");
    assert!(kept.contains(&"[vented-charge]".to_owned()), "{kept:?}");
    let [said, kept] = warnings(&format!("{late}[lint]\nallow = ['vented-charge']\n"));
    assert!(!said.iter().chain(&kept).any(|text| text.contains("vented")), "{said:?} {kept:?}");
}

#[test]
fn a_time_step_that_is_stable_until_joints_fail_is_a_warning() {
    let critical = {
        let (deck, _) = ddem_deck::parse(BLAST, "deck.toml").unwrap();
        ddem_core::Simulation::new(deck.build().unwrap()).critical_step().unwrap()
    };
    let deck = BLAST.replace("delay = 0.05\n", "") + &format!("time_step = {}\n", 0.95 * critical);
    let deck = deck.replace("duration = 0.06", &format!("duration = {}", 10.0 * critical));
    let [said, kept] = warnings(&deck);
    assert!(said.iter().any(|text| text.ends_with("[unsafe-time-step]")), "{said:?}");
    assert!(kept.contains(&"[unsafe-time-step]".to_owned()), "{kept:?}");
}
