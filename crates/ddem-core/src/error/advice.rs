//! Causes and remedies in the messages of run errors.

use std::fmt::Display;

use super::{FastestBlock, MovingBlock};

/// Likely cause of a block that moves too fast.
pub(super) fn block_too_fast(driven: Option<usize>) -> String {
    driven.map_or_else(
        || {
            "use a shorter `time_step`; the usual cause of such a speed is an excessive load"
                .to_owned()
        },
        |fix| {
            format!("its support, fix[{fix}], moves it: use a smaller `velocity` or a shorter `time_step`")
        },
    )
}

/// Likely cause of an excessive penetration.
pub(super) fn deep_penetration(driven: Option<(usize, usize)>, relaxes: bool) -> String {
    match driven {
        Some((fix, block)) => format!(
            "the support fix[{fix}] drives block {block} into the other: use a smaller `velocity`, or end \
             the motion earlier"
        ),
        None if relaxes => {
            "the contact is too soft for the weight on it: check the units of `young` (Pa), `density` (kg/m³) and \
             lengths (m), or increase `normal_stiffness` in `[contact]`; use a dynamic stage for blocks that nothing \
             supports"
                .to_owned()
        }
        None => "the contact is too soft to stop a block as fast or as heavy: check the units of `young` (Pa), \
                 velocities (m/s) and lengths (m), or increase `normal_stiffness` in `[contact]`"
            .to_owned(),
    }
}

/// Cause of the rounding forces: the last digit of displacements.
pub(super) fn stiff(joint: Option<&(String, f64)>, force: f64) -> String {
    let what = joint.map_or_else(String::new, |(name, thickness)| match thickness {
        0.0 => format!(" with its springs of joint `{name}`"),
        _ => format!(" with its joint `{name}`, {thickness:e} m thick"),
    });
    format!("{what}, where rounding of a displacement causes {force:.0e} N")
}

/// Largest tolerance that still gives a useful equilibrium.
const LOOSEST: f64 = 0.01;

/// Ways to an unbalanced `ratio` below the tolerance: a larger tolerance, or another joint.
pub(super) fn less_rounding(ratio: f64, tolerance: f64, joint: Option<&(String, f64)>) -> String {
    let missing = 3.0 * ratio / tolerance;
    let joint = match joint {
        // A change by a larger factor would make it a different joint.
        Some((_, thickness)) if missing < 3e4 => Some(match thickness {
            0.0 => format!("make the springs of this joint {missing:.0e} times as soft"),
            _ => format!("make this joint {:.0e} m thick", missing * thickness),
        }),
        _ => None,
    };
    let tolerance = 3.0 * ratio;
    let tolerance = (tolerance < LOOSEST).then(|| format!("use a tolerance of {tolerance:.0e}"));
    let ways: Vec<String> = tolerance.into_iter().chain(joint).collect();
    if ways.is_empty() {
        "make the stiffest joints and contacts softer".to_owned()
    } else {
        ways.join(", or ")
    }
}

/// Fastest block of an unfinished relaxation.
pub(super) fn moving(fastest: Option<&FastestBlock>) -> String {
    fastest.map_or_else(String::new, |FastestBlock { block, set, speed }| {
        format!("; block {block} (set `{set}`) moves most, {speed:.1e} m in the last step")
    })
}

/// Largest number of blocks that a message names.
const NAMED: usize = 3;

/// Moving blocks, for a message.
pub(super) fn named(moving: &[MovingBlock]) -> String {
    if moving.is_empty() {
        return "no block has moved so far".to_owned();
    }
    let each = moving.iter().take(NAMED).map(
        |MovingBlock { set, block, distance, direction: [x, y, z] }| {
            format!(
                "block {block} (set `{set}`), {distance:.2e} m towards ({x:.2}, {y:.2}, {z:.2})"
            )
        },
    );
    let more = if moving.len() > NAMED { ", ..." } else { "" };
    let verb = if moving.len() == 1 { "keeps" } else { "keep" };
    let blocks = counted(moving.len(), "block");
    format!("{blocks} {verb} moving: {}{more}", each.collect::<Vec<_>>().join("; "))
}

/// Number of failed pairs, for a message.
pub(super) fn after(failed: u64) -> String {
    if failed == 0 {
        return String::new();
    }
    format!(", after the failure of {}", counted(failed, "pair"))
}

/// Number of things that have numbers from 0.
pub(crate) fn numbered(count: usize) -> String {
    if count == 0 { "none".to_owned() } else { format!("{count}, numbered from 0") }
}

/// Number of things with their noun, in the plural unless there is one.
#[doc(hidden)]
pub fn counted<N: Display + PartialEq + From<u8>>(number: N, noun: &str) -> String {
    if number == N::from(1) { format!("1 {noun}") } else { format!("{number} {noun}s") }
}

/// Likely cause of a relaxation that takes too long.
pub(super) fn hint(ratio: f64, failed: u64) -> String {
    match (ratio > 1.0, failed) {
        (true, _) => {
            "; the motion grows: use more `increments`, or a damped dynamic stage".to_owned()
        }
        (false, 0) => String::new(),
        (false, failed) => {
            format!("; after the failure of {}, blocks may still move", counted(failed, "pair"))
        }
    }
}
