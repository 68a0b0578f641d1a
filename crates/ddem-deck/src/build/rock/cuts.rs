//! Cuts of regions, in the order of a deck.

use ddem_core::problem::{Sets, Vec3, shown};
use ddem_core::{ErrorCode, Fault};
use ddem_cut::{
    CellComplex, Compass, CutCount, CutPlane, JointSet, MOST_CELLS, Outline, Polyhedron, Spacing,
    Tunnel, expected_cells,
};

use crate::build::geometry::{Region, place};
use crate::schema::{Deck, PlaneCut, RockCut, SetCut, SetSpacing, SpacingLaw, TunnelCut, Where};

/// Regions that share the planes of cuts, because their north and their seed are the same.
struct SharedPlanes {
    compass: Compass,
    seed: u64,
    regions: Vec<u32>,
    /// Corners of these regions `[m]`.
    corners: Vec<Vec3>,
}

/// Cells of all regions after all cuts.
pub(super) fn cut(deck: &Deck, shapes: &[Vec<Polyhedron>]) -> Result<CellComplex, Vec<Fault>> {
    let groups = groups(deck, shapes);
    let corners: Vec<Vec3> = groups.iter().flat_map(|group| group.corners.clone()).collect();
    let bounds = bounds(&corners);
    if let Some(fault) = too_many(deck, shapes, (&groups, middle(bounds))) {
        return Err(vec![fault]);
    }
    let mut rock = CellComplex::new(shapes);
    for (number, entry) in deck.cut.iter().enumerate() {
        let at = format!("cut[{number}]");
        let chosen = chosen(&rock, &entry.region, bounds);
        if !chosen.contains(&true) {
            return Err(vec![no_cell(&rock, format!("{at}.where"), &entry.region)]);
        }
        let mut all = CutCount::default();
        for group in &groups {
            // Cells that another group has made are none of this one.
            let is_chosen = |cell: usize| chosen.get(cell).is_some_and(|chosen| *chosen);
            let of_group = |region: u32| group.regions.contains(&region);
            let allowed = rock.select(|cell, of| is_chosen(cell) && of_group(of.region));
            let cells = rock.cells().len() as f64
                + divisions(&rock, entry, (group, middle(bounds)), &allowed);
            if cells > MOST_CELLS as f64 {
                return Err(vec![too_many_fault(deck, format!("{at}.set.spacing"), cells)]);
            }
            let count = one(&mut rock, (entry, number as u32), (group, middle(bounds)), allowed);
            all.divisions += count.divisions;
            all.too_many |= count.too_many;
        }
        if all.too_many {
            return Err(vec![too_many_fault(deck, at, rock.cells().len() as f64)]);
        }
        if let Some(fault) = without_effect(&rock, entry, (&at, bounds), all) {
            return Err(vec![fault]);
        }
    }
    Ok(rock)
}

fn groups(deck: &Deck, shapes: &[Vec<Polyhedron>]) -> Vec<SharedPlanes> {
    let mut groups: Vec<SharedPlanes> = Vec::new();
    for (number, (region, parts)) in deck.region.iter().zip(shapes).enumerate() {
        let compass = Compass::new(region.north.into()).unwrap_or_default();
        let same =
            |group: &&mut SharedPlanes| group.compass == compass && group.seed == region.seed;
        let corners = parts.iter().flat_map(|part| part.points.iter().copied());
        match groups.iter_mut().find(same) {
            Some(group) => {
                group.regions.push(number as u32);
                group.corners.extend(corners);
            }
            None => groups.push(SharedPlanes {
                compass,
                seed: region.seed,
                regions: vec![number as u32],
                corners: corners.collect(),
            }),
        }
    }
    groups
}

fn bounds(corners: &[Vec3]) -> [Vec3; 2] {
    let far = Vec3::repeat(f64::INFINITY);
    corners.iter().fold([far, -far], |[low, high], x| [low.inf(x), high.sup(x)])
}

