//! Springs of failed points: contact, friction with slip, softening. The formulas serve one point or
//! four side by side.
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
//! Otherwise a point that opens and closes under little pressure would gain energy. Faces that are
//! closed in an equilibrium have it again ([`damage_at_equilibrium`](super::damage_at_equilibrium)).
//!
//! In a relaxation slip, dilation and damage follow the direct path from the last equilibrium. They
//! depend on the present displacement alone, not on how often the motion went past it.

use super::PARTED;
use super::points::{Displacements, LastEquilibrium, Loss, Points};
use super::strengths::Strengths;
use crate::math::number::Number;

/// Updates the states and the tractions of failed points with the normal and shear stiffnesses
/// `stiffness` for displacements. Returns the losses since the last update `[J/m²]`. While
/// [`Points::relaxing`], slip and damage continue from the last equilibrium.
#[inline(always)]
pub(super) fn respond<N: Number>(
    law: &(impl Strengths<N> + ?Sized),
    stiffness: [N; 2],
    displacement: Displacements<N>,
    points: &mut Points<N>,
) -> Loss<N> {
    let before = *points;
    let gap = displacement[0] - before.dilation;
    let (zero, one) = (gap.like(0.0), gap.like(1.0));
    if N::any(before.relaxing) {
        let stuck = before.equilibrium.stuck(displacement, gap);
        points.slip = select_both(before.relaxing, stuck, before.slip);
        // Faces that have parted since the equilibrium stay parted.
        let parted = before.damage.reaches(gap.like(PARTED));
        let damage = N::select(parted, gap.like(PARTED), before.equilibrium.damage);
        points.damage = N::select(before.relaxing, damage, before.damage);
    }
    let (start_damage, start_slip) = (points.damage, points.slip);
    let (softening, softens) = law.softens();
    let open = gap.exceeds(zero);
    // A brittle point that fails under pressure has only its residual strength.
    points.damage = N::select(softens | open, start_damage, start_damage.or_more(one));
    points.normal = stiffness[0] * gap * contact_fraction(&before, gap);
    if N::any(open) {
        let bond =
            TensileBond { tension: law.tensile(), stiffness: stiffness[0], last: softening[0] };
        let damage = bond.damage(gap, start_damage);
        let parts = damage.reaches(one) & law.residual_cohesion().exceeds(zero);
        let damage = N::select(parts, gap.like(PARTED), damage);
        points.damage = N::select(open, damage, points.damage);
        points.normal = N::select(open, bond.secant(damage) * gap, points.normal);
    }
    (points.gap, points.applied_dilation) = (gap, before.dilation);
    slide(law, stiffness[1], softening[1], displacement, points);
    let tan_dilation = law.dilatancy();
    let dilates = tan_dilation.exceeds(zero);
    if N::any(dilates) {
        // Sliding back over the roughness closes the opening that slip caused.
        let further = N::select(open, zero, size(points.slip) - size(start_slip));
        let from = N::select(before.relaxing, before.equilibrium.dilation, before.dilation);
        let dilation = (from + tan_dilation * further).or_more(zero);
        points.dilation = N::select(dilates, dilation, before.dilation);
    }
    loss(law, &before, points)
}

/// Fraction of the pressure that acts on faces that have just met or are about to part. They touch
/// during a part of the step only. The full pressure would take or do more work than the springs
/// hold, and bouncing blocks would gain or lose energy with every contact.
#[inline(always)]
fn contact_fraction<N: Number>(before: &Points<N>, gap: N) -> N {
    let (zero, one) = (gap.like(0.0), gap.like(1.0));
    let du = gap - before.gap;
    let pressed = zero.exceeds(gap) & !before.relaxing;
    let meet = before.gap.exceeds(zero) & before.normal.equals(zero);
    let part = (gap + du).exceeds(zero);
    if !N::any(pressed & (meet | part)) {
        return one;
    }
    let of_step = gap * 0.5 / du;
    let fraction = N::select(meet, of_step + 0.5, N::select(part, -of_step + 0.5, one));
    N::select(pressed, fraction, one)
}

impl<N: Number> LastEquilibrium<N> {
    /// Slip at which points begin to stick on the direct path to a displacement. If they were open
    /// without a bond, this is the position at which they close.
    #[inline(always)]
    fn stuck(&self, displacement: Displacements<N>, gap: N) -> [N; 2] {
        let (zero, one) = (gap.like(0.0), gap.like(1.0));
        let closes = self.damage.reaches(one) & self.gap.exceeds(zero) & zero.exceeds(gap);
        if !N::any(closes) {
            return self.slip;
        }
        let fraction = self.gap / (self.gap - gap);
        let [s, t] = self.slip;
        let at = [s + (displacement[1] - s) * fraction, t + (displacement[2] - t) * fraction];
        select_both(closes, at, self.slip)
    }
}

/// Bond of points in tension.
#[derive(Clone, Copy)]
struct TensileBond<N> {
    /// Tensile strength `[Pa]`.
    tension: N,
    /// Normal stiffness `[Pa/m]`.
    stiffness: N,
    /// Inelastic opening at which no tension is left `[m]`.
    last: N,
}

impl<N: Number> TensileBond<N> {
    /// Damage after opening to a gap.
    #[inline(always)]
    fn damage(&self, gap: N, damage: N) -> N {
        let one = gap.like(1.0);
        let elastic = self.tension / self.stiffness;
        let reached = (gap - elastic) / (self.last - elastic);
        N::select(self.last.exceeds(elastic), damage.or_more(reached.or_less(one)), one)
    }

