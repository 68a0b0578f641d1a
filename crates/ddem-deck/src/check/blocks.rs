//! Checks of sets of blocks, and of the entries that change parts of them.

use super::conditions::force_time;
use super::selection::{Selected, dips, selector};
use super::{ErrorCode, Faults, NameFaults, Rule, shown};
use crate::schema::{BlockMesh, BlockSet, COORDINATES, Deck, JointChoice, Remove};
const AXES: [&str; 3] = ["x", "y", "z"];

pub(super) fn check(deck: &Deck, faults: &mut Faults) {
    if deck.blocks.is_empty() && deck.region.is_empty() {
        faults.add_help(
            ErrorCode::EmptyModel,
            "blocks",
            "the model has no blocks",
            "`[[blocks]]` with `size` and `material` makes a set of blocks",
        );
    }
    let named = deck.blocks.iter().enumerate();
    let named =
        named.filter_map(|(i, set)| Some((format!("blocks[{i}].name"), set.name.as_deref()?)));
    faults.unique("set of blocks", named.clone());
    // A `set` in `where` names either.
    for (place, name) in named {
        if deck.region.iter().any(|region| region.name.as_deref() == Some(name)) {
            let message = format!("there is a region named `{name}`, too");
            faults.add(ErrorCode::InvalidName, place, message);
        }
    }
    for (i, set) in deck.blocks.iter().enumerate() {
        let at = format!("blocks[{i}]");
        material_of(deck, &at, &set.material, faults);
        if let Some(mesh) = &set.mesh {
            of_mesh(deck, &at, (set, mesh), faults);
            continue;
        }
        lattice(&at, set, faults);
        joints(deck, &at, set, faults);
        axes(&at, set, faults);
        turned(&at, set, faults);
    }
    changes(deck, faults);
}

/// Checks the key `material` of a set of blocks or a region.
pub(super) fn material_of(deck: &Deck, at: &str, name: &str, faults: &mut Faults) {
    let place = format!("{at}.material");
    if name.is_empty() {
        faults.add(ErrorCode::MissingKey, place, "key `material` is missing or empty");
    } else {
        material(deck, place, name, faults);
    }
}

fn material(deck: &Deck, place: String, name: &str, faults: &mut Faults) {
    // A deck without materials has one fault that says so, not one for each name.
    if !deck.materials.is_empty() {
        let known = deck.materials.keys().map(String::as_str);
        faults.reference(place, name, known, ("material", "`[materials.NAME]`"));
    }
}

pub(super) fn joint(deck: &Deck, place: String, name: &str, faults: &mut Faults) {
    let known = deck.joints.keys().map(String::as_str);
    faults.reference(place, name, known, ("joint", "`[joints.NAME]`"));
}

/// Cuts along the edge `k`, if they are given.
fn cuts(set: &BlockSet, k: usize) -> Option<&[f64]> {
    let edges = set.edges.as_ref()?;
    [&edges.x, &edges.y, &edges.z][k].as_deref()
}

/// Number of blocks along the edge `k`.
fn blocks_along(set: &BlockSet, k: usize) -> u64 {
    match cuts(set, k) {
        Some(cuts) => cuts.len().saturating_sub(1) as u64,
        None => u64::from(set.count()[k]),
    }
}

