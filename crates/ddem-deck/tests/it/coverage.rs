//! Every text of a message in the sources is in a committed snapshot.

use std::fs;
use std::path::{Path, PathBuf};

use ddem_core::ErrorCode;
use ddem_deck::lint::Code;

use crate::notation::{literals, sources};

/// Crates with messages.
const CRATES: [&str; 7] =
    ["ddem-cut", "ddem-mechanics", "ddem-mesh", "ddem-core", "ddem-deck", "ddem-io", "ddem-cli"];

/// Files whose texts are reports, progress or names, not messages.
const REPORTS: [&str; 7] = [
    "ddem-cli/src/progress.rs",
    "ddem-core/src/error/code.rs",
    "ddem-deck/src/lint.rs",
    "ddem-deck/src/schema/examples.rs",
    "ddem-io/src/cells/table.rs",
    "ddem-io/src/run/plan.rs",
    "ddem-io/src/summary/table.rs",
];

/// Ends of the lines before texts that are not messages: of panics, attributes, comparisons and progress.
const UNSEEN: [&str; 11] = [
    ".expect(",
    "assert!(",
    "assert_eq!(",
    "unreachable!(",
    "panic!(",
    "reason =",
    "after_help =",
    "const PROBE: &str =",
    "has(",
    "screen.line(",
    "screen.line(&format!(",
];

/// Lines of the report on a deck.
const LINES: [&str; 3] = [
    "can fail       {joints} joints, {pairs} pairs",
    "contacts       {near} pairs of blocks near each other at the start",
    " while joints hold",
];

/// Largest number of characters that a value in a message has.
const LONGEST: usize = 400;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Texts of all committed snapshots below a folder.
pub(crate) fn snapshots(folder: &Path, found: &mut Vec<String>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            snapshots(&path, found);
        } else if path.extension().is_some_and(|end| end == "snap") {
            let text = fs::read_to_string(&path).unwrap();
            let (_, text) = text.split_once("\n---\n").unwrap();
            found.push(text.to_owned());
        }
    }
}

/// Parts of a snapshot between the codes of messages, with single spaces.
fn cut(snapshot: &str) -> Vec<String> {
    let mut text = snapshot.replace('│', " ");
    let errors = ErrorCode::ALL.iter().map(|code| code.name());
    for code in errors.chain(Code::ALL.iter().map(|code| code.name())) {
        text = text.replace(&format!("[{code}]"), "\0");
    }
    text.split('\0').map(spaced).collect()
}

/// Text with one space for each gap, also at its ends.
fn spaced(text: &str) -> String {
    let words: Vec<&str> = text.split_whitespace().collect();
    let gap = |there: bool| if there { " " } else { "" };
    let (first, last) =
        (text.starts_with(char::is_whitespace), text.ends_with(char::is_whitespace));
    if words.is_empty() {
        return gap(first).to_owned();
    }
    format!("{}{}{}", gap(first), words.join(" "), gap(last))
}

/// Parts of a format between its values.
fn parts(format: &str) -> Vec<String> {
    // The snapshots are cut at codes.
    let plain = format.replace(" [{}]", "").replace(" [{code}]", "");
    let plain = plain.replace("{{", "\u{1}").replace("}}", "\u{2}");
    let mut parts = Vec::new();
    let mut rest = plain.as_str();
    while let Some((before, after)) = rest.split_once('{') {
        parts.push(before);
        rest = after.split_once('}').map_or("", |(_, after)| after);
    }
    parts.push(rest);
    let whole = |part: &str| spaced(&part.replace('\u{1}', "{").replace('\u{2}', "}"));
    parts.into_iter().map(whole).filter(|part| !part.is_empty()).collect()
}

/// True if the parts follow each other in a text, with at most a value between them.
fn is_in(parts: &[String], text: &str) -> bool {
    let Some((first, others)) = parts.split_first() else { return true };
    text.match_indices(first.as_str()).any(|(at, _)| {
        let mut end = at + first.len();
        others.iter().all(|part| match text[end..].find(part.as_str()) {
            Some(gap) if gap <= LONGEST => {
                end += gap + part.len();
                true
            }
            _ => false,
        })
    })
}

/// Number of words with a letter.
fn words(text: &str) -> usize {
    text.split_whitespace().filter(|word| word.contains(char::is_alphabetic)).count()
}

/// Texts of messages in a source: those of three words or more.
fn texts(source: &str) -> Vec<String> {
    let own = source.split("#[cfg(test)]").next().unwrap();
    let seen = |at: usize| {
        let before = own[..at].trim_end();
        !UNSEEN.iter().any(|unseen| before.ends_with(unseen))
    };
    let all = literals(own).into_iter().filter(|(at, _)| seen(*at)).map(|(_, text)| text);
    let enough = |text: &String| {
        let longest = parts(text).iter().map(|part| words(part)).max();
        !LINES.contains(&text.as_str())
            && words(text) >= 3
            && longest.is_some_and(|longest| longest >= 2)
    };
    all.filter(enough).collect()
}

/// A message that no snapshot shows could become wrong without notice.
#[test]
fn every_message_is_in_a_snapshot() {
    let mut shown = Vec::new();
    snapshots(&root(), &mut shown);
    let shown: Vec<String> = shown.iter().flat_map(|snapshot| cut(snapshot)).collect();
    let mut paths = Vec::new();
    CRATES.iter().for_each(|name| sources(&root().join(name).join("src"), &mut paths));
    let mut missing = Vec::new();
    for path in paths.iter().filter(|path| !REPORTS.iter().any(|report| path.ends_with(report))) {
        for text in texts(&fs::read_to_string(path).unwrap()) {
            let parts = parts(&text);
            if !shown.iter().any(|shown| is_in(&parts, shown)) {
                missing.push(format!("{}: {text:?}", path.display()));
            }
        }
    }
    assert!(missing.is_empty(), "no snapshot shows\n{}", missing.join("\n"));
}
