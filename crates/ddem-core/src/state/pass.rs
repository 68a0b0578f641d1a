//! First pass of a step: its input, its output and its working space.

use fearless_simd::{Select, Simd, SimdBase, f64x4};
use nalgebra::Matrix3;

use super::profile::Stopwatch;
use ddem_joint::broken::{BrokenLattice, GroundFrame, PairTractions};
use ddem_joint::kinematics::NodePositions;
use ddem_joint::losses::Losses;
use ddem_joint::point::{FailureCheck, PairContext};
use ddem_mechanics::math::lanes::{LANES, Lanes, Matrix, splat, transposed_product};
use ddem_mesh::assembly::Assembly;
use ddem_mesh::in_situ::{InSitu, InSituLattice};
use ddem_mesh::joint_sections::{FaceLattice, JointSections};
use ddem_mesh::pack::{JointLattice, Neighbours};

/// Stiffness damping of the blocks, `C = β K`.
#[derive(Clone, Copy)]
pub(crate) struct Viscous<'a> {
    /// Velocities that are damped `[m/s]`.
    pub(crate) v: &'a [Lanes],
    /// β of all deformable blocks `[s]`.
    pub(crate) stiffness: f64,
}

/// Input of the internal forces.
#[derive(Clone, Copy)]
pub(crate) struct Input<'a> {
    pub(crate) moved: NodePositions<'a>,
    pub(crate) assembly: &'a Assembly,
    pub(crate) sections: &'a JointSections,
    /// In-situ stress.
    pub(crate) in_situ: Option<&'a InSitu>,
    pub(crate) pair_context: PairContext<'a>,
    /// Velocities of the last half step and its time step, if there was one.
    pub(crate) last: Option<(&'a [Lanes], f64)>,
    /// Stiffness damping of the blocks, if in use.
    pub(crate) viscous: Option<Viscous<'a>>,
    /// True for blocks that supports hold along all axes, by pack and lane; empty if there are
    /// none.
    pub(crate) held: &'a [[bool; LANES]],
}

/// Working space of one task.
#[derive(Debug, Default)]
pub(crate) struct Workspace {
    /// Local displacements of one lattice.
    pub(crate) local: Vec<Lanes>,
    /// Local forces of one lattice.
    pub(crate) g: Vec<Lanes>,
    /// Forces before some of the elements failed.
    pub(crate) before: Vec<Lanes>,
    /// Displacement increments of the nodes in the last step.
    pub(crate) du: Vec<Lanes>,
    /// Displacements of the pairs of one lattice, side b relative to side a, along the joint's axes.
    pub(crate) relative: Vec<Lanes>,
    /// Increments of the displacements of these pairs in the last step.
    pub(crate) pair_du: Vec<Lanes>,
    /// Forces of the springs of the pairs on side a, along the joint's axes.
    pub(crate) pair_forces: Vec<Lanes>,
    /// Tractions of the pairs of one lattice.
    pub(crate) tractions: PairTractions,
    /// Times of the phases.
    pub(crate) stopwatch: Stopwatch,
}

/// Output for one pack. Forces have the sign of forces on the nodes, `−K u`.
pub(crate) struct Output<'a> {
    /// Forces on the pack's own nodes `[N]`, overwritten.
    pub(crate) f: &'a mut [Lanes],
    /// Viscous part of the forces, against the motion; overwritten if blocks are viscous.
    pub(crate) viscous: Option<&'a mut [Lanes]>,
    /// Forces on the nodes of upper neighbours `[N]` and torques on them `[N m]`, overwritten.
    pub(crate) neighbour_forces: &'a mut [Lanes],
    /// Residual torque on the pack's own blocks `[N m]`, overwritten.
    pub(crate) torque: &'a mut [Lanes; 3],
    /// Strain energy of the blocks and of the joints, if requested `[J]`.
    pub(crate) energy: Option<&'a mut [Lanes; 2]>,
    /// Losses of its joints, overwritten.
    pub(crate) losses: &'a mut Losses,
}

