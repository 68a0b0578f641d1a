//! Tests of decks that run: results, progress and interruption.

use std::io::Read;
use std::path::Path;
use std::process::{Command, Stdio};

use super::harness::*;

#[test]
fn check_reports_and_writes_nothing() {
    let desk = Desk::with(&[PRESS, SHAKE]);
    let outcome = desk.run("column.toml --check");
    assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(0), ""));
    for line in ["column", "blocks         3", "nodes          81", "joints         2"] {
        assert!(outcome.stdout.lines().any(|other| other == line), "{}", outcome.stdout);
    }
    for part in ["pairs          18", "critical step  ", "memory  ", "stage shake: "] {
        assert!(outcome.stdout.contains(part), "{}", outcome.stdout);
    }
    assert_eq!(desk.names(), ["column.toml"]);
}

#[test]
fn run_writes_all_results() {
    let desk = Desk::with(&[PRESS, SHAKE]);
    let outcome = desk.run("column.toml");
    assert_eq!((outcome.status, outcome.stdout.as_str()), (Some(0), ""), "{}", outcome.stderr);
    for name in RESULTS {
        assert!(desk.path("results/column").join(name).exists(), "{name}");
    }
    let summary: serde_json::Value =
        serde_json::from_slice(&desk.read("results/column/summary.json")).unwrap();
    assert_eq!(summary["title"], "column");
    assert_eq!(summary["stages"][0]["name"], "press");
    assert_eq!(summary["stages"][1]["name"], "shake");
    let lines: Vec<&str> = outcome.stderr.lines().collect();
    assert_eq!(lines[0], "model: 3 blocks, 81 nodes, 18 pairs");
    let starts = [
        "press (1/2): relaxation",
        "press: at rest after ",
        "critical step ",
        "shake (2/2): ",
        "shake: at rest after ",
    ];
    for (line, start) in lines[1..].iter().zip(starts) {
        assert!(line.starts_with(start), "{}", outcome.stderr);
    }
    assert_eq!(lines[6..8], ["", "at the end of `shake`, t = 10.00 ms:"]);
    let folder = Path::new("results").join("column");
    let last = format!("results are in {}: open blocks.vtkhdf there in ParaView", folder.display());
    assert_eq!(lines.last(), Some(&last.as_str()));
}

/// Column whose joints can fail, but are far too strong to do so.
fn breakable() -> String {
    let strength = "cohesion = 1e9\nfriction = 30\ntension = 1e9\n";
    COLUMN.replace(
        "material = 'rock'\n[[blocks]]",
        &format!("material = 'rock'\n{strength}[[blocks]]"),
    )
}

#[test]
fn report_counts_joints_that_can_fail() {
    let desk = Desk::new();
    desk.write("column.toml", &(breakable() + PRESS));
    let outcome = desk.run("column.toml --check");
    assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(0), ""));
    let expected = "can fail       2 joints, 18 pairs";
    assert!(outcome.stdout.lines().any(|line| line == expected), "{}", outcome.stdout);
    let outcome = desk.run("column.toml");
    assert_eq!(outcome.status, Some(0), "{}", outcome.stderr);
    let first = outcome.stderr.lines().next();
    assert_eq!(first, Some("model: 3 blocks, 81 nodes, 18 pairs, which can all fail"));
    let summary: serde_json::Value =
        serde_json::from_slice(&desk.read("results/column/summary.json")).unwrap();
    assert_eq!(summary["failed_pairs"], serde_json::json!({ "shear": 0, "tension": 0 }));

    // `[contact]` has no effect if contacts are not searched for.
    desk.write("column.toml", &(breakable() + PRESS + "[contact]\nfriction = 20\n"));
    for arguments in ["column.toml --check", "column.toml"] {
        let stderr = desk.run(arguments).stderr;
        let start = "warning: contact: `[contact]` has no effect: `contact = false` in `[model]`";
        assert!(
            stderr.starts_with(start) && stderr.contains("[contact-without-effect]"),
            "{stderr}"
        );
    }
}

#[test]
fn impossible_strength_is_shown_and_nothing_is_written() {
    let desk = Desk::new();
    desk.write("column.toml", &(breakable().replace("friction = 30", "friction = 90") + PRESS));
    for arguments in ["column.toml", "column.toml --check"] {
        let outcome = desk.run(arguments);
        assert_eq!((outcome.status, outcome.stdout.as_str()), (Some(2), ""));
        for part in ["`friction` is 90 but must be 0 or more and below 90", "joints.seam.friction"]
        {
            assert!(outcome.stderr.contains(part), "{}", outcome.stderr);
        }
        assert_eq!(desk.names(), ["column.toml"]);
    }
}

