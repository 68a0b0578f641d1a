use std::ops::Range;
use std::sync::Mutex;

use hdf5::filters::Filter;

use super::create::{chunk, stride};
use super::*;
use crate::OutputError;

fn grid() -> Grid {
    let point = |i: u32| [f64::from(i), 0.5, -1.0];
    let cells = Cells::Hexahedra(vec![[0, 1, 2, 3, 4, 5, 6, 7], [4, 5, 6, 7, 8, 9, 10, 11]]);
    Grid { points: (0..12).map(point).collect(), cells }
}

fn fields() -> [FieldSpec; 3] {
    [
        FieldSpec::point("velocity", 3),
        FieldSpec::cell("stress", 6).uncompressed(),
        FieldSpec::point("state", 1).kind(NumberType::U8),
    ]
}

fn append(writer: &mut Writer, step: usize) -> Result<(), OutputError> {
    let state = vec![step as f64; 12];
    let wholes = [values(step, 36), values(step + 100, 12), state];
    writer.append(step as f64 / 3.0, None, &|field, rows, out| {
        out.copy_from_slice(part(&wholes[field], rows, fields()[field].components));
    })?;
    Ok(())
}

/// Some rows of values.
fn part(values: &[f64], rows: Range<usize>, components: usize) -> &[f64] {
    &values[components * rows.start..components * rows.end]
}

fn values(seed: usize, n: usize) -> Vec<f64> {
    (0..n).map(|i| ((i + 31 * seed) as f64).sqrt()).collect()
}

fn assert_steps(path: &std::path::Path, steps: &[usize]) {
    let results = Results::open(path).unwrap();
    let times: Vec<f64> = steps.iter().map(|&s| s as f64 / 3.0).collect();
    assert_eq!(results.times().unwrap(), times);
    for (i, &step) in steps.iter().enumerate() {
        let velocity = results.field("velocity", i).unwrap();
        assert_eq!((velocity.location, velocity.components), (Location::Point, 3));
        assert_eq!(velocity.values, values(step, 36));
        let stress = results.field("stress", i).unwrap();
        assert_eq!((stress.location, stress.components), (Location::Cell, 6));
        assert_eq!(stress.values, values(step + 100, 12));
        assert_eq!(results.field("state", i).unwrap().values, [step as f64; 12]);
    }
}

#[test]
fn written_values_are_read_back() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.vtkhdf");
    let block = Constant { name: "block", location: Location::Cell, values: &[7, -8] };
    let mut writer = Writer::create(&path, &grid(), &[block], &fields()).unwrap();
    assert_steps(&path, &[]);
    for step in 0..5 {
        append(&mut writer, step).unwrap();
        // The file is readable while the writer exists, as after a crash of its process.
        assert_steps(&path, &(0..=step).collect::<Vec<_>>());
    }
    assert_eq!(writer.steps(), 5);
    writer.sync().unwrap();
    let results = Results::open(&path).unwrap();
    assert_eq!(results.points(4).unwrap(), grid().points);
    assert_eq!(results.field("block", 4).unwrap().values, [7.0, -8.0]);
    assert_eq!(results.names(Location::Cell).unwrap(), ["block", "stress"]);
}

#[test]
fn reopened_files_forget_later_steps() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.vtkhdf");
    let mut writer = Writer::create(&path, &grid(), &[], &fields()).unwrap();
    let empty = writer.savepoint().unwrap();
    (0..2).for_each(|step| append(&mut writer, step).unwrap());
    let savepoint = writer.savepoint().unwrap();
    (2..6).for_each(|step| append(&mut writer, step).unwrap());
    let mut writer = Writer::reopen(&path, PointOwner::Mesh, &fields(), &savepoint).unwrap();
    assert_eq!(writer.steps(), 2);
    assert_steps(&path, &[0, 1]);
    [9, 8].into_iter().for_each(|step| append(&mut writer, step).unwrap());
    assert_steps(&path, &[0, 1, 9, 8]);
    let mut writer = Writer::reopen(&path, PointOwner::Mesh, &fields(), &empty).unwrap();
    append(&mut writer, 4).unwrap();
    assert_steps(&path, &[4]);
}

#[test]
fn reopening_needs_the_same_fields() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.vtkhdf");
    let mut writer = Writer::create(&path, &grid(), &[], &fields()).unwrap();
    append(&mut writer, 0).unwrap();
    let savepoint = writer.savepoint().unwrap();
    let others = [FieldSpec::point("velocity", 2), FieldSpec::cell("velocity", 3)];
    for other in others.into_iter().chain([FieldSpec::point("state", 1)]) {
        let error = Writer::reopen(&path, PointOwner::Mesh, &[other], &savepoint).unwrap_err();
        assert!(matches!(error, OutputError::Unusable { .. }), "{error}");
    }
    assert_steps(&path, &[0]);
}

