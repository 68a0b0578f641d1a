//! Warnings about charges.

use std::collections::BTreeMap;

use super::super::geometry::touching::TouchingFaces;
use super::super::geometry::{Selector, coordinates};
use super::cavity::{Cavity, CavityEnd};
use super::holes::Holes;
use crate::lint::{Code, Diagnostic};
use crate::schema::Deck;
use ddem_core::counted;
use ddem_core::problem::{Geometry, Vec3};

/// Atmospheric pressure `[Pa]`.
const AIR: f64 = 1e5;

fn of_where(index: usize, code: Code, message: String, help: &str) -> Diagnostic {
    Diagnostic::warning(code, format!("charge[{index}].where"), message, help)
}

/// Warnings about the cavities of a charge.
pub(super) fn of_cavities(
    index: usize,
    cavities: &[Cavity],
    deck: &Deck,
    geometry: &Geometry,
) -> Vec<Diagnostic> {
    let mut warnings = Vec::new();
    for cavity in cavities {
        let mut ends: BTreeMap<CavityEnd, Vec3> = BTreeMap::new();
        for (at, end) in &cavity.ends {
            ends.entry(*end).or_insert(*at);
        }
        warnings.extend(ends.into_iter().map(|(end, at)| ended(index, end, at, deck)));
        let [own, all] = cavity.walls;
        if own < all {
            let message = format!("the charge pushes {own} of the {all} walls of its cavity");
            let help = "`where` must contain the centres of all walls";
            warnings.push(of_where(index, Code::UnselectedWalls, message, help));
        }
        if let Some(&first) = cavity.within.first() {
            let message = format!(
                "its cavity contains {} of set `{}`, the first with its centre at {}: the gas exerts no \
                 pressure there, and this volume counts as cavity",
                counted(cavity.within.len(), "block"),
                deck.set_name(geometry.set(first)),
                coordinates(geometry.centre(first))
            );
            let help = "`[[remove]]` these blocks as well, or move the charge";
            warnings.push(of_where(index, Code::BlocksInCavity, message, help));
        }
    }
    warnings
}

/// Warning about a cavity whose surface is open at a point.
fn ended(index: usize, end: CavityEnd, at: Vec3, deck: &Deck) -> Diagnostic {
    let at = coordinates(at);
    let split = "split all blocks around the cavity alike";
    match end {
        CavityEnd::Open => {
            let message = format!(
                "its cavity is open to the outside at {at}: the gas pushes the walls that are there, and \
                 nothing balances its force on the opening"
            );
            let help = "leave blocks at the end of the hole, as stemming";
            of_where(index, Code::OpenCavity, message, help)
        }
        CavityEnd::OtherCavity => {
            let message = format!(
                "its cavity continues at {at} among blocks that `[[refine]]` splits in another way: the gas does \
                 not get there"
            );
            of_where(index, Code::DividedCavity, message, split)
        }
        CavityEnd::Split => {
            let message = format!(
                "its cavity borders on blocks that `[[refine]]` splits in another way, at {at}: the gas does not \
                 push them"
            );
            of_where(index, Code::DividedCavity, message, split)
        }
        CavityEnd::Set(set) => {
            let message = format!(
                "its cavity borders on blocks of set `{}` at {at}: the gas does not push them",
                deck.set_name(set)
            );
            let help = "all blocks around a cavity must belong to one set";
            of_where(index, Code::SetsInCavity, message, help)
        }
    }
}

/// Warnings about a charge in a number of conforming joints.
pub(super) fn of_joints(
    index: usize,
    joints: usize,
    selector: &Selector,
    holes: &Holes<'_>,
) -> Vec<Diagnostic> {
    let (mut warnings, geometry) = (Vec::new(), holes.geometry);
    let others = TouchingFaces(geometry).joins_at(selector);
    if others > 0 {
        let others = counted(others, "joint");
        let message = format!("the gas does not push {others} between faces that do not match");
        let help = "split the blocks on both sides alike, or leave these joints out of `where`";
        warnings.push(of_where(index, Code::NonconformingJoints, message, help));
    }
    // A sphere or cylinder around the centre of a block probably stands for a hole that nobody has
    // removed. If it is wider than two blocks, it may select the joints of a part of the model.
    // A `where` with planes selects joints, too.
    let hole = selector.is_round() && selector.planes() == 0;
    let inside = |&block: &usize| {
        let (centre, edge) = (geometry.centre(block), geometry.shortest_edge(block));
        selector.in_ranges(&centre)
            && selector.off_middle(&centre).is_some_and(|[off, r]| off < 0.25 * edge && r <= edge)
    };
    if hole && let Some(block) = holes.blocks_near(selector).find(inside) {
        let message = format!(
            "no cavity is found: there is a block at {}, and the charge acts on {}",
            coordinates(geometry.centre(block)),
            counted(joints, "joint")
        );
        let help = "a `[[remove]]` makes the hole";
        warnings.push(of_where(index, Code::MissingRemove, message, help));
    }
    warnings
}

/// Warning about an explosive whose gas has hardly any pressure.
pub(super) fn weak(
    index: usize,
    mass: Option<f64>,
    room: f64,
    pressure: f64,
) -> Option<Diagnostic> {
    let mass = mass.filter(|_| pressure < AIR)?;
    let message = format!(
        "{mass} kg of explosive begin with {pressure:.3e} Pa in a cavity of {room:.4e} m³, less than the \
         pressure of the air"
    );
    let help = "check the mass, in kg, and the size of the hole, in m";
    Some(Diagnostic::warning(Code::WeakCharge, format!("charge[{index}].mass"), message, help))
}

/// Warning about an explosive with more volume than its cavity `[m³]`.
pub(super) fn full(index: usize, own: f64, room: f64) -> Diagnostic {
    let message = format!(
        "{own:.4e} m³ of explosive in a cavity of {room:.4e} m³: it begins with the detonation pressure"
    );
    let help = "check the mass, in kg, and the size of the hole, in m; a larger hole holds more";
    Diagnostic::warning(Code::FullCavity, format!("charge[{index}].mass"), message, help)
}
