//! Part of a quadrilateral that lies over another one in the plane, with points and areas for sums
//! over it.

#[cfg(test)]
mod tests;

/// Point of the plane `[m]`.
pub(super) type Point = [f64; 2];

/// Vertex of the part of a quadrilateral that lies over an outline.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Vertex {
    /// Position in the plane `[m]`.
    pub at: Point,
    /// Bilinear coordinates in the quadrilateral, each in [0, 1].
    pub on: [f64; 2],
    /// Share of the area `[m²]`.
    pub area: f64,
}

/// Largest number of vertices of the intersection of two convex quadrilaterals.
const MOST: usize = 8;

/// Convex polygon.
#[derive(Clone, Copy, Debug)]
pub struct Polygon {
    vertices: [Vertex; MOST],
    len: usize,
}

/// Side of an outline.
#[derive(Clone, Copy)]
struct OutlineSide {
    from: Point,
    /// Inward normal, as long as the side.
    inward: Point,
    /// Tolerance times the length of the side.
    slack: f64,
}

/// Distance within which vertices are merged, as a fraction of the size.
const SAME: f64 = 1e-9;
/// Distance by which a point may lie outside and still count as inside, as a fraction of the size.
/// Without it rounding would cut faces of equal size that lie on each other.
const OUTSIDE: f64 = 1e-10;
/// Area that counts as zero, as a fraction of the squared size.
const NO_AREA: f64 = 1e-13;
/// Tolerance as a fraction of the size: of the deviation from a parallelogram, and of a point whose
/// bilinear coordinates are computed.
const EXACT: f64 = 1e-13;

impl Polygon {
    const EMPTY: Self =
        Self { vertices: [Vertex { at: [0.0; 2], on: [0.0; 2], area: 0.0 }; MOST], len: 0 };

    /// Vertices around the polygon, in the order of the quadrilateral.
    #[inline(always)]
    pub fn as_slice(&self) -> &[Vertex] {
        &self.vertices[..self.len]
    }

    /// Corners and inner points whose areas integrate quadratic functions exactly. Each triangle
    /// gives 1/12 of its area to each corner and 3/4 to its centroid.
    pub fn squares(&self) -> (Vec<Vertex>, Vec<Vertex>) {
        let mut corners: Vec<Vertex> =
            self.as_slice().iter().map(|vertex| Vertex { area: 0.0, ..*vertex }).collect();
        let mut inside = Vec::new();
        for i in 1..corners.len().saturating_sub(1) {
            let triangle = [0, i, i + 1];
            let [a, b, c] = triangle.map(|k| corners[k]);
            let area = 0.5 * cross(minus(b.at, a.at), minus(c.at, a.at)).abs();
            let mean = |of: &dyn Fn(&Vertex) -> Point| {
                [0, 1].map(|k| (of(&a)[k] + of(&b)[k] + of(&c)[k]) / 3.0)
            };
            inside.push(Vertex { at: mean(&|v| v.at), on: mean(&|v| v.on), area: 0.75 * area });
            triangle.into_iter().for_each(|k| corners[k].area += area / 12.0);
        }
        (corners, inside)
    }

    /// Area `[m²]`.
    #[cfg(test)]
    pub(super) fn area(&self) -> f64 {
        self.as_slice().iter().map(|vertex| vertex.area).sum()
    }

    /// Quadrilateral before any cut.
    #[inline(always)]
    fn from_quad(quad: &[Point; 4]) -> Self {
        let mut polygon = Self::EMPTY;
        for ((vertex, &at), on) in polygon.vertices.iter_mut().zip(quad).zip(CORNERS) {
            *vertex = Vertex { at, on, area: 0.0 };
        }
        polygon.len = 4;
        polygon
    }

    /// Adds a vertex. A full polygon ignores it, which only a nonconvex quadrilateral can cause.
    #[inline(always)]
    fn push(&mut self, vertex: Vertex) {
        if let Some(free) = self.vertices.get_mut(self.len) {
            *free = vertex;
            self.len += 1;
        }
    }

    /// Stores the part inside a side in `inside`.
    #[inline(always)]
    fn cut(&self, side: &OutlineSide, inside: &mut Self) {
        inside.len = 0;
        let Some(mut last) = self.as_slice().last() else { return };
        let mut last_height = side.height(last.at);
        for vertex in self.as_slice() {
            let height = side.height(vertex.at);
            match (last_height >= -side.slack, height >= -side.slack) {
                (true, false) => inside.push(crossing(last, vertex, last_height, height)),
                (false, true) => inside.push(crossing(vertex, last, height, last_height)),
                _ => {}
            }
            if height >= -side.slack {
                inside.push(*vertex);
            }
            (last, last_height) = (vertex, height);
        }
    }

