//! Principal stresses.

/// Steps of Newton's method from the largest possible root; each squares the error.
const STEPS: usize = 5;

/// Least and largest principal stress of xx yy zz xy yz zx.
///
/// Newton's method finds the root of the deviator's polynomial `x³ − J₂ x − J₃` that lies apart
/// from the other two. The remaining quadratic gives these. Only square roots are needed, so that
/// the bits are the same on every processor.
pub fn principal(stress: &[f64; 6]) -> [f64; 2] {
    let [xx, yy, zz, xy, yz, zx] = *stress;
    let mean = (xx + yy + zz) / 3.0;
    let [a, b, c] = [xx - mean, yy - mean, zz - mean];
    let second = 0.5 * (a * a + b * b + c * c) + xy * xy + yz * yz + zx * zx;
    if second <= 0.0 {
        return [mean; 2];
    }
    let third = a * (b * c - yz * yz) - xy * (xy * c - yz * zx) + zx * (xy * yz - b * zx);
    // The separate root has the sign of J₃ and lies between √J₂ and √(4 J₂/3).
    let mut apart = (second * (4.0 / 3.0)).sqrt();
    for _ in 0..STEPS {
        let (square, constant) = (apart * apart, third.abs());
        apart -= (apart * (square - second) - constant) / (3.0 * square - second);
    }
    let root = (second - 0.75 * apart * apart).max(0.0).sqrt();
    let other = 0.5 * apart + root;
    if third >= 0.0 { [mean - other, mean + apart] } else { [mean - apart, mean + other] }
}
