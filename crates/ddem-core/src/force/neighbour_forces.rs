//! Forces of neighbours on a pack: forces and torques of the joints at its lower sides, and the
//! nodal forces that balance the torque of each of its blocks.

use std::ops::Range;

use fearless_simd::{Select, Simd, mask64x4};
use fearless_simd_macros::simd;

use ddem_mechanics::element::corotation::{Frame, torque_forces};
use ddem_mechanics::math::lanes::{
    LANES, Lanes, Vector, add, load, load_at, scale, shifted, splat, sub,
};
use ddem_mesh::assembly::Assembly;
use ddem_mesh::numbering::BlockNumbering;
use ddem_mesh::pack::Packs;
use ddem_mesh::parallel::neighbour_force_start;

/// Forces of joints on neighbours, by the pack that owns the joints.
#[derive(Clone, Copy)]
pub(crate) struct NeighbourForces<'a> {
    /// Packs from `first` on.
    pub(crate) first: usize,
    pub(crate) forces: &'a [Lanes],
    /// Other packs: their numbers and forces.
    pub(crate) others: &'a [(Range<usize>, &'a [Lanes])],
}

impl<'a> NeighbourForces<'a> {
    /// Forces of all packs.
    pub(crate) fn all(forces: &'a [Lanes]) -> Self {
        Self { first: 0, forces, others: &[] }
    }

    /// Forces of the joints of a pack on neighbours, and torques.
    #[inline(always)]
    fn of(&self, packs: &Packs, pack: usize) -> &'a [[Lanes; 3]] {
        let within = |first: usize, forces: &'a [Lanes]| {
            let at =
                |pack| neighbour_force_start(packs, pack) - neighbour_force_start(packs, first);
            forces.get(at(pack)..at(pack + 1)).map(|forces| forces.as_chunks::<3>().0)
        };
        let own = if pack >= self.first { within(self.first, self.forces) } else { None };
        own.or_else(|| {
            let (range, forces) = self.others.iter().find(|(range, _)| range.contains(&pack))?;
            within(range.start, forces)
        })
        .unwrap_or_default()
    }
}

/// Sets the forces and the torque of a pack on its neighbours at an offset to zero, if it has no
/// joint with them. Its joints of more blocks, strips and corners, may still add forces there.
pub(crate) fn clear(numbering: &BlockNumbering, offset: usize, neighbour_forces: &mut [Lanes]) {
    let part = numbering.upper_part(offset);
    let (first, nodes) = (part.in_neighbour_forces.first, part.count.iter().product::<usize>());
    neighbour_forces[3 * first..3 * (first + nodes)].fill(Lanes::ZERO);
    neighbour_forces[3 * numbering.torque(offset)..][..3].fill(Lanes::ZERO);
}

/// Adds the forces and torques of the joints at the lower sides of a pack, which the owners of
/// these joints have stored, to `f` and `torque`. The fixed order of offsets gives every node one
/// order of summation.
#[simd]
pub(crate) fn collect<S: Simd>(
    simd: S,
    packs: &Packs,
    assembly: &Assembly,
    index: usize,
    neighbour_forces: NeighbourForces<'_>,
    f: &mut [Lanes],
    torque: &mut [Lanes; 3],
) {
    let pack = &packs.packs[index];
    let numbering = packs.numbering_of(pack);
    let f = f.as_chunks_mut::<3>().0;
    for offset in 1..8 {
        let lower = &pack.lower[offset];
        if lower.is_none() || !assembly.loaded_neighbours[offset] {
            continue;
        }
        let of = |pack: usize| neighbour_forces.of(packs, pack);
        let Some(run) = lower.in_order() else {
            for lane in 0..pack.filled {
                let Some((other, there)) = lower.at(lane) else { continue };
                add_lane(of(other), [lane, there], numbering, offset, f, torque);
            }
            continue;
        };
        let forces = run.packs().map(of);
        let present = (run.present != [true; LANES]).then(|| run.mask(simd));
        match run.shift {
            0 => add_run::<S, 0>(simd, forces, present, numbering, offset, f, torque),
            1 => add_run::<S, 1>(simd, forces, present, numbering, offset, f, torque),
            2 => add_run::<S, 2>(simd, forces, present, numbering, offset, f, torque),
            _ => add_run::<S, 3>(simd, forces, present, numbering, offset, f, torque),
        }
    }
}

