//! Explicit time stepping, (M2).

use super::{Csr, System};

/// A motion under a constant load, step by step:
/// `v⁺ = [ (m/Δt − c/2) v⁻ + F ] / (m/Δt + c/2)`, `u⁺ = u + Δt v⁺`, `F = load − K u`.
#[derive(Clone, Debug)]
pub struct Transient<'a> {
    system: &'a System,
    masses: Vec<f64>,
    damping: Vec<f64>,
    /// Matrix C of the force `−C v⁻`, with the velocity half a step ago.
    pub viscous: Option<Csr>,
    load: Vec<f64>,
    fixed: Vec<bool>,
    time_step: f64,
    started: bool,
    /// The present displacement.
    pub displacement: Vec<f64>,
    /// The velocity half a step ago (before the first step, the initial velocity).
    pub velocity: Vec<f64>,
    /// Steps taken.
    pub steps: usize,
}

impl<'a> Transient<'a> {
    /// A motion from rest at zero displacement; `damping` is c, N·s/m, by degree of freedom.
    pub fn new(
        system: &'a System,
        load: Vec<f64>,
        damping: Vec<f64>,
        fixed: Vec<bool>,
        time_step: f64,
    ) -> Self {
        let zero = vec![0.0; system.dofs()];
        Self {
            system,
            masses: system.dof_masses(),
            damping,
            viscous: None,
            load,
            fixed,
            time_step,
            started: false,
            displacement: zero.clone(),
            velocity: zero,
            steps: 0,
        }
    }

    /// The unbalanced force on every degree of freedom, zero on fixed ones.
    pub fn force(&self) -> Vec<f64> {
        let mut force = self.system.stiffness.multiply(&self.displacement);
        if let Some(viscous) = &self.viscous {
            let drag = viscous.multiply(&self.velocity);
            force.iter_mut().zip(drag).for_each(|(force, drag)| *force += drag);
        }
        for (dof, force) in force.iter_mut().enumerate() {
            *force = if self.fixed[dof] { 0.0 } else { self.load[dof] - *force };
        }
        force
    }

    /// Takes one step, `v⁺ = [(m/h − c/2) v⁻ + F] / (m/h + c/2)` with `h = Δt`. The first step
    /// begins at the present time and has `h = Δt/2`.
    pub fn step(&mut self) {
        let force = self.force();
        for (dof, force) in force.into_iter().enumerate() {
            let interval = if self.started { self.time_step } else { self.time_step / 2.0 };
            let (mass, damping) = (self.masses[dof] / interval, self.damping[dof] / 2.0);
            let before = self.velocity[dof];
            let moved = ((mass - damping) * before + force) / (mass + damping);
            let after = if self.fixed[dof] { 0.0 } else { moved };
            self.velocity[dof] = after;
            self.displacement[dof] += self.time_step * after;
        }
        self.started = true;
        self.steps += 1;
    }

    /// Takes several steps.
    pub fn run(&mut self, steps: usize) {
        for _ in 0..steps {
            self.step();
        }
    }

    /// The present time.
    pub fn time(&self) -> f64 {
        self.steps as f64 * self.time_step
    }

    /// Kinetic energy at the half step of `velocity`.
    pub fn kinetic_energy(&self) -> f64 {
        self.masses.iter().zip(&self.velocity).map(|(m, v)| m * v * v / 2.0).sum()
    }
}
