//! §6: damping of blocks that slide.
//!
//! Elastic blocks that slide under Coulomb friction flutter, and those that hit each other ring. Failed pairs
//! and contacts have dashpots against that, and the blocks around them a little of the damping
//! `C = β K` of (9): `β = ζ Δt_e r`, with the critical step `Δt_e = 2/ω_e` of their elements alone and
//! `r² = ω_c²/(ω_c² + ω_e²)`, where `ω_c` is the fastest vibration of their nodes on the stiffest of their joints and
//! contacts. Soft joints let blocks slide without flutter, and need next to nothing.

use crate::assembly::Assembly;
use crate::breaks::Breaks;
use crate::contact::{Contacts, Skins, dashpot_rate, stiffest_square};
use crate::deck::Deck;
use crate::geometry::Geometry;
use crate::lanes::{LANES, Lanes};
use crate::pack::Packs;

/// Damping of the blocks that slide.
#[derive(Clone, Debug, Default)]
pub(crate) struct Sliding {
    /// ζ, as a fraction of critical.
    ratio: f64,
    /// β of the bodies of each pack, where they slide `[s]`.
    betas: Vec<Lanes>,
    /// Largest ζ ω_c √(m/m_n) of the dashpots, none where rigid blocks have them `[1/s]`.
    dashpots: Option<f64>,
    /// Largest `β ω_e²` `[1/s]`.
    bodies: f64,
}

impl Sliding {
    /// Of a model whose blocks `can` slide; nothing otherwise.
    pub(crate) fn new(
        can: bool,
        deck: &Deck,
        (geometry, packs, assembly): (&Geometry, &Packs, &Assembly),
    ) -> Self {
        let ratio = deck.contact.damping_ratio();
        if !can || ratio == 0.0 {
            return Self::default();
        }
        let skins = Skins::new(deck, geometry);
        let mut steps = vec![None; assembly.elements.len()];
        let mut sliding = Self { ratio, dashpots: Some(0.0), ..Self::default() };
        for (index, pack) in packs.packs.iter().enumerate() {
            if pack.rigid {
                // Joints and contacts are all that it vibrates on.
                sliding.dashpots = None;
            }
            let mut beta = Lanes::ZERO;
            for lane in (0..pack.filled).filter(|_| !pack.rigid) {
                let table = &assembly.tables[assembly.pack_tables[index][0] as usize];
                let Some(element) = table.elements[lane] else { continue };
                let element = element as usize;
                let step = *steps[element]
                    .get_or_insert_with(|| assembly.elements[element].critical_step());
                let joints = stiffest_square(&skins, geometry, pack.bodies[lane] as usize);
                let elements = 4.0 / (step * step);
                beta.0[lane] = ratio * step * (joints / (joints + elements)).sqrt();
                let rate = ratio * dashpot_rate(&skins, geometry, pack.bodies[lane] as usize);
                sliding.dashpots = sliding.dashpots.map(|most| most.max(rate));
                sliding.bodies = sliding.bodies.max(beta.0[lane] * elements);
            }
            sliding.betas.push(beta);
        }
        sliding
    }

    /// Critical step with the square of the largest angular frequency. Dashpots and stiffness damping work with
    /// velocities half a step old: `Δt² ω²/4 + Δt (ζ ω_c √(m/m_n) + β ω_e²/2) ≤ 1`.
    pub(crate) fn critical_step(&self, square: f64) -> f64 {
        let undamped = 2.0 / square.sqrt();
        let dashpots = self.dashpots.unwrap_or(self.ratio * square.sqrt());
        let part = 0.5 * undamped * (dashpots + 0.5 * self.bodies);
        undamped * ((1.0 + part * part).sqrt() - part)
    }

    /// β of the bodies of each pack `[s]`; empty where all are 0. `everywhere` is that of all deformable
    /// bodies.
    pub(crate) fn viscosities(
        &self,
        packs: &Packs,
        everywhere: f64,
        joints: (&Breaks, &Contacts),
        betas: &mut Vec<Lanes>,
    ) {
        betas.clear();
        if self.ratio > 0.0 {
            each_sliding(packs, joints, &mut |pack, lane| {
                if betas.is_empty() {
                    betas.resize(packs.packs.len(), Lanes::ZERO);
                }
                betas[pack].0[lane] = self.betas[pack].0[lane];
            });
        }
        if everywhere == 0.0 {
            return;
        }
        betas.resize(packs.packs.len(), Lanes::ZERO);
        for (beta, pack) in betas.iter_mut().zip(&packs.packs).filter(|(_, pack)| !pack.rigid) {
            (0..pack.filled).for_each(|lane| beta.0[lane] = beta.0[lane].max(everywhere));
        }
    }
}

/// The two bodies of each joint with a failed pair and of each contact, by pack and lane.
fn each_sliding(
    packs: &Packs,
    (breaks, contacts): (&Breaks, &Contacts),
    slides: &mut impl FnMut(usize, usize),
) {
    for (index, lattices) in breaks.packs.iter().enumerate() {
        for d in 0..3 {
            let Some(broken) = lattices.as_ref().and_then(|l| l[1 << d].as_ref()) else { continue };
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
