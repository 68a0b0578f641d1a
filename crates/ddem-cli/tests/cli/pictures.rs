//! Tests of pictures of results.

use std::collections::BTreeSet;

use super::harness::{Desk, PRESS};

/// Environment variable that names a Python with the module and PyVista.
const PYTHON: &str = "DDEM_PYTHON";

#[test]
fn missing_python_names_what_to_install() {
    let desk = Desk::with(&[PRESS]);
    desk.run("column.toml");
    let plot = |python: &str| {
        let mut command = desk.command("plot results/column");
        let output = command.env(PYTHON, python).output().unwrap();
        assert_eq!((output.status.code(), &output.stdout[..]), (Some(2), &b""[..]));
        String::from_utf8(output.stderr).unwrap()
    };
    // `ddem` itself starts like a Python, but has no module.
    let other = env!("CARGO_BIN_EXE_ddem");
    let found = plot("no/python") + &plot(other).replace(other, "other/python");
    insta::assert_snapshot!(found);
    assert!(!desk.path("results/column/plot.png").exists());
}

#[test]
fn missing_results_folder_is_named() {
    let desk = Desk::with(&[PRESS]);
    let outcome = desk.run("plot column.tom");
    assert_eq!(outcome.status, Some(2));
    let missing = "error: there is no folder `column.tom`: give that of the results of a run [results-folder]\n";
    assert_eq!(outcome.stderr, missing);
    let outcome = desk.run("plot column.toml");
    assert!(
        outcome.stderr.contains("`column.toml` is a file: give the folder"),
        "{}",
        outcome.stderr
    );
}

#[test]
fn plot_prints_path_of_the_picture() {
    if std::env::var_os(PYTHON).is_none() {
        eprintln!("{PYTHON} is not set: no picture is drawn");
        return;
    }
    let desk = Desk::with(&[PRESS]);
    desk.run("column.toml");
    let outcome = desk.run("plot results/column");
    assert_eq!(outcome.status, Some(0), "{}", outcome.stderr);
    assert_eq!(outcome.stdout.trim(), "results/column/plot.png");
    let bytes = desk.read("results/column/plot.png");
    assert_eq!(&bytes[..8], b"\x89PNG\r\n\x1a\n");
    // A blank picture of this size compresses to a few kilobytes of few different bytes.
    assert!(bytes.len() > 20_000, "{} bytes", bytes.len());
    assert_eq!(bytes.iter().collect::<BTreeSet<_>>().len(), 256);

    let line = "plot results/column --field stress --frame 0 --view xz --scale 1 --out side.png";
    let outcome = desk.run(line);
    assert_eq!(
        (outcome.status, outcome.stdout.trim()),
        (Some(0), "side.png"),
        "{}",
        outcome.stderr
    );
    assert_ne!(desk.read("side.png"), bytes);
    let outcome = desk.run("plot results/column --field strss");
    assert_eq!((outcome.status, outcome.stdout.as_str()), (Some(2), ""));
    assert!(outcome.stderr.contains("did you mean 'stress'"), "{}", outcome.stderr);
    let outcome = desk.run("plot results/column --frame first");
    assert_eq!(outcome.status, Some(2));
    assert!(outcome.stderr.contains("--frame"), "{}", outcome.stderr);
}
