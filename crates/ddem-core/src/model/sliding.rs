//! Damping of failed joints, contacts and the blocks around them (§5).
//!
//! Elastic blocks flutter when they slide under Coulomb friction, and ring when they collide.
//! Dashpots at failed pairs and contacts damp this motion. Mass damping acts on the deformation of
//! the blocks around them: `f −= α m (v − v̄)` with the rigid part v̄ of the motion, `α = 2 ζ ω`
//! and `ω = 2π c_P/L`. Waves as long as the longest edge L then have the damping ratio ζ of the
//! dashpots.

use ddem_joint::broken::BrokenJoints;
use ddem_joint::contact::{ContactModel, Contacts};
use ddem_mechanics::element::Elastic;
use ddem_mechanics::law::Laws;
use ddem_mechanics::math::lanes::{LANES, Lanes};
use ddem_mesh::Geometry;
use ddem_mesh::assembly::Assembly;
use ddem_mesh::pack::Packs;

/// Damping of sliding blocks.
#[derive(Clone, Debug, Default)]
pub(crate) struct SlidingDamping {
    /// Damping ratio ζ.
    pub(crate) ratio: f64,
    /// α of the blocks of each pack while they slide `[1/s]`.
    rates: Vec<Lanes>,
}

impl SlidingDamping {
    /// Damping of a model whose joints can fail or whose blocks can meet; otherwise no damping.
    pub(crate) fn new(
        laws: &Laws,
        contact: Option<&ContactModel>,
        ratio: f64,
        geometry: &Geometry,
        packs: &Packs,
        assembly: &Assembly,
    ) -> Self {
        let can = contact.is_some() || laws.iter().any(Option::is_some);
        if !can || ratio == 0.0 {
            return Self::default();
        }
        let mut sliding = Self { ratio, ..Self::default() };
        for (index, pack) in packs.packs.iter().enumerate() {
            let mut rates = Lanes::ZERO;
            for lane in (0..pack.filled).filter(|_| !pack.rigid) {
                let block = pack.blocks[lane] as usize;
                let table = &assembly.tables[assembly.pack_tables[index][0] as usize];
                let Some(element) = table.elements[lane] else { continue };
                // The parts of a cell have no rigid motion of their own.
                if geometry.part(block).is_some() {
                    continue;
                }
                let elastic = &assembly.elements[element as usize].elastic;
                rates.0[lane] = 2.0 * ratio * slowest(geometry, block, elastic);
            }
            sliding.rates.push(rates);
        }
        // Without blocks to damp the contacts need not be searched for those that slide.
        if sliding.rates.iter().all(|rates| *rates == Lanes::ZERO) {
            sliding.rates.clear();
        }
        sliding
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
            rates[pack].0[lane] = self.rates[pack].0[lane];
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

/// Angular frequency of waves as long as the longest edge of a block, `2π c_P/L` `[1/s]`.
fn slowest(geometry: &Geometry, block: usize, elastic: &Elastic) -> f64 {
    std::f64::consts::TAU * elastic.p_speed() / geometry.longest_edge(block)
}
