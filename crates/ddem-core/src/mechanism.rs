//! Rigid-body motions that the supports of a relax stage leave free.

use nalgebra::{Matrix6, Vector6};

use crate::deck::StageKind;
use crate::error::Fault;
use crate::geometry::Vec3;
use crate::model::Model;

const AXES: [&str; 3] = ["x", "y", "z"];

/// A fault for each relax stage in which a group of joined blocks can move as a rigid body.
pub(crate) fn check(model: &Model) -> Vec<Fault> {
    let stages = model.deck.stage.iter().enumerate();
    let relax = stages.filter(|(_, stage)| stage.kind == StageKind::Relax);
    relax.filter_map(|(index, stage)| free_motion(model, index, &stage.name)).collect()
}

fn free_motion(model: &Model, stage: usize, name: &str) -> Option<Fault> {
    let groups = groups(model);
    let n_groups = groups.iter().max().map_or(0, |g| g + 1);
    let (centre, size) = extent(model);
    let mut grams = vec![Matrix6::<f64>::zeros(); n_groups];
    for (node, axis) in model.active(stage).held() {
        let arm = (Vec3::from(model.point(node as usize)) - centre) / size;
        let direction = Vec3::ith(axis, 1.0);
        let turn = arm.cross(&direction);
        let row = Vector6::new(direction.x, direction.y, direction.z, turn.x, turn.y, turn.z);
        grams[groups[model.block_of(node as usize)]] += row * row.transpose();
    }
    let (group, motions) = grams.iter().enumerate().find_map(|(group, gram)| {
        let motions = null_motions(gram);
        (!motions.is_empty()).then_some((group, motions))
    })?;
    let who = if n_groups == 1 {
        "the model".to_owned()
    } else {
        let block = groups.iter().position(|&g| g == group).unwrap_or(0);
        let body = &model.geometry.bodies[block];
        let set = body.set as usize;
        let set = model.deck.blocks[set].name.clone().unwrap_or_else(|| format!("blocks[{set}]"));
        format!("block {block} of the set `{set}`, with what is joined to it,")
    };
    Some(
        Fault::new(
            format!("stage[{stage}]"),
            format!(
                "the supports of relax stage `{name}` let {who} move as a rigid body: {}",
                describe(&motions, &centre, size).join(", ")
            ),
        )
        .help("hold that motion with [[fix]], or make the stage dynamic"),
    )
}

/// Group of each block: blocks joined by face joints are in one.
fn groups(model: &Model) -> Vec<usize> {
    let n = model.n_blocks();
    let mut groups = vec![usize::MAX; n];
    let mut count = 0;
    for start in 0..n {
        if groups[start] != usize::MAX {
            continue;
        }
        let mut open = vec![start];
        groups[start] = count;
        while let Some(body) = open.pop() {
            for (d, side) in (0..3).flat_map(|d| [(d, -1), (d, 1)]) {
                let mut offset = [0; 3];
                offset[d] = side;
                if let Some(other) = model.geometry.neighbour(body, offset)
                    && groups[other] == usize::MAX
                {
                    groups[other] = count;
                    open.push(other);
                }
            }
        }
        count += 1;
    }
    groups
}

fn extent(model: &Model) -> (Vec3, f64) {
    let [low, high] = model.geometry.bounds;
    ((low + high) / 2.0, (high - low).norm().max(f64::MIN_POSITIVE) / 2.0)
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
    let has = |wanted: &Vector6<f64>| {
        let inside: Vector6<f64> = motions.iter().map(|m| m * m.dot(wanted)).sum();
        (inside - wanted).norm() < 1e-6
    };
    let mut names = Vec::new();
    for (k, axis) in AXES.iter().enumerate() {
        if has(&Vector6::ith(k, 1.0)) {
            names.push(format!("translation along {axis}"));
        }
    }
    // A turn about an axis parallel to x, y or z, wherever it passes.
    for (k, axis) in AXES.iter().enumerate() {
        let turns =
            nalgebra::Matrix3xX::from_columns(&motions.iter().map(&rotation).collect::<Vec<_>>());
        let wanted = Vec3::ith(k, 1.0);
        let Ok(inverse) = turns.clone().pseudo_inverse(1e-8) else { continue };
        let share = inverse * wanted;
        if (&turns * &share - wanted).norm() < 1e-6 {
            let shift: Vec3 =
                motions.iter().zip(share.iter()).map(|(m, s)| translation(m) * *s).sum();
            let through = centre + wanted.cross(&shift) * size;
            names.push(format!(
                "rotation about {axis} through ({:.4}, {:.4}, {:.4})",
                through.x, through.y, through.z
            ));
        }
    }
    if names.is_empty() {
        names.extend(motions.iter().map(|m| {
            let (t, r) = (translation(m), rotation(m) / size);
            format!(
                "translation ({:.3}, {:.3}, {:.3}) with rotation ({:.3}, {:.3}, {:.3})",
                t.x, t.y, t.z, r.x, r.y, r.z
            )
        }));
    }
    names
}
