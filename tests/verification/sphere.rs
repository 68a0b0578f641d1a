//! Waves from a cavity: a staircase of blocks instead of a sphere.

use std::collections::BTreeMap;
use std::f64::consts::PI;

use ddem_deck::Deck;
use ddem_deck::History;
use nalgebra::Vector3;

use super::ROCK;
use super::fem::{Formulation, Mesh, OracleLattice, System};
use super::record::Tolerance::Relative;
use super::record::{at_most, check, of};
use super::shared::{deck, example, run, simulation};

/// Size of the independent model `[m]`; farther out a point source is as good.
const OUT: f64 = 3.5;
/// Faces of an element, whose nodes are in VTK order.
const FACES: [[usize; 4]; 6] =
    [[0, 1, 2, 3], [4, 5, 6, 7], [0, 1, 5, 4], [3, 2, 6, 7], [0, 3, 7, 4], [1, 2, 6, 5]];

/// The independent mesh of the blocks of a deck near its cavity.
fn around(deck: &Deck) -> (Mesh, f64) {
    let edges = deck.blocks[0].edges.as_ref().and_then(|edges| edges.x.clone()).expect("edges");
    let cuts: Vec<f64> = edges.into_iter().take_while(|cut| *cut < OUT + 1e-9).collect();
    let (n, size) = (cuts.len() - 1, cuts[cuts.len() - 1]);
    let mut lattice =
        OracleLattice::boxed([size; 3], [n; 3], 1, deck.joints["seam"].thickness, ROCK);
    let ball = deck.remove[0].r#where.sphere.expect("a ball");
    let middle = |cell: usize| 0.5 * (cuts[cell] + cuts[cell + 1]);
    let far = |i: &usize| Vector3::from([i % n, i / n % n, i / n / n].map(middle)).norm();
    lattice.removed = (0..n.pow(3)).filter(|i| far(i) < ball.radius).collect();
    lattice.cuts = [0, 1, 2].map(|_| cuts.clone());
    (lattice.mesh(), size)
}

/// Forces of a pressure of 1 Pa on all faces that belong to one element only, except those on the
/// planes of symmetry and the outer ones.
fn pushed(mesh: &Mesh, size: f64) -> Vec<f64> {
    let mut faces: BTreeMap<[usize; 4], (Vector3<f64>, u32)> = BTreeMap::new();
    for element in &mesh.elements {
        let corners = mesh.corners(element);
        let middle = corners.iter().sum::<Vector3<f64>>() / 8.0;
        for face in FACES {
            let [a, b, c, d] = face.map(|i| corners[i]);
            let area = (c - a).cross(&(d - b)) / 2.0;
            let mut nodes = face.map(|i| element.nodes[i]);
            nodes.sort_unstable();
            let into_it = area * (middle - a).dot(&area).signum();
            faces.entry(nodes).or_insert((into_it, 0)).1 += 1;
        }
    }
    let mut load = vec![0.0; mesh.dofs()];
    for (nodes, (area, _)) in faces.iter().filter(|(_, (_, count))| *count == 1) {
        let on = |d: usize, x: f64| nodes.iter().all(|&i| (mesh.nodes[i][d] - x).abs() < 1e-9);
        if (0..3).any(|d| on(d, 0.0) || on(d, size)) {
            continue;
        }
        for node in nodes {
            (0..3).for_each(|d| load[3 * node + d] += area[d] / 4.0);
        }
    }
    load
}

/// Radius of the sphere whose static displacement far away equals that of the cavity of a deck. It
/// follows from the theorem of Betti for the outside of a cube. The work of the forces on the cube
/// on the displacement of a point source, `w = x/r³`, equals that of the tractions of w on the
/// displacement, which is `C w` there.
fn effective_radius(deck: &Deck) -> f64 {
    let (mesh, size) = around(deck);
    let system = System::assemble(&mesh, Formulation::Standard);
    let w = |node: usize| mesh.nodes[node] / mesh.nodes[node].norm().powi(3);
    let outer = mesh.select(|at| at.iter().any(|x| *x > size - 1e-9));
    let on_plane = |dof: usize| mesh.nodes[dof / 3][dof % 3] < 1e-9;
    let held: Vec<Option<f64>> = (0..mesh.dofs()).map(|dof| on_plane(dof).then_some(0.0)).collect();
    // Work on w of the forces that hold the cube's outer faces, which are displaced by a multiple
    // of w.
    let work = |times: f64, load: &[f64]| {
        let mut held = held.clone();
        for &node in &outer {
            (0..3).for_each(|d| held[3 * node + d] = Some(times * w(node)[d]));
        }
        let reactions = system.solve(load, &held).reactions;
        let of =
            |&node: &usize| Vector3::from_column_slice(&reactions[3 * node..][..3]).dot(&w(node));
        outer.iter().map(of).sum::<f64>()
    };
    let (still, alone) = (work(0.0, &pushed(&mesh, size)), work(1.0, &vec![0.0; mesh.dofs()]));
    // The tractions of w do the work -4 G L/r⁶ per area on w, on each side of a cube with the edge
    // L.
    let (steps, shear) = (400, ROCK.shear());
    let h = size / f64::from(steps);
    let place = |i: i32| (f64::from(i) + 0.5) * h;
    let at = |i: i32, k: i32| (size * size + place(i).powi(2) + place(k).powi(2)).powi(-3);
    let sum: f64 =
        (0..steps).flat_map(|i| (0..steps).map(move |k| (i, k))).map(|(i, k)| at(i, k)).sum();
    let own = -12.0 * shear * size * sum * h * h;
    // still + C alone = C own, and C = a³/(4 G).
    (4.0 * shear * still / (own - alone)).cbrt()
}

