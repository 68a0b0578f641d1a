//! V7: the first of two weak planes to fail, and its load.

use nalgebra::Vector3;

use super::ROCK;
use super::energy::closes;
use super::fem::{Formulation, OracleLattice, System};
use super::intact_planes::{Pair, tractions};
use super::record::Tolerance::{Of, Relative};
use super::record::{at_most, between, check, consistent, of};
use super::shared::{Frames, Run, edited, example, run};

const COHESION: f64 = 0.8e6;
const TENSION: f64 = 1.38e6;
/// Weight of a cubic metre `[N]`.
const WEIGHT: f64 = 2400.0 * 9.81;

fn friction() -> f64 {
    30_f64.to_radians().tan()
}

/// Tractions of the intact planes at z = 2 and 5 under the weight, and under 1 Pa on y = 0.
fn intact() -> [[Vec<Pair>; 2]; 2] {
    let mesh = OracleLattice::boxed([4.0, 4.0, 8.0], [4, 4, 8], 2, 0.05, ROCK).mesh();
    let system = System::assemble(&mesh, Formulation::Standard);
    let mut held = vec![None; mesh.dofs()];
    for node in mesh.select(|at| at.z < 1e-9) {
        held[3 * node..3 * node + 3].fill(Some(0.0));
    }
    let (mut weight, mut push) = (vec![0.0; mesh.dofs()], vec![0.0; mesh.dofs()]);
    for (node, mass) in mesh.masses().into_iter().enumerate() {
        weight[3 * node + 2] = -9.81 * mass;
    }
    for (node, share) in mesh.outer_face(1, false) {
        push[3 * node + 1] = share * 32.0;
    }
    [weight, push].map(|load| {
        let u = system.solve(&load, &held).displacement;
        [2.0, 5.0].map(|z| tractions(&mesh, &u, 2, z))
    })
}

/// Load at which the first pair of a plane fails, and the position of the pair.
fn first_slip(weight: &[Pair], push: &[Pair]) -> (f64, Vector3<f64>) {
    let beyond = |q: f64, (w, p): (&Pair, &Pair)| {
        let t = w.1 + q * p.1;
        (t.xy().norm() - (COHESION - t.z * friction())).max(t.z - TENSION)
    };
    let limit = |pair: (&Pair, &Pair)| {
        let (mut low, mut high) = (0.0, 10e6);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if beyond(middle, pair) > 0.0 { high = middle } else { low = middle }
        }
        (high, pair.0.0)
    };
    let limits = weight.iter().zip(push).map(limit);
    limits.min_by(|a, b| a.0.total_cmp(&b.0)).expect("pairs")
}

/// Positions of the pairs of a plane, and their failure times.
fn failures(run: &Run, z: f64) -> Vec<([f64; 3], f64)> {
    let joints = Frames::open(run.path("joints.vtkhdf"));
    let all = joints.points().into_iter().zip(joints.last_scalars("failure_time"));
    let plane: Vec<_> = all.filter(|(at, _)| (at[2] - z).abs() < 1e-6).collect();
    assert_eq!(plane.len(), 16 * 9);
    plane
}

/// Load when the last pair of the deeper plane has failed `[Pa]`, in a run that loads at `rate`.
fn limit(run: &Run, rate: f64) -> f64 {
    let deeper = failures(run, 2.0);
    let last = deeper.iter().fold(0.0, |last: f64, (_, time)| {
        assert!(time.is_finite(), "the deeper plane has not failed everywhere");
        last.max(*time)
    });
    0.2e6 + rate * last
}

#[test]
fn deeper_plane_fails_first_between_the_bounds() {
    let case = of("v07_shear");
    let text = example(case.deck);
    let run = run(&text);
    let [weight, push] = intact();
    let [(slips, place), (upper_slips, _)] =
        [0, 1].map(|plane| first_slip(&weight[plane], &push[plane]));
    assert!(slips < upper_slips, "the upper plane would slip first");

    let deeper = failures(&run, 2.0);
    let first = deeper.iter().min_by(|a, b| a.1.total_cmp(&b.1)).expect("pairs");
    check(case, "load at first slip [Pa]", slips, 0.2e6 + 0.2e6 * first.1, Relative(1e-2));
    check(case, "y of the first slip [m]", place.y, first.0[1], Of(4.0, 1e-9));
    let upper = failures(&run, 5.0);
    let first_above = upper.iter().map(|pair| pair.1).fold(0.12, f64::min);
    at_most(case, "first slip of z = 2, before that of z = 5 [s]", first_above, first.1);
    let at_far_side = deeper.iter().filter(|(at, _)| at[1] > 3.9).map(|(_, time)| *time);
    let at_far_side = at_far_side.fold(f64::INFINITY, f64::min);
    let before = deeper.iter().filter(|(at, _)| at[1] < 2.0).map(|(_, time)| *time);
    let before = before.fold(0.0, f64::max);
    at_most(
        case,
        "slip of the near half of z = 2, before that of its far side [s]",
        at_far_side,
        before,
    );

    let found = limit(&run, 0.2e6);
    let equilibrium = COHESION * 4.0 / 6.0 + WEIGHT * 4.0 * friction();
    let bounds = [slips.floor(), equilibrium.ceil()];
    between(case, "limit load, between the bounds [Pa]", found, bounds);
    let slower = edited(&text, "ramp = 0.12 ", "ramp = 0.24 ");
    let slower = super::shared::run(&edited(&slower, "duration = 0.12 ", "duration = 0.24 "));
    let what = "limit load / that of a run that loads half as fast";
    consistent(case, what, 1.0, found / limit(&slower, 0.1e6), Relative(2e-2));
    closes(case, "", &run);
}

/// Limit equilibrium holds for joints that keep their strength while they fail.
#[test]
fn plane_without_softening_fails_at_limit_equilibrium() {
    let case = of("v07_shear");
    let tough = "cohesion = 0.8e6                   # Pa\nfracture_energy = [5e4, 5e5]\n";
    let text = edited(&example(case.deck), "cohesion = 0.8e6                   # Pa\n", tough);
    let text = edited(&text, "traction = [0.0, 0.024e6, 0.0]", "traction = [0.0, 0.6e6, 0.0]");
    let text = edited(&text, "ramp = 0.12 ", "ramp = 0.3 ");
    let run = run(&edited(&text, "duration = 0.12 ", "duration = 0.3 "));
    let pushed = |time: f64| 0.2e6 + 2e6 * time;
    let base = run.probes.series("base.y").into_iter().filter(|[time, _]| *time > 0.0);
    let resistance = base.map(|[time, force]| -force - 8.0 * pushed(time));
    let most = resistance.fold(0.0, f64::max);
    let equilibrium = 16.0 * COHESION + 16.0 * 6.0 * WEIGHT * friction();
    let what = "shear force on z = 2 when it yields / limit equilibrium";
    between(case, what, most / equilibrium, [0.9, 1.0]);
}
