//! Checks of regions of rock and their cuts.

use super::selection::{Selected, dips, selector};
use super::{ErrorCode, Faults, NameFaults, Rule, blocks, fractures, rock_file, shown};
use crate::build::rock_parts;
use crate::schema::{
    Deck, PlaneCut, RockCut, RockRegion, SetCut, SetSpacing, SpacingLaw, SpacingTable, TunnelCut,
};
use ddem_cut::{Compass, CutPlane, Outline, ShapeError, Tunnel};

/// Largest number of elements along an edge: more only come from a slip of the pen.
const MOST_DIVISIONS: u32 = 64;

pub(super) fn check(deck: &Deck, faults: &mut Faults) {
    let named = |section: &'static str, names: Vec<Option<&'_ String>>| {
        let places = names.into_iter().enumerate();
        places
            .filter_map(|(i, name)| Some((format!("{section}[{i}].name"), name?.clone())))
            .collect::<Vec<_>>()
    };
    for (kind, names) in [
        ("region", named("region", deck.region.iter().map(|entry| entry.name.as_ref()).collect())),
        ("cut", named("cut", deck.cut.iter().map(|entry| entry.name.as_ref()).collect())),
    ] {
        faults.unique(kind, names.iter().map(|(place, name)| (place.clone(), name.as_str())));
    }
    for (i, region) in deck.region.iter().enumerate() {
        self::region(deck, &format!("region[{i}]"), region, faults);
    }
    if deck.region.is_empty() && !deck.cut.is_empty() {
        faults.add_help(
            ErrorCode::MissingKey,
            "cut[0]",
            "there is no region to cut",
            "`region` with `box`, `prism`, `faces` or `file` makes one",
        );
    }
    for (i, join) in deck.join.iter().enumerate() {
        if deck.region.is_empty() {
            let message = "there is no region whose cells could be joined";
            let help = "a set of blocks has fewer joints with a smaller `count`";
            faults.add_help(ErrorCode::MissingKey, format!("join[{i}]"), message, help);
        }
        selector(deck, &format!("join[{i}].where"), (&join.r#where, Selected::Joints), faults);
    }
    for (i, cut) in deck.cut.iter().enumerate() {
        self::cut(deck, &format!("cut[{i}]"), cut, faults);
    }
}

/// Checks that exactly one of several keys is given.
pub(super) fn one_of(at: &str, keys: &[(&str, bool)], help: &str, faults: &mut Faults) -> bool {
    let given: Vec<&str> = keys.iter().filter(|(_, given)| *given).map(|(key, _)| *key).collect();
    match given[..] {
        [_] => true,
        [] => {
            let names = keys.iter().map(|(key, _)| format!("`{key}`")).collect::<Vec<_>>();
            let message = format!("one of {} is missing", names.join(", "));
            faults.add_help(ErrorCode::MissingKey, at, message, help);
            false
        }
        [first, second, ..] => {
            let message = format!("`{second}` cannot be combined with `{first}`");
            faults.add_help(ErrorCode::ConflictingKeys, format!("{at}.{second}"), message, help);
            false
        }
    }
}

fn region(deck: &Deck, at: &str, region: &RockRegion, faults: &mut Faults) {
    blocks::material_of(deck, at, &region.material, faults);
    let place = format!("{at}.divisions");
    if faults.not_zero(&place, region.divisions)
        && (!region.divisions.is_multiple_of(2) || region.divisions > MOST_DIVISIONS)
    {
        let near = region.divisions.saturating_add(1).min(MOST_DIVISIONS);
        faults.add_help(
            ErrorCode::OutOfRange,
            place,
            format!(
                "`divisions` is {} but must be even, at most {MOST_DIVISIONS}",
                region.divisions
            ),
            format!("as in `divisions = {near}`: an edge is halved before it is divided"),
        );
    }
    let place = format!("{at}.north");
    if faults.finite(&place, &region.north) && Compass::new(region.north.into()).is_none() {
        faults.add_help(
            ErrorCode::InvalidGeometry,
            place,
            "`north` has no level part",
            "it points along the ground, as in `north = [0, 1, 0]`",
        );
    }
    faults.number(format!("{at}.small.width"), region.small.width, Rule::Within(0.0, 1.0));
    shape(at, region, faults);
    rock_file::check(deck, at, region, faults);
}

fn shape(at: &str, region: &RockRegion, faults: &mut Faults) {
    let keys = [
        ("box", region.bounds.is_some()),
        ("prism", region.prism.is_some()),
        ("faces", region.faces.is_some()),
        ("file", region.file.is_some()),
    ];
    if !one_of(at, &keys, "a region has one shape", faults) {
        return;
    }
    // Files are checked as they are read.
    let mut finite = region.file.is_none();
    if let Some(shape) = &region.bounds {
        finite &= faults.finite(format!("{at}.box.from"), &shape.from);
        finite &= faults.finite(format!("{at}.box.to"), &shape.to);
    }
    if let Some(shape) = &region.prism {
        finite &= outline_is_finite(&format!("{at}.prism"), &shape.outline, faults);
        finite &= faults.number(format!("{at}.prism.from"), shape.from, Rule::Any);
        finite &= faults.number(format!("{at}.prism.to"), shape.to, Rule::Any);
    }
    for (i, face) in region.faces.iter().flatten().enumerate() {
        for (k, corner) in face.iter().enumerate() {
            finite &= faults.finite(format!("{at}.faces[{i}][{k}]"), corner);
        }
    }
    if finite && let Err((key, error)) = rock_parts(region) {
        let place = match face_of(&error) {
            Some(face) => format!("{at}.faces[{face}]"),
            None => format!("{at}.{key}"),
        };
        faults.add_help(ErrorCode::InvalidGeometry, place, error.to_string(), remedy(&error));
    }
}

fn outline_is_finite(at: &str, outline: &[[f64; 2]], faults: &mut Faults) -> bool {
    outline.iter().enumerate().fold(true, |finite, (i, corner)| {
        faults.finite(format!("{at}.outline[{i}]"), corner) && finite
    })
}

/// Number of the face that a fault is about.
fn face_of(error: &ShapeError) -> Option<usize> {
    match error {
        ShapeError::FewCorners(face)
        | ShapeError::NotPlanar { face, .. }
        | ShapeError::Open { face, .. }
        | ShapeError::NotConvex { face, .. } => Some(*face),
        _ => None,
    }
}

/// Advice on a fault of a shape.
pub(crate) fn remedy(error: &ShapeError) -> &'static str {
    match error {
        ShapeError::NoArea => "an outline has three corners or more that are not on one line",
        ShapeError::Crossing => "list the corners in order around the outline",
        ShapeError::NoVolume => "its two ends, or opposite sides, must be apart",
        ShapeError::FewCorners(_) => "a face has three corners or more",
        ShapeError::NotPlanar { .. } => "split the face into triangles, or move the corner",
        ShapeError::Open { .. } => {
            "each edge belongs to two faces, which list its two corners in opposite order"
        }
        ShapeError::InsideOut => {
            "list the corners of all faces in reverse: counter-clockwise seen from outside"
        }
        ShapeError::Undivided { .. } => {
            "its triangles may cross, touch or nearly coincide: make them larger and fewer"
        }
        ShapeError::NotConvex { .. } => {
            "make several convex bodies that share faces, or a `prism` or a closed surface, which may be concave"
        }
    }
}

fn cut(deck: &Deck, at: &str, cut: &RockCut, faults: &mut Faults) {
    let keys = [
        ("set", cut.set.is_some()),
        ("plane", cut.plane.is_some()),
        ("disc", cut.disc.is_some()),
        ("polygon", cut.polygon.is_some()),
        ("dfn", cut.dfn.is_some()),
        ("surface", cut.surface.is_some()),
        ("tunnel", cut.tunnel.is_some()),
        ("voronoi", cut.voronoi.is_some()),
    ];
    let help =
        "a cut is a set of planes, one plane, fractures of finite size, a tunnel, or Voronoi cells";
    one_of(at, &keys, help, faults);
    fractures::check(deck, at, cut, faults);
    if let Some(set) = &cut.set {
        self::set(&format!("{at}.set"), set, faults);
    }
    if let Some(plane) = &cut.plane {
        self::plane(&format!("{at}.plane"), plane, faults);
    }
    if let Some(of) = &cut.voronoi {
        super::voronoi::check(&format!("{at}.voronoi"), of, faults);
    }
    if let Some(tunnel) = &cut.tunnel {
        self::tunnel(&format!("{at}.tunnel"), tunnel, faults);
    }
    match &cut.joint {
        Some(name) if cut.join => faults.add_help(
            ErrorCode::ConflictingKeys,
            format!("{at}.joint"),
            format!("`joint` is `{name}`, but `join = true` leaves no joint"),
            "leave one of them out",
        ),
        Some(name) => blocks::joint(deck, format!("{at}.joint"), name, faults),
        None if !cut.join => faults.add_help(
            ErrorCode::MissingKey,
            at,
            "the cut has no joint",
            "name it as `joint = …`, or keep the parts together by `join = true`",
        ),
        None => {}
    }
    let place = format!("{at}.where");
    for (key, given) in [("set", cut.r#where.set.is_some()), ("side", cut.r#where.side.is_some())] {
        if given {
            faults.add_help(
                ErrorCode::NotSupported,
                format!("{place}.{key}"),
                format!("`{key}` selects from sets of blocks, which are not cut"),
                "select by ranges or shapes, as in `where = { z = [5, 30] }`",
            );
            return;
        }
    }
    selector(deck, &place, (&cut.r#where, Selected::Blocks), faults);
}

fn set(at: &str, set: &SetCut, faults: &mut Faults) {
    dips(at, (Some(set.dip), Some(set.dip_direction)), faults);
    faults.optional(format!("{at}.fisher"), set.fisher, Rule::AboveZero);
    if let Some(origin) = &set.origin {
        faults.finite(format!("{at}.origin"), origin);
    }
    match &set.spacing {
        SetSpacing::Constant(distance) => {
            faults.number(format!("{at}.spacing"), *distance, Rule::AboveZero);
        }
        SetSpacing::Random(table) => spacing(&format!("{at}.spacing"), table, faults),
    }
}

/// Largest standard deviation of lognormal distances, relative to their mean above the least one. A
/// wider law has so many small distances that their number cannot be foreseen.
const WIDEST: f64 = 10.0;

fn spacing(at: &str, table: &SpacingTable, faults: &mut Faults) {
    let mean = faults.number(format!("{at}.mean"), table.mean, Rule::AboveZero);
    faults.optional(format!("{at}.deviation"), table.deviation, Rule::AboveZero);
    for (key, value) in [("spread", table.spread), ("least", table.least)] {
        let place = format!("{at}.{key}");
        if faults.optional(&place, value, Rule::ZeroOrMore)
            && mean
            && let Some(value) = value.filter(|value| *value >= table.mean)
        {
            let message = format!(
                "`{key}` is {} but must be less than `mean`, {}",
                shown(value),
                shown(table.mean)
            );
            faults.add(ErrorCode::OutOfRange, place, message);
        }
    }
    let help = "spacings are `{ mean, spread }`, `{ mean, law = \"exponential\" }` or \
                `{ mean, law = \"lognormal\", deviation }`, the last two with `least`";
    let keys = [("spread", table.spread.is_some()), ("law", table.law.is_some())];
    if !one_of(at, &keys, help, faults) {
        return;
    }
    let lognormal = table.law == Some(SpacingLaw::Lognormal);
    if lognormal && table.deviation.is_none() {
        let message = "`law = \"lognormal\"` needs `deviation`";
        faults.add_help(ErrorCode::MissingKey, format!("{at}.law"), message, help);
    }
    let most = WIDEST * (table.mean - table.least.unwrap_or_default());
    if lognormal
        && mean
        && let Some(deviation) = table.deviation.filter(|deviation| *deviation > most)
        && most > 0.0
    {
        let message = format!(
            "`deviation` is {} but must be at most {}, ten times the mean above `least`",
            shown(deviation),
            shown(most)
        );
        faults.add(ErrorCode::OutOfRange, format!("{at}.deviation"), message);
    }
    let without = [
        ("deviation", table.deviation.is_some() && !lognormal),
        ("least", table.least.is_some() && table.law.is_none()),
    ];
    for (key, _) in without.into_iter().filter(|(_, given)| *given) {
        let message = format!("`{key}` has no effect on this law");
        faults.add_help(ErrorCode::IneffectiveKey, format!("{at}.{key}"), message, help);
    }
}

fn plane(at: &str, plane: &PlaneCut, faults: &mut Faults) {
    dips(at, (plane.dip, plane.dip_direction), faults);
    let help = "a plane has `dip`, `dip_direction` and `through`, or three `points`";
    let dipping = [
        ("dip", plane.dip.is_some()),
        ("dip_direction", plane.dip_direction.is_some()),
        ("through", plane.through.is_some()),
    ];
    if let Some(through) = &plane.through {
        faults.finite(format!("{at}.through"), through);
    }
    let Some(points) = plane.points else {
        if let Some((key, _)) = dipping.into_iter().find(|(_, given)| !given) {
            let message = format!("key `{key}` is missing");
            faults.add_help(ErrorCode::MissingKey, format!("{at}.{key}"), message, help);
        }
        return;
    };
    let mut finite = true;
    for (i, point) in points.iter().enumerate() {
        finite &= faults.finite(format!("{at}.points[{i}]"), point);
    }
    if let Some((key, _)) = dipping.into_iter().find(|(_, given)| *given) {
        let message = format!("`{key}` cannot be combined with `points`");
        faults.add_help(ErrorCode::ConflictingKeys, format!("{at}.{key}"), message, help);
    } else if finite && CutPlane::through(points.map(Into::into), 0, false).is_none() {
        faults.add_help(
            ErrorCode::InvalidGeometry,
            format!("{at}.points"),
            "the three `points` lie on one line",
            "three points that form a triangle determine a plane",
        );
    }
}

fn tunnel(at: &str, tunnel: &TunnelCut, faults: &mut Faults) {
    let mut finite = outline_is_finite(at, &tunnel.outline, faults);
    finite &= faults.finite(format!("{at}.from"), &tunnel.from);
    finite &= faults.finite(format!("{at}.to"), &tunnel.to);
    if !finite {
        return;
    }
    let outline = match Outline::new(&tunnel.outline) {
        Ok(outline) => outline,
        Err(error) => {
            let place = format!("{at}.outline");
            let text = error.to_string();
            return faults.add_help(ErrorCode::InvalidGeometry, place, text, remedy(&error));
        }
    };
    let ends = [tunnel.from, tunnel.to].map(Into::into);
    if Tunnel::new(&outline, ends, &Compass::default(), 0, true).is_err() {
        faults.add_help(
            ErrorCode::InvalidGeometry,
            format!("{at}.to"),
            "the tunnel has no length: its two ends are one point",
            "they are the ends of its axis",
        );
    }
}
