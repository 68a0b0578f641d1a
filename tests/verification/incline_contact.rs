//! V4: a block on an incline, in contact with its base.

use super::energy::closes;
use super::incline::{G, rate};
use super::record::Tolerance::{Absolute, Of, Relative};
use super::record::{Case, at_least, at_most, check, consistent, of};
use super::shared::{Run, edited, example, run};

/// Mass of the block `[kg]`.
const MASS: f64 = 150.0;

/// The deck with this kind of block; the base stays rigid.
pub(crate) fn body(text: &str, block: &str, kind: &str) -> String {
    let start = text.find(&format!("name = \"{block}\"")).expect("the block");
    let (before, after) = text.split_at(start);
    format!("{before}{}", after.replace("\"rigid\"", &format!("\"{kind}\"")))
}

/// Largest absolute value of a column from a time on.
pub(crate) fn largest(run: &Run, column: &str, from: f64) -> f64 {
    let late = run.probes.series(column).into_iter().filter(|[time, _]| *time >= from);
    late.fold(0.0, |most, [_, value]| most.max(value.abs()))
}

/// Difference between the largest and the smallest value of a column from a time on.
pub(crate) fn spread(run: &Run, column: &str, from: f64) -> f64 {
    let late = run.probes.series(column).into_iter().filter(|[time, _]| *time >= from);
    let (low, high) = late.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), [_, value]| {
        (low.min(value), high.max(value))
    });
    high - low
}

#[test]
fn block_in_contact_slides() {
    let case = of("v04_contact_slides");
    let (slope, friction) = (40_f64.to_radians(), 20_f64.to_radians());
    let resisting = G * slope.cos() * friction.tan();
    for kind in ["rigid", "deformable"] {
        let run = run(&body(&example(case.deck), "block", kind));
        let along = |name: &str| {
            let [x, z] = ["x", "z"].map(|c| run.probes.series(&format!("{name}.{c}")));
            let down = move |([t, x], [_, z]): ([f64; 2], [f64; 2])| {
                [t, x * slope.cos() - z * slope.sin(), x * slope.sin() + z * slope.cos()]
            };
            x.into_iter().zip(z).map(down).collect::<Vec<_>>()
        };
        let late = along("block").into_iter().filter(|[t, ..]| *t >= 0.1).map(|[t, v, _]| [t, v]);
        let exact = G * slope.sin() - resisting;
        check(case, &format!("acceleration, {kind} [m/s²]"), exact, rate(late), Relative(2e-3));
        let [_, way, off] = *along("way").last().expect("a row");
        check(case, &format!("off the plane, {kind} [m]"), 0.0, off, Absolute(1e-4 * way));
        let taken = *run.energy.column("friction").last().expect("a row");
        // It slides for 0.5 s.
        let work = MASS * resisting * 0.5 * exact * 0.5 * 0.5;
        check(case, &format!("taken by friction, {kind} [J]"), work, taken, Relative(1e-2));
        let work = MASS * resisting * way;
        let what =
            format!("taken by friction, expected: force times the distance of the run, {kind} [J]");
        consistent(case, &what, work, taken, Relative(1e-2));
        closes(case, &format!(", {kind}"), &run);
    }
}

#[test]
fn block_in_contact_stays() {
    let case = of("v04_contact_stays");
    // A softer block permits longer steps, and the result is the same.
    let soft = edited(&example(case.deck), "young = 18e9", "young = 18e7");
    for (kind, text) in [("rigid", example(case.deck)), ("deformable", soft)] {
        let run = run(&body(&text, "block", kind));
        for axis in ["x", "y", "z"] {
            let creep = spread(&run, &format!("block.{axis}"), 0.301);
            at_most(case, &format!("creep along {axis} in 10 s, {kind} [m]"), 1e-6, creep);
        }
        let weight = G * (MASS + 2400.0);
        check(case, &format!("base, z, {kind} [N]"), weight, run.last("base.z"), Relative(1e-4));
        for axis in ["base.x", "base.y"] {
            let sideways = run.last(axis);
            check(case, &format!("{axis}, {kind} [N]"), 0.0, sideways, Of(weight, 1e-4));
        }
    }
}

/// Near the limit undamped blocks flutter, and would neither slide nor stay.
#[test]
fn deformable_blocks_slide_and_stay_near_the_limit() {
    let case = of("v04_contact_steep");
    let text = example(case.deck);
    let slope = 35_f64.to_radians();
    let down = |run: &Run| {
        let [x, z] = ["block.x", "block.z"].map(|name| run.probes.series(name));
        let both = x.into_iter().zip(z);
        let along = both.map(move |([t, x], [_, z])| [t, x * slope.cos() - z * slope.sin()]);
        along.collect::<Vec<_>>()
    };
    let run_34 = run(&text);
    let exact = G * (slope.sin() - slope.cos() * 34_f64.to_radians().tan());
    let late = down(&run_34).into_iter().filter(|[t, _]| *t >= 0.1);
    check(case, "acceleration at 34° [m/s²]", exact, rate(late), Relative(1e-5));
    closes(case, " at 34°", &run_34);
    let run_36 = run(&edited(&text, "friction = 34.0", "friction = 36.0"));
    let speed = down(&run_36).last().expect("a row")[1];
    at_most(case, "speed at the end at 36° [m/s]", 1e-6, speed.abs());
    closes(case, " at 36°", &run_36);
}

/// Runs a deck with widths on both sides of the limit. The height of the probe is `level` half
/// heights of the block.
fn topples(case: Case, kind: &str, text: &str, level: f64) {
    let limit = 20_f64.to_radians().tan();
    for part in [1.03, 0.97] {
        let width = format!("{:.6}", part * limit);
        let run = run(&text.replace("0.374889", &width));
        let what = format!("w/h = {part} tan ψ, {kind}");
        let leans = run.last("block.x");
        if part > 1.0 {
            // A part of the displacement that would bring the weight over the edge.
            let most = 0.1 * 0.5 * (part - 1.0) * limit * level;
            at_most(
                case,
                &format!("{what}: leans, a tenth of what topples it [m]"),
                most,
                leans.abs(),
            );
            let speed = run.last("speed.x").abs();
            at_most(case, &format!("{what}: speed at the end [m/s]"), 1e-6, speed);
        } else {
            at_least(case, &format!("{what}: falls by [m]"), 0.1, leans);
        }
        closes(case, &format!(", {what}"), &run);
    }
}

fn softer(text: &str) -> String {
    let text = edited(text, "young = 18e9", "young = 18e8");
    edited(&text, "divisions = 3", "divisions = 2")
}

#[test]
fn slender_block_in_contact_topples() {
    let case = of("v04_topples");
    let text = example(case.deck);
    topples(case, "rigid", &text, 1.0);
    topples(case, "deformable", &softer(&body(&text, "block", "deformable")), 1.0);
}

#[test]
fn slender_block_on_joint_without_strength_topples() {
    let case = of("v04_topples_joint");
    let text = example(case.deck);
    topples(case, "rigid", &text, 2.0);
    let deformable = edited(&text, "body = \"rigid\"", "body = \"deformable\"");
    topples(case, "deformable", &softer(&deformable), 2.0);
}
