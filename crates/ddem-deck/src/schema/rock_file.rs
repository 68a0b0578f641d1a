//! Rock of a file: cells of another program, or the inside of a closed surface.

use ddem_cut::Polyhedron;

use super::Triangles;

/// Rock of a file.
#[derive(Clone, Debug, PartialEq)]
pub enum RockFile {
    /// Triangles of a closed surface.
    Surface(Triangles),
    /// Convex cells, with equal corners where they meet.
    Cells(FileCells),
}

/// Convex cells of a file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FileCells(Vec<Polyhedron>);

impl FileCells {
    /// Cells that have been checked: each is convex, and none overlaps another.
    pub(crate) fn checked(cells: Vec<Polyhedron>) -> Self {
        Self(cells)
    }

    /// Cells.
    #[must_use]
    pub fn cells(&self) -> &[Polyhedron] {
        &self.0
    }

    /// Diagonal of the box around the cells `[m]`.
    pub(crate) fn diagonal(&self) -> f64 {
        let corners = || self.0.iter().flat_map(|cell| &cell.points);
        let first = corners().next().copied().unwrap_or_default();
        let ends = corners().fold([first; 2], |[low, high], x| [low.inf(x), high.sup(x)]);
        (ends[1] - ends[0]).norm()
    }

    /// Cells as numbers: for each cell its points and faces, with their counts.
    pub(crate) fn numbers(&self) -> Vec<f64> {
        let mut numbers = Vec::new();
        for cell in &self.0 {
            numbers.push(cell.points.len() as f64);
            numbers.extend(cell.points.iter().flatten());
            numbers.push(cell.faces.len() as f64);
            for face in &cell.faces {
                numbers.push(face.len() as f64);
                numbers.extend(face.iter().map(|&corner| corner as f64));
            }
        }
        numbers
    }

    /// Cells from [`FileCells::numbers`]; `None` if these are others.
    pub(crate) fn from_numbers(numbers: &[f64]) -> Option<Self> {
        let mut rest = numbers;
        let mut take = |n: usize| {
            let (taken, after) = rest.split_at_checked(n)?;
            rest = after;
            Some(taken)
        };
        let mut cells = Vec::new();
        while let Some([points]) = take(1) {
            let points: Vec<_> = take((*points as usize).checked_mul(3)?)?
                .chunks_exact(3)
                .map(ddem_core::problem::Vec3::from_column_slice)
                .collect();
            let mut faces = Vec::new();
            for _ in 0..*take(1)?.first()? as usize {
                let n = *take(1)?.first()? as usize;
                let corners: Vec<usize> = take(n)?.iter().map(|&corner| corner as usize).collect();
                if corners.iter().any(|&corner| corner >= points.len()) {
                    return None;
                }
                faces.push(corners);
            }
            cells.push(Polyhedron { points, faces });
        }
        Some(Self(cells))
    }
}

impl RockFile {
    /// Number of the cells of a file that has cells.
    #[must_use]
    pub fn n_cells(&self) -> usize {
        match self {
            Self::Surface(_) => 1,
            Self::Cells(cells) => cells.cells().len(),
        }
    }
}