fn lattice(at: &str, set: &BlockSet, faults: &mut Faults) {
    faults.finite(format!("{at}.origin"), &set.origin);
    faults.not_zero(format!("{at}.divisions"), set.divisions);
    if let Some(size) = set.size {
        faults.numbers(format!("{at}.size"), &size, Rule::AboveZero);
    }
    let mut without = Vec::new();
    for k in 0..3 {
        if let Some(count) = set.count {
            faults.not_zero(format!("{at}.count[{k}]"), count[k]);
        }
        match cuts(set, k) {
            Some(cuts) => edge(at, set, k, cuts, faults),
            None if set.size.is_none() => without.push(AXES[k]),
            None => {}
        }
    }
    if let Some(axis) = without.first() {
        faults.add_help(
            ErrorCode::MissingKey,
            format!("{at}.size"),
            format!("key `size` is missing: the set has no length along {}", without.join(", ")),
            format!("give `size = [x, y, z]`, or the cuts in `edges = {{ {axis} = […] }}`"),
        );
    }
    // Floating-point numbers do not overflow here.
    let blocks: f64 = (0..3).map(|k| blocks_along(set, k) as f64).product();
    let nodes = blocks * (f64::from(set.elements_along_edge()) + 1.0).powi(3);
    if nodes > f64::from(u32::MAX) {
        let key = if set.count.is_some() { "count" } else { "divisions" };
        faults.add(
            ErrorCode::TooLarge,
            format!("{at}.{key}"),
            format!("the set would have {nodes:.2e} nodes; at most {} can be numbered", u32::MAX),
        );
    }
}

/// Checks a set whose blocks are those of a mesh.
fn of_mesh(deck: &Deck, at: &str, (set, mesh): (&BlockSet, &BlockMesh), faults: &mut Faults) {
    let standard = BlockSet::default();
    let given = [
        ("origin", set.origin != standard.origin),
        ("size", set.size.is_some()),
        ("count", set.count.is_some()),
        ("edges", set.edges.is_some()),
        ("divisions", set.divisions != standard.divisions),
        ("axes", set.axes != standard.axes),
        ("dip", set.dip.is_some()),
        ("dip_direction", set.dip_direction.is_some()),
        ("planes", set.planes.is_some()),
    ];
    for (key, _) in given.into_iter().filter(|(_, given)| *given) {
        let help = "the blocks are where their nodes are, and divided as their hexahedra are";
        faults.add_help(
            ErrorCode::ConflictingKeys,
            format!("{at}.{key}"),
            format!("`{key}` cannot be combined with `mesh`"),
            help,
        );
    }
    match &set.joint {
        Some(JointChoice::All(name)) => joint(deck, format!("{at}.joint"), name, faults),
        Some(JointChoice::ByNormal { .. }) => faults.add_help(
            ErrorCode::NotSupported,
            format!("{at}.joint"),
            "blocks of a `mesh` have no common normals",
            "name one joint, and others in `mesh.joints` or by `[[assign]]`",
        ),
        None => {}
    }
    for (k, entry) in mesh.joints.iter().enumerate() {
        joint(deck, format!("{at}.mesh.joints[{k}].joint"), &entry.joint, faults);
    }
}

fn edge(at: &str, set: &BlockSet, k: usize, cuts: &[f64], faults: &mut Faults) {
    let axis = AXES[k];
    let place = format!("{at}.edges.{axis}");
    if !faults.finite(&place, cuts) {
        return;
    }
    let (Some(first), Some(last), true) = (cuts.first(), cuts.last(), cuts.len() >= 2) else {
        let message = format!("`edges.{axis}` needs 2 or more entries but has {}", cuts.len());
        faults.add_help(
            ErrorCode::InvalidGeometry,
            place,
            message,
            "it lists the cuts from the first face to the last",
        );
        return;
    };
    if let Some(i) = cuts.windows(2).position(|pair| pair[0] >= pair[1]) {
        faults.add(
            ErrorCode::InvalidGeometry,
            format!("{place}[{}]", i + 1),
            format!(
                "`edges.{axis}` must increase: {} comes after {}",
                shown(cuts[i + 1]),
                shown(cuts[i])
            ),
        );
        return;
    }
    let length = last - first;
    if let Some(size) = set.size
        && (size[k] - length).abs() > 1e-9 * length
    {
        faults.add_help(
            ErrorCode::ConflictingKeys,
            format!("{at}.size[{k}]"),
            format!(
                "`size` is {} along {axis} but `edges.{axis}` spans {}",
                shown(size[k]),
                shown(length)
            ),
            "an edge given in `edges` needs no `size`; when both are given they must agree",
        );
    }
    if let Some(count) = set.count
        && u64::from(count[k]) != blocks_along(set, k)
    {
        let parts = cuts.len() - 1;
        faults.add_help(
            ErrorCode::ConflictingKeys,
            format!("{at}.count[{k}]"),
            format!("`count` is {} along {axis} but `edges.{axis}` makes {parts} blocks", count[k]),
            "an edge given in `edges` needs no `count`; when both are given they must agree",
        );
    }
}

