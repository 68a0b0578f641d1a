use nalgebra::Vector3;

use super::{Bounds, overlapping_pairs};

/// Reproducible pseudorandom numbers in [0, 1).
struct CongruentialNumbers(u64);

impl CongruentialNumbers {
    fn next(&mut self) -> f64 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn vector(&mut self) -> Vector3<f64> {
        Vector3::new(self.next(), self.next(), self.next())
    }

    fn boxes(&mut self, count: usize, spread: f64, size: impl Fn(f64) -> [f64; 3]) -> Vec<Bounds> {
        let mut one = || {
            let (low, size) = (self.vector() * spread, Vector3::from(size(self.next())));
            [low, low + size.component_mul(&self.vector())]
        };
        (0..count).map(|_| one()).collect()
    }
}

fn brute(boxes: &[Bounds]) -> Vec<[u32; 2]> {
    let sound = |b: &Bounds| {
        (0..3).all(|d| b[0][d] <= b[1][d] && b[0][d].is_finite() && b[1][d].is_finite())
    };
    let mut pairs = Vec::new();
    for (i, a) in boxes.iter().enumerate() {
        for (j, b) in boxes.iter().enumerate().skip(i + 1) {
            let apart = (0..3).any(|d| a[1][d] < b[0][d] || b[1][d] < a[0][d]);
            if sound(a) && sound(b) && !apart {
                pairs.push([i as u32, j as u32]);
            }
        }
    }
    pairs
}

#[track_caller]
fn check(boxes: &[Bounds]) {
    assert_eq!(overlapping_pairs(boxes), brute(boxes));
}

#[test]
fn random_box_pairs_match_brute_force() {
    let mut numbers = CongruentialNumbers(1);
    for round in 0..30 {
        let spread = [1.0, 5.0, 20.0][round % 3];
        // Boxes of one size, of many sizes, flat, long, and points.
        check(&numbers.boxes(300, spread, |_| [1.0; 3]));
        check(&numbers.boxes(300, spread, |x| [0.01 / (x * x * x + 1e-5); 3]));
        check(&numbers.boxes(300, spread, |_| [1.0, 1.0, 0.0]));
        check(&numbers.boxes(
            300,
            spread,
            |x| if x < 0.5 { [8.0, 0.1, 0.1] } else { [0.1, 8.0, 0.1] },
        ));
        check(&numbers.boxes(300, spread, |x| if x < 0.7 { [0.0; 3] } else { [3.0; 3] }));
        // Two kinds: few large boxes, and about equal numbers of each.
        check(&numbers.boxes(300, spread, |x| if x < 0.97 { [0.3; 3] } else { [9.0; 3] }));
        check(&numbers.boxes(300, spread, |x| if x < 0.51 { [0.1; 3] } else { [3.0; 3] }));
    }
}

#[test]
fn touching_lattice_cubes_match_brute_force() {
    let n = 12_usize;
    let low = |k: usize| {
        Vector3::new((k % n) as f64, (k / n % n) as f64, (k / n / n) as f64) - Vector3::repeat(5.0)
    };
    let boxes: Vec<Bounds> = (0..n.pow(3)).map(|k| [low(k), low(k).add_scalar(1.0)]).collect();
    // Each cube has 26 neighbours, found from both sides; border cubes have fewer.
    let ways = (3 * n - 2).pow(3) - n.pow(3);
    let found = overlapping_pairs(&boxes);
    assert_eq!(found.len(), ways / 2);
    assert!(found.is_sorted() && found.iter().all(|[i, j]| i < j));
}

#[test]
fn extreme_boxes_match_brute_force() {
    let mut numbers = CongruentialNumbers(2);
    let mut boxes = numbers.boxes(200, 5.0, |_| [1.0; 3]);
    let cube = |at: f64, size: f64| [Vector3::repeat(at), Vector3::repeat(at + size)];
    // Far away, and at cells that share a key with those here.
    boxes.extend([cube(1e9, 1.0), cube(1e9, 0.5), cube(-1e18, 1.0), cube(1e300, 1e290)]);
    boxes.extend_from_within(..200);
    boxes[204..].iter_mut().flatten().for_each(|x| x.add_scalar_mut(f64::from(1 << 21)));
    check(&boxes);
    // Over everything; through everything; not finite; inverted.
    boxes.extend([[-1e308, 1e308].map(Vector3::repeat), cube(-1e300, 2e300)]);
    boxes.push([Vector3::new(-1e12, 1.0, 1.0), Vector3::new(1e12, 1.1, 1.1)]);
    boxes.extend([cube(f64::NAN, 1.0), cube(f64::NEG_INFINITY, 1.0), cube(0.0, f64::INFINITY)]);
    boxes.push([Vector3::repeat(3.0), Vector3::repeat(0.0)]);
    check(&boxes);
    check(&[]);
    check(&boxes[..1]);
    check(&vec![cube(0.0, 0.0); 20]);
    check(&vec![[-1e308, 1e308].map(Vector3::repeat); 20]);
    check(&[cube(0.0, 5e-324), cube(0.0, 0.0), cube(5e-324, 1e-310)]);
}

/// Neither distant nor large boxes fill the memory or take long.
#[test]
fn distant_and_large_boxes_stay_cheap() {
    let mut numbers = CongruentialNumbers(3);
    let mut boxes = numbers.boxes(50_000, 40.0, |_| [1.0; 3]);
    boxes.push([Vector3::repeat(1e9), Vector3::repeat(1e9 + 1.0)]);
    boxes.push([Vector3::new(-10.0, -10.0, -1.0), Vector3::new(50.0, 50.0, 0.5)]);
    let found = overlapping_pairs(&boxes);
    let slab = boxes.len() as u32 - 1;
    let on_slab = boxes[..50_000].iter().filter(|b| b[0].z <= 0.5).count();
    assert_eq!(found.iter().filter(|[_, j]| *j == slab).count(), on_slab);
    assert!(found.iter().all(|[_, j]| *j != slab - 1));
}