    /// Merges vertices that are closer than `same`.
    #[inline(always)]
    fn merge(&mut self, same: f64) {
        let are_distinct = |a: Point, b: Point| (a[0] - b[0]).abs().max((a[1] - b[1]).abs()) > same;
        let mut len = 0;
        for i in 0..self.len {
            if len == 0 || are_distinct(self.vertices[i].at, self.vertices[len - 1].at) {
                self.vertices[len] = self.vertices[i];
                len += 1;
            }
        }
        while len > 1 && !are_distinct(self.vertices[len - 1].at, self.vertices[0].at) {
            len -= 1;
        }
        self.len = len;
    }

    /// Sets the areas of the vertices: half of the two adjacent triangles with the centroid. Sums
    /// of linear functions are then exact, and they do not jump when vertices split or merge. A
    /// polygon without area becomes empty.
    #[inline(always)]
    fn share(&mut self, no_area: f64) {
        let len = self.len;
        if len < 3 {
            self.len = 0;
            return;
        }
        // Relative to a vertex, so that the area of a small polygon far from the origin is exact.
        let origin = self.vertices[0].at;
        let (mut twice, mut first) = (0.0, [0.0; 2]);
        for i in 1..len - 1 {
            let (u, v) =
                (minus(self.vertices[i].at, origin), minus(self.vertices[i + 1].at, origin));
            let triangle = cross(u, v);
            twice += triangle;
            first = [first[0] + triangle * (u[0] + v[0]), first[1] + triangle * (u[1] + v[1])];
        }
        let some = twice.abs() > no_area;
        if !some {
            self.len = 0;
            return;
        }
        let third = 1.0 / (3.0 * twice);
        let centroid = [origin[0] + first[0] * third, origin[1] + first[1] * third];
        let quarter = if twice > 0.0 { 0.25 } else { -0.25 };
        let mut last = len - 1;
        for i in 0..len {
            let (u, v) = (self.vertices[last].at, self.vertices[i].at);
            let triangle = cross(minus(u, centroid), minus(v, centroid));
            let area = (quarter * triangle).max(0.0);
            self.vertices[last].area += area;
            self.vertices[i].area += area;
            last = i;
        }
    }
}

impl OutlineSide {
    /// Height over the side, times the length of the side.
    #[inline(always)]
    fn height(&self, at: Point) -> f64 {
        let from = minus(at, self.from);
        self.inward[0] * from[0] + self.inward[1] * from[1]
    }
}

/// Vertex at which the line from an inside to an outside vertex crosses a side.
#[inline(always)]
fn crossing(inside: &Vertex, outside: &Vertex, height: f64, below: f64) -> Vertex {
    let t = (height / (height - below)).max(0.0);
    let mix = |x: Point, y: Point| [x[0] + t * (y[0] - x[0]), x[1] + t * (y[1] - x[1])];
    Vertex { at: mix(inside.at, outside.at), on: mix(inside.on, outside.on), area: 0.0 }
}

#[inline(always)]
fn minus(a: Point, b: Point) -> Point {
    [a[0] - b[0], a[1] - b[1]]
}

#[inline(always)]
fn cross(a: Point, b: Point) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

/// Sum of the absolute components of the diagonals.
#[inline(always)]
fn size(quad: &[Point; 4]) -> f64 {
    let (u, v) = (minus(quad[2], quad[0]), minus(quad[3], quad[1]));
    u[0].abs() + u[1].abs() + v[0].abs() + v[1].abs()
}

/// Part of a convex quadrilateral inside a convex outline. The corners of both may run in either
/// sense. Those of the quadrilateral are at (0, 0), (1, 0), (1, 1), (0, 1) of its bilinear
/// coordinates.
pub fn overlap(quad: &[Point; 4], outline: &[Point; 4]) -> Polygon {
    let size = size(quad);
    let Some(sides) = sides(outline, size) else { return Polygon::EMPTY };
    let mut polygon = Polygon::from_quad(quad);
    let mut cuts = [false; 4];
    for (side, cuts) in sides.iter().zip(&mut cuts) {
        let inside = quad.map(|corner| side.height(corner) >= -side.slack);
        if inside == [false; 4] {
            return Polygon::EMPTY;
        }
        *cuts = inside != [true; 4];
    }
    if cuts != [false; 4] {
        let mut spare = Polygon::EMPTY;
        let (mut whole, mut part) = (&mut polygon, &mut spare);
        for (side, _) in sides.iter().zip(cuts).filter(|(_, cuts)| *cuts) {
            whole.cut(side, part);
            (whole, part) = (part, whole);
        }
        polygon = *whole;
        polygon.merge(SAME * size);
    }
    polygon.share(NO_AREA * size * size);
    locate(&mut polygon, quad, size);
    polygon
}

