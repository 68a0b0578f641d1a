//! Geometry of a `where`, with tests for points and faces.

use std::sync::Arc;

use super::orientation::OrientationFilter;
use super::sets;
use super::solid::Solid;
use super::terrain::Terrain;
use crate::schema::{Extent, Plane, Sheet, Where};
use ddem_core::problem::{Sets, Vec3};

/// Plane: the points with `normal·x = at`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PlaneEquation {
    /// Unit vector.
    pub(crate) normal: Vec3,
    /// Position along the normal `[m]`.
    pub(crate) at: f64,
    /// Largest distance of points that count as on the plane `[m]`.
    pub(crate) tolerance: f64,
}

impl PlaneEquation {
    /// Distance of a point, positive on the side of the normal `[m]`.
    pub(crate) fn signed_distance(&self, x: &Vec3) -> f64 {
        self.normal.dot(x) - self.at
    }

    pub(crate) fn has(&self, x: &Vec3) -> bool {
        self.signed_distance(x).abs() <= self.tolerance
    }

    /// Axis along which the normal points, in either direction; `None` for an oblique plane.
    fn axis(&self) -> Option<usize> {
        (0..3).find(|&axis| (0..3).all(|k| k == axis || self.normal[k] == 0.0))
    }
}

/// Stands for a set that is not among those of the selection: it has nothing there.
const NO_SET: usize = usize::MAX;

/// A `where` with its tolerances and the index of its set.
#[derive(Clone, Debug)]
pub(crate) struct Selector {
    /// Ranges along the coordinate axes `[m]`.
    pub(super) ranges: [Option<[f64; 2]>; 3],
    /// Planes; a selected point lies on all of them.
    pub(super) planes: Vec<PlaneEquation>,
    /// Bounds of half-spaces; a selected point is not on the side to which their normals point.
    pub(super) half_spaces: Vec<PlaneEquation>,
    pub(super) sphere: Option<(Vec3, f64)>,
    /// Centres of the ends, and radius.
    pub(super) cylinder: Option<([Vec3; 2], f64)>,
    pub(super) solid: Option<Arc<Solid>>,
    /// Topographies, each with true if the space above it is selected.
    pub(super) terrains: Vec<(Terrain, bool)>,
    pub(super) facing: Option<OrientationFilter>,
    pub(super) set: Option<usize>,
    /// 1e-6 of the size of the sets along each axis `[m]`.
    pub(crate) tolerance: [f64; 3],
}

impl Selector {
    pub(crate) fn new(selector: &Where, sets: &Sets) -> Self {
        let size = sets.bounds[1] - sets.bounds[0];
        let named = |name: &str| {
            let known = sets.list.iter().position(|s| s.name.as_deref() == Some(name));
            known.unwrap_or(NO_SET)
        };
        let mut made = Self {
            ranges: [None; 3],
            planes: Vec::new(),
            half_spaces: Vec::new(),
            sphere: selector.sphere.map(|s| (Vec3::from(s.centre), s.radius)),
            cylinder: selector.cylinder.map(|c| ([c.from, c.to].map(Vec3::from), c.radius)),
            solid: None,
            terrains: Vec::new(),
            facing: OrientationFilter::new(selector),
            set: selector.set.as_deref().map(named),
            // A flat model still has a size: a small fraction of its longest side.
            tolerance: [0, 1, 2].map(|k| 1e-6 * size[k].max(1e-3 * size.max())),
        };
        for (axis, extent) in [selector.x, selector.y, selector.z].into_iter().enumerate() {
            match extent {
                Some(Extent::Plane(at)) => made.planes.push(made.flat(Vec3::ith(axis, 1.0), at)),
                Some(Extent::Range(range)) => made.ranges[axis] = Some(range),
                None => {}
            }
        }
        let plane = selector.plane.as_ref().map(|plane| made.flat_of(plane));
        made.planes.extend(plane);
        let set = sets.list.get(made.set.unwrap_or(0));
        let side = selector.side.zip(set).map(|(side, set)| sets::side(set, side));
        let side = side.map(|(normal, at)| made.flat(normal, at));
        made.planes.extend(side);
        for (sheet, above) in [(&selector.above, true), (&selector.below, false)] {
            match sheet {
                Some(Sheet::Level(z)) => made.bound(made.flat(Vec3::z(), *z), above),
                Some(Sheet::Plane(plane)) => made.bound(made.flat_of(plane).upright(), above),
                Some(Sheet::Topography { topography }) => {
                    made.terrains.push((Terrain::new(topography.content.clone()), above));
                }
                None => {}
            }
        }
        let triangles = selector.inside.as_ref().and_then(|file| file.content.as_ref());
        made.solid = triangles.map(|all| Arc::new(Solid::new(&all.mesh(), made.clear())));
        made
    }

