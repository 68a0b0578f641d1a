//! Messages in the notation of Python: every section and key of a deck in a message can be
//! converted.

use std::path::{Path, PathBuf};

use ddem_deck::lint::{Code, Diagnostic};

use crate::python;

#[test]
fn headers_keys_and_tables_become_python() {
    for (deck, script) in [
        ("hold it with `[[fix]]`", "hold it with `Model.fix`"),
        ("`[[blocks]]` makes a set", "`Model.add_blocks` makes a set"),
        ("`[[region]]` and `[[cut]]` make cells", "`Model.add_region` and `Model.cut` make cells"),
        ("`peaks = true` in `[model]`", "`peaks=True` in `Model(...)`"),
        ("`[joints.seam]` makes one", "`Joint(...)` makes one"),
        ("`[contact]` has no effect", "`Model.contact` has no effect"),
        ("a list `[…]`, or `[from, to]`", "a list `[…]`, or `[from, to]`"),
        ("`from` needs `release`", "`from_` needs `release`"),
        ("`from = \"stage\"` removes", "`from_=\"stage\"` removes"),
        ("`\"gas = true\"`, `true` or `false`", "`\"gas = true\"`, `True` or `False`"),
        ("`where = { x = 6.0, z = 3.0 }`", "`where={\"x\": 6.0, \"z\": 3.0}`"),
        ("`{ ramp = s }`, `{ duvall = { alpha } }`", "`{\"ramp\": s}`, `{\"duvall\": {alpha}}`"),
        ("block [0, 0, 0] of `base`", "block [0, 0, 0] of `base`"),
        (
            "put in\n  [[fix]]\n  where = { x = 1.5 }\n  axes = \"xy\"\n",
            "put in\n  model.fix(where={\"x\": 1.5}, axes=\"xy\")\n",
        ),
    ] {
        assert_eq!(python::text(deck), script);
    }
    for (deck, script) in [
        ("remove[0].from", "remove[0].from_"),
        ("fix[0].where.x", "fix[0].x"),
        ("model.contact", "contact"),
        ("stage", "stage"),
    ] {
        assert_eq!(python::place(deck), script);
    }
    assert_eq!(python::list("keys here: `where`, `axes`").matches('`').count(), 2 * 16);
    assert_eq!(python::list("keys here: `where`, `plane`, `set`").matches('`').count(), 2 * 15);
    let help = "`contact = true` lets them meet";
    let warning = Diagnostic::warning(Code::SetsNotInContact, "model.contact", "`[[fix]]`", help);
    let warning = python::warning(&warning);
    let expected = "contact: `Model.fix`; `contact=True` lets them meet [sets-not-in-contact]";
    assert_eq!(warning, expected);
}

/// Sources of the messages of models and runs.
pub(crate) fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_str().unwrap();
        if path.is_dir() && name != "tests" {
            sources(&path, found);
        } else if name.ends_with(".rs") && name != "tests.rs" {
            found.push(path);
        }
    }
}

/// Texts in double quotes of a source, with `x` for each value of a format.
fn texts(source: &str) -> Vec<String> {
    literals(source).iter().map(|(_, text)| filled(text)).collect()
}

/// Texts in double quotes of a source, without comments, each with its position; `\` at the end of a
/// line joins lines.
pub(crate) fn literals(source: &str) -> Vec<(usize, String)> {
    let mut found = Vec::new();
    let mut rest = source;
    while let Some(at) = rest.find(['"', '\'', '/']) {
        let (first, after) = (rest.as_bytes()[at], &rest[at + 1..]);
        let place = source.len() - rest.len() + at;
        rest = after;
        if first == b'/' && after.starts_with('/') {
            rest = &after[after.find('\n').unwrap_or(after.len())..];
        } else if first == b'\'' {
            // A lifetime has no second quote nearby.
            let skip = if after.starts_with('\\') { 3 } else { 2 };
            let end = after.char_indices().nth(skip - 1).map_or(0, |(end, _)| end);
            rest = if after[end..].starts_with('\'') { &after[end + 1..] } else { after };
        } else if first == b'"' {
            let mut text = String::new();
            let mut letters = after.char_indices();
            while let Some((i, letter)) = letters.next() {
                match letter {
                    '"' => {
                        rest = &after[i + 1..];
                        break;
                    }
                    '\\' => match letters.next() {
                        Some((i, '\n')) => {
                            let line = &after[i..];
                            let gap = line.len() - line.trim_start().len();
                            letters.by_ref().take(gap - 1).for_each(drop);
                        }
                        Some((_, 'n')) => text.push('\n'),
                        Some((_, other)) => text.push(other),
                        None => {}
                    },
                    other => text.push(other),
                }
            }
            found.push((place, text));
        }
    }
    found
}

/// Text of a format with `x` for each value; a value has no spaces in its braces.
fn filled(format: &str) -> String {
    let format = format.replace("{{", "{ ").replace("}}", " }");
    let mut parts = format.split('{');
    let mut out = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        match part.split_once('}') {
            Some((value, rest)) if !value.contains(' ') => out += &format!("x{rest}"),
            _ => out += &format!("{{{part}"),
        }
    }
    out
}

/// True if a text has the header of a section, without or with backticks.
fn has_header(text: &str) -> bool {
    text.split("[[").skip(1).any(|after| {
        let word = after.trim_start_matches(|c: char| c.is_ascii_lowercase());
        word.len() < after.len() && word.starts_with("]]")
    })
}

#[test]
fn messages_can_be_converted() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut paths = Vec::new();
    for folder in ["ddem-core/src", "ddem-deck/src", "ddem-io/src"] {
        sources(&root.join(folder), &mut paths);
    }
    let (mut headers, mut wrong) = (0, Vec::new());
    for path in paths {
        let source = std::fs::read_to_string(&path).unwrap();
        // Tests at the end of a file.
        let source = source.split("#[cfg(test)]").next().unwrap();
        // Mistakes in the form of TOML are found in TOML only.
        let of_toml = path.ends_with("ddem-deck/src/reader/de.rs");
        for text in texts(source).iter().filter(|text| !of_toml && text.contains(' ')) {
            headers += usize::from(has_header(text));
            if is_left(text) {
                wrong.push(format!("{}: {text}", path.display()));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(headers > 20, "{headers}");
}

/// True if something in a text is in the notation of decks and stays so.
fn is_left(text: &str) -> bool {
    let script = python::text(text);
    let headers = ["[contact]", "[model]", "[lint]", "[output]", "[joints.", "[materials."];
    let left = has_header(&script) || headers.iter().any(|header| script.contains(header));
    let deck = |code: &str| ["from", "true", "false"].contains(&code) || code.contains(" = ");
    let codes = script.split('`').skip(1).step_by(2).any(deck);
    left || codes || !text.matches('`').count().is_multiple_of(2)
}
