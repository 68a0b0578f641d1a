//! V9: a rocking block, and a rocking cell with sloping sides.

use super::energy::closes;
use super::incline::G;
use super::incline_contact::body;
use super::record::Tolerance::Relative;
use super::record::{check, consistent, of};
use super::shared::{Run, edited, example, run, simulation};

/// Body that rocks on the two lower edges of its base.
#[derive(Clone, Copy)]
struct Rocker {
    /// Half width of the base `[m]`.
    half_width: f64,
    /// Height of the centre above the base `[m]`.
    height: f64,
    /// Moment of inertia about the centre over the mass `[m²]`.
    inertia: f64,
}

/// Block of half width 0.25 m and half height 1 m. Nodal masses of n elements per edge have `1 + 2/n²`
/// times its moment of inertia; rigid blocks have their own.
fn block(divisions: Option<u32>) -> Rocker {
    let lumped = divisions.map_or(1.0, |n| 1.0 + 2.0 / f64::from(n * n));
    let (half_width, height) = (0.25_f64, 1.0_f64);
    Rocker { half_width, height, inertia: lumped * half_width.hypot(height).powi(2) / 3.0 }
}

/// Symmetric frustum of 2 m height, 0.5 m wide at its base and 0.3 m at its top.
fn frustum() -> Rocker {
    // A rectangle of 0.3 m, and two triangles of 0.1 m beside it.
    let rectangle = (0.6, 1.0, (0.3_f64.powi(2) + 4.0) / 12.0);
    let triangles = (0.2, 2.0 / 3.0, (0.15 + 0.1 / 3.0_f64).powi(2) + (0.01 + 4.0) / 18.0);
    let area = rectangle.0 + triangles.0;
    let height = (rectangle.0 * rectangle.1 + triangles.0 * triangles.1) / area;
    let about = |(part, at, own): (f64, f64, f64)| part * (own + (at - height).powi(2));
    Rocker { half_width: 0.25, height, inertia: (about(rectangle) + about(triangles)) / area }
}

impl Rocker {
    /// Angle at which the body would fall over.
    fn alpha(&self) -> f64 {
        self.half_width.atan2(self.height)
    }

    /// Distance of the centre from a lower edge.
    fn radius(&self) -> f64 {
        self.half_width.hypot(self.height)
    }

    /// A quarter of the period after a start at a part of `alpha`: fall time of a pendulum about its edge,
    /// with the equation `I θ'' = −m g R sin(α − θ)`. With θ = θ0 (1 − s²) the integrand is smooth.
    fn quarter(&self, part: f64) -> f64 {
        let (alpha, start) = (self.alpha(), part * self.alpha());
        let rate = G * self.radius() / (self.inertia + self.radius().powi(2));
        let steps = 20_000;
        let sum: f64 = (0..steps)
            .map(|i| {
                let s = (f64::from(i) + 0.5) / f64::from(steps);
                let angle = start * (1.0 - s * s);
                let square = 2.0 * rate * ((alpha - start).cos() - (alpha - angle).cos());
                2.0 * s * start / square.sqrt()
            })
            .sum();
        sum / f64::from(steps)
    }

    /// Housner's quarter period of slender blocks.
    fn housner(&self, part: f64) -> f64 {
        (1.0 / (1.0 - part)).acosh() / (3.0 * G / (4.0 * self.radius())).sqrt()
    }

    /// Part of the energy that an impact without rebound leaves: the angular momentum about the other edge
    /// stays.
    fn kept(&self) -> f64 {
        let (b, h) = (self.half_width.powi(2), self.height.powi(2));
        ((self.inertia + h - b) / (self.inertia + h + b)).powi(2)
    }

    /// Energies above the rest position at the tops of the swings, divided by that at the start.
    fn swings(&self, angles: &[[f64; 2]]) -> Vec<f64> {
        let alpha = self.alpha();
        let height = |angle: f64| (alpha - angle.abs()).cos() - alpha.cos();
        let start = height(angles[0][1]);
        let top = |w: &&[[f64; 2]]| w[1][1].abs() > w[0][1].abs() && w[1][1].abs() >= w[2][1].abs();
        let tops = angles.windows(3).filter(top).map(|w| height(w[1][1]) / start);
        // The smallest tops are the ringing after an impact.
        tops.filter(|energy| *energy > 0.1).collect()
    }
}

/// The deck with another angle and its lower corners in place.
fn leaning(text: &str, part: f64) -> String {
    let rocker = block(None);
    let (sin, cos) = (part * rocker.alpha()).sin_cos();
    let text = edited(text, "0.9925077", &format!("{cos:.10}"));
    let text = edited(&text, "0.1221815", &format!("{sin:.10}"));
    let text = edited(&text, "0.49625385", &format!("{:.10}", 2.0 * rocker.half_width * cos));
    edited(&text, "0.06109075", &format!("{:.10}", 2.0 * rocker.half_width * sin))
}