    fn flat(&self, normal: Vec3, at: f64) -> PlaneEquation {
        let tolerance = (0..3).map(|k| normal[k].abs() * self.tolerance[k]).sum();
        PlaneEquation { normal, at, tolerance }
    }

    fn flat_of(&self, plane: &Plane) -> PlaneEquation {
        let normal = Vec3::from(plane.unit_normal());
        self.flat(normal, normal.dot(&Vec3::from(plane.point)))
    }

    /// Adds the half-space above or below a plane. It becomes a range if the plane is normal to an
    /// axis and no plane is given on that axis.
    fn bound(&mut self, flat: PlaneEquation, above: bool) {
        let out = if above { -1.0 } else { 1.0 };
        let on_plane = |axis: usize| {
            self.planes.iter().any(|plane| plane.axis() == Some(axis))
                && self.ranges[axis].is_none()
        };
        let Some(axis) = flat.axis().filter(|&axis| !on_plane(axis)) else {
            self.half_spaces.push(PlaneEquation {
                normal: flat.normal * out,
                at: flat.at * out,
                ..flat
            });
            return;
        };
        let sign = flat.normal[axis];
        let at = flat.at * sign;
        let [from, to] = self.ranges[axis].unwrap_or([f64::NEG_INFINITY, f64::INFINITY]);
        let lower = (out * sign) < 0.0;
        self.ranges[axis] = Some(if lower { [from.max(at), to] } else { [from, to.min(at)] });
    }

    pub(crate) fn has_set(&self, set: usize) -> bool {
        self.set.is_none_or(|own| own == set)
    }

    pub(super) fn range(&self, axis: usize) -> Option<[f64; 2]> {
        self.ranges[axis]
    }

    /// True if a sphere or a cylinder is given.
    pub(crate) fn is_round(&self) -> bool {
        self.sphere.is_some() || self.cylinder.is_some()
    }

    /// Number of planes that are given.
    pub(crate) fn planes(&self) -> usize {
        self.planes.len()
    }

    /// True if a point lies in the ranges and the shapes; planes do not count.
    pub(crate) fn in_ranges(&self, x: &Vec3) -> bool {
        self.in_ranges_alone(x) && self.in_shapes(x)
    }

    fn in_ranges_alone(&self, x: &Vec3) -> bool {
        (0..3).all(|axis| {
            self.range(axis).is_none_or(|[from, to]| {
                x[axis] >= from - self.tolerance[axis] && x[axis] <= to + self.tolerance[axis]
            })
        })
    }

    /// Part of a box that may contain points of the ranges, the sphere and the cylinder; `None` if
    /// there is no such part.
    pub(crate) fn part_of(&self, [low, high]: &[Vec3; 2]) -> Option<[Vec3; 2]> {
        let (mut low, mut high) = (*low, *high);
        let sphere = self.sphere.map(|(centre, radius)| ([centre; 2], radius));
        for ([a, b], radius) in sphere.into_iter().chain(self.cylinder) {
            let reach = radius + 2.0 * self.clear();
            low = low.sup(&a.inf(&b).add_scalar(-reach));
            high = high.inf(&a.sup(&b).add_scalar(reach));
        }
        for axis in 0..3 {
            let Some([from, to]) = self.range(axis) else { continue };
            low[axis] = low[axis].max(from - self.tolerance[axis]);
            high[axis] = high[axis].min(to + self.tolerance[axis]);
        }
        (0..3).all(|axis| low[axis] <= high[axis]).then_some([low, high])
    }

