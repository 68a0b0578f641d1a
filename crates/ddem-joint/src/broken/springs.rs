//! The pairs of one joint lattice: which fail, and what their springs do.

use nalgebra::{Matrix3, Vector3};

use super::BrokenLattice;
use crate::losses::Losses;
use crate::point::{JointPoint, PairContext, joined, split};
use ddem_mechanics::law::Traction;
use ddem_mechanics::law::response::stored;
use ddem_mechanics::math::lanes::{LANES, Lanes};
use ddem_mesh::joint_sections::{FaceLattice, JointSection};
use ddem_mesh::pack::NodePair;

/// Forces of the springs of a joint lattice.
#[derive(Clone, Copy, Debug, Default)]
pub struct SpringForces {
    /// Force on side a, from side b, in the joint's frame `[N]`.
    pub force: [Lanes; 3],
    /// `Σ s × F` of the slips, in the joint's frame `[N m]`.
    pub couple: [Lanes; 3],
    /// Energy in the springs `[J]`.
    pub stored: Lanes,
    /// 1 where the springs turn with the ground, 0 where with both bodies.
    pub grounded: Lanes,
}

/// Motion of both sides of a joint lattice.
#[derive(Clone, Copy)]
pub struct SideDisplacements<'a> {
    /// Displacements of the nodes in the joint's frame `[m]`.
    pub local: &'a [Lanes],
    /// Way of the nodes in the last step, if pairs have just failed `[m]`.
    pub du: Option<&'a [Lanes]>,
    /// Ground of each lane that the springs turn with, if there is one.
    pub grounds: &'a [Option<GroundFrame>; LANES],
}

/// The frame of a ground with which the springs of a lane turn, from the joint's mean frame.
#[derive(Clone, Copy, Debug)]
pub struct GroundFrame {
    /// Axes of the springs, as columns, in the mean frame.
    axes: Matrix3<f64>,
    /// Turns openings along the joint's own axes to those along the springs'.
    turn: Matrix3<f64>,
    /// Opening that turning the gap makes, along the springs' axes `[m]`.
    shift: Vector3<f64>,
}

impl GroundFrame {
    /// Of a ground that is turned so against the mean frame.
    pub fn new(turned: &Matrix3<f64>, section: &JointSection, lane: usize) -> Self {
        let axes = turned * section.axes;
        let gap = lane_of(section.gap(), lane);
        let shift = axes.tr_mul(&gap) - section.axes.tr_mul(&gap);
        Self { axes, turn: axes.tr_mul(&section.axes), shift }
    }
}

impl BrokenLattice {
    /// The springs of a lane bear tractions, along the joint's own axes, where nothing has moved.
    pub fn preload(&mut self, section: &JointSection, lane: usize, tractions: &[Vector3<f64>]) {
        let k = section.stiffness(lane);
        for (points, &traction) in self.points.iter_mut().zip(tractions) {
            let traction = split(traction);
            points[lane].origin = -joined(traction.normal / k.normal, traction.shear / k.shear);
        }
    }

    /// Lets pairs fail under the forces `g` that the elements exert (`K u`) and those of the
    /// springs. Elements that hold a failed pair are no longer alive then. Returns whether any
    /// pair failed.
    pub fn fail(
        &mut self,
        FaceLattice { node_pairs, section }: FaceLattice<'_>,
        context: PairContext<'_>,
        local: &[Lanes],
        g: &[Lanes],
        losses: &mut Losses,
    ) -> bool {
        if context.failing.is_none() || !self.bonded {
            return false;
        }
        let before = self.fresh.len();
        self.bonded = false;
        let turned: [bool; LANES] =
            std::array::from_fn(|lane| context.turning && self.turned(section, lane));
        for (p, node_pair) in node_pairs.iter().enumerate() {
            for (lane, turned) in turned.into_iter().enumerate() {
                let point = &mut self.points[p][lane];
                let law = context.law(section.laws[lane]);
                let Some(law) = law.filter(|_| point.failure.is_none()) else { continue };
                let area = section.quarter.0[lane] * node_pair.elements().len() as f64;
                let force = element_force(g, section, node_pair, lane)
                    + elastic_force(point, section, lane, node_pair, local);
                if !point.fail(law, context, split(force / area), turned, losses) {
                    self.bonded = true;
                    continue;
                }
                self.set_failed(node_pairs, p, lane);
            }
        }
        self.fresh.len() > before
    }

