//! Cuts of regions, in the order of a deck.

use std::sync::Arc;

use ddem_core::problem::{Sets, Vec3};
use ddem_core::{ErrorCode, Fault};
use ddem_cut::{
    CellComplex, Compass, CutCount, Ground, JointSet, MOST_CELLS, Polyhedron, RegionParts,
    expected_cells,
};

use super::fractures::{RockFracture, listed};
use super::ground::ground_over;
use super::least_divisions;
use super::region_cut::{CutShape, RegionCut};
use super::shapes::{fractures, joint_set, network, plane, seeds, spacing, tunnel};
use super::too_many::{stopped, too_many_fault};
use crate::build::geometry::{Selector, coordinates};
use crate::build::{BuildPhase, BuildProgress};
use crate::schema::{Deck, RockCut, SetCut, Size, Where};

/// Largest number of planes from the origin of a set to the end of the rock: more take long.
const MOST_PLANES: f64 = 1e8;

/// Length of the difference of two unit vectors below which they are one direction.
const SAME_NORTH: f64 = 1e-9;

/// Regions whose planes have the same random numbers, because their north and their seed are the
/// same.
struct RegionGroup {
    compass: Compass,
    seed: u64,
    regions: Vec<u32>,
}

/// Rock before the cuts.
struct WholeRock<'a> {
    shapes: &'a [RegionParts],
    groups: Vec<RegionGroup>,
    /// Corners of all regions `[m]`.
    corners: Vec<Vec3>,
    /// Box around them `[m]`.
    bounds: [Vec3; 2],
}

