//! Notation of Python in texts about decks.
//!
//! Messages name sections and keys of a deck in backticks. Here they become the methods and
//! arguments that a script has instead. Nothing here calls Python; the tests of decks use this file
//! to write docstrings, and to check that all messages can be converted.

use ddem_deck::lint::Diagnostic;

/// Text in the notation of Python.
pub(crate) fn text(text: &str) -> String {
    let mut out = calls(text);
    // Paths are resolved by `ddem_deck::read_files`, from a folder that depends on the caller.
    out = out.replace("the folder of the deck", "the current directory");
    let parts = out.split('`').enumerate();
    let parts = parts.map(|(i, part)| if i % 2 == 1 { code(part) } else { part.to_owned() });
    parts.collect::<Vec<_>>().join("`")
}

/// Place in a deck, with the names of Python's arguments.
pub(crate) fn place(place: &str) -> String {
    let mut parts: Vec<&str> = place.split('.').collect();
    if parts.len() > 1 && parts[0] == "model" {
        parts.remove(0);
    }
    if parts.len() > 2 {
        parts.retain(|part| *part != "where");
    }
    parts.into_iter().map(argument).collect::<Vec<_>>().join(".")
}

/// Text of a warning.
pub(crate) fn warning(warning: &Diagnostic) -> String {
    let mut python = warning.clone();
    python.place = place(&warning.place);
    python.message = text(&warning.message);
    python.help = text(&warning.help);
    python.to_string()
}

/// List of keys, or advice with one, in which the keys of `where` are arguments of their own.
pub(crate) fn list(help: &str) -> String {
    match help.split_once("keys here: ") {
        Some((before, keys)) => {
            // Keys of an entry come first: `plane` and `set` of a cut are its shapes.
            let others: Vec<String> = where_keys()
                .split(", ")
                .filter(|key| !keys.contains(key))
                .map(str::to_owned)
                .collect();
            format!("{before}keys here: {}", keys.replace("`where`", &others.join(", ")))
        }
        None => help.to_owned(),
    }
}

/// Keys of a `where`, as a list.
pub(crate) fn where_keys() -> String {
    ddem_deck::keys("Where").iter().map(|key| format!("`{key}`")).collect::<Vec<_>>().join(", ")
}

/// Argument for a key: `from` is a word of Python.
pub(crate) fn argument(key: &str) -> &str {
    if key == "from" { "from_" } else { key }
}

/// Text in which entries to paste into a deck, a header and lines of keys, are calls.
fn calls(text: &str) -> String {
    let mut lines: Vec<String> = Vec::new();
    let mut open = false;
    for line in text.split('\n') {
        let own = line.trim_start();
        let indent = &line[..line.len() - own.len()];
        let header = own.strip_prefix("[[").and_then(|own| own.strip_suffix("]]"));
        match (header, lines.last_mut()) {
            (Some(section), _) if !indent.is_empty() => {
                lines.push(format!("{indent}model.{}()", method(section)));
                open = true;
            }
            (None, Some(call)) if open && own.contains(" = ") => {
                call.pop();
                *call += if call.ends_with('(') { "" } else { ", " };
                *call += &format!("{})", code(own));
            }
            _ => {
                lines.push(line.to_owned());
                open = false;
            }
        }
    }
    lines.join("\n")
}

fn method(section: &str) -> &str {
    match section {
        "blocks" => "add_blocks",
        "region" => "add_region",
        other => other,
    }
}

/// A piece of a deck: a header, a key, or keys with values.
fn code(deck: &str) -> String {
    let bare = |name: &str| !name.is_empty() && name.chars().all(|c| c.is_ascii_lowercase());
    if let Some(section) = deck.strip_prefix("[[").and_then(|deck| deck.strip_suffix("]]"))
        && bare(section)
    {
        return format!("Model.{}", method(section));
    }
    if let Some(section) = deck.strip_prefix('[').and_then(|deck| deck.strip_suffix(']')) {
        match section.split('.').next() {
            Some("materials") => return "Material(...)".to_owned(),
            Some("joints") => return "Joint(...)".to_owned(),
            Some("model") => return "Model(...)".to_owned(),
            Some(section @ ("contact" | "lint" | "output")) => return format!("Model.{section}"),
            _ => {}
        }
    }
    if deck == "from" { argument(deck).to_owned() } else { values(deck) }
}

/// Keys with values: `key = value` is an argument, and inside braces an entry of a dictionary.
fn values(deck: &str) -> String {
    let (mut out, mut depth) = (String::with_capacity(deck.len()), 0_u32);
    let mut rest = deck;
    while let Some(first) = rest.chars().next() {
        let word = rest.split(|c: char| !c.is_ascii_alphanumeric() && c != '_').next();
        let word = word.unwrap_or_default();
        let quoted = || rest[1..].find('"').map_or(rest.len(), |end| end + 2);
        let is_key = !word.is_empty() && rest[word.len()..].starts_with(" = ");
        let taken = match first {
            '"' => quoted(),
            '{' if rest.starts_with("{ ") => 2,
            ' ' if depth > 0 && rest.starts_with(" }") => 1,
            _ if is_key => word.len() + 3,
            _ if !word.is_empty() => word.len(),
            other => other.len_utf8(),
        };
        match (first, word) {
            ('{', _) => (depth, out) = (depth + 1, out + "{"),
            (' ', _) if depth > 0 && rest.starts_with(" }") => {}
            ('}', _) => (depth, out) = (depth.saturating_sub(1), out + "}"),
            (_, key) if is_key && depth > 0 => out += &format!("\"{key}\": "),
            (_, key) if is_key => out += &format!("{}=", argument(key)),
            (_, "true") => out += "True",
            (_, "false") => out += "False",
            _ => out += &rest[..taken],
        }
        rest = &rest[taken..];
    }
    out
}