    /// Elements that hold a pair are no longer alive.
    pub fn set_failed(&mut self, node_pairs: &[NodePair], p: usize, lane: usize) {
        self.fresh.push((p as u32, lane as u8));
        node_pairs[p].elements().for_each(|e| self.alive[e].0[lane] = 0.0);
    }

    /// Hands the forces of elements that are gone over to springs, without a jump at any pair:
    /// `forces` are those with them and without; `du` is that of the nodes in the last step.
    pub fn transfer_to_springs(
        &mut self,
        FaceLattice { node_pairs, section }: FaceLattice<'_>,
        local: &[Lanes],
        du: &[Lanes],
        forces: [&[Lanes]; 2],
        losses: &mut Losses,
    ) {
        losses.fracture += lost(local, forces);
        let old: Vec<[f64; LANES]> = self.points.iter().map(|p| p.map(|p| p.area)).collect();
        self.update_areas(node_pairs, section);
        for (p, (node_pair, old)) in node_pairs.iter().zip(old).enumerate() {
            for (lane, old) in old.into_iter().enumerate() {
                let point = &mut self.points[p][lane];
                if point.area == old {
                    continue;
                }
                let before = JointPoint { area: old, ..*point };
                let springs = elastic_force(&before, section, lane, node_pair, local);
                let gone = forces.map(|g| element_force(g, section, node_pair, lane));
                let force = springs + gone[0] - gone[1];
                losses.fracture += energy(section, lane, springs, old);
                losses.fracture -= energy(section, lane, force, point.area);
                let k = section.stiffness(lane);
                let traction = split(force / point.area);
                let elastic = joined(traction.normal / k.normal, traction.shear / k.shear);
                point.origin = across(local, section, node_pair, lane) - elastic;
                // What both nodes felt alike is gone before it could do its half of the work on
                // the last way.
                let [a, b] = node_pair.sides;
                let alike =
                    [a, b].map(|node| at(forces[0], node, lane) - at(forces[1], node, lane));
                let ways = at(du, a, lane) + at(du, b, lane);
                losses.fracture -= 0.25 * (alike[0] + alike[1]).dot(&ways);
            }
        }
        // What a pair bore when it failed is where its law begins.
        for &(p, lane) in &self.fresh {
            let (node_pair, lane) = (&node_pairs[p as usize], lane as usize);
            let point = &mut self.points[p as usize][lane];
            let traction =
                split(elastic_force(point, section, lane, node_pair, local) / point.area);
            point.begin(traction, traction.normal / section.stiffness(lane).normal);
        }
    }

