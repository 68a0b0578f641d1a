//! Tests of `ddem new`: every starter deck is checked and run.

use std::fs;

use super::harness::*;

const TEMPLATES: [&str; 6] = ["column", "slope", "tunnel", "blast", "wedge", "sample"];

/// Summary of the run of a starter deck, whose text may be replaced in places, and the folder of the run.
fn ran(template: &str, changes: &[(&str, &str)]) -> (serde_json::Value, Desk) {
    let desk = Desk::new();
    let written = desk.run(&format!("new {template}"));
    assert_eq!(written.status, Some(0), "{}", written.stderr);
    let name = format!("{template}.toml");
    let mut text = String::from_utf8(desk.read(&name)).unwrap();
    for (old, new) in changes {
        assert!(text.contains(old), "{template}: {old}");
        text = text.replace(old, new);
    }
    desk.write(&name, &text);
    let outcome = desk.run(&name);
    assert_eq!(outcome.status, Some(0), "{}", outcome.stderr);
    let summary = desk.read(&format!("results/{template}/summary.json"));
    (serde_json::from_slice(&summary).unwrap(), desk)
}

/// Last number in a column of the probes of a run.
fn last(desk: &Desk, template: &str, column: &str) -> f64 {
    let table = String::from_utf8(desk.read(&format!("results/{template}/probes.csv"))).unwrap();
    let mut lines = table.lines();
    let at = lines.next().unwrap().split(',').position(|name| name == column).unwrap();
    lines.next_back().unwrap().split(',').nth(at).unwrap().parse().unwrap()
}

fn assert_near(value: f64, exact: f64, tolerance: f64) {
    let error = (value / exact - 1.0).abs();
    assert!(error < tolerance, "{value} instead of {exact}: off by {error:.1e}");
}

#[test]
fn every_template_passes_its_check_without_a_warning() {
    let desk = Desk::new();
    let help = desk.run("new --help").stdout;
    for template in TEMPLATES {
        assert!(help.contains(&format!("- {template}:")), "{help}");
        let written = desk.run(&format!("new {template}"));
        assert_eq!((written.status, written.stdout.as_str()), (Some(0), ""), "{}", written.stderr);
        let line = format!("wrote {template}.toml, to run it: ddem {template}.toml\n");
        assert_eq!(written.stderr, line);
        let checked = desk.run(&format!("{template}.toml --check"));
        assert_eq!((checked.status, checked.stderr.as_str()), (Some(0), ""), "{template}");
    }
    let files = fs::read_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/templates")).unwrap();
    assert_eq!(files.count(), TEMPLATES.len());
}

/// Settlement of the column: p h/E + rho g h²/(2 E) in the rock, (p + rho g h above)/k_n in each joint.
#[test]
fn column_settles_as_its_comment_says() {
    let (_, desk) = ran("column", &[]);
    let (load, weight, young, stiffness) = (1e6, 2400.0 * 9.81, 18e9, 1e10);
    let rock = (load * 3.0 + weight * 9.0 / 2.0) / young;
    let joints = (load + 2.0 * weight + load + weight) / stiffness;
    // The weight bends the levels of the column a little, by Poisson's ratio.
    assert_near(last(&desk, "column", "top.z"), -(rock + joints), 2e-4);
}

/// Layers on a plane with friction slide at tan(phi)/tan(dip).
#[test]
fn slope_has_the_factor_of_its_comment() {
    let (summary, _) = ran("slope", &[("bracket = [0.8, 3.0]", "bracket = [1.2, 1.32]")]);
    let factor = summary["stages"][1]["factor"].as_f64().unwrap();
    assert_near(factor, 36_f64.to_radians().tan() / 30_f64.to_radians().tan(), 2e-3);
}

/// Limit equilibrium of the wedge by Hoek and Bray.
#[test]
fn wedge_has_the_factor_of_its_comment() {
    let (summary, desk) = ran("wedge", &[("bracket = [1.0, 2.5]", "bracket = [1.46, 1.58]")]);
    let factor = summary["stages"][1]["factor"].as_f64().unwrap();
    assert_near(factor, (0.673312 + 0.242106) / 37.0583_f64.to_radians().sin(), 2e-3);
    assert_eq!(desk.run("cut wedge.toml").status, Some(0));
    let blocks = String::from_utf8(desk.read("results/wedge-cut/blocks.csv")).unwrap();
    assert!(blocks.contains(",slides on two,1.51904"), "{blocks}");
}

/// Strength of a sample with one plane of weakness, by Jaeger.
#[test]
fn sample_has_the_strength_of_its_comment() {
    let (_, desk) = ran("sample", &[]);
    let (confining, dip, friction) = (5e6, 55_f64.to_radians(), 30_f64.to_radians().tan());
    let shear = (1.0 - friction / dip.tan()) * (2.0 * dip).sin();
    let force = 0.01 * (confining + 2.0 * confining * friction / shear);
    // The sample slides by a thousandth of its width, which turns its halves a little.
    assert_near(last(&desk, "sample", "platen.z"), -force, 1e-3);
}

/// The stress before the excavation is in balance; afterwards the crown and the floor close in.
#[test]
fn tunnel_is_in_balance_before_it_is_dug() {
    let (summary, desk) = ran("tunnel", &[]);
    let moved = summary["stages"][0]["state"]["displacement"]["size"].as_f64().unwrap_or(0.0);
    assert!(moved < 1e-9, "{moved}");
    let (crown, floor) = (last(&desk, "tunnel", "crown.z"), last(&desk, "tunnel", "floor.z"));
    assert!(crown < -1e-3 && floor > 1e-3, "{crown} {floor}");
}

#[test]
fn blast_throws_the_face_forward() {
    let (_, desk) = ran("blast", &[("duration = 0.02 ", "duration = 0.005 ")]);
    assert!(last(&desk, "blast", "face.y") < -5.0);
}

#[test]
fn files_are_replaced_only_on_request() {
    let desk = Desk::new();
    desk.write("column.toml", "mine");
    let refused = desk.run("new column");
    assert_eq!(refused.status, Some(2));
    assert_eq!(desk.read("column.toml"), b"mine");
    let other = desk.run("new column other.toml");
    assert_eq!(other.status, Some(0));
    assert_eq!(desk.run("new column --overwrite").status, Some(0));
    assert_eq!(desk.read("column.toml"), desk.read("other.toml"));
    let nowhere = desk.run("new column none/deck.toml");
    assert_eq!(nowhere.status, Some(2));
    insta::assert_snapshot!([refused, other, nowhere].map(|outcome| outcome.stderr).concat());
}

#[test]
fn unknown_template_names_the_nearest() {
    let desk = Desk::new();
    let outcome = desk.run("new slop");
    assert_eq!((outcome.status, desk.names()), (Some(2), Vec::new()));
    insta::assert_snapshot!(outcome.stderr, @r"
    error: invalid value 'slop' for '<TEMPLATE>' [invalid-argument]
      [possible values: column, slope, tunnel, blast, wedge, sample]

      tip: a similar value exists: 'slope'

    For more information, try '--help'.
    ");
}
