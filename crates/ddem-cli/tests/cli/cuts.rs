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

/// Two blocks of two cells each.
const RUN: &str = "
[model]
gravity = [0, 0, -9.81]
[materials.rock]
density = 2700.0
young = 10e9
poisson = 0.25
[joints.seam]
normal_stiffness = 5e9
shear_stiffness = 2e9
cohesion = 1e6
friction = 30.0
[[region]]
name = 'rock'
box = { from = [0, 0, 0], to = [1, 2, 3] }
material = 'rock'
[[cut]]
plane = { dip = 30, dip_direction = 90, through = [0.5, 1, 1.5] }
joint = 'seam'
[[cut]]
plane = { dip = 80, dip_direction = 0, through = [0.5, 1, 1.5] }
join = true
[[fix]]
where = { z = 0.0 }
axes = 'xyz'
";

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

/// The list of fractures that a cut writes is one that a cut reads; only decks with fractures have it.
#[test]
fn fractures_are_written_as_a_deck_reads_them() {
    let desk = Desk::new();
    let network = "[[cut]]\nname = 'cracks'\ndfn = { number = 40, size = 1.5, dip = 70, dip_direction = 30, fisher = 5 }\njoint = 'seam'\n";
    let (region, fix) = RUN.split_once("[[cut]]").unwrap();
    assert!(fix.contains("[[fix]]"));
    desk.write("first.toml", &format!("{region}{network}"));
    let file = "[[cut]]\nname = 'cracks'\ndfn = { file = 'results/first-cut/fractures.csv' }\njoint = 'seam'\n";
    desk.write("second.toml", &format!("{region}{file}"));
    for deck in ["first", "second"] {
        let outcome = desk.run(&format!("cut {deck}.toml"));
        assert_eq!(outcome.status, Some(0), "{}", outcome.stderr);
    }
    let table = |name: &str| {
        String::from_utf8(desk.read(&format!("results/{name}-cut/fractures.csv"))).unwrap()
    };
    let (first, second) = (table("first"), table("second"));
    assert_eq!(first.lines().next(), Some("fracture,cut,x,y,z,dip,dip_direction,radius,area"));
    assert_eq!(first.lines().count(), 41);
    for name in ["x", "y", "z", "radius"] {
        assert_eq!(column(&first, name), column(&second, name));
    }
    for name in ["dip", "dip_direction", "area"] {
        let pairs = column(&first, name).into_iter().zip(column(&second, name));
        assert!(pairs.into_iter().all(|(a, b)| (a - b).abs() < 1e-10), "{name}");
    }
    desk.write("whole.toml", region);
    desk.run("cut whole.toml");
    assert!(!desk.path("results/whole-cut/fractures.csv").exists());
}

/// A column of 1 × 2 × 3 m with a free top, cut by a level plane 1 m above its base.
#[test]
fn free_faces_have_their_area() {
    let desk = Desk::new();
    let (region, _) = RUN.split_once("[[cut]]").unwrap();
    let level =
        "[[cut]]\nplane = { dip = 0, dip_direction = 0, through = [0, 0, 1] }\njoint = 'seam'\n";
    desk.write("box.toml", &format!("{region}{level}"));
    desk.run("cut box.toml");
    let csv = String::from_utf8(desk.read("results/box-cut/blocks.csv")).unwrap();
    let by_height = |name: &str| {
        let mut rows: Vec<_> = column(&csv, "z").into_iter().zip(column(&csv, name)).collect();
        rows.sort_by(|a, b| a.0.total_cmp(&b.0));
        rows.into_iter().map(|(_, value)| value).collect::<Vec<_>>()
    };
    assert_eq!(by_height("free_area"), [0.0, 2.0]);
    assert_eq!(by_height("surface"), [10.0, 16.0]);
}

