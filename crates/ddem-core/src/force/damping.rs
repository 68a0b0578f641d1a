//! Damping of the deformation of sliding blocks, one pack at a time (§5).

use fearless_simd::Simd;
use fearless_simd_macros::simd;

use ddem_mechanics::element::corotation::Frame;
use ddem_mechanics::math::lanes::{
    Lanes, Vector, add, cross, dot, inverse_symmetric, load, load_at, scale, splat, store_at, sub,
    symmetric_times, times, zero,
};
use ddem_mesh::assembly::Assembly;
use ddem_mesh::inertia::Moments;
use ddem_mesh::pack::Packs;

/// Pack with blocks that slide.
#[derive(Clone, Copy)]
pub(crate) struct SlidingPack<'a> {
    pub(crate) packs: &'a Packs,
    pub(crate) assembly: &'a Assembly,
    /// Number of the pack.
    pub(crate) index: usize,
    /// Frame of the blocks; `None` for small displacements.
    pub(crate) frame: Option<&'a Frame>,
    /// α of each block `[1/s]`.
    pub(crate) alpha: Lanes,
}

/// Subtracts the forces `α M (v − v̄)` of four blocks from `f` and adds them to `damping_force`.
/// They damp the deformation only: the rigid motion v̄ has the momentum and the angular momentum of
/// `v`. Returns the torque of these forces with the nodes at their present positions `[N m]`.
#[simd]
pub(crate) fn damp<S: Simd>(
    simd: S,
    SlidingPack { packs, assembly, index, frame, alpha }: SlidingPack<'_>,
    u: &[Lanes],
    v: &[Lanes],
    f: &mut [Lanes],
    damping_force: &mut [Lanes],
) -> [Lanes; 3] {
    let numbering = packs.numbering_of(&packs.packs[index]);
    let inertia = &assembly.inertia[assembly.pack_inertia[index] as usize];
    let table = &assembly.tables[assembly.pack_tables[index][0] as usize];
    let at_rest = table.edges.each_ref().map(|edge| load(simd, edge));
    let edges = frame.map_or(at_rest, |frame| at_rest.map(|edge| times(&frame.matrix(simd), edge)));
    let ([momentum, first @ ..], _) = lattice_moments(simd, numbering.divisions, |node, _| {
        [scale(load_at(simd, v, 3 * node), inertia.mass[node].load(simd)), zero(simd)]
    });
    let (base, slopes) = rigid_motion(simd, &inertia.moments, &edges, momentum, first);
    let alpha = alpha.load(simd);
    let mean = frame.map_or(zero(simd), |frame| load(simd, &frame.mean));
    let ([_, first @ ..], torque) =
        lattice_moments(simd, numbering.divisions, |node, [x, y, z]| {
            let row = add(add(base, scale(slopes[2], z)), scale(slopes[1], y));
            let deforms = sub(load_at(simd, v, 3 * node), add(row, scale(slopes[0], x)));
            let force = scale(deforms, alpha * inertia.mass[node].load(simd));
            store_at(f, 3 * node, sub(load_at(simd, f, 3 * node), force));
            store_at(damping_force, 3 * node, add(load_at(simd, damping_force, 3 * node), force));
            [force, cross(sub(load_at(simd, u, 3 * node), mean), force)]
        });
    (0..3).fold(torque, |torque, d| add(torque, cross(at_rest[d], first[d]))).map(Lanes::from)
}

/// Sum and first moments of one vector over the nodes of four blocks, and the sum of another one.
/// `of` returns both vectors from the node and its coordinates, which are numbers of elements from
/// the centre.
#[inline(always)]
fn lattice_moments<S: Simd>(
    simd: S,
    divisions: usize,
    mut of: impl FnMut(usize, Vector<S>) -> [Vector<S>; 2],
) -> ([Vector<S>; 4], Vector<S>) {
    let [mut sum, mut along_x, mut along_y, mut along_z, mut others] = [zero(simd); 5];
    let from_centre = |i: usize| splat(simd, i as f64 - 0.5 * divisions as f64);
    let mut node = 0;
    for z in (0..=divisions).map(from_centre) {
        let [mut plane, mut others_of_plane] = [zero(simd); 2];
        for y in (0..=divisions).map(from_centre) {
            let [mut row, mut others_of_row] = [zero(simd); 2];
            for x in (0..=divisions).map(from_centre) {
                let [vector, other] = of(node, [x, y, z]);
                row = add(row, vector);
                others_of_row = add(others_of_row, other);
                along_x = add(along_x, scale(vector, x));
                node += 1;
            }
            plane = add(plane, row);
            others_of_plane = add(others_of_plane, others_of_row);
            along_y = add(along_y, scale(row, y));
        }
        sum = add(sum, plane);
        others = add(others, others_of_plane);
        along_z = add(along_z, scale(plane, z));
    }
    ([sum, along_x, along_y, along_z], others)
}

/// Rigid motion of four blocks with a given momentum and its first moments: the velocity at the
/// centre of the lattice, and its change per element along each direction. `edges` are the present
/// edges of an element.
#[inline(always)]
fn rigid_motion<S: Simd>(
    simd: S,
    moments: &Moments,
    edges: &[Vector<S>; 3],
    momentum: Vector<S>,
    first: [Vector<S>; 3],
) -> (Vector<S>, [Vector<S>; 3]) {
    let centre = load(simd, &moments.centre);
    // Inertia Σ m (x² 1 − x xᵀ) and angular momentum Σ m x × v, with x = Σ ι_d h_d and ι_d counted
    // from the centre of mass.
    let mut spread = [splat(simd, 0.0); 6];
    (0..3).for_each(|k| spread[k] = moments.empty.load(simd));
    let mut spin = zero(simd);
    for d in 0..3 {
        for e in 0..3 {
            let at = if d == e {
                d
            } else if (d + 1) % 3 == e {
                3 + d
            } else {
                3 + e
            };
            let moved = scale(edges[e], moments.second[at].load(simd));
            let squares = dot(edges[d], moved);
            (0..3).for_each(|k| spread[k] += squares - edges[d][k] * moved[k]);
            (0..3).for_each(|k| spread[3 + k] -= edges[d][k] * moved[(k + 1) % 3]);
        }
        spin = add(spin, cross(edges[d], sub(first[d], scale(momentum, centre[d]))));
    }
    let spin = symmetric_times(inverse_symmetric(simd, spread), spin);
    let slopes = edges.map(|edge| cross(spin, edge));
    let mean = scale(momentum, moments.per_mass.load(simd));
    let base = (0..3).fold(mean, |base, d| sub(base, scale(slopes[d], centre[d])));
    (base, slopes)
}
