//! What the points of a patch hand on to those that take their place.

use super::{Patch, Placing, Point};
use crate::geometry::Vec3;
use crate::law::Traction;

impl Patch {
    /// Energies in the springs, along the normal and in the plane `[J]`.
    pub(super) fn held(&self) -> [f64; 2] {
        let mut held = [0.0; 2];
        for Point { area, gap, traction: Traction { normal, shear }, .. } in &self.points {
            held[0] += 0.5 * area * normal * gap;
            held[1] += 0.5 * area * shear.norm_squared() / self.both.stiffness[1];
        }
        held
    }

    /// Areas change as blocks turn and slide under pressure: new points hold no more energy than the
    /// old ones did. What they do not bear of their gap is an offset.
    pub(super) fn cap(&mut self, before: [f64; 2]) {
        let now = self.held();
        // Rounding may leave less than nothing.
        let before = before.map(|energy| energy.max(0.0));
        let part = |k: usize| if now[k] > before[k] { (before[k] / now[k]).sqrt() } else { 1.0 };
        let [press, shear] = [part(0), part(1)];
        if press == 1.0 && shear == 1.0 {
            return;
        }
        let soft = self.both.stiffness[1];
        for Point { gap, offset, slip, traction, .. } in &mut self.points {
            if *gap < 0.0 {
                let less = (1.0 - press) * *gap;
                *gap -= less;
                *offset = [offset[0] + less; 2];
                traction.normal *= press;
            }
            // Friction may bear no more than before of what is pressed less.
            let part = shear.min(press);
            *slip += traction.shear * ((1.0 - part) / soft);
            traction.shear *= part;
        }
    }
}

/// What old points hand on.
pub(super) struct Known {
    points: Vec<(Vec3, Handed)>,
    /// Distance within which a point is known `[m]`.
    near: f64,
}

#[derive(Clone, Copy)]
pub(super) struct Handed {
    /// Gap at which the springs bear nothing `[m]`.
    pub(super) offset: f64,
    /// Shear traction in space `[Pa]`.
    pub(super) shear: Vec3,
    pub(super) drag: f64,
    pub(super) slid: f64,
}

impl Known {
    pub(super) fn new(placing: &Placing<'_>, old: &Patch) -> Self {
        let axes = old.frame();
        let [a, b] = old.blocks.map(|block| block as usize);
        let face = old.faces()[0];
        let hand = |point: &Point| {
            let shear = point.traction.shear;
            let shear = axes * Vec3::new(0.0, shear.x, shear.y);
            let x = placing.position(a, face, &point.spots[0]);
            (x, Handed { offset: point.offset[0], shear, drag: point.drag, slid: point.slid })
        };
        let near = placing.blocks[a].spacing.min(placing.blocks[b].spacing);
        Self { points: old.points.iter().map(hand).collect(), near }
    }

    /// What the point nearest to a place has, if that is near; nothing of it otherwise, as it has
    /// come within reach without a jump.
    pub(super) fn nearest(&self, x: Vec3) -> Option<Handed> {
        let mut best: (f64, Option<Handed>) = (f64::INFINITY, None);
        for (at, handed) in &self.points {
            let distance = (at - x).norm_squared();
            if distance < best.0 {
                best = (distance, Some(*handed));
            }
        }
        let fresh = Handed { offset: 0.0, shear: Vec3::zeros(), drag: 0.0, slid: 0.0 };
        if best.0 > self.near * self.near { Some(fresh) } else { best.1 }
    }
}
