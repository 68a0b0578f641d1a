//! Conversion of `[[charge]]` entries to the surfaces on which their gas acts.

mod cavity;
mod holes;
mod mesh;
mod warnings;

use std::collections::BTreeSet;

use self::cavity::{between, cavities};
use self::holes::walls;
pub(super) use self::holes::{Holes, is_wall};
use self::mesh::SurfaceBuilder;
use super::geometry::touching::TouchingFaces;
use super::geometry::{Selector, coordinates};
use crate::lint::Diagnostic;
use crate::schema::{self, ChargeHistory, Deck};
use ddem_core::problem::{BlockFace, FaceId, Geometry, Lattice, Vec3};
use ddem_core::problem::{ChargeSize, Gas, GasCharge, GasSurface};
use ddem_core::{ErrorCode, Fault};

/// Charge of a deck entry, with its warnings.
pub(super) fn charge(
    index: usize,
    deck: &Deck,
    selector: &Selector,
    holes: &Holes<'_>,
) -> Result<(GasCharge, Vec<Diagnostic>), Fault> {
    let (cavities, geometry) = (cavities(selector, holes), holes.geometry);
    let mut warnings = warnings::of_cavities(index, &cavities, deck, geometry);
    let mut size = ChargeSize {
        walls: cavities.iter().map(|cavity| cavity.walls[0]).sum(),
        area: cavities.iter().map(|cavity| cavity.area).sum(),
        ..ChargeSize::default()
    };
    let mut parts: Vec<(SurfaceBuilder, f64, f64)> = cavities
        .into_iter()
        .map(|cavity| (cavity.mesh, cavity.volume, cavity.shortest_extent))
        .collect();
    let in_cavity = !parts.is_empty();
    if !in_cavity {
        let near = holes.blocks_near(selector);
        let joints = near.flat_map(|block| joints_of(geometry, block));
        let inside: Vec<_> = joints.filter(|s| selects(selector, geometry, s)).collect();
        warnings.extend(warnings::of_joints(index, inside.len(), selector, holes));
        size.joints = inside.len();
        size.area = inside.iter().map(|sides| sides[0].area(geometry)).sum();
        parts.extend(inside.iter().map(|sides| joint_surface(geometry, sides)));
    }
    if parts.is_empty() {
        return Err(no_face(index, selector, holes));
    }
    let all: BTreeSet<u32> = parts.iter().flat_map(|(mesh, ..)| mesh.nodes()).collect();
    let nodes: Vec<u32> = all.into_iter().collect();
    let position = |node: &u32| {
        let (block, at) = geometry.locate(*node as usize);
        geometry.position(block, at)
    };
    let start: Vec<Vec3> = nodes.iter().map(position).collect();
    let surface = |(mesh, volume, venting_displacement): &(SurfaceBuilder, f64, f64)| {
        mesh.gas_surface(&nodes, &start, (*volume, *venting_displacement))
    };
    let surfaces: Vec<GasSurface> = parts.iter().map(surface).collect();
    let mut charge = GasCharge { nodes, start, surfaces, pressure: 0.0, gas: None, size };
    warnings.extend(fill(&mut charge, index, &deck.charge[index], in_cavity)?);
    let first = charge.pressure * charge.gas.map_or(1.0, |gas| gas.pressure_ratio(gas.start, 0.0));
    charge.size.pressure = first;
    charge.size.timed = matches!(deck.charge[index].history, Some(ChargeHistory::Given(_)));
    let volume = charge.size.volume;
    warnings.extend(warnings::weak(index, charge.size.mass, volume, first));
    Ok((charge, warnings))
}

