//! Discs and polygons of cuts, as a list.

use std::collections::BTreeSet;

use ddem_cut::{Compass, Fracture, PlaneSource};

use super::CutRock;

/// Disc or polygon of a cut. A polygon is listed as the disc of its area.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RockFracture {
    /// Number of the cut.
    pub cut: u32,
    /// Middle `[m]`.
    pub centre: [f64; 3],
    /// Angle below the horizontal of the steepest line, from 0 to 90 `[degrees]`.
    pub dip: f64,
    /// Direction in which that line goes down, clockwise from `north` of the region, from 0 to 360
    /// `[degrees]`.
    pub dip_direction: f64,
    /// Radius `[m]`.
    pub radius: f64,
    /// Area `[m²]`.
    pub area: f64,
}

impl CutRock {
    /// Number of discs and polygons that cut no cell.
    #[must_use]
    pub fn idle_fractures(&self) -> usize {
        let cuts: BTreeSet<u32> = self.fractures.iter().map(|fracture| fracture.cut).collect();
        let is_cut = |plane: &u32| match self.complex.planes()[*plane as usize].source {
            PlaneSource::Cut(cut) | PlaneSource::Bridge(cut) => cuts.contains(&cut),
            PlaneSource::Region => false,
        };
        let planes = self.common.iter().map(|face| face.plane).filter(is_cut);
        let cutting = planes.filter(|plane| self.complex.fracture(*plane).is_some());
        self.fractures.len().saturating_sub(cutting.collect::<BTreeSet<u32>>().len())
    }
}

/// Fractures of a cut.
pub(super) fn listed(
    fractures: &[Fracture],
    cut: u32,
    compass: &Compass,
) -> impl Iterator<Item = RockFracture> {
    fractures.iter().map(move |of| {
        let normal = of.plane.normal;
        let upward = if normal.z < 0.0 { -normal } else { normal };
        let [plunge, dip_direction] = compass.plunge_trend(&upward);
        let (dip, centre) = (90.0 + plunge, of.centre.into());
        RockFracture { cut, centre, dip, dip_direction, radius: of.radius, area: of.area() }
    })
}
