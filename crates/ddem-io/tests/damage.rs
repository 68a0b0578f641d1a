//! Checkpoints and results with changed or missing bytes.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use ddem_io::OutputError;
use ddem_io::checkpoint::{self, Checkpoint};
use ddem_io::vtkhdf::{Cells, FieldSpec, Grid, PointOwner, Results, Savepoint, Writer};
use tempfile::tempdir;

/// Flips one bit in every fifth byte in turn, and cuts the file in as many places.
#[test]
fn every_damage_of_a_checkpoint_is_noticed() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("checkpoint.h5");
    checkpoint::save(&path, "title = 'deck'", &[1, 2, 3], &[7; 500]).unwrap();
    let whole = fs::read(&path).unwrap();
    let load = |bytes: &[u8]| {
        fs::write(&path, bytes).unwrap();
        Checkpoint::load(&path)
    };
    for at in (0..whole.len()).step_by(5).chain(whole.len() - 20..whole.len()) {
        let mut flipped = whole.clone();
        flipped[at] ^= 1 << (at % 8);
        assert!(load(&flipped).is_err(), "byte {at} of {}", whole.len());
        assert!(load(&whole[..at]).is_err(), "{at} of {} bytes", whole.len());
    }
    assert_eq!(load(&whole).unwrap().state, [7; 500]);
}

/// Any HDF5 program notices a flipped bit in the numbers of a field when it reads them.
#[test]
fn damaged_numbers_of_a_field_are_noticed() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("blocks.vtkhdf");
    let grid = Grid { points: vec![[0.0; 3]; 8], cells: Cells::Vertices(8) };
    let fields = [FieldSpec::point("displacement", 3).uncompressed()];
    let mut writer = Writer::create(&path, &grid, &[], &fields).unwrap();
    for step in 0..2_u32 {
        let fill = |_: usize, rows: std::ops::Range<usize>, out: &mut [f64]| {
            for (number, at) in out.iter_mut().zip(3 * rows.start..) {
                *number = f64::from(1 + step) / (at + 1) as f64;
            }
        };
        writer.append(f64::from(step), None, &fill).unwrap();
    }
    let read = || {
        let file = hdf5::File::open(&path).unwrap();
        file.dataset("VTKHDF/PointData/displacement").unwrap().read_raw::<f64>()
    };
    assert_eq!(read().unwrap()[24], 2.0);
    let mut bytes = fs::read(&path).unwrap();
    let third = (2.0_f64 / 3.0).to_le_bytes();
    let at = bytes.windows(8).position(|part| part == third).unwrap();
    bytes[at] ^= 1;
    fs::write(&path, bytes).unwrap();
    assert!(read().is_err());
}

fn fields() -> [FieldSpec; 2] {
    [FieldSpec::point("displacement", 3), FieldSpec::cell("stress", 6)]
}

/// Makes a file with a cube and two steps.
fn cube(path: &Path) -> Savepoint {
    let points = (0..8_u32).map(|i| [f64::from(i), 0.5, -1.0]).collect();
    let grid = Grid { points, cells: Cells::Hexahedra(vec![[0, 1, 2, 3, 4, 5, 6, 7]]) };
    let mut writer = Writer::create(path, &grid, &[], &fields()).unwrap();
    for step in 1..3_u32 {
        writer.append(f64::from(step), None, &|_, _, out| out.fill(f64::from(step))).unwrap();
    }
    writer.savepoint().unwrap()
}

