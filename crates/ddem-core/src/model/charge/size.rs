//! Size of a charge before it detonates.

use std::fmt;

use crate::error::counted;

/// Size of a `[[charge]]` before detonation, with all blocks in their reference positions.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ChargeSize {
    /// Number of cavity walls (faces of blocks) on which it acts; 0 in joints.
    pub walls: usize,
    /// Number of joints in which it acts; 0 in cavities.
    pub joints: usize,
    /// Area of the walls, or of one side of the joints `[m²]`.
    pub area: f64,
    /// Volume of the cavities, or of the gaps of the joints `[m³]`.
    pub volume: f64,
    /// Mass of the explosive `[kg]`; `None` if a pressure is given.
    pub mass: Option<f64>,
    /// Density of the explosive `[kg/m³]`; `None` if a pressure is given.
    pub density: Option<f64>,
    /// Initial pressure on the walls or joints `[Pa]`; with a history in time that at factor 1.
    pub pressure: f64,
    /// True if the pressure follows a history in time and not the volume.
    pub timed: bool,
}

impl fmt::Display for ChargeSize {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.joints {
            0 => write!(f, "{}, {:.4e} m³", counted(self.walls, "wall"), self.volume)?,
            joints => write!(f, "{}, {:.4e} m²", counted(joints, "joint"), self.area)?,
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
    /// Mass of the explosive over the volume of its cavities `[kg/m³]`, which is its density if it
    /// fills them. `None` in joints, and if a pressure is given.
    #[must_use]
    pub fn filling(&self) -> Option<f64> {
        self.mass.filter(|_| self.walls > 0).map(|mass| mass / self.volume)
    }
}
