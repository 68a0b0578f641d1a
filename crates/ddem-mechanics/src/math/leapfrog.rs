//! Leap-frog step (M2) of one degree of freedom (§6): of a node, a rigid block or a free-field
//! column.

use super::number::Number;

/// Coefficients `a` and `b` of `v⁺ = a v⁻ + b F`, that is of
/// `v⁺ = [(m/h − c/2) v⁻ + F] / (m/h + c/2)`, from `m/h` and the damping c.
#[inline]
pub fn coefficients(per_interval: f64, c: f64) -> [f64; 2] {
    let below = per_interval + 0.5 * c;
    [(per_interval - 0.5 * c) / below, 1.0 / below]
}

/// Cundall's local damping `α |F| sign v`, which opposes the motion; 0 without motion.
#[inline(always)]
pub fn local_damping<N: Number>(alpha: f64, force: N, v: N) -> N {
    let zero = v.like(0.0);
    let most = force.or_more(-force) * alpha;
    N::select(v.exceeds(zero), most, N::select(zero.exceeds(v), -most, zero))
}

/// Force of which local damping leaves the force `left`.
#[inline]
pub fn before_local_damping(alpha: f64, left: f64, v: f64) -> f64 {
    let with = if v == 0.0 { 0.0 } else { v.signum() * left.signum() };
    left / (1.0 - alpha * with)
}

#[cfg(test)]
mod tests {
    use fearless_simd::{Level, dispatch};

    use super::*;
    use crate::math::lanes::Lanes;

    /// Local damping opposes the motion, for one number and for four.
    #[test]
    fn local_damping_opposes_the_motion() {
        let forces = [3.0, -3.0, 5.0, -5.0];
        let velocities = [-2.0, 2.0, 0.0, -0.1];
        let expected = [-2.25, 2.25, 0.0, -3.75];
        let single: [f64; 4] =
            std::array::from_fn(|i| local_damping(0.75, forces[i], velocities[i]));
        assert_eq!(single, expected);
        let four = dispatch!(Level::new(), simd => {
            let (force, v) = (Lanes(forces).load(simd), Lanes(velocities).load(simd));
            Lanes::from(local_damping(0.75, force, v))
        });
        assert_eq!(four.0, expected);
    }
}
