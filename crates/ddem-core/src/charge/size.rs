//! What there is of a charge before it goes off.

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
}

impl ChargeSize {
    /// Mass of the explosive by the volume of its cavities: as much as its density where it fills them
    /// `[kg/m³]`. None in joints, and where a pressure is given.
    #[must_use]
    pub fn filling(&self) -> Option<f64> {
        self.mass.filter(|_| self.walls > 0).map(|mass| mass / self.volume)
    }
}
