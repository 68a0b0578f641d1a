//! Wedges between two joints, a slope face and a level top: volumes and areas in closed form.

use ddem_cut::{CellComplex, Compass, CutPlane};
use nalgebra::Vector3;

use crate::shared::{assert_sound, brick, cut_all};

/// Dips and dip directions of the two joints and the slope face `[degrees]`.
pub(crate) type WedgePlanes = [[f64; 2]; 3];

/// Volume of the wedge whose top is `height` above the toe, and areas of its faces on the joints.
pub(crate) fn wedge(orientations: WedgePlanes, height: f64) -> (f64, [f64; 2]) {
    let normals = orientations.map(|[dip, direction]| Compass::default().normal(dip, direction));
    let mut rock: CellComplex = brick([-150.0, -150.0, -20.0], [150.0, 150.0, height]);
    for (cut, normal) in normals.into_iter().enumerate() {
        let plane = CutPlane::new(normal, Vector3::zeros(), cut as u32, false).unwrap();
        cut_all(&mut rock, &[plane]);
    }
    assert_sound(&rock, 300.0 * 300.0 * (20.0 + height));
    // Above both joints and behind the face.
    let is_wedge = |cell: usize| {
        let side = normals.map(|normal| normal.dot(&rock.centroid(cell)) > 0.0);
        side == [true, true, false]
    };
    let wedges: Vec<usize> = (0..rock.cells().len()).filter(|&cell| is_wedge(cell)).collect();
    assert_eq!(wedges.len(), 1);
    let area = |cut: u32| {
        let of =
            |face: &&ddem_cut::CellFace| rock.plane(face).source == ddem_cut::PlaneSource::Cut(cut);
        rock.cells()[wedges[0]].faces.iter().find(of).unwrap().area(rock.points()).norm()
    };
    assert_eq!(rock.cuts_of(wedges[0]), [0, 1, 2]);
    (rock.properties(wedges[0]).volume, [area(0), area(1)])
}

#[test]
fn a_wedge_of_ten_metres() {
    let (volume, areas) = wedge([[40.0, 130.0], [60.0, 220.0], [70.0, 156.0]], 10.0);
    assert!((volume - 390.057_24).abs() < 6e-6, "{volume}");
    assert!((areas[0] - 170.392_87).abs() < 6e-6, "{areas:?}");
    assert!((areas[1] - 61.683_65).abs() < 6e-6, "{areas:?}");
}

#[test]
fn a_wedge_of_thirty_metres() {
    let (volume, areas) = wedge([[45.0, 105.0], [70.0, 235.0], [65.0, 185.0]], 30.0);
    assert!((volume - 4_584.085_2).abs() < 6e-5, "{volume}");
    assert!((areas[0] - 647.249_7).abs() < 6e-5, "{areas:?}");
    assert!((areas[1] - 626.135_8).abs() < 6e-5, "{areas:?}");
}
