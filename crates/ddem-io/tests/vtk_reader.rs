//! Checks that VTK's own reader finds the written values in the result files.
//!
//! The tests run `tests/vtk/check_vtkhdf.py` with the interpreter named by `DDEM_PYTHON`, which
//! needs the packages `vtk` and `numpy`.

use std::ffi::{OsStr, OsString};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::process::Command;

use ddem_io::vtkhdf::{Cells, Constant, FieldSpec, Grid, Location, NumberType, PointOwner, Writer};
use serde_json::{Value, json};

/// The interpreter, or `None` after a message that VTK was not used.
fn python() -> Option<OsString> {
    let python = std::env::var_os("DDEM_PYTHON").filter(|p| !p.is_empty());
    if python.is_none() {
        eprintln!("NOT CHECKED WITH VTK: set DDEM_PYTHON to a Python that has vtk and numpy");
    }
    python
}

/// Contents of a file as read by VTK.
fn vtk(python: &OsStr, file: &Path) -> Value {
    let script = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../tests/vtk/check_vtkhdf.py");
    // Tests run in parallel, and a process started while another test writes inherits its lock.
    let mut command = Command::new(python);
    command.arg(script).arg(file).env("HDF5_USE_FILE_LOCKING", "FALSE");
    let out = command.output().expect("the interpreter runs");
    let (stdout, stderr) =
        (String::from_utf8_lossy(&out.stdout), String::from_utf8_lossy(&out.stderr));
    assert!(out.status.success(), "{}: {stderr}{stdout}", file.display());
    assert!(stderr.is_empty(), "{}: {stderr}", file.display());
    serde_json::from_str(&stdout).expect("the script prints JSON")
}

/// Compares an array as read by VTK with the written numbers.
fn assert_array(seen: &Value, components: usize, written: &[f64]) {
    let numbered = written.iter().enumerate().map(|(i, &v)| ((i + 1) as f64, v));
    let kept: Vec<(f64, f64)> = numbered.filter(|(_, v)| v.is_finite()).collect();
    assert_eq!(seen["components"], components);
    assert_eq!(seen["rows"], written.len() / components);
    assert_eq!(seen["nan"], written.len() - kept.len());
    let close = |key: &str, want: f64, size: f64| {
        let have = seen[key].as_f64().unwrap_or(0.0);
        assert!((have - want).abs() <= 1e-12 * size, "{key}: {have} instead of {want}");
    };
    let sum = |f: &dyn Fn(f64, f64) -> f64| kept.iter().map(|&(i, v)| f(i, v)).sum::<f64>();
    close("sum", sum(&|_, v| v), sum(&|_, v| v.abs()));
    close("weighted", sum(&|i, v| i * v), sum(&|i, v| i * v.abs()));
    if let Some(&(_, first)) = kept.first() {
        let (min, max) = kept.iter().fold((first, first), |(a, b), &(_, v)| (a.min(v), b.max(v)));
        // The JSON reader may be off by the last bit.
        close("min", min, min.abs());
        close("max", max, max.abs());
    }
}

/// `n` separate unit cubes in a row, like the blocks of a model.
fn cubes(n: u32) -> Grid {
    const SQUARE: [[f64; 2]; 4] = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    let corner = |b: u32, i: usize| {
        let [x, y] = SQUARE[i % 4];
        [x + 1.1 * f64::from(b), y, (i / 4) as f64]
    };
    let points = (0..n).flat_map(|b| (0..8).map(move |i| corner(b, i))).collect();
    let cells = (0..n).map(|b| std::array::from_fn(|i| 8 * b + i as u32)).collect();
    Grid { points, cells: Cells::Hexahedra(cells) }
}

/// `n` squares between the cubes, like joints.
fn squares(n: u32) -> Grid {
    let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    let square = |j: u32| corners.map(|[y, z]| [1.05 + 1.1 * f64::from(j), y, z]);
    let cells = (0..n).map(|j| std::array::from_fn(|i| 4 * j + i as u32)).collect();
    Grid { points: (0..n).flat_map(square).collect(), cells: Cells::Quads(cells) }
}

/// Numbers without a pattern, different for each field and step.
fn noise(seed: usize, n: usize) -> Vec<f64> {
    (0..n).map(|i| ((i * 7919 + seed * 104_729) as f64).sin() * 1e6).collect()
}

fn blocks_fields() -> [FieldSpec; 3] {
    [
        FieldSpec::point("displacement", 3),
        FieldSpec::point("velocity", 3),
        FieldSpec::cell("stress", 6),
    ]
}

