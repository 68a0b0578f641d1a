//! Advice on text that is not TOML.

use super::numbers;
use crate::schema::examples;
use crate::schema::is_list;

/// Advice on a line that is none of TOML.
pub(crate) const LINES: &str = "a line of a deck is `key = value`, a header such as `[model]` or `[[blocks]]`, or a \
                                comment after `#`";

/// Message and help.
type Advice = (String, String);

/// Characters of word processors that stand for quotes and minus signs.
const CURLY: [char; 5] = ['“', '”', '„', '‘', '’'];
const DASHES: [char; 3] = ['−', '–', '—'];
/// Words for the values of switches.
const TRUTHS: [(&str, &str); 6] = [
    ("True", "true"),
    ("False", "false"),
    ("yes", "true"),
    ("no", "false"),
    ("on", "true"),
    ("off", "false"),
];

/// Advice on the line of a mistake at a position of the text.
pub(crate) fn advice(text: &str, at: usize) -> Option<Advice> {
    let (before, after) = text.split_at_checked(at)?;
    let start = before.rfind('\n').map_or(0, |end| end + 1);
    let end = at + after.find('\n').unwrap_or(after.len());
    let line = text.get(start..end)?;
    let line = line.split(" #").next().unwrap_or_default().trim();
    if line.contains(CURLY) {
        let straight = line.replace(CURLY, "\"");
        return Some(("text has straight quotes in TOML".to_owned(), write(&straight)));
    }
    let Some((key, value)) = line.split_once('=') else {
        let (key, value) = line.split_once(':')?;
        let (key, value) = (key.trim(), value.trim());
        let message = "`=` joins a key and its value".to_owned();
        return is_key(key).then(|| (message, write(&format!("{key} = {value}"))));
    };
    let (key, value) = (key.trim(), value.trim());
    if !is_key(key) {
        return None;
    }
    if value.is_empty() {
        let help = examples::example(key).map_or_else(
            || "a value stands after `=`, in the same line".to_owned(),
            |example| format!("for example `{example}`"),
        );
        return Some((format!("`{key}` has no value"), help));
    }
    if value.starts_with(DASHES) {
        let plain = value.replacen(DASHES, "-", 1);
        return Some(("this is not a number".to_owned(), minus(key, &plain)));
    }
    if let Some(hint) = numbers::hint(value) {
        return Some(("this is not a number".to_owned(), hint));
    }
    if let Some((_, truth)) = TRUTHS.iter().find(|(word, _)| *word == value) {
        return Some(("this is not a value".to_owned(), write(&format!("{key} = {truth}"))));
    }
    let bare = value.chars().all(|c| c.is_alphanumeric() || "_- ".contains(c));
    let bare = bare && value.starts_with(char::is_alphabetic);
    let quoted = || write(&format!("{key} = \"{value}\""));
    bare.then(|| ("text stands in quotes".to_owned(), quoted()))
}

fn write(text: &str) -> String {
    format!("write `{text}`")
}

fn minus(key: &str, value: &str) -> String {
    format!("a minus is the character `-`: {}", write(&format!("{key} = {value}")))
}

fn is_key(text: &str) -> bool {
    !text.is_empty() && text.chars().all(|c| c.is_ascii_alphanumeric() || "_-.\"".contains(c))
}

/// Advice on a key or a header that the text has twice; `at` is the second one.
pub(crate) fn twice(text: &str, at: usize) -> Option<Advice> {
    let number = text.get(..at)?.matches('\n').count();
    let lines: Vec<&str> = text.lines().map(str::trim).collect();
    let line = *lines.get(number)?;
    let earlier = || lines[..number].iter().enumerate();
    if line.starts_with('[') {
        let header = line.split_inclusive(']').next()?;
        let (first, _) = earlier().find(|(_, line)| line.starts_with(header))?;
        let name = header.trim_matches(['[', ']']);
        let help = if is_list(name) {
            format!("each entry begins with `[[{name}]]`, in two pairs of brackets")
        } else {
            "put all its keys below one header, or change a name".to_owned()
        };
        return Some((format!("`{header}` stands in line {}, too", first + 1), help));
    }
    let key = |line: &str| line.split_once('=').map(|(key, _)| key.trim().to_owned());
    let own = key(line)?;
    let table = earlier().rev().take_while(|(_, line)| !line.starts_with('['));
    let same = |(_, line): &(usize, &&str)| key(line).as_ref() == Some(&own);
    let first = table.filter(same).last()?.0;
    let help = "keep one of the two lines".to_owned();
    Some((format!("`{own}` stands in line {}, too", first + 1), help))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_of_other_notations_have_advice() {
        for (line, help) in [
            ("young = 20,5e9", "write 20.5e9"),
            ("young = 20*10^9 # Pa", "write 20e9"),
            ("young =", "for example `young = 20e9`"),
            ("name =", "a value stands after `=`, in the same line"),
            ("material = “rock”", "write `material = \"rock\"`"),
            ("density: 2600", "write `density = 2600`"),
            ("young = −18e9", "write `young = -18e9`"),
            ("contact = True", "write `contact = true`"),
            ("material = rock", "write `material = \"rock\"`"),
        ] {
            let (_, found) = advice(line, 0).unwrap_or_default();
            assert!(found.ends_with(help), "{line}: {found}");
        }
        for line in ["", "where = { z = 0", "size = [1, 2", "[[fix]", "young 18e9"] {
            assert_eq!(advice(line, 0), None, "{line}");
        }
    }

    #[test]
    fn second_key_and_header_name_the_first() {
        let text = "[materials.rock]\nyoung = 1\nyoung = 2\n[materials.rock]\n[stage]\n[stage]\n";
        let found = |of: &str| twice(text, text.rfind(of).unwrap_or_default()).unwrap_or_default();
        assert_eq!(found("young").0, "`young` stands in line 2, too");
        assert_eq!(found("materials").0, "`[materials.rock]` stands in line 1, too");
        assert!(found("stage").1.contains("`[[stage]]`"));
    }
}
