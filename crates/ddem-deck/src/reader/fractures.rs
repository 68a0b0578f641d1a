//! Tables of fractures: CSV with the columns x, y, z, dip, dip_direction and radius.

use std::fs::File;
use std::io::Read;

use ddem_core::{ErrorCode, Fault};

use crate::schema::FractureTable;

const COLUMNS: [&str; 6] = ["x", "y", "z", "dip", "dip_direction", "radius"];

const FORMAT: &str =
    "fractures are CSV with the columns x, y, z, dip, dip_direction, radius, a row for each";

fn wrong(message: impl Into<String>) -> Fault {
    Fault::new(ErrorCode::InvalidFile, "", message).help(FORMAT)
}

/// Fractures from a CSV file. A line of headings gives the columns their order.
pub(super) fn fractures(mut file: File) -> Result<FractureTable, Fault> {
    let mut text = String::new();
    file.read_to_string(&mut text).map_err(|error| wrong(format!("this is not text: {error}")))?;
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .trim(csv::Trim::All)
        .comment(Some(b'#'))
        .flexible(true)
        .from_reader(text.as_bytes());
    let mut order = [0, 1, 2, 3, 4, 5];
    let mut rows = Vec::new();
    for (index, record) in reader.records().enumerate() {
        let record =
            record.unwrap_or_else(|error| unreachable!("UTF-8 with rows of any length: {error}"));
        let number = |at: usize| record.get(at)?.parse().ok().filter(|x: &f64| x.is_finite());
        if index == 0 && record.iter().all(|field| field.parse::<f64>().is_err()) {
            for (place, column) in order.iter_mut().zip(COLUMNS) {
                let found = record.iter().position(|field| field.eq_ignore_ascii_case(column));
                *place = found.ok_or_else(|| wrong(format!("there is no column `{column}`")))?;
            }
            continue;
        }
        let line = record.position().map_or(index as u64 + 1, csv::Position::line);
        let mut row = [0.0; 6];
        for (k, value) in row.iter_mut().enumerate() {
            *value = number(order[k])
                .ok_or_else(|| wrong(format!("line {line}: `{}` is no number", COLUMNS[k])))?;
        }
        let [.., dip, direction, radius] = row;
        let ranges = [
            ("dip", (0.0..=90.0).contains(&dip), "from 0 to 90"),
            ("dip_direction", (0.0..=360.0).contains(&direction), "from 0 to 360"),
            ("radius", radius > 0.0, "above 0"),
        ];
        if let Some((column, _, range)) = ranges.into_iter().find(|(_, fits, _)| !fits) {
            return Err(wrong(format!("line {line}: `{column}` must be {range}")));
        }
        rows.push(row);
    }
    if rows.is_empty() { Err(wrong("there is no fracture")) } else { Ok(FractureTable(rows)) }
}
