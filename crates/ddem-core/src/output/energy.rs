//! Energies of the whole model.

use serde::{Deserialize, Serialize};

/// Energies at one time `[J]`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Energy {
    /// Kinetic energy, `½ v⁻ m v⁺` of the half steps before and after; `½ v m v` at the start of a
    /// stage.
    pub kinetic: f64,
    /// Strain energy of the blocks, whole rock between cells included.
    pub strain_bodies: f64,
    /// Strain energy of the joints.
    pub strain_joints: f64,
    /// Energy dissipated by damping so far.
    pub damping: f64,
    /// Energy dissipated by friction on failed joints and contacts so far, less the work of
    /// dilation.
    pub friction: f64,
    /// Energy dissipated by fracture of joints so far.
    pub fracture: f64,
    /// Energy lost so far where contacts form, end or change their points, and where faces meet or
    /// part within a step. It is a numerical error of the method.
    pub contact: f64,
    /// Work of loads, gravity and driven supports so far.
    #[serde(alias = "external")]
    pub external_work: f64,
    /// Kinetic + strain + damping + friction + fracture + contact − external work − initial energy.
    /// It is zero to rounding; in large rotations and failure the time step adds an error.
    pub balance: f64,
    /// Largest of the present energies, the energy at the start, and the external work at any time
    /// since then `[J]`.
    pub largest: f64,
}

impl Energy {
    /// Names of the columns, in the order of [`values`](Self::values).
    pub const NAMES: [&'static str; 9] = [
        "kinetic",
        "strain_bodies",
        "strain_joints",
        "friction",
        "fracture",
        "contact",
        "damping",
        "external_work",
        "balance",
    ];

    pub(crate) fn new(
        kinetic: f64,
        [blocks, joints]: [f64; 2],
        [damping, friction, fracture, contact]: [f64; 4],
        external_work: f64,
        [initial, worked]: [f64; 2],
    ) -> Self {
        let mut energy = Self {
            kinetic,
            strain_bodies: blocks,
            strain_joints: joints,
            damping,
            friction,
            fracture,
            contact,
            external_work,
            balance: kinetic + blocks + joints + (damping + friction + fracture + contact)
                - external_work
                - initial,
            largest: 0.0,
        };
        let others = Self { balance: 0.0, ..energy };
        let before = initial.abs().max(worked);
        energy.largest = others.values().into_iter().fold(before, |most, e| most.max(e.abs()));
        energy
    }

    /// Energy error relative to the largest energy since the start: the sizes of the balance and of
    /// the contact losses together; 0 without error.
    #[must_use]
    pub fn imbalance(&self) -> f64 {
        let error = self.balance.abs() + self.contact.abs();
        if error == 0.0 { 0.0 } else { error / self.largest }
    }

    /// Energies, in the order of [`NAMES`](Self::NAMES).
    #[must_use]
    pub fn values(&self) -> [f64; 9] {
        [
            self.kinetic,
            self.strain_bodies,
            self.strain_joints,
            self.friction,
            self.fracture,
            self.contact,
            self.damping,
            self.external_work,
            self.balance,
        ]
    }
}
