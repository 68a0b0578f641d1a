//! Triangles of a ground by the squares of a grid over x and y that they meet.

use nalgebra::Vector3;

use crate::height_field::HeightField;

/// Grid of squares, with the triangles whose boxes meet each of them.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Buckets {
    low: [f64; 2],
    width: [f64; 2],
    count: [usize; 2],
    triangles: Vec<Vec<u32>>,
}

impl Buckets {
    /// About as many squares as triangles.
    pub(crate) fn new(field: &HeightField) -> Self {
        let far = Vector3::repeat(f64::INFINITY);
        let (low, high) =
            (field.points.iter()).fold((far, -far), |(low, high), x| (low.inf(x), high.sup(x)));
        let side = libm::sqrt(field.triangles.len() as f64).ceil().max(1.0);
        let count = [side as usize; 2];
        let width = [0, 1].map(|k| ((high[k] - low[k]) / side).max(f64::MIN_POSITIVE));
        let low = [low.x, low.y];
        let mut buckets =
            Self { low, width, count, triangles: vec![Vec::new(); count[0] * count[1]] };
        for (of, number) in field.triangles.iter().zip(0..) {
            let corners = field.corners(*of);
            let least = corners.into_iter().fold(far, |low, x| low.inf(x));
            let most = corners.into_iter().fold(-far, |high, x| high.sup(x));
            for square in buckets.squares(&least, &most) {
                buckets.triangles[square].push(number);
            }
        }
        buckets
    }

    fn square(&self, k: usize, x: f64) -> usize {
        let at = ((x - self.low[k]) / self.width[k]).floor();
        // Squares at the rim reach beyond it; NaN becomes 0.
        (at.max(0.0) as usize).min(self.count[k] - 1)
    }

    fn squares(&self, low: &Vector3<f64>, high: &Vector3<f64>) -> Vec<usize> {
        let [columns, rows] = [0, 1].map(|k| self.square(k, low[k])..=self.square(k, high[k]));
        let width = self.count[0];
        rows.flat_map(|row| columns.clone().map(move |column| row * width + column)).collect()
    }

    /// Triangles that may lie above or below a point.
    pub(crate) fn at(&self, x: &Vector3<f64>) -> &[u32] {
        &self.triangles[self.square(1, x.y) * self.count[0] + self.square(0, x.x)]
    }

    /// Triangles that may lie above or below a box, in increasing order.
    pub(crate) fn over(&self, low: &Vector3<f64>, high: &Vector3<f64>) -> Vec<u32> {
        let squares = self.squares(low, high).into_iter();
        let mut all: Vec<u32> =
            squares.flat_map(|square| self.triangles[square].iter().copied()).collect();
        all.sort_unstable();
        all.dedup();
        all
    }
}
