//! §10: charges. The surfaces that their gas pushes, and its pressure.
//!
//! The gas fills a closed surface of facets between nodes, or several; where a cavity is open, the
//! surface ends. A pressure p does `p A` on the nodes, with the present areas A: of a closed surface no
//! force and no moment are left, and the work is `p dV`.

mod cavity;
mod doubts;
mod shell;
mod size;

use std::collections::BTreeSet;

use self::cavity::{between, cavities};
pub(crate) use self::cavity::{is_wall, walls};
use self::shell::{Mesh, Shell};
pub use self::size::ChargeSize;
use crate::deck::{self, ChargeHistory, Deck};
use crate::error::Fault;
use crate::geometry::{Face, Geometry, Lattice, NONE, Region, Surface, Vec3, faces, place};

/// The gas in one shell of a charge.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Fill {
    /// Volume of the shell when the charge went off, if it has `[m³]`.
    pub(crate) began: Option<f64>,
    /// Volume with which the gas got out, if it has `[m³]`.
    pub(crate) left: Option<f64>,
}

/// The gas of a charge that expands.
#[derive(Clone, Copy, Debug)]
struct Gas {
    gamma: f64,
    /// Volume at which it has the pressure of the charge `[m³]`.
    own: f64,
    /// Volume that it has at the start `[m³]`.
    start: f64,
    /// It makes its own room: its volume grows by what the shells grow by from when it goes off.
    own_room: bool,
    /// It has the pressure of the charge in the volume that there is when it goes off.
    given: bool,
}

impl Gas {
    /// Its volume, from one at first that has grown by so much. Explosive is in no less than its own, and
    /// walls that have met leave no gas of no volume.
    fn volume(&self, first: f64, grown: f64) -> f64 {
        (first + grown).max(if self.given { 1e-6 * first } else { self.own })
    }

    /// Its pressure as a part of the charge's.
    fn part(&self, first: f64, grown: f64) -> f64 {
        let own = if self.given { first } else { self.own };
        libm::pow(own / self.volume(first, grown), self.gamma)
    }
}

/// One `[[charge]]`.
#[derive(Clone, Debug)]
pub(crate) struct Charge {
    /// Nodes that it pushes, in order.
    pub(crate) nodes: Vec<u32>,
    /// Their reference positions `[m]`.
    start: Vec<Vec3>,
    pub(crate) shells: Vec<Shell>,
    /// Pressure `[Pa]`: of the gas in its own volume, or at factor 1.
    pressure: f64,
    gas: Option<Gas>,
    /// What there is of it at the start.
    pub(crate) size: ChargeSize,
    /// What is doubtful about it.
    pub(crate) doubts: Vec<String>,
}

/// A charge at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChargeState {
    /// Pressure of its gas `[Pa]`; 0 before it goes off, and where it is not in force.
    pub pressure: f64,
    /// Volume of the cavity, or of the joints `[m³]`: what the gas has got out of has that with which
    /// it did.
    pub volume: f64,
    /// Whether the gas has got out everywhere.
    pub vented: bool,
    /// Volume of the cavity, or of the joints, when it went off; `None` before `[m³]`.
    pub began: Option<f64>,
}

/// What a charge does to its nodes.
#[derive(Debug)]
pub(crate) struct Push {
    /// At factor 1 `[Pa]`.
    pub(crate) pressure: f64,
    /// Volume of all shells `[m³]`.
    pub(crate) volume: f64,
    /// At factor 1, by node `[N]`.
    pub(crate) forces: Vec<Vec3>,
    /// Of each shell.
    pub(crate) fills: Vec<Fill>,
}

impl Charge {
    pub(crate) fn new(
        index: usize,
        deck: &Deck,
        region: &Region,
        geometry: &Geometry,
    ) -> Result<Self, Fault> {
        let cavities = cavities(region, geometry);
        let mut doubts = doubts::of_cavities(&cavities, deck, geometry);
        let mut size = ChargeSize {
            walls: cavities.iter().map(|cavity| cavity.walls[0]).sum(),
            area: cavities.iter().map(|cavity| cavity.area).sum(),
            ..ChargeSize::default()
        };
        let mut parts: Vec<(Mesh, f64, f64)> =
            cavities.into_iter().map(|cavity| (cavity.mesh, cavity.volume, cavity.reach)).collect();
        let in_cavity = !parts.is_empty();
        if !in_cavity {
            let joints = faces(geometry).into_iter().map(|face| sides(&face));
            let inside: Vec<_> = joints.filter(|s| selects(region, geometry, s)).collect();
            doubts.extend(doubts::of_joints(inside.len(), region, geometry));
            size.joints = inside.len();
            size.area = inside.iter().map(|sides| sides[0].area(geometry)).sum();
            parts.extend(inside.iter().map(|sides| seam(geometry, sides)));
        }
        if parts.is_empty() {
            return Err(no_face(index, region, geometry));
        }
        let all: BTreeSet<u32> = parts.iter().flat_map(|(mesh, ..)| mesh.nodes()).collect();
        let nodes: Vec<u32> = all.into_iter().collect();
        let position = |node: &u32| {
            let (body, at) = geometry.locate(*node as usize);
            geometry.position(body, at)
        };
        let start: Vec<Vec3> = nodes.iter().map(position).collect();
        let shell = |(mesh, volume, reach): &(Mesh, f64, f64)| {
            mesh.shell(&nodes, &start, (*volume, *reach))
        };
        let shells: Vec<Shell> = parts.iter().map(shell).collect();
        let mut charge = Self { nodes, start, shells, pressure: 0.0, gas: None, size, doubts };
        charge.fill(index, &deck.charge[index], in_cavity)?;
        let first = charge.pressure * charge.gas.map_or(1.0, |gas| gas.part(gas.start, 0.0));
        charge.size.pressure = first;
        charge.size.timed = matches!(deck.charge[index].history, Some(ChargeHistory::Given(_)));
        let room = charge.size.volume;
        charge.doubts.extend(doubts::of_little(charge.size.mass, room, first));
        Ok(charge)
    }

