//! Closest points of two edges.

use nalgebra::Vector3;

/// Square of the sine of the angle below which edges are parallel.
const PARALLEL: f64 = 1e-12;

/// Positions of the closest points of two segments, as fractions of their lengths in [0, 1]. For
/// parallel segments it is the middle of the length over which they run side by side.
pub fn nearest(a: [Vector3<f64>; 2], b: [Vector3<f64>; 2]) -> [f64; 2] {
    let (along_a, along_b, offset) = (a[1] - a[0], b[1] - b[0], b[0] - a[0]);
    let (aa, bb, ab) = (along_a.norm_squared(), along_b.norm_squared(), along_a.dot(&along_b));
    let (start, start_b) = (offset.dot(&along_a), offset.dot(&along_b));
    let determinant = aa * bb - ab * ab;
    let s = if determinant > PARALLEL * (aa * bb) {
        within((start * bb - start_b * ab) / determinant)
    } else {
        // Projections of the ends of b on a, in lengths of a.
        let (first, last) = (start / aa, (start + ab) / aa);
        within(0.5 * (first.min(last).max(0.0) + first.max(last).min(1.0)))
    };
    // Closest point of b to that point of a. Only if it is clamped to an end of b does the point of
    // a change.
    let t = (s * ab - start_b) / bb;
    if (0.0..=1.0).contains(&t) {
        return [s, t];
    }
    let t = within(t);
    [within((start + t * ab) / aa), t]
}

/// Number clamped to [0, 1]. NaN, from an edge without length, becomes 0.
fn within(x: f64) -> f64 {
    if x > 0.0 { x.min(1.0) } else { 0.0 }
}