fn middle([low, high]: [Vec3; 2]) -> Vec3 {
    (low + high) / 2.0
}

/// Fault of more cells than there may be, before anything is cut. Cuts of a part of the rock are
/// counted when their turn comes.
fn too_many(
    deck: &Deck,
    shapes: &[Vec<Polyhedron>],
    (groups, middle): (&[SharedPlanes], Vec3),
) -> Option<Fault> {
    let all =
        || deck.cut.iter().enumerate().filter_map(|(i, cut)| Some((i, cut, cut.set.as_ref()?)));
    let mut cells = 0.0;
    for group in groups {
        let of = |set: &SetCut| joint_set(set, &group.compass, middle);
        let whole = all().filter(|(_, cut, _)| cut.region.is_everywhere());
        let sets: Vec<JointSet> = whole.map(|(_, _, set)| of(set)).collect();
        let parts = group.regions.iter().flat_map(|&region| &shapes[region as usize]);
        cells += parts.map(|part| expected_cells(part, &sets)).sum::<f64>();
        cells = all().map(|(_, _, set)| of(set).expected(&group.corners)).fold(cells, f64::max);
    }
    if cells <= MOST_CELLS as f64 {
        return None;
    }
    let mean = |set: &SetCut| spacing(&set.spacing).mean();
    let (number, ..) = all().min_by(|(.., a), (.., b)| mean(a).total_cmp(&mean(b)))?;
    Some(too_many_fault(deck, format!("cut[{number}].set.spacing"), cells))
}

fn too_many_fault(deck: &Deck, place: String, cells: f64) -> Fault {
    let sets = deck.cut.iter().filter_map(|cut| cut.set.as_ref());
    let least = sets.map(|set| spacing(&set.spacing).mean()).fold(f64::INFINITY, f64::min);
    let message =
        format!("the cuts would make about {cells:.1e} blocks; at most {MOST_CELLS} are possible");
    let help = format!("the smallest `spacing` is {} m on average", shown(least));
    Fault::new(ErrorCode::TooLarge, place, message).help(help)
}

/// Flags of the cells whose centroid is in a `where`.
fn chosen(rock: &CellComplex, region: &Where, bounds: [Vec3; 2]) -> Vec<bool> {
    if region.is_everywhere() {
        return rock.select(|_, _| true);
    }
    let region = Region::new(region, &Sets { bounds, list: Vec::new() });
    rock.select(|cell, _| region.planes() == 0 && region.in_ranges(&rock.centroid(cell)))
}

fn no_cell(rock: &CellComplex, at: String, region: &Where) -> Fault {
    let centroids: Vec<Vec3> = (0..rock.cells().len()).map(|cell| rock.centroid(cell)).collect();
    let [low, high] = bounds(&centroids);
    let help = if region.n_planes() > 0 {
        "blocks count by their centroid, which is on no plane: give a range `[from, to]`".to_owned()
    } else {
        format!(
            "blocks count by their centroid: here these lie from {} to {}",
            place(low),
            place(high)
        )
    };
    Fault::new(ErrorCode::EmptySelection, at, "selects nothing: no block to cut there").help(help)
}

/// Cuts the regions of one group.
fn one(
    rock: &mut CellComplex,
    (entry, number): (&RockCut, u32),
    (group, middle): (&SharedPlanes, Vec3),
    allowed: Vec<bool>,
) -> CutCount {
    if let Some(set) = &entry.set {
        let set = joint_set(set, &group.compass, middle);
        let planes = set.planes(&group.corners, group.seed, number, entry.join);
        return rock.cut(&planes, allowed);
    }
    if let Some(plane) = &entry.plane {
        let plane = self::plane(plane, &group.compass, (number, entry.join));
        return plane.map(|plane| rock.cut(&[plane], allowed)).unwrap_or_default();
    }
    let tunnel = entry.tunnel.as_ref();
    let tunnel =
        tunnel.and_then(|tunnel| self::tunnel(tunnel, &group.compass, (number, entry.join)));
    tunnel.map(|tunnel| rock.cut_tunnel(&tunnel, allowed)).unwrap_or_default()
}

