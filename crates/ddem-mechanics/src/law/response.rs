//! The springs of a failed point: contact, friction with slip, softening.
//!
//! One damage D runs from 0 at the peak to 1, where the residual is left:
//!
//! ```text
//! tension   T_n ≤ (1−D) σ_t, unloading along the secant; no tension at D = 1
//! pressure  T_n = k_n (δ_n − dilation), negative
//! shear     T_s = k_s (δ_s − s),  |T_s| ≤ (1−D) peak(T_n) + D residual(T_n)
//! ```
//!
//! D grows by the inelastic opening over `2G_I/σ_t` and by slip over `2G_II/(peak − residual)`: pure
//! opening takes `G_I` for each unit of area and sliding under a pressure `G_II` above the residual,
//! whatever the stiffness. The residual acts on closed faces only, so that an open point without bond
//! bears nothing and forgets where it stuck. Faces that have parted bear no cohesion any more when they
//! close, D = 2: otherwise a point that opens and closes under little pressure takes energy from nowhere.
//!
//! In a relaxation slip, dilation and damage are those of the way straight from the last equilibrium:
//! they depend on the present opening alone, and not on how often the motion went past it.

use nalgebra::Vector2;

use super::{
    Equilibrium, JointLaw, Opening, PointLoss, PointState, Softening, SpringStiffness, Traction,
};

/// Damage of faces that have parted: nothing is left but friction.
const PARTED: f64 = 2.0;

/// Traction of a failed point at an opening, left in its memory; returns what it loses on the way there. Where
/// [`PointState::equilibrium`] is there, slip and damage go on from it.
#[inline(always)]
pub(super) fn respond<L: JointLaw + ?Sized>(
    law: &L,
    stiffness: SpringStiffness,
    opening: Opening,
    state: &mut PointState,
) -> PointLoss {
    let before = *state;
    let softening = law.softening().unwrap_or_default();
    let gap = opening.normal - before.dilation;
    if let Some(equilibrium) = before.equilibrium {
        state.slip = equilibrium.stuck(opening, gap);
        // What has parted on the way does not grow together.
        state.damage = if before.damage >= PARTED { PARTED } else { equilibrium.damage };
    }
    let start = *state;
    let tension = law.tension();
    let normal = if gap > 0.0 {
        state.damage = opened(tension, stiffness.normal, softening, gap, start.damage);
        if state.damage >= 1.0 && law.residual(0.0) > 0.0 {
            state.damage = PARTED;
        }
        secant(tension, stiffness.normal, softening, state.damage) * gap
    } else {
        if start.damage < 1.0 && law.softening().is_none() {
            state.damage = 1.0;
        }
        stiffness.normal * gap * eased(&before, gap)
    };
    (state.gap, state.lifted) = (gap, before.dilation);
    state.traction.normal = normal;
    slide(law, stiffness.shear, softening, opening, state);
    let tan_dilation = law.tan_dilation();
    if tan_dilation > 0.0 {
        // Slip back over the roughness closes what slip made.
        let further = if gap <= 0.0 { state.slip.norm() - start.slip.norm() } else { 0.0 };
        let from = before.equilibrium.map_or(before.dilation, |equilibrium| equilibrium.dilation);
        state.dilation = (from + tan_dilation * further).max(0.0);
    }
    loss(law, &before, state)
}

/// Part of the pressure that acts on faces that have just met, or are about to part. They touch for a
/// part of the step only: the whole pressure would take, or do, more work than the springs hold, and
/// what bounces gain or lose energy with every contact.
fn eased(before: &PointState, gap: f64) -> f64 {
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
    /// Slip at which a point begins to stick on the way straight to an opening: where it closes, if it
    /// was open without a bond.
    fn stuck(&self, opening: Opening, gap: f64) -> Vector2<f64> {
        if self.damage < 1.0 || self.gap <= 0.0 || gap >= 0.0 {
            return self.slip;
        }
        self.slip + (opening.shear - self.slip) * (self.gap / (self.gap - gap))
    }
}