impl<'a> Input<'a> {
    /// Edges of one element of a joint lattice.
    pub(crate) fn edges(&self, at: JointLattice) -> &'a [[Lanes; 3]; 3] {
        let table = || self.assembly.pack_tables[at.pack][at.offset] as usize;
        match self.face(at) {
            Some(face) => &face.section.edges,
            None => &self.assembly.tables[table()].edges,
        }
    }

    /// In-situ stress in the blocks (offset 0) or a joint lattice of a pack.
    #[inline(always)]
    pub(crate) fn initial_stress(&self, at: JointLattice) -> Option<InSituLattice<'a>> {
        self.in_situ?.initial_stress(self.moved.packs, at.pack, at.offset)
    }

    /// Pairs and section of a joint lattice, if it is a face joint.
    #[inline(always)]
    pub(crate) fn face(&self, at: JointLattice) -> Option<FaceLattice<'a>> {
        let JointLattice { pack, offset } = at;
        if !offset.is_power_of_two() {
            return None;
        }
        let direction = offset.trailing_zeros() as usize;
        let packs = self.moved.packs;
        let node_pairs = &packs.numbering_of(&packs.packs[pack]).pairs[direction];
        Some(FaceLattice { node_pairs, section: self.sections.get(pack, direction)? })
    }

    /// Divisors of the tractions in the check of the joints of a lattice for failure; `None`: no
    /// pair fails.
    #[inline(always)]
    pub(crate) fn failure_divisors(&self, at: JointLattice) -> Option<Lanes> {
        let check = self.pair_context.failure_check;
        match check {
            FailureCheck::None => None,
            FailureCheck::Overloaded => Some(Lanes([1.0; LANES])),
            FailureCheck::MostLoaded { .. } => {
                let upper = self.moved.packs.packs[at.pack].upper[at.offset];
                let section = self.face(at)?.section;
                Some(Lanes(std::array::from_fn(|lane| {
                    let own = (at.pack, lane);
                    let law = self.pair_context.law(section.laws[lane]);
                    check
                        .divisor(law, [own, upper.at(lane).unwrap_or(own)])
                        .unwrap_or(f64::INFINITY)
                })))
            }
        }
    }

    /// Part of the couple due to slip that a block takes against its upper neighbour: all if it
    /// alone is held, none if only the neighbour is held, otherwise half.
    pub(crate) fn own_part(&self, upper: Neighbours, index: usize) -> Lanes {
        if self.held.is_empty() {
            return Lanes([0.5; LANES]);
        }
        let held = |pack: usize, lane: usize| {
            f64::from(u8::from(self.held.get(pack).is_some_and(|lanes| lanes[lane])))
        };
        Lanes(std::array::from_fn(|lane| match upper.at(lane) {
            Some((pack, there)) => 0.5 + 0.5 * (held(index, lane) - held(pack, there)),
            None => 0.5,
        }))
    }

    /// Frames of the ground blocks with which the springs of each lane rotate. The ground is the
    /// only held block of a joint once all pairs have failed, until a contact replaces the joint.
    /// `mean` is the rotation of the joint's frame.
    #[inline(always)]
    pub(crate) fn grounds<S: Simd>(
        &self,
        simd: S,
        at: JointLattice,
        mean: &Matrix<S>,
        blocks: &[Matrix<S>; 2],
        broken: &BrokenLattice,
    ) -> [Option<GroundFrame>; LANES] {
        let Some(FaceLattice { section, .. }) = self.face(at) else { return [None; LANES] };
        let pack = &self.moved.packs.packs[at.pack];
        let part = self.own_part(pack.upper[at.offset], at.pack);
        let context = self.pair_context;
        let has_ground: [bool; LANES] = std::array::from_fn(|lane| {
            part.0[lane] != 0.5 && broken.has_failed_in_place(context, section, lane, pack.rigid)
        });
        if !context.releases_rotated_joints || has_ground == [false; LANES] {
            return [None; LANES];
        }
        let own = part.load(simd).simd_gt(splat(simd, 0.5));
        let [a, b] = blocks;
        let ground = [0, 1, 2].map(|i| [0, 1, 2].map(|j| own.select(a[i][j], b[i][j])));
        let rows = transposed_product(mean, &ground).map(|row| row.map(Lanes::from));
        std::array::from_fn(|lane| {
            let rotation = || Matrix3::from_fn(|i, j| rows[i][j].0[lane]);
            has_ground[lane].then(|| GroundFrame::new(&rotation(), section, lane))
        })
    }
}

impl Workspace {
    /// Makes room for `n` numbers of the nodes of a lattice, and so for those of its pairs.
    pub(crate) fn reserve(&mut self, n: usize) {
        if self.local.len() >= n {
            return;
        }
        let Self { local, g, before, du, relative, pair_du, pair_forces, .. } = self;
        for buffer in [local, g, before, du, relative, pair_du, pair_forces] {
            buffer.resize(n, Lanes::ZERO);
        }
    }
}

/// Half the work, `½ Σ u·g` `[J]`.
#[inline(always)]
pub(crate) fn half_work<S: Simd>(simd: S, u: &[Lanes], g: &[Lanes]) -> f64x4<S> {
    let mut sum = splat(simd, 0.0);
    for (u, g) in u.iter().zip(g) {
        sum += u.load(simd) * g.load(simd);
    }
    sum * 0.5
}
