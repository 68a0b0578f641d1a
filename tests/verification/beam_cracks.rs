//! V8: the beam cracks at midspan.

use super::ROCK;
use super::energy::closes;
use super::fem::{Formulation, OracleLattice, System};
use super::intact_planes::tractions;
use super::record::Tolerance::{Absolute, Of, Relative};
use super::record::{at_least, check, of};
use super::shared::{Frames, Run, edited, example, run};

const STRENGTH: f64 = 0.8e6;
const THICKNESS: f64 = 0.05;

/// Force on the line `[N/Pa]` and its displacement `[m/Pa]` per largest tension across a joint, and
/// the place of that tension, from a finite element model of the intact beam.
fn elastic() -> ([f64; 2], [f64; 3]) {
    let mesh = OracleLattice::boxed([12.0, 3.0, 3.0], [12, 3, 3], 2, THICKNESS, ROCK).mesh();
    let mut held = vec![None; mesh.dofs()];
    let ends = mesh.select(|at| at.z < 1e-9 && (at.x < 1e-9 || at.x > 12.0 - 1e-9));
    for node in ends {
        held[3 * node + 2] = Some(0.0);
        if mesh.nodes[node].x < 6.0 {
            held[3 * node] = Some(0.0);
        }
        if (mesh.nodes[node].y - 1.5).abs() < 1e-9 {
            held[3 * node + 1] = Some(0.0);
        }
    }
    let line = mesh.select(|at| at.z > 3.0 - 1e-9 && (at.x - 6.0).abs() < THICKNESS);
    for node in &line {
        held[3 * node + 2] = Some(-1e-3);
    }
    let system = System::assemble(&mesh, Formulation::Standard);
    let u = system.solve(&vec![0.0; mesh.dofs()], &held).displacement;
    let forces = system.stiffness.multiply(&u);
    let force: f64 = line.iter().map(|node| -forces[3 * node + 2]).sum();
    let planes = (1..12).flat_map(|x| tractions(&mesh, &u, 0, f64::from(x)));
    let (place, traction) = planes.max_by(|a, b| a.1.x.total_cmp(&b.1.x)).expect("pairs");
    ([force / traction.x, 1e-3 / traction.x], place.into())
}

#[test]
fn beam_cracks_from_below_at_midspan() {
    let case = of("v08_beam_cracks");
    let run = run(&example(case.deck));
    let joints = Frames::open(run.path("joints.vtkhdf"));
    let (points, times) = (joints.points(), joints.last_scalars("failure_time"));
    let states = joints.last_scalars("state");
    let failed: Vec<usize> = (0..points.len()).filter(|&pair| times[pair].is_finite()).collect();
    let first = failed.iter().copied().min_by(|&a, &b| times[a].total_cmp(&times[b]));
    let first = first.expect("a crack");
    let ([force, travel], place) = elastic();

    let load = run.probes.series("base.z");
    let load = load.iter().find(|[time, _]| *time >= times[first]).expect("a sample")[1];
    let pushed = 2e-3 * (times[first] - 0.1 / 2.0);
    check(
        case,
        "displacement of the line at the first crack [m]",
        travel * STRENGTH,
        pushed,
        Relative(5e-3),
    );
    check(case, "load at the first crack [N]", force * STRENGTH, load, Relative(2e-2));
    let theory = 1.2e6 / (1.0 - 2.0 / 3.0 * 0.4875 / 3.0);
    check(case, "the same, theory of beams [N]", theory, load, Relative(0.1));
    for axis in [0, 2] {
        let what = format!("{} of the first crack [m]", ["x", "y", "z"][axis]);
        check(case, &what, place[axis], points[first][axis], Of(12.0, 1e-6));
    }
    assert!(failed.iter().all(|&pair| (points[pair][0] - 6.0).abs() < 1e-6), "other planes crack");
    assert!(failed.iter().all(|&pair| states[pair] == 2.0), "not in tension");
    // Rows of pairs of the plane from below; each row begins to crack after the row below it.
    let mut rows: Vec<(f64, f64)> = Vec::new();
    let mut upward = failed.clone();
    upward.sort_by(|&a, &b| points[a][2].total_cmp(&points[b][2]));
    for pair in upward {
        match rows.last_mut() {
            Some(row) if (points[pair][2] - row.0).abs() < 1e-6 => row.1 = row.1.min(times[pair]),
            _ => rows.push((points[pair][2], times[pair])),
        }
    }
    at_least(case, "rows that have cracked", 3.0, rows.len() as f64);
    let downward = rows.windows(2).filter(|pair| pair[1].1 < pair[0].1).count();
    check(case, "rows that cracked before the one below", 0.0, downward as f64, Absolute(0.0));
    closes(case, "", &run);
}

/// Beam in equilibrium under a load along the line `[N]`.
fn relaxed(load: f64, increments: u32) -> Run {
    let text = example("v08_beam_cracks");
    let (head, _) =
        text.split_once("[[fix]]                            # the line").expect("a line");
    let soft = "tension = 0.8e6                    # Pa\nfracture_energy = [250, 2e4]\n";
    let head = edited(head, "tension = 0.8e6                    # Pa\n", soft);
    let line = -load / 3.0;
    run(&format!(
        "{head}
[[load]]
where = {{ x = 6.0, z = 3.0 }}
line = [0.0, 0.0, {line}]
[[stage]]
name = \"load\"
kind = \"relax\"
tolerance = 1e-6
increments = {increments}
[[probe]]
name = \"base\"
where = {{ z = 0.0 }}
quantity = \"reaction\"
"
    ))
}

#[test]
fn static_load_above_strength_cracks_beam() {
    let case = of("v08_beam_cracks");
    let load = elastic().0[0] * STRENGTH;
    let failed = |run: &Run| run.summary.failed_pairs.tension + run.summary.failed_pairs.shear;
    let less = failed(&relaxed(0.95 * load, 1));
    check(case, "failed pairs, relaxed under 95 % of it", 0.0, less as f64, Absolute(0.0));
    for increments in [1, 3] {
        let run = relaxed(1.05 * load, increments);
        let joints = Frames::open(run.path("joints.vtkhdf"));
        let states = joints.points().into_iter().zip(joints.last_scalars("state"));
        let cracked: Vec<_> = states.filter(|(_, state)| *state != 0.0).collect();
        let below = |(at, state): &([f64; 3], f64)| {
            (at[0] - 6.0).abs() < 1e-6 && at[2] < 0.6 && *state == 2.0
        };
        assert!(!cracked.is_empty() && cracked.iter().all(below), "{cracked:?}");
        let what = format!("pairs of the lowest row that hold, at 105 % in {increments}");
        let held = 9.0 - cracked.iter().filter(|(at, _)| at[2] == 0.0).count() as f64;
        check(case, &what, 0.0, held, Absolute(0.0));
        let what = format!("support force [N], at 105 % in {increments}");
        check(case, &what, 1.05 * load, run.last("base.z"), Relative(1e-5));
    }
}
