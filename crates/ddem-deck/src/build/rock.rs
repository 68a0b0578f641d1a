//! Regions of rock: from a deck to cells.

mod assigned;
mod beside;
mod blocks;
mod cuts;
mod fractures;
mod ground;
mod inside;
mod joined;
mod joints;
mod planes;
mod region_cut;
mod shape;
mod shapes;
mod stability;
mod thick;
mod ties;
mod too_many;
mod walls;
mod warnings;

pub(in crate::build) use assigned::AssignedRock;
pub(in crate::build) use blocks::RockBlocks;
pub use fractures::RockFracture;
pub use planes::RockPlane;
pub(crate) use shape::parts;
pub use stability::{BlockMode, BlockVerdict};
pub(in crate::build) use walls::{CellWalls, cell_face};
pub(in crate::build) use warnings::much_inertia;

use std::collections::BTreeSet;

use ddem_core::element::Elastic;
use ddem_core::problem::{Vec3, stiffest_nodes};
use ddem_core::{ErrorCode, Fault, ModelError};
use ddem_cut::{CellComplex, CellPart, CellProperties, CommonFace, ON_PLANE, RegionParts};

use self::joined::FaceSides;
use super::{BuildPhase, BuildProgress};
use crate::schema::{Body, Deck, RockRegion, Size, SmallKind};

/// Cells of the regions of a deck after all its cuts.
#[derive(Clone, Debug)]
pub struct CutRock {
    deck: Deck,
    /// Points, planes and cells.
    pub complex: CellComplex,
    /// Sizes of the cells.
    pub properties: Vec<CellProperties>,
    /// Faces that two cells have in common.
    pub common: Vec<CommonFace>,
    /// Block of each cell: cells that are joined form one.
    pub blocks: Vec<u32>,
    /// Discs and polygons of the cuts, in their order.
    pub fractures: Vec<RockFracture>,
    /// Joints that each entry of `[[join]]` leaves out.
    left_out: Vec<BTreeSet<FaceSides>>,
    /// Cells of each region.
    of_region: Vec<Vec<usize>>,
    /// Width of the cells in the middle of the volume of each region `[m]`.
    median_widths: Vec<f64>,
    /// Width of the widest cell of each block `[m]`.
    block_widths: Vec<f64>,
}

impl Deck {
    /// Cuts the regions of a deck.
    ///
    /// # Errors
    ///
    /// All mistakes of the regions, cuts and joins; each [`Fault`] names the key it is about.
    pub fn cut_regions(&self) -> Result<CutRock, ModelError> {
        self.cut_regions_with_progress(&BuildProgress::default())
    }

    /// As [`cut_regions`](Self::cut_regions), with the progress for other threads.
    ///
    /// # Errors
    ///
    /// Those of [`cut_regions`](Self::cut_regions).
    pub fn cut_regions_with_progress(
        &self,
        progress: &BuildProgress,
    ) -> Result<CutRock, ModelError> {
        let faults = crate::check::check_cuts(self);
        if !faults.is_empty() {
            return Err(ModelError { faults });
        }
        self.with_tunnels().with_grounds().cut_checked(u64::MAX, progress)
    }

    /// Fault of regions whose model would need more memory than the `available` `[bytes]`, before
    /// anything is cut; `None` without regions.
    ///
    /// # Errors
    ///
    /// The shape of a region has a mistake.
    pub fn beyond_memory(&self, available: u64) -> Result<Option<Fault>, ModelError> {
        if self.region.is_empty() {
            return Ok(None);
        }
        let deck = self.with_tunnels();
        let (cells, place) = cuts::expected(&deck, &deck.shapes()?);
        let size = Size::of_cells(cells, least_divisions(self));
        Ok((size.bytes > available as f64).then(|| {
            let message = format!(
                "the cuts would make about {cells:.1e} cells, which need about {:.1} GB of memory; {:.1} GB is \
                 available",
                1e-9 * size.bytes,
                1e-9 * available as f64
            );
            let help = "wider spacings or fewer seeds make fewer cells; fewer `divisions` need less";
            Fault::new(ErrorCode::OutOfMemory, place, message).help(help)
        }))
    }

    /// Shapes of the regions.
    fn shapes(&self) -> Result<Vec<RegionParts>, ModelError> {
        let of = |(number, region): (usize, &RockRegion)| {
            parts(region).map_err(|(key, error)| {
                let place = format!("region[{number}].{key}");
                let fault = Fault::new(ErrorCode::InvalidGeometry, place, error.to_string());
                ModelError::from(fault.help(crate::check::remedy(&error)))
            })
        };
        self.region.iter().enumerate().map(of).collect()
    }

