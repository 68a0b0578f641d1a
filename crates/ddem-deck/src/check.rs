//! Checks of the deck alone, before any geometry is built.

mod blocks;
mod charge;
mod conditions;
mod contact;
mod fractures;
mod history;
mod matter;
mod rock;
mod rock_file;
mod rock_run;
mod selection;
mod stages;
mod strength;
#[cfg(test)]
mod tests;
mod units;
mod voronoi;
mod warnings;

pub(crate) use rock::remedy;
pub(crate) use warnings::warnings;

use std::collections::HashSet;

use ddem_core::problem::{Faults, Rule, shown};
use ddem_core::{ErrorCode, Fault};

use crate::diagnose::is_control;
use crate::schema::examples::example;
use crate::schema::{Deck, names};

/// Faults that the deck alone shows; without any of them the deck is consistent.
///
/// Overlaps of blocks and empty selections need the geometry and are not checked here.
pub fn check(deck: &Deck) -> Vec<Fault> {
    let mut faults = Faults::default();
    faults.printable("title", &deck.title);
    faults.finite("model.gravity", &deck.model.gravity);
    contact::check(&deck.contact, &mut faults);
    let every = deck.output.checkpoint_every;
    faults.optional("output.checkpoint_every", every, Rule::ZeroOrMore);
    matter::check(deck, &mut faults);
    rock::check(deck, &mut faults);
    rock_run::check(deck, &mut faults);
    blocks::check(deck, &mut faults);
    conditions::check(deck, &mut faults);
    charge::check(deck, &mut faults);
    stages::check(deck, &mut faults);
    faults.0.into_iter().map(with_example).collect()
}

/// Faults of a deck that keep its regions from being cut ([`Deck::cut_regions`]): of materials and
/// joints, regions and cuts.
pub fn check_cuts(deck: &Deck) -> Vec<Fault> {
    let mut faults = Faults::default();
    matter::check(deck, &mut faults);
    rock::check(deck, &mut faults);
    if deck.region.is_empty() && deck.cut.is_empty() {
        faults.add_help(
            ErrorCode::EmptyModel,
            "region",
            "the deck has no regions to cut",
            "`region` with `box`, `prism`, `faces` or `file` makes one; sets of blocks have their \
             joints already",
        );
    }
    faults.0.into_iter().map(with_example).collect()
}

/// Fault of a number out of its range, with a valid value unless it has other help.
fn with_example(fault: Fault) -> Fault {
    match example(&fault.place) {
        Some(value) if fault.help.is_none() && fault.code == ErrorCode::OutOfRange => {
            fault.help(format!("as in `{value}`"))
        }
        _ => fault,
    }
}

/// Faults of names.
trait NameFaults {
    /// Adds a fault if a name is not among the known ones. `of` is the kind of the named thing and
    /// the header of the table that makes one.
    fn reference<'a>(
        &mut self,
        place: impl Into<String>,
        name: &str,
        known: impl Iterator<Item = &'a str> + Clone,
        of: (&str, &str),
    );

    /// Adds a fault of a text with characters that a terminal obeys.
    fn printable(&mut self, place: impl Into<String>, text: &str);

    /// Adds faults of empty and repeated names, and of names with characters that a terminal obeys.
    fn unique<'a>(&mut self, kind: &str, names: impl IntoIterator<Item = (String, &'a str)>);
}

impl NameFaults for Faults {
    fn reference<'a>(
        &mut self,
        place: impl Into<String>,
        name: &str,
        known: impl Iterator<Item = &'a str> + Clone,
        (kind, header): (&str, &str),
    ) {
        if known.clone().any(|known| known == name) {
            return;
        }
        let help = if known.clone().next().is_none() {
            format!("the model has no {kind} with a name; {header} makes one")
        } else {
            let near = names::nearest(name, known.clone())
                .map(|near| format!("did you mean `{near}`? "))
                .unwrap_or_default();
            format!("{near}{kind}s of this model: {}", names::list(known))
        };
        self.add_help(
            ErrorCode::UnknownName,
            place,
            format!("there is no {kind} named `{name}`"),
            help,
        );
    }

    fn printable(&mut self, place: impl Into<String>, text: &str) {
        if let Some(letter) = text.chars().find(|letter| is_control(*letter)) {
            let message = format!("the text has the control character U+{:04X}", u32::from(letter));
            self.add_help(
                ErrorCode::InvalidName,
                place,
                message,
                "write letters, digits and signs: results and messages show this text",
            );
        }
    }

    fn unique<'a>(&mut self, kind: &str, names: impl IntoIterator<Item = (String, &'a str)>) {
        let mut seen: HashSet<&str> = HashSet::new();
        for (place, name) in names {
            self.printable(place.as_str(), name);
            if name.is_empty() {
                self.add(ErrorCode::InvalidName, place, format!("the name of a {kind} is empty"));
            } else if !seen.insert(name) {
                self.add(
                    ErrorCode::InvalidName,
                    place,
                    format!("there is another {kind} named `{name}`"),
                );
            }
        }
    }
}
