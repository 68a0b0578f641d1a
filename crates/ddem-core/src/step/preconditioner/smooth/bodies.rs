//! Bodies in smooth motions: rigid ones, and deformable cells that move as such. A body moves as the functions do at its centre, and rotates by half
//! of their curl.

use nalgebra::{Matrix3, Vector6};

use super::grid::FunctionGrid;
use crate::model::Model;
use crate::step::preconditioner::rigid::{RigidMasses, part_properties};
use crate::step::preconditioner::springs::{SpringSum, centre};
use ddem_mechanics::rigid::SpatialVector;
use ddem_mesh::Vec3;

/// Function at the centre of a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct AtCentre {
    /// Number of the function.
    pub(super) function: u32,
    pub(super) value: f64,
    /// Half of the gradient `[1/m]`.
    pub(super) half_gradient: Vec3,
}

/// Rotations of bodies by the functions of the finest grid.
#[derive(Clone, Debug, Default)]
pub(super) struct BodyTurns {
    /// Functions of the cell around each body.
    around: Vec<[AtCentre; 8]>,
    /// First entry of each function in `bodies`, and one past the last.
    start: Vec<u32>,
    /// Bodies of each function, with half its gradient there.
    bodies: Vec<(u32, Vec3)>,
}

impl BodyTurns {
    pub(super) fn new(grid: &FunctionGrid, bodies: &[SmoothBody<'_>]) -> Self {
        let around: Vec<_> = bodies.iter().map(|body| grid.at_centre(&body.centre)).collect();
        let mut start = vec![0; grid.moved.len() + 1];
        let mut by_function: Vec<(u32, (u32, Vec3))> = Vec::new();
        for (body, around) in around.iter().enumerate() {
            for own in around {
                by_function.push((own.function, (body as u32, own.half_gradient)));
                start[own.function as usize + 1] += 1;
            }
        }
        by_function.sort_by_key(|(function, _)| *function);
        (0..grid.moved.len()).for_each(|function| start[function + 1] += start[function]);
        let bodies = by_function.into_iter().map(|(_, entry)| entry).collect();
        Self { around, start, bodies }
    }

    /// Force of the torques on all bodies on a function. With the rotation `s × g` of a body this
    /// does the same work, `τ · (s × g) = g · (τ × s)`.
    pub(super) fn force(&self, function: usize, wrenches: &[SpatialVector]) -> Vec3 {
        let own = &self.bodies[self.start[function] as usize..self.start[function + 1] as usize];
        own.iter().fold(Vec3::zeros(), |sum, (body, half_gradient)| {
            sum + wrenches[*body as usize].angular.cross(half_gradient)
        })
    }

    /// Rotation of a body by the motion of the functions.
    pub(super) fn rotation(&self, body: usize, moved: &[Vec3]) -> Vec3 {
        let around = self.around[body].iter();
        around.fold(Vec3::zeros(), |sum, own| {
            sum + own.half_gradient.cross(&moved[own.function as usize])
        })
    }

    /// Functions of the finest grid at the centre of each body.
    pub(super) fn functions(&self) -> Vec<Vec<AtCentre>> {
        self.around.iter().map(|around| around.to_vec()).collect()
    }
}

/// Functions of a coarser grid at the centre of a body, from those of the next finer level.
pub(super) fn coarser(grid: &FunctionGrid, finer: &[AtCentre]) -> Vec<AtCentre> {
    let mut all: Vec<AtCentre> = Vec::new();
    for own in finer {
        for (function, weight) in grid.functions_at(own.function as usize) {
            let (value, half_gradient) = (own.value * weight, own.half_gradient * weight);
            match all.iter_mut().find(|known| known.function == function) {
                Some(known) => {
                    known.value += value;
                    known.half_gradient += half_gradient;
                }
                None => all.push(AtCentre { function, value, half_gradient }),
            }
        }
    }
    all
}

/// Body as the smooth motions see it.
pub(in crate::step::preconditioner) struct SmoothBody<'a> {
    /// Centre of mass or of the nodes at rest `[m]`.
    pub(in crate::step::preconditioner) centre: Vec3,
    /// Extent along x, y and z `[m]`.
    pub(in crate::step::preconditioner) extent: Vec3,
    /// Size, by which rotations are multiplied `[m]`.
    pub(in crate::step::preconditioner) size: f64,
    pub(in crate::step::preconditioner) springs: &'a SpringSum,
    /// Stiffness of the springs along the held parts of its translations `[N/m]`.
    pub(in crate::step::preconditioner) held: Vec3,
}

