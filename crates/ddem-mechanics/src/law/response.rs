//! Springs of a failed point: contact, friction with slip, softening.
//!
//! One damage χ grows from 0 at the peak to 1, where only the residual strength is left:
//!
//! ```text
//! tension   T_n ≤ (1−χ) σ_t, unloading along the secant; no tension at χ = 1
//! pressure  T_n = k_n (δ_n − dilation), negative
//! shear     T_s = k_s (δ_s − s),  |T_s| ≤ (1−χ) peak(T_n) + χ residual(T_n)
//! ```
//!
//! χ grows with the inelastic opening over `2G_I/σ_t` and with slip over `2G_II/(peak − residual)`.
//! Per unit area, pure opening takes `G_I`, and sliding under a pressure takes `G_II` above the
//! residual, for any stiffness.
//!
//! The residual strength acts on closed faces only. An open point without bond carries nothing, and
//! its stick position is reset. Faces that have parted have no cohesion when they close (χ = 2).
//! Otherwise a point that opens and closes under little pressure would gain energy.
//!
//! In a relaxation slip, dilation and damage follow the direct path from the last equilibrium. They
//! depend on the present displacement alone, not on how often the motion went past it.

use nalgebra::Vector2;

use super::{
    Equilibrium, JointDisplacement, JointLaw, PointLoss, PointState, Softening, SpringStiffness,
    Traction,
};

/// Damage of faces that have parted: only friction is left.
const PARTED: f64 = 2.0;

/// Updates the state and the traction of a failed point for a displacement. Returns the losses since
/// the last update `[J/m²]`. With [`PointState::equilibrium`] slip and damage continue from there.
#[inline(always)]
pub(super) fn respond<L: JointLaw + ?Sized>(
    law: &L,
    stiffness: SpringStiffness,
    displacement: JointDisplacement,
    state: &mut PointState,
) -> PointLoss {
    let before = *state;
    let given = law.softening();
    let softening = given.unwrap_or_default();
    let gap = displacement.normal - before.dilation;
    if let Some(equilibrium) = before.equilibrium {
        state.slip = equilibrium.stuck(displacement, gap);
        // Faces that have parted since the equilibrium stay parted.
        state.damage = if before.damage >= PARTED { PARTED } else { equilibrium.damage };
    }
    let (start_damage, start_slip) = (state.damage, state.slip);
    let normal = if gap > 0.0 {
        let tension = law.tension();
        state.damage = tensile_damage(tension, stiffness.normal, softening, gap, start_damage);
        if state.damage >= 1.0 && law.residual(0.0) > 0.0 {
            state.damage = PARTED;
        }
        secant(tension, stiffness.normal, softening, state.damage) * gap
    } else {
        if start_damage < 1.0 && given.is_none() {
            state.damage = 1.0;
        }
        stiffness.normal * gap * contact_fraction(&before, gap)
    };
    (state.gap, state.applied_dilation) = (gap, before.dilation);
    state.traction.normal = normal;
    slide(law, stiffness.shear, softening, displacement, state);
    let tan_dilation = law.tan_dilation();
    if tan_dilation > 0.0 {
        // Sliding back over the roughness closes the opening that slip caused.
        let further = if gap <= 0.0 { state.slip.norm() - start_slip.norm() } else { 0.0 };
        let from = before.equilibrium.map_or(before.dilation, |equilibrium| equilibrium.dilation);
        state.dilation = (from + tan_dilation * further).max(0.0);
    }
    loss(law, &before, state)
}

/// Fraction of the pressure that acts on faces that have just met or are about to part. They touch
/// during a part of the step only. The full pressure would take or do more work than the springs
/// hold, and bouncing blocks would gain or lose energy with every contact.
#[inline(always)]
fn contact_fraction(before: &PointState, gap: f64) -> f64 {
    let du = gap - before.gap;
    if gap >= 0.0 || before.equilibrium.is_some() {
        1.0
    } else if before.gap > 0.0 && before.traction.normal == 0.0 {
        0.5 - 0.5 * gap / (before.gap - gap)
    } else if gap + du > 0.0 {
        0.5 - 0.5 * gap / du
    } else {
        1.0
    }
}

impl Equilibrium {
    /// Slip at which a point begins to stick on the direct path to a displacement. If it was open
    /// without a bond, this is the position at which it closes.
    fn stuck(&self, displacement: JointDisplacement, gap: f64) -> Vector2<f64> {
        if self.damage < 1.0 || self.gap <= 0.0 || gap >= 0.0 {
            return self.slip;
        }
        self.slip + (displacement.shear - self.slip) * (self.gap / (self.gap - gap))
    }
}

