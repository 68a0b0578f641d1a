//! Rigid motions that supports leave free.

use nalgebra::{Matrix6, Vector6};

use crate::model::conditions::ActiveConditions;
use ddem_mesh::connected::connected;
use ddem_mesh::{Geometry, Vec3};

const AXES: [&str; 3] = ["x", "y", "z"];

/// A rigid motion that supports leave free.
#[derive(Clone, Debug)]
pub struct FreeMotion {
    /// A block of the group that moves; `None` if all blocks are one group.
    pub block: Option<usize>,
    /// Translations and rotations, in words.
    pub motions: Vec<String>,
}

/// Rigid motions of the first group of connected blocks that the supports in force leave free. With
/// `contacts`, sets that touch are one group.
pub(crate) fn free_motion(
    geometry: &Geometry,
    active: &ActiveConditions,
    contacts: bool,
) -> Option<FreeMotion> {
    let groups = connected(geometry, contacts);
    let n_groups = groups.iter().max().map_or(0, |g| g + 1);
    let extents = extents(geometry, &groups, n_groups);
    let mut grams = vec![Matrix6::<f64>::zeros(); n_groups];
    for (node, axis) in active.held() {
        let (block, at) = geometry.locate(node as usize);
        let (centre, size) = extents[groups[block]];
        let arm = (geometry.position(block, at) - centre) / size;
        let direction = Vec3::ith(axis, 1.0);
        let turn = arm.cross(&direction);
        let row = Vector6::new(direction.x, direction.y, direction.z, turn.x, turn.y, turn.z);
        grams[groups[block]] += row * row.transpose();
    }
    let (group, motions) = grams.iter().enumerate().find_map(|(group, gram)| {
        let motions = null_motions(gram);
        (!motions.is_empty()).then_some((group, motions))
    })?;
    let (centre, size) = extents[group];
    let first = || groups.iter().position(|&g| g == group).unwrap_or(0);
    let block = (n_groups > 1).then(first);
    Some(FreeMotion { block, motions: describe(&motions, &centre, size) })
}

/// Centre and half size of each group, to which rotations are scaled.
fn extents(geometry: &Geometry, groups: &[usize], n_groups: usize) -> Vec<(Vec3, f64)> {
    let nothing = (Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY));
    let mut bounds = vec![nothing; n_groups];
    for (block, &group) in groups.iter().enumerate() {
        for x in geometry.corners(block) {
            bounds[group] = (bounds[group].0.inf(&x), bounds[group].1.sup(&x));
        }
    }
    let extent = |(low, high): (Vec3, Vec3)| {
        ((low + high) / 2.0, (high - low).norm().max(f64::MIN_POSITIVE) / 2.0)
    };
    bounds.into_iter().map(extent).collect()
}

/// Orthonormal motions (translation, rotation) that no support resists.
fn null_motions(gram: &Matrix6<f64>) -> Vec<Vector6<f64>> {
    let eigen = gram.symmetric_eigen();
    let most = eigen.eigenvalues.max();
    let free = |k: &usize| eigen.eigenvalues[*k] <= 1e-10 * most;
    (0..6).filter(free).map(|k| eigen.eigenvectors.column(k).into_owned()).collect()
}

fn describe(motions: &[Vector6<f64>], centre: &Vec3, size: f64) -> Vec<String> {
    let translation = |v: &Vector6<f64>| Vec3::new(v[0], v[1], v[2]);
    let rotation = |v: &Vector6<f64>| Vec3::new(v[3], v[4], v[5]);
    let has = |required: &Vector6<f64>| {
        let inside: Vector6<f64> = motions.iter().map(|m| m * m.dot(required)).sum();
        (inside - required).norm() < 1e-6
    };
    let mut names = Vec::new();
    for (k, axis) in AXES.iter().enumerate() {
        if has(&Vector6::ith(k, 1.0)) {
            names.push(format!("translation along {axis}"));
        }
    }
    // A rotation about an axis parallel to x, y or z, at any position.
    for (k, axis) in AXES.iter().enumerate() {
        let turns =
            nalgebra::Matrix3xX::from_columns(&motions.iter().map(&rotation).collect::<Vec<_>>());
        let required = Vec3::ith(k, 1.0);
        let Ok(inverse) = turns.clone().pseudo_inverse(1e-8) else { continue };
        let share = inverse * required;
        if (&turns * &share - required).norm() < 1e-6 {
            let shift: Vec3 =
                motions.iter().zip(share.iter()).map(|(m, s)| translation(m) * *s).sum();
            let through = centre + required.cross(&shift) * size;
            // Adding 0 avoids −0 from rounding.
            let through = through.map(|x| (x * 1e4).round() / 1e4 + 0.0);
            names.push(format!(
                "rotation about {axis} through ({:.4}, {:.4}, {:.4})",
                through.x, through.y, through.z
            ));
        }
    }
    if names.is_empty() {
        let named = |m: &Vector6<f64>| oblique(&translation(m), &rotation(m), centre, size);
        names.extend(motions.iter().map(named));
    }
    names
}

/// Words for a motion that is parallel to none of the axes: a translation, a rotation, or both along
/// one axis. The rotation is that over `size`, so that both have the same unit.
fn oblique(translation: &Vec3, rotation: &Vec3, centre: &Vec3, size: f64) -> String {
    let small = 1e-6 * (translation.norm() + rotation.norm());
    let turns = rotation.norm() > small;
    let along = if turns { rotation } else { translation }.normalize();
    // The first component that is not 0 is positive.
    let sign = along.iter().find(|x| x.abs() > 1e-6).map_or(1.0, |x| x.signum());
    let shown = |v: Vec3, digits: f64| v.map(|x| (x * digits).round() / digits + 0.0);
    let axis = shown(along * sign, 1e3);
    let axis = format!("({:.3}, {:.3}, {:.3})", axis.x, axis.y, axis.z);
    if !turns {
        return format!("translation along {axis}");
    }
    let through =
        shown(centre + rotation.cross(translation) * (size / rotation.norm_squared()), 1e4);
    let slides = translation.dot(&along).abs() > small;
    let more = if slides { ", with a translation along it" } else { "" };
    format!(
        "rotation about {axis} through ({:.4}, {:.4}, {:.4}){more}",
        through.x, through.y, through.z
    )
}
