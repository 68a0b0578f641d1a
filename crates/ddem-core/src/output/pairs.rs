//! Fields at the pairs of joints.

use std::ops::Range;

use super::Snapshot;
use ddem_joint::point::PairFailure;
use ddem_mechanics::law::{FailureMode, PointState};
use ddem_mesh::Vec3;

/// Writes the mean displacement of both sides.
pub(super) fn displacement(snapshot: &Snapshot<'_>, range: Range<usize>, out: &mut [f64]) {
    let (model, u) = (snapshot.model, &snapshot.state.u);
    model.fill_pairs(range, out, |joint| {
        let nodes = model.joint(joint).nodes(model);
        // The blocks are known; a search for the block of every node would take longer.
        let sides = model.joint(joint).blocks().map(|block| {
            let (pack, lane) = model.packs.slot(block);
            (3 * model.packs.packs[pack].start, model.nodes_of(block).start, lane)
        });
        move |pair| {
            let [a, b] = [0, 1].map(|side| {
                let (start, first, lane) = sides[side];
                let at = start + 3 * (nodes[pair][side] as usize - first);
                [0, 1, 2].map(|c| u[at + c].0[lane])
            });
            [0, 1, 2].map(|c| 0.5 * (a[c] + b[c]))
        }
    });
}

/// Writes the traction on the first node's side; 0 if a contact has replaced the joint.
pub(super) fn traction(snapshot: &Snapshot<'_>, range: Range<usize>, out: &mut [f64]) {
    let (rows, start) = (out.as_chunks_mut::<3>().0, range.start);
    rows.fill([0.0; 3]);
    snapshot.visit_pairs(range, |pair, view| rows[pair - start] = view.traction.into());
}

pub(super) fn slip(snapshot: &Snapshot<'_>, range: Range<usize>, out: &mut [f64]) {
    let (rows, start) = (out.as_chunks_mut::<3>().0, range.start);
    rows.fill([0.0; 3]);
    snapshot.visit_pairs(range, |pair, view| {
        if let Some(point) = view.point {
            let slip = point.state.slip;
            rows[pair - start] = (view.axes * Vec3::new(0.0, slip.x, slip.y)).into();
        }
    });
}

/// Writes the opening: dilation by slip over the roughness, plus the gap beyond it.
pub(super) fn opening(snapshot: &Snapshot<'_>, range: Range<usize>, out: &mut [f64]) {
    failed(snapshot, range, out, 0.0, |_, state| state.dilation + state.gap.max(0.0));
}

pub(super) fn failure_mode(snapshot: &Snapshot<'_>, range: Range<usize>, out: &mut [f64]) {
    let number = |mode| if mode == FailureMode::Tension { 2.0 } else { 1.0 };
    failed(snapshot, range, out, 0.0, |failure, _| number(failure.mode));
}

pub(super) fn open(snapshot: &Snapshot<'_>, range: Range<usize>, out: &mut [f64]) {
    failed(snapshot, range, out, 0.0, |_, state| f64::from(u8::from(state.gap > 0.0)));
}

pub(super) fn failure_time(snapshot: &Snapshot<'_>, range: Range<usize>, out: &mut [f64]) {
    failed(snapshot, range, out, f64::NAN, |failure, _| failure.time);
}

pub(super) fn damage(snapshot: &Snapshot<'_>, range: Range<usize>, out: &mut [f64]) {
    failed(snapshot, range, out, 0.0, |_, state| state.damage.min(1.0));
}

/// Writes `number` of each failed pair, and `bonded` for each other pair.
fn failed(
    snapshot: &Snapshot<'_>,
    range: Range<usize>,
    out: &mut [f64],
    bonded: f64,
    number: impl Fn(PairFailure, &PointState) -> f64 + Sync,
) {
    let number = &number;
    snapshot.model.fill_pairs(range, out, |joint| {
        let state = snapshot.joint_state(joint);
        move |pair| {
            let number = state.point(pair).and_then(|p| Some(number(p.failure?, &p.state)));
            [number.unwrap_or(bonded)]
        }
    });
}

/// Writes 1 if a contact has replaced the joint, otherwise 0.
pub(super) fn released(snapshot: &Snapshot<'_>, range: Range<usize>, out: &mut [f64]) {
    snapshot.model.fill_pairs(range, out, |joint| {
        let released = snapshot.joint_state(joint).is_released();
        move |_| [f64::from(u8::from(released))]
    });
}

/// Writes 1 at joints with a removed block, 0 at others.
pub(super) fn removed(snapshot: &Snapshot<'_>, range: Range<usize>, out: &mut [f64]) {
    let model = snapshot.model;
    model.fill_pairs(range, out, |joint| {
        let removed = model.joint(joint).blocks().iter().any(|&block| model.is_removed(block));
        move |_| [f64::from(u8::from(removed))]
    });
}
