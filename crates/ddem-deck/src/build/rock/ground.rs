//! Grounds: surfaces that cut, and by which the same deck selects.

use std::borrow::Cow;
use std::sync::Arc;

use ddem_core::problem::{Vec3, shown};
use ddem_core::{ErrorCode, Fault};
use ddem_cut::{CellComplex, Ground, HeightField, ON_PLANE};

use super::cuts;
use crate::lint::{Code, Diagnostic};
use crate::schema::{Deck, RockCut, Sheet, SurfaceFile, Triangles};

/// Default tolerance of a ground, relative to the diagonal of the regions.
const TOLERANCE: f64 = 0.005;

/// Share of the tolerance that the simplified ground takes. Cells that avoid thin parts have the rest.
const SIMPLIFIED: f64 = 0.75;

/// Number of triangles of other surfaces above which a warning is issued.
const MANY_TRIANGLES: usize = 500;

/// Ground of a cut in a box; `None` for other cuts, and for surfaces that a vertical line meets twice.
pub(super) fn ground(entry: &RockCut, number: u32, bounds: [Vec3; 2]) -> Option<Ground> {
    let field = match entry.surface.as_ref()?.content.as_deref()? {
        SurfaceFile::Triangles(triangles) => triangles.height_field()?,
        SurfaceFile::Heights(of) => HeightField::of_grid([&of.x, &of.y], &of.z, of.rim, bounds),
    };
    let diagonal = (bounds[1] - bounds[0]).norm();
    let tolerance = entry.tolerance.unwrap_or(TOLERANCE * diagonal);
    let simplified = field.within(bounds).simplified(SIMPLIFIED * tolerance);
    let distances = [ON_PLANE * diagonal, (1.0 - SIMPLIFIED) * tolerance];
    Some(Ground::new(simplified, number, entry.join, distances))
}

/// Ground of a cut that covers all cells that it is to cut; `None` for other cuts. Triangles that cover
/// only some of them, as those of a fault that ends in the rock, are no ground.
///
/// # Errors
///
/// A grid has no height over some of the cells.
pub(super) fn ground_over(
    rock: &CellComplex,
    entry: &RockCut,
    number: u32,
    bounds: [Vec3; 2],
    chosen: &[bool],
) -> Result<Option<Arc<Ground>>, Fault> {
    let Some(ground) = ground(entry, number, bounds) else { return Ok(None) };
    let Some(bare) = rock.uncovered(&ground, chosen) else { return Ok(Some(Arc::new(ground))) };
    let file = entry.surface.as_ref();
    if let Some(SurfaceFile::Triangles(_)) = file.and_then(|file| file.content.as_deref()) {
        return Ok(None);
    }
    let path = file.map_or("", |file| &file.path);
    let place = |x: f64| shown((1e3 * x).round() / 1e3);
    let message = format!(
        "the ground `{path}` has no height at x = {}, y = {}",
        place(bare.x),
        place(bare.y)
    );
    let help = "it must cover the regions: give a larger one, fill its gaps, or leave cells out by `where`";
    let at = format!("cut[{number}].surface");
    Err(Fault::new(ErrorCode::InvalidFile, at, message).help(help))
}

impl Deck {
    /// Same deck, whose topographies are the simplified grounds of the cuts with the same files.
    pub(crate) fn with_grounds(&self) -> Cow<'_, Self> {
        let names = |path: &str| {
            let all = self.selectors().into_iter();
            all.flat_map(|(_, of)| of.topographies()).any(|(_, file)| file.path == path)
        };
        let file = |cut: &RockCut| Some(cut.surface.as_ref()?.path.clone());
        let cuts =
            self.cut.iter().zip(0..).filter_map(|(cut, number)| Some((cut, number, file(cut)?)));
        let cuts: Vec<_> = cuts.filter(|(.., path)| names(path)).collect();
        // Beyond the regions sets of blocks need the heights of the file.
        let (false, true, Ok(shapes)) = (cuts.is_empty(), self.blocks.is_empty(), self.shapes())
        else {
            return Cow::Borrowed(self);
        };
        let bounds = cuts::bounds_of(&shapes);
        let grounds = cuts.into_iter().filter_map(|(cut, number, path)| {
            let ground = ground(cut, number, bounds)?;
            let field = ground.field();
            let corner = |corner: u32| field.points[corner as usize].into();
            let triangles = field.triangles.iter().map(|of| of.map(corner)).collect();
            Some((path, Arc::new(SurfaceFile::Triangles(Triangles(triangles)))))
        });
        let grounds: Vec<(String, Arc<SurfaceFile>)> = grounds.collect();
        let mut filled = self.clone();
        for (_, selector) in filled.selectors_mut() {
            for sheet in [&mut selector.above, &mut selector.below] {
                let Some(Sheet::Topography { topography }) = sheet else { continue };
                if let Some((_, ground)) = grounds.iter().find(|(path, _)| *path == topography.path)
                {
                    topography.content = Some(ground.clone());
                }
            }
        }
        Cow::Owned(filled)
    }

    /// Warnings about surfaces of many triangles that are no grounds.
    pub(in crate::build) fn many_triangles(&self) -> Vec<Diagnostic> {
        let Ok(shapes) = self.shapes() else { return Vec::new() };
        let [low, high] = cuts::bounds_of(&shapes);
        let warning = |(number, cut): (usize, &RockCut)| {
            let SurfaceFile::Triangles(triangles) = cut.surface.as_ref()?.content.as_deref()?
            else {
                return None;
            };
            let meets = |corners: &&[[f64; 3]; 3]| {
                (0..3).all(|k| {
                    let at = corners.map(|corner| corner[k]);
                    at.iter().any(|x| *x >= low[k]) && at.iter().any(|x| *x <= high[k])
                })
            };
            let count = triangles.0.iter().filter(meets).count();
            if count <= MANY_TRIANGLES || triangles.height_field().is_some() {
                return None;
            }
            let message = format!(
                "the planes of {count} triangles cut the regions one by one, which makes many thin cells"
            );
            let help = "coarsen the surface in the program that wrote it; one that each vertical line \
                        meets once at most is a ground, which is simplified";
            Some(Diagnostic::warning(
                Code::ManyTriangles,
                format!("cut[{number}].surface"),
                message,
                help,
            ))
        };
        self.cut.iter().enumerate().filter_map(warning).collect()
    }
}
