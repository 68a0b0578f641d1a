//! Numbers times powers of ten, without a rounding.

/// A number times a power of ten, by its decimal digits: the double that is nearest to what they say.
#[must_use]
pub(crate) fn shifted(value: f64, power: i32) -> f64 {
    let text = format!("{value:e}");
    let parts = text.split_once('e').and_then(|(digits, exponent)| {
        format!("{digits}e{}", exponent.parse::<i32>().ok()? + power).parse().ok()
    });
    // What is infinite or no number has no exponent.
    parts.unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use super::shifted;

    #[test]
    fn digits_are_not_rounded() {
        assert_eq!(shifted(2.01, 9), 2.01e9);
        assert_ne!(2.01 * 1e9, 2.01e9);
    }
}
