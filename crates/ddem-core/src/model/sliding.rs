//! Damping of failed joints, contacts and the blocks around them (§5).
//!
//! Elastic blocks flutter when they slide under Coulomb friction, and ring when they collide.
//! Dashpots at failed pairs and contacts damp this motion. Mass damping acts on the deformation of
//! the blocks around them: `f −= α m (v − v̄)` with the rigid part v̄ of the motion, `α = 2 ζ ω`
//! and `ω = 2π c_P/L`. Waves as long as the longest edge L then have the damping ratio ζ of the
//! dashpots. L of a cell is the longest edge of a box with the same moments of volume.

use std::f64::consts::TAU;

use ddem_joint::broken::BrokenJoints;
use ddem_joint::contact::{ContactModel, Contacts};
use ddem_mechanics::law::Laws;
use ddem_mechanics::math::lanes::{LANES, Lanes};
use ddem_mesh::pack::Packs;
use ddem_mesh::properties::Properties;
use ddem_mesh::{CellBodies, Geometry};

/// Damping of sliding blocks.
#[derive(Clone, Debug, Default)]
pub(crate) struct SlidingDamping {
    /// Damping ratio ζ.
    pub(crate) ratio: f64,
    /// α of the blocks of each pack while they slide `[1/s]`.
    rates: Vec<Lanes>,
    /// Deformable cells, all parts of which slide together.
    pub(crate) cells: CellBodies,
}

impl SlidingDamping {
    /// Damping of a model whose joints can fail or whose blocks can meet; otherwise no damping.
    pub(crate) fn new(
        laws: &Laws,
        contact: Option<&ContactModel>,
        properties: &Properties,
        geometry: &Geometry,
        packs: &Packs,
    ) -> Self {
        let ratio = properties.contact.damping_ratio();
        let can = contact.is_some() || laws.iter().any(Option::is_some);
        if !can || ratio == 0.0 {
            return Self::default();
        }
        // Without blocks to damp the contacts need not be searched for those that slide.
        if packs.packs.iter().all(|pack| pack.rigid) {
            return Self { ratio, ..Self::default() };
        }
        let speed = |block: usize| {
            properties.materials[usize::from(geometry.blocks[block].material)].p_speed()
        };
        let rate = |speed: f64, length: f64| 2.0 * ratio * TAU * speed / length;
        let cells = CellBodies::deformable(geometry, packs, properties);
        let mut rates = vec![Lanes::ZERO; packs.packs.len()];
        for (index, pack) in packs.packs.iter().enumerate().filter(|(_, pack)| !pack.rigid) {
            for lane in (0..pack.filled).filter(|&lane| cells.body(index, lane).is_none()) {
                let block = pack.blocks[lane] as usize;
                rates[index].0[lane] = rate(speed(block), geometry.longest_edge(block));
            }
        }
        for cell in 0..cells.len() {
            let parts = cells.parts(cell);
            let slowest = parts.iter().map(|part| speed(part.block)).fold(f64::INFINITY, f64::min);
            let own = rate(slowest, geometry.length_of_cell(parts));
            parts.iter().for_each(|part| rates[part.pack].0[part.lane] = own);
        }
        Self { ratio, rates, cells }
    }

    /// Memory in use `[bytes]`.
    pub(crate) fn bytes(&self) -> usize {
        size_of_val(&self.rates[..]) + self.cells.bytes()
    }

    /// Sets `rates` to α of the sliding blocks of each pack `[1/s]`, or to nothing if no block
    /// slides. `failed` is true if any pair has failed.
    pub(crate) fn rates(
        &self,
        packs: &Packs,
        failed: bool,
        broken_joints: &BrokenJoints,
        contacts: &Contacts,
        rates: &mut Vec<Lanes>,
    ) {
        rates.clear();
        if self.rates.is_empty() {
            return;
        }
        let mut slides = |pack: usize, lane: usize| {
            if rates.is_empty() {
                rates.resize(packs.packs.len(), Lanes::ZERO);
            }
            if rates[pack].0[lane] != 0.0 {
                return;
            }
            let mut set = |pack: usize, lane: usize| rates[pack].0[lane] = self.rates[pack].0[lane];
            match self.cells.body(pack, lane) {
                Some(cell) => self.cells.parts(cell).iter().for_each(|own| set(own.pack, own.lane)),
                None => set(pack, lane),
            }
        };
        for (index, lattices) in broken_joints.packs.iter().enumerate().filter(|_| failed) {
            for d in 0..3 {
                let lattice = lattices.as_ref().and_then(|lattices| lattices[1 << d].as_ref());
                let Some(broken) = lattice else { continue };
                for lane in (0..LANES).filter(|&lane| broken.slides(lane)) {
                    slides(index, lane);
                    if let Some((pack, lane)) = packs.packs[index].upper[1 << d].at(lane) {
                        slides(pack, lane);
                    }
                }
            }
        }
        for patch in contacts.patches.iter().filter(|patch| patch.slides()) {
            for block in patch.blocks {
                let (pack, lane) = packs.slot(block as usize);
                slides(pack, lane);
            }
        }
    }
}
