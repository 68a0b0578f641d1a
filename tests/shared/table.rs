//! Tables over time, read as plain text.

use std::path::Path;

/// `probes.csv` or `energy.csv`.
pub struct ResultTable {
    names: Vec<String>,
    rows: Vec<Vec<Option<f64>>>,
}

impl ResultTable {
    /// Reads a table; the names of stages must be free of commas.
    pub fn read(path: &Path) -> Self {
        let text = std::fs::read_to_string(path).expect("a table");
        let mut lines = text.lines();
        let header = lines.next().expect("a header");
        let cells = |line: &str| line.split(',').map(|cell| cell.parse().ok()).collect();
        Self {
            names: header.split(',').map(str::to_owned).collect(),
            rows: lines.map(cells).collect(),
        }
    }

    /// The values of a column with the times of their rows, without empty cells.
    pub fn series(&self, name: &str) -> Vec<[f64; 2]> {
        let find = |name: &str| self.names.iter().position(|n| n == name);
        let at = find(name).unwrap_or_else(|| panic!("no column {name} in {:?}", self.names));
        let time = find("time").expect("times");
        let sample = |row: &Vec<Option<f64>>| Some([row[time]?, row[at]?]);
        self.rows.iter().filter_map(sample).collect()
    }

    /// The values of a column.
    pub fn column(&self, name: &str) -> Vec<f64> {
        self.series(name).into_iter().map(|[_, value]| value).collect()
    }
}