fn joints(deck: &Deck, at: &str, set: &BlockSet, faults: &mut Faults) {
    let by_normal = match &set.joint {
        Some(JointChoice::All(name)) => {
            joint(deck, format!("{at}.joint"), name, faults);
            return;
        }
        Some(JointChoice::ByNormal { x, y, z }) => [x, y, z].map(|name| name.as_deref()),
        None => [None; 3],
    };
    for (k, axis) in AXES.into_iter().enumerate() {
        let blocks = blocks_along(set, k);
        let message = format!("there are {blocks} blocks along {axis} but no joint between them");
        match by_normal[k] {
            Some(name) => joint(deck, format!("{at}.joint.{axis}"), name, faults),
            None if blocks > 1 && set.joint.is_some() => faults.add_help(
                ErrorCode::MissingKey,
                format!("{at}.joint"),
                message,
                format!("name the joint as `{axis} = …`"),
            ),
            None if blocks > 1 => {
                faults.add_help(
                    ErrorCode::MissingKey,
                    at,
                    message,
                    "name the joint as `joint = …`",
                );
                // One fault is enough if the whole key is missing.
                return;
            }
            None => {}
        }
    }
}

/// Checks the orientations of joints, which replace `axes`.
fn turned(at: &str, set: &BlockSet, faults: &mut Faults) {
    let alternatives = [
        ("axes", set.axes != COORDINATES),
        ("dip", set.dip.is_some() || set.dip_direction.is_some()),
        ("planes", set.planes.is_some()),
    ];
    let mut given = alternatives.into_iter().filter(|(_, given)| *given).map(|(key, _)| key);
    if let (Some(first), Some(second)) = (given.next(), given.next()) {
        let help = "a set is turned by one of `axes`, `dip` with `dip_direction`, and `planes`";
        let message = format!("`{second}` cannot be combined with `{first}`");
        faults.add_help(ErrorCode::ConflictingKeys, format!("{at}.{second}"), message, help);
    }
    dips(at, (set.dip, set.dip_direction), faults);
    match (set.dip, set.dip_direction) {
        (Some(_), None) => faults.add_help(
            ErrorCode::MissingKey,
            format!("{at}.dip"),
            "`dip` needs `dip_direction`",
            "the direction in which the joints go down, clockwise from north, y",
        ),
        (None, Some(_)) => {
            faults.add(
                ErrorCode::MissingKey,
                format!("{at}.dip_direction"),
                "`dip_direction` needs `dip`",
            );
        }
        _ => {}
    }
    let Some(planes) = &set.planes else { return };
    for (axis, plane) in [("x", planes.x), ("y", planes.y), ("z", planes.z)] {
        let at = format!("{at}.planes.{axis}");
        dips(&at, (Some(plane.dip), Some(plane.dip_direction)), faults);
    }
    let [x, y, z] = planes.normals();
    if volume([x, y, z]).abs() < 1e-6 {
        faults.add_help(
            ErrorCode::InvalidGeometry,
            format!("{at}.planes"),
            "the three `planes` have a direction in common: they enclose no blocks",
            "their normals must not lie in one plane",
        );
    }
}

/// Signed volume of the parallelepiped that three vectors span.
fn volume([[ax, ay, az], [bx, by, bz], [cx, cy, cz]]: [[f64; 3]; 3]) -> f64 {
    ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
}

