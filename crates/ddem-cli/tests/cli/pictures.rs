//! Tests of pictures of results.

use std::collections::BTreeSet;

use super::harness::{Desk, PRESS};

/// Environment variable that names a Python with the module and PyVista.
const PYTHON: &str = "DDEM_PYTHON";

#[test]
fn without_python_it_is_said_what_to_install() {
    let desk = Desk::with(&[PRESS]);
    desk.run("column.toml");
    let plot = |python: &str| {
        let mut command = desk.command("plot results/column");
        let output = command.env(PYTHON, python).output().unwrap();
        assert_eq!((output.status.code(), &output.stdout[..]), (Some(2), &b""[..]));
        String::from_utf8(output.stderr).unwrap()
    };
    let said = |looked: &str, python: &str| {
        format!(
            "error: pictures need Python with the module ddem and PyVista: looked for them with `{looked}`\n  \
             install them by `{python} -m pip install '.[plot]'` in the folder of the sources of ddem\n"
        )
    };
    assert_eq!(plot("no/python"), said("no/python", "python3"));
    // `ddem` itself starts like a Python, but has no module.
    let other = env!("CARGO_BIN_EXE_ddem");
    assert_eq!(plot(other), said(other, other));
    assert!(!desk.path("results/column/plot.png").exists());
}

#[test]
fn a_folder_that_is_not_there_is_said() {
    let desk = Desk::with(&[PRESS]);
    let went = desk.run("plot column.tom");
    assert_eq!(went.status, Some(2));
    assert_eq!(went.stderr, "error: there is no folder `column.tom`\n");
    let went = desk.run("plot column.toml");
    assert!(went.stderr.contains("`column.toml` is a file: give the folder"), "{}", went.stderr);
}

#[test]
fn a_picture_is_drawn_and_its_path_printed() {
    if std::env::var_os(PYTHON).is_none() {
        eprintln!("{PYTHON} is not set: no picture is drawn");
        return;
    }
    let desk = Desk::with(&[PRESS]);
    desk.run("column.toml");
    let went = desk.run("plot results/column");
    assert_eq!(went.status, Some(0), "{}", went.stderr);
    assert_eq!(went.stdout.trim(), "results/column/plot.png");
    let bytes = desk.read("results/column/plot.png");
    assert_eq!(&bytes[..8], b"\x89PNG\r\n\x1a\n");
    // A blank picture of this size compresses to a few kilobytes of few different bytes.
    assert!(bytes.len() > 20_000, "{} bytes", bytes.len());
    assert_eq!(bytes.iter().collect::<BTreeSet<_>>().len(), 256);

    let line = "plot results/column --field stress --frame 0 --view xz --scale 1 --out side.png";
    let went = desk.run(line);
    assert_eq!((went.status, went.stdout.trim()), (Some(0), "side.png"), "{}", went.stderr);
    assert_ne!(desk.read("side.png"), bytes);
    let went = desk.run("plot results/column --field strss");
    assert_eq!((went.status, went.stdout.as_str()), (Some(2), ""));
    assert!(went.stderr.contains("did you mean 'stress'"), "{}", went.stderr);
    let went = desk.run("plot results/column --frame first");
    assert_eq!(went.status, Some(2));
    assert!(went.stderr.contains("--frame"), "{}", went.stderr);
}