/// Number of divisions to expect from a set: its planes cross a cell as often as the spacing fits
/// into the extent of the cell.
fn divisions(
    rock: &CellComplex,
    entry: &RockCut,
    (group, middle): (&SharedPlanes, Vec3),
    allowed: &[bool],
) -> f64 {
    let Some(set) = &entry.set else { return 0.0 };
    let set = joint_set(set, &group.compass, middle);
    let extent = |cell: &ddem_cut::ConvexCell| {
        let corners = cell.faces.iter().flat_map(|face| &face.corners);
        let heights = corners.map(|&corner| set.normal.dot(&rock.points()[corner as usize]));
        let [low, high] = heights.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], at| {
            [low.min(at), high.max(at)]
        });
        high - low
    };
    let cells = rock.cells().iter().zip(allowed).filter(|(_, allowed)| **allowed);
    cells.map(|(cell, _)| extent(cell)).sum::<f64>() / set.spacing.mean()
}

fn joint_set(set: &SetCut, compass: &Compass, middle: Vec3) -> JointSet {
    JointSet {
        normal: compass.normal(set.dip, set.dip_direction),
        fisher: set.fisher,
        spacing: spacing(&set.spacing),
        origin: set.origin.map_or(middle, Vec3::from),
    }
}

fn spacing(spacing: &SetSpacing) -> Spacing {
    match *spacing {
        SetSpacing::Constant(distance) => Spacing::Constant(distance),
        SetSpacing::Random(table) => {
            let (mean, least) = (table.mean, table.least.unwrap_or_default());
            match table.law {
                None => Spacing::Even { mean, spread: table.spread.unwrap_or_default() },
                Some(SpacingLaw::Exponential) => Spacing::Exponential { mean, least },
                Some(SpacingLaw::Lognormal) => {
                    let deviation = table.deviation.unwrap_or(mean);
                    Spacing::Lognormal { mean, deviation, least }
                }
            }
        }
    }
}

fn plane(plane: &PlaneCut, compass: &Compass, (cut, joined): (u32, bool)) -> Option<CutPlane> {
    match plane.points {
        Some(points) => CutPlane::through(points.map(Vec3::from), cut, joined),
        None => {
            let normal = compass.normal(plane.dip?, plane.dip_direction?);
            CutPlane::new(normal, plane.through?.into(), cut, joined)
        }
    }
}

fn tunnel(tunnel: &TunnelCut, compass: &Compass, (cut, joined): (u32, bool)) -> Option<Tunnel> {
    let outline = Outline::new(&tunnel.outline).ok()?;
    let ends = [tunnel.from, tunnel.to].map(Vec3::from);
    Tunnel::new(&outline, ends, compass, cut, joined).ok()
}

/// Fault of a cut that divides nothing.
fn without_effect(
    rock: &CellComplex,
    entry: &RockCut,
    (at, [low, high]): (&str, [Vec3; 2]),
    count: CutCount,
) -> Option<Fault> {
    if count.divisions > 0 {
        return None;
    }
    let rock_is = format!("the regions lie from {} to {}", place(low), place(high));
    let fault = |key: &str, message: &str| {
        let fault = Fault::new(ErrorCode::EmptySelection, format!("{at}.{key}"), message);
        fault.help(rock_is.clone())
    };
    if entry.set.is_some() {
        return Some(fault("set", "no plane of the set divides a block"));
    }
    if entry.plane.is_some() {
        return Some(fault("plane", "the plane divides no block"));
    }
    // A tunnel along faces that are there already divides nothing, but has blocks inside.
    let tunnel = self::tunnel(entry.tunnel.as_ref()?, &Compass::default(), (0, true))?;
    let inside = |cell: usize| tunnel.contains(&rock.centroid(cell));
    let empty = !(0..rock.cells().len()).any(inside);
    empty.then(|| fault("tunnel", "the tunnel lies outside of all blocks"))
}