fn blocks_values(step: usize, grid: &Grid) -> [Vec<f64>; 3] {
    let sizes = [3 * grid.points.len(), 3 * grid.points.len(), 6 * grid.cells.len()];
    std::array::from_fn(|field| noise(10 * step + field, sizes[field]))
}

fn append_blocks(writer: &mut Writer, step: usize, grid: &Grid) {
    let values = blocks_values(step, grid);
    append(writer, step as f64 * 0.125, (&blocks_fields(), None), &values);
}

fn append(
    writer: &mut Writer,
    time: f64,
    (fields, points): (&[FieldSpec], Option<Vec<[f64; 3]>>),
    values: &[Vec<f64>],
) {
    let fill = &mut |field: usize, rows: Range<usize>, out: &mut [f64]| {
        let n = fields[field].components;
        out.copy_from_slice(&values[field][n * rows.start..n * rows.end]);
    };
    writer.append(time, points, fill).unwrap();
}

fn create_blocks(path: &Path, grid: &Grid) -> Writer {
    let ids: Vec<i32> = (0..grid.cells.len() as i32).collect();
    let constants =
        ["block", "material"].map(|name| Constant { name, location: Location::Cell, values: &ids });
    Writer::create(path, grid, &constants, &blocks_fields()).unwrap()
}

fn assert_blocks(seen: &Value, steps: usize, grid: &Grid) {
    let times: Vec<f64> = (0..steps).map(|s| s as f64 * 0.125).collect();
    // VTK reports no time for a file with a single step.
    let times = if steps == 1 { Vec::new() } else { times };
    assert_eq!(seen["times"], json!(times));
    let count = |n: usize| (0..n).map(|i| i as f64).collect::<Vec<_>>();
    for (step, seen) in seen["steps"].as_array().unwrap().iter().enumerate() {
        assert_eq!(seen["points"], grid.points.len());
        assert_eq!(seen["cells"], grid.cells.len());
        assert_eq!(seen["cell_types"], json!([12]));
        assert_array(&seen["coordinates"], 3, grid.points.as_flattened());
        assert_array(&seen["connectivity"], 1, &count(grid.points.len()));
        let [displacement, velocity, stress] = blocks_values(step, grid);
        assert_array(&seen["point_data"]["displacement"], 3, &displacement);
        assert_array(&seen["point_data"]["velocity"], 3, &velocity);
        assert_array(&seen["cell_data"]["stress"], 6, &stress);
        assert_array(&seen["cell_data"]["block"], 1, &count(grid.cells.len()));
        assert_array(&seen["cell_data"]["material"], 1, &count(grid.cells.len()));
    }
}

#[test]
fn vtk_reads_blocks() {
    let Some(python) = python() else { return };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("blocks.vtkhdf");
    let grid = cubes(27);
    let mut writer = create_blocks(&path, &grid);
    for step in 0..4 {
        append_blocks(&mut writer, step, &grid);
        assert_blocks(&vtk(&python, &path), step + 1, &grid);
    }
}

/// More rows than one chunk, which cannot be split evenly.
#[test]
fn vtk_reads_blocks_over_several_chunks() {
    let Some(python) = python() else { return };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("blocks.vtkhdf");
    let grid = cubes(8209);
    let mut writer = create_blocks(&path, &grid);
    (0..3).for_each(|step| append_blocks(&mut writer, step, &grid));
    assert_blocks(&vtk(&python, &path), 3, &grid);
}

#[test]
fn vtk_reads_blocks_after_resume() {
    let Some(python) = python() else { return };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("blocks.vtkhdf");
    let grid = cubes(5);
    let mut writer = create_blocks(&path, &grid);
    // The last two steps are later than the checkpoint and must be removed.
    [0, 1].into_iter().for_each(|step| append_blocks(&mut writer, step, &grid));
    let savepoint = writer.savepoint().unwrap();
    [7, 8].into_iter().for_each(|step| append_blocks(&mut writer, step, &grid));
    let mut writer = Writer::reopen(&path, PointOwner::Mesh, &blocks_fields(), &savepoint).unwrap();
    assert_blocks(&vtk(&python, &path), 2, &grid);
    (2..5).for_each(|step| append_blocks(&mut writer, step, &grid));
    assert_blocks(&vtk(&python, &path), 5, &grid);
}

