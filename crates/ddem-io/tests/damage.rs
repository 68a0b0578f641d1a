//! Checkpoints and results with changed or missing bytes.

use std::fs;

use ddem_io::checkpoint::{self, Checkpoint};
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
    use ddem_io::vtkhdf::{Cells, FieldSpec, Grid, Writer};
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
