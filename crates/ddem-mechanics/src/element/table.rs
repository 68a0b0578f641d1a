//! Stiffness of four elements side by side, for [`lattice`](super::lattice).

use super::hexahedron::{HexahedronElement, HexahedronTable};
use super::modal::Modal;
use crate::math::lanes::{LANES, Lanes};

/// Stiffness tables of four elements, one per lane.
#[derive(Clone, Debug, PartialEq)]
pub enum ElementTable {
    /// Four boxes along the coordinate axes.
    Box(Box<BoxTable>),
    /// Four parallelepipeds of any shape.
    Oblique(Box<ObliqueTable>),
    /// Hexahedra of any shape: a table for each element of the lattice, x fastest.
    Hexahedra(Box<[HexahedronTable]>),
}

/// Independent nonzero entries of the stiffness of a box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoxTable {
    /// Normal strains: xx yy zz xy yz zx of a symmetric 3×3.
    pub(super) normal: [Lanes; 6],
    /// Shear strains in the planes yz, zx, xy: 11, 22, 12 of a symmetric 2×2 each. Here and below the
    /// axes follow each other cyclically, so that turned axes have turned entries.
    pub(super) shear: [[Lanes; 3]; 3],
    /// Bending, linear in ξ, η, ζ: 11, 22, 12 of a symmetric 2×2 each.
    pub(super) bend: [[Lanes; 3]; 3],
    /// Twisting: (ηζ, x), (ζξ, y), (ξη, z), as xx yy zz xy yz zx.
    pub(super) twist: [Lanes; 6],
    /// Mode ξηζ.
    pub(super) hour: [Lanes; 3],
}

/// All entries of the stiffness of a parallelepiped.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObliqueTable {
    pub(super) strain: [[Lanes; 9]; 9],
    pub(super) bend: [[Lanes; 9]; 9],
    pub(super) hour: [[Lanes; 3]; 3],
}

impl ElementTable {
    /// Table of four modal stiffnesses side by side; `None` is a lane without an element.
    pub fn new(lanes: [Option<&Modal>; LANES], is_box: bool) -> Self {
        let pick = |f: &dyn Fn(&Modal) -> f64| Lanes(lanes.map(|m| m.map_or(0.0, f)));
        let strain = |r: usize, c: usize| pick(&|m| m.strain[(r, c)]);
        let bend = |r: usize, c: usize| pick(&|m| m.bend[(r, c)]);
        let hour = |r: usize, c: usize| pick(&|m| m.hour[(r, c)]);
        if !is_box {
            let square = |f: &dyn Fn(usize, usize) -> Lanes| {
                std::array::from_fn(|r| std::array::from_fn(|c| f(r, c)))
            };
            return Self::Oblique(Box::new(ObliqueTable {
                strain: square(&strain),
                bend: square(&bend),
                hour: std::array::from_fn(|r| std::array::from_fn(|c| hour(r, c))),
            }));
        }
        // Indices: strain 3 i + α; bend 3 (0 ξη, 1 ξζ, 2 ηζ) + i.
        let three = |f: &dyn Fn(usize, usize) -> Lanes, at: [usize; 3]| {
            let [a, b, c] = at;
            [f(a, a), f(b, b), f(c, c), f(a, b), f(b, c), f(c, a)]
        };
        let two =
            |f: &dyn Fn(usize, usize) -> Lanes, a: usize, b: usize| [f(a, a), f(b, b), f(a, b)];
        Self::Box(Box::new(BoxTable {
            normal: three(&strain, [0, 4, 8]),
            shear: [two(&strain, 7, 5), two(&strain, 2, 6), two(&strain, 3, 1)],
            bend: [two(&bend, 1, 5), two(&bend, 8, 0), two(&bend, 3, 7)],
            twist: three(&bend, [6, 4, 2]),
            hour: [hour(0, 0), hour(1, 1), hour(2, 2)],
        }))
    }
}

impl ElementTable {
    /// Tables of four lattices of hexahedra side by side, x fastest; a lattice without elements has an
    /// empty list.
    pub fn hexahedra(lattices: [&[HexahedronElement]; LANES]) -> Self {
        let elements = lattices.iter().map(|lattice| lattice.len()).max().unwrap_or(0);
        let table = |at: usize| HexahedronTable::new(lattices.map(|lattice| lattice.get(at)));
        Self::Hexahedra((0..elements).map(table).collect())
    }

    /// Memory on the heap `[bytes]`.
    pub fn bytes(&self) -> usize {
        match self {
            Self::Box(_) => size_of::<BoxTable>(),
            Self::Oblique(_) => size_of::<ObliqueTable>(),
            Self::Hexahedra(tables) => size_of_val(&tables[..]),
        }
    }
}
