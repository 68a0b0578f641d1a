//! Shapes of regions, as convex parts.

use ddem_core::problem::Vec3;
use ddem_cut::{CellComplex, Fracture, Outline, Polyhedron, RegionParts, ShapeError, prism};

use crate::build::geometry::Solid;
use crate::schema::{AxisName, PrismShape, RockFile, RockRegion, Triangles};

/// Largest difference of the volume of the parts of a surface from that inside, relative to it.
const FILLED: f64 = 1e-6;

/// Convex parts of a region; an error comes with its key.
pub(crate) fn parts(region: &RockRegion) -> Result<RegionParts, (&'static str, ShapeError)> {
    if let Some(shape) = &region.bounds {
        let (from, to) = (Vec3::from(shape.from), Vec3::from(shape.to));
        return match Polyhedron::brick(from.inf(&to), from.sup(&to)) {
            Ok(part) => Ok(vec![part].into()),
            Err(error) => Err(("box", error)),
        };
    }
    if let Some(shape) = &region.prism {
        return along_axis(shape).map(Into::into).map_err(|error| ("prism", error));
    }
    match region.file.as_ref().and_then(|file| file.content.as_deref()) {
        Some(RockFile::Cells(file)) => {
            let (jointed, same) = (!region.join, 2.0 * Polyhedron::tolerance(file.diagonal()));
            let parts = file.cells().to_vec();
            return Ok(RegionParts { parts, jointed, coplanar: Some(same) });
        }
        Some(RockFile::Surface(surface)) => {
            return within(surface).map_err(|error| ("file", error));
        }
        None => {}
    }
    let faces = region.faces.iter().flatten();
    let faces: Vec<Vec<Vec3>> =
        faces.map(|face| face.iter().map(|corner| Vec3::from(*corner)).collect()).collect();
    match Polyhedron::from_faces(&faces) {
        Ok(part) => Ok(vec![part].into()),
        Err(error) => Err(("faces", error)),
    }
}

/// Convex parts of the inside of a closed surface: itself, or the cells that the planes of its
/// triangles make of the box around it.
fn within(surface: &Triangles) -> Result<RegionParts, ShapeError> {
    let mesh = surface.mesh();
    let points: Vec<Vec3> = mesh.points.iter().copied().map(Vec3::from).collect();
    let [low, high] = ddem_core::problem::bounds_of(&points);
    let same = Polyhedron::tolerance((high - low).norm());
    let corners = |corners: &[u32; 3]| corners.map(|corner| corner as usize).to_vec();
    let faces = mesh.triangles.iter().map(corners).collect();
    let whole = Polyhedron { points: points.clone(), faces }.with_whole_faces(same);
    if whole.check(same).is_ok() {
        return Ok(vec![whole].into());
    }
    let triangle = |corners: &[u32; 3]| {
        let corners = corners.map(|corner| points[corner as usize]);
        // Triangles without area have no plane.
        Fracture::polygon(&corners, 0, true).ok()
    };
    let triangles: Vec<Fracture> = mesh.triangles.iter().filter_map(triangle).collect();
    let mut rock = CellComplex::new(&[vec![Polyhedron::brick(low, high)?]]);
    rock.cut_surface(&triangles, vec![true]);
    let solid = Solid::new(&mesh, rock.tolerance());
    let inside = |cell: &usize| solid.contains(&rock.centroid(*cell));
    let parts: Vec<Polyhedron> =
        (0..rock.cells().len()).filter(inside).map(|cell| rock.polyhedron(cell)).collect();
    let (volume, own) = (mesh.volume(), parts.iter().map(Polyhedron::volume).sum::<f64>());
    if (own - volume).abs() > FILLED * volume {
        return Err(ShapeError::Undivided { volume, parts: own });
    }
    Ok(RegionParts { parts, jointed: false, coplanar: Some(2.0 * same) })
}

fn along_axis(shape: &PrismShape) -> Result<Vec<Polyhedron>, ShapeError> {
    let outline = Outline::new(&shape.outline)?;
    let ends = [shape.from, shape.to];
    match shape.axis {
        AxisName::X => prism(&outline, ends, |[y, z], x| Vec3::new(x, y, z)),
        // x, z and −y are right-handed.
        AxisName::Y => prism(&outline, ends.map(|end| -end), |[x, z], y| Vec3::new(x, -y, z)),
        AxisName::Z => prism(&outline, ends, |[x, y], z| Vec3::new(x, y, z)),
    }
}