/// Cells of all regions after all cuts, and the discs and polygons of these. There are no more cells than the
/// `available` memory holds as blocks `[bytes]`.
pub(super) fn cut(
    deck: &Deck,
    shapes: &[RegionParts],
    available: u64,
    progress: &BuildProgress,
) -> Result<(CellComplex, Vec<RockFracture>), Vec<Fault>> {
    let whole = WholeRock::new(deck, shapes);
    for count in [far_origin, too_many_discs, too_many, too_close] {
        if let Some(fault) = count(deck, &whole) {
            return Err(vec![fault]);
        }
    }
    let most = available as f64 / Size::of_cells(1.0, least_divisions(deck)).bytes;
    let rock = CellComplex::of_regions(shapes).with_most(most as usize);
    let (mut rock, mut fractures) = (rock.counted_by(progress.counter()), Vec::new());
    for (number, entry) in deck.cut.iter().enumerate() {
        let at = format!("cut[{number}]");
        progress.enter(BuildPhase::Cut { number, cuts: deck.cut.len() });
        let chosen = chosen(&rock, &entry.r#where, whole.bounds);
        if !chosen.contains(&true) {
            return Err(vec![no_cell(&rock, format!("{at}.where"), &entry.r#where)]);
        }
        let ground = ground_over(&rock, entry, number as u32, whole.bounds, &chosen);
        let cuts = whole.cuts(entry, number as u32, ground.map_err(|fault| vec![fault])?);
        let mut all = CutCount::default();
        for region_cut in &cuts {
            if let CutShape::Fractures(all) = &region_cut.shape
                && entry.surface.is_none()
            {
                fractures.extend(listed(all, number as u32, &region_cut.compass));
            }
            // Cells made by the planes of other regions are not selected.
            let is_chosen = |cell: usize| chosen.get(cell).is_some_and(|chosen| *chosen);
            let allowed =
                rock.select(|cell, of| is_chosen(cell) && region_cut.regions.contains(&of.region));
            let cells =
                rock.cells().len() as f64 + divisions(&rock, entry, &whole, region_cut, &allowed);
            if cells > MOST_CELLS as f64 {
                return Err(vec![too_many_fault(deck, format!("{at}.set.spacing"), cells)]);
            }
            let count = region_cut.apply(&mut rock, entry, number as u32, allowed);
            all.divisions += count.divisions;
            all.too_many |= count.too_many;
        }
        if all.too_many {
            return Err(vec![stopped(deck, at, rock.cells().len(), available)]);
        }
        if all.divisions == 0
            && let Some(fault) = without_effect(&rock, entry, &at, &cuts, &chosen, &whole)
        {
            return Err(vec![fault]);
        }
    }
    Ok((rock, fractures))
}

impl<'a> WholeRock<'a> {
    fn new(deck: &Deck, shapes: &'a [RegionParts]) -> Self {
        let parts = shapes.iter().flat_map(|shape| &shape.parts);
        let corners: Vec<Vec3> = parts.flat_map(|part| part.points.iter().copied()).collect();
        Self { shapes, groups: groups(deck), corners, bounds: bounds_of(shapes) }
    }

    fn middle(&self) -> Vec3 {
        (self.bounds[0] + self.bounds[1]) / 2.0
    }

    /// Planes of a cut, or its ground. Regions with the same planes are cut together, so that faces
    /// which they share are divided alike.
    fn cuts(&self, entry: &RockCut, number: u32, ground: Option<Arc<Ground>>) -> Vec<RegionCut> {
        let mut cuts: Vec<RegionCut> = Vec::new();
        for group in &self.groups {
            let shape = ground.clone().map(CutShape::Ground);
            let Some(shape) = shape.or_else(|| self.shape(entry, number, group)) else { continue };
            match cuts.iter_mut().find(|region_cut| region_cut.shape == shape) {
                Some(region_cut) => region_cut.regions.extend(&group.regions),
                None => {
                    let RegionGroup { compass, seed, regions } = group;
                    let regions = regions.clone();
                    cuts.push(RegionCut { shape, compass: *compass, seed: *seed, regions });
                }
            }
        }
        cuts
    }

    fn shape(&self, entry: &RockCut, number: u32, group: &RegionGroup) -> Option<CutShape> {
        if let Some(set) = &entry.set {
            let set = joint_set(set, &group.compass, self.middle());
            let planes = set.planes(&self.corners, group.seed, number, entry.join);
            return Some(CutShape::Planes(planes));
        }
        if let Some(plane) = &entry.plane {
            let plane = self::plane(plane, &group.compass, number, entry.join)?;
            return Some(CutShape::Planes(vec![plane]));
        }
        if let Some(of) = fractures(entry, number, &group.compass, group.seed, self.bounds) {
            return Some(CutShape::Fractures(of));
        }
        if let Some(of) = &entry.voronoi {
            return Some(CutShape::Seeds(seeds(of, number, group.seed, self.bounds)));
        }
        let tunnel = tunnel(entry.tunnel.as_ref()?, &group.compass, number, entry.join)?;
        Some(CutShape::Tunnel(tunnel))
    }
}

fn groups(deck: &Deck) -> Vec<RegionGroup> {
    let mut groups: Vec<RegionGroup> = Vec::new();
    for (number, region) in deck.region.iter().enumerate() {
        let compass = Compass::new(region.north.into()).unwrap_or_default();
        // Two ways to write one direction differ by rounding.
        let same = |known: &Compass| (known.north() - compass.north()).norm() <= SAME_NORTH;
        let compass = groups.iter().map(|group| group.compass).find(same).unwrap_or(compass);
        match groups.iter_mut().find(|of| of.compass == compass && of.seed == region.seed) {
            Some(group) => group.regions.push(number as u32),
            None => {
                let regions = vec![number as u32];
                groups.push(RegionGroup { compass, seed: region.seed, regions });
            }
        }
    }
    groups
}

/// Box around regions `[m]`.
pub(super) fn bounds_of(shapes: &[RegionParts]) -> [Vec3; 2] {
    let parts = shapes.iter().flat_map(|shape| &shape.parts);
    bounds(&parts.flat_map(|part| part.points.iter().copied()).collect::<Vec<_>>())
}

fn bounds(corners: &[Vec3]) -> [Vec3; 2] {
    let far = Vec3::repeat(f64::INFINITY);
    corners.iter().fold([far, -far], |[low, high], x| [low.inf(x), high.sup(x)])
}

/// Fault of a set whose origin is so far that the planes up to the rock cannot be counted.
fn far_origin(deck: &Deck, whole: &WholeRock<'_>) -> Option<Fault> {
    let sets = deck.cut.iter().enumerate().filter_map(|(i, cut)| Some((i, cut.set.as_ref()?)));
    sets.flat_map(|set| whole.groups.iter().map(move |group| (set, group))).find_map(
        |((number, entry), group)| {
            let set = joint_set(entry, &group.compass, whole.middle());
            let inside = set.expected(&whole.corners);
            let planes = set.from_origin(&whole.corners);
            if inside > MOST_CELLS as f64 || planes <= MOST_PLANES {
                return None;
            }
            let place = format!("cut[{number}].set.origin");
            let message = format!("there would be about {planes:.1e} planes from here to the rock");
            let help = "distances between planes count from the origin: put it into the rock";
            Some(Fault::new(ErrorCode::TooLarge, place, message).help(help))
        },
    )
}

/// Fault of a network of more discs than there may be cells.
fn too_many_discs(deck: &Deck, whole: &WholeRock<'_>) -> Option<Fault> {
    let networks = deck.cut.iter().enumerate().filter_map(|(i, cut)| Some((i, cut.dfn.as_ref()?)));
    networks.flat_map(|of| whole.groups.iter().map(move |group| (of, group))).find_map(
        |((number, entry), group)| {
            let discs = network(entry, &group.compass)?.expected(whole.bounds);
            let key = if entry.number.is_some() { "number" } else { "p32" };
            let message = format!(
                "there would be about {discs:.1e} discs; at most {MOST_CELLS} are possible"
            );
            let help = "larger radii, or a smaller `p32` or `number`, make fewer";
            let fault =
                Fault::new(ErrorCode::TooLarge, format!("cut[{number}].dfn.{key}"), message);
            (discs > MOST_CELLS as f64).then(|| fault.help(help))
        },
    )
}

/// Share of space that balls fill at most when they are put at random places one by one.
const RANDOM_BALLS: f64 = 0.4;

/// Fault of random seeds that do not fit at their least distance.
fn too_close(deck: &Deck, whole: &WholeRock<'_>) -> Option<Fault> {
    let cuts = deck.cut.iter().enumerate().filter_map(|(i, cut)| Some((i, cut.voronoi.as_ref()?)));
    cuts.flat_map(|of| whole.groups.iter().map(move |group| (of, group))).find_map(
        |((number, entry), group)| {
            let (wanted, least) = (entry.number? as usize, entry.least?);
            let ball = std::f64::consts::PI * least * least * least / 6.0;
            // Half of the balls at the rim is outside of the box.
            let room = (whole.bounds[1] - whole.bounds[0]).add_scalar(least).product();
            let fits = RANDOM_BALLS * room / ball;
            let n = match wanted as f64 <= fits {
                true => seeds(entry, number as u32, group.seed, whole.bounds).len() as f64,
                false => fits.floor(),
            };
            let place = format!("cut[{number}].voronoi.least");
            let message = format!("only about {n} of {wanted} seeds fit at this distance");
            let help = "give fewer seeds, or a smaller `least`";
            let fault = Fault::new(ErrorCode::OutOfRange, place, message).help(help);
            (n < wanted as f64).then_some(fault)
        },
    )
}

/// Fault of more cells than there may be, before anything is cut. Cuts of a part of the rock are
/// counted when their turn comes.
fn too_many(deck: &Deck, whole: &WholeRock<'_>) -> Option<Fault> {
    let cells = by_sets(deck, whole);
    if cells <= MOST_CELLS as f64 {
        return None;
    }
    Some(too_many_fault(deck, closest_set(deck)?, cells))
}

/// Number of cells that joint sets are expected to make. Of a set of a part of the rock it is one for
/// each plane.
fn by_sets(deck: &Deck, whole: &WholeRock<'_>) -> f64 {
    let all = || deck.cut.iter().filter_map(|cut| Some((cut, cut.set.as_ref()?)));
    let mut cells = 0.0;
    for group in &whole.groups {
        let of = |set: &SetCut| joint_set(set, &group.compass, whole.middle());
        let everywhere = all().filter(|(cut, _)| cut.r#where.is_everywhere());
        let sets: Vec<JointSet> = everywhere.map(|(_, set)| of(set)).collect();
        let parts = group.regions.iter().flat_map(|&region| &whole.shapes[region as usize].parts);
        cells += parts.map(|part| expected_cells(part, &sets)).sum::<f64>();
        cells = all().map(|(_, set)| of(set).expected(&whole.corners)).fold(cells, f64::max);
    }
    cells
}

/// Key of the joint set with the closest planes.
fn closest_set(deck: &Deck) -> Option<String> {
    let mean = |set: &SetCut| spacing(&set.spacing).mean();
    let sets = deck.cut.iter().enumerate().filter_map(|(i, cut)| Some((i, cut.set.as_ref()?)));
    let closest = sets.min_by(|(_, a), (_, b)| mean(a).total_cmp(&mean(b)));
    closest.map(|(number, _)| format!("cut[{number}].set.spacing"))
}

/// Number of cells that the cuts are expected to make at least, before anything is cut, and the key
/// of the cut that makes the most.
pub(super) fn expected(deck: &Deck, shapes: &[RegionParts]) -> (f64, String) {
    let whole = WholeRock::new(deck, shapes);
    let by_sets = by_sets(deck, &whole);
    // Seeds are anywhere in the box around the rock.
    let rock: f64 = shapes.iter().flat_map(|shape| &shape.parts).map(Polyhedron::volume).sum();
    let share = rock / (whole.bounds[1] - whole.bounds[0]).product();
    let seeds = deck.cut.iter().enumerate().filter_map(|(i, cut)| {
        let number = cut.voronoi.as_ref()?.number.filter(|_| cut.r#where.is_everywhere())?;
        Some((share * f64::from(number), format!("cut[{i}].voronoi.number")))
    });
    let by_seeds = seeds.max_by(|a, b| a.0.total_cmp(&b.0));
    match by_seeds.filter(|(number, _)| *number > by_sets) {
        Some(by_seeds) => by_seeds,
        None => (by_sets, closest_set(deck).unwrap_or_else(|| "region".to_owned())),
    }
}

/// Flags of the cells whose centroid is in a `where`.
fn chosen(rock: &CellComplex, region: &Where, bounds: [Vec3; 2]) -> Vec<bool> {
    if region.is_everywhere() {
        return rock.select(|_, _| true);
    }
    let region = Selector::new(region, &Sets { bounds, list: Vec::new() });
    rock.select(|cell, _| region.planes() == 0 && region.in_ranges(&rock.centroid(cell)))
}

fn no_cell(rock: &CellComplex, at: String, region: &Where) -> Fault {
    let centroids: Vec<Vec3> = (0..rock.cells().len()).map(|cell| rock.centroid(cell)).collect();
    let [low, high] = bounds(&centroids);
    let help = if region.n_planes() > 0 {
        "cells count by their centroid, which is on no plane: give a range `[from, to]`".to_owned()
    } else {
        format!(
            "cells count by their centroid: here these lie from {} to {}",
            coordinates(low),
            coordinates(high)
        )
    };
    Fault::new(ErrorCode::EmptySelection, at, "selects nothing: no cell to cut there").help(help)
}

/// Number of divisions to expect from a set: its planes cross a cell as often as the spacing fits
/// into the extent of the cell.
fn divisions(
    rock: &CellComplex,
    entry: &RockCut,
    whole: &WholeRock<'_>,
    region_cut: &RegionCut,
    allowed: &[bool],
) -> f64 {
    let Some(set) = &entry.set else { return 0.0 };
    let set = joint_set(set, &region_cut.compass, whole.middle());
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

/// Fault of a cut that divides nothing.
fn without_effect(
    rock: &CellComplex,
    entry: &RockCut,
    at: &str,
    cuts: &[RegionCut],
    chosen: &[bool],
    whole: &WholeRock<'_>,
) -> Option<Fault> {
    let [low, high] = whole.bounds;
    let rock_is = format!("the regions lie from {} to {}", coordinates(low), coordinates(high));
    let fault = |key: &str, message: &str| {
        let fault = Fault::new(ErrorCode::EmptySelection, format!("{at}.{key}"), message);
        fault.help(rock_is.clone())
    };
    if entry.set.is_some() {
        return Some(fault("set", "no plane of the set divides a cell"));
    }
    if entry.plane.is_some() {
        return Some(fault("plane", "the plane divides no cell"));
    }
    if entry.surface.is_some() {
        return Some(fault("surface", "the surface meets no cell"));
    }
    if entry.voronoi.is_some() {
        return Some(fault("voronoi", "no cell has parts of two seeds"));
    }
    let fractures = [
        ("disc", entry.disc.is_some()),
        ("polygon", entry.polygon.is_some()),
        ("dfn", entry.dfn.is_some()),
    ];
    if let Some((key, _)) = fractures.into_iter().find(|(_, given)| *given) {
        return Some(fault(key, "no fracture covers enough of a cell to cut it"));
    }
    // A tunnel along faces that are there already divides nothing, but has cells inside.
    let inside = |cell: usize| {
        cuts.iter().any(|region_cut| match &region_cut.shape {
            CutShape::Tunnel(tunnel) => {
                region_cut.regions.contains(&rock.cells()[cell].region)
                    && tunnel.contains(&rock.centroid(cell))
            }
            _ => false,
        })
    };
    let empty = !(0..rock.cells().len()).any(|cell| chosen[cell] && inside(cell));
    empty.then(|| fault("tunnel", "the tunnel lies outside of all cells"))
}