/// A viewer holds a lock while it reads; the run continues.
#[test]
fn locked_file_is_still_written() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.vtkhdf");
    let mut writer = Writer::create(&path, &grid(), &[], &fields()).unwrap();
    append(&mut writer, 0).unwrap();
    let viewer = std::fs::File::open(&path).unwrap();
    viewer.lock_shared().unwrap();
    append(&mut writer, 1).unwrap();
    assert_steps(&path, &[0, 1]);
    append(&mut writer, 2).unwrap();
    assert_steps(&path, &[0, 1, 2]);
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
}

#[test]
fn all_fields_have_checksums_and_some_are_compressed() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.vtkhdf");
    Writer::create(&path, &grid(), &[], &fields()).unwrap();
    let file = hdf5::File::open(&path).unwrap();
    for field in fields() {
        let name = format!("VTKHDF/{}/{}", field.location.group(), field.name);
        let filters = file.dataset(&name).unwrap().filters();
        assert!(filters.contains(&Filter::Fletcher32), "{name}");
        let compressed = filters.iter().any(|filter| matches!(filter, Filter::Deflate(_)));
        assert_eq!(compressed, field.compressed, "{name}");
    }
}

#[test]
fn points_outside_mesh_are_refused_without_trace() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.vtkhdf");
    let mut writer = Writer::create(&path, &grid(), &[], &[FieldSpec::point("u", 1)]).unwrap();
    let error = writer.append(0.0, Some(Vec::new()), &|_, _, _| ()).unwrap_err();
    assert!(matches!(error, OutputError::Mismatch { .. }), "{error}");
    assert!(Results::open(&path).unwrap().times().unwrap().is_empty());
}

#[test]
fn wrong_meshes_and_names_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.vtkhdf");
    let beyond = Grid { points: vec![[0.0; 3]; 7], ..grid() };
    assert!(Writer::create(&path, &beyond, &[], &[]).is_err());
    let short = Constant { name: "block", location: Location::Cell, values: &[1] };
    assert!(Writer::create(&path, &grid(), &[short], &[]).is_err());
    for name in ["", ".", "a/b", "a\0b"] {
        assert!(Writer::create(&path, &grid(), &[], &[FieldSpec::point(name, 1)]).is_err());
    }
    let twice = [FieldSpec::point("u", 1), FieldSpec::point("u", 3)];
    assert!(Writer::create(&path, &grid(), &[], &twice).is_err());
    assert!(Writer::create(&path, &grid(), &[], &[FieldSpec::point("u", 0)]).is_err());
    assert!(!path.exists());
}

#[test]
fn other_files_and_missing_things_are_errors() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.vtkhdf");
    assert!(matches!(Results::open(&path), Err(OutputError::Io { .. })));
    std::fs::write(&path, "not a mesh").unwrap();
    let error = Results::open(&path).unwrap_err();
    assert!(matches!(error, OutputError::Unusable { .. }), "{error}");
    let other = folder.path().join("b.vtkhdf");
    let savepoint = Writer::create(&other, &grid(), &[], &[]).unwrap().savepoint().unwrap();
    assert!(Writer::reopen(&path, PointOwner::Mesh, &[], &savepoint).is_err());
    let mut writer = Writer::create(&path, &grid(), &[], &fields()).unwrap();
    append(&mut writer, 0).unwrap();
    let results = Results::open(&path).unwrap();
    let error = results.field("pressure", 0).unwrap_err().to_string();
    assert!(error.contains("a.vtkhdf") && error.contains("`pressure`"), "{error}");
    assert!(results.field("stress", 1).unwrap_err().to_string().contains("step 1"));
}

#[test]
fn steps_fill_their_chunks() {
    assert_eq!([0, 1, 8, 65_536].map(chunk), [1, 1, 8, 65_536]);
    assert_eq!(chunk(1_000_000), 62_500);
    assert_eq!([65_537, 200_001].map(stride), [65_538, 200_004]);
    for rows in [65_672, 123_457, 3_000_017] {
        assert!((32 * 1024..=64 * 1024).contains(&chunk(rows)), "{rows}");
        assert!(stride(rows) < rows + rows.div_ceil(chunk(rows)), "{rows}");
    }
}

/// Points of a step, and values of its two fields.
fn cloud(step: usize) -> (Vec<[f64; 3]>, [Vec<f64>; 2]) {
    let n = [0, 3, 0, 5000, 7, 1][step % 6];
    let points = (0..n).map(|i| [i as f64, step as f64, -0.5]).collect();
    let blocks = (0..2 * n).map(|i| (10 * step + i) as f64).collect();
    (points, [values(step, 3 * n), blocks])
}

