//! Tests of appends that end at any moment.

use std::fs::{self, File};
use std::path::Path;

use super::structure::{FilePages, Structure};
use crate::vtkhdf::{Cells, FieldSpec, Grid, NumberType, PointOwner, Results, Writer};

/// Numbers of a field with `columns` in a step. Zeros are not stored: two of three steps of a field with one column, and
/// the first chunk of a field with two columns and some more.
fn numbers(step: usize, columns: usize, rows: std::ops::Range<usize>, out: &mut [f64]) {
    if columns == 1 && step % 3 != 1 {
        return out.fill(0.0);
    }
    for (i, out) in out.iter_mut().enumerate() {
        let is_zero = columns == 2 && rows.start + i / 2 < 1024;
        *out = if is_zero {
            0.0
        } else {
            ((columns * rows.start + i) as f64 + 31.0 * step as f64).sqrt()
        };
    }
}

fn fields() -> [FieldSpec; 3] {
    [
        FieldSpec::point("velocity", 3),
        FieldSpec::point("force", 2).uncompressed(),
        FieldSpec::point("state", 1).kind(NumberType::I32),
    ]
}

/// File under test: a mesh with a number of points, or a cloud with as many at most.
#[derive(Clone, Copy)]
struct FileKind {
    points: usize,
    cloud: bool,
}

impl FileKind {
    fn owner(self) -> PointOwner {
        if self.cloud { PointOwner::Step } else { PointOwner::Mesh }
    }

    fn grid(self, points: usize) -> Grid {
        let points: Vec<_> = (0..points).map(|i| [i as f64, 0.5, -1.0]).collect();
        Grid { cells: Cells::Vertices(points.len()), points }
    }

    fn create(self, path: &Path) -> Writer {
        if self.cloud {
            return Writer::create_cloud(path, &fields()).unwrap();
        }
        Writer::create(path, &self.grid(self.points), &[], &fields()).unwrap()
    }

    /// Points of a step.
    fn points(self, step: usize) -> usize {
        if self.cloud { self.points * (step % 4) / 3 } else { self.points }
    }

    fn append(self, writer: &mut Writer, step: usize) {
        let points = self.cloud.then(|| self.grid(self.points(step)).points);
        let fill = |field: usize, rows: std::ops::Range<usize>, out: &mut [f64]| {
            numbers(step, fields()[field].components, rows, out);
        };
        writer.append(step as f64, points, &fill).unwrap();
    }

    /// Checks that a file has the first steps.
    fn check(self, path: &Path, steps: usize) {
        let results = Results::open(path).unwrap();
        assert!(results.times().unwrap().len() >= steps);
        for step in 0..steps {
            for field in fields() {
                let rows = 0..self.points(step);
                let mut expected = vec![0.0; rows.len() * field.components];
                numbers(step, field.components, rows, &mut expected);
                if field.kind == NumberType::I32 {
                    expected.iter_mut().for_each(|x| *x = x.trunc());
                }
                assert_eq!(results.field(&field.name, step).unwrap().values, expected, "{step}");
            }
        }
    }
}

/// Few points, steps of two chunks, and clouds of none to three chunks.
const KINDS: [(FileKind, usize); 3] = [
    (FileKind { points: 12, cloud: false }, 140),
    (FileKind { points: 65_537, cloud: false }, 3),
    (FileKind { points: 2500, cloud: true }, 140),
];

/// Byte by byte: nothing else has changed before the former end.
#[test]
fn savepoint_brings_back_all_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.vtkhdf");
    for (kind, steps) in KINDS {
        let mut writer = kind.create(&path);
        let mut before = Vec::new();
        for step in 0..steps {
            if step % 9 == 0 || step == 64 {
                before.push((step, writer.savepoint().unwrap(), fs::read(&path).unwrap()));
            }
            kind.append(&mut writer, step);
        }
        kind.check(&path, steps);
        for (step, savepoint, bytes) in before.into_iter().rev() {
            let reopened = Writer::reopen(&path, kind.owner(), &fields(), &savepoint).unwrap();
            assert_eq!(reopened.steps(), step);
            assert!(fs::read(&path).unwrap() == bytes, "step {step} of {steps}");
        }
        kind.append(&mut kind.create(&path), 0);
        kind.check(&path, 1);
    }
}

/// Makes the files between all changes of an append, at those steps at which the index of the chunks gets new nodes, too.
#[test]
fn killed_append_leaves_all_former_steps() {
    let folder = tempfile::tempdir().unwrap();
    let (path, torn) = (folder.path().join("a.vtkhdf"), folder.path().join("b.vtkhdf"));
    for (kind, steps) in KINDS {
        let mut writer = kind.create(&path);
        for step in 0..steps {
            let savepoint = writer.savepoint().unwrap();
            let before = fs::read(&path).unwrap();
            let file = File::open(&path).unwrap();
            let structure = Structure::read(&mut FilePages::of(&file).unwrap()).unwrap();
            kind.append(&mut writer, step);
            // Nodes hold 64 chunks, and get half of those of a full one.
            if !(step < 5 || [64, 96, 128].contains(&step)) {
                continue;
            }
            let after = fs::read(&path).unwrap();
            let mut bytes = [&before, &after[before.len()..]].concat();
            for (at, block) in structure.growing.into_iter().enumerate() {
                if at % 7 == step % 7 || (step == 64 && !kind.cloud) || kind.points > 1000 {
                    fs::write(&torn, &bytes).unwrap();
                    let found = Results::open(&torn).unwrap().times().unwrap().len();
                    assert!(found == step || found == step + 1, "{found} of {step} steps");
                    kind.check(&torn, found);
                }
                let own = block.at as usize..block.at as usize + block.bytes.len();
                bytes[own.clone()].copy_from_slice(&after[own]);
            }
            assert!(bytes == after, "step {step}");
            fs::write(&torn, &bytes[..bytes.len() - 1]).unwrap();
            Writer::reopen(&torn, kind.owner(), &fields(), &savepoint).unwrap();
            assert!(fs::read(&torn).unwrap() == before, "step {step}");
        }
    }
}

/// Makes the files between all changes on the way back to a savepoint, from before to after the index gets new nodes.
#[test]
fn killed_return_to_a_savepoint_leaves_its_steps() {
    let folder = tempfile::tempdir().unwrap();
    let (path, torn) = (folder.path().join("a.vtkhdf"), folder.path().join("b.vtkhdf"));
    for kind in [KINDS[0].0, KINDS[2].0] {
        let mut writer = kind.create(&path);
        (0..60).for_each(|step| kind.append(&mut writer, step));
        let file = File::open(&path).unwrap();
        let structure = Structure::read(&mut FilePages::of(&file).unwrap()).unwrap();
        (60..70).for_each(|step| kind.append(&mut writer, step));
        let mut bytes = fs::read(&path).unwrap();
        for (at, block) in structure.growing.iter().enumerate().rev() {
            let own = block.at as usize..block.at as usize + block.bytes.len();
            bytes[own].copy_from_slice(&block.bytes);
            if at % 3 == 0 {
                fs::write(&torn, &bytes).unwrap();
                let found = Results::open(&torn).unwrap().times().unwrap().len();
                assert!(found == 60 || found == 70, "{found} steps");
                kind.check(&torn, found.min(60));
            }
        }
    }
}
