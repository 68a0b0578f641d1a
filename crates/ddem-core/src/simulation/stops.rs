//! What a run stops at.

use super::Simulation;
use crate::error::RunError;
use crate::geometry::Vec3;
use crate::model::Model;
use crate::sums::Sums;

impl Simulation {
    pub(crate) fn check(&self, sums: Sums) -> Result<(), RunError> {
        if sums.free.is_finite() {
            self.check_speed(sums)?;
            return self.check_depth();
        }
        let (block, node) = self.worst_node();
        Err(RunError::Diverged { step: self.state.steps, time: self.state.time, block, node })
    }

    /// Blocks that are deep in each other may come out on the other side.
    fn check_depth(&self) -> Result<(), RunError> {
        let Some(surfaces) = &self.model.contact else { return Ok(()) };
        let patches = self.state.contacts.patches.iter();
        for patch in patches.filter(|patch| patch.depth > 0.25 * surfaces.shortest) {
            let blocks = patch.blocks.map(|block| block as usize);
            let edges = blocks.map(|block| self.model.geometry.shortest_edge(block));
            let edge = edges[0].min(edges[1]);
            if patch.depth > 0.25 * edge && !self.motion.fictitious {
                let (step, time, depth) = (self.state.steps, self.state.time, patch.depth);
                return Err(RunError::TooDeep { blocks, step, time, depth, edge });
            }
        }
        Ok(())
    }

    /// Contacts are found from step to step: nothing may go far in one.
    fn check_speed(&self, sums: Sums) -> Result<(), RunError> {
        let Some(surfaces) = &self.model.contact else { return Ok(()) };
        let edge = surfaces.shortest;
        if self.motion.fictitious || self.farthest(sums.fastest.0[0]) <= 0.25 * edge {
            return Ok(());
        }
        // The largest component says no more than what nothing is faster than: now exactly.
        let (way, block) = self.fastest_node();
        if way <= 0.25 * edge {
            return Ok(());
        }
        let (step, time) = (self.state.steps, self.state.time);
        Err(RunError::TooFast { block, step, time, way, edge })
    }

    /// Longest way of a step in which no component of a velocity was larger `[m]`.
    fn farthest(&self, component: f64) -> f64 {
        3.0_f64.sqrt() * self.motion.time_step * component
    }

    /// Longest way of a node in the last step `[m]`, and its block; 0 where none can have gone further
    /// than what is allowed.
    fn fastest_node(&self) -> (f64, usize) {
        let Model { packs, contact, .. } = &self.model;
        let least = contact.as_ref().map_or(0.0, |surfaces| 0.25 * surfaces.shortest);
        let mut most = (0.0, 0);
        for (pack, sums) in packs.packs.iter().zip(&self.scratch.sums) {
            for lane in 0..pack.filled {
                if self.farthest(sums.fastest.0[lane]) <= least {
                    continue;
                }
                let nodes = 3 * pack.start..3 * (pack.start + packs.shape_of(pack).nodes);
                for v in self.state.v[nodes].chunks_exact(3) {
                    let speed = Vec3::from([0, 1, 2].map(|c| v[c].0[lane])).norm();
                    let way = self.motion.time_step * speed;
                    if way > most.0 {
                        most = (way, pack.bodies[lane] as usize);
                    }
                }
            }
        }
        most
    }

    /// Block and node with the largest force; one that is not a number is larger than any.
    fn worst_node(&self) -> (usize, usize) {
        let size = |x: f64| if x.is_nan() { f64::INFINITY } else { x.abs() };
        let mut worst = (f64::NEG_INFINITY, 0, 0);
        for (index, pack) in self.model.packs.packs.iter().enumerate() {
            let nodes = self.model.packs.shape_of(pack).nodes;
            let forces = &self.scratch.f[3 * pack.start..3 * (pack.start + nodes)];
            for (at, f) in forces.iter().enumerate() {
                for lane in 0..pack.filled {
                    if size(f.0[lane]) <= worst.0 {
                        continue;
                    }
                    let block = self.model.packs.packs[index].bodies[lane] as usize;
                    worst = (size(f.0[lane]), block, at / 3);
                }
            }
        }
        let (_, block, local) = worst;
        (block, self.model.geometry.bodies[block].first_node as usize + local)
    }
}
