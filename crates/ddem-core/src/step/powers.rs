//! What supports and dashpots do to the nodes of a pack, and how large what is applied is.

use super::Context;
use crate::conditions::Support;
use crate::force::boundary;
use crate::lanes::Lanes;

/// Power of the supports with the velocities `v`.
pub(super) fn support_power(
    context: Context<'_>,
    index: usize,
    v: &[Lanes],
    reactions: &[f64],
) -> f64 {
    let first = 3 * context.model.packs.packs[index].start;
    let supports = &context.active.supports[context.active.supports_of(index)];
    let power = supports.iter().zip(reactions).map(|(support, reaction)| {
        reaction * v[support.at as usize - first].0[support.lane as usize]
    });
    power.sum()
}

/// Power that the dashpots of boundaries take with the velocities `v`.
pub(super) fn drag_power(
    context: Context<'_>,
    index: usize,
    v: &[Lanes],
    drags: &[[f64; 3]],
) -> f64 {
    let first = 3 * context.model.packs.packs[index].start;
    boundary::power(context.dashpots(index), drags, first, v)
}

/// `Σ (Q + R)²` of a pack.
pub(super) fn applied(
    q: Option<&[Lanes]>,
    supports: &[Support],
    reactions: &[f64],
    first: usize,
) -> f64 {
    let Some(q) = q else { return reactions.iter().map(|r| r * r).sum() };
    let square = |all: &Lanes| Lanes(all.0.map(|x| x * x)).sum();
    let mut held = supports.iter().zip(reactions).peekable();
    let (mut sum, mut from) = (0.0, 0);
    while let Some(&(support, _)) = held.peek() {
        let at = support.at as usize - first;
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
