//! One number or four side by side, so that formulas are written once for both.

use std::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

use fearless_simd::{Select, Simd, SimdBase, SimdFloat, SimdMask, f64x4, mask64x4};

use super::lanes::splat;

/// One number, or four side by side in a register. All operations give the same bits for both: each
/// is one IEEE operation per lane.
pub trait Number:
    Copy
    + Neg<Output = Self>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Add<f64, Output = Self>
    + Sub<f64, Output = Self>
    + Mul<f64, Output = Self>
    + Div<f64, Output = Self>
{
    /// Answer to a comparison, for each lane.
    type Mask: Copy
        + BitAnd<Output = Self::Mask>
        + BitOr<Output = Self::Mask>
        + Not<Output = Self::Mask>;

    /// The number `value` in all lanes.
    fn like(self, value: f64) -> Self;

    /// True where `self > other`.
    fn exceeds(self, other: Self) -> Self::Mask;

    /// True where `self ≥ other`.
    fn reaches(self, other: Self) -> Self::Mask;

    /// True where `self = other`.
    fn equals(self, other: Self) -> Self::Mask;

    /// `yes` where a mask is true, `no` elsewhere.
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self;

    /// True if a mask is true in any lane.
    fn any(mask: Self::Mask) -> bool;

    /// Square root.
    fn root(self) -> Self;

    /// The larger of two numbers.
    #[inline(always)]
    fn or_more(self, other: Self) -> Self {
        Self::select(other.exceeds(self), other, self)
    }

    /// The smaller of two numbers.
    #[inline(always)]
    fn or_less(self, other: Self) -> Self {
        Self::select(self.exceeds(other), other, self)
    }
}

impl Number for f64 {
    type Mask = bool;

    #[inline(always)]
    fn like(self, value: f64) -> Self {
        value
    }

    #[inline(always)]
    fn exceeds(self, other: Self) -> bool {
        self > other
    }

    #[inline(always)]
    fn reaches(self, other: Self) -> bool {
        self >= other
    }

    #[inline(always)]
    fn equals(self, other: Self) -> bool {
        self == other
    }

    #[inline(always)]
    fn select(mask: bool, yes: Self, no: Self) -> Self {
        if mask { yes } else { no }
    }

    #[inline(always)]
    fn any(mask: bool) -> bool {
        mask
    }

    #[inline(always)]
    fn root(self) -> Self {
        self.sqrt()
    }
}

impl<S: Simd> Number for f64x4<S> {
    type Mask = mask64x4<S>;

    #[inline(always)]
    fn like(self, value: f64) -> Self {
        splat(self.simd, value)
    }

    #[inline(always)]
    fn exceeds(self, other: Self) -> mask64x4<S> {
        self.simd_gt(other)
    }

    #[inline(always)]
    fn reaches(self, other: Self) -> mask64x4<S> {
        self.simd_ge(other)
    }

    #[inline(always)]
    fn equals(self, other: Self) -> mask64x4<S> {
        self.simd_eq(other)
    }

    #[inline(always)]
    fn select(mask: mask64x4<S>, yes: Self, no: Self) -> Self {
        mask.select(yes, no)
    }

    #[inline(always)]
    fn any(mask: mask64x4<S>) -> bool {
        mask.any_true()
    }

    #[inline(always)]
    fn root(self) -> Self {
        self.sqrt()
    }
}