    /// Adds the forces of the springs to `g`, the forces `K u` of the elements that are left.
    pub fn add_spring_forces(
        &mut self,
        FaceLattice { node_pairs, section }: FaceLattice<'_>,
        context: PairContext<'_>,
        SideDisplacements { local, du, grounds }: SideDisplacements<'_>,
        g: &mut [Lanes],
        losses: &mut Losses,
    ) -> SpringForces {
        let grounded = Lanes(grounds.map(|ground| f64::from(u8::from(ground.is_some()))));
        let mut pull = SpringForces { grounded, ..SpringForces::default() };
        for (p, node_pair) in node_pairs.iter().enumerate() {
            for (lane, ground) in grounds.iter().enumerate() {
                let point = &mut self.points[p][lane];
                if point.area == 0.0 {
                    continue;
                }
                let area = point.area;
                let mut apart = across(local, section, node_pair, lane);
                if let Some(GroundFrame { turn, shift, .. }) = ground {
                    apart = turn * apart + shift;
                }
                let breaks_off = du.filter(|_| self.fresh.contains(&(p as u32, lane as u8)));
                let du = breaks_off.map(|du| across(du, section, node_pair, lane));
                let law = context.law(section.laws[lane]).filter(|_| point.failure.is_some());
                let springs = context.springs(section.stiffness(lane), section.dashpot.0[lane]);
                losses.add_point(area, point.update(law, &springs, apart, du));
                if context.relaxing && law.is_some() {
                    point.set_equilibrium();
                }
                let Traction { normal: t_n, shear } = point.state.total_traction();
                let axes = ground.as_ref().map_or(&section.axes, |ground| &ground.axes);
                let force = axes * joined(t_n, shear) * area;
                // A ground takes the whole torque.
                let couple = match ground {
                    Some(_) => Vector3::zeros(),
                    None => (axes * joined(0.0, point.state.slip)).cross(&force),
                };
                let [a, b] = node_pair.sides;
                for c in 0..3 {
                    g[3 * a + c].0[lane] -= force[c];
                    g[3 * b + c].0[lane] += force[c];
                    pull.force[c].0[lane] += force[c];
                    pull.couple[c].0[lane] += couple[c];
                }
                pull.stored.0[lane] += area * stored(section.stiffness(lane), &point.state);
            }
        }
        pull
    }
}

/// Force of the springs of a bonded pair on side a, along the joint's own axes `[N]`.
fn elastic_force(
    point: &JointPoint,
    section: &JointSection,
    lane: usize,
    node_pair: &NodePair,
    local: &[Lanes],
) -> Vector3<f64> {
    if point.area == 0.0 {
        return Vector3::zeros();
    }
    let elastic = point.elastic(section.stiffness(lane), across(local, section, node_pair, lane));
    joined(elastic.normal, elastic.shear) * point.area
}

/// Energy of springs over an area that bear a force `[J]`.
fn energy(section: &JointSection, lane: usize, force: Vector3<f64>, area: f64) -> f64 {
    if area == 0.0 {
        return 0.0;
    }
    let force = split(force);
    let k = section.stiffness(lane);
    let both = force.normal * force.normal / k.normal + force.shear.norm_squared() / k.shear;
    0.5 * both / area
}

/// Energy that the elements of a lattice lose from one state to the other `[J]`.
fn lost(local: &[Lanes], [before, after]: [&[Lanes]; 2]) -> f64 {
    let mut sum = 0.0;
    for ((u, before), after) in local.iter().zip(before).zip(after) {
        sum += Lanes(std::array::from_fn(|l| 0.5 * u.0[l] * (before.0[l] - after.0[l]))).sum();
    }
    sum
}

/// Displacement of side b against side a, along the joint's own axes.
fn across(
    local: &[Lanes],
    section: &JointSection,
    node_pair: &NodePair,
    lane: usize,
) -> Vector3<f64> {
    let [a, b] = node_pair.sides;
    section.axes.tr_mul(&(at(local, b, lane) - at(local, a, lane)))
}

/// Half the difference of the forces of the elements on the two nodes, (M1), along the joint's own
/// axes.
fn element_force(
    g: &[Lanes],
    section: &JointSection,
    node_pair: &NodePair,
    lane: usize,
) -> Vector3<f64> {
    across(g, section, node_pair, lane) * 0.5
}

fn at(field: &[Lanes], node: usize, lane: usize) -> Vector3<f64> {
    lane_of(&[0, 1, 2].map(|c| field[3 * node + c]), lane)
}

fn lane_of(v: &[Lanes; 3], lane: usize) -> Vector3<f64> {
    Vector3::from(v.map(|c| c.0[lane]))
}
