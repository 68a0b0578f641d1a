//! Fragments in the results of a run.

use super::harness::*;

/// 27 blocks of 1 m with spring joints; the joints at z = 1 are weak. The lowest layer is held, and
/// the layers above are pulled off it.
const CUBE: &str = "
[materials.rock]
density = 2400
young = 18e9
poisson = 0.25
[joints.seam]
normal_stiffness = 1e10
shear_stiffness = 1e10
[joints.weak]
normal_stiffness = 1e10
shear_stiffness = 1e10
cohesion = 1e5
friction = 30
tension = 1e4
[model]
peaks = true
[[blocks]]
size = [3, 3, 3]
count = [3, 3, 3]
divisions = 1
material = 'rock'
joint = 'seam'
[[assign]]
where = { z = 1.0 }
joint = 'weak'
[[fix]]
where = { z = 0.0 }
axes = 'xyz'
[[fix]]
where = { z = 3.0 }
axes = 'xyz'
velocity = [0, 0, 1]
history = { ramp = 1e-3 }
from = 'pull'
[[stage]]
name = 'rest'
kind = 'relax'
[[stage]]
name = 'pull'
kind = 'dynamic'
duration = 0.02
frames = 4
";

type CsvRow = Vec<String>;

/// Header and rows of a table.
fn table(desk: &Desk, name: &str) -> (CsvRow, Vec<CsvRow>) {
    let text = String::from_utf8(desk.read(name)).unwrap();
    let mut rows = text.lines().map(|line| line.split(',').map(str::to_owned).collect::<CsvRow>());
    (rows.next().unwrap(), rows.collect())
}

#[test]
fn fragments_are_written_at_the_end_of_each_stage() {
    let desk = Desk::new();
    desk.write("cube.toml", CUBE);
    let outcome = desk.run("cube.toml --out a");
    assert_eq!(outcome.status, Some(0), "{}", outcome.stderr);
    let (header, rows) = table(&desk, "a/fragments.csv");
    let expected = "stage,step,time,fragment,blocks,volume,mass,size,passing,centroid.x,centroid.y,\
                    centroid.z,velocity.x,velocity.y,velocity.z";
    assert_eq!(header.join(","), expected);
    let column = |name: &str| header.iter().position(|column| column == name).unwrap();
    let numbers = |name: &str| -> Vec<f64> {
        rows.iter().map(|row| row[column(name)].parse().unwrap()).collect()
    };
    let texts = |name: &str| rows.iter().map(|row| row[column(name)].as_str()).collect::<Vec<_>>();
    assert_eq!(texts("stage"), ["rest", "pull", "pull"]);
    assert_eq!(texts("fragment"), ["0", "0", "1"]);
    assert_eq!(texts("blocks"), ["27", "18", "9"]);
    let close = |name: &str, expected: [f64; 3]| {
        for (found, expected) in numbers(name).into_iter().zip(expected) {
            assert!((found / expected - 1.0).abs() < 1e-12, "{name}: {found}, not {expected}");
        }
    };
    close("volume", [27.0, 18.0, 9.0]);
    close("mass", [27.0, 18.0, 9.0].map(|volume| 2400.0 * volume));
    close("size", [3.0, 18.0_f64.cbrt(), 9.0_f64.cbrt()]);
    close("passing", [1.0, 1.0, 1.0 / 3.0]);
    // The top is pulled at 1 m/s for 20 ms, with a ramp in the first millisecond. The lower
    // fragment hardly moves.
    let [_, above, below] = numbers("centroid.z")[..] else { panic!("three rows") };
    assert!((above - 2.0 - 0.0195).abs() < 1e-3 && (below - 0.5).abs() < 1e-4, "{above} {below}");
    let summary = String::from_utf8(desk.read("a/summary.json")).unwrap();
    let summary: serde_json::Value = serde_json::from_str(&summary).unwrap();
    assert_eq!(summary["fragments"]["number"], 2);
    assert_eq!(summary["fragments"]["largest_volume"].as_f64().map(f64::round), Some(18.0));
}

#[test]
#[cfg(unix)]
fn interrupted_run_writes_each_fragment_once() {
    let desk = Desk::new();
    desk.write("cube.toml", &CUBE.replace("duration = 0.02", "duration = 2.0"));
    assert_eq!(desk.run("cube.toml --out whole").status, Some(0));
    let outcome = desk.interrupt("cube.toml --out parts", "pull");
    assert_eq!(outcome.status, Some(130), "{}", outcome.stderr);
    let outcome = desk.run("cube.toml --out parts --resume --threads 2");
    assert_eq!(outcome.status, Some(0), "{}", outcome.stderr);
    for name in ["fragments.csv", "energy.csv"] {
        let read = |folder: &str| desk.read(&format!("{folder}/{name}"));
        assert!(read("whole") == read("parts"), "{name}");
    }
}
