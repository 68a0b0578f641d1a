//! V4: a block on an incline.

use super::energy::closes;
use super::record::Tolerance::{Absolute, Relative};
use super::record::{at_most, check, consistent, of};
use super::shared::{edited, example, run};

pub(crate) const G: f64 = 9.81;
/// Mass of the block, and of the base.
const MASS: f64 = 1200.0;

/// Slope of the straight line nearest to some points; the block rings while it slides.
pub(crate) fn rate(points: impl Iterator<Item = [f64; 2]> + Clone) -> f64 {
    let mean = |c: usize| points.clone().map(|p| p[c]).sum::<f64>() / points.clone().count() as f64;
    let (x, y) = (mean(0), mean(1));
    let sum = |f: &dyn Fn([f64; 2]) -> f64| points.clone().map(f).sum::<f64>();
    sum(&|p| (p[0] - x) * (p[1] - y)) / sum(&|p| (p[0] - x).powi(2))
}

#[test]
fn block_slides_on_slope_steeper_than_friction() {
    let case = of("v04_slides");
    let (slope, friction) = (40_f64.to_radians(), 20_f64.to_radians());
    let resisting = G * slope.cos() * friction.tan();
    let exact = G * slope.sin() - resisting;
    let run = run(&example(case.deck));
    let velocities = run.probes.series("block.x");
    let acceleration = rate(velocities.into_iter().filter(|[time, _]| *time >= 0.02));
    check(case, "acceleration [m/s²]", exact, acceleration, Relative(5e-3));
    let friction = *run.energy.column("friction").last().expect("a row");
    // It slides for 0.5 s.
    let work = MASS * resisting * 0.5 * exact * 0.5 * 0.5;
    check(case, "energy taken by friction [J]", work, friction, Relative(1e-2));
    let work = MASS * resisting * run.last("way.x");
    let what = "energy taken by friction, expected: force times the way of the run [J]";
    consistent(case, what, work, friction, Relative(1e-2));
    let failed = run.summary.failed_pairs.shear + run.summary.failed_pairs.tension;
    check(case, "failed pairs", 9.0, failed as f64, Absolute(0.0));
    closes(case, "", &run);
}

/// After half a pair spacing the joint is released and a contact replaces it.
#[test]
fn block_keeps_sliding_after_contact_replaces_joint() {
    let case = of("v04_slides");
    let (slope, friction) = (40_f64.to_radians(), 20_f64.to_radians());
    let exact = G * (slope.sin() - slope.cos() * friction.tan());
    for kind in ["rigid", "deformable"] {
        let text = edited(&example(case.deck), "contact = false", "contact = true");
        let text = edited(&text, "where = { z = 0.75 }", "where = { z = 1.0 }");
        let body = format!("divisions = 2\nbody = \"{kind}\"");
        let run = run(&edited(&text, "divisions = 2", &body));
        let velocities = run.probes.series("block.x").into_iter();
        let what = format!("acceleration, its joint let go, {kind} [m/s²]");
        let late = velocities.filter(|[time, _]| *time >= 0.02);
        check(case, &what, exact, rate(late), Relative(5e-3));
        closes(case, &format!(", its joint let go, {kind}"), &run);
    }
}

#[test]
fn block_stays_on_slope_flatter_than_friction() {
    let case = of("v04_stays");
    let slope = 30_f64.to_radians();
    let run = run(&example(case.deck));
    let largest = |column: &str| {
        run.probes.column(column).into_iter().fold(0.0, |most: f64, x| most.max(x.abs()))
    };
    at_most(case, "largest velocity [m/s]", 1e-5, largest("block.x"));
    at_most(case, "largest displacement [m]", 1e-5, largest("way.x"));
    let weight = 2.0 * MASS * G;
    check(case, "base, x [N]", -weight * slope.sin(), run.last("base.x"), Relative(1e-4));
    check(case, "base, z [N]", weight * slope.cos(), run.last("base.z"), Relative(1e-4));
}

/// The friction changes with the stage, for the joint and for the contact that replaces it.
#[test]
fn block_slides_with_friction_of_the_stage() {
    let case = of("v04_stages");
    let slope = 20_f64.to_radians();
    let resisting = |friction: f64| G * slope.cos() * friction.to_radians().tan();
    for kind in ["deformable", "rigid"] {
        let body = format!("divisions = 2\nbody = \"{kind}\"");
        let run = run(&edited(&example(case.deck), "divisions = 2", &body));
        let velocities = run.probes.series("block.x");
        let between = |from: f64, to: f64| {
            rate(velocities.clone().into_iter().filter(move |[t, _]| from <= *t && *t <= to))
        };
        let slides = G * slope.sin() - resisting(10.0);
        let what = |what: &str| format!("acceleration, {what}, {kind} [m/s²]");
        check(case, &what("a joint"), slides, between(0.02, 0.25), Relative(5e-3));
        check(case, &what("a contact"), slides, between(0.6, 0.8), Relative(5e-3));
        let brakes = G * slope.sin() - resisting(40.0);
        check(case, &what("braked"), brakes, between(0.82, 1.1), Relative(5e-3));
        let work =
            |[slid, braked]: [f64; 2]| MASS * (resisting(10.0) * slid + resisting(40.0) * braked);
        let taken = *run.energy.column("friction").last().expect("a row");
        // It slides for 0.8 s, then it is braked for 0.3 s.
        let exact = [0.5 * slides * 0.8 * 0.8, slides * 0.8 * 0.3 + 0.5 * brakes * 0.3 * 0.3];
        let what = format!("taken by friction, {kind} [J]");
        check(case, &what, work(exact), taken, Relative(1e-2));
        let ways = run.probes.series("way.x");
        let slid = ways.iter().filter(|[time, _]| *time <= 0.8).fold(0.0, |_, [_, way]| *way);
        let found = [slid, run.last("way.x") - slid];
        let what =
            format!("taken by friction, expected: force times the way of the run, {kind} [J]");
        consistent(case, &what, work(found), taken, Relative(1e-2));
        closes(case, &format!(", {kind}"), &run);
    }
}