    /// Nodes of the walls of cavities that it pushes.
    pub(crate) fn walls(&self) -> impl Iterator<Item = Vec<u32>> {
        let in_cavity = self.shells.iter().filter(|_| self.size.walls > 0);
        let node = |&at: &u32| self.nodes[at as usize];
        in_cavity.flat_map(Shell::walls).map(move |wall| wall.iter().map(node).collect())
    }

    /// Takes in what is in the cavity: pressure, and gas if it expands.
    fn fill(&mut self, index: usize, entry: &deck::Charge, in_cavity: bool) -> Result<(), Fault> {
        let room: f64 = self.shells.iter().map(|shell| shell.volume).sum();
        self.size.volume = room;
        let explosive = entry.explosive.as_ref().and_then(deck::Explosive::detonation);
        let gamma = entry.index().unwrap_or(1.0);
        if let (Some(mass), Some(explosive)) = (entry.mass, explosive) {
            let own = mass / explosive.density;
            (self.size.mass, self.size.density) = (Some(mass), Some(explosive.density));
            if in_cavity && own > room * (1.0 + 1e-9) {
                self.doubts.push(format!(
                    "{own:.4e} m³ of explosive in a cavity of {room:.4e} m³: it begins with the pressure \
                     of detonation"
                ));
            }
            // Explosive in a joint makes its own room.
            let start = if in_cavity { own.max(room) } else { own };
            let gas = Gas { gamma, own, start, own_room: !in_cavity, given: false };
            let peak = explosive.pressure();
            (self.pressure, self.gas) = match entry.expands() {
                true => (peak, Some(gas)),
                false => (peak * gas.part(start, 0.0), None),
            };
            return Ok(());
        }
        self.pressure = entry.pressure.unwrap_or(0.0);
        if entry.expands() {
            // Faces that coincide enclose rounding.
            let size: f64 = self.shells.iter().map(|shell| shell.reach.powi(3)).sum();
            if room <= 1e-9 * size {
                return Err(Fault::new(
                    format!("charge[{index}].history"),
                    "\"gas\" in joints without thickness: there is no volume to expand from",
                )
                .help("give `mass` and `explosive`, whose own volume it expands from"));
            }
            self.gas = Some(Gas { gamma, own: room, start: room, own_room: false, given: true });
        }
        Ok(())
    }

    /// Pressure by volume of a gas that expands, `γ p/V` `[Pa/m³]`, and the areas that it has then `[m²]`: gas is a
    /// spring of the stiffness `γ p/V A Aᵀ`. It is stiffest at the start, or when it went off in less room.
    pub(crate) fn stiffness(&self, u: &[Vec3], fills: &[Fill]) -> Option<(f64, Vec<Vec3>)> {
        let gas = self.gas?;
        let still = vec![Vec3::zeros(); self.nodes.len()];
        let off = fills.iter().any(|fill| fill.began.is_some());
        let [first, grown] = if off { self.room(u, fills) } else { [gas.start, 0.0] };
        let narrow = gas.volume(first, grown) < gas.start;
        let (volume, at) = match (narrow, gas.given) {
            (false, _) => (gas.start, &still[..]),
            (true, true) => (gas.volume(first, grown), u),
            // It may become narrower still.
            (true, false) => (gas.own, u),
        };
        let mut areas = still.clone();
        self.shells.iter().for_each(|shell| shell.add_areas(&self.start, at, &mut areas));
        let own = if gas.given { first } else { gas.own };
        Some((gas.gamma * self.pressure * libm::pow(own / volume, gas.gamma) / volume, areas))
    }