#[test]
fn vtk_reads_joints() {
    let Some(python) = python() else { return };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("joints.vtkhdf");
    let grid = squares(9);
    let n = grid.points.len();
    let joint: Vec<i32> = (0..n as i32).map(|i| i / 4).collect();
    let constants = [Constant { name: "joint", location: Location::Point, values: &joint }];
    let fields = [
        FieldSpec::point("state", 1).kind(NumberType::U8),
        FieldSpec::point("failure_time", 1),
        FieldSpec::point("traction", 3),
        FieldSpec::point("side", 1).kind(NumberType::I32),
    ];
    let mut writer = Writer::create(&path, &grid, &constants, &fields).unwrap();
    let state = |step: usize| (0..n).map(|i| ((i + step) % 3) as u8).collect::<Vec<_>>();
    let failure = |step: usize| {
        let time = |i: usize| if (i + step).is_multiple_of(3) { f64::NAN } else { i as f64 };
        (0..n).map(time).collect::<Vec<_>>()
    };
    for step in 0..3 {
        let state = state(step).into_iter().map(f64::from).collect();
        let sides = joint.iter().map(|&joint| f64::from(joint)).collect();
        let values = [state, failure(step), noise(step, 3 * n), sides];
        append(&mut writer, step as f64, (&fields, None), &values);
    }
    let seen = vtk(&python, &path);
    assert_eq!(seen["times"], json!([0.0, 1.0, 2.0]));
    let joint: Vec<f64> = joint.into_iter().map(f64::from).collect();
    for (step, seen) in seen["steps"].as_array().unwrap().iter().enumerate() {
        assert_eq!(seen["cell_types"], json!([9]));
        let data = &seen["point_data"];
        assert_eq!(data["state"]["type"], "uint8");
        assert_eq!(data["joint"]["type"], "int32");
        let state: Vec<f64> = state(step).into_iter().map(f64::from).collect();
        assert_array(&data["state"], 1, &state);
        assert_array(&data["failure_time"], 1, &failure(step));
        assert_array(&data["traction"], 3, &noise(step, 3 * n));
        assert_array(&data["joint"], 1, &joint);
        assert_array(&data["side"], 1, &joint);
    }
}

/// Points whose number differs at each step and is 0 at some.
#[test]
fn vtk_reads_contacts() {
    let Some(python) = python() else { return };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("contacts.vtkhdf");
    let fields = [
        FieldSpec::point("force", 3),
        FieldSpec::point("gap", 1),
        FieldSpec::point("sliding", 1).kind(NumberType::U8),
        FieldSpec::point("blocks", 2).kind(NumberType::I32),
    ];
    let sizes = [0, 5, 0, 9001, 3, 12, 0];
    let points = |step: usize| noise(step, 3 * sizes[step]);
    let append = |writer: &mut Writer, step: usize| {
        let n = sizes[step];
        let (force, gap) = (noise(10 + step, 3 * n), noise(20 + step, n));
        let values = [force, gap, vec![step as f64; n], vec![step as f64; 2 * n]];
        let points = points(step).as_chunks().0.to_vec();
        append(writer, step as f64 * 0.125, (&fields, Some(points)), &values);
    };
    let mut writer = Writer::create_cloud(&path, &fields).unwrap();
    (0..4).for_each(|step| append(&mut writer, step));
    let savepoint = writer.savepoint().unwrap();
    append(&mut writer, 4);
    let mut writer = Writer::reopen(&path, PointOwner::Step, &fields, &savepoint).unwrap();
    (4..7).for_each(|step| append(&mut writer, step));
    let seen = vtk(&python, &path);
    let times: Vec<f64> = (0..7).map(|step| f64::from(step) * 0.125).collect();
    assert_eq!(seen["times"], json!(times));
    for (step, seen) in seen["steps"].as_array().unwrap().iter().enumerate() {
        let n = sizes[step];
        assert_eq!((&seen["points"], &seen["cells"]), (&json!(n), &json!(n)), "{step}");
        if n == 0 {
            continue;
        }
        assert_eq!(seen["cell_types"], json!([1]));
        assert_array(&seen["coordinates"], 3, &points(step));
        let numbers: Vec<f64> = (0..n).map(|i| i as f64).collect();
        assert_array(&seen["connectivity"], 1, &numbers);
        let data = &seen["point_data"];
        assert_array(&data["force"], 3, &noise(10 + step, 3 * n));
        assert_array(&data["gap"], 1, &noise(20 + step, n));
        assert_array(&data["sliding"], 1, &vec![step as f64; n]);
        assert_array(&data["blocks"], 2, &vec![step as f64; 2 * n]);
    }
}
