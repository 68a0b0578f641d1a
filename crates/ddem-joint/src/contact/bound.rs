//! Upper bounds of the stiffness of contacts and of the rates of dashpots (§6).
//!
//! Contacts come and go, so their stiffness is bounded, not computed. Two blocks in contact are at
//! most twice as stiff as one block against fixed ground. A block is stiffest with contacts on all
//! its faces.

use nalgebra::{Matrix3, Matrix6};

use super::ContactSurfaces;
use super::bounds_at_nodes::outer_faces;
use ddem_mechanics::collide::FaceId;
use ddem_mechanics::law::SpringStiffness;
use ddem_mechanics::math::lanes::{LANES, Lanes};
use ddem_mechanics::rigid::MassProperties;
use ddem_mesh::assembly::Assembly;
use ddem_mesh::pack::Packs;
use ddem_mesh::{BodyPart, Geometry, PartShape, Vec3};

/// Upper bounds `[1/s²]`: the amount that contacts add to the largest squared angular frequency of
/// deformable blocks, and that frequency squared of rigid blocks with all joints and contacts.
pub fn bound(
    surfaces: &ContactSurfaces,
    geometry: &Geometry,
    packs: &Packs,
    assembly: &Assembly,
) -> [f64; 2] {
    let mut more = 0.0_f64;
    for block in (0..geometry.blocks.len()).filter(|&block| !geometry.is_rigid(block)) {
        let faces = each_face(surfaces, geometry, block);
        let corners = (0..8).map(|corner| [0, 1, 2].map(|d| Some(corner >> d & 1 == 1)));
        more = corners.map(|at| on_node(&faces, at)[0]).fold(more, f64::max);
    }
    let rigid = rigid_bounds(surfaces, geometry, packs, assembly);
    [more, rigid.map(|(_, square)| square).fold(0.0, f64::max)]
}

/// Upper bounds of the largest squared angular frequency of each rigid block and body with all joints
/// and contacts, with its first block `[1/s²]`.
pub fn rigid_bounds<'a>(
    surfaces: &'a ContactSurfaces,
    geometry: &'a Geometry,
    packs: &'a Packs,
    assembly: &'a Assembly,
) -> impl Iterator<Item = (usize, f64)> + 'a {
    let bodies = (0..assembly.bodies.len()).map(move |body| {
        let square = 2.0 * of_body(surfaces, geometry, packs, assembly, body);
        (assembly.bodies.parts(body)[0].block, square)
    });
    let alone = |&block: &usize| geometry.is_rigid(block) && geometry.part(block).is_none();
    let blocks = (0..geometry.blocks.len()).filter(alone).map(move |block| {
        let (pack, lane) = packs.slot(block);
        let mass_properties = &assembly.rigid[packs.packs[pack].rigid_start][lane];
        (block, 2.0 * rigid(surfaces, block as u32, mass_properties))
    });
    bodies.chain(blocks)
}

/// Contact stiffness of a face in excess of its joint's, normal and shear `[Pa/m]`. It is doubled
/// for the motion of the other block.
pub fn outer(surfaces: &ContactSurfaces, block: usize, face: FaceId) -> [f64; 2] {
    let SpringStiffness { normal, shear } = surfaces.excess_over_joint(block as u32, face);
    [2.0 * normal, 2.0 * shear]
}

/// Upper bound of the stiffness and damping that contacts and dashpots add to the nodes of
/// deformable blocks. Dashpots act on velocities half a step old.
///
/// A step is stable if `M − Δt C/2 − Δt² K/4` has no negative eigenvalue. For the expected step `g`
/// a dashpot counts as a spring of stiffness `2 C/g`.
pub struct AddedStiffness {
    /// Added stiffness of each node over its mass `[1/s²]`.
    pub squares: Vec<Lanes>,
    /// Expected time step `[s]`.
    expected: f64,
    /// Largest nodal value of half the damping over the mass `[1/s]`.
    dashpots: f64,
}

