//! Outer faces that do not carry the in-situ stress.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use ddem_core::problem::{BlockFace, Geometry, Vec3};
use ddem_core::{Model, counted};

use super::BuiltDeck;
use crate::lint::{Code, Diagnostic};
use crate::schema::Where;

/// Fraction of the force on a plane that may be missing without a warning.
const SMALL: f64 = 1e-3;

const AXES: [&str; 3] = ["x", "y", "z"];

/// Required, applied and missing force on the outer faces of one plane `[N]`.
#[derive(Clone, Copy, Debug, Default)]
struct PlaneBalance {
    normal: Vec3,
    point: Vec3,
    area: f64,
    asked: f64,
    /// Sum of the required forces along the normal.
    pull: f64,
    lacking: Vec3,
    /// Sums of the absolute components (`sizes`) and of the norms (`lacks`) of the missing forces,
    /// which may cancel in `lacking`.
    sizes: Vec3,
    lacks: f64,
}

impl BuiltDeck {
    /// Warnings about planes whose supports and loads in the first stage do not carry the initial
    /// stress.
    pub(super) fn unbalanced_stress(&self, model: &Model) -> Vec<Diagnostic> {
        let (geometry, stresses) = (model.geometry(), &self.problem.stresses);
        // After an excavation its walls are free on purpose.
        if stresses.is_empty() || (0..model.n_blocks()).any(|block| model.is_removed(block)) {
            return Vec::new();
        }
        let mut given = self.given(model);
        let mut planes: BTreeMap<[i64; 4], PlaneBalance> = BTreeMap::new();
        let everywhere = self.selector(&Where::default());
        let surfaces = everywhere.surfaces(geometry);
        // The faces of a node share its load in proportion to the forces that they require. Each
        // node is therefore treated once.
        let mut asks: HashMap<u32, Vec<(BlockFace, Vec3, f64)>> = HashMap::new();
        for face in surfaces {
            for (node, area) in everywhere.areas(geometry, &face) {
                let x = Vec3::from(model.point(node as usize));
                let Some(stress) = stresses[face.block] else { continue };
                let force = stress.at(&x) * face.outward(geometry) * area;
                asks.entry(node).or_default().push((face, force, area));
            }
        }
        let mut nodes: Vec<_> = asks.into_iter().collect();
        nodes.sort_unstable_by_key(|(node, _)| *node);
        for (node, asked) in nodes {
            let (load, held) = given.remove(&node).unwrap_or_default();
            let whole: Vec3 = asked.iter().map(|(_, force, _)| force).sum();
            let mut lacking = whole - load;
            (0..3).filter(|&c| held[c]).for_each(|c| lacking[c] = 0.0);
            // The faces share a missing component in proportion to their requirements.
            let sizes: Vec3 = asked.iter().map(|(_, force, _)| force.abs()).sum();
            for (face, force, area) in asked {
                let part = |c: usize| if sizes[c] > 0.0 { force[c].abs() / sizes[c] } else { 0.0 };
                let lacking = Vec3::from([0, 1, 2].map(|c| lacking[c] * part(c)));
                let plane = planes.entry(plane_of(geometry, &face)).or_default();
                plane.normal = face.outward(geometry);
                plane.point = Vec3::from(model.point(node as usize));
                plane.area += area;
                plane.asked += force.norm();
                plane.pull += force.dot(&plane.normal);
                plane.lacking += lacking;
                plane.sizes += lacking.abs();
                plane.lacks += lacking.norm();
            }
        }
        // A free surface requires no more than rounding errors.
        let most = planes.values().fold(0.0, |most: f64, plane| most.max(plane.asked));
        let much = |plane: &PlaneBalance| plane.lacks > SMALL * plane.asked.max(SMALL * most);
        let wrong = planes.into_values().filter(much);
        wrong.map(|plane| plane.warning(&self.problem.properties.gravity)).collect()
    }

    /// Warning about blocks whose in-situ stress does not balance their weight.
    pub(super) fn unbalanced_weight(&self, model: &Model) -> Option<Diagnostic> {
        let stresses = &self.problem.stresses;
        let gravity = self.problem.properties.gravity;
        let wrong = |&block: &usize| {
            let Some(stress) = stresses[block] else { return false };
            let weight = gravity * self.density(model, block);
            let divergence = stress.divergence();
            (divergence + weight).norm() > SMALL * divergence.norm().max(weight.norm())
        };
        let wrong: Vec<usize> = (0..stresses.len()).filter(wrong).collect();
        let first = *wrong.first()?;
        let whole: BTreeSet<usize> = wrong.iter().map(|&block| model.whole_block(block)).collect();
        let required = -gravity * self.density(model, first);
        let [x, y, z] = required.map(|x| x + 0.0).into();
        let stress = stresses[first]?;
        let divergence = stress.divergence();
        // There is advice only for one axis, so that no other component of the gradient changes.
        let axis = required.iamax();
        let alone = required.norm() - required[axis].abs() <= 1e-9 * required.norm();
        let paste = (alone && (required - divergence).norm() > 0.0).then(|| {
            let mut slope = stress.gradient[axis];
            slope[axis] += (required - divergence)[axis];
            let (axis, slope) = (AXES[axis], slope.map(|x| rounded(x, 9)));
            format!("put `gradient = {{ {axis} = {slope:?} }}` into `[[initial]]`")
        });
        let message = format!(
            "the in-situ stress does not balance the weight of {}, first of block {} of set `{}`: \
             its divergence is ({:.4e}, {:.4e}, {:.4e}) N/m³, but the weight requires ({x:.4e}, {y:.4e}, {z:.4e})",
            counted(whole.len(), "block"),
            model.whole_block(first),
            model.set_name(first),
            divergence.x,
            divergence.y,
            divergence.z
        );
        let help = paste.unwrap_or_else(|| {
            "the divergence of `gradient` must be minus the density times `gravity`".to_owned()
        });
        Some(Diagnostic::warning(Code::UnbalancedWeight, "initial", message, help))
    }

