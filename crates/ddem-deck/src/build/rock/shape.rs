//! Shapes of regions, as convex parts.

use ddem_core::problem::Vec3;
use ddem_cut::{Outline, Polyhedron, ShapeError, prism};

use crate::schema::{AxisName, PrismShape, RockRegion};

/// Convex parts of a region; an error comes with its key.
pub(crate) fn parts(region: &RockRegion) -> Result<Vec<Polyhedron>, (&'static str, ShapeError)> {
    if let Some(shape) = &region.bounds {
        let (from, to) = (Vec3::from(shape.from), Vec3::from(shape.to));
        return match Polyhedron::brick(from.inf(&to), from.sup(&to)) {
            Ok(part) => Ok(vec![part]),
            Err(error) => Err(("box", error)),
        };
    }
    if let Some(shape) = &region.prism {
        return along_axis(shape).map_err(|error| ("prism", error));
    }
    let faces = region.faces.iter().flatten();
    let faces: Vec<Vec<Vec3>> =
        faces.map(|face| face.iter().map(|corner| Vec3::from(*corner)).collect()).collect();
    match Polyhedron::from_faces(&faces) {
        Ok(part) => Ok(vec![part]),
        Err(error) => Err(("faces", error)),
    }
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
