//! Names and comments of the source: one type for each name, and quantities in the comments.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Words with which no doc comment may open, because no quantity follows them.
const OPENERS: [&str; 20] = [
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
    "From",
    "For",
    "At",
    "Only",
    "Does",
    "Its",
    "Their",
];

/// Path below the root and text of every Rust file: sources, tests, examples and benchmarks.
fn files() -> Vec<(PathBuf, String)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut folders: Vec<PathBuf> =
        ["src", "tests", "examples", "benches", "crates"].map(|name| root.join(name)).into();
    let mut files = Vec::new();
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                let text = std::fs::read_to_string(&path).unwrap();
                files.push((path.strip_prefix(root).unwrap().to_owned(), text));
            }
        }
    }
    files.sort();
    files
}

/// Files of [`files`] that belong to crates.
fn sources() -> Vec<(PathBuf, String)> {
    let mut sources = files();
    sources.retain(|(path, _)| path.components().any(|part| part.as_os_str() == "src"));
    assert!(sources.len() > 150, "sources not found");
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

/// Name of the type that a line declares, at the top of a module or inside one. The types of a trait
/// and of its implementations are not counted: they are indented and have no visibility.
fn declared(line: &str) -> Option<&str> {
    let trimmed = line.trim_start();
    let rest = trimmed.strip_prefix("pub").map(|rest| {
        rest.strip_prefix('(').map_or(rest, |rest| rest.split_once(')').map_or("", |p| p.1))
    });
    let of_trait = line != trimmed && rest.is_none();
    let line = rest.map_or(trimmed, str::trim_start);
    let kinds = ["struct ", "enum ", "trait ", "union ", "type "];
    let kinds = &kinds[..if of_trait { 4 } else { 5 }];
    let name = kinds.iter().find_map(|kind| line.strip_prefix(kind))?;
    name.split(|c: char| !c.is_alphanumeric() && c != '_').next()
}

#[test]
fn type_names_are_unique() {
    assert_eq!(declared("pub(in crate::build) enum Kind<'a> {"), Some("Kind"));
    assert_eq!(declared("pub struct Point;"), Some("Point"));
    assert_eq!(declared("    struct Inner;"), Some("Inner"));
    assert_eq!(declared("    pub(super) type Pair = (u8, u8);"), Some("Pair"));
    assert_eq!(declared("    type Error = Mistake;"), None);
    let mut known: BTreeMap<String, PathBuf> = BTreeMap::new();
    for (path, text) in files() {
        for name in text.lines().filter_map(declared) {
            if let Some(other) = known.insert(name.to_owned(), path.clone()) {
                panic!("{name}: {} and {}", other.display(), path.display());
            }
        }
    }
    assert!(known.len() > 400, "{} types found", known.len());
}
