//! Numbers as people write them, and as TOML requires them.

use crate::schema::decimal::shifted;

/// Units, each with the power of ten that converts it to the SI unit.
const UNITS: [(&str, i32); 25] = [
    ("Pa", 0),
    ("kPa", 3),
    ("MPa", 6),
    ("GPa", 9),
    ("bar", 5),
    ("m", 0),
    ("mm", -3),
    ("cm", -2),
    ("km", 3),
    ("s", 0),
    ("ms", -3),
    ("us", -6),
    ("µs", -6),
    ("N", 0),
    ("kN", 3),
    ("MN", 6),
    ("kg", 0),
    ("t", 3),
    ("g", -3),
    ("kg/m3", 0),
    ("t/m3", 3),
    ("g/cm3", 3),
    ("MPa/m", 6),
    ("GPa/m", 9),
    ("m/s", 0),
];

/// Advice for a text that is meant as a number but is not one in TOML.
pub(crate) fn hint(text: &str) -> Option<String> {
    let text = text.trim().trim_matches(['"', '\'']);
    let starts = |c: char| c.is_ascii_digit() || matches!(c, '.' | '-' | '+');
    if !text.starts_with(starts) || !text.contains(|c: char| c.is_ascii_digit()) {
        return None;
    }
    if let Some(plain) = comma(text).or_else(|| product(text)) {
        return Some(plain);
    }
    // The longest beginning that is a number; `e` may be its exponent or the unit's first letter.
    let ends = text.char_indices().map(|(at, c)| at + c.len_utf8()).rev();
    let number =
        ends.map(|end| &text[..end]).find(|part| part.trim_end().parse::<f64>().is_ok())?;
    let unit = text[number.len()..].trim();
    let value: f64 = number.trim().parse().ok()?;
    if unit.is_empty() {
        let bare = number.trim().trim_start_matches(['-', '+']);
        let short = bare.starts_with('.') || bare.ends_with('.') || bare.contains(".e");
        return short.then(|| {
            format!("a number has digits before and after its point: {}", written(value))
        });
    }
    if !unit.starts_with(|c: char| c.is_alphabetic() || matches!(c, '°' | '%')) {
        return None;
    }
    let plain = "numbers stand without a unit, in SI units (angles in degrees)";
    let unit = unit.replace(['^', '³'], if unit.contains('³') { "3" } else { "" });
    let known = UNITS.iter().find(|(name, _)| *name == unit);
    let known = known.map(|(_, power)| shifted(value, *power));
    let known = known.or(["°", "deg", "degrees"].contains(&unit.as_str()).then_some(value));
    Some(match known {
        Some(value) => format!("{plain}: write {}", written(value)),
        None => plain.to_owned(),
    })
}

/// Advice on a number with a decimal comma.
fn comma(text: &str) -> Option<String> {
    let (whole, part) = text.split_once(',')?;
    let point = format!("{whole}.{part}");
    let ends = whole.ends_with(|c: char| c.is_ascii_digit());
    let begins = part.starts_with(|c: char| c.is_ascii_digit());
    let is_number = ends && begins && point.parse::<f64>().is_ok();
    is_number.then(|| format!("a decimal point is `.`, not a comma: write {point}"))
}

/// Advice on a number with a power of ten as a product, such as `20*10^9`.
fn product(text: &str) -> Option<String> {
    let (factor, power) = text.split_once(['*', '×', '·', 'x'])?;
    let power = power.trim().strip_prefix("10")?.trim_start();
    let power = power.strip_prefix("**").or_else(|| power.strip_prefix('^'))?;
    let (factor, power) = (factor.trim(), power.trim().parse::<i32>().ok()?);
    factor.parse::<f64>().ok()?;
    Some(format!("a power of ten follows the letter `e`: write {factor}e{power}"))
}

/// Number as TOML accepts it.
fn written(value: f64) -> String {
    let size = value.abs();
    if value == 0.0 || (1e-3..1e5).contains(&size) {
        format!("{value:?}")
    } else {
        format!("{value:e}")
    }
}

/// Text between the punctuation marks around a position.
pub(crate) fn word(text: &str, at: usize) -> &str {
    let sign = |c: char| matches!(c, '=' | ',' | '[' | ']' | '{' | '}' | '#' | '\n' | '\r');
    let (before, after) = text.split_at_checked(at).unwrap_or_default();
    let start = before.rfind(sign).map_or(0, |sign| sign + 1);
    let end = at + after.find(sign).unwrap_or(after.len());
    text.get(start..end).unwrap_or_default().trim()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn number_with_unit_suggests_plain_number() {
        for (text, number) in [
            ("20GPa", "2e10"),
            ("20 GPa", "2e10"),
            ("\"0.5 MPa\"", "5e5"),
            ("1e3 mm", "1.0"),
            ("2.01 GPa", "2.01e9"),
            ("0.07 mm", "7e-5"),
            ("2.7 g/cm^3", "2700.0"),
            ("2400 kg/m³", "2400.0"),
            ("30°", "30.0"),
            ("30 deg", "30.0"),
        ] {
            let hint = hint(text).unwrap_or_default();
            assert!(hint.ends_with(&format!(": write {number}")), "{text}: {hint}");
        }
        assert!(hint("12 furlongs").is_some_and(|hint| !hint.contains("write")));
        assert!(hint("-.5").is_some_and(|hint| hint.ends_with(": -0.5")));
        assert!(hint("3.").is_some_and(|hint| hint.ends_with(": 3.0")));
        for text in ["12", "1e5", "rock", "-", "1979-05-27", ""] {
            assert_eq!(hint(text), None, "{text}");
        }
    }

    #[test]
    fn words_end_at_punctuation() {
        let text = "young = 20GPa # hard\norigin = [-.5, 0]";
        assert_eq!(word(text, 8), "20GPa");
        assert_eq!(word(text, text.find("-.5").unwrap_or_default()), "-.5");
        assert_eq!((word("", 0), word("x", 7)), ("", ""));
    }
}
