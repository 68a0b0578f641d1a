//! What the pairs of points of patches exert.

use nalgebra::Vector2;
use rayon::prelude::*;

use super::friction::{Bare, Friction};
use super::{ContactPoint, Contacts, Patch, Placing};
use crate::losses::{Losses, Lost};
use crate::point::Look;
use ddem_mechanics::law::bearing::Bearing;
use ddem_mechanics::law::{JointLaw, Loss, Memory, MohrCoulomb};
use ddem_mesh::Vec3;

/// Patches that one task takes.
const TOGETHER: usize = 64;

/// Forces of all patches, and what they lose.
pub(super) fn act(placing: Placing<'_>, look: Look<'_>, contacts: &mut Contacts) -> Losses {
    let chunks = contacts.patches.par_chunks_mut(TOGETHER);
    let acting = chunks.map(|patches| {
        let (mut lost, mut deepest) = (Lost::default(), 0.0_f64);
        for patch in patches {
            lost.add(&patch.act(&placing, look));
            if patch.bond.is_none() {
                deepest = deepest.max(patch.depth());
            }
            if look.relaxing {
                patch.settle();
            }
        }
        (lost, deepest)
    });
    let none = || (Lost::default(), 0.0);
    let (lost, deepest) = acting.reduce(none, |(lost, deepest), (more, other)| {
        (lost.merge(&more), f64::max(deepest, other))
    });
    contacts.deepest = deepest;
    lost.total()
}

impl Patch {
    /// What it exerts at the present positions, and what is lost on the way there.
    pub(super) fn act(&mut self, placing: &Placing<'_>, look: Look<'_>) -> Losses {
        if let Some(bond) = self.bond {
            if self.pairs().all(|pair| pair.failure.is_some()) {
                self.turn_with_larger(placing);
            }
            return self.act_by(look.law(bond.law), placing, look);
        }
        match self.both.friction {
            Friction::Angle(tan) => {
                let dry = MohrCoulomb { tan_friction: tan, ..MohrCoulomb::default() };
                let dry = MohrCoulomb { tan_residual_friction: tan, ..dry };
                self.act_by(Some(&dry), placing, look)
            }
            Friction::Laws(strengths) => {
                self.act_by(Some(&Bare { strengths, laws: look.laws }), placing, look)
            }
        }
    }

    fn act_by<L: JointLaw + ?Sized>(
        &mut self,
        law: Option<&L>,
        placing: &Placing<'_>,
        look: Look<'_>,
    ) -> Losses {
        self.turn(placing);
        let axes = self.frame();
        let mut bearing = look.bearing(self.both.stiffness, self.both.dashpot);
        if std::mem::take(&mut self.renewed) {
            // Points that have been made anew have the drag of those before.
            bearing.time_step = None;
        }
        let (is_joint, turned) = (self.bond.is_some(), look.turning && self.turned(placing));
        let (blocks, faces, spacing) = (self.blocks, self.faces(), self.spacing(placing));
        let rubs = self.both.friction.rubs();
        let (mut losses, mut couple) = (Losses::default(), Vec3::zeros());
        for i in 0..self.points.len() {
            let point = &mut self.points[i];
            let apart = placing.apart(blocks, faces, &point.spots);
            let own = axes.tr_mul(&apart);
            let loss = if is_joint {
                let pair = &mut point.pair;
                let elastic = pair.elastic(bearing.stiffness, own);
                let fails =
                    law.is_some_and(|law| pair.fail(law, look, elastic, turned, &mut losses));
                let way = fails.then(|| {
                    pair.begin(elastic, own.x - pair.origin.x);
                    axes.tr_mul(&placing.parted(blocks, faces, &point.spots))
                });
                pair.act(law.filter(|_| pair.failure.is_some()), &bearing, own, way)
            } else {
                point.rub(law, &bearing, own, rubs, spacing)
            };
            losses.add_point(point.pair.area, loss);
            couple += apart.cross(&self.force(&self.points[i]));
        }
        self.couple = couple;
        losses
    }
}

impl ContactPoint {
    /// Tractions of a contact where its sides are `apart` `[m]`; returns what is lost `[J/m²]`.
    #[inline(always)]
    fn rub<L: JointLaw + ?Sized>(
        &mut self,
        law: Option<&L>,
        bearing: &Bearing,
        apart: Vec3,
        rubs: bool,
        spacing: f64,
    ) -> Loss {
        let Memory { slip: slip_before, gap: gap_before, .. } = self.pair.memory;
        let mut loss = self.pair.act(law, bearing, apart, None);
        let memory = &mut self.pair.memory;
        let slipped = (memory.slip - slip_before).norm();
        // In a relaxation, straight from the last equilibrium.
        let from = memory.settled.map_or(slip_before, |settled| settled.slip);
        let slid =
            |gap: f64, slip: Vector2<f64>| if gap < 0.0 { (slip - from).norm() } else { 0.0 };
        self.slid += slid(memory.gap, memory.slip) - slid(gap_before, slip_before);
        // Over half an element.
        let part = (slipped / (0.5 * spacing)).min(1.0);
        let gap = apart.x - self.pair.origin.x;
        self.ease(bearing.stiffness.normal, gap, part, loss.friction);
        if !rubs {
            // What offsets take on their way back is no friction.
            loss.contact += std::mem::take(&mut loss.friction);
        }
        loss
    }

    /// Lets the distance at which the springs bear nothing go to where the faces touch: while they
    /// part, and by a part while they slide over each other, as far as friction pays for it.
    fn ease(&mut self, stiffness: f64, gap: f64, part: f64, friction: f64) {
        let Memory { dilation: offset, gap: pressed, traction, .. } = &mut self.pair.memory;
        if *offset == 0.0 {
            return;
        }
        if *pressed > 0.0 {
            *offset = if *offset < 0.0 { offset.max(gap.min(0.0)) } else { 0.0 };
            return;
        }
        let back = *offset * part;
        let pressure = -traction.normal;
        // What the springs take on the way back, as they are pressed more and more.
        let taken = |back: f64| -back * pressure + 0.5 * stiffness * back * back;
        if back > 0.0 || taken(back) <= friction {
            *offset -= back;
        } else if friction > 0.0 {
            let root = (pressure * pressure + 2.0 * stiffness * friction).sqrt();
            *offset += (root - pressure) / stiffness;
        }
    }
}
