//! Regions of rock: from a deck to cells.

mod cuts;
mod shape;

pub(crate) use shape::parts;

use ddem_core::{ErrorCode, Fault, ModelError};
use ddem_cut::{CellComplex, CellProperties, MatchedFace, PlaneSource, Polyhedron};

use crate::schema::{Body, Deck, RockRegion};

/// Cells of the regions of a deck after all its cuts.
#[derive(Clone, Debug)]
pub struct CutRock {
    deck: Deck,
    /// Points, planes and cells.
    pub complex: CellComplex,
    /// Sizes of the cells.
    pub properties: Vec<CellProperties>,
    /// Faces that two cells share.
    pub matched: Vec<MatchedFace>,
    /// Block of each cell: cells that are joined form one.
    pub blocks: Vec<u32>,
}

impl Deck {
    /// Cuts the regions of a deck.
    ///
    /// # Errors
    ///
    /// All mistakes of the regions and cuts; each [`Fault`] names the key it is about.
    pub fn cut_regions(&self) -> Result<CutRock, ModelError> {
        let faults = crate::check::check_cuts(self);
        if !faults.is_empty() {
            return Err(ModelError { faults });
        }
        let shapes: Result<Vec<Vec<Polyhedron>>, _> = self.region.iter().map(parts).collect();
        let shapes = shapes.map_err(|(key, error)| {
            ModelError::from(Fault::new(ErrorCode::InvalidGeometry, key, error.to_string()))
        })?;
        let complex = cuts::cut(self, &shapes).map_err(|faults| ModelError { faults })?;
        let properties = (0..complex.cells().len()).map(|cell| complex.properties(cell)).collect();
        let matched = complex.matched_faces();
        let blocks = complex.blocks(&matched);
        let rock = CutRock { deck: self.clone(), complex, properties, matched, blocks };
        let faults = rock.corners();
        if faults.is_empty() { Ok(rock) } else { Err(ModelError { faults }) }
    }
}

impl CutRock {
    /// Region of a cell.
    #[must_use]
    pub fn region(&self, cell: usize) -> &RockRegion {
        &self.deck.region[self.complex.cells()[cell].region as usize]
    }

    /// Name of the region of a cell, or its place in the deck if it has none.
    #[must_use]
    pub fn region_name(&self, cell: usize) -> String {
        let number = self.complex.cells()[cell].region as usize;
        name_of("region", number, self.deck.region[number].name.as_ref())
    }

    /// Name of a cut, or its place in the deck if it has none.
    #[must_use]
    pub fn cut_name(&self, cut: u32) -> String {
        let number = cut as usize;
        name_of("cut", number, self.deck.cut.get(number).and_then(|cut| cut.name.as_ref()))
    }

    /// Number of cells of each region.
    #[must_use]
    pub fn cells_of(&self, region: usize) -> Vec<usize> {
        let of = |&cell: &usize| self.complex.cells()[cell].region as usize == region;
        (0..self.complex.cells().len()).filter(of).collect()
    }

    /// Regions of the deck.
    #[must_use]
    pub fn regions(&self) -> &[RockRegion] {
        &self.deck.region
    }

    /// Width of the cells in the middle of the volume of a region `[m]`: as much of it is in thinner
    /// cells as in wider ones.
    #[must_use]
    pub fn median_width(&self, region: usize) -> f64 {
        let mut sizes: Vec<(f64, f64)> = self
            .cells_of(region)
            .into_iter()
            .map(|cell| (self.properties[cell].width, self.properties[cell].volume))
            .collect();
        sizes.sort_by(|a, b| a.0.total_cmp(&b.0));
        let half = sizes.iter().map(|(_, volume)| volume).sum::<f64>() / 2.0;
        let mut below = 0.0;
        let middle = sizes.iter().find(|(_, volume)| {
            below += volume;
            below >= half
        });
        middle.map_or(0.0, |(width, _)| *width)
    }

    /// Number of elements of a cell: `divisions`/2 along each half edge at each vertex, one for a
    /// rigid block.
    #[must_use]
    pub fn n_elements(&self, cell: usize) -> usize {
        let region = self.region(cell);
        match region.body {
            Body::Rigid => 1,
            Body::Deformable => {
                let vertices = self.complex.cells()[cell].vertices().len();
                vertices * (region.divisions as usize / 2).pow(3)
            }
        }
    }

    /// Faults of divisions that do not suit corners with more than three edges.
    fn corners(&self) -> Vec<Fault> {
        let fits =
            |region: &RockRegion| region.body == Body::Rigid || region.divisions.is_power_of_two();
        let odd = |cell: &usize| {
            // In a polyhedron whose corners all have three edges, 2E = 3V.
            let cell = &self.complex.cells()[*cell];
            2 * cell.n_edges() != 3 * cell.vertices().len()
        };
        let regions = self.deck.region.iter().enumerate().filter(|(_, region)| !fits(region));
        let faults = regions.filter_map(|(number, region)| {
            let cell = self.cells_of(number).into_iter().find(odd)?;
            let message = format!(
                "block {cell} has a corner of more than three edges, which {} divisions do not fit",
                region.divisions
            );
            let near = region.divisions.next_power_of_two();
            let help = format!("a power of two, as in `divisions = {near}`");
            let place = format!("region[{number}].divisions");
            Some(Fault::new(ErrorCode::OutOfRange, place, message).help(help))
        });
        faults.collect()
    }

    /// Cuts whose planes bound a cell, by name, separated by spaces.
    #[must_use]
    pub fn cut_by(&self, cell: usize) -> String {
        let names = self.complex.cuts_of(cell).into_iter().map(|cut| self.cut_name(cut));
        names.collect::<Vec<_>>().join(" ")
    }

    /// True if a matched face is a joint.
    #[must_use]
    pub fn is_joint(&self, face: &MatchedFace) -> bool {
        let plane = &self.complex.planes()[face.plane as usize];
        !plane.joined && plane.source != PlaneSource::Region
    }
}

fn name_of(section: &str, number: usize, name: Option<&String>) -> String {
    name.cloned().unwrap_or_else(|| format!("{section}[{number}]"))
}