/// Readers notice a flipped bit in the points and the fields of contacts.
#[test]
fn damaged_contacts_are_noticed() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("contacts.vtkhdf");
    let mut writer = Writer::create_cloud(&path, &fields()[..1]).unwrap();
    for n in [3_u32, 2000] {
        let points = (0..n).map(|i| [f64::from(i), 0.5, -1.0]).collect();
        writer.append(f64::from(n), Some(points), &|_, _, out| out.fill(f64::from(n))).unwrap();
    }
    let read = || -> Result<_, OutputError> {
        let results = Results::open(&path)?;
        Ok([0, 1].map(|step| (results.points(step), results.field("displacement", step))))
    };
    assert!(read().unwrap().iter().all(|(points, field)| points.is_ok() && field.is_ok()));
    let (whole, chunks) = (fs::read(&path).unwrap(), chunks(&path));
    let is_read = |name: &str| name.ends_with("/Points") || name.ends_with("/displacement");
    let chunks: Vec<_> = chunks.into_iter().filter(|(name, _)| is_read(name)).collect();
    assert_eq!(chunks.len(), 3 + 3 + 1);
    for (name, place) in chunks {
        let mut flipped = whole.clone();
        flipped[place as usize + 8] ^= 1;
        fs::write(&path, &flipped).unwrap();
        let damaged = read().map_or(1, |steps| {
            steps.iter().filter(|(points, field)| points.is_err() || field.is_err()).count()
        });
        assert_eq!(damaged, 1, "{name}");
    }
}

/// Reads all numbers of such a file.
fn numbers(path: &Path) -> Result<Vec<f64>, OutputError> {
    let results = Results::open(path)?;
    let mut all = results.times()?;
    for step in 0..2 {
        all.extend(results.points(step)?.into_iter().flatten());
        for field in fields() {
            all.extend(results.field(&field.name, step)?.values);
        }
    }
    Ok(all)
}

/// Names of the arrays of a file, and the places of their chunks.
fn chunks(path: &Path) -> Vec<(String, u64)> {
    fn below(group: &hdf5::Group, all: &mut Vec<(String, u64)>) {
        for dataset in group.datasets().unwrap() {
            let places =
                (0..dataset.num_chunks().unwrap()).map(|at| dataset.chunk_info(at).unwrap().addr);
            all.extend(places.map(|place| (dataset.name(), place)));
        }
        group.groups().unwrap().iter().for_each(|group| below(group, all));
    }
    let mut all = Vec::new();
    below(&hdf5::File::open(path).unwrap().group("VTKHDF").unwrap(), &mut all);
    all
}

/// Readers notice a flipped bit in any number that they need, and a run that resumes one in the index of the steps.
#[test]
fn damaged_index_is_noticed() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("blocks.vtkhdf");
    let savepoint = cube(&path);
    let (sound, whole, chunks) = (numbers(&path).unwrap(), fs::read(&path).unwrap(), chunks(&path));
    // Those of the mesh, its sizes, and two steps of times, parts and fields, of which the second ones begin after row 0.
    assert_eq!(chunks.len(), 4 + 3 + 2 * 2 + 2 + 2 * 2);
    let mut found = BTreeSet::new();
    let mut tell = |error: OutputError| {
        let folder = format!("{}/", folder.path().display());
        found.insert(error.to_string().replace(&folder, ""));
    };
    for (name, place) in chunks {
        let mut flipped = whole.clone();
        flipped[place as usize] ^= 1;
        fs::write(&path, &flipped).unwrap();
        match numbers(&path) {
            Err(error) => tell(error),
            Ok(all) => assert_eq!(all, sound, "{name}"),
        }
        let is_index = name.contains("/Steps/") || name.contains("/NumberOf");
        match Writer::reopen(&path, PointOwner::Mesh, &fields(), &savepoint) {
            Err(error) if is_index => tell(error),
            reopened => assert!(reopened.is_ok() && !is_index, "{name}"),
        }
    }
    fs::write(&path, &whole).unwrap();
    let file = hdf5::File::open_rw(&path).unwrap();
    let steps = file.group("VTKHDF/Steps").unwrap().attr("NSteps").unwrap();
    steps.write_scalar(&6_i64).unwrap();
    drop(steps);
    file.close().unwrap();
    tell(numbers(&path).unwrap_err());
    insta::assert_snapshot!(found.into_iter().collect::<Vec<_>>().join("\n"));
}
