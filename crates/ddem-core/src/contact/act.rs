//! What the pairs of points of patches exert.

use nalgebra::Vector2;
use rayon::prelude::*;

use super::{Contacts, Patch, Placing, Point};
use crate::breaks::Losses;
use crate::geometry::Vec3;
use crate::law::response::stored;
use crate::law::{JointLaw, MohrCoulomb, Opening, Stiffness};

/// Patches that one task takes.
const TOGETHER: usize = 64;

/// Forces of all patches; what they lose is summed in their order.
pub(crate) fn act(placing: Placing<'_>, contacts: &mut Contacts) -> Losses {
    let chunks = contacts.patches.par_chunks_mut(TOGETHER);
    let losses: Vec<Losses> = chunks
        .map(|patches| {
            let each = patches.iter_mut().map(|patch| patch.act(&placing));
            Losses::total(&each.collect::<Vec<_>>())
        })
        .collect();
    Losses::total(&losses)
}

impl Patch {
    /// What it exerts at the present positions, and what is lost on the way there.
    pub(super) fn act(&mut self, placing: &Placing<'_>) -> Losses {
        let axes = self.frame(placing);
        let law = MohrCoulomb {
            tan_friction: self.both.tan_friction,
            tan_residual_friction: self.both.tan_friction,
            ..MohrCoulomb::default()
        };
        let [normal, shear] = self.both.stiffness;
        let stiffness = Stiffness { normal, shear };
        let [a, b] = self.blocks.map(|block| block as usize);
        let mut losses = Losses::default();
        (self.couple, self.stored, self.depth) = (Vec3::zeros(), self.bank, 0.0);
        for point in &mut self.points {
            let apart = placing.position(b, &point.spots[1]) - placing.position(a, &point.spots[0]);
            let own = axes.tr_mul(&apart);
            let opening =
                Opening { normal: own.x - self.both.skin, shear: Vector2::new(own.y, own.z) };
            let slip = point.memory.slip;
            let loss = law.respond(stiffness, opening, &mut point.memory);
            // Without friction, what offsets take on their way back is none.
            let slid = if self.both.tan_friction > 0.0 { loss.friction } else { 0.0 };
            losses.friction += point.area * slid;
            losses.contact += point.area * (loss.contact + (loss.friction - slid));
            let slipped = (point.memory.slip - slip).norm();
            point.ease((slipped, loss.friction), (opening.normal, normal), self.spacing);
            let mut traction = point.memory.traction;
            if self.both.dashpot > 0.0 {
                losses.damping += point.area
                    * point.dash(placing, self.blocks, &axes.column(0).into(), self.both.dashpot);
                traction.normal += point.drag;
            }
            self.stored += point.area * stored(stiffness, &point.memory);
            if point.memory.gap < 0.0 {
                self.depth = self.depth.max(-opening.normal);
            }
            let force = Vec3::new(traction.normal, traction.shear.x, traction.shear.y);
            point.force = axes * force * point.area;
            self.couple += apart.cross(&point.force);
        }
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
        let offset = &mut self.memory.dilation;
        if *offset == 0.0 {
            return;
        }
        if self.memory.gap > 0.0 {
            *offset = if *offset < 0.0 { offset.max(gap.min(0.0)) } else { 0.0 };
            return;
        }
        // Over half an element.
        let back = *offset * (slipped / (0.5 * spacing)).min(1.0);
        let pressure = -self.memory.traction.normal;
        // What the springs take on the way back, as they are pressed more and more.
        let taken = |back: f64| -back * pressure + 0.5 * stiffness * back * back;
        if back > 0.0 || taken(back) <= friction {
            *offset -= back;
        } else if friction > 0.0 {
            let root = (pressure * pressure + 2.0 * stiffness * friction).sqrt();
            *offset += (root - pressure) / stiffness;
        }
    }

    /// The dashpot along the normal: never pulls. Returns what it takes for each unit of area.
    fn dash(
        &mut self,
        placing: &Placing<'_>,
        [a, b]: [u32; 2],
        normal: &Vec3,
        dashpot: f64,
    ) -> f64 {
        let time_step = placing.last.1;
        let way = |block: u32, spot| placing.spot(block as usize, spot)[1];
        let opened = (way(b, &self.spots[1]) - way(a, &self.spots[0])).dot(normal);
        let spring = self.memory.traction.normal;
        let closed = self.memory.gap < 0.0 && time_step > 0.0;
        let before = self.drag;
        self.drag = if closed { (dashpot * opened / time_step).min(-spring) } else { 0.0 };
        if placing.start { 0.0 } else { 0.5 * (before + self.drag) * opened }
    }
}
