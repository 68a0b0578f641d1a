//! Pairs of one joint lattice: their failure and the forces of their springs.

use nalgebra::{Matrix3, Vector3};

use super::BrokenLattice;
use crate::losses::Losses;
use crate::point::{JointPoint, PairContext, components, vector};
use ddem_mechanics::law::Traction;
use ddem_mechanics::law::response::stored;
use ddem_mechanics::math::lanes::{LANES, Lanes};
use ddem_mesh::joint_sections::{FaceLattice, JointSection};
use ddem_mesh::numbering::NodePair;

/// Forces of the springs of a joint lattice.
#[derive(Clone, Copy, Debug, Default)]
pub struct SpringForces {
    /// Force on side a, from side b, in the joint's frame `[N]`.
    pub force: [Lanes; 3],
    /// `Σ s × F` of the slips, in the joint's frame `[N m]`.
    pub couple: [Lanes; 3],
    /// Energy in the springs `[J]`.
    pub stored: Lanes,
    /// 1 where the springs rotate with the ground block, 0 where they rotate with both blocks.
    pub grounded: Lanes,
}

/// Motion of both sides of a joint lattice.
#[derive(Clone, Copy)]
pub struct SideDisplacements<'a> {
    /// Displacements of the nodes in the joint's frame `[m]`.
    pub local: &'a [Lanes],
    /// Displacement increments of the nodes in the last step `[m]`; only if pairs have just failed.
    pub du: Option<&'a [Lanes]>,
    /// Ground block's frame for each lane whose springs rotate with it.
    pub grounds: &'a [Option<GroundFrame>; LANES],
}

/// Frame of the ground block with which the springs of a lane rotate, relative to the joint's mean
/// frame.
#[derive(Clone, Copy, Debug)]
pub struct GroundFrame {
    /// Axes of the springs, as columns, in the mean frame.
    axes: Matrix3<f64>,
    /// Rotation from openings along the joint's axes to openings along the springs' axes.
    opening_rotation: Matrix3<f64>,
    /// Opening that the rotation of the gap causes, along the springs' axes `[m]`.
    shift: Vector3<f64>,
}

impl GroundFrame {
    /// Frame of a ground block whose rotation relative to the mean frame is `rotation`.
    pub fn new(rotation: &Matrix3<f64>, section: &JointSection, lane: usize) -> Self {
        let axes = rotation * section.axes;
        let gap = lane_of(section.gap(), lane);
        let shift = axes.tr_mul(&gap) - section.axes.tr_mul(&gap);
        Self { axes, opening_rotation: axes.tr_mul(&section.axes), shift }
    }
}

impl BrokenLattice {
    /// Sets the tractions of a lane's springs at zero displacement, along the joint's axes.
    pub fn preload(&mut self, section: &JointSection, lane: usize, tractions: &[Vector3<f64>]) {
        let k = section.stiffness(lane);
        for (points, &traction) in self.points.iter_mut().zip(tractions) {
            let traction = components(traction);
            points[lane].origin = -vector(traction.normal / k.normal, traction.shear / k.shear);
        }
    }

    /// Checks bonded pairs for failure under the element forces `g` (`K u`) plus the spring forces.
    /// Removes the elements that hold a failed pair. Returns true if any pair failed.
    pub fn fail(
        &mut self,
        FaceLattice { node_pairs, section }: FaceLattice<'_>,
        context: PairContext<'_>,
        local: &[Lanes],
        g: &[Lanes],
        losses: &mut Losses,
    ) -> bool {
        if context.failure_divisor.is_none() || !self.bonded {
            return false;
        }
        let before = self.newly_failed.len();
        self.bonded = false;
        let has_rotated: [bool; LANES] = std::array::from_fn(|lane| {
            context.releases_rotated_joints && self.has_rotated(section, lane)
        });
        for (p, node_pair) in node_pairs.iter().enumerate() {
            for (lane, has_rotated) in has_rotated.into_iter().enumerate() {
                let point = &mut self.points[p][lane];
                let law = context.law(section.laws[lane]);
                let Some(law) = law.filter(|_| point.failure.is_none()) else { continue };
                let area = section.quarter.0[lane] * node_pair.elements().len() as f64;
                let force = element_force(g, section, node_pair, lane)
                    + elastic_force(point, section, lane, node_pair, local);
                if !point.fail(law, context, components(force / area), has_rotated, losses) {
                    self.bonded = true;
                    continue;
                }
                self.set_failed(node_pairs, p, lane);
            }
        }
        self.newly_failed.len() > before
    }

