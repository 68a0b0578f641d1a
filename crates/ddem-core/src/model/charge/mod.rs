//! §10: charges. The surfaces that their gas pushes, and its pressure.
//!
//! The gas fills a closed surface of facets between nodes, or several; where a cavity is open, the
//! surface ends. A pressure p does `p A` on the nodes, with the present areas A: of a closed surface no
//! force and no moment are left, and the work is `p dV`.

mod shell;
mod size;

pub use self::shell::Shell;
pub use self::size::ChargeSize;
use serde::{Deserialize, Serialize};

use ddem_mesh::Vec3;

/// The gas in one shell of a charge.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ShellState {
    /// Volume of the shell when the charge went off, if it has `[m³]`.
    pub began: Option<f64>,
    /// Volume with which the gas got out, if it has `[m³]`.
    pub left: Option<f64>,
}

/// The gas of a charge that expands.
#[derive(Clone, Copy, Debug)]
pub struct Gas {
    /// Adiabatic index.
    pub gamma: f64,
    /// Volume at which it has the pressure of the charge `[m³]`.
    pub own: f64,
    /// Volume that it has at the start `[m³]`.
    pub start: f64,
    /// The gas makes its own room: its volume grows with the shells, from the moment of detonation.
    pub own_room: bool,
    /// The gas has the charge's pressure in the volume at detonation.
    pub given: bool,
}

impl Gas {
    /// Its volume, from one at first that has grown by so much. Explosive is in no less than its own, and
    /// walls that have met leave no gas of no volume.
    fn volume(&self, first: f64, grown: f64) -> f64 {
        (first + grown).max(if self.given { 1e-6 * first } else { self.own })
    }

    /// Its pressure as a part of the charge's.
    pub fn part(&self, first: f64, grown: f64) -> f64 {
        let own = if self.given { first } else { self.own };
        libm::pow(own / self.volume(first, grown), self.gamma)
    }
}

/// A charge.
#[derive(Clone, Debug)]
pub struct GasCharge {
    /// Nodes that it pushes, in order.
    pub nodes: Vec<u32>,
    /// Their reference positions `[m]`.
    pub start: Vec<Vec3>,
    /// Surfaces of the gas, each apart from the others.
    pub shells: Vec<Shell>,
    /// Pressure `[Pa]`: of the gas in its own volume, or at factor 1.
    pub pressure: f64,
    /// The gas, if it expands.
    pub gas: Option<Gas>,
    /// Size at the start.
    pub size: ChargeSize,
}

/// A charge at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChargeState {
    /// Pressure of its gas `[Pa]`; 0 before it goes off, and where it is not in force.
    pub pressure: f64,
    /// Volume of the cavity, or of the joints `[m³]`: what the gas has got out of has that with which
    /// it did.
    pub volume: f64,
    /// True once the gas has vented from all shells.
    pub vented: bool,
    /// Volume of the cavity, or of the joints, when it went off; `None` before `[m³]`.
    pub began: Option<f64>,
}

/// Forces of a charge on its nodes.
#[derive(Debug)]
pub struct ChargeForces {
    /// At factor 1 `[Pa]`.
    pub pressure: f64,
    /// Volume of all shells `[m³]`.
    pub volume: f64,
    /// At factor 1, by node `[N]`.
    pub forces: Vec<Vec3>,
    /// Of each shell.
    pub shells: Vec<ShellState>,
}

impl GasCharge {
    /// Nodes of the walls of cavities that it pushes.
    pub fn walls(&self) -> impl Iterator<Item = Vec<u32>> {
        let in_cavity = self.shells.iter().filter(|_| self.size.walls > 0);
        let node = |&at: &u32| self.nodes[at as usize];
        in_cavity.flat_map(Shell::walls).map(move |wall| wall.iter().map(node).collect())
    }

    /// Pressure by volume of a gas that expands, `γ p/V` `[Pa/m³]`, and the areas that it has then `[m²]`: gas is a
    /// spring of the stiffness `γ p/V A Aᵀ`. It is stiffest at the start, or when it went off in less room.
    pub fn stiffness(&self, u: &[Vec3], states: &[ShellState]) -> Option<(f64, Vec<Vec3>)> {
        let gas = self.gas?;
        let still = vec![Vec3::zeros(); self.nodes.len()];
        let off = states.iter().any(|state| state.began.is_some());
        let [first, grown] = if off { self.room(u, states) } else { [gas.start, 0.0] };
        let narrow = gas.volume(first, grown) < gas.start;
        let (volume, at) = match (narrow, gas.given) {
            (false, _) => (gas.start, &still[..]),
            (true, true) => (gas.volume(first, grown), u),
            // It may become narrower still.
            (true, false) => (gas.own, u),
        };
        let mut areas = still.clone();
        self.shells.iter().for_each(|shell| shell.add_areas(&self.start, at, &mut areas));
        let own = if gas.given { first } else { gas.own };
        Some((gas.gamma * self.pressure * libm::pow(own / volume, gas.gamma) / volume, areas))
    }

    /// Volume that its gas has at first, and by how much that has grown `[m³]`.
    fn room(&self, u: &[Vec3], states: &[ShellState]) -> [f64; 2] {
        let Some(gas) = self.gas else { return [0.0; 2] };
        let (mut all, mut began) = (0.0, 0.0);
        for (shell, state) in self.shells.iter().zip(states) {
            let volume = state.left.unwrap_or_else(|| shell.volume(&self.start, u));
            all += volume;
            began += state.began.unwrap_or(volume);
        }
        let grown = all - began;
        match (gas.given, gas.own_room) {
            (true, _) => [began, grown],
            // No joint is too narrow for the explosive that is in it,
            (_, true) => [gas.own, grown.max(0.0)],
            // and where rock has moved into its cavity it makes its room.
            _ => [began.max(gas.own), grown],
        }
    }

    /// Forces and gas states at nodal displacements u.
    pub fn push(&self, u: &[Vec3], states: &[ShellState]) -> ChargeForces {
        let mut forces = vec![Vec3::zeros(); self.nodes.len()];
        let (mut all, mut now) = (0.0, Vec::with_capacity(self.shells.len()));
        for (shell, state) in self.shells.iter().zip(states) {
            let volume = state.left.unwrap_or_else(|| shell.volume(&self.start, u));
            let left = state.left.is_some() || shell.is_open(u);
            all += volume;
            now.push(ShellState {
                began: state.began.or(Some(volume)),
                left: left.then_some(volume),
            });
            if !left {
                shell.add_areas(&self.start, u, &mut forces);
            }
        }
        let [first, grown] = self.room(u, &now);
        let pressure = self.pressure * self.gas.map_or(1.0, |gas| gas.part(first, grown));
        forces.iter_mut().for_each(|force| *force *= pressure);
        ChargeForces { pressure, volume: all, forces, shells: now }
    }
}