    /// Volume that its gas has at first, and by how much that has grown `[m³]`.
    fn room(&self, u: &[Vec3], fills: &[Fill]) -> [f64; 2] {
        let Some(gas) = self.gas else { return [0.0; 2] };
        let (mut all, mut began) = (0.0, 0.0);
        for (shell, fill) in self.shells.iter().zip(fills) {
            let volume = fill.left.unwrap_or_else(|| shell.volume(&self.start, u));
            all += volume;
            began += fill.began.unwrap_or(volume);
        }
        let grown = all - began;
        match (gas.given, gas.own_room) {
            (true, _) => [began, grown],
            // No joint is too narrow for the explosive that is in it,
            (_, true) => [gas.own, grown.max(0.0)],
            // and where rock has moved into its cavity it makes its room.
            _ => [began.max(gas.own), grown],
        }
    }

    /// What it does after these displacements of its nodes.
    pub(crate) fn push(&self, u: &[Vec3], fills: &[Fill]) -> Push {
        let mut forces = vec![Vec3::zeros(); self.nodes.len()];
        let (mut all, mut now) = (0.0, Vec::with_capacity(self.shells.len()));
        for (shell, fill) in self.shells.iter().zip(fills) {
            let volume = fill.left.unwrap_or_else(|| shell.volume(&self.start, u));
            let left = fill.left.is_some() || shell.is_open(u);
            all += volume;
            now.push(Fill { began: fill.began.or(Some(volume)), left: left.then_some(volume) });
            if !left {
                shell.add_areas(&self.start, u, &mut forces);
            }
        }
        let [first, grown] = self.room(u, &now);
        let pressure = self.pressure * self.gas.map_or(1.0, |gas| gas.part(first, grown));
        forces.iter_mut().for_each(|force| *force *= pressure);
        Push { pressure, volume: all, forces, fills: now }
    }
}

/// The two faces of a joint.
fn sides(face: &Face) -> [Surface; 2] {
    let normal = face.direction as usize;
    let side = |body: u32, side: i32| Surface { body: body as usize, normal, side };
    [side(face.a, 1), side(face.b, -1)]
}

fn selects(region: &Region, geometry: &Geometry, sides: &[Surface; 2]) -> bool {
    region.has_set(geometry.set(sides[0].body))
        && region.contains_face(&between(geometry, sides), &sides[0].outward(geometry))
}

/// The surface of a gas in a joint: both faces, and what is between their edges.
fn seam(geometry: &Geometry, sides: &[Surface; 2]) -> (Mesh, f64, f64) {
    let [a, b] = sides;
    let mut mesh = Mesh::default();
    mesh.add_wall(geometry, a);
    let rim: Vec<(u32, u32)> = mesh.rim().collect();
    mesh.add_wall(geometry, b);
    let opposite = |node: u32| {
        let (_, mut at) = geometry.locate(node as usize);
        at[a.normal] = 0;
        geometry.node(b.body, at) as u32
    };
    for (p, q) in rim {
        mesh.add(vec![q, p, opposite(p), opposite(q)]);
    }
    let reach = geometry.shortest_edge(a.body).min(geometry.shortest_edge(b.body));
    (mesh, 0.0, reach)
}

/// A charge that pushes nothing, and what would be nearest.
fn no_face(index: usize, region: &Region, geometry: &Geometry) -> Fault {
    let what = "selects nothing: no wall of a cavity and no joint has its centre there";
    let fault = Fault::new(format!("charge[{index}].where"), what);
    if geometry.joins_at(region) > 0 {
        return fault.help(
            "there are joints between faces that do not match, which gas does not push: split the blocks on \
             both sides alike",
        );
    }
    let in_sets = geometry.lattices.iter().filter(|lattice| region.has_set(lattice.set));
    let hole = |lattice: &&Lattice| {
        let taken = (0..lattice.body.len()).filter(|&at| lattice.body[at] == NONE);
        taken.map(|at| lattice.centre(lattice.cell(at))).any(|x| region.contains(&x))
    };
    if in_sets.clone().any(|lattice| hole(&lattice) && walls(lattice).next().is_none()) {
        return fault.help(
            "there is a cavity, but gas does not push faces that do not match: `[[refine]]` a block more on \
             all sides of it, so that the blocks around it are split as it is",
        );
    }
    let cavity = in_sets.flat_map(walls);
    let cavity = cavity.map(|(_, surface)| ("wall of a cavity", surface.centre(geometry)));
    let joints = faces(geometry).into_iter().map(|face| sides(&face));
    let joints = joints.filter(|s| region.has_set(geometry.set(s[0].body)));
    let joints = joints.map(|sides| ("joint", between(geometry, &sides)));
    let far = |x: &Vec3| region.distance(x, x);
    let nearest = cavity.chain(joints).min_by(|a, b| far(&a.1).total_cmp(&far(&b.1)));
    match nearest {
        Some((kind, at)) => {
            fault.help(format!("the nearest is a {kind} with its centre at {}", place(at)))
        }
        None => fault.help(
            "the model has neither cavities nor joints; a pressure on outer faces is a `[[load]]`",
        ),
    }
}