    /// Secant stiffness to the damaged tensile peak `[Pa/m]`.
    #[inline(always)]
    fn secant(&self, damage: N) -> N {
        let (zero, one) = (damage.like(0.0), damage.like(1.0));
        let bonded = one.exceeds(damage);
        if !N::any(bonded) {
            return zero;
        }
        let elastic = self.tension / self.stiffness;
        let opening = elastic + damage * (self.last - elastic);
        let secant = N::select(bonded, (one - damage) * self.tension / opening, zero);
        N::select(damage.exceeds(zero), secant, self.stiffness)
    }
}

/// Updates the shear tractions: elastic up to the limit, then slip along the traction.
#[inline(always)]
fn slide<N: Number>(
    law: &(impl Strengths<N> + ?Sized),
    stiffness: N,
    softening: N,
    displacement: Displacements<N>,
    points: &mut Points<N>,
) {
    let [_, x, y] = displacement;
    let [s, t] = points.slip;
    let trial = [(x - s) * stiffness, (y - t) * stiffness];
    let trial_size = size(trial);
    let (zero, one) = (x.like(0.0), x.like(1.0));
    let (peak, residual) = limits(law, points);
    let damage = points.damage.or_less(one);
    let limit = (one - damage) * peak + damage * residual;
    let slips = trial_size.exceeds(limit);
    points.shear = trial;
    if !N::any(slips) {
        return;
    }
    let mut strength = residual;
    let softens = slips & one.exceeds(points.damage);
    if N::any(softens) {
        // The limit falls while the point slips; both are solved together.
        let per_slip = damage_per_slip(law, softening, points.normal);
        let fall = (peak - residual) * per_slip;
        let damage = points.damage + (trial_size - limit) / (stiffness - fall) * per_slip;
        let partly = stiffness.exceeds(fall) & one.exceeds(damage);
        points.damage = N::select(softens, N::select(partly, damage, one), points.damage);
        let left = (one - points.damage) * peak + points.damage * residual;
        strength = N::select(softens, left, strength);
    }
    let carries = strength.exceeds(zero);
    let part = N::select(carries, strength / trial_size, zero);
    let shear = [trial[0] * part, trial[1] * part];
    let elastic = [shear[0] / stiffness, shear[1] / stiffness];
    let slip = select_both(carries, [x - elastic[0], y - elastic[1]], [x, y]);
    points.shear = select_both(slips, shear, trial);
    points.slip = select_both(slips, slip, points.slip);
}

/// Damage per unit of slip under a normal traction `[1/m]`; tension counts as no traction.
#[inline(always)]
fn damage_per_slip<N: Number>(law: &(impl Strengths<N> + ?Sized), softening: N, normal: N) -> N {
    let zero = normal.like(0.0);
    let pressed = normal.or_less(zero);
    let drop = law.peak_at(pressed) - law.residual_at(pressed);
    N::select(drop.exceeds(zero), drop / (softening * 2.0), normal.like(f64::INFINITY))
}

/// Peak and residual shear strength under the traction of spring and dashpot. The residual acts on
/// closed faces only.
#[inline(always)]
fn limits<N: Number>(law: &(impl Strengths<N> + ?Sized), points: &Points<N>) -> (N, N) {
    let zero = points.gap.like(0.0);
    let normal = points.normal + points.dashpot_traction();
    let open = points.gap.exceeds(zero);
    let mut residual = zero;
    if N::any(!open) {
        let parted = points.damage.reaches(zero.like(PARTED));
        let mut strength = law.residual_at(normal);
        if N::any(parted) {
            strength = strength - N::select(parted, law.residual_cohesion(), zero);
        }
        residual = N::select(open, zero, strength.or_more(zero));
    }
    let bonded = zero.like(1.0).exceeds(points.damage);
    if !N::any(bonded) {
        return (residual, residual);
    }
    // Softening never increases the strength.
    let peak = law.peak_at(normal).or_more(residual);
    (N::select(bonded, peak, residual), residual)
}

/// Losses `∫ T · d(inelastic opening and slip)` by the trapezoidal rule, as in the time step `[J/m²]`.
#[inline(always)]
fn loss<N: Number>(
    law: &(impl Strengths<N> + ?Sized),
    before: &Points<N>,
    after: &Points<N>,
) -> Loss<N> {
    let (zero, one) = (after.gap.like(0.0), after.gap.like(1.0));
    // Area between two secants; zero along a straight line.
    let area = (before.normal * after.gap - after.normal * before.gap) * 0.5;
    let pulls = before.normal.exceeds(zero) | after.normal.exceeds(zero);
    let slip = [after.slip[0] - before.slip[0], after.slip[1] - before.slip[1]];
    let shear = [before.shear[0] + after.shear[0], before.shear[1] + after.shear[1]];
    let work = (shear[0] * slip[0] + shear[1] * slip[1]) * 0.5;
    // The work of the residual strength is friction; so is all work once the bond has failed.
    let mut friction = work;
    let bonded = one.exceeds(before.damage);
    if N::any(bonded) {
        let (_, residual) = limits(law, after);
        friction = N::select(bonded, work.or_less(residual * size(slip)), work);
    }
    let dilation = after.applied_dilation - before.applied_dilation;
    Loss {
        friction: friction + (before.normal + after.normal) * 0.5 * dilation,
        fracture: N::select(pulls, area, zero) + (work - friction),
        contact: N::select(pulls, zero, area),
        damping: zero,
    }
}

/// Length of a vector in the plane of the joint.
#[inline(always)]
fn size<N: Number>([s, t]: [N; 2]) -> N {
    (s * s + t * t).root()
}

#[inline(always)]
fn select_both<N: Number>(mask: N::Mask, yes: [N; 2], no: [N; 2]) -> [N; 2] {
    [N::select(mask, yes[0], no[0]), N::select(mask, yes[1], no[1])]
}
