//! V5: direct shear of one joint, and the strength of Barton's law.

use super::energy::closes;
use super::record::Tolerance::{Absolute, Relative};
use super::record::{Case, check, of};
use super::shared::{Run, edited, example, run};

/// Shear of a joint of 1 m².
struct Curve {
    /// Displacement of the upper block `[m]`, and shear stress `[Pa]`.
    points: Vec<[f64; 2]>,
    /// Rise of the upper block at the end `[m]`.
    risen: f64,
}

impl Curve {
    fn of(run: &Run) -> Self {
        let (force, way) = (run.probes.series("box.x"), run.probes.series("top.x"));
        let points: Vec<_> = force.iter().zip(&way).map(|(f, u)| [u[1], -f[1]]).collect();
        let height = run.probes.series("top.z");
        let pressed = height.iter().take_while(|[time, _]| *time <= 0.0).last().expect("samples");
        Self { points, risen: height.last().expect("samples")[1] - pressed[1] }
    }

    /// Peak stress before the first drop by a tenth. The unbalanced forces of the stage before are noise.
    fn peak(&self) -> f64 {
        let most = self.points.iter().fold(0.0, |most: f64, p| most.max(p[1]));
        let mut peak: f64 = 0.0;
        for [_, stress] in &self.points {
            if *stress < 0.9 * peak && peak > 1e-3 * most {
                break;
            }
            peak = peak.max(*stress);
        }
        peak
    }

    /// Mean stress over the last fifth.
    fn residual(&self) -> f64 {
        let last = &self.points[self.points.len() * 4 / 5..];
        last.iter().map(|p| p[1]).sum::<f64>() / last.len() as f64
    }

    /// Slope of the line through a fifth and four fifths of the peak.
    fn stiffness(&self) -> f64 {
        let at = |stress| self.points.iter().find(|p| p[1] >= stress).expect("on the way up");
        let (low, high) = (at(0.2 * self.peak()), at(0.8 * self.peak()));
        (high[1] - low[1]) / (high[0] - low[0])
    }

    /// Area above a stress `[J/m²]`.
    fn area_above(&self, stress: f64) -> f64 {
        let up = self.points.iter().position(|p| p[1] >= stress).expect("a peak");
        let trapezium = |p: &[[f64; 2]]| (p[1][0] - p[0][0]) * (0.5 * (p[0][1] + p[1][1]) - stress);
        self.points[up..].windows(2).map(trapezium).sum()
    }

    fn end(&self) -> f64 {
        self.points.last().expect("samples")[1]
    }

    fn displacement(&self) -> f64 {
        self.points.last().expect("samples")[0]
    }
}

/// Shear stiffness of the spring joint with the rock on both sides `[Pa/m]`.
const HELD: f64 = 1.0 / (1.0 / 2e8 + 0.1 / 7.2e9);

fn tan(degrees: f64) -> f64 {
    degrees.to_radians().tan()
}

/// The box of a deck under another pressure.
fn pressed(deck: &str, pressure: f64) -> Run {
    run(&edited(&example(deck), "pressure = 1e6 ", &format!("pressure = {pressure:e} ")))
}

#[test]
fn thick_joint_has_peak_and_residual_strength() {
    let case = of("v05_shear_thick");
    let stiffness = 2e7 / 0.001;
    for pressure in [0.5e6, 1e6, 2e6, 5e6] {
        let run = pressed(case.deck, pressure);
        let curve = Curve::of(&run);
        let under = format!("under {} MPa", pressure / 1e6);
        let is = |what: &str, exact: f64, computed: f64, tolerance| {
            check(case, &format!("{what}, {under}"), exact, computed, Relative(tolerance));
        };
        is("shear stiffness [Pa/m]", stiffness, curve.stiffness(), 1e-3);
        is("peak [Pa]", 1e6 + pressure * tan(30.0), curve.peak(), 5e-3);
        let residual = 0.1e6 + pressure * tan(25.0);
        is("residual [Pa]", residual, curve.residual(), 5e-3);
        let slip = curve.displacement() - residual / stiffness;
        is("opening / slip", tan(5.0), curve.risen / slip, 5e-3);
        assert_eq!([run.summary.failed_pairs.shear, run.summary.failed_pairs.tension], [9, 0]);
        closes(case, &format!(", {under}"), &run);
    }
}

#[test]
fn reversed_sliding_closes_dilation() {
    let case = of("v05_shear_thick");
    // To 0.5 mm and back to 0.
    let ramp = "history = { ramp = 0.02 }";
    let there_and_back = "history = { table = [[0, 0], [0.02, 1], [0.5, 1], [0.52, -1]] }";
    let text = edited(&example(case.deck), ramp, there_and_back);
    let text = edited(&text, "duration = 0.61 ", "duration = 1.01 ");
    // A rough joint chatters as it slides back down the slopes that it climbed: some pairs stick
    // briefly.
    for (dilation, tolerance) in [(0.0, 5e-3), (5.0, 2e-2)] {
        let dilated = format!("dilation = {dilation} ");
        let run = run(&edited(&text, "dilation = 5.0 ", &dilated));
        let curve = Curve::of(&run);
        assert!(
            curve.displacement().abs() < 1e-9,
            "it ends where it began: {}",
            curve.displacement()
        );
        let residual = 0.1e6 + 1e6 * tan(25.0);
        let what = format!("shear stress [Pa], slid back, dilation {dilation}°");
        check(case, &what, -residual, curve.residual(), Relative(tolerance));
        // The springs of the joint are strained backwards, so this much slip is left.
        let left = residual / (2e7 / 0.001) * tan(dilation);
        let what = format!("opening [m], slid back, dilation {dilation}°");
        check(case, &what, left, curve.risen, Absolute(1e-2 * 0.5e-3 * tan(5.0)));
        closes(case, &format!(", slid back, dilation {dilation}°"), &run);
    }
}

