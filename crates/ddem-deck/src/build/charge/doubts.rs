//! Warnings about charges.

use std::collections::BTreeMap;

use super::super::geometry::abut::Seats;
use super::super::geometry::{Region, place};
use super::cavity::{Cavity, CavityEnd};
use super::holes::Holes;
use crate::schema::Deck;
use ddem_core::problem::{Geometry, Vec3};

/// Pressure of the air `[Pa]`.
const AIR: f64 = 1e5;

pub(super) fn of_cavities(cavities: &[Cavity], deck: &Deck, geometry: &Geometry) -> Vec<String> {
    let mut doubts = Vec::new();
    for cavity in cavities {
        let mut ends: BTreeMap<CavityEnd, (usize, Vec3)> = BTreeMap::new();
        for (at, end) in &cavity.ends {
            ends.entry(*end).or_insert((0, *at)).0 += 1;
        }
        doubts.extend(ends.into_iter().map(|(end, (_, at))| ended(end, at, deck)));
        let [own, all] = cavity.walls;
        if own < all {
            doubts.push(format!(
                "it pushes {own} of the {all} walls of its cavity: its `where` has to reach the centres \
                 of the others, too"
            ));
        }
        if let Some(&first) = cavity.within.first() {
            doubts.push(format!(
                "{} blocks of set `{}` stand in its cavity, first that with its centre at {}: the gas does \
                 not push them, and has their room, too",
                cavity.within.len(),
                deck.set_name(geometry.set(first)),
                place(geometry.centre(first))
            ));
        }
    }
    doubts
}

/// A cavity whose surface ends there.
fn ended(end: CavityEnd, at: Vec3, deck: &Deck) -> String {
    let at = place(at);
    match end {
        CavityEnd::Open => format!(
            "its cavity is open to the outside at {at}: the gas pushes the walls that are there, and \
             nothing bears what it does to the opening"
        ),
        CavityEnd::GoesOn => format!(
            "its cavity goes on at {at} among blocks that `[[refine]]` splits otherwise, where the gas does \
             not get: split all blocks around it alike"
        ),
        CavityEnd::Split => format!(
            "its cavity borders on blocks that `[[refine]]` splits otherwise, at {at}: the gas does not \
             push these; split all blocks around it alike"
        ),
        CavityEnd::Set(set) => format!(
            "its cavity borders on blocks of set `{}` at {at}: the gas does not push these; all blocks around \
             it want to be of one set",
            deck.set_name(set)
        ),
    }
}

/// Of a charge in so many joints that match.
pub(super) fn of_joints(joints: usize, region: &Region, holes: &Holes<'_>) -> Vec<String> {
    let (mut doubts, geometry) = (Vec::new(), holes.geometry);
    let others = Seats(geometry).joins_at(region);
    if others > 0 {
        doubts.push(format!(
            "{others} of the joints there are between faces that do not match, which gas does not push"
        ));
    }
    // A sphere or a cylinder around the middle of a block is a hole, unless it is wider than two blocks:
    // then it may as well take the joints of a part of the model. Joints are also named by planes.
    let hole = region.is_round() && region.planes() == 0;
    let inside = |&block: &usize| {
        let (centre, edge) = (geometry.centre(block), geometry.shortest_edge(block));
        region.in_ranges(&centre)
            && region.off_middle(&centre).is_some_and(|[off, r]| off < 0.25 * edge && r <= edge)
    };
    if hole && let Some(block) = holes.blocks_near(region).find(inside) {
        doubts.push(format!(
            "it pushes {joints} joints apart, for there is no cavity: the block at {} has not been taken \
             out; was a `[[remove]]` forgotten?",
            place(geometry.centre(block))
        ));
    }
    doubts
}

/// Of explosive whose gas has hardly any pressure.
pub(super) fn of_little(mass: Option<f64>, room: f64, pressure: f64) -> Option<String> {
    let mass = mass.filter(|_| pressure < AIR)?;
    Some(format!(
        "{mass} kg of explosive begin with {pressure:.3e} Pa in a cavity of {room:.4e} m³, less than the air \
         has"
    ))
}
