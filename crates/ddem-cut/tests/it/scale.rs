//! Large cuts.

use std::time::Instant;

use ddem_cut::{CellComplex, Compass, JointSet, Polyhedron, Spacing};
use nalgebra::Vector3;

/// Cube of rock cut by three scattered sets with a mean spacing of 1 m.
fn jointed(size: f64, fisher: Option<f64>) -> CellComplex {
    let body = Polyhedron::brick(Vector3::zeros(), Vector3::repeat(size)).unwrap();
    let mut rock = CellComplex::new(&[vec![body.clone()]]);
    for (cut, (dip, direction)) in
        [(30.0, 80.0), (70.0, 200.0), (80.0, 320.0)].into_iter().enumerate()
    {
        let set = JointSet {
            normal: Compass::default().normal(dip, direction),
            fisher,
            spacing: Spacing::Even { mean: 1.0, spread: 0.3 },
            origin: Vector3::repeat(size / 2.0),
        };
        let planes = set.planes(&body.points, 1, cut as u32, false);
        rock.cut(&planes, rock.select(|_, _| true));
    }
    rock
}

#[test]
#[ignore = "a hundred thousand cells, a time"]
fn a_hundred_thousand_cells_take_less_than_five_seconds() {
    for fisher in [None, Some(50.0)] {
        for size in [20.0, 42.0] {
            let start = Instant::now();
            let rock = jointed(size, fisher);
            let cut = start.elapsed().as_secs_f64();
            let matched = rock.common_faces().len();
            let volume: f64 =
                (0..rock.cells().len()).map(|cell| rock.properties(cell).volume).sum();
            let all = start.elapsed().as_secs_f64();
            let n = rock.cells().len();
            println!(
                "κ {fisher:?}: {n} cells in {cut:.2} s, with {matched} neighbours and properties {all:.2} s"
            );
            assert!((volume / size.powi(3) - 1.0).abs() < 1e-12);
            assert_eq!(rock.n_uncut(), 0);
            assert!(all <= 5.0 * (n as f64 / 1e5).max(1.0));
        }
    }
}