fn cloud_fields() -> [FieldSpec; 2] {
    [FieldSpec::point("force", 3), FieldSpec::point("blocks", 2).kind(NumberType::I32)]
}

fn append_cloud(writer: &mut Writer, step: usize) {
    let (points, wholes) = cloud(step);
    let fill: WriteRows<'_> = &|field, rows, out| {
        out.copy_from_slice(part(&wholes[field], rows, cloud_fields()[field].components));
    };
    writer.append(step as f64 / 3.0, Some(points), fill).unwrap();
}

fn assert_clouds(path: &std::path::Path, steps: &[usize]) {
    let results = Results::open(path).unwrap();
    let times: Vec<f64> = steps.iter().map(|&s| s as f64 / 3.0).collect();
    assert_eq!(results.times().unwrap(), times);
    for (i, &step) in steps.iter().enumerate() {
        let (points, [force, blocks]) = cloud(step);
        assert_eq!(results.points(i).unwrap(), points);
        assert_eq!(results.field("force", i).unwrap().values, force);
        assert_eq!(results.field("blocks", i).unwrap().values, blocks);
    }
}

#[test]
fn clouds_may_change_points_each_step() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.vtkhdf");
    let mut writer = Writer::create_cloud(&path, &cloud_fields()).unwrap();
    assert_clouds(&path, &[]);
    let mut savepoints = vec![writer.savepoint().unwrap()];
    for step in 0..6 {
        append_cloud(&mut writer, step);
        assert_clouds(&path, &(0..=step).collect::<Vec<_>>());
        savepoints.push(writer.savepoint().unwrap());
    }
    assert_eq!(writer.steps(), 6);
    for (steps, more) in [(4, 5), (2, 3), (1, 4), (0, 1)] {
        let fields = cloud_fields();
        let mut writer =
            Writer::reopen(&path, PointOwner::Step, &fields, &savepoints[steps]).unwrap();
        append_cloud(&mut writer, more);
        assert_clouds(&path, &(0..steps).chain([more]).collect::<Vec<_>>());
    }
    let other = [FieldSpec::point("gap", 1)];
    let error = Writer::reopen(&path, PointOwner::Step, &other, &savepoints[0]).unwrap_err();
    assert!(matches!(error, OutputError::Unusable { .. }), "{error}");
    assert!(Writer::create_cloud(&path, &[FieldSpec::cell("u", 1)]).is_err());
    let error = writer.append(0.0, None, &|_, _, _| ()).unwrap_err();
    assert!(matches!(error, OutputError::Mismatch { .. }), "{error}");
}

/// Steps that end within a chunk.
#[test]
fn pieces_are_whole_chunks_and_cover_the_field() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.vtkhdf");
    let n_rows = 200_001;
    let grid = Grid { points: vec![[0.0; 3]; n_rows], cells: Cells::Quads(Vec::new()) };
    let fields = [
        FieldSpec::point("six", 6),
        FieldSpec::point("one", 1),
        FieldSpec::point("blocks", 2).kind(NumberType::I32),
        FieldSpec::point("open", 1).kind(NumberType::U8),
    ];
    let mut writer = Writer::create(&path, &grid, &[], &fields).unwrap();
    let number = |field, step, at: usize| match field {
        0 | 1 => ((7 * at + step) as f64).sqrt(),
        2 => (at + step) as f64 - 1000.0,
        _ => ((at + step) % 2) as f64,
    };
    for step in 0..3 {
        let ends = Mutex::new(vec![0; fields.len()]);
        let fill: WriteRows<'_> = &|field, rows, out| {
            let n = fields[field].components;
            let end = &mut ends.lock().unwrap()[field];
            assert_eq!((rows.start, out.len()), (*end, n * rows.len()));
            *end = rows.end;
            assert!(rows.end == n_rows || rows.end.is_multiple_of(chunk(n_rows)));
            out.iter_mut()
                .zip(n * rows.start..)
                .for_each(|(out, at)| *out = number(field, step, at));
        };
        writer.append(step as f64, None, fill).unwrap();
        assert_eq!(*ends.lock().unwrap(), [n_rows; 4]);
    }
    let results = Results::open(&path).unwrap();
    for (step, (at, field)) in
        (0..3).flat_map(|step| fields.iter().enumerate().map(move |f| (step, f)))
    {
        let whole: Vec<f64> = (0..n_rows * field.components).map(|i| number(at, step, i)).collect();
        assert!(results.field(&field.name, step).unwrap().values == whole, "{} {step}", field.name);
    }
}

