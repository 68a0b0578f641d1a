//! Tests of rigid blocks and contacts on the command line: errors, warnings and resumed runs.

use super::harness::*;

/// Two rigid blocks, one on the other, each in its own set.
const PAIR: &str = "
[materials.rock]
density = 2400
young = 18e9
poisson = 0.25
[model]
gravity = [0, 0, -9.81]
[[blocks]]
name = 'below'
body = 'rigid'
size = [1, 1, 1]
material = 'rock'
[[blocks]]
name = 'above'
body = 'rigid'
origin = [0.3, 0.2, 1.0]
size = [1, 1, 1]
material = 'rock'
[[fix]]
where = { set = 'below' }
axes = 'xyz'
[[initial]]
where = { set = 'above' }
velocity = [1, 0, -0.5]
[[probe]]
name = 'above'
where = { set = 'above' }
every = 1e-3
[[stage]]
name = 'slide'
kind = 'dynamic'
duration = 0.05
frames = 5
damping = 'none'
";

fn run_changed(change: impl Fn(&str) -> String, arguments: &str) -> RunOutput {
    let desk = Desk::new();
    desk.write("pair.toml", &change(PAIR));
    desk.run(&format!("pair.toml {arguments}"))
}

#[test]
fn overlapping_sets_are_refused_by_name() {
    for arguments in ["", "--check"] {
        let change = |text: &str| text.replace("[0.3, 0.2, 1.0]", "[0.3, 0.2, 0.75]");
        let outcome = run_changed(change, arguments);
        assert_eq!((outcome.status, outcome.stdout.as_str()), (Some(2), ""));
        let message =
            "block [0, 0, 0] of `above` and block [0, 0, 0] of `below` overlap by 2.500e-1 m";
        assert!(outcome.stderr.contains(message), "{}", outcome.stderr);
        assert!(outcome.stderr.contains("blocks[1].origin"), "{}", outcome.stderr);
    }
}

#[test]
fn invalid_contacts_and_rigid_blocks_are_refused() {
    for (from, to, message) in [
        ("[model]", "[contact]\nfriction = 90\n[model]", "`friction` is 90 but must be"),
        (
            "[model]",
            "[contact]\nnormal_stiffness = 0\n[model]",
            "`normal_stiffness` is 0 but must be",
        ),
        ("[model]", "[contact]\nfriktion = 30\n[model]", "did you mean `friction`"),
        (
            "[model]",
            "[contact]\ndamping = 0.1\nrestitution = 0.5\n[model]",
            "cannot be combined with",
        ),
        ("every = 1e-3", "quantity = 'stress'", "rigid"),
    ] {
        let outcome = run_changed(|text| text.replace(from, to), "");
        assert_eq!((outcome.status, outcome.stdout.as_str()), (Some(2), ""), "{to}");
        assert!(outcome.stderr.contains(message), "{to}: {}", outcome.stderr);
    }
}

#[test]
fn doubtful_contacts_and_rigid_blocks_warn() {
    for (from, to, message) in [
        (
            "[model]",
            "[contact]\nnormal_stiffness = 1e18\n[model]",
            "warning: contact.normal_stiffness: 1e18 Pa/m is ",
        ),
        (
            "[model]",
            "[contact]\nnormal_stiffness = 1e5\n[model]",
            "warning: contact.normal_stiffness: under its own weight a block of 2400 kg/m³ sinks 23.5 % of \
             its edge into the one below: contacts have 1.00e5 Pa/m; check the units of `young` (Pa), \
             `density` (kg/m³) and lengths (m), or increase `normal_stiffness` [soft-contact]",
        ),
    ] {
        let outcome = run_changed(|text| text.replacen(from, to, 1), "--check");
        assert_eq!(outcome.status, Some(0), "{}", outcome.stderr);
        assert!(outcome.stderr.starts_with(message), "{to}: {}", outcome.stderr);
    }
    let outcome = run_changed(str::to_owned, "");
    assert_eq!(outcome.status, Some(0), "{}", outcome.stderr);
    assert!(!outcome.stderr.contains("warning"), "{}", outcome.stderr);
}