/// Angles of the base over time, after a start at a part of `alpha`.
fn angles(run: &Run, rocker: Rocker, part: f64) -> Vec<[f64; 2]> {
    let (sin, cos) = (part * rocker.alpha()).sin_cos();
    let width = 2.0 * rocker.half_width;
    let [lx, lz, rx, rz] =
        ["left.x", "left.z", "right.x", "right.z"].map(|column| run.probes.series(column));
    let at = |i: usize| {
        let up = rz[i][1] + width * sin - lz[i][1];
        [lx[i][0], up.atan2(rx[i][1] + width * cos - lx[i][1])]
    };
    (0..lx.len()).map(at).collect()
}

/// Time at which the base is level for the first time.
fn level(angles: &[[f64; 2]]) -> f64 {
    let after = angles.iter().position(|[_, angle]| *angle <= 0.0).expect("it falls back");
    let ([t0, a0], [t1, a1]) = (angles[after - 1], angles[after]);
    t0 + (t1 - t0) * a0 / (a0 - a1)
}

#[test]
fn rigid_block_rocks_as_housner() {
    let case = of("v09_rocking");
    let rocker = block(None);
    for part in [0.25, 0.5, 0.75] {
        let run = run(&leaning(&example(case.deck), part));
        let angles = angles(&run, rocker, part);
        let period = 4.0 * level(&angles);
        let what = format!("θ0/α = {part}");
        let exact = 4.0 * rocker.quarter(part);
        check(case, &format!("T, {what}: pendulum [s]"), exact, period, Relative(5e-3));
        let slender = 4.0 * rocker.housner(part);
        check(case, &format!("T, {what}: Housner [s]"), slender, period, Relative(1e-2));
        let swings = rocker.swings(&angles);
        for (impacts, often) in [(1, "one impact"), (2, "two impacts")] {
            let (exact, left) = (rocker.kept().powi(impacts), swings[impacts as usize - 1]);
            let name = format!("energy after {often}, {what}: Housner");
            check(case, &name, exact, left, Relative(5e-2 * f64::from(impacts)));
        }
        closes(case, &format!(", {what}"), &run);
    }
}

#[test]
fn deformable_block_rocks_as_housner() {
    let case = of("v09_rocking");
    let part = 0.5;
    for divisions in [2, 6] {
        let text = leaning(&body(&example(case.deck), "block", "deformable"), part);
        let text = edited(&text, "divisions = 2", &format!("divisions = {divisions}"));
        let text = edited(&text, "young = 18e9", "young = 18e8");
        let run = run(&edited(&text, "duration = 2.5 ", "duration = 0.55"));
        let rocker = block(Some(divisions));
        let period = 4.0 * level(&angles(&run, rocker, part));
        let what = format!("θ0/α = {part}, {divisions} divisions");
        let exact = 4.0 * rocker.quarter(part);
        check(
            case,
            &format!("T, {what}: pendulum of its nodes [s]"),
            exact,
            period,
            Relative(5e-3),
        );
        if divisions == 6 {
            let slender = 4.0 * rocker.housner(part);
            check(case, &format!("T, {what}: Housner [s]"), slender, period, Relative(1e-2));
        }
        closes(case, &format!(", {what}"), &run);
    }
}

/// Rocker with the nodal masses of the second set of a model, which leans at a part of `alpha`.
fn of_nodes(text: &str, rigid: Rocker, part: f64) -> Rocker {
    let simulation = simulation(text);
    let model = simulation.model();
    let (sin, cos) = (part * rigid.alpha()).sin_cos();
    let upright = |node: usize| {
        let [x, _, z] = model.point(node);
        (model.mass(node), x * cos + z * sin - rigid.half_width, z * cos - x * sin)
    };
    let set = |node: usize| model.geometry().set(model.geometry().locate(node).0);
    let nodes: Vec<_> = (0..model.n_nodes()).filter(|&node| set(node) == 1).map(upright).collect();
    let mass: f64 = nodes.iter().map(|(mass, ..)| mass).sum();
    let height = nodes.iter().map(|(mass, _, z)| mass * z).sum::<f64>() / mass;
    let square = |(mass, x, z): &(f64, f64, f64)| mass * (x * x + (z - height).powi(2));
    let inertia = nodes.iter().map(square).sum::<f64>() / mass;
    Rocker { height, inertia, ..rigid }
}

#[test]
fn cell_with_sloping_sides_rocks_as_a_pendulum() {
    let case = of("cells_rock");
    let (rocker, part) = (frustum(), 0.5);
    let rigid = example(case.deck);
    let run_rigid = run(&rigid);
    let swing = angles(&run_rigid, rocker, part);
    let exact = 4.0 * rocker.quarter(part);
    check(case, "T, rigid [s]", exact, 4.0 * level(&swing), Relative(5e-3));
    closes(case, ", rigid", &run_rigid);
    // Lumped masses of a coarse mesh have more moment of inertia than the cell.
    let text = edited(&rigid, "body = \"rigid\"\n\n[[fix]]", "divisions = 2\n\n[[fix]]");
    let own = of_nodes(&text, rocker, part);
    let run = run(&text);
    let period = 4.0 * level(&angles(&run, rocker, part));
    let what = "T, 2 divisions: pendulum of its nodes [s]";
    consistent(case, what, 4.0 * own.quarter(part), period, Relative(5e-3));
    closes(case, ", 2 divisions", &run);
}
