//! What the points of a patch hand on to those that take their place.

use nalgebra::Vector2;

use super::fit::Fitting;
use super::{ContactPoint, Patch, Placing};
use crate::losses::Losses;
use crate::point::JointPoint;
use ddem_mechanics::law::{Memory, Settled, Traction};
use ddem_mesh::Vec3;

/// Part by which pressed areas may differ from those of the overlap, up or down, so that the energy stays.
const SCALE: f64 = 1.25;

/// A patch whose points are to be made anew.
pub(super) struct Old {
    pub(super) patch: Patch,
    /// Energies that its springs keep, along the normal and in the plane `[J]`.
    held: [f64; 2],
}

impl Old {
    /// Follows the blocks to where they are. Also returns what is lost on the way.
    pub(super) fn new(mut patch: Patch, fitting: &Fitting<'_>) -> (Self, Losses) {
        let opening = |pair: &JointPoint| pair.memory.gap + pair.memory.lifted;
        let mut opened: Vec<f64> = patch.pairs().map(opening).collect();
        let losses = patch.act(&fitting.placing, fitting.look);
        for (way, pair) in opened.iter_mut().zip(patch.pairs()) {
            *way = opening(pair) - *way;
        }
        let held = patch.held(&opened);
        (Self { patch, held }, losses)
    }

    /// Energy in its springs, and in its bank `[J]`.
    pub(super) fn kept(&self) -> f64 {
        self.held[0] + self.held[1] + self.patch.owed()
    }
}

impl Patch {
    /// Energy in the bank and on the accounts of the points `[J]`.
    pub(super) fn owed(&self) -> f64 {
        let accounts = self.pairs().map(|pair| pair.area * pair.memory.account);
        self.bank + accounts.sum::<f64>()
    }

    /// How far the points opened in the last step `[m]`, in which the normal turned with its block.
    fn opened(&self, placing: &Placing<'_>) -> Vec<f64> {
        if placing.start {
            return Vec::new();
        }
        let normal = self.now[0];
        let turn = placing.turned(self.order()[0]);
        let before = normal - turn.cross(&(normal - turn.cross(&normal) * 0.5));
        let opened = |point: &ContactPoint| {
            let apart = placing.apart(self.blocks, self.faces(), &point.spots);
            let way = placing.parted(self.blocks, self.faces(), &point.spots);
            normal.dot(&apart) - before.dot(&(apart - way))
        };
        self.points.iter().map(opened).collect()
    }

    /// Energies in the springs, along the normal and in the plane `[J]`. What the scheme of the step
    /// keeps along the normal is half the traction now times the gap a step ago.
    pub(super) fn held(&self, opened: &[f64]) -> [f64; 2] {
        let mut held = [0.0; 2];
        for (k, JointPoint { area, memory, .. }) in self.pairs().enumerate() {
            let Memory { gap, traction: Traction { normal, shear }, .. } = memory;
            let before = gap - opened.get(k).copied().unwrap_or(0.0);
            held[0] += 0.5 * area * normal * before;
            held[1] += 0.5 * area * shear.norm_squared() / self.both.stiffness.shear;
        }
        held
    }

    /// Energy in the springs as the scheme of the step keeps it, and in the bank `[J]`.
    pub(super) fn kept(&self, placing: &Placing<'_>) -> f64 {
        let [normal, shear] = self.held(&self.opened(placing));
        normal + shear + self.owed()
    }

    /// Areas change as blocks turn and slide under pressure, and a corner that leaves a face meets an
    /// edge: new points hold as much energy along the normal as the old ones did, or less. Pressed
    /// areas make up for it, by [`SCALE`], or to that of an element; what is then too much is an offset,
    /// part of the gap that they do not bear, and what is too little goes to the bank. Shear is less only.
    pub(super) fn hold(&mut self, placing: &Placing<'_>, old: &Old) {
        // Rounding, and faces that have just met, may leave less than nothing.
        let [normal, shear] = old.held.map(|energy| energy.max(0.0));
        let before = [(normal + old.patch.owed()).max(0.0), shear];
        let opened = self.opened(placing);
        let natural = self.held(&opened)[0];
        let mut scale = 1.0;
        if natural > 0.0 {
            let pressed = |pair: &JointPoint| pair.memory.gap < 0.0;
            let area: f64 = self.pairs().filter(|p| pressed(p)).map(|pair| pair.area).sum();
            let most = SCALE.max(self.spacing(placing).powi(2) / area);
            scale = (before[0] / natural).clamp(1.0 / SCALE, most);
            let pairs = self.points.iter_mut().map(|point| &mut point.pair);
            pairs.filter(|pair| pressed(pair)).for_each(|pair| pair.area *= scale);
        }
        self.both.friction.set_stretch(scale);
        self.cap(before, &opened);
        // Of faces that have parted nothing comes back.
        let now = self.held(&opened)[0];
        self.bank = if now > 0.0 { (before[0] - now).max(0.0) } else { 0.0 };
    }

    /// Takes out what the springs hold more than before, along the normal and in the plane.
    pub(super) fn cap(&mut self, before: [f64; 2], opened: &[f64]) {
        let now = self.held(opened);
        let shear = if now[1] > before[1] { (before[1] / now[1]).sqrt() } else { 1.0 };
        // With a part p of all gaps: p² gg − p gw, of half the traction times the gap and times the way.
        let press = if now[0] > before[0] {
            let square = self.held(&[])[0];
            let way = square - now[0];
            let root = (way * way + 4.0 * square * before[0]).max(0.0).sqrt();
            ((way + root) / (2.0 * square)).clamp(0.0, 1.0)
        } else {
            1.0
        };
        if press == 1.0 && shear == 1.0 {
            return;
        }
        let soft = self.both.stiffness.shear;
        for point in &mut self.points {
            let Memory { gap, dilation, lifted, slip, traction, .. } = &mut point.pair.memory;
            if *gap < 0.0 {
                let less = (1.0 - press) * *gap;
                *gap -= less;
                *dilation += less;
                *lifted = *dilation;
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

#[derive(Clone, Copy, Default)]
pub(super) struct Handed {
    /// Gap at which the springs bear nothing `[m]`.
    pub(super) offset: f64,
    /// Shear traction in space `[Pa]`.
    pub(super) shear: Vec3,
    pub(super) drag: [f64; 2],
    pub(super) slid: f64,
    /// The last equilibrium of a relaxation, and the slip since in space `[m]`.
    pub(super) settled: Option<(Settled, Vec3)>,
}

impl Known {
    pub(super) fn new(placing: &Placing<'_>, old: &Patch) -> Self {
        let axes = old.frame();
        let a = old.blocks[0] as usize;
        let face = old.faces()[0];
        let hand = |&ContactPoint { spots, pair, slid }: &ContactPoint| {
            let in_space = |v: Vector2<f64>| axes * Vec3::new(0.0, v.x, v.y);
            let x = placing.position(a, face, &spots[0]);
            let Memory { drag, dilation: offset, traction, slip, settled, .. } = pair.memory;
            let shear = in_space(traction.shear);
            let settled = settled.map(|last| (last, in_space(slip - last.slip)));
            (x, Handed { offset, shear, drag, slid, settled })
        };
        Self { points: old.points.iter().map(hand).collect(), near: old.spacing(placing) }
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
        let fresh = Handed::default();
        if best.0 > self.near * self.near { Some(fresh) } else { best.1 }
    }
}
