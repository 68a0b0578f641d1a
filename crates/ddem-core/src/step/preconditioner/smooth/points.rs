//! Corners of blocks that move together.

use std::collections::HashMap;

use super::block::{CORNERS, CornerVectors};
use super::bodies::SmoothBody;
use crate::model::Model;
use crate::step::preconditioner::coupling::first_member;
use ddem_mechanics::math::lanes::LANES;
use ddem_mesh::Vec3;

/// Marker for a corner that does not take part.
pub(super) const NO_POINT: u32 = u32::MAX;

/// Corner of a block in a pack.
#[derive(Clone, Copy, Debug)]
pub(super) struct PackCorner {
    pack: u32,
    corner: u8,
    lane: u8,
}

impl PackCorner {
    /// Value at the corner.
    pub(super) fn of(self, values: &[CornerVectors]) -> Vec3 {
        let corner = &values[self.pack as usize].0[usize::from(self.corner)];
        Vec3::from([0, 1, 2].map(|c| corner[c].0[usize::from(self.lane)]))
    }
}

/// Points of a model: the corners that face each other across gaps are one point.
#[derive(Clone, Debug, Default)]
pub(super) struct SmoothPoints {
    /// Mean reference position of the corners of each point, then the centres of bodies `[m]`.
    pub(super) positions: Vec<Vec3>,
    /// Points at the corners of the blocks of each pack, by corner and lane.
    pub(super) of_pack: Vec<[[u32; LANES]; CORNERS]>,
    /// First corner of each point in `corners`, and one past the last.
    pub(super) start: Vec<u32>,
    pub(super) corners: Vec<PackCorner>,
    /// Mean extent of the blocks along x, y and z `[m]`.
    pub(super) extent: Vec3,
}

impl SmoothPoints {
    /// Points of the deformable blocks of a model and of some bodies. With `parts` those of
    /// deformable cells, which are single elements, take part.
    pub(super) fn new(model: &Model, bodies: &[SmoothBody<'_>], parts: bool) -> Self {
        let geometry = &model.geometry;
        let mut number: HashMap<usize, u32> = HashMap::new();
        let mut members: Vec<(u32, PackCorner, Vec3)> = Vec::new();
        let mut of_pack = vec![[[NO_POINT; LANES]; CORNERS]; model.packs.packs.len()];
        let mut extent = Vec3::zeros();
        for (index, pack) in model.packs.packs.iter().enumerate().filter(|(_, pack)| !pack.rigid) {
            for (lane, &block) in pack.blocks.iter().enumerate().take(pack.filled) {
                let block = block as usize;
                let is_part = geometry.part(block).is_some();
                if geometry.is_removed(block) || is_part && !parts {
                    continue;
                }
                let steps = geometry.topology(block).corners();
                let at = geometry.corners(block);
                let low = at.iter().fold(at[0], |low, x| low.inf(x));
                extent += at.iter().fold(at[0], |high, x| high.sup(x)) - low;
                for corner in 0..CORNERS {
                    let node = geometry.node(block, steps[corner]);
                    let first = match geometry.ties.with(node as u32).first() {
                        Some(&first) => first as usize,
                        None if is_part => node,
                        None => first_member(model, block, steps[corner]),
                    };
                    let next = number.len() as u32;
                    let point = *number.entry(first).or_insert(next);
                    of_pack[index][corner][lane] = point;
                    let own =
                        PackCorner { pack: index as u32, corner: corner as u8, lane: lane as u8 };
                    members.push((point, own, at[corner]));
                }
            }
        }
        let blocks = members.len() / CORNERS;
        members.sort_by_key(|(point, ..)| *point);
        let mut positions = vec![Vec3::zeros(); number.len()];
        let mut start = vec![0; number.len() + 1];
        for (point, _, at) in &members {
            positions[*point as usize] += at;
            start[*point as usize + 1] += 1;
        }
        for point in 0..positions.len() {
            positions[point] /= f64::from(start[point + 1]);
            start[point + 1] += start[point];
        }
        let corners = members.into_iter().map(|(_, corner, _)| corner).collect();
        positions.extend(bodies.iter().map(|body| body.centre));
        let extent = bodies.iter().fold(extent, |sum, body| sum + body.extent);
        let blocks = blocks + bodies.len();
        Self { positions, of_pack, start, corners, extent: extent / blocks.max(1) as f64 }
    }

    /// True if blocks of a pack take part.
    pub(super) fn has(&self, pack: usize) -> bool {
        self.of_pack[pack][0] != [NO_POINT; LANES]
    }

    /// Low corner of the box around the points and bodies, and its edges `[m]`.
    pub(super) fn bounds(&self) -> [Vec3; 2] {
        let (corners, centres) = self.positions.split_at(self.n_corners());
        let around = centres.iter().flat_map(|at| [at - self.extent / 2.0, at + self.extent / 2.0]);
        let mut all = corners.iter().copied().chain(around);
        let Some(first) = all.next() else { return [Vec3::zeros(); 2] };
        let [low, high] = all.fold([first; 2], |[low, high], x| [low.inf(&x), high.sup(&x)]);
        [low, high - low]
    }

    /// Number of mean blocks along the longest edge of the box around them.
    pub(super) fn blocks_in_row(&self) -> f64 {
        if self.positions.is_empty() {
            0.0
        } else {
            self.bounds()[1].component_div(&self.extent).max()
        }
    }

    /// Number of points that are corners of blocks.
    pub(super) fn n_corners(&self) -> usize {
        self.start.len().saturating_sub(1)
    }

    /// Corners of a point.
    pub(super) fn corners_of(&self, point: usize) -> &[PackCorner] {
        &self.corners[self.start[point] as usize..self.start[point + 1] as usize]
    }
}
