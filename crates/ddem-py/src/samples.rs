//! Samples of probes, which hold only the numbers that were due.

/// Samples of all probes since the start, column by column. Memory grows with the numbers that were
/// due: 12 bytes for each number and 16 for each row. Probes that were not due need none.
#[derive(Default)]
pub(crate) struct Samples {
    /// Step and time of each row `[s]`.
    rows: Vec<(u64, f64)>,
    columns: Vec<SampleColumn>,
}

#[derive(Default)]
struct SampleColumn {
    /// Row of each number.
    rows: Vec<u32>,
    numbers: Vec<f64>,
}

impl Samples {
    /// Adds a row with one number for each column; `None` if the probe was not due.
    pub(crate) fn push(&mut self, step: u64, time: f64, values: &[Option<f64>]) {
        // Memory cannot hold so many rows.
        let Ok(row) = u32::try_from(self.rows.len()) else { return };
        if values.len() > self.columns.len() {
            self.columns.resize_with(values.len(), SampleColumn::default);
        }
        for (column, value) in self.columns.iter_mut().zip(values) {
            if let Some(value) = value {
                column.rows.push(row);
                column.numbers.push(*value);
            }
        }
        self.rows.push((step, time));
    }

    /// Steps and times at which a column was due `[s]`.
    pub(crate) fn times(&self, column: usize) -> (Vec<i64>, Vec<f64>) {
        let rows = self.columns.get(column).map_or(&[][..], |column| &column.rows);
        rows.iter().map(|&row| self.rows[row as usize]).map(|(step, t)| (step as i64, t)).unzip()
    }

    /// Numbers of a column, at its times.
    pub(crate) fn numbers(&self, column: usize) -> Vec<f64> {
        self.columns.get(column).map_or_else(Vec::new, |column| column.numbers.clone())
    }
}