#[test]
fn quiet_run_prints_nothing() {
    let desk = Desk::with(&[PRESS, SHAKE]);
    for arguments in ["column.toml --quiet --out a", "column.toml --quiet --check"] {
        let outcome = desk.run(arguments);
        assert_eq!((outcome.status, outcome.stdout, outcome.stderr), {
            (Some(0), String::new(), String::new())
        });
    }
    assert!(desk.path("a/summary.json").exists());
}

#[test]
fn results_are_independent_of_threads_and_instruction_set() {
    let desk = Desk::with(&[PRESS, SHAKE]);
    let run = |arguments: &str| {
        let outcome = desk.run(&format!("column.toml --out a {arguments}"));
        assert_eq!(outcome.status, Some(0), "{}", outcome.stderr);
        ["a/probes.csv", "a/energy.csv", "a/fragments.csv", "a/blocks.vtkhdf", "a/joints.vtkhdf"]
            .map(|name| desk.read(name))
    };
    let expected = run("--threads 1");
    assert!(expected == run("--threads 2"), "2 threads");
    for (name, _) in ddem_core::Simd::available() {
        assert!(expected == run(&format!("--simd {name}")), "{name}");
    }
}

/// The system library chooses its functions by processor; the results do not depend on that choice.
#[test]
#[cfg(all(target_os = "linux", target_env = "gnu", target_arch = "x86_64"))]
fn results_are_independent_of_the_processor() {
    let desk = Desk::new();
    let thrown = "
[model]
gravity = [0, 0, -9.81]
[materials.rock]
density = 2400
young = 18e9
poisson = 0.25
[joints.seam]
normal_stiffness = 1e10
shear_stiffness = 1e10
residual_friction = 25
jrc = 8
jcs = 60e6
[[blocks]]
size = [4, 3, 3]
count = [4, 3, 3]
divisions = 1
dip = 20
dip_direction = 65
material = 'rock'
joint = 'seam'
[[blocks]]
origin = [-6, -2, 6]
size = [2, 1, 1]
count = [2, 1, 1]
body = 'rigid'
material = 'rock'
joint = 'seam'
[[initial]]
where = { z = [5.9, 8] }
spin = [3, 2, 1]
[[load]]
where = { x = [-9, 9], z = [-3, 0] }
force = [1e3, 0, 0]
history = { duvall = { alpha = 100, beta = 900 } }
[[stage]]
name = 'fly'
kind = 'dynamic'
duration = 0.05
frames = 2
";
    desk.write("thrown.toml", thrown);
    let run = |tunables: &str| {
        let ran = desk.command("thrown.toml --overwrite").env("GLIBC_TUNABLES", tunables).output();
        let ran = ran.unwrap();
        assert!(ran.status.success(), "{}", String::from_utf8_lossy(&ran.stderr));
        ["energy.csv", "blocks.vtkhdf"].map(|name| desk.read(&format!("results/thrown/{name}")))
    };
    assert!(run("") == run("glibc.cpu.hwcaps=-FMA,-FMA4,-AVX2,-AVX512F"));
}

#[test]
fn unwritable_folder_is_refused() {
    let desk = Desk::with(&[SHAKE]);
    desk.write("file", "mine");
    for out in ["file", "file/below"] {
        let outcome = desk.run(&format!("column.toml --out {out}"));
        assert_eq!((outcome.status, outcome.stdout.as_str()), (Some(2), ""));
        assert!(outcome.stderr.contains("give another --out"), "{}", outcome.stderr);
        assert!(!outcome.stderr.contains("panicked"), "{}", outcome.stderr);
    }
    assert_eq!(desk.names(), ["column.toml", "file"]);
    assert_eq!(desk.read("file"), b"mine");
}

