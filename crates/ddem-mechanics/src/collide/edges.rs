//! The closest points of two edges.

use nalgebra::Vector3;

/// Square of the sine of the angle below which edges are parallel.
const PARALLEL: f64 = 1e-12;

/// Closest points of two segments: how far along each, in [0, 1]. For parallel ones the middle of
/// the length that they run beside each other.
pub fn nearest(a: [Vector3<f64>; 2], b: [Vector3<f64>; 2]) -> [f64; 2] {
    let (along_a, along_b, apart) = (a[1] - a[0], b[1] - b[0], b[0] - a[0]);
    let (aa, bb, ab) = (along_a.norm_squared(), along_b.norm_squared(), along_a.dot(&along_b));
    let (start, start_b) = (apart.dot(&along_a), apart.dot(&along_b));
    let determinant = aa * bb - ab * ab;
    let s = if determinant > PARALLEL * (aa * bb) {
        within((start * bb - start_b * ab) / determinant)
    } else {
        // From where to where b runs beside a, in lengths of a.
        let (first, last) = (start / aa, (start + ab) / aa);
        within(0.5 * (first.min(last).max(0.0) + first.max(last).min(1.0)))
    };
    // The closest of b to that, and of a to this: the same point again unless an end was in the way.
    let t = (s * ab - start_b) / bb;
    if (0.0..=1.0).contains(&t) {
        return [s, t];
    }
    let t = within(t);
    [within((start + t * ab) / aa), t]
}

/// Into [0, 1]; 0 for what is not a number: the edge has no length.
fn within(x: f64) -> f64 {
    if x > 0.0 { x.min(1.0) } else { 0.0 }
}
