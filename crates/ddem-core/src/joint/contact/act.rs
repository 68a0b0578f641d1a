//! What the pairs of points of patches exert.

use std::sync::Arc;

use nalgebra::Vector2;
use rayon::prelude::*;

use super::friction::{Bare, Friction};
use super::{Contacts, Patch, Placing, Point};
use crate::joint::breaks::{Look, Losses, Lost};
use crate::law::bearing::Bearing;
use crate::law::{JointLaw, MohrCoulomb, Opening, Stiffness};
use crate::mesh::Vec3;

/// Patches that one task takes.
const TOGETHER: usize = 64;

/// Forces of all patches, and what they lose.
pub(super) fn act(placing: Placing<'_>, look: Look<'_>, contacts: &mut Contacts) -> Losses {
    let chunks = contacts.patches.par_chunks_mut(TOGETHER);
    let acting = chunks.map(|patches| {
        let (mut lost, mut deepest) = (Lost::default(), 0.0_f64);
        for patch in patches {
            if patch.bond.is_some() {
                lost.add(&patch.bear_as_joint(&placing, look));
            } else {
                lost.add(&patch.act(&placing, look.laws));
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
    pub(super) fn act(
        &mut self,
        placing: &Placing<'_>,
        laws: &[Option<Arc<dyn JointLaw>>],
    ) -> Losses {
        match self.both.friction {
            Friction::Angle(tan) => {
                let dry = MohrCoulomb { tan_friction: tan, ..MohrCoulomb::default() };
                self.act_by(&MohrCoulomb { tan_residual_friction: tan, ..dry }, placing)
            }
            Friction::Laws(strengths) => self.act_by(&Bare { strengths, laws }, placing),
        }
    }

    fn act_by<L: JointLaw>(&mut self, law: &L, placing: &Placing<'_>) -> Losses {
        self.turn(placing);
        let axes = self.frame();
        let rubs = self.both.friction.rubs();
        let [normal, shear] = self.both.stiffness;
        // Points that have been made anew have the drag of those before.
        let renewed = std::mem::take(&mut self.renewed);
        let time_step = (!renewed && !placing.start).then_some(placing.last.1);
        let stiffness = Stiffness { normal, shear };
        let dashpot = if placing.undamped { 0.0 } else { self.both.dashpot };
        let bearing = Bearing { stiffness, dashpot, time_step };
        let [a, b] = self.blocks.map(|block| block as usize);
        let [face_a, face_b] = self.faces();
        let spacing = self.spacing(placing);
        let (mut losses, mut couple) = (Losses::default(), Vec3::zeros());
        for i in 0..self.points.len() {
            let point = &mut self.points[i];
            let [x, y] = point.spots;
            let apart = placing.position(b, face_b, &y) - placing.position(a, face_a, &x);
            let own = axes.tr_mul(&apart);
            let opening =
                Opening { normal: own.x - self.both.skin, shear: Vector2::new(own.y, own.z) };
            let mut memory = point.memory();
            let loss = bearing.act(law, opening, &mut memory);
            // Without friction, what offsets take on their way back is none.
            let rubbed = if rubs { loss.friction } else { 0.0 };
            losses.friction += point.area * rubbed;
            losses.contact += point.area * (loss.contact + (loss.friction - rubbed));
            losses.damping += point.area * loss.damping;
            let slipped = (memory.slip - point.slip).norm();
            // In a relaxation, straight from the last equilibrium.
            let from = memory.settled.map_or(point.slip, |settled| settled.slip);
            let slid =
                |gap: f64, slip: Vector2<f64>| if gap < 0.0 { (slip - from).norm() } else { 0.0 };
            point.slid += slid(memory.gap, memory.slip) - slid(point.gap, point.slip);
            point.set(&memory);
            point.ease((slipped, loss.friction), (opening.normal, normal), spacing);
            couple += apart.cross(&self.force(&self.points[i]));
        }
        self.couple = couple;
        losses
    }
}

impl Point {
    /// Lets the distance at which the springs bear nothing go to where the faces touch: while they
    /// part, and while they slide over each other as far as friction pays for it.
    fn ease(
        &mut self,
        (slipped, friction): (f64, f64),
        (gap, stiffness): (f64, f64),
        spacing: f64,
    ) {
        let offset = &mut self.offset[0];
        if *offset == 0.0 {
            return;
        }
        if self.gap > 0.0 {
            *offset = if *offset < 0.0 { offset.max(gap.min(0.0)) } else { 0.0 };
            return;
        }
        // Over half an element.
        let back = *offset * (slipped / (0.5 * spacing)).min(1.0);
        let pressure = -self.traction.normal;
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