#[test]
fn results_of_another_deck_are_not_overwritten() {
    let desk = Desk::with(&[SHAKE]);
    assert_eq!(desk.run("column.toml --out a").status, Some(0));
    let read = || RESULTS.map(|name| desk.read(&format!("a/{name}")));
    let before = read();
    desk.write("other.toml", &(COLUMN.to_owned() + PRESS));
    let outcome = desk.run("other.toml --out a --overwrite");
    assert_eq!(outcome.status, Some(2));
    assert!(outcome.stderr.contains("holds the results of another deck"), "{}", outcome.stderr);
    assert!(outcome.stderr.contains("give another --out, or run without"), "{}", outcome.stderr);
    assert!(before == read());
}

#[test]
fn earlier_results_are_kept_unless_overwritten() {
    let desk = Desk::with(&[SHAKE]);
    let read = |folder: &str| RESULTS.map(|name| desk.read(&format!("results/{folder}/{name}")));
    assert_eq!(desk.run("column.toml").status, Some(0));
    let before = read("column");
    let outcome = desk.run("column.toml");
    let message = "earlier results were moved to results/column.1\n";
    assert!(outcome.status == Some(0) && outcome.stderr.contains(message), "{}", outcome.stderr);
    assert!(before == read("column.1"));
    let outcome = desk.run("column.toml --overwrite");
    assert!(outcome.status == Some(0) && !outcome.stderr.contains("earlier"), "{}", outcome.stderr);
    assert!(!desk.path("results/column.2").exists());
    assert_eq!(desk.run("column.toml --resume --overwrite").status, Some(2));
}

#[test]
fn unconverged_relaxation_fails_and_keeps_results() {
    let stage = PRESS.replace("1e-6", "1e-12\nmax_steps = 20");
    let desk = Desk::with(&[&stage]);
    let outcome = desk.run("column.toml --out a");
    assert_eq!(outcome.status, Some(1), "{}", outcome.stderr);
    let end: Vec<&str> = outcome.stderr.lines().rev().take(2).collect();
    assert_eq!(end[1], "the results up to here are in a");
    assert!(end[0].starts_with("error: stage `press`: not in equilibrium after 20 steps"));
    assert!(desk.read("a/probes.csv").iter().filter(|byte| **byte == b'\n').count() > 1);
}

#[test]
#[cfg(unix)]
fn interrupted_run_resumes_with_same_results() {
    for (stages, interrupted, status) in
        [([PRESS, LONG_SHAKE], "shake (2/2)", 0), ([LONG_PRESS, SHAKE], "press (1/2)", 1)]
    {
        let desk = Desk::with(&stages);
        assert_eq!(desk.run("column.toml --out whole").status, Some(status));

        let outcome = desk.interrupt("column.toml --out parts", interrupted);
        assert_eq!(outcome.status, Some(130), "{}", outcome.stderr);
        assert!(outcome.stderr.contains("stopping at the next step"), "{}", outcome.stderr);
        let last = outcome.stderr.lines().last();
        let checkpoint = Path::new("parts").join("checkpoint.h5");
        let hint = "to continue: ddem column.toml --out=parts --resume";
        assert_eq!(last, Some(&*format!("saved in {}, {hint}", checkpoint.display())));
        assert!(desk.path("parts/checkpoint.h5").exists());

        // Interrupts the run once more, with another number of threads.
        let outcome = desk.interrupt("column.toml --out=parts --resume --threads 1", interrupted);
        assert_eq!(outcome.status, Some(130), "{}", outcome.stderr);
        assert!(outcome.stderr.contains(", from step "), "{}", outcome.stderr);
        let outcome = desk.run("column.toml --out=parts --resume");
        assert_eq!(outcome.status, Some(status), "{}", outcome.stderr);
        for name in ["probes.csv", "energy.csv", "fragments.csv", "frames.csv"] {
            let read = |out: &str| desk.read(&format!("{out}/{name}"));
            assert!(read("whole") == read("parts"), "{interrupted}: {name}");
        }
    }
}

#[test]
#[cfg(unix)]
fn quiet_run_is_interrupted_silently() {
    let desk = Desk::with(&[LONG_SHAKE]);
    let mut child = desk.command("column.toml --quiet --out a").stderr(Stdio::piped()).spawn();
    let child = child.as_mut().unwrap();
    while !desk.path("a/energy.csv").exists() {
        assert!(child.try_wait().unwrap().is_none());
        std::thread::sleep(std::time::Duration::from_millis(10));
    }
    let kill = Command::new("kill").args(["-INT", &child.id().to_string()]).status();
    assert!(kill.unwrap().success());
    let mut stderr = String::new();
    child.stderr.take().unwrap().read_to_string(&mut stderr).unwrap();
    assert_eq!((child.wait().unwrap().code(), stderr.as_str()), (Some(130), ""));
    assert!(desk.path("a/checkpoint.h5").exists());
}