/// Message about a file, with its name only.
fn message<T>(done: Result<T, OutputError>) -> String {
    let error = done.err().unwrap_or_else(|| panic!("no error"));
    let folder = error.path().parent().unwrap().display().to_string();
    error.to_string().replace(&format!("{folder}/"), "")
}

#[test]
fn refused_meshes_and_fields() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.vtkhdf");
    let create = |constants: &[Constant<'_>], fields: &[FieldSpec]| {
        message(Writer::create(&path, &grid(), constants, fields))
    };
    let block = |values| Constant { name: "block", location: Location::Cell, values };
    let mut cut = grid();
    cut.points.truncate(9);
    let mut found = vec![
        message(Writer::create(&path, &cut, &[], &[])),
        create(&[block(&[7])], &[]),
        create(&[block(&[7, 8])], &[FieldSpec::cell("block", 1)]),
        create(&[], &[FieldSpec::point("a/b", 1)]),
        create(&[], &[FieldSpec::point("u", 0)]),
        message(Writer::create_cloud(&path, &[FieldSpec::cell("u", 1)])),
    ];
    let mut writer = Writer::create(&path, &grid(), &[], &[]).unwrap();
    found.push(message(writer.append(0.0, Some(Vec::new()), &|_, _, _| ())));
    let mut writer = Writer::create_cloud(&path, &[]).unwrap();
    found.push(message(writer.append(0.0, None, &|_, _, _| ())));
    insta::assert_snapshot!(found.join("\n"));
}

/// Message about a file with two steps after a change; `read` has its writer and its savepoint.
fn damaged(
    change: impl FnOnce(&std::path::Path),
    read: &dyn Fn(Writer, Savepoint) -> String,
) -> String {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.vtkhdf");
    let mut writer = Writer::create(&path, &grid(), &[], &fields()).unwrap();
    (0..2).for_each(|step| append(&mut writer, step).unwrap());
    let savepoint = writer.savepoint().unwrap();
    change(&path);
    read(writer, savepoint)
}

/// Change of the arrays of a file.
fn arrays(change: impl FnOnce(&hdf5::Group)) -> impl FnOnce(&std::path::Path) {
    move |path| {
        let file = hdf5::File::open_rw(path).unwrap();
        change(&file.group("VTKHDF").unwrap());
        file.close().unwrap();
    }
}

#[test]
fn damaged_files() {
    let reopen = |writer: &Writer, savepoint: &Savepoint, fields: &[FieldSpec]| {
        message(Writer::reopen(writer.path(), PointOwner::Mesh, fields, savepoint))
    };
    let reopened = |writer: Writer, savepoint| reopen(&writer, &savepoint, &fields());
    let with_others =
        |writer: Writer, savepoint| reopen(&writer, &savepoint, &[FieldSpec::cell("u", 1)]);
    let appended = |mut writer: Writer, _| message(append(&mut writer, 2));
    let saved = |writer: Writer, _| message(writer.savepoint());
    let field = |name: &'static str, step| {
        move |writer: Writer, _| message(Results::open(writer.path()).unwrap().field(name, step))
    };
    let cut = |path: &std::path::Path| {
        std::fs::File::options().write(true).open(path).unwrap().set_len(9000).unwrap();
    };
    let replace = |root: &hdf5::Group, name: &str, shape: &[usize]| {
        root.unlink(name).unwrap();
        root.new_dataset::<f64>().shape(shape).create(name).unwrap();
    };
    let folder = tempfile::tempdir().unwrap();
    let text = folder.path().join("a.vtkhdf");
    std::fs::write(&text, "not a mesh").unwrap();
    let found = [
        damaged(|_| (), &field("pressure", 0)),
        damaged(|_| (), &field("stress", 2)),
        damaged(arrays(|root| replace(root, "CellData/stress", &[3, 6])), &field("stress", 1)),
        damaged(|_| (), &with_others),
        damaged(cut, &reopened),
        damaged(cut, &appended),
        damaged(cut, &saved),
        damaged(|path| std::fs::remove_file(path).unwrap(), &appended),
        damaged(arrays(|root| root.unlink("CellData/stress").unwrap()), &reopened),
        damaged(arrays(|root| replace(root, "Steps/Values", &[2, 1, 1])), &reopened),
        damaged(arrays(|root| replace(root, "Steps/Values", &[2, 1, 1])), &appended),
        message(Results::open(&text)),
        message(Results::open(folder.path().join("b.vtkhdf"))),
    ];
    insta::assert_snapshot!(found.join("\n"));
}
