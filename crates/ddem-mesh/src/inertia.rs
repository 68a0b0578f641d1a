//! Masses of the nodes of a pack.

use crate::Geometry;
use crate::assembly::Assembly;
use crate::pack::Pack;
use ddem_mechanics::math::lanes::Lanes;

/// Mass and stiffness diagonal of the nodes of one pack.
#[derive(Clone, Debug, PartialEq)]
pub struct Inertia {
    /// Mass of each node `[kg]`.
    pub mass: Vec<Lanes>,
    /// Diagonal of the assembled stiffness, three numbers per node `[N/m]`.
    pub diagonal: Vec<Lanes>,
    /// Moments of the mass of each block.
    pub moments: Moments,
    /// Sums over tied nodes, if a node of the pack may be tied.
    pub tied: Option<TiedInertia>,
}

/// Masses and stiffnesses of the nodes of one pack, each summed over the nodes it is tied to.
#[derive(Clone, Debug, PartialEq)]
pub struct TiedInertia {
    /// Mass of all tied nodes `[kg]`.
    pub mass: Vec<Lanes>,
    /// Diagonal of the assembled stiffness of all tied nodes, three numbers per node `[N/m]`.
    pub diagonal: Vec<Lanes>,
    /// Part of each node in that mass; 1 for a node that is not tied, 0 without mass.
    pub share: Vec<Lanes>,
}

/// Moments of the mass of four blocks. Coordinates count elements from the centre of a block.
#[derive(Clone, Debug, PartialEq)]
pub struct Moments {
    /// Inverse of the mass `[1/kg]`; 1 without mass.
    pub per_mass: Lanes,
    /// Centre of mass.
    pub centre: [Lanes; 3],
    /// Second moments about the centre of mass, xx yy zz xy yz zx `[kg]`.
    pub second: [Lanes; 6],
    /// 1 without mass, else 0. A lane has no mass if it has no block or its block is removed.
    pub empty: Lanes,
}

impl Assembly {
    /// Parts of the nodes of a pack in the nodes that they are tied to, if some may be tied.
    #[inline]
    #[must_use]
    pub fn shares(&self, pack: usize) -> Option<&[Lanes]> {
        let inertia = &self.inertia[self.pack_inertia[pack] as usize];
        inertia.tied.as_ref().map(|tied| &tied.share[..])
    }
}

impl Inertia {
    pub(super) fn gather(
        geometry: &Geometry,
        divisions: usize,
        pack: &Pack,
        nodes: &[[f64; 4]],
    ) -> Self {
        let n = (divisions + 1).pow(3);
        // Lanes without a block have no mass and therefore never move.
        let first = |lane: usize| {
            let block = (lane < pack.filled).then_some(pack.blocks[lane] as usize)?;
            Some(geometry.blocks[block].first_node as usize)
        };
        let pick = |local: usize, k: usize| {
            let of = |lane: usize| first(lane).map_or(0.0, |first| nodes[first + local][k]);
            Lanes(std::array::from_fn(of))
        };
        let mass: Vec<Lanes> = (0..n).map(|local| pick(local, 0)).collect();
        let diagonal = (0..n).flat_map(|local| [1, 2, 3].map(|c| pick(local, c))).collect();
        let moments = Moments::new(divisions, &mass);
        Self { mass, diagonal, moments, tied: None }
    }

    /// Adds the sums over tied nodes. `tied` has mass and diagonal of each node.
    pub(super) fn tie(
        &mut self,
        geometry: &Geometry,
        divisions: usize,
        pack: &Pack,
        tied: &[[f64; 4]],
    ) {
        let Self { mass, diagonal, .. } = Self::gather(geometry, divisions, pack, tied);
        let share = |(own, all): (&Lanes, &Lanes)| {
            let part = |own: f64, all: f64| if all > 0.0 { own / all } else { 0.0 };
            Lanes(std::array::from_fn(|lane| part(own.0[lane], all.0[lane])))
        };
        let share = self.mass.iter().zip(&mass).map(share).collect();
        self.tied = Some(TiedInertia { mass, diagonal, share });
    }

    /// Mass that each node moves, that of tied nodes included `[kg]`.
    #[inline]
    #[must_use]
    pub fn moved_mass(&self) -> &[Lanes] {
        self.tied.as_ref().map_or(&self.mass, |tied| &tied.mass)
    }

    /// Diagonal of the assembled stiffness at each node, that of tied nodes included `[N/m]`.
    #[inline]
    #[must_use]
    pub fn moved_diagonal(&self) -> &[Lanes] {
        self.tied.as_ref().map_or(&self.diagonal, |tied| &tied.diagonal)
    }

    /// Memory in use `[bytes]`.
    pub fn bytes(&self) -> usize {
        let tied = if self.tied.is_some() { 5 * self.mass.len() } else { 0 };
        size_of::<Moments>() + (self.mass.len() + self.diagonal.len() + tied) * size_of::<Lanes>()
    }

    /// Numbers that distinguish it from others.
    pub(super) fn numbers(&self) -> impl Iterator<Item = f64> + '_ {
        let tied = self.tied.iter().flat_map(|tied| tied.mass.iter().chain(&tied.diagonal));
        let all = self.mass.iter().chain(&self.diagonal).chain(tied);
        all.flat_map(|lanes| lanes.0)
    }
}

impl Moments {
    fn new(divisions: usize, mass: &[Lanes]) -> Self {
        let mut moments = Self {
            per_mass: Lanes::ZERO,
            centre: [Lanes::ZERO; 3],
            second: [Lanes::ZERO; 6],
            empty: Lanes::ZERO,
        };
        let (side, half) = (divisions + 1, 0.5 * divisions as f64);
        for lane in 0..mass[0].0.len() {
            let nodes = || {
                mass.iter().enumerate().map(|(node, mass)| {
                    let index = [node % side, node / side % side, node / side / side];
                    (mass.0[lane], index.map(|i| i as f64 - half))
                })
            };
            let whole: f64 = nodes().map(|(mass, _)| mass).sum();
            if whole == 0.0 {
                (moments.per_mass.0[lane], moments.empty.0[lane]) = (1.0, 1.0);
                continue;
            }
            moments.per_mass.0[lane] = 1.0 / whole;
            let centre = [0, 1, 2].map(|d| nodes().map(|(m, x)| m * x[d]).sum::<f64>() / whole);
            (0..3).for_each(|d| moments.centre[d].0[lane] = centre[d]);
            for (mass, x) in nodes() {
                let x = [0, 1, 2].map(|d| x[d] - centre[d]);
                (0..3).for_each(|d| moments.second[d].0[lane] += mass * x[d] * x[d]);
                (0..3).for_each(|d| moments.second[3 + d].0[lane] += mass * x[d] * x[(d + 1) % 3]);
            }
        }
        moments
    }
}
