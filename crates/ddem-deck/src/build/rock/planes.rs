//! Planes of cuts, with their orientations and areas in the rock.

use std::collections::{BTreeMap, BTreeSet};

use ddem_core::problem::Vec3;
use ddem_cut::{CommonFace, Compass, PlaneSource};

use super::CutRock;

/// Plane of a cut, as far as it bounds cells.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RockPlane {
    /// Number of the cut.
    pub cut: u32,
    /// True if the cut makes no joint.
    pub joined: bool,
    /// Unit normal, upward, or along the dip direction if the plane is vertical.
    pub normal: [f64; 3],
    /// Angle below the horizontal of the steepest line `[degrees]`.
    pub dip: f64,
    /// Direction in which that line goes down, clockwise from `north` of the first region, from 0 to
    /// 360; 0 for a level plane `[degrees]`.
    pub dip_direction: f64,
    /// Area between cells, bridges of rock included `[m²]`.
    pub area: f64,
}

impl CutRock {
    /// Planes of the cuts, and for each face of the cells, cell after cell, the row of its plane; `None`
    /// on a face of a region.
    #[must_use]
    pub fn planes(&self) -> (Vec<RockPlane>, Vec<Option<usize>>) {
        let complex = &self.complex;
        let north = self.regions().first().and_then(|region| Compass::new(region.north.into()));
        let compass = north.unwrap_or_default();
        let cut_of = |plane: u32| match complex.planes()[plane as usize].source {
            PlaneSource::Cut(cut) | PlaneSource::Bridge(cut) => Some(cut),
            PlaneSource::Region => None,
        };
        let faces = || complex.cells().iter().flat_map(|cell| &cell.faces);
        // Numbers of planes increase with those of the cuts.
        let mut areas = BTreeMap::new();
        for face in faces().filter(|face| cut_of(face.plane).is_some()) {
            // Both sides of the plane have the face.
            *areas.entry(face.plane).or_insert(0.0) += face.area(complex.points()).norm() / 2.0;
        }
        let rows: BTreeMap<u32, usize> = areas.keys().copied().zip(0..).collect();
        // Planes of which `[[join]]` leaves out all joints have none.
        let joints = self.common.iter().filter(|face| !self.is_joined(face));
        let joints: BTreeSet<u32> = joints.map(|face| face.plane).collect();
        let left_out = |face: &&CommonFace| self.is_left_out(face) && !joints.contains(&face.plane);
        let left_out: BTreeSet<u32> =
            self.common.iter().filter(left_out).map(|face| face.plane).collect();
        let plane = |(&number, &area): (&u32, &f64)| {
            let plane = &complex.planes()[number as usize];
            let oriented = oriented(&plane.normal, &compass);
            let joined = plane.joined || left_out.contains(&number);
            cut_of(number).map(|cut| RockPlane { cut, joined, area, ..oriented })
        };
        let planes = areas.iter().filter_map(plane).collect();
        let of_faces = faces().map(|face| rows.get(&face.plane).copied()).collect();
        (planes, of_faces)
    }
}

/// Orientation of a plane of no cut, without area.
fn oriented(normal: &Vec3, compass: &Compass) -> RockPlane {
    let normal = if normal.z < 0.0 { -normal } else { *normal };
    let [plunge, dip_direction] = compass.plunge_trend(&normal);
    let (dip, normal) = (90.0 + plunge, normal.into());
    RockPlane { cut: 0, joined: false, normal, dip, dip_direction, area: 0.0 }
}
