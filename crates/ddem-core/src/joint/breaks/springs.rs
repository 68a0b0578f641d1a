//! The pairs of one joint lattice: which fail, and what their springs do.

use std::sync::Arc;

use nalgebra::{Matrix3, Vector2, Vector3};

use super::{Broken, Losses, Point};
use crate::law::bearing::Bearing;
use crate::law::response::stored;
use crate::law::{JointLaw, Loss, Memory, Mode, Opening, Traction};
use crate::math::lanes::{LANES, Lanes};
use crate::mesh::NO_JOINT;
use crate::mesh::pack::PairPlace;
use crate::mesh::seams::{FaceLattice, Seam};

/// How to look at the pairs in one pass over the joints.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Look<'a> {
    /// Pairs fail whose traction, divided by this, is still beyond their strength; `None`: none.
    pub(crate) failing: Option<f64>,
    /// Whether joints that have turned about the pairs that hold let go of these: a contact takes over.
    pub(crate) turning: bool,
    /// Slip goes on from the last equilibrium, not from the last step.
    pub(crate) relaxing: bool,
    /// Failed pairs and contacts have no dashpots now.
    pub(crate) undamped: bool,
    /// Present time `[s]`.
    pub(crate) time: f64,
    /// Time since the last look, 0 in relaxation, none in the first half step of a stage `[s]`.
    pub(crate) time_step: Option<f64>,
    /// Laws of the joints.
    pub(crate) laws: &'a [Option<Arc<dyn JointLaw>>],
}

/// What the springs of a joint lattice do together.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Pull {
    /// Force on side a, from side b, in the joint's frame `[N]`.
    pub(crate) force: [Lanes; 3],
    /// `Σ s × F` of the slips, in the joint's frame `[N m]`.
    pub(crate) couple: [Lanes; 3],
    /// Energy in the springs `[J]`.
    pub(crate) stored: Lanes,
    /// 1 where the springs turn with the ground, 0 where with both bodies.
    pub(crate) grounded: Lanes,
}

/// The frame of a ground with which the springs of a lane turn, from the joint's mean frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ground {
    /// Axes of the springs, as columns, in the mean frame.
    axes: Matrix3<f64>,
    /// Turns openings along the joint's own axes to those along the springs'.
    turn: Matrix3<f64>,
    /// Opening that turning the gap makes, along the springs' axes `[m]`.
    shift: Vector3<f64>,
}

impl Ground {
    /// Of a ground that is turned so against the mean frame.
    pub(crate) fn new(turned: &Matrix3<f64>, seam: &Seam, lane: usize) -> Self {
        let axes = turned * seam.axes;
        let gap = lane_of(seam.gap(), lane);
        let shift = axes.tr_mul(&gap) - seam.axes.tr_mul(&gap);
        Self { axes, turn: axes.tr_mul(&seam.axes), shift }
    }
}

impl Broken {
    /// The springs of a lane bear tractions, along the joint's own axes, where nothing has moved.
    pub(crate) fn bear(&mut self, seam: &Seam, lane: usize, tractions: &[Vector3<f64>]) {
        let k = seam.stiffness(lane);
        for (points, &traction) in self.points.iter_mut().zip(tractions) {
            let traction = split(traction);
            points[lane].origin = -joined(traction.normal / k.normal, traction.shear / k.shear);
        }
    }

    /// Lets pairs fail under the forces `g` that the elements exert (`K u`) and those of the
    /// springs. Elements that hold a failed pair are no longer alive then. Returns whether any
    /// pair failed.
    pub(crate) fn fail(
        &mut self,
        FaceLattice { places, seam }: FaceLattice<'_>,
        look: Look<'_>,
        local: &[Lanes],
        g: &[Lanes],
        losses: &mut Losses,
    ) -> bool {
        let Some(factor) = look.failing.filter(|_| self.bonded) else { return false };
        let before = self.fresh.len();
        self.bonded = false;
        let turned: [bool; LANES] =
            std::array::from_fn(|lane| look.turning && self.turned(seam, lane));
        for (p, place) in places.iter().enumerate() {
            for (lane, turned) in turned.into_iter().enumerate() {
                let point = &mut self.points[p][lane];
                let Some(law) = law_of(look.laws, seam, lane).filter(|_| point.mode.is_none())
                else {
                    continue;
                };
                let area = seam.quarter.0[lane] * place.elements().len() as f64;
                let force =
                    element_force(g, seam, place, lane) + point.force(seam, lane, place, local);
                let traction = split(force / area);
                let failure = law.failure(traction.normal / factor, traction.shear.norm() / factor);
                let Some(mode) = failure.or((turned && law.bonds()).then_some(Mode::Shear)) else {
                    self.bonded = true;
                    continue;
                };
                point.mode = Some(mode);
                self.times[p][lane] = look.time;
                losses.failed[usize::from(mode == Mode::Tension)] += 1;
                self.set_failed(places, p, lane);
            }
        }
        self.fresh.len() > before
    }

