//! A sparse matrix in compressed rows.

/// A square sparse matrix; the columns of each row ascend.
#[derive(Clone, Debug)]
pub struct Csr {
    /// Start of each row, and the end of the last one.
    pub offsets: Vec<usize>,
    /// The column of every entry.
    pub columns: Vec<usize>,
    /// The value of every entry.
    pub values: Vec<f64>,
}

impl Csr {
    /// A zero matrix whose entries couple all components of nodes that share an element.
    pub fn of_elements(nodes: usize, elements: impl Iterator<Item = [usize; 8]>) -> Self {
        let mut neighbours = vec![Vec::new(); nodes];
        for element in elements {
            for &node in &element {
                neighbours[node].extend(element);
            }
        }
        let mut matrix = Self { offsets: vec![0], columns: Vec::new(), values: Vec::new() };
        for row in &mut neighbours {
            row.sort_unstable();
            row.dedup();
            for _ in 0..3 {
                matrix.columns.extend(row.iter().flat_map(|node| 3 * node..3 * node + 3));
                matrix.offsets.push(matrix.columns.len());
            }
        }
        matrix.values = vec![0.0; matrix.columns.len()];
        matrix
    }

    /// The number of rows.
    pub fn size(&self) -> usize {
        self.offsets.len() - 1
    }

    /// The entry at a place of the pattern.
    fn index(&self, row: usize, column: usize) -> Option<usize> {
        let range = self.offsets[row]..self.offsets[row + 1];
        self.columns[range.clone()].binary_search(&column).ok().map(|at| range.start + at)
    }

    /// Adds to an entry of the pattern.
    pub fn add(&mut self, row: usize, column: usize, value: f64) {
        let index = self.index(row, column).expect("the entry is outside the pattern");
        self.values[index] += value;
    }

    /// An entry, zero outside the pattern.
    pub fn get(&self, row: usize, column: usize) -> f64 {
        self.index(row, column).map_or(0.0, |index| self.values[index])
    }

    /// The diagonal.
    pub fn diagonal(&self) -> Vec<f64> {
        (0..self.size()).map(|row| self.get(row, row)).collect()
    }

    /// `product = self · vector`.
    pub fn multiply_into(&self, vector: &[f64], product: &mut [f64]) {
        for (row, entry) in product.iter_mut().enumerate() {
            let range = self.offsets[row]..self.offsets[row + 1];
            *entry = self.columns[range.clone()]
                .iter()
                .zip(&self.values[range])
                .map(|(&column, value)| value * vector[column])
                .sum();
        }
    }

    /// `self · vector`.
    pub fn multiply(&self, vector: &[f64]) -> Vec<f64> {
        let mut product = vec![0.0; self.size()];
        self.multiply_into(vector, &mut product);
        product
    }
}

/// The scalar product.
pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

/// The Euclidean norm.
pub(super) fn norm(a: &[f64]) -> f64 {
    dot(a, a).sqrt()
}

/// `y += scale · x`.
pub(super) fn add_scaled(y: &mut [f64], scale: f64, x: &[f64]) {
    for (y, x) in y.iter_mut().zip(x) {
        *y += scale * x;
    }
}
