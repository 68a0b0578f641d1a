//! Blocks that stand, tip and fall as statics says, and blocks that slide from one to the next.

use super::energy::closes;
use super::incline::G;
use super::incline_contact::{body, largest, spread};
use super::record::Tolerance::{Absolute, Relative};
use super::record::{at_least, at_most, check, of};
use super::shared::{edited, example, run};

#[test]
fn column_stands() {
    let case = of("v04_column");
    let text = example(case.deck);
    let soft = edited(&body(&text, "b01", "deformable"), "young = 18e9", "young = 18e8");
    for (kind, text) in [("rigid", text), ("deformable", soft)] {
        let run = run(&text);
        let weight = G * (20.0 * 300.0 + 600.0);
        check(case, &format!("base, {kind} [N]"), weight, run.last("base.z"), Relative(1e-3));
        for column in ["top.x", "top.y", "top.z", "middle.x", "middle.y", "middle.z"] {
            let creep = spread(&run, column, 2.501);
            at_most(case, &format!("creep in 10 s, {column}, {kind} [m]"), 1e-6, creep);
        }
        if kind == "rigid" {
            let settled = -210.0 * 300.0 * G / (1e9 * 0.25);
            check(case, "settlement of the top [m]", settled, run.last("top.z"), Relative(1e-4));
        }
        closes(case, &format!(", {kind}"), &run);
    }
}

#[test]
fn block_tips_over_edge() {
    let case = of("v04_edge");
    let text = example(case.deck);
    let soft = edited(&body(&text, "block", "deformable"), "young = 18e9", "young = 18e8");
    let finer = edited(&soft, "divisions = 3", "divisions = 4");
    for (kind, text) in [("rigid", text), ("3 divisions", soft), ("4 divisions", finer)] {
        let run = run(&text);
        let [front, rear, table] =
            ["front.z", "rear.z", "table.x"].map(|column| run.probes.series(column));
        let angle = |i: usize| (rear[i][1] - front[i][1]) / 0.5;
        let first = (0..table.len()).find(|&i| table[i][0] >= 0.05).expect("it is drawn");
        let tipped = (first..table.len()).find(|&i| (angle(i) - angle(first)).abs() > 1e-3);
        let free = 0.25 - table[tipped.expect("it tips")][1] - 0.0125;
        let square = (0.5_f64.powi(2) + 0.2_f64.powi(2)) / 12.0 + 0.01;
        let exact = 0.25 + 0.02 * (1e-3 * 6.0 * square / (G * 0.02)).cbrt();
        let what = format!("length past the edge when it has turned by 0.001, {kind} [m]");
        check(case, &what, exact, free, Absolute(0.005));
        closes(case, &format!(", {kind}"), &run);
    }
}

/// The corbelled stack with its blocks shifted by a part of the limit.
pub(crate) fn shifted(text: &str, part: f64) -> String {
    let mut at = -1.0;
    let mut text = text.to_owned();
    let blocks =
        [("-0.8775", 8.0), ("-0.71416667", 6.0), ("-0.46916667", 4.0), ("0.02083333", 2.0)];
    for (old, inverse) in blocks {
        at += part / inverse;
        text = edited(&text, &format!("origin = [{old},"), &format!("origin = [{at:.8},"));
    }
    text
}

#[test]
fn corbelled_stack_stands_up_to_limit() {
    let case = of("v04_corbel");
    let rigid = example(case.deck);
    let soft = edited(&body(&rigid, "fourth", "deformable"), "young = 18e9", "young = 18e8");
    let soft = edited(&soft, "divisions = 4", "divisions = 2");
    for (kind, text) in [("rigid", rigid), ("deformable", soft)] {
        for part in [0.98, 1.02] {
            let run = run(&shifted(&text, part));
            let what = format!("{part} of the limit, {kind}");
            if part < 1.0 {
                let moved = largest(&run, "top.z", 0.0);
                at_most(case, &format!("{what}: moves by [m]"), 2e-4, moved);
                let speed = run.last("speed.z").abs();
                at_most(case, &format!("{what}: speed at the end [m/s]"), 1e-6, speed);
            } else {
                let fallen = -run.last("top.z");
                at_least(case, &format!("{what}: falls by [m]"), 0.02, fallen);
            }
            closes(case, &format!(", {what}"), &run);
        }
    }
}

#[test]
fn block_slides_onto_neighbour() {
    let case = of("v04_neighbours");
    let text = example(case.deck);
    let soft = edited(&body(&text, "block", "deformable"), "young = 18e9", "young = 18e8");
    for (kind, text) in [("rigid", text), ("deformable", soft)] {
        let run = run(&text);
        let slowing = G * 10_f64.to_radians().tan();
        let way = 4.0 / (2.0 * slowing);
        check(case, &format!("way to rest, {kind} [m]"), way, run.last("way.x"), Relative(2e-3));
        let bump = largest(&run, "block.z", 0.05);
        at_most(case, &format!("largest speed up or down, {kind} [m/s]"), 1e-3, bump);
        let taken = *run.energy.column("friction").last().expect("a row");
        check(case, &format!("taken by friction, {kind} [J]"), 240.0, taken, Relative(1e-2));
        closes(case, &format!(", {kind}"), &run);
    }
}
