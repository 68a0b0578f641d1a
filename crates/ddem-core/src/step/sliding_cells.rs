//! Damping of sliding cells: all parts of a cell have one rigid motion (§5).
//!
//! The forces are those of [`sliding`](super::sliding). Sums over the nodes of each pack give the rigid
//! motion of each cell; then each part damps what it moves otherwise.

use fearless_simd::Simd;
use fearless_simd_macros::simd;
use nalgebra::Matrix3;
use rayon::prelude::*;

use super::sliding::{damping_rate, look_ahead};
use super::{Context, ForcesOfOthers, PackContext};
use crate::step::scratch::PackFields;
use ddem_mechanics::math::lanes::{
    LANES, Lanes, Vector, add, cross, load, load_at, scale, splat, store_at, sub, zero,
};
use ddem_mechanics::rigid::{SpatialLanes, SpatialVector};
use ddem_mesh::{BodyPart, Vec3};

/// Cells that one task computes.
const TOGETHER: usize = 64;

/// Moments of the mass and of the momentum of the parts of a pack. Positions are relative to the
/// origin of each cell.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct PartMoments {
    /// Mass `[kg]`.
    mass: Lanes,
    /// First moments of mass `Σ m x` `[kg m]`.
    first: [Lanes; 3],
    /// Second moments of mass `Σ m x xᵀ`, xx yy zz xy yz zx `[kg m²]`.
    second: [Lanes; 6],
    /// Momentum `[kg m/s]` and angular momentum `[kg m²/s]`.
    momentum: SpatialLanes,
}

/// Corner of its first part at rest, so that a cell far from the centre of the model loses no digits.
fn origin(context: Context<'_>, cell: usize) -> Option<Vec3> {
    let model = context.model;
    let first = model.sliding.cells.parts(cell)[0];
    Some(model.geometry.part(first.block)?.corners[0])
}

/// Corners of the parts of a pack at rest, relative to the origins of their cells `[m]`.
fn corners_of(pack: &PackContext<'_>) -> [[Lanes; 3]; 8] {
    let model = pack.step.model;
    let mut corners = [[Lanes::ZERO; 3]; 8];
    for lane in 0..pack.pack.filled {
        let Some(cell) = model.sliding.cells.body(pack.index, lane) else { continue };
        let part = model.geometry.part(pack.pack.blocks[lane] as usize);
        let Some((part, origin)) = part.zip(origin(pack.step, cell)) else { continue };
        for (own, corner) in corners.iter_mut().zip(&part.corners) {
            let arm = corner - origin;
            (0..3).for_each(|c| own[c].0[lane] = arm[c]);
        }
    }
    corners
}

/// Calls `visit` with each node of four parts and its position at rest, between these corners.
#[inline(always)]
fn each_node<S: Simd>(
    simd: S,
    corners: &[[Lanes; 3]; 8],
    divisions: usize,
    mut visit: impl FnMut(usize, Vector<S>),
) {
    let part_of = |i: usize| splat(simd, i as f64 / divisions as f64);
    let mut node = 0;
    for z in (0..=divisions).map(part_of) {
        for y in (0..=divisions).map(part_of) {
            let side = |x: usize| {
                let at = |corner: usize| load(simd, &corners[x + corner]);
                let [low, high] = [between([at(0), at(2)], y), between([at(4), at(6)], y)];
                between([low, high], z)
            };
            let ends = [side(0), side(1)];
            for x in (0..=divisions).map(part_of) {
                visit(node, between(ends, x));
                node += 1;
            }
        }
    }
}

/// Points between two others.
#[inline(always)]
fn between<S: Simd>([from, to]: [Vector<S>; 2], at: fearless_simd::f64x4<S>) -> Vector<S> {
    add(from, scale(sub(to, from), at))
}

/// Finds the moments of the sliding parts of a pack with the velocities `v*`.
#[simd]
pub(super) fn find_moments<S: Simd>(
    simd: S,
    pack: &PackContext<'_>,
    others: ForcesOfOthers<'_>,
    part: &mut PackFields<'_>,
) {
    look_ahead(simd, pack, others.tied, part);
    let (u, turns) = (part.blocks.u.get(), pack.step.model.corotational());
    let mut mass = splat(simd, 0.0);
    let [mut first, mut squares, mut products, mut linear, mut angular] = [zero(simd); 5];
    each_node(simd, &corners_of(pack), pack.divisions, |node, mut x| {
        if turns {
            x = add(x, load_at(simd, u, 3 * node));
        }
        let own = pack.mass[node].load(simd);
        let (moved, momentum) = (scale(x, own), scale(load_at(simd, part.buffer, 3 * node), own));
        mass += own;
        first = add(first, moved);
        squares = add(squares, [moved[0] * x[0], moved[1] * x[1], moved[2] * x[2]]);
        products = add(products, [moved[0] * x[1], moved[1] * x[2], moved[2] * x[0]]);
        linear = add(linear, momentum);
        angular = add(angular, cross(x, momentum));
    });
    let [xx, yy, zz] = squares.map(Lanes::from);
    let [xy, yz, zx] = products.map(Lanes::from);
    if let Some(moments) = &mut part.moments {
        **moments = PartMoments {
            mass: Lanes::from(mass),
            first: first.map(Lanes::from),
            second: [xx, yy, zz, xy, yz, zx],
            momentum: SpatialLanes {
                linear: linear.map(Lanes::from),
                angular: angular.map(Lanes::from),
            },
        };
    }
}