/// A block that moves too fast stops the run. The error names the block, and the results so far
/// remain.
#[test]
fn too_fast_block_stops_the_run() {
    let desk = Desk::new();
    desk.write("pair.toml", &PAIR.replace("[1, 0, -0.5]", "[3e4, 0, 0]"));
    let outcome = desk.run("pair.toml --out a");
    assert_eq!(outcome.status, Some(1), "{}", outcome.stderr);
    assert!(outcome.stderr.contains("block 1 (set `above`) moved "), "{}", outcome.stderr);
    assert!(outcome.stderr.contains("in step 1, at time "), "{}", outcome.stderr);
    assert!(desk.path("a/energy.csv").exists());
}

#[test]
#[cfg(unix)]
fn interrupted_slide_resumes_with_same_bits() {
    let desk = Desk::new();
    desk.write("pair.toml", &PAIR.replace("duration = 0.05", "duration = 3.0"));
    assert_eq!(desk.run("pair.toml --out whole").status, Some(0));
    let outcome = desk.interrupt("pair.toml --out parts", "slide");
    assert_eq!(outcome.status, Some(130), "{}", outcome.stderr);
    let outcome = desk.run("pair.toml --out parts --resume --threads 2");
    assert_eq!(outcome.status, Some(0), "{}", outcome.stderr);
    for name in ["probes.csv", "energy.csv"] {
        let read = |folder: &str| desk.read(&format!("{folder}/{name}"));
        assert!(read("whole") == read("parts"), "{name}");
    }
}

/// A deck with deformable blocks in the place of rigid ones.
fn soft(text: &str) -> String {
    text.replacen("body = 'rigid'", "divisions = 1", 2)
}

/// A deck with the damping of contacts turned off.
fn undamped(text: &str) -> String {
    text.replacen("[model]", "[contact]\ndamping = 0\n[model]", 1)
}

/// Sliding deformable blocks need some damping; rigid blocks need none.
#[test]
fn undamped_sliding_warns() {
    let doubt = "[undamped-sliding]";
    for (damping, warned) in [("'none'", true), ("{ stiffness = 1e-5 }", false)] {
        let outcome = run_changed(|text| undamped(&soft(text)).replace("'none'", damping), "");
        assert_eq!(outcome.status, Some(0), "{}", outcome.stderr);
        assert_eq!(outcome.stderr.contains(doubt), warned, "{}", outcome.stderr);
    }
    for change in [undamped, soft] {
        assert!(!run_changed(change, "").stderr.contains(doubt));
    }
}

/// Friction dissipates about a third of the energy of blocks thrown by an explosive, but they do
/// not slide steadily.
#[test]
fn blast_gives_no_sliding_warning() {
    let desk = Desk::new();
    let blast = "
[materials.rock]
density = 2400
young = 18e9
poisson = 0.25
[joints.seam]
normal_stiffness = 1e10
shear_stiffness = 1e10
cohesion = 1e6
tension = 1e6
friction = 50
[[blocks]]
size = [5, 5, 5]
count = [5, 5, 5]
divisions = 1
material = 'rock'
joint = 'seam'
[[remove]]
where = { x = [2, 3], y = [2, 3], z = [2, 3] }
[[fix]]
where = { z = 0.0 }
axes = 'xyz'
[[charge]]
where = { x = [1.9, 3.1], y = [1.9, 3.1], z = [1.9, 3.1] }
mass = 500
explosive = 'tnt'
[[stage]]
name = 'blast'
kind = 'dynamic'
duration = 2e-2
";
    desk.write("blast.toml", blast);
    let outcome = desk.run("blast.toml");
    assert_eq!(outcome.status, Some(0), "{}", outcome.stderr);
    assert!(!outcome.stderr.contains("[undamped-sliding]"), "{}", outcome.stderr);
    let table = String::from_utf8(desk.read("results/blast/energy.csv")).unwrap();
    let rows: Vec<Vec<&str>> = table.lines().map(|line| line.split(',').collect()).collect();
    let last = |name: &str| -> f64 {
        let column = rows[0].iter().position(|own| *own == name).unwrap();
        rows.last().unwrap()[column].parse().unwrap()
    };
    assert!(last("friction") > 0.2 * last("kinetic"), "{table}");
}