#[test]
fn spring_joint_has_peak_and_residual_strength() {
    dilates(of("v05_shear_spring"), &[0.5e6, 1e6, 2e6, 5e6]);
}

#[test]
fn joint_of_cells_has_peak_and_residual_strength() {
    dilates(of("cells_shear"), &[0.5e6, 1e6]);
}

/// Checks a rough spring joint between plates that keep their distance.
fn dilates(case: Case, pressures: &[f64]) {
    let normal = 1.0 / (1.0 / 6e8 + 0.1 / 21.6e9);
    for &pressure in pressures {
        let run = pressed(case.deck, pressure);
        let curve = Curve::of(&run);
        let is = |what: &str, exact: f64, computed: f64| {
            let what = format!("{what}, under {} MPa", pressure / 1e6);
            check(case, &what, exact, computed, Relative(5e-3));
        };
        is("shear stiffness [Pa/m]", HELD, curve.stiffness());
        is("peak [Pa]", 1e6 + pressure * tan(30.0), curve.peak());
        let pressed = pressure + normal * curve.displacement() * tan(5.0);
        let coupled = 1.0 + normal / HELD * tan(5.0) * tan(25.0);
        let end = (0.1e6 + pressed * tan(25.0)) / coupled;
        is("shear stress at the end [Pa]", end, curve.end());
        let opened = (curve.displacement() - end / HELD) * tan(5.0);
        is("pressure at the end [Pa]", pressure + normal * opened, run.last("box.z"));
        let failed = &run.summary.failed_pairs;
        assert_eq!([failed.shear, failed.tension], [run.summary.pairs, 0]);
        closes(case, &format!(", under {} MPa", pressure / 1e6), &run);
    }
}

/// Checks the linear softening of the cohesion: exact peak, residual and energies.
fn softens(case: Case, what: &str, run: &Run, stiffness: f64, residual_cohesion: f64, energy: f64) {
    let curve = Curve::of(run);
    let is = |quantity: &str, exact: f64, computed: f64, tolerance| {
        check(case, &format!("{quantity}, {what}"), exact, computed, Relative(tolerance));
    };
    let residual = residual_cohesion + 1e6 * tan(30.0);
    is("peak [Pa]", 1e6 + 1e6 * tan(30.0), curve.peak(), 5e-3);
    is("residual [Pa]", residual, curve.residual(), 5e-3);
    is("area above the residual [J/m²]", energy, curve.area_above(residual), 1e-2);
    let last = |name: &str| *run.energy.column(name).last().expect("a row");
    is("fracture [J]", energy, last("fracture"), 1e-2);
    let slip = curve.displacement() - residual / stiffness;
    is("friction [J]", residual * slip, last("friction"), 1e-2);
    closes(case, &format!(", {what}"), run);
}

#[test]
fn softening_dissipates_fracture_energy() {
    let case = of("v05_shear_softening");
    let run = run(&example(case.deck));
    softens(case, "spring joint", &run, HELD, 0.2e6, 1e4);
}

#[test]
fn softening_of_thick_joint_dissipates_fracture_energy() {
    let text =
        edited(&example("v05_shear_thick"), "dilation = 5.0", "fracture_energy = [100, 100] #");
    let text = edited(&text, "residual_friction = 25.0", "residual_friction = 30.0");
    softens(of("v05_shear_softening"), "thick joint", &run(&text), 2e10, 0.1e6, 100.0);
}

#[test]
fn rough_joint_has_barton_bandis_strength() {
    let case = of("barton_bandis");
    for pressure in [0.5e6, 1e6, 5e6] {
        let curve = Curve::of(&pressed(case.deck, pressure));
        let is = |what: &str, exact: f64, computed: f64| {
            let what = format!("{what} [Pa], under {} MPa", pressure / 1e6);
            check(case, &what, exact, computed, Relative(5e-3));
        };
        let angle = 28.0 + 10.0 * (50e6 / pressure).log10();
        is("peak", pressure * tan(angle), curve.peak());
        is("residual", pressure * tan(28.0), curve.residual());
        let stiffness = curve.stiffness();
        let what = format!("shear stiffness [Pa/m], under {} MPa", pressure / 1e6);
        check(case, &what, 2e10, stiffness, Relative(1e-3));
    }
    let text = edited(&example(case.deck), "jrc = 10.0", "jrc = 20.0");
    let text = edited(&text, "pressure = 1e6 ", "pressure = 0.1e6 ");
    let peak = Curve::of(&run(&text)).peak();
    let exact = 0.1e6 * tan(70.0);
    check(case, "peak [Pa], JRC 20, under 0.1 MPa", exact, peak, Relative(5e-3));
}