    pub(crate) fn contains(&self, x: &Vec3) -> bool {
        self.in_ranges(x) && self.on_planes(x)
    }

    /// True if a face with this centre and normal belongs to the selector.
    pub(crate) fn contains_face(&self, centre: &Vec3, normal: &Vec3) -> bool {
        self.faces(normal) && self.contains(centre)
    }

    /// True if a face with this normal has the given orientation.
    pub(super) fn faces(&self, normal: &Vec3) -> bool {
        self.facing.is_none_or(|facing| facing.has(normal))
    }

    pub(crate) fn on_planes(&self, x: &Vec3) -> bool {
        self.planes.iter().all(|plane| plane.has(x))
    }

    /// True if a point lies in all shapes that are not aligned with the axes.
    pub(super) fn in_shapes(&self, x: &Vec3) -> bool {
        self.in_firm_shapes(x)
            && self.terrains.iter().all(|(terrain, above)| {
                let height = terrain.height(x, self.clear());
                let over = height.map(|height| if *above { x.z - height } else { height - x.z });
                over.is_some_and(|over| over >= -self.tolerance[2])
            })
    }

    /// True if a point lies in all shapes except the topographies.
    fn in_firm_shapes(&self, x: &Vec3) -> bool {
        self.beyond_round(x) <= self.clear()
            && self
                .half_spaces
                .iter()
                .all(|half_space| half_space.signed_distance(x) <= half_space.tolerance)
            && self.solid.as_ref().is_none_or(|solid| solid.contains(x))
    }

    /// True if only the height of a topography decides whether a point belongs to the selector.
    pub(super) fn asks_heights_at(&self, x: &Vec3) -> bool {
        self.in_ranges_alone(x) && self.in_firm_shapes(x)
    }

    /// Largest distance from a shape at which points still count as inside `[m]`.
    pub(super) fn clear(&self) -> f64 {
        self.tolerance.iter().fold(f64::MAX, |a, &b| a.min(b))
    }

    /// Distance of a point from the sphere or the cylinder `[m]`, 0 inside.
    pub(super) fn beyond_round(&self, x: &Vec3) -> f64 {
        let sphere = self.sphere.map_or(0.0, |(centre, radius)| (x - centre).norm() - radius);
        let cylinder = self.cylinder.map_or(0.0, |([from, to], radius)| {
            let length = (to - from).norm();
            let axis = (to - from) / length;
            let along = (x - from).dot(&axis);
            let aside = (x - from - axis * along).norm() - radius;
            aside.max(-along).max(along - length)
        });
        sphere.max(cylinder).max(0.0)
    }

    /// Largest distance of a point from the shapes `[m]`, 0 inside. For a closed surface it is the
    /// distance from its box.
    pub(super) fn beyond_shapes(&self, x: &Vec3) -> f64 {
        let half_spaces = self.half_spaces.iter().map(|half_space| half_space.signed_distance(x));
        let solid = self.solid.iter().map(|solid| solid.outside_box(x));
        let terrains = self.terrains.iter().map(|(terrain, above)| {
            let height = terrain.height(x, self.clear()).unwrap_or(x.z);
            if *above { height - x.z } else { x.z - height }
        });
        half_spaces.chain(solid).chain(terrains).fold(self.beyond_round(x), f64::max)
    }
}

impl PlaneEquation {
    /// Same plane with its normal upward. The normal of a vertical plane is unchanged.
    fn upright(self) -> Self {
        // Rounding errors must not flip the normal of a vertical plane.
        if self.normal.z >= -1e-12 {
            return self;
        }
        Self { normal: -self.normal, at: -self.at, ..self }
    }
}
