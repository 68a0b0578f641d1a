//! Forces of neighbours on a pack: forces and torques of the joints at its lower sides, and the
//! nodal forces that balance the torque of each of its blocks.

use fearless_simd::Simd;
use fearless_simd_macros::simd;

use ddem_mechanics::element::corotation::{Frame, torque_forces};
use ddem_mechanics::math::lanes::{Lanes, Vector, add, load, load_at, scale, splat, store_at, sub};
use ddem_mesh::assembly::Assembly;
use ddem_mesh::pack::{BlockNumbering, Packs};

/// Adds the forces and torques of the joints at the lower sides of a pack, which the owners of
/// these joints have stored, to `f` and `torque`. The fixed order of offsets gives every node one
/// order of summation.
#[simd]
pub(crate) fn collect<S: Simd>(
    simd: S,
    packs: &Packs,
    index: usize,
    neighbour_forces: &[Lanes],
    f: &mut [Lanes],
    torque: &mut [Lanes; 3],
) {
    let pack = &packs.packs[index];
    let shape = packs.shape_of(pack);
    for offset in 1..8 {
        let lower = &pack.lower[offset];
        if lower.is_none() {
            continue;
        }
        let entries = entries(shape, offset);
        if let Some(other) = lower.aligned() {
            let first = 3 * packs.packs[other].neighbour_force_start;
            for (local, place) in entries {
                let sum = add(
                    load_at(simd, f, 3 * local),
                    load_at(simd, neighbour_forces, first + 3 * place),
                );
                store_at(f, 3 * local, sum);
            }
            let share = load_at(simd, neighbour_forces, first + 3 * shape.torque(offset));
            let [x, y, z] = add(load(simd, torque), share);
            *torque = [Lanes::from(x), Lanes::from(y), Lanes::from(z)];
            continue;
        }
        for lane in 0..pack.filled {
            let Some((other, there)) = lower.at(lane) else { continue };
            let first = 3 * packs.packs[other].neighbour_force_start;
            for (local, place) in entries.clone() {
                for c in 0..3 {
                    f[3 * local + c].0[lane] += neighbour_forces[first + 3 * place + c].0[there];
                }
            }
            let from = first + 3 * shape.torque(offset);
            for c in 0..3 {
                torque[c].0[lane] += neighbour_forces[from + c].0[there];
            }
        }
    }
}

/// Subtracts the nodal forces that balance the torque of each block of a pack.
#[simd]
pub(crate) fn spread_torque<S: Simd>(
    simd: S,
    packs: &Packs,
    assembly: &Assembly,
    index: usize,
    frame: &Frame,
    torque: Vector<S>,
    f: &mut [Lanes],
) {
    let n = packs.shape_of(&packs.packs[index]).divisions;
    let edges = &assembly.tables[assembly.pack_tables[index][0] as usize].edges;
    let per_step = torque_forces(simd, n, edges, frame, torque);
    let half = 0.5 * n as f64;
    let mut node = 0;
    for k in 0..=n {
        let plane = scale(per_step[2], splat(simd, k as f64 - half));
        for j in 0..=n {
            let row = add(plane, scale(per_step[1], splat(simd, j as f64 - half)));
            for i in 0..=n {
                let force = add(row, scale(per_step[0], splat(simd, i as f64 - half)));
                store_at(f, node, sub(load_at(simd, f, node), force));
                node += 3;
            }
        }
    }
}

/// Local nodes at the lower side towards an offset, with their indices in the owner's neighbour
/// forces.
#[inline(always)]
fn entries(shape: &BlockNumbering, offset: usize) -> impl Iterator<Item = (usize, usize)> + Clone {
    let start = shape.neighbour_force_start[offset];
    shape.touched[offset].iter().enumerate().map(move |(i, &local)| (local, start + i))
}
