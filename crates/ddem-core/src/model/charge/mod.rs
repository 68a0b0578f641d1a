//! Charges (§11): the surfaces on which their gas acts, and its pressure.
//!
//! The gas fills one or several closed surfaces of facets between nodes. At an opening of a cavity
//! the surface ends. A pressure p exerts the forces `p A` on the nodes, with their present area
//! vectors A. On a closed surface these forces have no resultant and no moment, and their work is
//! `p dV`.

mod gas_surface;
mod size;

pub use self::gas_surface::GasSurface;
pub use self::size::ChargeSize;
use serde::{Deserialize, Serialize};

use ddem_mesh::Vec3;

/// The gas in one surface of a charge.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct GasSurfaceState {
    /// Volume of the surface at detonation `[m³]`; `None` before.
    pub detonation_volume: Option<f64>,
    /// Volume of the surface at venting `[m³]`; `None` before.
    pub venting_volume: Option<f64>,
}

/// Gas of a charge that expands.
#[derive(Clone, Copy, Debug)]
pub struct Gas {
    /// Adiabatic index.
    pub gamma: f64,
    /// Volume at which it has the pressure of the charge `[m³]`.
    pub reference_volume: f64,
    /// Volume at the start `[m³]`.
    pub start: f64,
    /// True if the gas expands in joints: its volume is `reference_volume` plus the growth of the
    /// surfaces since detonation.
    pub expands_in_joint: bool,
    /// True if the pressure of the charge is that of the gas in its volume at detonation.
    pub given: bool,
}

impl Gas {
    /// Volume of the gas `[m³]`: the initial volume `first` plus `grown`. It is at least the
    /// explosive's own volume or, with a `given` pressure, a millionth of `first`: it stays
    /// positive when walls have met.
    fn volume(&self, first: f64, grown: f64) -> f64 {
        (first + grown).max(if self.given { 1e-6 * first } else { self.reference_volume })
    }

    /// Pressure of the gas as a fraction of the pressure of the charge.
    pub fn pressure_ratio(&self, first: f64, grown: f64) -> f64 {
        let own = if self.given { first } else { self.reference_volume };
        libm::pow(own / self.volume(first, grown), self.gamma)
    }
}

/// A charge.
#[derive(Clone, Debug)]
pub struct GasCharge {
    /// Nodes on which it acts, in ascending order.
    pub nodes: Vec<u32>,
    /// Reference positions of these nodes `[m]`.
    pub start: Vec<Vec3>,
    /// Surfaces of the gas, separate from each other.
    pub surfaces: Vec<GasSurface>,
    /// Pressure `[Pa]`: of the gas in its own volume, or at factor 1.
    pub pressure: f64,
    /// The gas, if it expands.
    pub gas: Option<Gas>,
    /// Size at the start.
    pub size: ChargeSize,
}

/// State of a charge at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChargeState {
    /// Pressure of its gas `[Pa]`; 0 before detonation and in stages in which it is not in force.
    pub pressure: f64,
    /// Volume of the cavity or of the joints `[m³]`. Vented surfaces keep their volume at venting.
    pub volume: f64,
    /// True once the gas has vented from all surfaces.
    pub vented: bool,
    /// Volume of the cavity or of the joints at detonation `[m³]`; `None` before.
    pub detonation_volume: Option<f64>,
}

/// Forces of a charge on its nodes.
#[derive(Debug)]
pub struct ChargeForces {
    /// Pressure at factor 1 `[Pa]`.
    pub pressure: f64,
    /// Volume of all surfaces `[m³]`.
    pub volume: f64,
    /// Nodal forces at factor 1 `[N]`, in the order of the charge's nodes.
    pub forces: Vec<Vec3>,
    /// State of each surface.
    pub surfaces: Vec<GasSurfaceState>,
}

impl GasCharge {
    /// Nodes of each cavity wall on which it acts.
    pub fn walls(&self) -> impl Iterator<Item = Vec<u32>> {
        let in_cavity = self.surfaces.iter().filter(|_| self.size.walls > 0);
        let node = |&at: &u32| self.nodes[at as usize];
        in_cavity.flat_map(GasSurface::walls).map(move |wall| wall.iter().map(node).collect())
    }

    /// Stiffness factor of an expanding gas, `γ p/V` `[Pa/m³]`, and its nodal area vectors A
    /// `[m²]`; `None` if it does not expand. The gas is a spring of the stiffness `γ p/V A Aᵀ`. It
    /// is stiffest at the start, or at detonation if its volume is smaller then.
    pub fn stiffness(&self, u: &[Vec3], states: &[GasSurfaceState]) -> Option<(f64, Vec<Vec3>)> {
        let gas = self.gas?;
        let still = vec![Vec3::zeros(); self.nodes.len()];
        let detonated = states.iter().any(|state| state.detonation_volume.is_some());
        let [first, grown] = if detonated { self.volumes(u, states) } else { [gas.start, 0.0] };
        let narrow = gas.volume(first, grown) < gas.start;
        let (volume, at) = match (narrow, gas.given) {
            (false, _) => (gas.start, &still[..]),
            (true, true) => (gas.volume(first, grown), u),
            // The volume may decrease further, down to the explosive's own.
            (true, false) => (gas.reference_volume, u),
        };
        let mut areas = still.clone();
        self.surfaces.iter().for_each(|surface| surface.add_areas(&self.start, at, &mut areas));
        let own = if gas.given { first } else { gas.reference_volume };
        Some((gas.gamma * self.pressure * libm::pow(own / volume, gas.gamma) / volume, areas))
    }

    /// Initial volume of its gas, and the growth since then `[m³]`.
    fn volumes(&self, u: &[Vec3], states: &[GasSurfaceState]) -> [f64; 2] {
        let Some(gas) = self.gas else { return [0.0; 2] };
        let (mut all, mut detonation_volume) = (0.0, 0.0);
        for (surface, state) in self.surfaces.iter().zip(states) {
            let volume = state.venting_volume.unwrap_or_else(|| surface.volume(&self.start, u));
            all += volume;
            detonation_volume += state.detonation_volume.unwrap_or(volume);
        }
        let grown = all - detonation_volume;
        match (gas.given, gas.expands_in_joint) {
            (true, _) => [detonation_volume, grown],
            // A joint is never too narrow for its explosive.
            (_, true) => [gas.reference_volume, grown.max(0.0)],
            // If rock has moved into the cavity, the explosive makes its own room.
            _ => [detonation_volume.max(gas.reference_volume), grown],
        }
    }

    /// Forces and gas states at nodal displacements u.
    pub fn gas_forces(&self, u: &[Vec3], states: &[GasSurfaceState]) -> ChargeForces {
        let mut forces = vec![Vec3::zeros(); self.nodes.len()];
        let (mut all, mut now) = (0.0, Vec::with_capacity(self.surfaces.len()));
        for (surface, state) in self.surfaces.iter().zip(states) {
            let volume = state.venting_volume.unwrap_or_else(|| surface.volume(&self.start, u));
            let vented = state.venting_volume.is_some() || surface.is_open(u);
            all += volume;
            now.push(GasSurfaceState {
                detonation_volume: state.detonation_volume.or(Some(volume)),
                venting_volume: vented.then_some(volume),
            });
            if !vented {
                surface.add_areas(&self.start, u, &mut forces);
            }
        }
        let [first, grown] = self.volumes(u, &now);
        let pressure = self.pressure * self.gas.map_or(1.0, |gas| gas.pressure_ratio(first, grown));
        forces.iter_mut().for_each(|force| *force *= pressure);
        ChargeForces { pressure, volume: all, forces, surfaces: now }
    }
}
