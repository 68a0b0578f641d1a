//! Blocks around cavities, and charges, that several tests use.

use ddem_core::{ChargeState, Simulation};
use ddem_deck::*;

use crate::decks::*;

pub(crate) fn ball(centre: [f64; 3], radius: f64) -> Where {
    Where { sphere: Some(Sphere { centre, radius }), ..Where::default() }
}

pub(crate) fn gas(region: Where, pressure: f64) -> Charge {
    let history = Some(ChargeHistory::Gas(GasWord::Gas));
    Charge {
        r#where: region,
        pressure: Some(pressure),
        gamma: Some(3.0),
        history,
        ..Charge::default()
    }
}

pub(crate) fn given(region: Where, pressure: f64, history: History) -> Charge {
    let history = Some(ChargeHistory::Given(history));
    Charge { r#where: region, pressure: Some(pressure), history, ..Charge::default() }
}

const ALL: [f64; 2] = [-100.0, 100.0];

pub(crate) fn everywhere() -> Where {
    Where { x: Some(Extent::Range(ALL)), ..Where::default() }
}

/// Blocks of a metre each in free space, without the blocks in some cells.
pub(crate) fn hollow(axes: [[f64; 3]; 3], cells: &[[f64; 3]], thickness: f64) -> Deck {
    let mut deck = with_axes(deck([4; 3], [4.0; 3], 2, thickness), axes);
    let directions = axes.map(|axis| Vec3::from(axis).normalize());
    deck.remove = cells
        .iter()
        .map(|cell| {
            let place = |k: usize| directions[k] * (cell[k] + 0.5);
            let region = ball((place(0) + place(1) + place(2)).into(), 0.1);
            Remove { r#where: region, ..Remove::default() }
        })
        .collect();
    deck
}

pub(crate) fn state(simulation: &Simulation, index: usize) -> ChargeState {
    simulation.charge(index).unwrap_or_else(|| panic!("no charge {index}"))
}