/// Rigid bodies of a model, given the springs around each.
pub(in crate::step::preconditioner) fn smooth_bodies<'a>(
    model: &Model,
    rigid: &RigidMasses,
    springs: &'a [SpringSum],
) -> Vec<SmoothBody<'a>> {
    let of_body = |(body, springs): (usize, &'a SpringSum)| {
        let parts = rigid.parts(model, body);
        let corners = parts.iter().flat_map(|part| {
            let properties = part_properties(model, part);
            (0..8).map(|corner| properties.arm(corner))
        });
        let [low, high] =
            corners.fold([Vec3::zeros(); 2], |[low, high], arm| [low.inf(&arm), high.sup(&arm)]);
        let own = Vec3::from([0, 1, 2].map(|c| springs.stiffness[(c, c)]));
        let held = own.component_mul(&rigid.free_axes(body).map(|free| 1.0 - free));
        let (centre, size) = (centre(model, parts), rigid.size(body));
        SmoothBody { centre, extent: high - low, size, springs, held }
    };
    springs.iter().enumerate().map(of_body).collect()
}

impl SmoothBody<'_> {
    /// Stiffness against a function for each component `[N/m]`.
    pub(super) fn stiffness(&self, function: &AtCentre) -> Vec3 {
        let [x, y, z] = function.half_gradient.into();
        let strains = [
            Vector6::new(2.0 * x, 0.0, 0.0, y, z, 0.0),
            Vector6::new(0.0, 2.0 * y, 0.0, x, 0.0, z),
            Vector6::new(0.0, 0.0, 2.0 * z, 0.0, x, y),
        ];
        let squared = function.value * function.value;
        let own = strains.map(|strain| strain.dot(&(self.springs.moduli * strain)));
        // Supports hold single nodes of a deformable cell, which rotates as well.
        let at_held = [Vec3::x(), Vec3::y(), Vec3::z()].map(|linear| {
            let angular = function.half_gradient.cross(&linear) * self.size;
            let motion = SpatialVector { linear: linear * function.value, angular }.to_vector();
            motion.dot(&(self.springs.held * motion))
        });
        Vec3::from(own) + Vec3::from(at_held) + self.held * squared
    }

    /// Ratio of the smallest to the largest stiffness against translations; `None` without any.
    pub(super) fn softest(&self) -> Option<f64> {
        // Supports do not turn with the body.
        let turning = self.springs.stiffness - self.springs.held;
        let translations: Matrix3<f64> = turning.fixed_view::<3, 3>(0, 0).into();
        let values = translations.symmetric_eigenvalues();
        let most = values.max();
        // Without springs only rounding is left.
        (most > 1e-9 * self.springs.stiffness.trace()).then(|| values.min().max(0.0) / most)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::step::preconditioner::smooth::points::SmoothPoints;

    /// Finest grid over five bodies of a metre along each direction: three cells along 5 m.
    fn grid() -> (FunctionGrid, Vec<Vec3>) {
        let at = |k: usize| Vec3::new((k % 5) as f64, (k / 5 % 5) as f64, (k / 25) as f64);
        let positions: Vec<Vec3> = (0..125).map(at).collect();
        let extent = Vec3::repeat(1.0);
        let points = SmoothPoints { positions, extent, ..SmoothPoints::default() };
        (FunctionGrid::over(&points).swap_remove(0), points.positions)
    }

    fn bodies<'a>(centres: &[Vec3], springs: &'a SpringSum) -> Vec<SmoothBody<'a>> {
        let (extent, held) = (Vec3::repeat(1.0), Vec3::zeros());
        let body = |&centre| SmoothBody { centre, extent, size: 1.0, springs, held };
        centres.iter().map(body).collect()
    }

    #[test]
    fn bodies_follow_a_rotation() {
        let (grid, centres) = grid();
        let turns = BodyTurns::new(&grid, &bodies(&centres, &SpringSum::default()));
        let turn = Vec3::new(0.1, -0.2, 0.3);
        let node = |k: usize| Vec3::new((k % 4) as f64, (k / 4 % 4) as f64, (k / 16) as f64);
        let moved: Vec<Vec3> =
            (0..grid.moved.len()).map(|k| turn.cross(&(node(k) * 5.0 / 3.0))).collect();
        for body in 0..centres.len() {
            assert!((turns.rotation(body, &moved) - turn).norm() < 1e-14);
        }
    }

    #[test]
    fn torques_do_the_same_work_on_functions() {
        let (grid, centres) = grid();
        let turns = BodyTurns::new(&grid, &bodies(&centres, &SpringSum::default()));
        let wrenches: Vec<SpatialVector> = (0..centres.len())
            .map(|k| SpatialVector {
                angular: Vec3::new(1.0, k as f64 - 2.0, 0.5 * k as f64),
                ..SpatialVector::default()
            })
            .collect();
        let moved: Vec<Vec3> =
            (0..grid.moved.len()).map(|k| Vec3::new((k % 3) as f64, 1.0, (k % 5) as f64)).collect();
        let on_bodies: f64 = (0..centres.len())
            .map(|body| wrenches[body].angular.dot(&turns.rotation(body, &moved)))
            .sum();
        let on_functions: f64 =
            (0..moved.len()).map(|k| turns.force(k, &wrenches).dot(&moved[k])).sum();
        assert!((on_bodies - on_functions).abs() < 1e-12 * on_bodies.abs(), "{on_bodies}");
    }
}
