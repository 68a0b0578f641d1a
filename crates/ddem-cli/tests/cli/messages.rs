//! Snapshots of the messages of the command.

use std::fmt::Write;
use std::fs;

use super::harness::*;

/// First lines of the messages about command lines, which run in one working folder.
fn first_lines(desk: &Desk, lines: &[&str]) -> String {
    let mut found = String::new();
    for line in lines {
        let outcome = desk.run(line);
        assert_ne!(outcome.status, Some(0), "{line}");
        let first = outcome.stderr.lines().find(|line| !line.is_empty()).unwrap_or_default();
        writeln!(found, "{first}").unwrap();
    }
    found
}

#[test]
fn command_lines_are_refused_with_codes() {
    let desk = Desk::with(&[PRESS]);
    fs::create_dir(desk.path("results")).unwrap();
    let lines = [
        "check column.toml",
        "inf column",
        "column.toml other.toml",
        "column.toml --threads=0",
        "column.toml --threads -1",
        "column.toml --checkpoint-every -1",
        "column.toml --simd=mmx",
        "column.toml --thread 2",
        "column.toml --out",
        "--bogus",
        "info",
        "info result",
        "info elsewhere",
        "info column.toml",
        "info results",
        "run column.toml",
        "new",
        "new colum",
        "new column column.toml",
    ];
    let found = first_lines(&desk, &lines);
    insta::with_settings!({filters => vec![(r"this machine has `.*`", "this machine has `baseline`")]}, {
        insta::assert_snapshot!(found);
    });
}

#[test]
fn folders_are_refused_with_advice() {
    let desk = Desk::with(&[PRESS]);
    desk.write("file", "");
    fs::create_dir(desk.path("foreign")).unwrap();
    desk.write("foreign/energy.csv", "1");
    assert_eq!(desk.run("column.toml --quiet").status, Some(0));
    desk.write("results/column/summary.json", "{}");
    let mut found = first_lines(
        &desk,
        &["info results/column", "column.toml --out file", "column.toml --out foreign"],
    );
    desk.write("column.toml", &(COLUMN.replace("18e9", "19e9") + PRESS));
    found += &first_lines(&desk, &["column.toml --resume", "column.toml --checkpoint-every=-1"]);
    desk.write("column.toml", &(COLUMN.replace("'column'", "'a pillar'") + PRESS));
    found += &first_lines(&desk, &["column.toml --overwrite"]);
    insta::assert_snapshot!(found);
}
