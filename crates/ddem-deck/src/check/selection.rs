//! Checks of each `where`.

use super::{ErrorCode, Faults, NameFaults, Rule, shown};
use crate::schema::{
    Deck, Extent, Heights, Plane, RockCut, Sheet, SurfaceFile, Triangles, TunnelCut, Where,
};
use ddem_core::problem::Set;
use ddem_cut::Compass;

/// Length of the difference of two unit vectors below which they are one direction.
const SAME_NORTH: f64 = 1e-9;

/// Kind of things that a `where` selects.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Selected {
    /// Joints alone.
    Joints,
    /// Joints or outer faces, which have an orientation.
    Faces,
    Nodes,
    Blocks,
}

impl Where {
    /// Faults of a `where` in a model with these sets; places begin with `where`.
    pub(crate) fn check(&self, sets: &[Set]) -> Vec<ddem_core::Fault> {
        let sets = sets.iter().map(|set| set.name.as_deref());
        let mut faults = Faults(Vec::new());
        in_sets(sets, "where", (self, Selected::Nodes), &mut faults);
        faults.0
    }
}

/// Checks a `where` of a deck.
pub(super) fn selector(deck: &Deck, at: &str, selector: (&Where, Selected), faults: &mut Faults) {
    let (region, of) = selector;
    let tunnel = region.inside.as_ref().and_then(|file| deck.tunnel(&file.path));
    let without_tunnel = tunnel.map(|_| Where { inside: None, ..region.clone() });
    let region = (without_tunnel.as_ref().unwrap_or(region), of);
    in_sets(deck.set_names().into_iter(), at, region, faults);
    if let Some(tunnel) = tunnel {
        shaft(deck, &format!("{at}.inside"), tunnel, faults);
    }
    let Some(name) = region.0.cut.as_ref().filter(|_| of == Selected::Joints) else { return };
    let (place, named) = (format!("{at}.cut"), |cut: &RockCut| cut.name.as_ref() == Some(name));
    match deck.cut.iter().find(|cut| named(cut)) {
        Some(cut) if cut.join => {
            let message = format!("cut `{name}` has no joints: it has `join = true`");
            let help = "select by ranges or shapes, as in `where = { z = [5, 30] }`";
            faults.add_help(ErrorCode::EmptySelection, place, message, help);
        }
        Some(_) => {}
        None => {
            let known = deck.cut.iter().filter_map(|cut| cut.name.as_deref());
            faults.reference(place, name, known, ("cut", "`name = …` in `[[cut]]`"));
        }
    }
}

/// Checks that the outline of a shaft has the same direction in all regions.
fn shaft(deck: &Deck, place: &str, tunnel: &TunnelCut, faults: &mut Faults) {
    let vertical = (0..2).all(|k| tunnel.from[k] == tunnel.to[k]);
    let norths = || deck.region.iter().filter_map(|region| Compass::new(region.north.into()));
    let first = norths().next();
    let other = norths().any(|compass| {
        first.is_some_and(|first| (first.north() - compass.north()).norm() > SAME_NORTH)
    });
    if vertical && other {
        let message = "a shaft has different directions in regions of different `north`";
        let help = "give all regions one `north`, or select the shaft by a range or a `cylinder`";
        faults.add_help(ErrorCode::NotSupported, place, message, help);
    }
}

/// Checks a `where` in a model whose sets have these names.
fn in_sets<'a>(
    sets: impl ExactSizeIterator<Item = Option<&'a str>> + Clone,
    at: &str,
    (selector, of): (&Where, Selected),
    faults: &mut Faults,
) {
    for (axis, extent) in [("x", selector.x), ("y", selector.y), ("z", selector.z)] {
        along(&format!("{at}.{axis}"), axis, extent, faults);
    }
    round(at, selector, faults);
    if let Some(plane) = &selector.plane {
        self::plane(&format!("{at}.plane"), plane, faults);
    }
    for (key, sheet) in [("above", &selector.above), ("below", &selector.below)] {
        let place = format!("{at}.{key}");
        match sheet {
            Some(Sheet::Level(level)) => {
                faults.number(place, *level, Rule::Any);
            }
            Some(Sheet::Plane(plane)) => self::plane(&place, plane, faults),
            Some(Sheet::Topography { topography }) => {
                let file = (&*topography.path, topography.content.as_deref());
                self::topography(&format!("{place}.topography"), file, faults);
            }
            None => {}
        }
    }
    if let Some(file) = &selector.inside {
        surface(&format!("{at}.inside"), (&file.path, file.content.as_deref()), faults);
    }
    orientation(at, selector, of, faults);
    if selector.cut.is_some() && of != Selected::Joints {
        faults.add_help(
            ErrorCode::IneffectiveKey,
            format!("{at}.cut"),
            "`cut` selects joints: it needs `[[join]]`, or `[[assign]]` with `joint` alone",
            "select by ranges or shapes, as in `where = { z = [5, 30] }`",
        );
    }
    if let Some(set) = &selector.set {
        faults.reference(
            format!("{at}.set"),
            set,
            sets.flatten(),
            ("set", "`name = …` in `[[blocks]]`"),
        );
    } else if selector.side.is_some() && sets.len() > 1 {
        let sets = sets.len();
        let message = format!("`side` needs `set`: the model has {sets} sets");
        faults.add_help(ErrorCode::MissingKey, format!("{at}.side"), message, "add `set = …`");
    }
}