/// Computes the rigid motions of the sliding cells: the velocity of the origin and the angular velocity
/// that have the momentum and the angular momentum of each cell.
pub(super) fn find_motions(
    context: Context<'_>,
    moments: &[PartMoments],
    motions: &mut Vec<SpatialVector>,
) {
    let cells = &context.model.sliding.cells;
    let of_cell = |cell: usize| {
        let parts = cells.parts(cell);
        let BodyPart { pack, lane, .. } = parts[0];
        let slides = context.slides(pack).is_some_and(|alpha| alpha.0[lane] != 0.0);
        if slides { rigid_motion(parts, moments) } else { SpatialVector::default() }
    };
    let all = (0..cells.len()).into_par_iter().with_min_len(TOGETHER);
    all.map(of_cell).collect_into_vec(motions);
}

/// Rigid motion with the momentum and the angular momentum of all parts of a cell.
fn rigid_motion(parts: &[BodyPart], moments: &[PartMoments]) -> SpatialVector {
    let (mut mass, mut first, mut second) = (0.0, Vec3::zeros(), [0.0; 6]);
    let mut momentum = SpatialVector::default();
    for &BodyPart { pack, lane, .. } in parts {
        let own = &moments[pack];
        mass += own.mass.0[lane];
        first += Vec3::from(own.first.map(|c| c.0[lane]));
        (0..6).for_each(|k| second[k] += own.second[k].0[lane]);
        let part = own.momentum.of(lane);
        momentum.linear += part.linear;
        momentum.angular += part.angular;
    }
    let (centre, mean) = (first / mass, momentum.linear / mass);
    let [xx, yy, zz, xy, yz, zx] = second;
    let about_origin = Matrix3::new(xx, xy, zx, xy, yy, yz, zx, yz, zz);
    let about_centre = about_origin - first * centre.transpose();
    let inertia = Matrix3::identity() * about_centre.trace() - about_centre;
    let own = momentum.angular - centre.cross(&momentum.linear);
    let angular = inertia.try_inverse().map_or_else(Vec3::zeros, |inverse| inverse * own);
    SpatialVector { linear: mean - angular.cross(&centre), angular }
}

/// Damps the deformation of the sliding parts of a pack.
#[simd]
pub(super) fn damp<S: Simd>(
    simd: S,
    pack: &PackContext<'_>,
    others: ForcesOfOthers<'_>,
    part: &mut PackFields<'_>,
) {
    let Some(alpha) = pack.step.slides(pack.index) else { return };
    look_ahead(simd, pack, others.tied, part);
    let (model, motion) = (pack.step.model, pack.step.motion);
    let PackFields { blocks, buffer, f, viscous, .. } = part;
    if motion.stiffness == 0.0 {
        viscous.fill(Lanes::ZERO);
    }
    let rate = damping_rate(simd, alpha, motion);
    let mut rigid = SpatialLanes::default();
    for lane in 0..LANES {
        let Some(cell) = model.sliding.cells.body(pack.index, lane) else { continue };
        let SpatialVector { linear, angular } = others.cells[cell];
        for c in 0..3 {
            (rigid.linear[c].0[lane], rigid.angular[c].0[lane]) = (linear[c], angular[c]);
        }
    }
    let (linear, angular) = (load(simd, &rigid.linear), load(simd, &rigid.angular));
    let (u, turns) = (blocks.u.get(), model.corotational());
    each_node(simd, &corners_of(pack), pack.divisions, |node, mut x| {
        if turns {
            x = add(x, load_at(simd, u, 3 * node));
        }
        let deforms = sub(load_at(simd, buffer, 3 * node), add(linear, cross(angular, x)));
        let force = scale(deforms, rate * pack.mass[node].load(simd));
        store_at(f, 3 * node, sub(load_at(simd, f, 3 * node), force));
        store_at(viscous, 3 * node, add(load_at(simd, viscous, 3 * node), force));
    });
}
