//! The results of the beam, read by VTK itself.

use std::process::Command;

use serde_json::Value;

use super::shared::{Frames, edited, example, root, run};

/// Runs only if `DDEM_PYTHON` names an interpreter that has vtk and numpy.
#[test]
fn vtk_reads_beam_results() {
    let Some(python) = std::env::var_os("DDEM_PYTHON").filter(|python| !python.is_empty()) else {
        eprintln!("NOT CHECKED WITH VTK: set DDEM_PYTHON to a Python that has vtk and numpy");
        return;
    };
    let run = run(&edited(&example("v03_beam"), "tolerance = 1e-8", "tolerance = 1e-4"));
    let counts = [("blocks.vtkhdf", 13_500, 108 * 64), ("joints.vtkhdf", 243 * 25, 243 * 16)];
    for (file, points, cells) in counts {
        let path = run.path(file);
        let mut command = Command::new(&python);
        command.arg(root("tests/vtk/check_vtkhdf.py")).arg(&path);
        let out = command.env("HDF5_USE_FILE_LOCKING", "FALSE").output().expect("Python runs");
        let errors = String::from_utf8_lossy(&out.stderr);
        assert!(out.status.success() && errors.is_empty(), "{file}: {errors}");
        let seen: Value = serde_json::from_slice(&out.stdout).expect("JSON");
        let frames = Frames::open(&path);
        let steps = seen["steps"].as_array().expect("frames");
        assert_eq!(steps.len(), frames.times().len(), "{file}");
        let last = steps.last().expect("a frame");
        assert_eq!((&last["points"], &last["cells"]), (&points.into(), &cells.into()), "{file}");
        let displacement = &last["point_data"]["displacement"];
        assert_eq!(displacement["nan"], 0);
        let values = frames.last_vectors("displacement").into_flattened();
        let sum: f64 = values.iter().sum();
        let size: f64 = values.iter().map(|u| u.abs()).sum();
        let found = displacement["sum"].as_f64().expect("a number");
        assert!((found - sum).abs() <= 1e-10 * size, "{file}: {found} against {sum}");
    }
}
