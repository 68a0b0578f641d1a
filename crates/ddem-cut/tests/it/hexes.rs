//! Hexahedra of midpoint subdivision fill their cells.

use ddem_cut::{CellComplex, CutPlane, RandomStream};
use nalgebra::{Matrix3, Vector3};

use crate::shared::{any_vector, cube, cut_all, plane, vector};

/// Signs of the corners of a hexahedron along its three directions, in VTK's order.
const SIGNS: [[f64; 3]; 8] = [
    [-1.0, -1.0, -1.0],
    [1.0, -1.0, -1.0],
    [1.0, 1.0, -1.0],
    [-1.0, 1.0, -1.0],
    [-1.0, -1.0, 1.0],
    [1.0, -1.0, 1.0],
    [1.0, 1.0, 1.0],
    [-1.0, 1.0, 1.0],
];

/// Volume of a trilinear hexahedron by 2×2×2 Gauss points, which is exact.
fn volume(corners: [Vector3<f64>; 8]) -> f64 {
    let gauss = 1.0 / 3.0_f64.sqrt();
    let at = |point: [f64; 3]| {
        let mut jacobian = Matrix3::zeros();
        for (corner, signs) in corners.iter().zip(SIGNS) {
            let factor = |axis: usize| 1.0 + signs[axis] * point[axis] * gauss;
            let slope = [0, 1, 2]
                .map(|axis| signs[axis] / 8.0 * factor((axis + 1) % 3) * factor((axis + 2) % 3));
            jacobian += corner * Vector3::from(slope).transpose();
        }
        jacobian.determinant()
    };
    SIGNS.into_iter().map(at).sum()
}

fn check(rock: &CellComplex) -> usize {
    let all = rock.hexes();
    let mut volumes = vec![0.0; rock.cells().len()];
    for (hex, cell) in all.hexes.iter().zip(&all.cells) {
        volumes[*cell as usize] += volume(hex.map(|point| all.points[point as usize]));
    }
    for (cell, sum) in volumes.into_iter().enumerate() {
        let expected = rock.properties(cell).volume;
        assert!((sum - expected).abs() < 1e-14, "cell {cell}: {sum:e} instead of {expected:e}");
    }
    let mut few = 0;
    // 3V + 3 points in a cell whose V vertices have three edges each.
    for (number, cell) in rock.cells().iter().enumerate() {
        let hexes = all.cells.iter().filter(|&&of| of as usize == number).count();
        let three = 2 * cell.n_edges() == 3 * cell.vertices().len();
        // Pyramids replace hexahedra that would be turned inside out.
        let pyramids = 2 * cell.n_edges();
        assert!(!three || hexes == cell.vertices().len() || hexes == pyramids);
        few += usize::from(three && hexes == pyramids);
    }
    assert!(100 * few <= rock.cells().len().max(100), "{few} cells of pyramids");
    all.points.len()
}

#[test]
fn a_vertex_of_three_edges_has_one_hexahedron() {
    let mut rock = cube(1.0);
    assert_eq!(check(&rock), 27);
    assert_eq!(rock.hexes().hexes.len(), 8);
    let mut numbers = RandomStream::new(8, 0);
    let mut any = || any_vector(&mut numbers);
    let planes: Vec<CutPlane> =
        (0..10).map(|_| plane(any(), any() / 2.0 + Vector3::repeat(0.5))).collect();
    cut_all(&mut rock, &planes);
    let points: usize = rock.cells().iter().map(|cell| 3 * cell.vertices().len() + 3).sum();
    assert_eq!(check(&rock), points);
}

#[test]
fn vertices_of_more_edges_are_filled() {
    let mut rock = cube(2.0);
    let through = vector([0.9, 1.1, 1.0]);
    let normals =
        [[1.0, 0.2, 0.3], [-0.4, 1.0, 0.1], [0.3, 0.1, 1.0], [1.0, 1.0, 1.0], [1.0, -1.0, 0.5]];
    let planes: Vec<CutPlane> =
        normals.into_iter().map(|normal| plane(vector(normal), through)).collect();
    cut_all(&mut rock, &planes);
    assert!(rock.cells().iter().any(|cell| 2 * cell.n_edges() != 3 * cell.vertices().len()));
    check(&rock);
}