#[test]
fn decks_with_regions_run_with_the_numbers_of_their_blocks() {
    let desk = Desk::new();
    let text = RUN.to_owned() + "[[stage]]\nname = 'rest'\nkind = 'relax'\ntolerance = 1e-6\n";
    desk.write("cells.toml", &text);
    let cut = desk.run("cut cells.toml");
    assert!(cut.stdout.starts_with("4 cells in 2 blocks, "), "{}", cut.stdout);
    desk.write("joined.toml", &format!("{text}[[join]]\nwhere = {{ x = [-9, 9] }}\n"));
    let joined = desk.run("cut joined.toml").stdout;
    assert!(joined.starts_with("4 cells in 1 block, 0 joint faces, "), "{joined}");
    assert!(joined.contains("\njoin[0] leaves 2 joint faces out\n"), "{joined}");
    let outcome = desk.run("cells.toml --check");
    assert_eq!(outcome.status, Some(0), "{}", outcome.stderr);
    assert!(outcome.stdout.contains("blocks         2\n"), "{}", outcome.stdout);
    let outcome = desk.run("cells.toml");
    assert_eq!(outcome.status, Some(0), "{}", outcome.stderr);
    let all = outcome.stdout + &outcome.stderr;
    assert!(all.contains("model: 2 blocks, 256 nodes, 32 pairs"), "{all}");
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

/// A cut warns of thin cells as a check and a run do, unless the deck allows it.
#[test]
fn cut_warns_of_thin_cells() {
    let slab = "[[cut]]\nplane = { dip = 0, dip_direction = 0, through = [0, 0, 0.001] }\njoint = 'seam'\n";
    let stage = "[[stage]]\nname = 'press'\nkind = 'relax'\n";
    let deck = RUN.replace("[[fix]]", &format!("{slab}[[fix]]")) + stage;
    let desk = Desk::new();
    desk.write("thin.toml", &deck);
    desk.write("allowed.toml", &format!("{deck}[lint]\nallow = ['added-inertia']\n"));
    let warnings = |line: &str| {
        let outcome = desk.run(line);
        assert_eq!(outcome.status, Some(0), "{}", outcome.stderr);
        let lines = outcome.stderr.lines().filter(|line| line.starts_with("warning: "));
        lines.map(str::to_owned).collect::<Vec<_>>()
    };
    let cut = warnings("cut thin.toml");
    assert!(matches!(&cut[..], [only] if only.ends_with("[added-inertia]")), "{cut:?}");
    assert_eq!(warnings("thin.toml --check"), cut);
    assert!(warnings("cut allowed.toml").is_empty());
}

/// Deck of about 11 000 cells, which take more than 2 s.
fn many_cells() -> String {
    let (materials, rest) = RUN.split_once("[[region]]").unwrap();
    let (_, fix) = rest.split_once("[[fix]]").unwrap();
    let set = |dip: u32, direction: u32| {
        format!(
            "[[cut]]\nset = {{ dip = {dip}, dip_direction = {direction}, spacing = 1.3 }}\njoint = 'seam'\n"
        )
    };
    let sets = [set(30, 90), set(80, 0), set(70, 250)].concat();
    let region = "[[region]]\nbox = { from = [0, 0, 0], to = [29, 29, 29] }\nmaterial = 'rock'\n";
    let stage = "[[stage]]\nname = 'press'\nkind = 'relax'\n";
    format!("{materials}{region}{sets}[[fix]]{fix}{stage}")
}

/// A model that takes long shows what it does, without a terminal by lines.
#[test]
fn building_of_a_large_model_is_shown() {
    use std::io::{BufRead, BufReader};
    use std::process::Stdio;

    let desk = Desk::new();
    desk.write("many.toml", &many_cells());
    for line in ["many.toml --check", "many.toml", "many.toml --quiet --json"] {
        let mut command = desk.command(line);
        let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        let mut first = String::new();
        if line.contains("json") {
            BufReader::new(child.stdout.take().unwrap()).read_line(&mut first).unwrap();
            assert!(first.starts_with("{\"event\":\"building\""), "{line}: {first}");
        } else {
            BufReader::new(child.stderr.take().unwrap()).read_line(&mut first).unwrap();
            assert!(first.starts_with("building: "), "{line}: {first}");
        }
        child.kill().unwrap();
        child.wait().unwrap();
    }
}

/// Ctrl-C ends the program while it builds a model, and not after that.
#[test]
#[cfg(unix)]
fn interrupt_of_building_writes_nothing() {
    use std::io::{BufRead, BufReader, Read};
    use std::process::{Command, Stdio};

    let desk = Desk::new();
    desk.write("many.toml", &many_cells());
    let mut command = desk.command("many.toml --json --out a");
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
    let first = lines.next().unwrap().unwrap();
    assert!(first.starts_with("{\"event\":\"building\""), "{first}");
    let kill = Command::new("kill").args(["-INT", &child.id().to_string()]).status();
    assert!(kill.unwrap().success());
    assert_eq!(child.wait().unwrap().code(), Some(130));
    let last = lines.last().unwrap().unwrap();
    assert!(last.starts_with("{\"event\":\"end\"") && last.contains("interrupted"), "{last}");
    let mut told = String::new();
    child.stderr.take().unwrap().read_to_string(&mut told).unwrap();
    insta::assert_snapshot!(told.lines().last().unwrap_or_default());
    assert!(!desk.path("a").exists());
}

/// The check predicts the peak memory of a relaxation of some 600 cells, the program itself included.
#[test]
#[cfg(target_os = "linux")]
fn check_predicts_the_memory_of_cells() {
    let cuts: String = [[20, 100], [75, 265], [80, 5]]
        .iter()
        .map(|[dip, direction]| {
            format!(
                "[[cut]]\njoint = 'seam'\n\
                 set = {{ dip = {dip}, dip_direction = {direction}, fisher = 300, spacing = 1.1 }}\n"
            )
        })
        .collect();
    let deck = format!(
        "model.gravity = [0, 0, -9.81]\n\
         materials.rock = {{ density = 2400, young = 18e9, poisson = 0.25 }}\n\
         joints.seam = {{ normal_stiffness = 2e10, shear_stiffness = 7e9 }}\n\
         [[region]]\nbox = {{ from = [0, 0, 0], to = [8, 8, 8] }}\nmaterial = 'rock'\n{cuts}\
         [[fix]]\nwhere = {{ z = 0.0 }}\naxes = 'xyz'\n\
         [[stage]]\nname = 'rest'\nkind = 'relax'\ntolerance = 0.5\n"
    );
    let desk = Desk::new();
    desk.write("rock.toml", &deck);
    let check = desk.run("rock.toml --check");
    let line = check.stdout.lines().find_map(|line| line.strip_prefix("memory  ")).unwrap();
    let predicted: f64 = line.trim().strip_suffix(" MB").unwrap().parse().unwrap();
    assert_eq!(desk.run("rock.toml --threads 2 --out a").status, Some(0));
    let summary: serde_json::Value = serde_json::from_slice(&desk.read("a/summary.json")).unwrap();
    let peak = 1e-6 * summary["peak_memory_bytes"].as_f64().unwrap();
    assert!((0.7..1.4).contains(&(peak / predicted)), "{peak} MB, predicted {predicted} MB");
}