impl AddedStiffness {
    /// Additions of dashpots with a damping ratio and, if `contacts`, of contacts.
    pub fn new(
        surfaces: &ContactSurfaces,
        geometry: &Geometry,
        packs: &Packs,
        assembly: &Assembly,
        contacts: bool,
        ratio: f64,
        bonds: &[[f64; 2]],
    ) -> Self {
        let mut squares = vec![Lanes::ZERO; packs.nodes];
        let mut rates = squares.clone();
        at_parts(geometry, packs, assembly, bonds, |at, lane, [square, rate]| {
            squares[at].0[lane] = square;
            rates[at].0[lane] = rate;
        });
        for block in 0..geometry.blocks.len() {
            let (index, lane) = packs.slot(block);
            let pack = &packs.packs[index];
            if pack.rigid || geometry.part(block).is_some() {
                continue;
            }
            let faces = each_face(surfaces, geometry, block);
            let topology = geometry.topology(block);
            let n = topology.divisions();
            for node in 0..topology.nodes() {
                let at = topology.steps(node).map(|i| (i == 0 || i == n).then_some(i == n));
                let [square, rate] = on_node(&faces, at);
                squares[pack.start + node].0[lane] = if contacts { square } else { 0.0 };
                rates[pack.start + node].0[lane] = ratio * rate;
            }
        }
        let most = |field: &[Lanes]| field.iter().flat_map(|lanes| lanes.0).fold(0.0, f64::max);
        let dashpots = most(&rates);
        // The largest diagonal stiffness over mass of a node approximates the fastest mode.
        let alone = assembly.inertia.iter().flat_map(|inertia| {
            let of = |(i, k): (usize, &Lanes)| (inertia.moved_mass()[i / 3], *k);
            inertia.moved_diagonal().iter().enumerate().map(of)
        });
        let alone = alone
            .flat_map(|(mass, k)| std::array::from_fn::<_, { LANES }, _>(|l| (mass.0[l], k.0[l])))
            .filter(|(mass, _)| *mass > 0.0)
            .map(|(mass, k)| k / mass);
        let square = most(&squares) + alone.fold(0.0, f64::max);
        let expected = longest(0.25 * square, dashpots);
        for (square, rate) in squares.iter_mut().zip(&rates) {
            *square = Lanes(std::array::from_fn(|l| square.0[l] + 4.0 * rate.0[l] / expected));
        }
        Self { squares, expected, dashpots }
    }

    /// Critical time step for the largest eigenvalue of `M⁻¹ K` including these additions `[s]`.
    pub fn critical_step(&self, largest: f64) -> f64 {
        let step = 2.0 / largest.sqrt();
        if self.dashpots == 0.0 || step >= self.expected {
            // The assumed springs are at least as stiff as the dashpots at this step.
            return step;
        }
        // The dashpots exceed the assumed springs, at most by the largest rate.
        longest((0.25 * largest - self.dashpots / self.expected).max(0.0), self.dashpots)
    }
}

/// Calls `visit` with slot, lane, stiffness over mass `[1/s²]` and rate of the dashpots `[1/s]` of
/// each node of a part of a cell. `bonds` are the stiffnesses `[N/m]` and dashpots `[N s/m]` of its
/// joints by node, which count twice for the motion of the other side.
fn at_parts(
    geometry: &Geometry,
    packs: &Packs,
    assembly: &Assembly,
    bonds: &[[f64; 2]],
    mut visit: impl FnMut(usize, usize, [f64; 2]),
) {
    let mut sums = bonds.to_vec();
    for group in geometry.tied_deformable().filter(|_| !bonds.is_empty()) {
        let of = |k: usize| group.iter().map(|&node| sums[node as usize][k]).sum();
        let whole = [of(0), of(1)];
        group.iter().for_each(|&node| sums[node as usize] = whole);
    }
    let some = |(_, sum): &(usize, [f64; 2])| *sum != [0.0; 2];
    for (node, [stiffness, dashpot]) in sums.into_iter().enumerate().filter(some) {
        let block = geometry.block_of(node);
        if geometry.part(block).is_none() || geometry.is_rigid(block) {
            continue;
        }
        let slot = packs.node_slot(geometry, node);
        let inertia = &assembly.inertia[assembly.pack_inertia[slot.pack] as usize];
        let mass = inertia.moved_mass()[slot.local(packs)].0[slot.lane()];
        if mass > 0.0 {
            visit(slot.at as usize / 3, slot.lane(), [2.0 * stiffness / mass, dashpot / mass]);
        }
    }
}

/// Largest Δt with `a Δt² + b Δt ≤ 1`.
fn longest(a: f64, b: f64) -> f64 {
    2.0 / (b + (b * b + 4.0 * a).sqrt())
}

/// Contacts and dashpots on one face of a deformable block, relative to the mass of a node on it.
#[derive(Clone, Copy, Default)]
struct FaceStiffness {
    /// Normal and shear stiffness over mass `[1/s²]`.
    normal: f64,
    shear: f64,
    /// Rate of the dashpots for a damping ratio of 1 `[1/s]`: `ω_c √(m/m_n)`, with the mass m that
    /// vibrates on them and the mass m_n of the node.
    rate: f64,
}

fn each_face(surfaces: &ContactSurfaces, geometry: &Geometry, block: usize) -> [FaceStiffness; 6] {
    [0, 1, 2, 3, 4, 5].map(|number| {
        let face = FaceId::from_number(number);
        let is_inner = |part: &PartShape| face.upper || part.faces[face.direction].is_none();
        if geometry.part(block).is_some_and(is_inner) {
            return FaceStiffness::default();
        }
        let per_mass = per_mass(surfaces, geometry, block, face);
        let SpringStiffness { normal, shear } = surfaces.excess_over_joint(block as u32, face);
        let stiffest = surfaces.largest_with_joint(block as u32, face).normal;
        let mass_ratio = surfaces.mass_ratio(block as u32, face, stiffest);
        FaceStiffness {
            normal: normal * per_mass,
            shear: shear * per_mass,
            rate: (stiffest * per_mass * mass_ratio).sqrt(),
        }
    })
}

