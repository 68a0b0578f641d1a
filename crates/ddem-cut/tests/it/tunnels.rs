//! Tunnels: cells inside fill the outline, cells outside that do not touch it stay whole.

use ddem_cut::{CellComplex, Compass, Outline, Tunnel};
use nalgebra::Vector3;

use crate::shared::{assert_sound, brick, cut_all, plane, vector};

const HORSESHOE: [[f64; 2]; 6] =
    [[-4.0, 0.0], [4.0, 0.0], [4.0, 3.0], [2.0, 5.0], [-2.0, 5.0], [-4.0, 3.0]];

fn tunnel(outline: &[[f64; 2]], from: [f64; 3], to: [f64; 3]) -> Tunnel {
    let outline = Outline::new(outline).unwrap();
    Tunnel::new(&outline, [vector(from), vector(to)], &Compass::default(), 3, true).unwrap()
}

fn excavate(rock: &mut CellComplex, tunnel: &Tunnel) -> f64 {
    let allowed = rock.select(|_, _| true);
    rock.cut_tunnel(tunnel, allowed);
    let inside = |&cell: &usize| tunnel.contains(&rock.centroid(cell));
    (0..rock.cells().len()).filter(inside).map(|cell| rock.properties(cell).volume).sum()
}

#[test]
fn a_tunnel_through_whole_rock_has_the_volume_of_its_outline() {
    let mut rock = brick([0.0; 3], [40.0, 40.0, 30.0]);
    let volume = excavate(&mut rock, &tunnel(&HORSESHOE, [20.0, 0.0, 10.0], [20.0, 40.0, 10.0]));
    assert!((volume - 36.0 * 40.0).abs() < 1e-9, "{volume}");
    // One cell inside and one outside of each side.
    assert_eq!(rock.cells().len(), 7);
    assert_sound(&rock, 48_000.0);
    let blocks = rock.blocks(&rock.common_faces());
    assert!(rock.planes().iter().skip(6).all(|plane| plane.joined));
    // The tunnel ends cuts on its own sides, so that faces overlap in part; the rock stays whole.
    assert_eq!(blocks, [0; 7]);
}

#[test]
fn the_outline_stands_upright_and_looks_along_the_axis() {
    let flag = [[0.0, 0.0], [2.0, 0.0], [0.0, 1.0]];
    // To the north, right is east; to the west, right is north; down a shaft, right is east.
    for (to, inside) in [
        ([0.0, 9.0, 0.0], [1.5, 1.0, 0.1]),
        ([-9.0, 0.0, 0.0], [-1.0, 1.5, 0.1]),
        ([0.0, 0.0, -9.0], [1.5, 0.1, -1.0]),
    ] {
        let tunnel = tunnel(&flag, [0.0; 3], to);
        assert!(tunnel.contains(&vector(inside)), "{to:?}");
        assert!(!tunnel.contains(&-vector(inside)), "{to:?}");
    }
}

#[test]
fn a_concave_tunnel_that_ends_in_jointed_rock() {
    let mut rock = brick([0.0; 3], [20.0, 20.0, 20.0]);
    for (normal, spacing) in
        [([1.0, 0.2, 0.1], 2.5), ([0.1, 1.0, -0.3], 3.0), ([0.2, -0.1, 1.0], 2.0)]
    {
        let normal = vector(normal).normalize();
        let at = |i: i32| normal * spacing * f64::from(i);
        let planes: Vec<_> = (-4..16).map(|i| plane(normal, at(i))).collect();
        cut_all(&mut rock, &planes);
    }
    let before = rock.clone();
    let outline = [[-3.0, 0.0], [3.0, 0.0], [3.0, 4.0], [1.0, 4.0], [1.0, 2.0], [-3.0, 2.0]];
    let tunnel = tunnel(&outline, [10.0, 3.0, 8.0], [10.0, 15.0, 9.0]);
    let volume = excavate(&mut rock, &tunnel);
    let length = vector([0.0, 12.0, 1.0]).norm();
    assert!((volume - 16.0 * length).abs() < 1e-9, "{volume}");
    assert_sound(&rock, 8_000.0);
    // Cells outside of a box around the tunnel are as they were.
    let middle = Vector3::new(10.0, 9.0, 10.5);
    for (cell, old) in before.cells().iter().enumerate() {
        let corners = old.vertices().into_iter().map(|v| before.points()[v as usize] - middle);
        let far = |axis: usize, half: f64| {
            let mut heights = corners.clone().map(|x| x[axis]);
            heights.clone().all(|x| x > half) || heights.all(|x| x < -half)
        };
        if far(0, 3.0) || far(1, 6.4) || far(2, 3.0) {
            assert_eq!(&rock.cells()[cell], old);
        }
    }
    let touched = rock.cells().len() - before.cells().len();
    assert!(touched > 50, "{touched}");
}

#[test]
fn a_tunnel_cut_again_changes_nothing() {
    let mut rock = brick([0.0; 3], [40.0, 40.0, 30.0]);
    let bore = tunnel(&HORSESHOE, [20.0, 5.0, 10.0], [23.0, 31.0, 12.0]);
    excavate(&mut rock, &bore);
    let cells = rock.cells().len();
    excavate(&mut rock, &bore);
    assert_eq!(rock.cells().len(), cells);
}
