//! Checks of regions from files.

use super::{ErrorCode, Faults, blocks, selection};
use crate::schema::{Deck, RockFile, RockRegion, Triangles};

pub(super) fn check(deck: &Deck, at: &str, region: &RockRegion, faults: &mut Faults) {
    let place = format!("{at}.file");
    match region.file.as_ref().map(|file| (&file.path, file.content.as_deref())) {
        Some((path, None)) => return selection::unread(&place, path, faults),
        Some((path, Some(RockFile::Surface(triangles)))) => {
            surface(&place, path, triangles, faults);
        }
        Some((_, Some(RockFile::Cells(_)))) | None => {}
    }
    joints(deck, at, region, faults);
}

/// Checks that a surface is closed and turned outward.
fn surface(place: &str, path: &str, triangles: &Triangles, faults: &mut Faults) {
    let before = faults.0.len();
    selection::surface(place, (path, Some(triangles)), faults);
    if faults.0.len() > before {
        return;
    }
    let (mesh, n) = (triangles.mesh(), triangles.0.len());
    let message = if !mesh.is_turned_one_way() {
        format!("the {n} triangles of `{path}` are turned to both sides of the surface")
    } else if mesh.volume() < 0.0 {
        format!("the surface in `{path}`, of {n} triangles, is turned inside out")
    } else {
        return;
    };
    let help = "turn the normals outward in the program that wrote it";
    faults.add_help(ErrorCode::InvalidFile, place, message, help);
}

/// Checks the joint between the cells of a file.
fn joints(deck: &Deck, at: &str, region: &RockRegion, faults: &mut Faults) {
    let several = region.n_file_cells() > 1;
    if region.join && !several {
        let message = "`join` is about faces between the cells of a `file` with several";
        let help = "leave it out: here the region is one cell before it is cut";
        faults.add_help(ErrorCode::IneffectiveKey, format!("{at}.join"), message, help);
        return;
    }
    match &region.joint {
        Some(name) if region.join => faults.add_help(
            ErrorCode::ConflictingKeys,
            format!("{at}.joint"),
            format!("`joint` is `{name}`, but `join = true` leaves no joint"),
            "leave one of them out",
        ),
        Some(name) => blocks::joint(deck, format!("{at}.joint"), name, faults),
        None if several && !region.join => faults.add_help(
            ErrorCode::MissingKey,
            at,
            format!("the {} cells of the file have no joint", region.n_file_cells()),
            "name it as `joint = …`, or keep the cells together by `join = true`",
        ),
        None => {}
    }
}
