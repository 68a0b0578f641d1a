//! Snapshots of the messages of runs: the report before a run, and its failures and warnings.

use ddem_io::run::{Event, Observer, Options, inspect, run};

use crate::lint::text;

/// Warnings of a run, in order.
#[derive(Default)]
struct EventLog(Vec<String>);

impl Observer for EventLog {
    fn event(&mut self, event: Event<'_>) {
        if let Event::Warning(warning) = event {
            self.0.push(warning.to_string());
        }
    }
}

/// Messages of the report on a deck.
fn inspected(text: &str) -> Vec<String> {
    let (deck, source) = ddem_deck::parse(text, "deck.toml").unwrap();
    match inspect(&deck, &source) {
        Ok(report) => report.warnings.iter().map(ToString::to_string).collect(),
        Err(error) => error.to_string().lines().skip(1).map(str::to_owned).collect(),
    }
}

/// Warnings of a run of a deck, and its failure.
fn ran(text: &str) -> Vec<String> {
    let (deck, source) = ddem_deck::parse(text, "deck.toml").unwrap();
    source.check(&deck).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let mut listener = EventLog::default();
    let mut options = Options::new(folder.path().join("out"));
    options.threads = Some(1);
    let outcome = run(&deck, &source, &options, &mut listener);
    listener.0.extend(outcome.err().map(|failure| failure.to_string()));
    listener.0
}

/// Messages about decks, each once.
fn all(decks: &[String], of: fn(&str) -> Vec<String>) -> String {
    let mut found: Vec<String> = Vec::new();
    for deck in decks {
        let messages = of(deck);
        assert!(!messages.is_empty(), "nothing is said about {deck}");
        for message in messages {
            if !found.contains(&message) {
                found.push(message);
            }
        }
    }
    found.join("\n")
}

const DYNAMIC: &str = "[[stage]]\nname = 'go'\nkind = 'dynamic'\n";
const RELAX: &str = "[[stage]]\nname = 'weight'\nkind = 'relax'\n";
const SAFETY: &str = "[[stage]]\nname = 'fs'\nkind = 'safety'\n";
const BASE: &str = "where = { z = 0.0 }";

#[test]
fn reports() {
    let deck = |more: &str| text(&[], more);
    let probe = "[[probe]]\nname = 'p'\n";
    let decks = [
        deck(""),
        deck(&format!("{DYNAMIC}duration = 1\ntime_step = 0.5\n")),
        deck(&format!("{DYNAMIC}duration = 1\ntime_step = 1e-20\n")),
        deck(&format!("{DYNAMIC}duration = 1e-20\n")),
        deck(&format!("{DYNAMIC}duration = 1e15\n")),
        text(&[("density = 2400", "density = 1e-300")], &format!("{DYNAMIC}duration = 1\n")),
        deck(&format!("{DYNAMIC}duration = 1e-3\ntime_step = 2e-4\n")),
        deck(&format!(
            "{probe}at = [1, 1, 1]\nquantity = 'peak_velocity'\n{DYNAMIC}duration = 1\n"
        )),
        text(
            &[("divisions = 1", "divisions = 1\nbody = 'rigid'")],
            &format!(
                "{probe}at = [1, 1, 1]\nquantity = 'stress'\n[[blocks]]\nname = 'soft'\norigin = [9, 0, 0]\n\
                 size = [1, 1, 1]\nmaterial = 'rock'\n{DYNAMIC}duration = 1\n"
            ),
        ),
    ];
    let found = all(&decks, inspected);
    insta::assert_snapshot!(found);
}

#[test]
fn searches_for_the_factor_of_safety() {
    let rigid = ("divisions = 1", "divisions = 1\nbody = 'rigid'");
    let search = |changes: &[(&str, &str)], keys: &str| {
        let changes = [&[rigid], changes].concat();
        text(&changes, &format!("{RELAX}{SAFETY}resolution = 0.5\ntolerance = 1e-4\n{keys}"))
    };
    let weak = ("cohesion = 1e5", "cohesion = 1e5\ntension = 1e5");
    let wall = (BASE, "where = { x = 0.0 }");
    let strong = "bracket = [0.2, 0.4]\n";
    let decks = [
        search(&[weak], strong),
        search(&[weak, ("[0, 0, -10]", "[0, 0, 0]")], strong),
        search(&[weak, wall], "bracket = [20, 40]\n"),
        search(&[weak], "max_steps = 1\n"),
        search(&[wall], strong),
    ];
    let found = all(&decks, ran);
    insta::assert_snapshot!(found);
}

#[test]
fn failures_of_stages() {
    let wall = (BASE, "where = { x = 0.0 }");
    let steps = |more: &str| text(&[wall], &format!("{RELAX}{more}"));
    let decks = [
        steps("on_failure = 'continue'\n"),
        steps("max_steps = 3\n"),
        text(
            &[],
            &format!(
                "[[probe]]\nname = 'p'\nat = [0.5, 0.5, 3.0]\n[[remove]]\nfrom = 'dig'\nwhere = {{ z = [2, 3] }}\n{RELAX}{}",
                RELAX.replace("weight", "dig")
            ),
        ),
    ];
    let found = all(&decks, ran);
    insta::assert_snapshot!(found);
}

/// A rigid cover that flies off a hole with a charge.
fn cover(speed: &str, more: &str) -> String {
    let changes = [
        ("divisions = 1", "divisions = 1\nbody = 'rigid'"),
        ("gravity = [0, 0, -10]", ""),
        ("        cohesion = 1e5\n", ""),
    ];
    text(
        &changes,
        &format!(
            "[[remove]]\nwhere = {{ x = [1, 2], y = [1, 2], z = [1, 2] }}\n[[charge]]\n\
             where = {{ sphere = {{ centre = [1.5, 1.5, 1.5], radius = 0.7 }} }}\npressure = 1e6\ndelay = 0.05\n\
             [[initial]]\nwhere = {{ z = [2, 3] }}\nvelocity = [0, 0, {speed}]\n{DYNAMIC}duration = 0.06\n{more}"
        ),
    )
}

#[test]
fn charges_that_detonate_late() {
    let decks = [cover("4", ""), cover("40", "")];
    let found = all(&decks, ran);
    insta::assert_snapshot!(found);
}

#[test]
fn blocks_that_slide_without_damping() {
    let slide = text(
        &[("divisions = 1", "divisions = 2"), (BASE, "where = { z = 0.0, set = 'rock' }")],
        &format!(
            "[[blocks]]\nname = 'sled'\norigin = [1, 1, 3]\nsize = [1, 1, 1]\ndivisions = 2\nmaterial = 'rock'\n\
             [[initial]]\nwhere = {{ set = 'sled' }}\nvelocity = [1, 0, 0]\n[contact]\ndamping = 0\n\
             {DYNAMIC}duration = 0.05\n"
        ),
    );
    let found = all(&[slide], ran);
    insta::assert_snapshot!(found);
}