/// Checks that the three directions span space and are right-handed. The node order of the elements
/// requires this: left-handed directions would turn every element inside out.
fn axes(at: &str, set: &BlockSet, faults: &mut Faults) {
    let place = format!("{at}.axes");
    let mut lengths = [0.0; 3];
    for (k, axis) in set.axes.iter().enumerate() {
        if !faults.finite(format!("{place}[{k}]"), axis) {
            return;
        }
        lengths[k] = axis.iter().fold(0.0_f64, |length, &component| libm::hypot(length, component));
        if !(lengths[k] > 0.0 && lengths[k].is_finite()) {
            let message = format!("axis {} has length {}", AXES[k], shown(lengths[k]));
            faults.add(ErrorCode::InvalidGeometry, format!("{place}[{k}]"), message);
            return;
        }
    }
    let unit = |k: usize| set.axes[k].map(|component| component / lengths[k]);
    let volume = volume([unit(0), unit(1), unit(2)]);
    if volume.abs() < 1e-6 {
        faults.add(ErrorCode::InvalidGeometry, place, "the three `axes` lie in one plane");
    } else if volume < 0.0 {
        faults.add_help(
            ErrorCode::InvalidGeometry,
            place,
            "the three `axes` are left-handed",
            "swap two of them, or turn one round: they must be right-handed, as x y z is",
        );
    }
}

fn changes(deck: &Deck, faults: &mut Faults) {
    for (i, assign) in deck.assign.iter().enumerate() {
        let at = format!("assign[{i}]");
        let of = if assign.material.is_some() { Selected::Blocks } else { Selected::Joints };
        selector(deck, &format!("{at}.where"), (&assign.r#where, of), faults);
        if assign.joint.is_none() && assign.material.is_none() {
            let message = "the entry assigns nothing: it needs `joint` or `material`";
            faults.add(ErrorCode::MissingKey, at.as_str(), message);
        }
        if let Some(name) = &assign.joint {
            joint(deck, format!("{at}.joint"), name, faults);
        }
        if let Some(name) = &assign.material {
            material(deck, format!("{at}.material"), name, faults);
        }
        force_time(deck, &at, assign.from.as_deref(), assign.until.as_deref(), faults);
    }
    for (i, remove) in deck.remove.iter().enumerate() {
        let at = format!("remove[{i}]");
        selector(deck, &format!("{at}.where"), (&remove.r#where, Selected::Blocks), faults);
        force_time(deck, &at, remove.from.as_deref(), None, faults);
        excavation(deck, &at, remove, faults);
    }
    for (i, refine) in deck.refine.iter().enumerate() {
        let at = format!("refine[{i}]");
        selector(deck, &format!("{at}.where"), (&refine.r#where, Selected::Blocks), faults);
        if refine.factor < 2 {
            let message = format!("{} parts leave blocks as they are", refine.factor);
            faults.add_help(ErrorCode::OutOfRange, format!("{at}.factor"), message, "at least 2");
        }
    }
}

/// Checks the removal of blocks at the start of a stage.
fn excavation(deck: &Deck, at: &str, remove: &Remove, faults: &mut Faults) {
    if remove.until.is_some() {
        faults.add_help(
            ErrorCode::IneffectiveKey,
            format!("{at}.until"),
            "removed blocks do not return: `remove` has no `until`",
            "leave it out",
        );
    }
    faults.optional(format!("{at}.release"), remove.release, Rule::ZeroOrMore);
    let same = |other: &&Remove| other.from == remove.from && other.release != remove.release;
    if remove.from.is_some() && deck.remove.iter().any(|other| same(&other)) {
        faults.add_help(
            ErrorCode::ConflictingKeys,
            format!("{at}.release"),
            "blocks removed in one stage have different `release`",
            "give all entries of one stage the same, or remove blocks in several stages",
        );
    }
    match &remove.from {
        None if remove.release.is_some() => faults.add_help(
            ErrorCode::MissingKey,
            format!("{at}.release"),
            "`release` needs `from`: blocks that never existed exerted no force",
            "`from = \"stage\"` removes them at the start of that stage",
        ),
        Some(from) if deck.stage.first().is_some_and(|stage| stage.name == *from) => {
            faults.add_help(
                ErrorCode::NeverInForce,
                format!("{at}.from"),
                format!("`{from}` is the first stage: there is nothing before it"),
                "leave `from` out for a cavity that was always there, or put a stage before it in \
                 which the blocks are still in place",
            );
        }
        _ => {}
    }
}
