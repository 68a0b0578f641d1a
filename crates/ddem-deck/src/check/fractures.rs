//! Checks of cuts of finite size, and of the bridges of rock that cuts leave.

use super::selection::dips;
use super::{ErrorCode, Faults, Rule, blocks, shown};
use crate::schema::{Deck, DiscCut, DiscSizes, FileOf, NetworkCut, RockCut, SurfaceFile, TIED};
use ddem_cut::{Fracture, ShapeError};

/// Largest exponent of a power law: of larger ones hardly any radius differs from the least.
const STEEPEST: f64 = 20.0;

pub(super) fn check(deck: &Deck, at: &str, cut: &RockCut, faults: &mut Faults) {
    if let Some(disc) = &cut.disc {
        self::disc(&format!("{at}.disc"), disc, faults);
    }
    if let Some(corners) = &cut.polygon {
        polygon(&format!("{at}.polygon"), corners, faults);
    }
    if let Some(network) = &cut.dfn {
        self::network(&format!("{at}.dfn"), network, faults);
    }
    surface(at, cut, faults);
    let persistence = cut.set.as_ref().and_then(|set| set.persistence);
    faults.optional(format!("{at}.set.persistence"), persistence, Rule::Within(0.0, 1.0));
    let Some(bridge) = &cut.bridge else { return };
    let place = format!("{at}.bridge");
    let finite =
        cut.surface.is_some() || cut.disc.is_some() || cut.polygon.is_some() || cut.dfn.is_some();
    if cut.join || (!finite && persistence.is_none_or(|share| share >= 1.0)) {
        let message = "the cut leaves no bridges of rock between joints";
        let help = "a `disc`, a `polygon`, a `dfn`, a `surface` and a `set` with `persistence` below 1 leave some";
        faults.add_help(ErrorCode::IneffectiveKey, place, message, help);
    } else if bridge != TIED {
        blocks::joint(deck, place, bridge, faults);
    }
}

/// Checks a surface, which may be open, and its tolerance.
fn surface(at: &str, cut: &RockCut, faults: &mut Faults) {
    let place = format!("{at}.tolerance");
    faults.optional(&place, cut.tolerance, Rule::AboveZero);
    let ground = match &cut.surface {
        None => false,
        Some(FileOf { path, content: None }) => {
            return super::selection::unread(&format!("{at}.surface"), path, faults);
        }
        Some(FileOf { path, content: Some(content) }) => {
            let at = format!("{at}.surface");
            match &**content {
                SurfaceFile::Heights(of) => {
                    super::selection::heights(&at, (path, of), faults);
                    true
                }
                SurfaceFile::Triangles(of) => {
                    super::selection::triangles(&at, (path, of), faults)
                        && (cut.tolerance.is_none() || of.height_field().is_some())
                }
            }
        }
    };
    if cut.tolerance.is_some() && !ground {
        let message = "`tolerance` is that of a ground, and the cut has none";
        let help = "a ground is a `surface` that each vertical line meets once at most";
        faults.add_help(ErrorCode::IneffectiveKey, place, message, help);
    }
}

fn disc(at: &str, disc: &DiscCut, faults: &mut Faults) {
    dips(at, (Some(disc.dip), Some(disc.dip_direction)), faults);
    faults.finite(format!("{at}.centre"), &disc.centre);
    faults.number(format!("{at}.radius"), disc.radius, Rule::AboveZero);
}

fn polygon(at: &str, corners: &[[f64; 3]], faults: &mut Faults) {
    let mut finite = true;
    for (i, corner) in corners.iter().enumerate() {
        finite &= faults.finite(format!("{at}[{i}]"), corner);
    }
    let corners: Vec<_> = corners.iter().map(|corner| (*corner).into()).collect();
    if !finite {
        return;
    }
    let (message, help) = match Fracture::polygon(&corners, 0, false) {
        Ok(_) => return,
        Err(ShapeError::NotPlanar { off, .. }) => (
            format!("the corners do not lie in one plane: one is {} m off it", shown(off)),
            "three corners always do; make several polygons of others",
        ),
        Err(ShapeError::Crossing) => (
            "the polygon is not convex".to_owned(),
            "list its corners in order; make several polygons of one with a dent",
        ),
        Err(_) => (
            "the polygon encloses no area".to_owned(),
            "it has three corners or more that are not on one line",
        ),
    };
    faults.add_help(ErrorCode::InvalidGeometry, at, message, help);
}

fn network(at: &str, network: &NetworkCut, faults: &mut Faults) {
    let keys = [
        ("p32", network.p32.is_some()),
        ("number", network.number.is_some()),
        ("file", network.file.is_some()),
    ];
    let help =
        "a network has `p32` or `number` with `size`, `dip` and `dip_direction`, or a `file`";
    super::rock::one_of(at, &keys, help, faults);
    faults.optional(format!("{at}.p32"), network.p32, Rule::AboveZero);
    if let Some(number) = network.number {
        faults.not_zero(format!("{at}.number"), number);
    }
    dips(at, (network.dip, network.dip_direction), faults);
    faults.optional(format!("{at}.fisher"), network.fisher, Rule::AboveZero);
    faults.optional(format!("{at}.least"), network.least, Rule::ZeroOrMore);
    match network.size {
        Some(DiscSizes::Constant(radius)) => {
            faults.number(format!("{at}.size"), radius, Rule::AboveZero);
        }
        Some(DiscSizes::Power(law)) => {
            let place = format!("{at}.size");
            faults.number(format!("{place}.power"), law.power, Rule::Within(0.0, STEEPEST));
            faults.number(format!("{place}.to"), law.to, Rule::AboveZero);
            let from = faults.number(format!("{place}.from"), law.from, Rule::AboveZero);
            if from && law.from > law.to {
                let message = format!("radii go from {} to {}", shown(law.from), shown(law.to));
                let help = "the smaller number comes first";
                faults.add_help(ErrorCode::InvalidGeometry, place, message, help);
            }
        }
        None => {}
    }
    let statistics = [
        ("size", network.size.is_some()),
        ("dip", network.dip.is_some()),
        ("dip_direction", network.dip_direction.is_some()),
    ];
    if network.file.is_none() {
        for (key, _) in statistics.into_iter().filter(|(_, given)| !given) {
            let message = format!("key `{key}` is missing");
            faults.add_help(ErrorCode::MissingKey, format!("{at}.{key}"), message, help);
        }
        return;
    }
    let given = statistics.into_iter().chain([("fisher", network.fisher.is_some())]);
    if let Some((key, _)) = given.into_iter().find(|(_, given)| *given) {
        let message = format!("`{key}` cannot be combined with `file`");
        faults.add_help(ErrorCode::ConflictingKeys, format!("{at}.{key}"), message, help);
    }
    if let Some(file) = network.file.as_ref().filter(|file| file.content.is_none()) {
        super::selection::unread(&format!("{at}.file"), &file.path, faults);
    }
}