    /// Cuts the regions of a deck without mistakes, into no more cells than the `available` memory holds as blocks
    /// `[bytes]`; no cells without regions.
    pub(in crate::build) fn cut_checked(
        &self,
        available: u64,
        progress: &BuildProgress,
    ) -> Result<CutRock, ModelError> {
        let shapes = self.shapes()?;
        let faults = overlaps(self, &shapes);
        if !faults.is_empty() {
            return Err(ModelError { faults });
        }
        let (complex, fractures) = cuts::cut(self, &shapes, available, progress)
            .map_err(|faults| ModelError { faults })?;
        progress.enter(BuildPhase::Blocks);
        CutRock::new(self.clone(), complex, fractures)
    }
}

/// Smallest number of elements along the edges of a block of regions.
fn least_divisions(deck: &Deck) -> f64 {
    deck.region.iter().map(|region| region.divisions).min().map_or(2.0, f64::from)
}

/// Faults of regions that have rock in common.
fn overlaps(deck: &Deck, shapes: &[RegionParts]) -> Vec<Fault> {
    let parts = || shapes.iter().flat_map(|shape| &shape.parts);
    let corners = || parts().flat_map(|part| &part.points);
    let largest = corners().fold(0.0_f64, |largest, corner| largest.max(corner.amax()));
    let margin = ON_PLANE * largest;
    let mut faults = Vec::new();
    for (number, shape) in shapes.iter().enumerate() {
        let meets = |other: &&usize| {
            let others = &shapes[**other].parts;
            shape.parts.iter().any(|one| others.iter().any(|other| one.overlaps(other, margin)))
        };
        let earlier: Vec<usize> = (0..number).collect();
        if let Some(&other) = earlier.iter().find(meets) {
            let name = name_of("region", other, deck.region[other].name.as_ref());
            let message = format!("the region overlaps `{name}`");
            let help = "regions may share faces, but no rock";
            let place = format!("region[{number}]");
            faults.push(Fault::new(ErrorCode::InvalidGeometry, place, message).help(help));
        }
    }
    faults
}

/// Ratio of stiffness to mass that a node of a distorted part may have, relative to that of a cube.
/// Single nodes with less hardly limit the step.
const SPREAD: f64 = 4.0;

impl CutRock {
    fn new(
        deck: Deck,
        complex: CellComplex,
        fractures: Vec<RockFracture>,
    ) -> Result<Self, ModelError> {
        let n = complex.cells().len();
        let properties: Vec<_> = (0..n).map(|cell| complex.properties(cell)).collect();
        let common = complex.common_faces();
        let mut of_region = vec![Vec::new(); deck.region.len()];
        for (number, cell) in complex.cells().iter().enumerate() {
            of_region[cell.region as usize].push(number);
        }
        let median_widths =
            of_region.iter().map(|cells: &Vec<usize>| median_width(cells, &properties)).collect();
        let mut rock = Self {
            deck,
            complex,
            properties,
            common,
            blocks: Vec::new(),
            fractures,
            left_out: Vec::new(),
            of_region,
            median_widths,
            block_widths: vec![0.0; n],
        };
        rock.left_out = rock.find_left_out()?;
        rock.blocks = rock.complex.blocks_where(&rock.common, |face| rock.is_joined(face));
        for (properties, &block) in rock.properties.iter().zip(&rock.blocks) {
            let widest = &mut rock.block_widths[block as usize];
            *widest = widest.max(properties.width);
        }
        Ok(rock)
    }

    /// Region of a cell.
    #[must_use]
    pub fn region(&self, cell: usize) -> &RockRegion {
        &self.deck.region[self.region_number(cell)]
    }

    /// Name of a region, or its place in the deck if it has none.
    #[must_use]
    pub fn region_name(&self, region: usize) -> String {
        name_of("region", region, self.deck.region[region].name.as_ref())
    }

    /// Numbers of the cells of a region.
    #[must_use]
    pub fn cells_of(&self, region: usize) -> &[usize] {
        &self.of_region[region]
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
        self.median_widths[region]
    }

    /// Width below which cells of the region of a cell are thin `[m]`.
    fn thin_width(&self, cell: usize) -> f64 {
        self.region(cell).small.width * self.median_widths[self.region_number(cell)]
    }

    /// Width of the widest cell of the block of a cell `[m]`.
    fn block_width(&self, cell: usize) -> f64 {
        self.block_widths[self.blocks[cell] as usize]
    }

    fn is_thin(&self, cell: usize) -> bool {
        self.properties[cell].width < self.thin_width(cell)
    }

    /// Treatment of a cell that is thin; `None` if it is not. A thin cell that is joined to a wider one
    /// cannot be rigid, and is scaled instead.
    #[must_use]
    pub fn treatment(&self, cell: usize) -> Option<SmallKind> {
        if !self.is_thin(cell) {
            return None;
        }
        let kind = self.region(cell).small.is;
        let joined = kind == SmallKind::Rigid && !self.is_rigid(cell);
        Some(if joined { SmallKind::Scaled } else { kind })
    }

