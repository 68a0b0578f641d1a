//! Points, axes and forces of a patch.

use nalgebra::Matrix3;

use super::{Configuration, ContactPoint, Patch};
use crate::point::JointPoint;
use ddem_mechanics::law::Traction;
use ddem_mesh::Vec3;

impl Patch {
    /// Energy in the springs and the reserve `[J]`.
    pub(super) fn stored(&self) -> f64 {
        let [normal, shear] = self.spring_energies(&[]);
        normal + shear + self.reserve()
    }

    /// Shortest element edge of the two blocks `[m]`.
    pub(super) fn spacing(&self, configuration: &Configuration<'_>) -> f64 {
        let [a, b] = self.blocks.map(|block| configuration.blocks[block as usize].spacing);
        a.min(b)
    }

    /// Notes on which blocks of the two bodies it has points.
    pub(super) fn note_parts(&mut self) {
        self.parts = [0, 1].map(|side| {
            let parts = self.points.iter().map(|point| point.points[side].part);
            parts.fold(0, |all, part| all | bit(part.into()))
        });
    }

    /// Largest penetration of its points `[m]`.
    pub fn depth(&self) -> f64 {
        self.points.iter().map(ContactPoint::depth).fold(0.0, f64::max)
    }

    /// Pairs of points.
    pub(super) fn pairs(&self) -> impl Iterator<Item = &JointPoint> {
        self.points.iter().map(|point| &point.pair)
    }

    /// True if a point may exert a force.
    #[inline]
    pub fn may_carry_force(&self, point: &ContactPoint) -> bool {
        let state = &point.pair.state;
        state.gap <= 0.0 || state.added_tractions != [0.0; 2] || self.bond.is_some()
    }

    /// Force of a point on block a `[N]`.
    #[inline(always)]
    pub fn force(&self, point: &ContactPoint) -> Vec3 {
        Self::force_along(&self.frame(), point)
    }

    /// Force of a point on block a, given the axes as columns `[N]`.
    #[inline(always)]
    pub(super) fn force_along(axes: &Matrix3<f64>, point: &ContactPoint) -> Vec3 {
        let Traction { normal, shear } = point.pair.state.total_traction();
        let (along, across) = (axes.column(1) * shear.x, axes.column(2) * shear.y);
        (axes.column(0) * normal + along + across) * point.pair.area
    }

    /// True if it may have points on a block of body a (side 0) or b (side 1).
    pub(super) fn has_points_on(&self, side: usize, block: usize) -> bool {
        self.bond.is_some() || self.parts[side] & bit(block - self.blocks[side] as usize) != 0
    }

    /// Area of all points `[m²]`.
    pub(super) fn area(&self) -> f64 {
        self.pairs().map(|pair| pair.area).sum()
    }

    /// Reference block, with which the normal rotates, and the other block.
    pub(super) fn order(&self) -> [usize; 2] {
        let [a, b] = self.blocks.map(|block| block as usize);
        if self.reference == 0 { [a, b] } else { [b, a] }
    }

    /// Rotates the axes with the reference block.
    pub(super) fn update_axes(&mut self, configuration: &Configuration<'_>) {
        self.axes_now = self.present_axes(configuration);
    }

    pub(super) fn present_axes(&self, configuration: &Configuration<'_>) -> [Vec3; 2] {
        let rotation = configuration.rotation(self.order()[0]);
        self.axes.map(|axis| rotation * axis)
    }

    /// Normal and two tangents in space as columns, from the last update of the axes.
    pub fn frame(&self) -> Matrix3<f64> {
        columns(self.axes_now)
    }

    /// Columns of the axes in the present configuration.
    pub(super) fn present_frame(&self, configuration: &Configuration<'_>) -> Matrix3<f64> {
        columns(self.present_axes(configuration))
    }
}

/// Bit of a block of a body; many blocks share the last one.
fn bit(part: usize) -> u64 {
    1 << part.min(63)
}

fn columns([normal, along]: [Vec3; 2]) -> Matrix3<f64> {
    Matrix3::from_columns(&[normal, along, normal.cross(&along)])
}
