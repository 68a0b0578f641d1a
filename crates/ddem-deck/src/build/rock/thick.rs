//! Joints that are thick beside the cells between which they lie.

use ddem_core::problem::shown;
use ddem_core::{ErrorCode, Fault};

use super::CutRock;
use crate::schema::Assign;

/// Thickness of a joint, as a part of the width of cells, above which its springs do not stand for it:
/// they take no room, so that cells fill that of the joint, too.
const THICKEST: f64 = 0.1;

impl CutRock {
    /// Faults of joints that are too thick for springs between cells.
    pub(in crate::build) fn thick_joints(&self) -> Vec<Fault> {
        let (deck, widths) = (&self.deck, self.median_widths.iter().copied());
        let width = widths.filter(|width| *width > 0.0).fold(f64::INFINITY, f64::min);
        let cuts = deck.cut.iter().enumerate().flat_map(|(i, cut)| {
            let names = [("joint", cut.joint.as_ref()), ("bridge", cut.bridge_joint())];
            names.map(|(key, name)| (format!("cut[{i}].{key}"), name))
        });
        let files = deck.region.iter().enumerate();
        let files = files.map(|(i, of)| (format!("region[{i}].joint"), of.joint.as_ref()));
        // Joints within sets of blocks have room.
        let of_blocks = |entry: &Assign| {
            let set = entry.r#where.set.as_ref();
            set.is_some_and(|name| deck.blocks.iter().any(|own| own.name.as_ref() == Some(name)))
        };
        let assigned = deck.assign.iter().enumerate().filter(|(_, entry)| !of_blocks(entry));
        let assigned =
            assigned.map(|(i, entry)| (format!("assign[{i}].joint"), entry.joint.as_ref()));
        let fault = |(place, name): (String, Option<&String>)| {
            let name = name?;
            let thickness = deck.joints.get(name)?.thickness;
            let most = THICKEST * width;
            if thickness <= most {
                return None;
            }
            let message = format!(
                "joint `{name}` is {} m thick, more than a tenth of the width of most cells, {} m",
                shown(thickness),
                rounded(width)
            );
            let help = format!(
                "its springs take no room between cells: give it a `thickness` of at most {}, or \
                 stiffnesses",
                rounded(most)
            );
            Some(Fault::new(ErrorCode::OutOfRange, place, message).help(help))
        };
        files.chain(cuts).chain(assigned).filter_map(fault).collect()
    }
}

/// Number with three digits.
fn rounded(number: f64) -> String {
    shown(format!("{number:.2e}").parse().unwrap_or(number))
}
