//! Names in decks: their form in faults, and the known name that was probably meant.

use std::borrow::Cow;

/// Name as one segment of a [`Fault::place`](ddem_core::Fault::place): unchanged if TOML accepts it
/// as a bare key, otherwise in double quotes.
///
/// ```
/// # use ddem_deck::names::segment;
/// assert_eq!(segment("rock"), "rock");
/// assert_eq!(segment("hard rock"), "\"hard rock\"");
/// ```
pub fn segment(name: &str) -> Cow<'_, str> {
    let bare = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    if !name.is_empty() && name.chars().all(bare) {
        Cow::Borrowed(name)
    } else {
        Cow::Owned(format!("\"{}\"", name.replace('\\', "\\\\").replace('"', "\\\"")))
    }
}

/// Known name that was probably meant, if one is close enough.
///
/// A name is close if at most a third of its letters are wrong, swapped, missing or extra,
/// regardless of case, or if one name begins with the other.
///
/// ```
/// # use ddem_deck::names::nearest;
/// assert_eq!(nearest("denisty", ["young", "density"]), Some("density"));
/// assert_eq!(nearest("colour", ["young", "density"]), None);
/// ```
pub fn nearest<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let name = name.to_lowercase();
    let length = name.chars().count();
    // The cost of the distance is the product of both lengths. Such long names are not compared.
    if length > 100 {
        return None;
    }
    let distance = |candidate: &str| {
        let candidate = candidate.to_lowercase();
        let shorter = length.min(candidate.chars().count());
        let begins = candidate.starts_with(&name) || name.starts_with(&candidate);
        let wrong = strsim::damerau_levenshtein(&name, &candidate);
        // A common beginning is only a guess, so mistyped names come before it.
        if wrong <= (shorter / 3).max(1) && wrong < length {
            Some(wrong)
        } else {
            (begins && shorter >= 3).then_some(1000 + wrong)
        }
    };
    known
        .into_iter()
        .filter_map(|candidate| distance(candidate).map(|wrong| (wrong, candidate)))
        .min()
        .map(|(_, candidate)| candidate)
}

/// Names for a sentence: each in backticks, separated by commas; the first 24 of them.
pub fn list<'a>(names: impl IntoIterator<Item = &'a str>) -> String {
    let names: Vec<String> = names.into_iter().map(|name| format!("`{name}`")).collect();
    match names.len() {
        0..=24 => names.join(", "),
        many => format!("{} and {} more", names[..24].join(", "), many - 24),
    }
}
