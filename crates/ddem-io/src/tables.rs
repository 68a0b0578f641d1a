//! Tables over time: `probes.csv`, `energy.csv`, `frames.csv` and `fragments.csv`.
//!
//! Every row begins with `stage,step,time`. Numbers have enough digits to read the same double
//! back. Rows become durable with `sync`. A killed run can leave a part of a last row, which
//! `reopen` removes.

use std::fmt::Write as _;
use std::fs::{File, OpenOptions};
use std::path::{Path, PathBuf};

use ddem_core::counted;

use crate::output_error::OutputError;

/// Columns with which every table begins.
const KEYS: [&str; 3] = ["stage", "step", "time"];
/// A table over time.
///
/// A row is one sample. Columns that were not sampled have empty cells. `NaN` is different: it is a
/// quantity without a value, such as the failure time of an intact bond.
#[derive(Debug)]
pub struct Table {
    path: PathBuf,
    columns: Vec<String>,
    /// Number of leading integer columns.
    whole: usize,
    writer: csv::Writer<File>,
    rows: u64,
    /// Buffer for one cell, which avoids an allocation for each number.
    cell: String,
}

impl Table {
    /// Creates the table with its header.
    ///
    /// # Errors
    ///
    /// The file cannot be written.
    pub fn create<S: AsRef<str>>(
        path: impl Into<PathBuf>,
        columns: &[S],
    ) -> Result<Self, OutputError> {
        let path = path.into();
        let columns: Vec<String> = columns.iter().map(|c| c.as_ref().to_owned()).collect();
        let file = File::create(&path).map_err(|e| OutputError::io(&path, "creating", e))?;
        let mut table = Self::new(path, columns, file, 0);
        let header = KEYS.into_iter().chain(table.columns.iter().map(String::as_str));
        table
            .writer
            .write_record(header)
            .map_err(|e| OutputError::csv(&table.path, "writing", e))?;
        table.flush()?;
        Ok(table)
    }

    /// Continues a table after its first `rows` rows and removes the later ones.
    ///
    /// # Errors
    ///
    /// [`OutputError::Unusable`] if the file is not such a table or has fewer rows.
    pub fn reopen(path: impl Into<PathBuf>, rows: u64) -> Result<Self, OutputError> {
        let path = path.into();
        let (columns, end) = header_and_end(&path, rows)?;
        let reopening = |e| OutputError::io(&path, "reopening", e);
        // In append mode no position is needed.
        let file = OpenOptions::new().append(true).open(&path).map_err(reopening)?;
        file.set_len(end).map_err(reopening)?;
        Ok(Self::new(path, columns, file, rows))
    }

    fn new(path: PathBuf, columns: Vec<String>, file: File, rows: u64) -> Self {
        let writer = csv::Writer::from_writer(file);
        Self { path, columns, whole: 0, writer, rows, cell: String::new() }
    }

    /// The table with integers in its first columns.
    #[must_use]
    pub fn with_whole(self, columns: usize) -> Self {
        Self { whole: columns, ..self }
    }

    /// Adds one row at `time` `[s]`; `None` for values that were not sampled.
    ///
    /// # Errors
    ///
    /// [`OutputError::Mismatch`] if there is not one value for each column, others if the file
    /// cannot be written.
    pub fn row<V: Copy + Into<Option<f64>>>(
        &mut self,
        stage: &str,
        step: u64,
        time: f64,
        values: &[V],
    ) -> Result<(), OutputError> {
        if values.len() != self.columns.len() {
            let (have, want) = (values.len(), self.columns.len());
            let message = format!(
                "a row has {} instead of {want}: give one for each column",
                counted(have, "value")
            );
            return Err(OutputError::mismatch(&self.path, message));
        }
        self.write(stage, step, time, values.iter().map(|&value| value.into()))
            .map_err(|e| OutputError::csv(&self.path, "writing", e))?;
        self.rows += 1;
        Ok(())
    }

    /// Passes the rows so far to the system, so that other programs can read them.
    ///
    /// # Errors
    ///
    /// [`OutputError::Io`] or [`OutputError::DiskFull`].
    pub fn flush(&mut self) -> Result<(), OutputError> {
        self.writer.flush().map_err(|e| OutputError::io(&self.path, "writing", e))
    }

    /// Waits until the rows so far are on the disk: they then survive a power failure.
    ///
    /// # Errors
    ///
    /// [`OutputError::Io`] or [`OutputError::DiskFull`].
    pub fn sync(&mut self) -> Result<(), OutputError> {
        self.flush()?;
        crate::replace::sync(&self.path)
    }

    /// Number of rows in the table, without the header.
    pub fn rows_written(&self) -> u64 {
        self.rows
    }

    /// Names of the columns after `stage,step,time`.
    pub fn columns(&self) -> &[String] {
        &self.columns
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    fn write(
        &mut self,
        stage: &str,
        step: u64,
        time: f64,
        values: impl Iterator<Item = Option<f64>>,
    ) -> csv::Result<()> {
        self.writer.write_field(stage)?;
        self.writer.write_field(step.to_string())?;
        // The time comes first and is not one of `columns`.
        for (at, value) in std::iter::once(Some(time)).chain(values).enumerate() {
            self.cell.clear();
            if let Some(value) = value.filter(|_| (1..=self.whole).contains(&at)) {
                let _ = write!(self.cell, "{value:.0}");
            } else if let Some(value) = value {
                // `Debug` is the shortest text that reads back the same, with an exponent where
                // `Display` would write hundreds of zeros. Writing to a string cannot fail.
                let _ = write!(self.cell, "{value:?}");
            }
            self.writer.write_field(&self.cell)?;
        }
        self.writer.write_record(None::<&[u8]>)
    }
}

/// Columns of a table, and the byte at which its first `rows` rows end.
fn header_and_end(path: &Path, rows: u64) -> Result<(Vec<String>, u64), OutputError> {
    let reading = |e| OutputError::csv(path, "reopening", e);
    let mut reader = csv::Reader::from_path(path).map_err(reading)?;
    let header = reader.headers().map_err(reading)?.clone();
    if !header.iter().take(KEYS.len()).eq(KEYS) {
        let message =
            "the first columns are not stage,step,time: restore the table, or run from the start";
        return Err(OutputError::unusable(path, message));
    }
    let mut record = csv::ByteRecord::new();
    for have in 0..rows {
        if !reader.read_byte_record(&mut record).map_err(reading)? {
            let message = format!(
                "the table has {}, but the run to resume had written {rows}: restore it, or run from the start",
                counted(have, "row")
            );
            return Err(OutputError::unusable(path, message));
        }
    }
    let columns = header.iter().skip(KEYS.len()).map(str::to_owned).collect();
    Ok((columns, reader.position().byte()))
}