/// Radial velocity `[s, m/s]` at a distance r from a cavity of radius a under the pressure p(t),
/// from the equation of Sharpe with steps of fourth order.
fn sharpe(a: f64, pressure: impl Fn(f64) -> f64, r: f64) -> Vec<[f64; 2]> {
    let (c, shear, density) = (3000.0, 7.2e9_f64 / 2400.0, 2400.0);
    let second = |t: f64, [f, g]: [f64; 2]| {
        -a * pressure(t) / density - 4.0 * shear / (a * c) * g - 4.0 * shear / (a * a) * f
    };
    let step = 1e-6;
    let mut state = [0.0; 2];
    let mut series = Vec::new();
    for i in 0..4000 {
        let t = f64::from(i) * step;
        let slope = |t: f64, s: [f64; 2]| [s[1], second(t, s)];
        let on = |k: [f64; 2], part: f64| [0, 1].map(|i| state[i] + part * step * k[i]);
        let k1 = slope(t, state);
        let k2 = slope(t + 0.5 * step, on(k1, 0.5));
        let k3 = slope(t + 0.5 * step, on(k2, 0.5));
        let k4 = slope(t + step, on(k3, 1.0));
        series.push([t + (r - a) / c, -k1[1] / (c * r) - k1[0] / (r * r)]);
        state = [0, 1].map(|i| state[i] + step / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]));
    }
    series
}

/// Value interpolated in a series; 0 before it.
fn at(series: &[[f64; 2]], time: f64) -> f64 {
    let next = series.partition_point(|[t, _]| *t <= time);
    match (next.checked_sub(1).map(|i| series[i]), series.get(next)) {
        (Some([t, v]), Some([later, then])) => v + (then - v) * (time - t) / (later - t),
        (Some([_, v]), None) => v,
        (None, _) => 0.0,
    }
}

fn largest(series: &[[f64; 2]]) -> f64 {
    series.iter().fold(0.0, |most: f64, [_, v]| most.max(*v))
}

/// Allowed relative error of a peak at a distance r from a staircase with steps of that height
/// around a sphere of radius a, as the headers of the decks state. It is of second order in the
/// elements that carry the wave, and of first order in the staircase.
fn bound(step: f64, a: f64, r: f64) -> f64 {
    let (wave, spacing) = (9.0, 0.5);
    (2.0 * PI / wave * spacing).powi(2) / 8.0 + step / a * (a / r).powi(2)
}

/// Checks the peaks of a deck; returns the mean relative error and its allowed value. `step` is
/// half the edge of a block of the staircase `[m]`.
fn peaks(name: &str, step: f64) -> [f64; 2] {
    let case = of(name);
    let text = example(name);
    let (deck, run, simulation) = (deck(&text), run(&text), simulation(&text));
    let a = effective_radius(&deck);
    let volume = simulation.charge(0).expect("a charge").volume;
    println!("a = {a} m, of the volume {} m", (6.0 * volume / PI).cbrt());
    let charge = &deck.charge[0];
    let Some(ddem_deck::ChargeHistory::Given(History::Table(table))) = &charge.history else {
        panic!("a table: {:?}", charge.history)
    };
    let peak = charge.pressure.expect("a pressure");
    let (mut mean, mut worst, mut most) = ([0.0; 2], 0.0_f64, 0.0_f64);
    for probe in &deck.probe {
        let node = simulation.model().nearest_node(probe.at.expect("a place"));
        let x = Vector3::from(simulation.model().point(node));
        let r = x.norm();
        let exact = sharpe(a, |t| peak * at(table, t), r);
        let part = |axis: usize| {
            let column = ["x", "y", "z"][axis];
            run.probes.series(&format!("{}.{column}", probe.name))
        };
        let parts = [0, 1, 2].map(part);
        let radial = |i: usize| {
            let v = Vector3::from([0, 1, 2].map(|axis| parts[axis][i][1]));
            [parts[0][i][0], v.dot(&x) / r]
        };
        let found: Vec<[f64; 2]> = (0..parts[0].len()).map(radial).collect();
        let (exact_peak, found_peak) = (largest(&exact), largest(&found));
        let what = format!("peak velocity, {} at {r:.3} m [m/s]", probe.name);
        let allowed = bound(step, a, r);
        check(case, &what, exact_peak, found_peak, Relative(allowed));
        let off = (found_peak / exact_peak - 1.0).abs();
        mean = [mean[0] + off, mean[1] + allowed];
        most = most.max(allowed);
        let away = found.iter().map(|[t, v]| (v - at(&exact, *t)).abs() / exact_peak);
        worst = away.fold(worst, f64::max);
    }
    most += step / 3000.0 * PI / 3e-3;
    at_most(case, "largest difference from Sharpe / peak, at any time", most, worst);
    mean.map(|sum| sum / deck.probe.len() as f64)
}

#[test]
fn spherical_cavity_radiates_exact_waves() {
    let [coarse, allowed] = peaks("blast_sphere", 0.25);
    let [fine, allowed_fine] = peaks("blast_sphere_fine", 0.125);
    // The error of the staircase is of first order; the blocks that carry the wave beyond 3 m are
    // the same in both.
    let what = "mean error of the peaks / that with blocks of 1/2 m";
    at_most(of("blast_sphere_fine"), what, allowed_fine / allowed, fine / coarse);
}