/// Adds the forces and torques of four neighbours in order.
#[simd]
fn add_run<S: Simd, const SHIFT: usize>(
    simd: S,
    sources: [&[[Lanes; 3]]; 2],
    present: Option<mask64x4<S>>,
    numbering: &BlockNumbering,
    offset: usize,
    f: &mut [[Lanes; 3]],
    torque: &mut [Lanes; 3],
) {
    let part = numbering.upper_part(offset);
    let [from, to] = [part.in_neighbour_forces.step[0], part.in_block.step[0]];
    for [j, k] in part.rows() {
        let (slot, node) = (part.in_neighbour_forces.row(j, k), part.in_block.row(j, k));
        for i in 0..part.count[0] {
            let f = &mut f[node + i * to];
            *f = add(load(simd, f), load_run::<S, SHIFT>(simd, sources, present, slot + i * from))
                .map(Lanes::from);
        }
    }
    *torque = add(
        load(simd, torque),
        load_run::<S, SHIFT>(simd, sources, present, numbering.torque(offset)),
    )
    .map(Lanes::from);
}

/// Forces of four neighbours in order at one slot; zero in lanes without a neighbour.
#[inline(always)]
fn load_run<S: Simd, const SHIFT: usize>(
    simd: S,
    [low, high]: [&[[Lanes; 3]]; 2],
    present: Option<mask64x4<S>>,
    slot: usize,
) -> Vector<S> {
    let low = load(simd, &low[slot]);
    let force = if SHIFT == 0 { low } else { shifted::<S, SHIFT>(low, load(simd, &high[slot])) };
    let Some(present) = present else { return force };
    let [x, y, z] = force;
    let zero = splat(simd, 0.0);
    [present.select(x, zero), present.select(y, zero), present.select(z, zero)]
}

/// Adds the forces and the torque of a neighbour in lane `there` to the block in lane `lane`.
fn add_lane(
    forces: &[[Lanes; 3]],
    [lane, there]: [usize; 2],
    numbering: &BlockNumbering,
    offset: usize,
    f: &mut [[Lanes; 3]],
    torque: &mut [Lanes; 3],
) {
    let part = numbering.upper_part(offset);
    for [j, k] in part.rows() {
        for i in 0..part.count[0] {
            let from =
                &forces[part.in_neighbour_forces.row(j, k) + i * part.in_neighbour_forces.step[0]];
            let to = &mut f[part.in_block.row(j, k) + i * part.in_block.step[0]];
            (0..3).for_each(|c| to[c].0[lane] += from[c].0[there]);
        }
    }
    (0..3).for_each(|c| torque[c].0[lane] += forces[numbering.torque(offset)][c].0[there]);
}

/// Subtracts the nodal forces that balance the torque of each block of a pack, and adds its loads
/// if there are any.
#[expect(clippy::too_many_arguments, reason = "one loop for two small tasks")]
#[simd]
pub(crate) fn spread_torque<S: Simd>(
    simd: S,
    packs: &Packs,
    assembly: &Assembly,
    index: usize,
    frame: &Frame,
    torque: Vector<S>,
    loads: Option<&[Lanes]>,
    f: &mut [Lanes],
) {
    let n = packs.numbering_of(&packs.packs[index]).divisions;
    let edges = &assembly.tables[assembly.pack_tables[index][0] as usize].edges;
    let per_step = torque_forces(simd, n, edges, frame, torque);
    let half = 0.5 * n as f64;
    let side = n + 1;
    let rows = f.as_chunks_mut::<3>().0.chunks_exact_mut(side);
    for (number, row) in rows.enumerate() {
        let [i, j, k] = [0, number % side, number / side].map(|at| splat(simd, at as f64 - half));
        let plane = add(scale(per_step[2], k), scale(per_step[1], j));
        let mut balance = add(plane, scale(per_step[0], i));
        let loads = loads.map(|loads| &loads[3 * side * number..][..3 * side]);
        for (node, f) in row.iter_mut().enumerate() {
            let mut force = sub(load(simd, f), balance);
            if let Some(loads) = loads {
                force = add(force, load_at(simd, loads, 3 * node));
            }
            *f = force.map(Lanes::from);
            balance = add(balance, per_step[0]);
        }
    }
}