    /// True for a cell of a rigid block.
    #[must_use]
    pub fn is_rigid(&self, cell: usize) -> bool {
        let RockRegion { small, body, .. } = self.region(cell);
        let is_thin = || self.block_width(cell) < self.thin_width(cell);
        *body == Body::Rigid || (small.is == SmallKind::Rigid && is_thin())
    }

    /// Number of elements along each edge of the parts of a cell.
    #[must_use]
    pub fn divisions(&self, cell: usize) -> usize {
        if self.is_rigid(cell) { 1 } else { self.region(cell).divisions as usize / 2 }
    }

    /// Parts of a cell.
    #[must_use]
    pub fn parts(&self, cell: usize) -> Vec<CellPart> {
        self.complex.parts(cell, self.divisions(cell))
    }

    /// Factors on the inertia of the parts of a cell, but not on their weight, and the volumes of the
    /// parts `[m³]`. A factor is at least 1, and so large that no node of the part has more than four
    /// times the ratio of stiffness to mass of a cube of the width `small.width` times the median one. All
    /// of a rigid block has that of the ratio of the two widths, squared: the springs of its joints and
    /// contacts are as stiff over its mass.
    #[must_use]
    pub fn inertia(&self, cell: usize, parts: &[CellPart]) -> Vec<[f64; 2]> {
        let region = self.region(cell);
        let width = self.thin_width(cell);
        let scaled = region.small.is != SmallKind::Removed;
        let of_body = self.is_rigid(cell).then(|| (width / self.block_width(cell)).powi(2));
        let material = self.deck.materials.get(&region.material);
        let rock = material.map_or(Elastic::new(1.0, 1.0, 0.0), |material| {
            Elastic::new(material.density, material.young, material.poisson)
        });
        let nodes =
            |hexahedra: &[[Vec3; 8]]| stiffest_nodes(hexahedra, &rock, self.deck.model.element);
        let parts: Vec<[Vec3; 8]> = parts.iter().map(|part| part.corners).collect();
        // The parts of a cube have half its edges.
        let cube = [
            [0, 0, 0],
            [1, 0, 0],
            [1, 1, 0],
            [0, 1, 0],
            [0, 0, 1],
            [1, 0, 1],
            [1, 1, 1],
            [0, 1, 1],
        ]
        .map(|at| Vec3::from(at.map(f64::from)) * (0.5 * width));
        let allowed = SPREAD * nodes(&[cube])[0][0];
        let factor = |[ratio, volume]: [f64; 2]| {
            let factor = of_body.unwrap_or(ratio / allowed);
            [if scaled && factor.is_finite() { factor.max(1.0) } else { 1.0 }, volume]
        };
        nodes(&parts).into_iter().map(factor).collect()
    }

    fn region_number(&self, cell: usize) -> usize {
        self.complex.cells()[cell].region as usize
    }

    /// Number of elements of a cell: `divisions`/2 along each edge of its parts, one in each part of a
    /// rigid block.
    #[must_use]
    pub fn n_elements(&self, cell: usize) -> usize {
        if self.treatment(cell) == Some(SmallKind::Removed) {
            return 0;
        }
        self.parts(cell).len() * self.divisions(cell).pow(3)
    }

    /// Area of all faces of a cell `[m²]`.
    #[must_use]
    pub fn surface(&self, cell: usize) -> f64 {
        let faces = &self.complex.cells()[cell].faces;
        faces.iter().map(|face| face.area(self.complex.points()).norm()).sum()
    }

    /// Names of the cuts whose planes bound a cell, or their places in the deck.
    #[must_use]
    pub fn cut_names(&self, cell: usize) -> Vec<String> {
        self.complex.cuts_of(cell).into_iter().map(|cut| self.cut_name(cut)).collect()
    }

    /// Name of a cut, or its place in the deck if it has none.
    #[must_use]
    pub fn cut_name(&self, cut: u32) -> String {
        let number = cut as usize;
        name_of("cut", number, self.deck.cut.get(number).and_then(|cut| cut.name.as_ref()))
    }
}

fn median_width(cells: &[usize], properties: &[CellProperties]) -> f64 {
    let size = |&cell: &usize| (properties[cell].width, properties[cell].volume);
    let mut sizes: Vec<(f64, f64)> = cells.iter().map(size).collect();
    sizes.sort_by(|a, b| a.0.total_cmp(&b.0));
    let half = sizes.iter().map(|(_, volume)| volume).sum::<f64>() / 2.0;
    let mut below = 0.0;
    let middle = sizes.iter().find(|(_, volume)| {
        below += volume;
        below >= half
    });
    middle.map_or(0.0, |(width, _)| *width)
}

fn name_of(section: &str, number: usize, name: Option<&String>) -> String {
    name.cloned().unwrap_or_else(|| format!("{section}[{number}]"))
}
