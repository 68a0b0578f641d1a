//! §6: factors in time.

use crate::deck::History;

impl History {
    /// The factor at a time `[s]` after the history begins.
    #[must_use]
    pub fn factor(&self, time: f64) -> f64 {
        match self {
            Self::Ramp(rise) => {
                if time >= *rise {
                    1.0
                } else {
                    (time / rise).max(0.0)
                }
            }
            Self::Table(rows) => {
                let after = rows.partition_point(|row| row[0] <= time);
                match (after.checked_sub(1).map(|i| rows[i]), rows.get(after)) {
                    (Some([t0, f0]), Some(&[t1, f1])) => f0 + (f1 - f0) * (time - t0) / (t1 - t0),
                    (Some([_, f]), None) | (None, Some(&[_, f])) => f,
                    (None, None) => 0.0,
                }
            }
        }
    }
}

#[cfg(test)]
mod tests;