/// One charge in a hole of two cubic metres and one in a joint of one square metre. The report, the
/// log and the summary list both.
#[test]
fn charges_are_listed_before_detonation() {
    let desk = Desk::new();
    let blast = "
[materials.rock]
density = 2400
young = 18e9
poisson = 0.25
[joints.seam]
normal_stiffness = 1e10
shear_stiffness = 1e10
[[blocks]]
size = [4, 4, 3]
count = [4, 4, 3]
divisions = 1
material = 'rock'
joint = 'seam'
[[remove]]
where = { x = [1, 3], y = [1, 2], z = [1, 2] }
[[charge]]
where = { x = [0.9, 3.1], y = [0.9, 2.1], z = [0.9, 2.1] }
mass = 500
explosive = 'tnt'
[[charge]]
where = { x = [0, 1], y = [0, 1], z = 1.0 }
pressure = 2e6
history = { ramp = 1e-3 }
[[stage]]
name = 'blast'
kind = 'dynamic'
duration = 1e-6
";
    desk.write("blast.toml", blast);
    let outcome = desk.run("blast.toml --check");
    assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(0), ""));
    // 10.50 GPa (250/1630)^2.727
    let charges = [
        "10 walls, 2.0000e0 m³, 500 kg (250.0 of 1630 kg/m³), begins with 6.321e7 Pa",
        "1 joint, 1.0000e0 m², history of 2.000e6 Pa",
    ];
    for (index, charge) in charges.iter().enumerate() {
        let line = format!("charge {index}       {charge}");
        assert!(outcome.stdout.lines().any(|other| other == line), "{}", outcome.stdout);
    }
    let outcome = desk.run("blast.toml");
    assert_eq!(outcome.status, Some(0), "{}", outcome.stderr);
    let log: Vec<&str> = outcome.stderr.lines().collect();
    assert_eq!(log[1..3], [0, 1].map(|i| format!("charge {i}: {}", charges[i])));
    let summary: serde_json::Value =
        serde_json::from_slice(&desk.read("results/blast/summary.json")).unwrap();
    let charge = &summary["charges"][0];
    assert_eq!((&charge["walls"], &charge["mass"]), (&10.into(), &500.0.into()));
    assert!((charge["filling"].as_f64().unwrap() - 250.0).abs() < 1e-9, "{charge}");
    assert_eq!(summary["charges"][1]["mass"], serde_json::Value::Null);
}

/// The estimate counts work of the first step alone only once; in this model all joints fail in
/// that step.
#[test]
fn time_estimate_counts_first_step_once() {
    let desk = Desk::new();
    let stage = "[[stage]]\nname = 'apart'\nkind = 'dynamic'\nduration = 2e-3\n";
    let text = COLUMN
        .replace("contact = false", "")
        .replace("[1, 1, 3]", "[10, 10, 10]")
        .replace("z = 3.0", "z = 10.0")
        .replace("material = 'rock'\n[[blocks]]", "material = 'rock'\ntension = 1.0\n[[blocks]]")
        .replace("[1e5, 0.0, -1e6]", "[0.0, 0.0, 1e8]");
    desk.write("apart.toml", &(text + stage));
    let outcome = desk.run("apart.toml --check");
    assert_eq!(outcome.status, Some(0), "{}", outcome.stderr);
    let line = outcome.stdout.lines().find(|line| line.starts_with("stage apart: "));
    let line = line.unwrap_or_else(|| panic!("{}", outcome.stdout));
    let estimate = line.split(" once they fail), about ").nth(1);
    let estimate = estimate.and_then(|rest| rest.strip_suffix(" s while joints hold"));
    let estimate: f64 = estimate.and_then(|s| s.parse().ok()).unwrap_or_else(|| panic!("{line}"));
    let start = std::time::Instant::now();
    let outcome = desk.run("apart.toml");
    assert_eq!(outcome.status, Some(0), "{}", outcome.stderr);
    let took = start.elapsed().as_secs_f64();
    println!("{line}; was {took:.1} s");
    // If each step counted like the first, the estimate would be thirty times as long.
    assert!(estimate < 5.0 * took, "{line}: {took} s");
}