/// Damage after opening to a gap.
fn opened(tension: f64, stiffness: f64, softening: Softening, gap: f64, damage: f64) -> f64 {
    let elastic = tension / stiffness;
    if softening.opening <= elastic {
        return 1.0;
    }
    let reached = (gap - elastic) / (softening.opening - elastic);
    damage.max(reached.min(1.0))
}

/// Stiffness towards a damaged tensile peak `[Pa/m]`.
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

/// Shear: elastic up to the limit, then slip along the traction.
fn slide<L: JointLaw + ?Sized>(
    law: &L,
    stiffness: f64,
    softening: Softening,
    opening: Opening,
    state: &mut PointState,
) {
    let trial = (opening.shear - state.slip) * stiffness;
    let size = trial.norm();
    let (peak, residual) = limits(law, state);
    let damage = state.damage.min(1.0);
    let limit = (1.0 - damage) * peak + damage * residual;
    if size <= limit {
        state.traction.shear = trial;
        return;
    }
    let mut bears = residual;
    if state.damage < 1.0 {
        // The limit falls while the point slips: both at once.
        let per_slip = damage_per_slip(law, softening, state.traction.normal);
        let fall = (peak - residual) * per_slip;
        let damage = state.damage + (size - limit) / (stiffness - fall) * per_slip;
        state.damage = if fall < stiffness && damage < 1.0 { damage } else { 1.0 };
        bears = (1.0 - state.damage) * peak + state.damage * residual;
    }
    state.traction.shear = if bears > 0.0 { trial * (bears / size) } else { trial * 0.0 };
    state.slip =
        if bears > 0.0 { opening.shear - state.traction.shear / stiffness } else { opening.shear };
}

/// Damage that slip does under a normal traction `[1/m]`: in tension as without it.
fn damage_per_slip<L: JointLaw + ?Sized>(law: &L, softening: Softening, normal: f64) -> f64 {
    let pressed = normal.min(0.0);
    let drop = law.peak(pressed) - law.residual(pressed);
    if drop > 0.0 { drop / (2.0 * softening.sliding) } else { f64::INFINITY }
}

/// Peak and residual shear strength under the pressure of spring and dashpot; the residual acts on closed faces
/// only.
fn limits<L: JointLaw + ?Sized>(law: &L, state: &PointState) -> (f64, f64) {
    let normal = state.traction.normal + state.dashpot();
    let cohesion = if state.damage >= PARTED { law.residual(0.0) } else { 0.0 };
    let residual = if state.gap <= 0.0 { (law.residual(normal) - cohesion).max(0.0) } else { 0.0 };
    let peak = if state.damage < 1.0 { law.peak(normal) } else { residual };
    // Softening never makes stronger.
    (peak.max(residual), residual)
}

/// `∫ T · d(inelastic opening and slip)` by the trapezoidal rule, which is that of the step.
fn loss<L: JointLaw + ?Sized>(law: &L, before: &PointState, after: &PointState) -> PointLoss {
    let mut loss = PointLoss::default();
    let (old, new): (Traction, Traction) = (before.traction, after.traction);
    // The area between two secants: nothing along a straight line.
    let area = 0.5 * (old.normal * after.gap - new.normal * before.gap);
    if old.normal > 0.0 || new.normal > 0.0 {
        loss.fracture = area
    } else {
        loss.contact = area
    }
    let slip = after.slip - before.slip;
    let work = 0.5 * (old.shear + new.shear).dot(&slip);
    // What the residual bears is friction, and all that is left when the bond has gone.
    let friction = if before.damage < 1.0 {
        let (_, residual) = limits(law, after);
        work.min(residual * slip.norm())
    } else {
        work
    };
    loss.fracture += work - friction;
    loss.friction += friction + 0.5 * (old.normal + new.normal) * (after.lifted - before.lifted);
    loss
}

/// Energy that a failed point holds for each unit of area: in its springs and on its account `[J/m²]`.
pub fn stored(stiffness: SpringStiffness, state: &PointState) -> f64 {
    let Traction { normal, shear } = state.traction;
    0.5 * normal * state.gap + 0.5 * shear.norm_squared() / stiffness.shear + state.account
}