/// Damage after opening to a gap.
fn tensile_damage(
    tension: f64,
    stiffness: f64,
    softening: Softening,
    gap: f64,
    damage: f64,
) -> f64 {
    let elastic = tension / stiffness;
    if softening.opening <= elastic {
        return 1.0;
    }
    let reached = (gap - elastic) / (softening.opening - elastic);
    damage.max(reached.min(1.0))
}

/// Secant stiffness to the damaged tensile peak `[Pa/m]`.
fn secant(tension: f64, stiffness: f64, softening: Softening, damage: f64) -> f64 {
    if damage <= 0.0 {
        return stiffness;
    }
    if damage >= 1.0 {
        return 0.0;
    }
    let elastic = tension / stiffness;
    (1.0 - damage) * tension / (elastic + damage * (softening.opening - elastic))
}

/// Updates the shear traction: elastic up to the limit, then slip along the traction.
#[inline(always)]
fn slide<L: JointLaw + ?Sized>(
    law: &L,
    stiffness: f64,
    softening: Softening,
    displacement: JointDisplacement,
    state: &mut PointState,
) {
    let trial = (displacement.shear - state.slip) * stiffness;
    let size = trial.norm();
    let (peak, residual) = limits(law, state);
    let damage = state.damage.min(1.0);
    let limit = (1.0 - damage) * peak + damage * residual;
    if size <= limit {
        state.traction.shear = trial;
        return;
    }
    let mut strength = residual;
    if state.damage < 1.0 {
        // The limit falls while the point slips; both are solved together.
        let per_slip = damage_per_slip(law, softening, state.traction.normal);
        let fall = (peak - residual) * per_slip;
        let damage = state.damage + (size - limit) / (stiffness - fall) * per_slip;
        state.damage = if fall < stiffness && damage < 1.0 { damage } else { 1.0 };
        strength = (1.0 - state.damage) * peak + state.damage * residual;
    }
    state.traction.shear = if strength > 0.0 { trial * (strength / size) } else { trial * 0.0 };
    state.slip = if strength > 0.0 {
        displacement.shear - state.traction.shear / stiffness
    } else {
        displacement.shear
    };
}

/// Damage per unit of slip under a normal traction `[1/m]`; tension counts as no traction.
fn damage_per_slip<L: JointLaw + ?Sized>(law: &L, softening: Softening, normal: f64) -> f64 {
    let pressed = normal.min(0.0);
    let drop = law.peak(pressed) - law.residual(pressed);
    if drop > 0.0 { drop / (2.0 * softening.sliding) } else { f64::INFINITY }
}

/// Peak and residual shear strength under the traction of spring and dashpot. The residual acts on
/// closed faces only.
#[inline(always)]
fn limits<L: JointLaw + ?Sized>(law: &L, state: &PointState) -> (f64, f64) {
    let normal = state.traction.normal + state.dashpot_traction();
    let cohesion = if state.damage >= PARTED { law.residual(0.0) } else { 0.0 };
    let residual = if state.gap <= 0.0 { (law.residual(normal) - cohesion).max(0.0) } else { 0.0 };
    let peak = if state.damage < 1.0 { law.peak(normal) } else { residual };
    // Softening never increases the strength.
    (peak.max(residual), residual)
}

/// Losses `∫ T · d(inelastic opening and slip)` by the trapezoidal rule, as in the time step `[J/m²]`.
#[inline(always)]
fn loss<L: JointLaw + ?Sized>(law: &L, before: &PointState, after: &PointState) -> PointLoss {
    let mut loss = PointLoss::default();
    let (old, new): (Traction, Traction) = (before.traction, after.traction);
    // Area between two secants; zero along a straight line.
    let area = 0.5 * (old.normal * after.gap - new.normal * before.gap);
    if old.normal > 0.0 || new.normal > 0.0 {
        loss.fracture = area
    } else {
        loss.contact = area
    }
    let slip = after.slip - before.slip;
    let work = 0.5 * (old.shear + new.shear).dot(&slip);
    // The work of the residual strength is friction; so is all work once the bond has failed.
    let friction = if before.damage < 1.0 {
        let (_, residual) = limits(law, after);
        work.min(residual * slip.norm())
    } else {
        work
    };
    loss.fracture += work - friction;
    loss.friction += friction
        + 0.5 * (old.normal + new.normal) * (after.applied_dilation - before.applied_dilation);
    loss
}

/// Energy of a failed point per unit area, in its springs and its energy excess `[J/m²]`.
pub fn stored(stiffness: SpringStiffness, state: &PointState) -> f64 {
    let Traction { normal, shear } = state.traction;
    0.5 * normal * state.gap + 0.5 * shear.norm_squared() / stiffness.shear + state.energy_excess
}