/// Stiffness over mass `[1/s²]` and dashpot rate `[1/s]` of a node. `at` says for each direction if
/// the node is on the lower face, on the upper face or on none. On edges and corners the shear of
/// adjacent faces adds to the normal stiffness.
fn on_node(faces: &[FaceStiffness; 6], at: [Option<bool>; 3]) -> [f64; 2] {
    let on: [FaceStiffness; 3] = std::array::from_fn(|d| match at[d] {
        Some(upper) => faces[2 * d + usize::from(upper)],
        None => FaceStiffness::default(),
    });
    let along = |d: usize| on[d].normal + on[(d + 1) % 3].shear + on[(d + 2) % 3].shear;
    let square = along(0).max(along(1)).max(along(2));
    [square, on[0].rate.max(on[1].rate).max(on[2].rate)]
}

/// Area over mass of a node on a face, doubled for the motion of the other block: `A/m = 2/(ρ h)`
/// `[m²/kg]`.
fn per_mass(surfaces: &ContactSurfaces, geometry: &Geometry, block: usize, face: FaceId) -> f64 {
    4.0 / (surfaces.density(block as u32, face) * geometry.surface_height(block, face.direction))
}

/// Largest squared angular frequency with springs at the corners of all faces `[1/s²]`. Each face
/// has the stiffness of its contact or its joint, the larger one.
fn rigid(surfaces: &ContactSurfaces, block: u32, mass_properties: &MassProperties) -> f64 {
    let mut sum = Matrix6::zeros();
    let motions = ScaledMotions::new(mass_properties);
    for face in FaceId::all() {
        let (d, e, f) = (face.direction, (face.direction + 1) % 3, (face.direction + 2) % 3);
        let cross = mass_properties.half[e].cross(&mass_properties.half[f]);
        let k = spring(surfaces.largest_with_joint(block, face), &cross);
        let side = mass_properties.half[d] * if face.upper { 1.0 } else { -1.0 };
        for (i, j) in [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)] {
            let arm: Vec3 = side + mass_properties.half[e] * i + mass_properties.half[f] * j;
            motions.add(&mut sum, &k, &arm);
        }
    }
    sum.symmetric_eigenvalues().max()
}

/// Largest squared angular frequency of a body of several blocks with springs at the corners of all
/// faces of its parts that lie on its surface `[1/s²]`, as in [`rigid`].
fn of_body(
    surfaces: &ContactSurfaces,
    geometry: &Geometry,
    packs: &Packs,
    assembly: &Assembly,
    body: usize,
) -> f64 {
    let parts = assembly.bodies.parts(body);
    let properties =
        |part: &BodyPart| &assembly.rigid[packs.packs[part.pack].rigid_start][part.lane];
    let (mut sum, motions) = (Matrix6::zeros(), ScaledMotions::new(properties(&parts[0])));
    for part in parts {
        let mass_properties = properties(part);
        for face in outer_faces(geometry, part.block) {
            let d = face.direction;
            let (e, f) = (1 << ((d + 1) % 3), 1 << ((d + 2) % 3));
            let arms = [0, e, e | f, f].map(|corner| mass_properties.arm(corner));
            // Each of the four corners has a quarter of the area, half the product of the diagonals.
            let quarter = (arms[2] - arms[0]).cross(&(arms[3] - arms[1])) / 8.0;
            let k = spring(surfaces.largest_with_joint(part.block as u32, face), &quarter);
            arms.iter().for_each(|arm| motions.add(&mut sum, &k, arm));
        }
    }
    sum.symmetric_eigenvalues().max()
}

/// Stiffness of springs over an area with a normal `[N/m]`.
fn spring(stiffness: SpringStiffness, area: &Vec3) -> Matrix3<f64> {
    stiffness.matrix(&area.try_normalize(0.0).unwrap_or_default()) * area.norm()
}

/// Motions of a rigid block scaled by `m^{-½}` and `I^{-½}`.
struct ScaledMotions {
    mass: f64,
    inertia: Matrix3<f64>,
}

impl ScaledMotions {
    fn new(mass_properties: &MassProperties) -> Self {
        Self { mass: mass_properties.mass.sqrt(), inertia: mass_properties.inverse_root() }
    }

    /// Adds a spring at an arm to a stiffness.
    fn add(&self, sum: &mut Matrix6<f64>, k: &Matrix3<f64>, arm: &Vec3) {
        let mut motion = nalgebra::Matrix3x6::zeros();
        motion.fixed_view_mut::<3, 3>(0, 0).copy_from(&(Matrix3::identity() / self.mass));
        motion.fixed_view_mut::<3, 3>(0, 3).copy_from(&(-arm.cross_matrix() * self.inertia));
        *sum += motion.transpose() * k * motion;
    }
}
