//! Supports: the force that makes a fixed or driven node move as prescribed.

use crate::model::conditions::SupportedAxis;
use crate::state::motion::{Coefficients, Motion};
use ddem_mechanics::math::lanes::Lanes;

/// Supports of one pack.
#[derive(Clone, Copy)]
pub(crate) struct Supports<'a> {
    pub(crate) list: &'a [SupportedAxis],
    /// Velocity of each support (`fix`) `[m/s]`.
    pub(crate) velocities: &'a [[f64; 3]],
    /// Index of the pack's first value in a nodal field.
    pub(crate) first: usize,
}

impl Supports<'_> {
    /// Adds the reactions with which (M2) gives the prescribed velocities to `f`, and stores them
    /// in `reactions` `[N]`.
    pub(crate) fn react(
        &self,
        motion: &Motion,
        coefficients: &Coefficients,
        v: &[Lanes],
        f: &mut [Lanes],
        reactions: &mut [f64],
    ) {
        for (support, reaction) in self.list.iter().zip(reactions) {
            let (at, lane) = (support.at as usize - self.first, support.lane as usize);
            let target = self.velocities[support.fix as usize][support.axis as usize];
            let (now, force) = (v[at].0[lane], f[at].0[lane]);
            let whole = motion.force_for(now, target, coefficients.at(at, lane)) - force;
            f[at].0[lane] = force + whole;
            *reaction = whole * support.share;
        }
    }

    /// Sets the prescribed velocities, so that rounding does not let a held node creep.
    pub(crate) fn enforce(&self, v: &mut [Lanes]) {
        for support in self.list {
            let target = self.velocities[support.fix as usize][support.axis as usize];
            v[support.at as usize - self.first].0[support.lane as usize] = target;
        }
    }

    /// Power of the reactions at the velocities `v` `[W]`.
    pub(crate) fn power(&self, v: &[Lanes], reactions: &[f64]) -> f64 {
        let power = self.list.iter().zip(reactions).map(|(support, reaction)| {
            reaction * v[support.at as usize - self.first].0[support.lane as usize]
        });
        power.sum()
    }

    /// Sum `Σ (Q + R)²` of the loads `q`, if any act, and the reactions `[N²]`.
    pub(crate) fn applied(&self, q: Option<&[Lanes]>, reactions: &[f64]) -> f64 {
        let Some(q) = q else { return reactions.iter().map(|r| r * r).sum() };
        let square = |all: &Lanes| Lanes(all.0.map(|x| x * x)).sum();
        let mut held = self.list.iter().zip(reactions).peekable();
        let (mut sum, mut from) = (0.0, 0);
        while let Some(&(support, _)) = held.peek() {
            let at = support.at as usize - self.first;
            q[from..at].iter().for_each(|q| sum += square(q));
            let mut all = q[at];
            while let Some((s, r)) = held.next_if(|(s, _)| s.at == support.at) {
                all.0[s.lane as usize] += r;
            }
            sum += square(&all);
            from = at + 1;
        }
        q[from..].iter().for_each(|q| sum += square(q));
        sum
    }
}
