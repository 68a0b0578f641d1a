//! Sums that do not depend on the order of their terms.
//!
//! A sum is a long fixed-point number with digits of 32 bits, which holds every finite `f64` and
//! all carries. It is rounded once, when it is read. No order of packs or threads therefore changes
//! a bit of it.

/// Number of digits: those of the largest number, and two for carries beyond it.
const DIGITS: usize = 68;
/// Exponent of the smallest number, the unit of the lowest digit.
const LOWEST: i32 = -1074;

/// Exact sum of up to 2³¹ numbers.
#[derive(Clone, Debug)]
pub struct ExactSum {
    /// Digits from the lowest to the highest; each may have a sign and more than 32 bits.
    digits: [i64; DIGITS],
    /// Lowest digit that may be nonzero, and the one above the highest.
    used: [usize; 2],
    /// Sum of the terms that are not finite.
    infinite: f64,
}

impl Default for ExactSum {
    fn default() -> Self {
        Self { digits: [0; DIGITS], used: [DIGITS, 0], infinite: 0.0 }
    }
}

impl ExactSum {
    /// Adds a number.
    #[inline]
    pub fn add(&mut self, x: f64) {
        if x == 0.0 {
            return;
        }
        let bits = x.to_bits();
        let exponent = (bits >> 52 & 0x7ff) as usize;
        if exponent == 0x7ff {
            self.infinite += x;
            return;
        }
        let fraction = bits & ((1 << 52) - 1);
        let whole = if exponent == 0 { fraction } else { fraction | 1 << 52 };
        let above = exponent.max(1) - 1;
        let (first, shift) = (above / 32, above % 32);
        let wide = u128::from(whole) << shift;
        let sign = if x < 0.0 { -1 } else { 1 };
        for (k, digit) in self.digits[first..first + 3].iter_mut().enumerate() {
            *digit += sign * i64::from((wide >> (32 * k)) as u32);
        }
        self.used = [self.used[0].min(first), self.used[1].max(first + 3)];
    }

    /// Adds another sum.
    #[inline]
    pub fn merge(&mut self, other: &Self) {
        for (own, other) in self.digits.iter_mut().zip(other.digits) {
            *own += other;
        }
        self.used = [self.used[0].min(other.used[0]), self.used[1].max(other.used[1])];
        self.infinite += other.infinite;
    }

    /// The nearest `f64`.
    #[inline]
    pub fn value(&self) -> f64 {
        let [low, high] = self.used;
        if self.infinite != 0.0 || low >= high {
            return self.infinite;
        }
        let high = DIGITS.min(high + 2);
        let mut digits = self.digits;
        let mut carry = 0;
        let mut carried = |digits: &mut [i64], sign: i64| {
            carry = 0;
            for digit in digits {
                let sum = sign * *digit + carry;
                (*digit, carry) = (sum & 0xffff_ffff, sum >> 32);
            }
            carry < 0
        };
        let negative = carried(&mut digits[low..high], 1);
        if negative {
            digits = self.digits;
            carried(&mut digits[low..high], -1);
        }
        let Some(top) = (low..high).rev().find(|&at| digits[at] != 0) else { return 0.0 };
        // The last bit of the four digits stands for all digits below; it lies below the rounded
        // bits.
        let last = top.saturating_sub(3);
        let four = (last..=top).rev().fold(0_u128, |sum, at| sum << 32 | digits[at] as u128);
        let below = digits[low.min(last)..last].iter().any(|&digit| digit != 0);
        let size = libm::scalbn((four | u128::from(below)) as f64, 32 * last as i32 + LOWEST);
        if negative { -size } else { size }
    }
}

/// Exact sum of some numbers, rounded once.
#[inline]
pub fn sum(numbers: impl IntoIterator<Item = f64>) -> f64 {
    let mut numbers = numbers.into_iter();
    // A single addition is rounded once as well.
    let (first, second) = (numbers.next().unwrap_or(0.0), numbers.next().unwrap_or(0.0));
    let Some(third) = numbers.next() else { return first + second };
    let mut sum = ExactSum::default();
    [first, second, third].into_iter().chain(numbers).for_each(|x| sum.add(x));
    sum.value()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_are_rounded_once() {
        assert_eq!(sum([]), 0.0);
        assert_eq!(sum([1e100, 1.0, -1e100]), 1.0);
        assert_eq!(sum([-1e100, -1.0, 1e100]), -1.0);
        // A tie is rounded to even; any further term decides.
        let half = f64::EPSILON / 2.0;
        assert_eq!(sum([1.0, half, 0.0]), 1.0);
        assert_eq!(sum([1.0, half, 1e-300]), 1.0 + f64::EPSILON);
        assert_eq!(sum([1.0, half, -1e-300]), 1.0);
        assert_eq!(sum([1.0 + f64::EPSILON, half, 0.0]), 1.0 + 2.0 * f64::EPSILON);
    }

    #[test]
    fn smallest_and_largest_numbers_are_exact() {
        let least = f64::from_bits(1);
        assert_eq!(sum([least; 5]), f64::from_bits(5));
        assert_eq!(sum([f64::MIN_POSITIVE, -least, 0.0]), f64::MIN_POSITIVE - least);
        assert_eq!(sum([f64::MAX, f64::MAX, -f64::MAX]), f64::MAX);
        assert_eq!(sum([f64::MAX; 3]), f64::INFINITY);
        assert_eq!(sum([1.0, f64::NEG_INFINITY, 2.0]), f64::NEG_INFINITY);
        assert!(
            sum([1.0, f64::INFINITY, f64::NEG_INFINITY]).is_nan()
                && sum([0.0, f64::NAN, 1.0]).is_nan()
        );
    }

    #[test]
    fn sum_is_independent_of_order() {
        let mut seed = 7_u64;
        let mut random = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        let numbers: Vec<f64> =
            (0..1000).map(|_| random() * libm::exp2((80.0 * random()).round())).collect();
        let whole = sum(numbers.iter().copied());
        assert_eq!(sum(numbers.iter().rev().copied()).to_bits(), whole.to_bits());
        let mut parts = [const { None }; 3].map(|part: Option<ExactSum>| part.unwrap_or_default());
        numbers.iter().enumerate().for_each(|(i, &x)| parts[i % 3].add(x));
        let [mut a, b, c] = parts;
        [c, b].iter().for_each(|part| a.merge(part));
        assert_eq!(a.value().to_bits(), whole.to_bits());
        let plain: f64 = numbers.iter().sum();
        assert!((plain - whole).abs() < 1e-9 * whole.abs() && plain != whole);
    }
}
