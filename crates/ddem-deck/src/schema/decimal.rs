//! Products of numbers and powers of ten without rounding errors.

/// Number times a power of ten, from its decimal digits: the double nearest to the exact product.
#[must_use]
pub(crate) fn shifted(value: f64, power: i32) -> f64 {
    let text = format!("{value:e}");
    let parts = text.split_once('e').and_then(|(digits, exponent)| {
        format!("{digits}e{}", exponent.parse::<i32>().ok()? + power).parse().ok()
    });
    // Infinity and NaN have no exponent.
    parts.unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use super::shifted;

    #[test]
    fn decimal_products_are_exact() {
        assert_eq!(shifted(2.01, 9), 2.01e9);
        assert_ne!(2.01 * 1e9, 2.01e9);
    }
}
