//! Names and comments of the source: one type for each name, and quantities in the comments.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Words with which no doc comment may open, because no quantity follows them.
const OPENERS: [&str; 13] = [
    "What",
    "Whether",
    "How",
    "Who",
    "Whose",
    "Where",
    "Which",
    "Why",
    "It",
    "Of",
    "Something",
    "Those",
    "To",
];

/// Path and text of every source file of all crates.
fn sources() -> Vec<(PathBuf, String)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut folders = vec![root.join("src"), root.join("crates")];
    let mut sources = Vec::new();
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "rs")
                && path.components().any(|part| part.as_os_str() == "src")
            {
                let text = std::fs::read_to_string(&path).unwrap();
                sources.push((path, text));
            }
        }
    }
    assert!(sources.len() > 150, "sources not found");
    sources.sort();
    sources
}

/// First words of the doc comments of a text, with the numbers of their lines.
fn openers(text: &str) -> Vec<(usize, &str)> {
    let mut before = false;
    let mut openers = Vec::new();
    for (number, line) in text.lines().enumerate() {
        let line = line.trim_start();
        let comment = line.strip_prefix("///").or_else(|| line.strip_prefix("//!"));
        if let Some(comment) = comment.filter(|_| !before) {
            openers.extend(comment.split_whitespace().next().map(|word| (number + 1, word)));
        }
        before = comment.is_some();
    }
    openers
}

#[test]
fn doc_comments_open_with_a_quantity() {
    assert_eq!(
        openers("/// What is it.\n/// Which\nfn f() {}\n//! How"),
        [(1, "What"), (4, "How")]
    );
    for (path, text) in sources() {
        for (number, word) in openers(&text) {
            assert!(!OPENERS.contains(&word), "{}:{number}: {word}", path.display());
        }
    }
}

/// Name of the type that a line declares at the top of a module.
fn declared(line: &str) -> Option<&str> {
    let line = match line.strip_prefix("pub") {
        Some(rest) => {
            rest.strip_prefix('(').map_or(rest, |rest| rest.split_once(')').map_or("", |p| p.1))
        }
        None => line,
    };
    let line = line.strip_prefix(' ').unwrap_or(line);
    let kinds = ["struct ", "enum ", "trait ", "type ", "union "];
    let name = kinds.iter().find_map(|kind| line.strip_prefix(kind))?;
    name.split(|c: char| !c.is_alphanumeric() && c != '_').next()
}

#[test]
fn type_names_are_unique() {
    assert_eq!(declared("pub(in crate::build) enum Kind<'a> {"), Some("Kind"));
    assert_eq!(declared("pub struct Point;"), Some("Point"));
    assert_eq!(declared("    struct Inner;"), None);
    let mut known: BTreeMap<String, PathBuf> = BTreeMap::new();
    for (path, text) in sources() {
        if path.ends_with("tests.rs") || path.components().any(|part| part.as_os_str() == "tests") {
            continue;
        }
        for name in text.lines().filter_map(declared) {
            if let Some(other) = known.insert(name.to_owned(), path.clone()) {
                panic!("{name}: {} and {}", other.display(), path.display());
            }
        }
    }
}
