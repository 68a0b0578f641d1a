//! Block theory: which blocks can move out of a free face, how, and how near they are to it.

use nalgebra::Vector3;

/// Part of a normal, of a force relative to the weight, or of a direction that counts as zero.
const ZERO: f64 = 1e-9;

/// Face of a block on a joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointFace {
    /// Unit normal, outward.
    pub normal: Vector3<f64>,
    /// Area `[m²]`.
    pub area: f64,
    /// Cohesion `[Pa]`.
    pub cohesion: f64,
    /// Tangent of the friction angle.
    pub tan_friction: f64,
}

/// First motion of a block that its weight moves without friction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FirstMotion {
    /// Faces on which it slides, none if it falls: their numbers and normal forces `[N]`.
    pub on: [Option<(usize, f64)>; 2],
    /// Unit vector of the motion.
    pub direction: Vector3<f64>,
    /// Part of the weight that drives it `[N]`.
    pub driving: f64,
}

/// Faces with equal normals as one: their areas, and the mean of their strengths by area.
#[must_use]
pub fn merged_faces(faces: &[JointFace]) -> Vec<JointFace> {
    let mut merged: Vec<JointFace> = Vec::new();
    for face in faces.iter().filter(|face| face.area > 0.0) {
        let same = |other: &&mut JointFace| (other.normal - face.normal).norm() < ZERO;
        let Some(known) = merged.iter_mut().find(same) else {
            merged.push(*face);
            continue;
        };
        let area = known.area + face.area;
        let mean = |a: f64, b: f64| (a * known.area + b * face.area) / area;
        let (cohesion, tan_friction) =
            (mean(known.cohesion, face.cohesion), mean(known.tan_friction, face.tan_friction));
        *known = JointFace { area, cohesion, tan_friction, ..*known };
    }
    merged
}

impl FirstMotion {
    /// Motion of a block with faces on joints under a force `[N]`; `None` if the joints keep it in
    /// place even without friction. All faces have different normals.
    ///
    /// A direction s is free if s·n ≤ 0 for all outward normals n. The block moves in the free
    /// direction nearest to the force: along it, or along one face or two, which the force presses.
    #[must_use]
    pub fn new(force: &Vector3<f64>, faces: &[JointFace]) -> Option<Self> {
        let weight = force.norm();
        let slack = ZERO * weight;
        let free = |s: &Vector3<f64>, on: [Option<usize>; 2]| {
            let others = faces.iter().enumerate().filter(|(k, _)| !on.contains(&Some(*k)));
            others.fold(true, |free, (_, face)| free && s.dot(&face.normal) <= ZERO * s.norm())
        };
        let made = |s: Vector3<f64>, on: [Option<(usize, f64)>; 2]| {
            let direction = s / s.norm();
            Self { on, direction, driving: force.dot(&direction) }
        };
        if weight > 0.0 && free(force, [None; 2]) {
            return Some(made(*force, [None; 2]));
        }
        for (i, face) in faces.iter().enumerate() {
            let pressed = force.dot(&face.normal);
            let along = force - face.normal * pressed;
            if pressed > slack && along.norm() > slack && free(&along, [Some(i), None]) {
                return Some(made(along, [Some((i, pressed)), None]));
            }
        }
        for (i, a) in faces.iter().enumerate() {
            for (j, b) in faces.iter().enumerate().skip(i + 1) {
                let line = a.normal.cross(&b.normal);
                let (cosine, sine) = (a.normal.dot(&b.normal), line.norm_squared());
                if sine <= ZERO * ZERO {
                    continue;
                }
                let along = line * (force.dot(&line) / sine);
                let [on_a, on_b] = [&a.normal, &b.normal].map(|normal| force.dot(normal));
                let (press_a, press_b) =
                    ((on_a - cosine * on_b) / sine, (on_b - cosine * on_a) / sine);
                let pressed = press_a > slack && press_b > slack && along.norm() > slack;
                if pressed && free(&along, [Some(i), Some(j)]) {
                    return Some(made(along, [Some((i, press_a)), Some((j, press_b))]));
                }
            }
        }
        None
    }

    /// Factor of safety by limit equilibrium, Σ(c A + N tan φ)/(r·ŝ), over the faces on which the
    /// block slides; 0 if it falls.
    #[must_use]
    pub fn factor(&self, faces: &[JointFace]) -> f64 {
        let holds = |(face, pressed): (usize, f64)| {
            let face = &faces[face];
            face.cohesion * face.area + pressed * face.tan_friction
        };
        // The sum of no numbers is −0.
        self.on.into_iter().flatten().map(holds).fold(0.0, |sum, force| sum + force) / self.driving
    }
}