fn along(place: &str, axis: &str, extent: Option<Extent>, faults: &mut Faults) {
    match extent {
        Some(Extent::Plane(plane)) => {
            faults.number(place, plane, Rule::Any);
        }
        Some(Extent::Range([from, to])) => {
            let finite = faults.finite(place, &[from, to]);
            if finite && from > to {
                let message =
                    format!("the range along {axis} goes from {} to {}", shown(from), shown(to));
                faults.add_help(
                    ErrorCode::InvalidGeometry,
                    place,
                    message,
                    "the smaller number comes first",
                );
            }
        }
        None => {}
    }
}

/// Checks the sphere and the cylinder.
fn round(at: &str, selector: &Where, faults: &mut Faults) {
    if let Some(sphere) = selector.sphere {
        faults.finite(format!("{at}.sphere.centre"), &sphere.centre);
        faults.number(format!("{at}.sphere.radius"), sphere.radius, Rule::AboveZero);
    }
    if let Some(cylinder) = selector.cylinder {
        let [from, to] = [("from", cylinder.from), ("to", cylinder.to)]
            .map(|(key, end)| faults.finite(format!("{at}.cylinder.{key}"), &end).then_some(end));
        faults.number(format!("{at}.cylinder.radius"), cylinder.radius, Rule::AboveZero);
        if from.is_some() && from == to {
            let message = "the cylinder has no length: its two ends are one point";
            faults.add_help(
                ErrorCode::InvalidGeometry,
                format!("{at}.cylinder.to"),
                message,
                "they are the centres of its two ends",
            );
        }
    }
}

/// Checks a plane that is given by its normal, or by its dip and dip direction.
fn plane(at: &str, plane: &Plane, faults: &mut Faults) {
    faults.finite(format!("{at}.point"), &plane.point);
    let help = "a plane has `point`, and `normal` or both `dip` and `dip_direction`";
    if let Some(normal) = plane.normal {
        let place = format!("{at}.normal");
        if faults.finite(&place, &normal) {
            let length = normal.iter().fold(0.0_f64, |length, part| libm::hypot(length, *part));
            if !(length > 0.0 && length.is_finite()) {
                let message = format!("`normal` has length {}", shown(length));
                faults.add_help(
                    ErrorCode::InvalidGeometry,
                    place,
                    message,
                    "it gives a direction: any length but 0",
                );
            }
        }
        for (key, angle) in [("dip", plane.dip), ("dip_direction", plane.dip_direction)] {
            if angle.is_some() {
                let message = format!("`{key}` cannot be combined with `normal`");
                faults.add_help(ErrorCode::ConflictingKeys, format!("{at}.{key}"), message, help);
                break;
            }
        }
        return;
    }
    dips(at, (plane.dip, plane.dip_direction), faults);
    match (plane.dip, plane.dip_direction) {
        (None, None) => {
            faults.add_help(ErrorCode::MissingKey, at, "the plane has no orientation", help)
        }
        (None, Some(_)) => {
            faults.add_help(
                ErrorCode::MissingKey,
                format!("{at}.dip_direction"),
                "`dip_direction` needs `dip`",
                help,
            );
        }
        (Some(dip), None) if dip != 0.0 => {
            faults.add_help(
                ErrorCode::MissingKey,
                format!("{at}.dip"),
                "`dip` needs `dip_direction`",
                help,
            );
        }
        _ => {}
    }
}

/// Checks the angles of an orientation.
pub(super) fn dips(
    at: &str,
    (dip, dip_direction): (Option<f64>, Option<f64>),
    faults: &mut Faults,
) {
    faults.optional(format!("{at}.dip"), dip, Rule::Within(0.0, 90.0));
    faults.optional(format!("{at}.dip_direction"), dip_direction, Rule::Within(0.0, 360.0));
}