    fn density(&self, model: &Model, block: usize) -> f64 {
        self.problem.properties.materials[usize::from(model.material(block))].density
    }

    /// Load at the start of the first stage and held directions, by node.
    fn given(&self, model: &Model) -> HashMap<u32, (Vec3, [bool; 3])> {
        let mut given: HashMap<u32, (Vec3, [bool; 3])> = HashMap::new();
        let factors = model.conditions().factors(0, 0.0, &[0.0]).unwrap_or_default();
        for (load, factor) in model.conditions().loaded.iter().zip(factors) {
            for (node, force) in &load.forces {
                given.entry(*node).or_default().0 += force * factor;
            }
        }
        for (node, axis) in self.problem.held(0) {
            given.entry(node).or_default().1[axis] = true;
        }
        given
    }
}

/// Key of the plane of a face; it is equal for faces in the same plane with the same normal.
fn plane_of(geometry: &Geometry, face: &BlockFace) -> [i64; 4] {
    let [low, high] = geometry.bounds;
    let normal = face.outward(geometry);
    let along = normal.dot(&(face.centre(geometry) - low)) / (high - low).norm();
    [normal.x, normal.y, normal.z, along].map(|x| (x * 1e6).round() as i64)
}

impl PlaneBalance {
    fn warning(&self, gravity: &Vec3) -> Diagnostic {
        let along = (0..3).find(|&c| self.normal[c].abs() > 1.0 - 1e-9);
        let faces = match along {
            Some(axis) => format!(
                "{} = {:.6} m, looking along {}{}",
                AXES[axis],
                self.point[axis],
                if self.normal[axis] > 0.0 { '+' } else { '-' },
                AXES[axis]
            ),
            None => format!("a plane through {:.4?} m", <[f64; 3]>::from(self.point)),
        };
        let [x, y, z] = self.lacking.into();
        let pulls = self.pull > 0.5 * self.asked;
        let sign =
            if pulls { ". The stress pulls on these faces: compression is negative" } else { "" };
        let message = format!(
            "the outer faces at {faces} do not carry the in-situ stress: [{x:.4e}, {y:.4e}, {z:.4e}] N are \
             missing, {:.2} % of what it requires; the model will move to another equilibrium{sign}",
            100.0 * self.lacks / self.asked
        );
        let help = match along.and_then(|axis| self.paste(axis, gravity)) {
            Some(lines) => format!("put in\n{lines}\n"),
            None => {
                "hold them with `[[fix]]`, or load them with the stress times the normal".to_owned()
            }
        };
        Diagnostic::warning(Code::UnbalancedStress, "initial", message, help)
    }

    /// Lines of a deck that carry the stress: a support along the missing components or, on faces
    /// that look up, a load if one load is enough.
    fn paste(&self, axis: usize, gravity: &Vec3) -> Option<String> {
        let selection =
            format!("where = {{ {} = {:?} }}", AXES[axis], rounded(self.point[axis], 9));
        if self.normal.dot(gravity) < 0.0 {
            let cancels = (self.sizes - self.lacking.abs()).norm() > SMALL * self.lacks;
            let traction = (self.lacking / self.area).map(|x| rounded(x, 6));
            let traction = <[f64; 3]>::from(traction);
            return (!cancels)
                .then(|| format!("  [[load]]\n  {selection}\n  traction = {traction:?}"));
        }
        let missing = |c: &usize| self.sizes[*c] > SMALL * self.lacks;
        let axes: String = (0..3).filter(missing).map(|c| AXES[c]).collect();
        Some(format!("  [[fix]]\n  {selection}\n  axes = \"{axes}\""))
    }
}

/// `x` rounded to a number of significant digits; 0 if it is not finite.
fn rounded(x: f64, digits: i32) -> f64 {
    if x == 0.0 || !x.is_finite() {
        return 0.0;
    }
    let scale = 10_f64.powi(digits - 1 - libm::log10(x.abs()).floor() as i32);
    (x * scale).round() / scale
}