/// Sets the pressure of a charge, and its gas if it expands. Returns a warning about an explosive
/// too large for its cavity.
fn fill(
    charge: &mut GasCharge,
    index: usize,
    entry: &schema::Charge,
    in_cavity: bool,
) -> Result<Option<Diagnostic>, Fault> {
    let volume: f64 = charge.surfaces.iter().map(|surface| surface.volume).sum();
    charge.size.volume = volume;
    let explosive = entry.explosive.as_ref().and_then(schema::Explosive::detonation);
    let gamma = entry.index().unwrap_or(1.0);
    if let (Some(mass), Some(explosive)) = (entry.mass, explosive) {
        let own = mass / explosive.density;
        (charge.size.mass, charge.size.density) = (Some(mass), Some(explosive.density));
        let is_full = in_cavity && own > volume * (1.0 + 1e-9);
        let warning = is_full.then(|| warnings::full(index, own, volume));
        // An explosive in a joint starts from its own volume.
        let start = if in_cavity { own.max(volume) } else { own };
        let gas =
            Gas { gamma, reference_volume: own, start, expands_in_joint: !in_cavity, given: false };
        let peak = explosive.pressure();
        (charge.pressure, charge.gas) = match entry.expands() {
            true => (peak, Some(gas)),
            false => (peak * gas.pressure_ratio(start, 0.0), None),
        };
        return Ok(warning);
    }
    charge.pressure = entry.pressure.unwrap_or(0.0);
    if entry.expands() {
        // Coinciding faces enclose a volume of rounding errors only.
        let size: f64 =
            charge.surfaces.iter().map(|surface| surface.venting_displacement.powi(3)).sum();
        if volume <= 1e-9 * size {
            return Err(Fault::new(
                ErrorCode::NotSupported,
                format!("charge[{index}].history"),
                "\"gas\" in joints without thickness: there is no volume to expand from",
            )
            .help("give `mass` and `explosive`, whose own volume it expands from"));
        }
        charge.gas = Some(Gas {
            gamma,
            reference_volume: volume,
            start: volume,
            expands_in_joint: false,
            given: true,
        });
    }
    Ok(None)
}

/// The two faces of each joint at the upper sides of a block.
fn joints_of(geometry: &Geometry, block: usize) -> impl Iterator<Item = [BlockFace; 2]> {
    (0..3).filter_map(move |direction| {
        let side = |(block, upper)| BlockFace { block, face: FaceId { direction, upper } };
        Some([(block, true), (geometry.above(block, direction)?, false)].map(side))
    })
}

fn selects(selector: &Selector, geometry: &Geometry, sides: &[BlockFace; 2]) -> bool {
    selector.has_set(geometry.set(sides[0].block))
        && selector.contains_face(&between(geometry, sides), &sides[0].outward(geometry))
}

/// Surface of a gas in a joint: both faces and the strips between their edges.
fn joint_surface(geometry: &Geometry, sides: &[BlockFace; 2]) -> (SurfaceBuilder, f64, f64) {
    let [a, b] = sides;
    let mut mesh = SurfaceBuilder::default();
    mesh.add_wall(geometry, a);
    let rim: Vec<(u32, u32)> = mesh.rim().collect();
    mesh.add_wall(geometry, b);
    let opposite = |node: u32| {
        let (_, mut at) = geometry.locate(node as usize);
        at[a.direction()] = 0;
        geometry.node(b.block, at) as u32
    };
    for (p, q) in rim {
        mesh.add(vec![q, p, opposite(p), opposite(q)]);
    }
    let venting_displacement = geometry.shortest_edge(a.block).min(geometry.shortest_edge(b.block));
    (mesh, 0.0, venting_displacement)
}

/// Fault of a charge that selects nothing; it names the nearest candidate.
fn no_face(index: usize, selector: &Selector, holes: &Holes<'_>) -> Fault {
    let geometry = holes.geometry;
    let what = "selects nothing: no wall of a cavity and no joint has its centre there";
    let fault = Fault::new(ErrorCode::EmptySelection, format!("charge[{index}].where"), what);
    if TouchingFaces(geometry).joins_at(selector) > 0 {
        return fault.help(
            "gas does not push joints between faces that do not match: split the blocks on both sides alike",
        );
    }
    let hole = |(lattice, empty): (&Lattice, &[[usize; 3]])| {
        let selected = empty.iter().any(|cell| selector.contains(&lattice.centre(*cell)));
        selected && walls(lattice, empty).next().is_none()
    };
    if holes.of(selector).any(hole) {
        return fault.help(
            "there is a cavity, but gas does not push faces that do not match: `[[refine]]` a block more on \
             all sides of it, so that the blocks around it are split as it is",
        );
    }
    let cavity = holes.of(selector).flat_map(|(lattice, empty)| walls(lattice, empty));
    let cavity = cavity.map(|(_, surface)| ("wall of a cavity", surface.centre(geometry)));
    let joints = (0..geometry.blocks.len()).flat_map(|block| joints_of(geometry, block));
    let joints = joints.filter(|s| selector.has_set(geometry.set(s[0].block)));
    let joints = joints.map(|sides| ("joint", between(geometry, &sides)));
    let far = |x: &Vec3| selector.distance(x, x);
    let nearest = cavity.chain(joints).min_by(|a, b| far(&a.1).total_cmp(&far(&b.1)));
    match nearest {
        Some((kind, at)) => {
            fault.help(format!("the nearest is a {kind} with its centre at {}", coordinates(at)))
        }
        None => fault.help(
            "the model has neither cavities nor joints; a pressure on outer faces is a `[[load]]`",
        ),
    }
}
