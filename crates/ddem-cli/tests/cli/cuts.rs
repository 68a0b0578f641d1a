//! The command `ddem cut`, on the example of a slope.

use std::path::Path;

use super::harness::*;

/// Cross-section of the slope of `examples/cut.toml` times its length `[m³]`: 40 × 8 below, and
/// above it a trapezium of 30 m and 16 m, 20 m high.
const SLOPE: f64 = (40.0 * 8.0 + 20.0 * (30.0 + 16.0) / 2.0) * 30.0;

/// Volume of its tunnel `[m³]`: 6 × 3 m, and a trapezium of 6 m and 3 m above, 1.5 m high.
const TUNNEL: f64 = (6.0 * 3.0 + 1.5 * (6.0 + 3.0) / 2.0) * 30.0;

fn example() -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/cut.toml");
    std::fs::read_to_string(path).unwrap()
}

/// Numbers of a column of `blocks.csv`.
fn column(text: &str, name: &str) -> Vec<f64> {
    let mut lines = text.lines();
    let at = lines.next().unwrap().split(',').position(|own| own == name).unwrap();
    lines.map(|line| line.split(',').nth(at).unwrap().parse().unwrap()).collect()
}

#[test]
fn the_blocks_of_the_example_fill_the_slope() {
    let desk = Desk::new();
    desk.write("cut.toml", &example());
    let outcome = desk.run("cut cut.toml");
    assert_eq!(outcome.status, Some(0), "{}", outcome.stderr);
    assert_eq!(
        outcome.stderr,
        "the blocks are in results/cut-cut: open blocks.vtkhdf there in ParaView\n"
    );
    assert_eq!(desk.names(), ["cut.toml", "results"]);
    let csv = String::from_utf8(desk.read("results/cut-cut/blocks.csv")).unwrap();
    let volumes = column(&csv, "volume");
    let sum: f64 = volumes.iter().sum();
    assert!((sum / SLOPE - 1.0).abs() < 1e-12, "{sum} instead of {SLOPE}");
    assert!(column(&csv, "width").iter().all(|width| *width > 0.0));
    // The cells in the outline of the tunnel, by their centroids.
    let (x, z) = (column(&csv, "x"), column(&csv, "z"));
    let inside = |i: &usize| {
        let (u, v) = ((x[*i] - 30.0).abs(), z[*i] - 5.0);
        u < 3.0 && v > 0.0 && v < 4.5 && u + (v - 3.0).max(0.0) < 3.0
    };
    let tunnel: f64 = (0..x.len()).filter(inside).map(|i| volumes[i]).sum();
    assert!((tunnel / TUNNEL - 1.0).abs() < 1e-9, "{tunnel} instead of {TUNNEL}");
    let first = outcome.stdout.lines().next().unwrap();
    assert!(first.starts_with(&format!("{} cells in ", volumes.len())), "{first}");
    assert!(desk.read("results/cut-cut/blocks.vtkhdf").len() > 100_000);
    // A second time the bytes are the same, and the first ones are kept.
    let again = desk.run("cut cut.toml");
    assert_eq!(again.stdout, outcome.stdout);
    assert!(again.stderr.starts_with("earlier results were moved to results/cut-cut.1\n"));
    assert_eq!(desk.read("results/cut-cut/blocks.csv"), csv.as_bytes());
    assert_eq!(desk.read("results/cut-cut.1/blocks.csv"), csv.as_bytes());
    desk.run("cut cut.toml --overwrite --out results/cut-cut.1");
    assert!(!desk.path("results/cut-cut.2").exists());
}

#[test]
fn decks_with_regions_are_cut_but_not_run() {
    let desk = Desk::new();
    desk.write("cut.toml", &example());
    for arguments in ["cut.toml", "cut.toml --check"] {
        let outcome = desk.run(arguments);
        assert_eq!((outcome.status, outcome.stdout.as_str()), (Some(2), ""));
        assert!(outcome.stderr.contains("cannot be run yet"), "{}", outcome.stderr);
        assert!(outcome.stderr.contains("ddem cut deck.toml"), "{}", outcome.stderr);
    }
    assert_eq!(desk.names(), ["cut.toml"]);
}

#[test]
fn wrong_cuts_are_refused_before_anything_is_written() {
    let desk = Desk::new();
    desk.write("cut.toml", &example().replace("spacing = 4.0", "spacing = 1e-4"));
    desk.write("column.toml", COLUMN);
    for (arguments, code) in [
        ("cut cut.toml", "too-large"),
        ("cut column.toml", "empty-model"),
        ("cut nowhere.toml", "invalid-file"),
    ] {
        let outcome = desk.run(arguments);
        assert_eq!((outcome.status, outcome.stdout.as_str()), (Some(2), ""), "{arguments}");
        assert!(outcome.stderr.contains(&format!("[{code}]")), "{arguments}: {}", outcome.stderr);
    }
    assert_eq!(desk.names(), ["column.toml", "cut.toml"]);
}