    /// Elements that hold a pair are no longer alive.
    pub(super) fn set_failed(&mut self, places: &[PairPlace], p: usize, lane: usize) {
        self.fresh.push((p as u32, lane as u8));
        places[p].elements().for_each(|e| self.alive[e].0[lane] = 0.0);
    }

    /// Hands the forces of elements that are gone over to springs, without a jump at any pair:
    /// `before` are the forces with them, `after` without; `way` is that of the nodes in the last
    /// step.
    pub(crate) fn take_over(
        &mut self,
        FaceLattice { places, seam }: FaceLattice<'_>,
        local: &[Lanes],
        way: &[Lanes],
        [before, after]: [&[Lanes]; 2],
        losses: &mut Losses,
    ) {
        losses.fracture += lost(local, [before, after]);
        let old: Vec<[u8; LANES]> = self.points.iter().map(|p| p.map(|p| p.quarters)).collect();
        self.count(places, seam);
        for (p, (place, old)) in places.iter().zip(old).enumerate() {
            for (lane, old) in old.into_iter().enumerate() {
                let point = &mut self.points[p][lane];
                if point.quarters == old {
                    continue;
                }
                let springs = Point { quarters: old, ..*point }.force(seam, lane, place, local);
                let gone = [before, after].map(|g| element_force(g, seam, place, lane));
                let force = springs + gone[0] - gone[1];
                losses.fracture += energy(seam, lane, springs, old);
                losses.fracture -= energy(seam, lane, force, point.quarters);
                let k = seam.stiffness(lane);
                let traction = split(force / point.area(seam, lane));
                let elastic = joined(traction.normal / k.normal, traction.shear / k.shear);
                point.origin = across(local, seam, place, lane) - elastic;
                // What both nodes felt alike is gone before it could do its half of the work on
                // the last way.
                let [a, b] = place.sides;
                let alike = [a, b].map(|node| at(before, node, lane) - at(after, node, lane));
                let ways = at(way, a, lane) + at(way, b, lane);
                losses.fracture -= 0.25 * (alike[0] + alike[1]).dot(&ways);
            }
        }
        // What a pair bore when it failed is where its law begins.
        for &(p, lane) in &self.fresh {
            let (place, lane) = (&places[p as usize], lane as usize);
            let point = &mut self.points[p as usize][lane];
            let force = point.force(seam, lane, place, local);
            let traction = split(force / point.area(seam, lane));
            let gap = traction.normal / seam.stiffness(lane).normal;
            point.memory = Memory { traction, gap, ..Memory::default() };
        }
    }

    /// Adds the forces of the springs to `g`, the forces `K u` of the elements that are left.
    /// `way` is that of the nodes in the last step, if pairs have just failed.
    pub(crate) fn pull(
        &mut self,
        FaceLattice { places, seam }: FaceLattice<'_>,
        (look, way, grounds): (Look<'_>, Option<&[Lanes]>, &[Option<Ground>; LANES]),
        (local, g): (&[Lanes], &mut [Lanes]),
        losses: &mut Losses,
    ) -> Pull {
        let grounded = Lanes(grounds.map(|ground| f64::from(u8::from(ground.is_some()))));
        let mut pull = Pull { grounded, ..Pull::default() };
        for (p, place) in places.iter().enumerate() {
            for (lane, ground) in grounds.iter().enumerate() {
                let point = &mut self.points[p][lane];
                if point.quarters == 0 {
                    continue;
                }
                let area = point.area(seam, lane);
                let mut apart = across(local, seam, place, lane);
                if let Some(Ground { turn, shift, .. }) = ground {
                    apart = turn * apart + shift;
                }
                let breaks_off = way.filter(|_| self.fresh.contains(&(p as u32, lane as u8)));
                let way = breaks_off.map(|way| across(way, seam, place, lane));
                losses.add_point(area, point.open_to(seam, lane, look, apart, way));
                let Traction { normal: t_n, shear } = point.memory.borne();
                let axes = ground.as_ref().map_or(&seam.axes, |ground| &ground.axes);
                let force = axes * joined(t_n, shear) * area;
                // A ground takes the whole torque.
                let couple = match ground {
                    Some(_) => Vector3::zeros(),
                    None => (axes * joined(0.0, point.memory.slip)).cross(&force),
                };
                let [a, b] = place.sides;
                for c in 0..3 {
                    g[3 * a + c].0[lane] -= force[c];
                    g[3 * b + c].0[lane] += force[c];
                    pull.force[c].0[lane] += force[c];
                    pull.couple[c].0[lane] += couple[c];
                }
                pull.stored.0[lane] += area * stored(seam.stiffness(lane), &point.memory);
            }
        }
        pull
    }
}

impl Point {
    pub(super) fn area(&self, seam: &Seam, lane: usize) -> f64 {
        seam.quarter.0[lane] * f64::from(self.quarters)
    }