/// Sides of an outline; `None` if it has no area.
#[inline(always)]
fn sides(outline: &[Point; 4], of_quad: f64) -> Option<[OutlineSide; 4]> {
    let twice = cross(minus(outline[2], outline[0]), minus(outline[3], outline[1]));
    let size = size(outline);
    let sign = if twice > 0.0 { 1.0 } else { -1.0 };
    (twice.abs() > NO_AREA * size * size).then(|| {
        [0, 1, 2, 3].map(|k| {
            let along = minus(outline[(k + 1) % 4], outline[k]);
            let slack = OUTSIDE * of_quad * (along[0].abs() + along[1].abs());
            OutlineSide { from: outline[k], inward: [-along[1] * sign, along[0] * sign], slack }
        })
    })
}

/// Corrects the bilinear coordinates of outline corners in a quadrilateral that is not a
/// parallelogram. There they are not linear between points of its edges.
#[inline(always)]
fn locate(polygon: &mut Polygon, quad: &[Point; 4], size: f64) {
    let map = Bilinear::new(quad);
    if map.warp[0].abs() + map.warp[1].abs() <= EXACT * size {
        return;
    }
    for vertex in &mut polygon.vertices[..polygon.len] {
        let inside = |x: f64| x > 0.0 && x < 1.0;
        if inside(vertex.on[0]) && inside(vertex.on[1]) {
            vertex.on = map.invert(vertex.at, vertex.on).map(|x| x.clamp(0.0, 1.0));
        }
    }
}

/// Bilinear coordinates of the corners.
const CORNERS: [[f64; 2]; 4] = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];

/// Map from bilinear coordinates to a quadrilateral: corner + ξ·along + η·up + ξη·warp.
struct Bilinear {
    corner: Point,
    along: Point,
    up: Point,
    warp: Point,
    /// Tolerance of a point `[m]`.
    exact: f64,
}

impl Bilinear {
    #[inline(always)]
    fn new(quad: &[Point; 4]) -> Self {
        let [a, b, c, d] = *quad;
        let exact = EXACT * size(quad);
        Self {
            corner: a,
            along: minus(b, a),
            up: minus(d, a),
            warp: minus(minus(c, d), minus(b, a)),
            exact,
        }
    }

    /// Coordinates of a point, by Newton's method from a guess.
    #[inline(always)]
    fn invert(&self, at: Point, mut on: [f64; 2]) -> [f64; 2] {
        let (p, q, w) = (self.along, self.up, self.warp);
        let from = minus(at, self.corner);
        for _ in 0..MOST_STEPS {
            let [x, y] = on;
            let left = [0, 1].map(|i| from[i] - (x * p[i] + y * q[i] + x * y * w[i]));
            if left[0].abs() + left[1].abs() <= self.exact {
                break;
            }
            let by_x = [p[0] + y * w[0], p[1] + y * w[1]];
            let by_y = [q[0] + x * w[0], q[1] + x * w[1]];
            let inverse = 1.0 / cross(by_x, by_y);
            let new = [x + cross(left, by_y) * inverse, y + cross(by_x, left) * inverse];
            if !(new[0].is_finite() && new[1].is_finite()) {
                break;
            }
            on = new.map(|x| x.clamp(-0.5, 1.5));
        }
        on
    }
}

/// Largest number of Newton steps. The faces of blocks need two or three, those that are nearly
/// triangles some more.
const MOST_STEPS: usize = 40;

/// Bilinear coordinates of a point in a convex quadrilateral, or slightly outside. Each coordinate
/// is limited to [−0.5, 1.5].
pub fn bilinear(quad: &[Point; 4], at: Point) -> [f64; 2] {
    // The first step from the middle is the affine map.
    Bilinear::new(quad).invert(at, [0.5; 2])
}

/// Weights of the corners at bilinear coordinates.
#[inline(always)]
pub fn weights([x, y]: [f64; 2]) -> [f64; 4] {
    [(1.0 - x) * (1.0 - y), x * (1.0 - y), x * y, (1.0 - x) * y]
}
