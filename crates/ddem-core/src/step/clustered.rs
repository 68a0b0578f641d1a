//! Largest eigenvalues of a relaxation, whose masses are clustered (§7).

use std::collections::BTreeSet;

use fearless_simd::dispatch;

use crate::error::RunError;
use crate::model::Model;
use crate::step::preconditioner::{BondPoints, Preconditioner, Present, accelerations};
use crate::step::scratch::Scratch;
use crate::step::timestep::start;
use crate::step::{FirstPass, internal_forces};
use ddem_joint::broken::BrokenJoints;
use ddem_mechanics::math::exact::sum;
use ddem_mechanics::math::lanes::{LANES, Lanes};
use ddem_mechanics::rigid::Pose;
use ddem_mesh::Vec3;
use ddem_mesh::parallel::{each_pack, node_start};

/// Largest eigenvalue of `M⁻¹K` for the clustered masses of relaxation, by power iteration. The
/// inverse masses of held degrees of freedom are zero, so that these do not take part.
///
/// The Rayleigh quotient weighs modes by their energy. Modes that open a joint have `h/t` times as
/// much energy as the others, and their eigenvalue is at most 9/4. If joints are very thin, the
/// quotient therefore gives their eigenvalue until the other modes have outgrown them. The
/// displacements show this: they grow by the largest eigenvalue at every product, for any
/// thickness.
pub(crate) fn largest_clustered(
    model: &Model,
    preconditioner: &mut Preconditioner,
    broken_joints: &mut BrokenJoints,
    scratch: &mut Scratch,
    stop: &dyn Fn() -> bool,
) -> Result<f64, RunError> {
    const STEPS: usize = 40;
    const MOST_STEPS: usize = 200;
    const GROWS: f64 = 1.05;
    let n = 3 * model.packs.nodes;
    let (mut x, mut next) = (start(model, n), vec![Lanes::ZERO; n]);
    preconditioner.start_bonds(model, &mut x);
    let mut points = BondPoints::new(model);
    let mut sums = vec![[0.0; 3]; model.packs.packs.len()];
    let rest = vec![[Pose::default(); LANES]; model.packs.rigid];
    let (mut largest, mut growth) = (0.0, 0.0);
    for step in 0..MOST_STEPS {
        if step >= STEPS && growth <= GROWS * largest {
            break;
        }
        if stop() {
            return Err(RunError::Stopped);
        }
        internal_forces(FirstPass::linear(model, &x), broken_joints, scratch);
        preconditioner.set_bond_forces(model, &x, &mut scratch.f);
        points.add_forces(model, &x, &mut scratch.f);
        preconditioner.respond(model, &rest, &scratch.f, &[], None, scratch.level);
        let preconditioner = &*preconditioner;
        // y = K x = −f; x⁺ = M⁻¹y. λ ≈ (y·M⁻¹y)/(x·y): a Rayleigh quotient of the square.
        let (f, level) = (&scratch.f, scratch.level);
        each_pack(&model.packs, [&mut x, &mut next], &mut sums, |pack, [x, next], sums| {
            dispatch!(level, simd => accelerations(simd, model, Present::default(), preconditioner, pack, f, next));
            *sums = [0.0; 3];
            let f = &f[node_start(&model.packs, pack)..];
            let shares = model.assembly.shares(pack);
            for (at, ((f, x), next)) in f.iter().zip(x).zip(next).enumerate() {
                for lane in 0..LANES {
                    let (y, m) = (-f.0[lane], -next.0[lane]);
                    let shared = shares.map_or(y, |shares| y * shares[at / 3].0[lane]);
                    sums[0] += shared * m;
                    sums[1] += shared * x.0[lane];
                    sums[2] = f64::max(sums[2], m.abs());
                    x.0[lane] = m;
                }
            }
        });
        let [above, below] = [0, 1].map(|part| sum(sums.iter().map(|sums| sums[part])));
        let size = sums.iter().map(|sums| sums[2]).fold(0.0, f64::max);
        if below <= 0.0 {
            break;
        }
        largest = f64::max(largest, above / below);
        growth = size;
        x.iter_mut().for_each(|x| x.0.iter_mut().for_each(|x| *x /= size));
    }
    Ok(largest)
}

/// Upper bound of the largest eigenvalue of `M⁻¹K` for the stiffnesses `k A Aᵀ` of gases and the
/// clustered masses of relaxation. `gases` gives the nodes, k and the areas A. This is Gershgorin's
/// bound of a matrix with one row per gas that has the same eigenvalues.
pub(crate) fn largest_of_gases(
    model: &Model,
    preconditioner: &mut Preconditioner,
    gases: &[(Vec<u32>, f64, Vec<Vec3>)],
    scratch: &mut Scratch,
) -> f64 {
    let mut largest: f64 = 0.0;
    // Only nodes at walls are computed, so that the work does not grow with the model.
    let nodes = gases.iter().flat_map(|(nodes, ..)| nodes);
    let walls: BTreeSet<usize> = nodes.map(|node| model.node_slot(*node as usize).pack).collect();
    scratch.f.fill(Lanes::ZERO);
    let mut response = vec![Lanes::ZERO; 3 * model.packs.nodes];
    let rest = vec![[Pose::default(); LANES]; model.packs.rigid];
    for (nodes, k, areas) in gases {
        for (node, area) in nodes.iter().zip(areas) {
            model.set(&mut scratch.f, *node as usize, (*area).into());
        }
        preconditioner.respond(model, &rest, &scratch.f, &[], None, scratch.level);
        for &pack in &walls {
            let range = node_start(&model.packs, pack)..node_start(&model.packs, pack + 1);
            response[range.clone()].fill(Lanes::ZERO);
            dispatch!(scratch.level, simd => {
                accelerations(simd, model, Present::default(), preconditioner, pack, &scratch.f, &mut response[range.clone()])
            });
        }
        let with = |(nodes, other, areas): &(Vec<u32>, f64, Vec<Vec3>)| {
            let work = |(node, area): (&u32, &Vec3)| {
                Vec3::from(model.get(&response, *node as usize)).dot(area)
            };
            (k * other).sqrt() * nodes.iter().zip(areas).map(work).sum::<f64>().abs()
        };
        largest = largest.max(gases.iter().map(with).sum());
        nodes.iter().for_each(|node| model.set(&mut scratch.f, *node as usize, [0.0; 3]));
    }
    largest
}