    /// Tractions of the springs where the sides are `apart`, by the law once the pair has failed; returns what is lost
    /// `[J/m²]`. `way` is how the sides moved in the last step, of a pair that has just failed.
    fn open_to(
        &mut self,
        seam: &Seam,
        lane: usize,
        look: Look<'_>,
        apart: Vector3<f64>,
        way: Option<Vector3<f64>>,
    ) -> Loss {
        let stiffness = seam.stiffness(lane);
        let Traction { normal, shear } = split(apart - self.origin);
        let Some(law) = law_of(look.laws, seam, lane).filter(|_| self.mode.is_some()) else {
            let traction =
                Traction { normal: stiffness.normal * normal, shear: shear * stiffness.shear };
            (self.memory.traction, self.memory.gap) = (traction, normal);
            return Loss::default();
        };
        let bore = self.memory.traction;
        let dashpot = if look.undamped { 0.0 } else { seam.dashpot.0[lane] };
        let bearing = Bearing { stiffness, dashpot, time_step: look.time_step };
        let mut loss = bearing.act(law, Opening { normal, shear }, &mut self.memory);
        if let Some(way) = way {
            bearing.break_off((bore, way), &mut loss, &mut self.memory);
        }
        if look.relaxing && self.memory.settled.is_none() {
            self.memory.settle();
        }
        loss
    }

    /// Force of the springs of a bonded pair on side a, along the joint's own axes `[N]`.
    fn force(&self, seam: &Seam, lane: usize, place: &PairPlace, local: &[Lanes]) -> Vector3<f64> {
        if self.quarters == 0 {
            return Vector3::zeros();
        }
        let k = seam.stiffness(lane);
        let opening = split(across(local, seam, place, lane) - self.origin);
        joined(k.normal * opening.normal, opening.shear * k.shear) * self.area(seam, lane)
    }
}

/// Energy of springs over some quarters that bear a force `[J]`.
fn energy(seam: &Seam, lane: usize, force: Vector3<f64>, quarters: u8) -> f64 {
    if quarters == 0 {
        return 0.0;
    }
    let force = split(force);
    let k = seam.stiffness(lane);
    let both = force.normal * force.normal / k.normal + force.shear.norm_squared() / k.shear;
    0.5 * both / (seam.quarter.0[lane] * f64::from(quarters))
}

/// Energy that the elements of a lattice lose from one state to the other `[J]`.
fn lost(local: &[Lanes], [before, after]: [&[Lanes]; 2]) -> f64 {
    let mut sum = 0.0;
    for ((u, before), after) in local.iter().zip(before).zip(after) {
        sum += Lanes(std::array::from_fn(|l| 0.5 * u.0[l] * (before.0[l] - after.0[l]))).sum();
    }
    sum
}

/// The law of a lane's joint, if it has one that can fail.
fn law_of<'a>(
    laws: &'a [Option<Arc<dyn JointLaw>>],
    seam: &Seam,
    lane: usize,
) -> Option<&'a dyn JointLaw> {
    match seam.laws[lane] {
        NO_JOINT => None,
        law => laws[law as usize].as_deref(),
    }
}

/// Parts of a vector along the joint's own axes: along the normal and in the plane.
fn split(v: Vector3<f64>) -> Traction {
    Traction { normal: v.x, shear: Vector2::new(v.y, v.z) }
}

/// The inverse of [`split`].
fn joined(normal: f64, shear: Vector2<f64>) -> Vector3<f64> {
    Vector3::new(normal, shear.x, shear.y)
}

/// Displacement of side b against side a, along the joint's own axes.
fn across(local: &[Lanes], seam: &Seam, place: &PairPlace, lane: usize) -> Vector3<f64> {
    let [a, b] = place.sides;
    seam.axes.tr_mul(&(at(local, b, lane) - at(local, a, lane)))
}

/// Half the difference of the forces of the elements on the two nodes, (M1), along the joint's own
/// axes.
fn element_force(g: &[Lanes], seam: &Seam, place: &PairPlace, lane: usize) -> Vector3<f64> {
    across(g, seam, place, lane) * 0.5
}

fn at(field: &[Lanes], node: usize, lane: usize) -> Vector3<f64> {
    lane_of(&[0, 1, 2].map(|c| field[3 * node + c]), lane)
}

fn lane_of(v: &[Lanes; 3], lane: usize) -> Vector3<f64> {
    Vector3::from(v.map(|c| c.0[lane]))
}
