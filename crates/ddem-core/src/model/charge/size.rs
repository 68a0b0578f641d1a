//! Size of a charge before it detonates.

use std::fmt;

/// One `[[charge]]` before it goes off, where blocks are in their reference positions.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ChargeSize {
    /// Walls of cavities that it pushes, faces of blocks; 0 where it pushes joints.
    pub walls: usize,
    /// Joints that it pushes; 0 where it pushes walls.
    pub joints: usize,
    /// Area of the walls, or of one side of the joints `[m²]`.
    pub area: f64,
    /// Volume of the cavities, or of what the joints are wide `[m³]`.
    pub volume: f64,
    /// Mass of the explosive `[kg]`; none where a pressure is given.
    pub mass: Option<f64>,
    /// Density of the explosive `[kg/m³]`; none where a pressure is given.
    pub density: Option<f64>,
    /// First pressure on them, of a history in time at factor 1 `[Pa]`.
    pub pressure: f64,
    /// Its pressure goes with time by a history, and not by the volume.
    pub timed: bool,
}

impl fmt::Display for ChargeSize {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.joints {
            0 => write!(f, "{} walls, {:.4e} m³", self.walls, self.volume)?,
            joints => write!(f, "{joints} joints, {:.4e} m²", self.area)?,
        }
        if let Some(mass) = self.mass {
            write!(f, ", {mass} kg")?;
        }
        if let (Some(filling), Some(density)) = (self.filling(), self.density) {
            write!(f, " ({filling:.1} of {density} kg/m³)")?;
        }
        let how = if self.timed { "history of" } else { "begins with" };
        write!(f, ", {how} {:.3e} Pa", self.pressure)
    }
}

impl ChargeSize {
    /// Mass of the explosive by the volume of its cavities: as much as its density where it fills them
    /// `[kg/m³]`. None in joints, and where a pressure is given.
    #[must_use]
    pub fn filling(&self) -> Option<f64> {
        self.mass.filter(|_| self.walls > 0).map(|mass| mass / self.volume)
    }
}