/// Checks the orientation of joints and outer faces.
fn orientation(at: &str, selector: &Where, of: Selected, faults: &mut Faults) {
    dips(at, (selector.dip, selector.dip_direction), faults);
    faults.optional(format!("{at}.within"), selector.within, Rule::Within(0.0, 90.0));
    let keys = [
        ("dip", selector.dip.is_some()),
        ("dip_direction", selector.dip_direction.is_some()),
        ("within", selector.within.is_some()),
    ];
    let Some((first, _)) = keys.into_iter().find(|(_, given)| *given) else { return };
    let what = match of {
        Selected::Faces | Selected::Joints if selector.dip.is_none() => {
            let message = format!("`{first}` needs `dip`");
            let help = "a set of joints has `dip`, and `dip_direction` where it is not level";
            faults.add_help(ErrorCode::MissingKey, format!("{at}.{first}"), message, help);
            return;
        }
        Selected::Faces | Selected::Joints => return,
        Selected::Nodes => "nodes",
        Selected::Blocks => "blocks",
    };
    faults.add_help(
        ErrorCode::IneffectiveKey,
        format!("{at}.{first}"),
        format!(
            "`{first}` selects joints and outer faces; here {what} are selected, which have none"
        ),
        "a plane through a point is `plane = { point, dip, dip_direction }`",
    );
}

/// Checks a topography.
fn topography(place: &str, (path, content): (&str, Option<&SurfaceFile>), faults: &mut Faults) {
    match content {
        None => unread(place, path, faults),
        Some(SurfaceFile::Heights(of)) => heights(place, (path, of), faults),
        Some(SurfaceFile::Triangles(of)) => {
            if triangles(place, (path, of), faults) && of.height_field().is_none() {
                let message =
                    format!("the surface in `{path}` is no ground: parts of it lie above others");
                let help =
                    "a topography meets each vertical line once; `inside` takes closed surfaces";
                faults.add_help(ErrorCode::InvalidFile, place, message, help);
            }
        }
    }
}

/// Checks triangles of any surface; true if it has some.
pub(super) fn triangles(
    place: &str,
    (path, triangles): (&str, &Triangles),
    faults: &mut Faults,
) -> bool {
    let finite = triangles.0.iter().flatten().flatten().all(|number| number.is_finite());
    let message = if !finite {
        format!("`{path}` has a corner that is not a finite number")
    } else if triangles.mesh().triangles.is_empty() {
        format!("`{path}` has no triangle")
    } else {
        return true;
    };
    faults.add_help(ErrorCode::InvalidFile, place, message, "write the STL file again");
    false
}

/// Checks a grid of heights.
pub(super) fn heights(place: &str, (path, heights): (&str, &Heights), faults: &mut Faults) {
    let Heights { x, y, z, rim } = heights;
    let rises = |axis: &[f64]| {
        axis.len() > 1
            && axis.iter().all(|at| at.is_finite())
            && axis.windows(2).all(|two| two[0] < two[1])
    };
    if !(rises(x) && rises(y)) || z.len() != x.len() * y.len() || !rim.is_finite() || *rim < 0.0 {
        let message = format!("`{path}` is no grid of heights");
        let help = "two or more columns and rows, at increasing x and y, with a height at each";
        faults.add_help(ErrorCode::InvalidFile, place, message, help);
    }
}

/// Checks a closed surface.
pub(super) fn surface(
    place: &str,
    (path, triangles): (&str, Option<&Triangles>),
    faults: &mut Faults,
) {
    let Some(triangles) = triangles else { return unread(place, path, faults) };
    if triangles.0.iter().flatten().flatten().any(|number| !number.is_finite()) {
        faults.add(
            ErrorCode::InvalidFile,
            place,
            format!("`{path}` has a corner that is not a finite number"),
        );
        return;
    }
    let mesh = triangles.mesh();
    if mesh.triangles.is_empty() {
        faults.add_help(
            ErrorCode::InvalidFile,
            place,
            format!("`{path}` has no triangle"),
            "an STL file of a closed surface has four triangles or more",
        );
        return;
    }
    let open = mesh.open_edges();
    if let Some([from, to]) = open.first() {
        let edges = if open.len() == 1 { "edge" } else { "edges" };
        let message = format!(
            "the surface in `{path}` is not closed: {} open {edges} of {} triangles, one from {} to {}",
            open.len(),
            triangles.0.len(),
            point(mesh.points[*from as usize]),
            point(mesh.points[*to as usize]),
        );
        faults.add_help(
            ErrorCode::InvalidFile,
            place,
            message,
            "close the surface in the program that wrote it",
        );
    }
}

fn point([x, y, z]: [f64; 3]) -> String {
    format!("[{}, {}, {}]", shown(x), shown(y), shown(z))
}

pub(super) fn unread(place: &str, path: &str, faults: &mut Faults) {
    let message = format!("the file `{path}` has not been read");
    faults.add_help(
        ErrorCode::InvalidFile,
        place,
        message,
        "a program that makes a deck itself puts the content in",
    );
}
