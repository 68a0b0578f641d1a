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
fn sets_that_overlap_are_refused_by_name() {
    for arguments in ["", "--check"] {
        let change = |text: &str| text.replace("[0.3, 0.2, 1.0]", "[0.3, 0.2, 0.75]");
        let went = run_changed(change, arguments);
        assert_eq!((went.status, went.stdout.as_str()), (Some(2), ""));
        let message =
            "block [0, 0, 0] of `above` and block [0, 0, 0] of `below` overlap by 2.500e-1 m";
        assert!(went.stderr.contains(message), "{}", went.stderr);
        assert!(went.stderr.contains("blocks[1].origin"), "{}", went.stderr);
    }
}

#[test]
fn mistakes_in_contacts_and_of_rigid_blocks_are_refused() {
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
        let went = run_changed(|text| text.replace(from, to), "");
        assert_eq!((went.status, went.stdout.as_str()), (Some(2), ""), "{to}");
        assert!(went.stderr.contains(message), "{to}: {}", went.stderr);
    }
}

#[test]
fn what_is_doubted_of_contacts_and_rigid_blocks_is_said() {
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
             its edge into the one below: contacts have 1.00e5 Pa/m [soft-contact]",
        ),
    ] {
        let went = run_changed(|text| text.replacen(from, to, 1), "--check");
        assert_eq!(went.status, Some(0), "{}", went.stderr);
        assert!(went.stderr.starts_with(message), "{to}: {}", went.stderr);
    }
    let went = run_changed(str::to_owned, "");
    assert_eq!(went.status, Some(0), "{}", went.stderr);
    assert!(!went.stderr.contains("warning"), "{}", went.stderr);
}

/// A block that moves too fast stops the run. The error names the block, and the results so far
/// remain.
#[test]
fn blocks_that_are_too_fast_stop_the_run() {
    let desk = Desk::new();
    desk.write("pair.toml", &PAIR.replace("[1, 0, -0.5]", "[3e4, 0, 0]"));
    let went = desk.run("pair.toml --out a");
    assert_eq!(went.status, Some(1), "{}", went.stderr);
    assert!(went.stderr.contains("block 1 of `above` moved "), "{}", went.stderr);
    assert!(went.stderr.contains("in step 1, at time "), "{}", went.stderr);
    assert!(desk.path("a/energy.csv").exists());
}

#[test]
#[cfg(unix)]
fn an_interrupted_slide_goes_on_bit_for_bit() {
    let desk = Desk::new();
    desk.write("pair.toml", &PAIR.replace("duration = 0.05", "duration = 3.0"));
    assert_eq!(desk.run("pair.toml --out whole").status, Some(0));
    let went = desk.interrupt("pair.toml --out parts", "slide");
    assert_eq!(went.status, Some(130), "{}", went.stderr);
    let went = desk.run("pair.toml --out parts --resume --threads 2");
    assert_eq!(went.status, Some(0), "{}", went.stderr);
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
fn undamped_blocks_that_slide_are_warned_of() {
    let doubt = "[undamped-sliding]";
    for (damping, warned) in [("'none'", true), ("{ stiffness = 1e-5 }", false)] {
        let went = run_changed(|text| undamped(&soft(text)).replace("'none'", damping), "");
        assert_eq!(went.status, Some(0), "{}", went.stderr);
        assert_eq!(went.stderr.contains(doubt), warned, "{}", went.stderr);
    }
    for change in [undamped, soft] {
        assert!(!run_changed(change, "").stderr.contains(doubt));
    }
}

/// Friction dissipates about a third of the energy of blocks thrown by an explosive, but they do
/// not slide steadily.
#[test]
fn a_blast_is_not_warned_of_as_sliding() {
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
    let went = desk.run("blast.toml");
    assert_eq!(went.status, Some(0), "{}", went.stderr);
    assert!(!went.stderr.contains("[undamped-sliding]"), "{}", went.stderr);
    let table = String::from_utf8(desk.read("results/blast/energy.csv")).unwrap();
    let rows: Vec<Vec<&str>> = table.lines().map(|line| line.split(',').collect()).collect();
    let last = |name: &str| -> f64 {
        let column = rows[0].iter().position(|own| *own == name).unwrap();
        rows.last().unwrap()[column].parse().unwrap()
    };
    assert!(last("friction") > 0.2 * last("kinetic"), "{table}");
}
