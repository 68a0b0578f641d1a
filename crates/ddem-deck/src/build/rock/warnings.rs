//! Warnings about regions after their cuts.

use super::CutRock;
use crate::lint::{Code, Diagnostic};

/// Inertia that is added to a region, relative to its mass, above which a warning is issued.
const MUCH_INERTIA: f64 = 0.01;

impl CutRock {
    /// Inertia that thin cells and sharp corners add to each region, relative to its mass.
    #[must_use]
    pub fn added_inertia(&self) -> Vec<f64> {
        let of = |region: usize| {
            let cells = self.cells_of(region);
            let parts = cells.iter().flat_map(|&cell| self.inertia(cell, &self.parts(cell)));
            let added: f64 = parts.map(|[factor, volume]| (factor - 1.0) * volume).sum();
            added / cells.iter().map(|&cell| self.properties[cell].volume).sum::<f64>()
        };
        (0..self.regions().len()).map(of).collect()
    }

    /// Warnings about the cells, which a run gives, too, unless the deck allows them. `added` is the
    /// [inertia](Self::added_inertia) added to each region.
    #[must_use]
    pub fn warnings(&self, added: &[f64]) -> Vec<Diagnostic> {
        let mut warnings = much_inertia(added);
        warnings.extend(self.deck.many_triangles());
        warnings.retain(|warning| self.deck.reports(warning));
        warnings
    }
}

/// Warnings about regions whose parts have much more inertia than mass, from the inertia added to each.
pub(in crate::build) fn much_inertia(added: &[f64]) -> Vec<Diagnostic> {
    let much = |(region, &share): (usize, &f64)| {
        (share > MUCH_INERTIA).then(|| {
            let message = format!(
                "thin cells and sharp corners have more inertia than mass: {:.1} % of the mass of the region is \
                 added",
                100.0 * share
            );
            let help = "motions there are slower, rest is the same: `ddem cut` lists the cells; a smaller \
                        `small.width` adds less, with shorter time steps";
            let at = format!("region[{region}].small");
            Diagnostic::warning(Code::AddedInertia, at, message, help)
        })
    };
    added.iter().enumerate().filter_map(much).collect()
}
