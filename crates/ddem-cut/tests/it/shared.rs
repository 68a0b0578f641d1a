//! Regions, planes and checks that several tests use.

use ddem_cut::{CellComplex, CutPlane, PlaneSource, Polyhedron, RandomStream};
use nalgebra::Vector3;

pub(crate) fn vector(x: [f64; 3]) -> Vector3<f64> {
    Vector3::from(x)
}

pub(crate) fn cube(size: f64) -> CellComplex {
    brick([0.0; 3], [size; 3])
}

pub(crate) fn brick(from: [f64; 3], to: [f64; 3]) -> CellComplex {
    CellComplex::new(&[vec![Polyhedron::brick(vector(from), vector(to)).unwrap()]])
}

pub(crate) fn plane(normal: Vector3<f64>, through: Vector3<f64>) -> CutPlane {
    CutPlane::new(normal, through, 0, false).unwrap()
}

/// Vector with all parts from −1 to 1.
pub(crate) fn any_vector(numbers: &mut RandomStream) -> Vector3<f64> {
    let [x, y, z] = [(); 3].map(|()| 2.0 * numbers.uniform() - 1.0);
    Vector3::new(x, y, z)
}

pub(crate) fn cut_all(rock: &mut CellComplex, planes: &[CutPlane]) -> usize {
    let allowed = rock.select(|_, _| true);
    rock.cut(planes, allowed).divisions
}

/// Sum of the volumes of all cells `[m³]`.
pub(crate) fn volume(rock: &CellComplex) -> f64 {
    (0..rock.cells().len()).map(|cell| rock.properties(cell).volume).sum()
}

/// Asserts that all cells are polyhedra and that together they have the given volume.
pub(crate) fn assert_sound(rock: &CellComplex, expected: f64) {
    assert_eq!(rock.n_uncut(), 0);
    assert_tiles(rock, expected);
}

/// [`assert_sound`], except that cells may have stayed whole. Such a cell meets its neighbours at
/// faces with other corners, between which the tolerance leaves gaps.
pub(crate) fn assert_tiles(rock: &CellComplex, expected: f64) {
    for (number, cell) in rock.cells().iter().enumerate() {
        assert_eq!(cell.check(), Ok(()), "cell {number}: {cell:?}");
        // Faces may be snapped by the tolerance, so that thin cells lose or gain that much.
        let properties = rock.properties(number);
        assert!(properties.volume > -1e-12 * expected, "cell {number}: {properties:?}");
    }
    let sum = volume(rock);
    let error = if rock.n_uncut() == 0 { 1e-12 } else { 1e-7 };
    assert!((sum - expected).abs() <= error * expected, "{sum:e} instead of {expected:e}");
}

/// Asserts that every face inside the region has one on the other side with the same corners.
pub(crate) fn assert_all_matched(rock: &CellComplex) {
    let inner = |source| source != PlaneSource::Region;
    let faces = rock.cells().iter().flat_map(|cell| &cell.faces);
    let n_inner = faces.filter(|face| inner(rock.plane(face).source)).count();
    let matched: Vec<_> = rock.common_faces().into_iter().filter(|face| face.matches).collect();
    let n_matched =
        matched.iter().filter(|face| inner(rock.planes()[face.plane as usize].source)).count();
    assert_eq!(2 * n_matched, n_inner);
    for face in &matched {
        let [one, other] = [0, 1].map(|side| {
            let cell = &rock.cells()[face.cells[side] as usize];
            cell.faces[face.faces[side] as usize].area(rock.points())
        });
        assert!((one + other).norm() <= 1e-14, "{one} and {other}");
    }
}