    /// Marks a pair as failed and removes the elements that hold it.
    pub fn set_failed(&mut self, node_pairs: &[NodePair], p: usize, lane: usize) {
        self.newly_failed.push((p as u32, lane as u8));
        node_pairs[p].elements().for_each(|e| self.alive[e].0[lane] = 0.0);
    }

    /// Transfers the forces of removed elements to springs without a jump at any pair. `forces` are
    /// the nodal forces before and after the removal; `du` are the displacement increments of the
    /// last step.
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
                let removed = forces.map(|g| element_force(g, section, node_pair, lane));
                let force = springs + removed[0] - removed[1];
                losses.fracture += energy(section, lane, springs, old);
                losses.fracture -= energy(section, lane, force, point.area);
                let k = section.stiffness(lane);
                let traction = components(force / point.area);
                let elastic = vector(traction.normal / k.normal, traction.shear / k.shear);
                point.origin = across(local, section, node_pair, lane) - elastic;
                // The part of the forces that is equal at both nodes vanishes before it does its
                // half of the work over the last displacement increment.
                let [a, b] = node_pair.sides;
                let alike =
                    [a, b].map(|node| at(forces[0], node, lane) - at(forces[1], node, lane));
                let increments = at(du, a, lane) + at(du, b, lane);
                losses.fracture -= 0.25 * (alike[0] + alike[1]).dot(&increments);
            }
        }
        // The law of a failed pair begins at the traction at failure.
        for &(p, lane) in &self.newly_failed {
            let (node_pair, lane) = (&node_pairs[p as usize], lane as usize);
            let point = &mut self.points[p as usize][lane];
            let traction =
                components(elastic_force(point, section, lane, node_pair, local) / point.area);
            point.begin(traction, traction.normal / section.stiffness(lane).normal);
        }
    }

    /// Adds the spring forces to `g`, the forces `K u` of the elements that are left.
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
                let mut relative_displacement = across(local, section, node_pair, lane);
                if let Some(GroundFrame { opening_rotation, shift, .. }) = ground {
                    relative_displacement = opening_rotation * relative_displacement + shift;
                }
                let just_failed =
                    du.filter(|_| self.newly_failed.contains(&(p as u32, lane as u8)));
                let du = just_failed.map(|du| across(du, section, node_pair, lane));
                let law = context.law(section.laws[lane]).filter(|_| point.failure.is_some());
                let springs = context.springs(section.stiffness(lane), section.dashpot.0[lane]);
                losses.add_point(area, point.update(law, &springs, relative_displacement, du));
                if context.relaxing && law.is_some() {
                    point.set_equilibrium();
                }
                let Traction { normal: t_n, shear } = point.state.total_traction();
                let axes = ground.as_ref().map_or(&section.axes, |ground| &ground.axes);
                let force = axes * vector(t_n, shear) * area;
                // The ground block takes the whole couple.
                let couple = match ground {
                    Some(_) => Vector3::zeros(),
                    None => (axes * vector(0.0, point.state.slip)).cross(&force),
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
    vector(elastic.normal, elastic.shear) * point.area
}

/// Energy of springs that carry a force over an area `[J]`.
fn energy(section: &JointSection, lane: usize, force: Vector3<f64>, area: f64) -> f64 {
    if area == 0.0 {
        return 0.0;
    }
    let force = components(force);
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

/// Displacement of side b relative to side a, along the joint's axes `[m]`.
fn across(
    local: &[Lanes],
    section: &JointSection,
    node_pair: &NodePair,
    lane: usize,
) -> Vector3<f64> {
    let [a, b] = node_pair.sides;
    section.axes.tr_mul(&(at(local, b, lane) - at(local, a, lane)))
}

/// Half the difference of the element forces at the two nodes (M1), along the joint's axes `[N]`.
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
