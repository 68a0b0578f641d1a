//! Tests of in-situ stress and removed blocks on the command line.

use super::harness::*;

/// Column of four blocks under an in-situ stress; the upper two are removed.
const COLUMN: &str = "
title = 'dug'
[materials.rock]
density = 2400
young = 18e9
poisson = 0.25
[joints.seam]
thickness = 0.01
material = 'rock'
[[blocks]]
size = [1, 1, 4]
count = [1, 1, 4]
divisions = 2
material = 'rock'
joint = 'seam'
[[initial]]
stress = [-3e6, -3e6, -8e6, 0, 0, 0]
[[fix]]
where = { x = [0, 1], z = 0.0 }
axes = 'xyz'
[[fix]]
axes = 'xy'
[[fix]]
where = { z = 4.0 }
axes = 'z'
[[remove]]
where = { z = [2.0, 4.0] }
from = 'dig'
release = 1e-3
[[stage]]
name = 'before'
kind = 'relax'
[[stage]]
name = 'dig'
kind = 'dynamic'
duration = 2e-3
frames = 4
";

fn run_deck(deck: &str) -> (Desk, RunOutput) {
    let desk = Desk::new();
    desk.write("dug.toml", deck);
    let outcome = desk.run("dug.toml --out a");
    (desk, outcome)
}

#[test]
fn balanced_stress_and_excavation_run_without_warning() {
    let (desk, outcome) = run_deck(COLUMN);
    assert_eq!(outcome.status, Some(0), "{}", outcome.stderr);
    assert!(!outcome.stderr.contains("warning"), "{}", outcome.stderr);
    let summary: serde_json::Value = serde_json::from_slice(&desk.read("a/summary.json")).unwrap();
    assert_eq!(summary["stages"][0]["steps"], 0, "{summary}");
    assert_eq!(summary["fragments"]["largest_volume"].as_f64().map(f64::round), Some(2.0));
}

#[test]
fn faces_without_initial_stress_balance_are_named() {
    let (_, outcome) = run_deck(&COLUMN.replace("where = { z = 4.0 }", "where = { z = 0.0 }"));
    assert_eq!(outcome.status, Some(0), "{}", outcome.stderr);
    let words = outcome.stderr.split_whitespace().collect::<Vec<_>>().join(" ");
    let expected = "initial: the outer faces at z = 4.000000 m, looking along +z do not carry the in-situ stress";
    assert!(words.contains(expected), "{words}");
    // -8 MPa on a square metre.
    assert!(words.contains("-8.0000e6] N are missing, 100.00 %"), "{words}");
    assert!(words.contains("[unbalanced-stress]") && !words.contains("z = 0.000000 m"), "{words}");
}

#[test]
fn excavation_errors_are_shown_and_nothing_runs() {
    for (from, to, expected) in [
        ("release = 1e-3", "release = -1e-3", "`release` is -0.001 but must be 0 or more"),
        ("from = 'dig'", "from = 'digg'", "there is no stage named `digg`"),
        ("from = 'dig'", "from = 'before'", "`before` is the first stage"),
        ("from = 'dig'", "", "`release` needs `from`"),
        ("{ z = [2.0, 4.0] }", "{ z = [8.0, 9.0] }", "remove[0].where"),
        ("{ z = [2.0, 4.0] }", "{ z = [0.0, 4.0] }", "all blocks are removed"),
        ("[-3e6, -3e6, -8e6, 0, 0, 0]", "[-3e6, -8e6]", "expected 6 numbers, found 2"),
        ("stress = ", "velocity = [0, 0, 1]\ngradient = { z = ", "`gradient` needs `stress`"),
    ] {
        let mut deck = COLUMN.replacen(from, to, 1);
        if to.contains("gradient") {
            deck = deck.replacen("0, 0, 0]\n", "0, 0, 0] }\n", 1);
        }
        assert_ne!(deck, COLUMN, "{from}");
        let (desk, outcome) = run_deck(&deck);
        assert_eq!(outcome.status, Some(2), "{to}: {}", outcome.stderr);
        assert!(outcome.stderr.contains(expected), "{to}: {}", outcome.stderr);
        assert_eq!(desk.names(), ["dug.toml"]);
    }
}

/// Probes exclude removed blocks from their mean. A probe without any block left has no value,
/// which a warning reports before the run.
#[test]
fn probes_exclude_removed_blocks() {
    // The nodes from z = 1 upwards are held along z.
    let deck =
        COLUMN.replace("where = { z = 4.0 }\naxes = 'z'", "where = { z = [1.0, 4.0] }\naxes = 'z'");
    let probe = |name: &str, place: &str, quantity: &str| {
        format!("[[probe]]\nname = '{name}'\n{place}\nquantity = '{quantity}'\nevery = 1e-3\n")
    };
    let deck = [
        deck,
        probe("gone", "at = [0.5, 0.5, 2.5]", "stress"),
        probe("top", "where = { z = 4.0 }", "velocity"),
        probe("stays", "at = [0.5, 0.5, 1.5]", "stress"),
        probe("all", "where = { x = 0.5 }", "stress"),
        probe("held", "where = { z = 4.0 }", "reaction"),
    ];
    let (desk, outcome) = run_deck(&deck.concat());
    assert_eq!(outcome.status, Some(0), "{}", outcome.stderr);
    let words = outcome.stderr.split_whitespace().collect::<Vec<_>>().join(" ");
    for name in ["gone", "top"] {
        let message = format!(
            "all blocks of probe `{name}` are removed by stage `dig`: it has no values from then on; \
             choose blocks that stay, unless only the values before that matter [probe-of-removed-blocks]"
        );
        assert!(words.contains(&message), "{words}");
    }
    assert_eq!(words.matches("probe `").count(), 2, "{words}");
    let table = String::from_utf8(desk.read("a/probes.csv")).unwrap();
    let mut lines = table.lines();
    let header: Vec<&str> = lines.next().unwrap().split(',').collect();
    let at = |name: &str| header.iter().position(|column| *column == name).unwrap();
    let rows: Vec<Vec<&str>> = lines.map(|line| line.split(',').collect()).collect();
    let (first, last) = (&rows[0], &rows[rows.len() - 1]);
    assert_eq!((first[0], last[0]), ("before", "dig"));
    let number = |row: &Vec<&str>, name: &str| row[at(name)].parse::<f64>().unwrap();
    for name in ["gone.zz", "stays.zz", "all.zz"] {
        assert!((number(first, name) / -8e6 - 1.0).abs() < 1e-9, "{name}: {first:?}");
    }
    for name in ["gone.zz", "gone.xy", "top.x", "top.z"] {
        assert_eq!(last[at(name)], "NaN", "{name}");
    }
    // The supports keep the remaining blocks in place, so their stress and its mean do not change.
    for name in ["stays.zz", "all.zz"] {
        assert!((number(last, name) / -8e6 - 1.0).abs() < 1e-9, "{name}: {last:?}");
    }
    assert!((number(first, "held.z") / -8e6 - 1.0).abs() < 1e-9, "{first:?}");
    assert_eq!(number(last, "held.z"), 0.0);
}
