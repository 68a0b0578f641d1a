//! Free cells: one topples on an incline, and others strike a wall.

use nalgebra::{Matrix3, Vector3};

use super::energy::closes;
use super::record::Tolerance::Of;
use super::record::{Case, at_least, at_most, check, of};
use super::shared::{deck, edited, example, run, simulation};

/// Runs a deck with widths of the cell on both sides of the limit.
fn topples(case: Case, what: &str, text: &str) {
    let limit = 8.0 / 7.0 * 20_f64.to_radians().tan();
    for part in [1.03, 0.97] {
        let width = part * limit;
        let text = edited(text, "0.428445", &format!("{width:.6}"));
        let run = run(&edited(&text, "0.2142225", &format!("{:.7}", width / 2.0)));
        let what = format!("w = {part} w_limit, {what}");
        let leans = run.last("top.x");
        if part > 1.0 {
            // A part of the displacement that would bring the weight over the edge.
            let most = 0.1 * 7.0 / 18.0 * (part - 1.0) * limit * 9.0 / 4.0;
            let quantity = format!("{what}: leans, a tenth of what topples it [m]");
            at_most(case, &quantity, most, leans.abs());
            let speed = run.last("speed.x").abs();
            at_most(case, &format!("{what}: speed at the end [m/s]"), 1e-6, speed);
        } else {
            at_least(case, &format!("{what}: falls by [m]"), 0.02, leans);
        }
        closes(case, &format!(", {what}"), &run);
    }
}

#[test]
fn cell_with_sloping_back_topples() {
    let case = of("cells_topple");
    let text = example(case.deck);
    let seam = "\n[joints.seam]\nnormal_stiffness = 3e9\nshear_stiffness = 3e9\nfriction = 50.0\n\n[[region]]";
    let joined = text.replacen("\n[[region]]", seam, 1);
    let joined =
        edited(&joined, "material = \"rock\"\n", "material = \"rock\"\njoint = \"seam\"\n");
    topples(case, "2 divisions, in contact", &text);
    topples(case, "rigid, in contact", &edited(&text, "divisions = 2", "body = \"rigid\""));
    topples(case, "2 divisions, on a joint", &joined);
}

/// Density of the tetrahedra `[kg/m³]`, and the speed at which they fly `[m/s]`.
const DENSITY: f64 = 2400.0;
const SPEED: f64 = 5.0;

/// Tetrahedron of uniform density.
struct Tetrahedron {
    corners: [Vector3<f64>; 4],
    mass: f64,
}

impl Tetrahedron {
    fn new(corners: [[f64; 3]; 4]) -> Self {
        let corners = corners.map(Vector3::from);
        let [a, b, c] = [1, 2, 3].map(|k| corners[k] - corners[0]);
        Self { corners, mass: DENSITY * a.cross(&b).dot(&c).abs() / 6.0 }
    }

    /// Corners from the centre.
    fn arms(&self) -> [Vector3<f64>; 4] {
        let centre = self.corners.iter().sum::<Vector3<f64>>() / 4.0;
        self.corners.map(|corner| corner - centre)
    }

    /// Moments of inertia about the centre.
    fn inertia(&self) -> Matrix3<f64> {
        let second: Matrix3<f64> =
            self.arms().iter().map(|arm| arm * arm.transpose() * (self.mass / 20.0)).sum();
        Matrix3::from_diagonal_element(second.trace()) - second
    }

    /// Momentum and angular momentum about the centre after an elastic impact at a point, along x.
    fn after(&self, at: &Vector3<f64>) -> [Vector3<f64>; 2] {
        let turning = at.cross(&Vector3::x());
        let spin = self.inertia().try_inverse().expect("a solid body") * turning;
        let impulse = 2.0 * SPEED / (1.0 / self.mass + spin.cross(at).x);
        [Vector3::x() * (impulse - self.mass * SPEED), turning * impulse]
    }

    /// Text of its faces in a deck, with normals out of it.
    fn faces(&self) -> String {
        let [a, b, c, d] = &self.corners;
        let turns = (b - a).cross(&(c - a)).dot(&(d - a)) > 0.0;
        let faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
        let face = |[i, j, k]: [usize; 3]| {
            let [i, j, k] = if turns { [i, j, k] } else { [i, k, j] };
            let at = |corner: usize| <[f64; 3]>::from(self.corners[corner]);
            format!("{:?}", [i, j, k].map(at))
        };
        format!("[{}]", faces.map(face).join(", "))
    }
}

/// Momentum and angular momentum about the centre at the end of a flight, by the motion of the corners. The
/// velocities of a rigid body, or of linear deformation, are weighted like the positions in the inertia.
fn momenta(text: &str, body: &Tetrahedron) -> [Vector3<f64>; 2] {
    let stage = deck(text).stage[0].clone();
    let mut simulation = simulation(text);
    let steps = simulation
        .start(stage.damping.unwrap_or_default(), ddem_deck::TimeStep::Auto, stage.duration)
        .expect("a stable step");
    for _ in 0..steps {
        simulation.step().expect("finite numbers");
    }
    let velocities = simulation.velocities();
    let at = body.corners.map(|corner| {
        let near = |node: &usize| {
            let point = Vector3::from(simulation.model().point(*node));
            (point - corner).norm() < 1e-6
        };
        let node = (0..velocities.len()).find(near).expect("a node at each corner");
        let moved = corner + Vector3::from(simulation.displacement(node));
        (moved, Vector3::from(velocities[node]))
    });
    let centre = at.iter().map(|(x, _)| x).sum::<Vector3<f64>>() / 4.0;
    let mean = at.iter().map(|(_, v)| v).sum::<Vector3<f64>>() / 4.0;
    let turning: Vector3<f64> = at.iter().map(|(x, v)| (x - centre).cross(&(v - mean))).sum();
    [mean * body.mass, turning * (body.mass / 20.0)]
}

#[test]
fn rigid_tetrahedron_rebounds_as_from_one_impulse() {
    let case = of("cells_strike");
    let text = example(case.deck);
    let (from, to) = (
        text.find("faces = ").expect("faces"),
        text.find("]                                  # m"),
    );
    let to = to.expect("the end of the faces") + 1;
    let vertex = Tetrahedron::new([
        [0.002, 0.2, 0.15],
        [0.45, -0.25, 0.3],
        [0.5, 0.35, 0.1],
        [0.4, 0.05, -0.35],
    ]);
    let edge = Tetrahedron::new([
        [0.002, -0.2, -0.15],
        [0.002, 0.2, -0.15],
        [0.5, 0.0, 0.3],
        [0.4, 0.0, -0.1],
    ]);
    let struck = [vertex.arms()[0], (edge.arms()[0] + edge.arms()[1]) / 2.0];
    for ((what, body), at) in [("vertex", vertex), ("edge", edge)].into_iter().zip(struck) {
        let text = format!("{}faces = {}{}", &text[..from], body.faces(), &text[to..]);
        let [momentum, angular] = momenta(&text, &body);
        let [exact, exact_angular] = body.after(&at);
        let size = body.mass * SPEED;
        check(
            case,
            &format!("momentum, {what} [kg m/s]"),
            0.0,
            (momentum - exact).norm(),
            Of(size, 2e-3),
        );
        let off = (angular - exact_angular).norm();
        let size = exact_angular.norm();
        check(case, &format!("angular momentum, {what} [kg m²/s]"), 0.0, off, Of(size, 5e-3));
        closes(case, &format!(", {what}"), &run(&text));
    }
}
