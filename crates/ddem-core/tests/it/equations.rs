//! Equations cited in the source and in the table of `docs/method.md` are the same.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use crate::architecture::sources;

/// Numbers cited as `eq. (n)` or `(Mn)` in the comments of a source file.
fn cited(text: &str) -> BTreeSet<String> {
    let mut cited = BTreeSet::new();
    for comment in text.lines().filter(|line| line.trim_start().starts_with("//")) {
        for (open, _) in comment.match_indices('(') {
            let Some(number) = comment[open + 1..].split(')').next() else { continue };
            let is_number = |s: &str| !s.is_empty() && s.chars().all(|c| c.is_ascii_digit());
            let own = number.strip_prefix('M').is_some_and(is_number);
            let before = comment[..open].trim_end();
            if own || (is_number(number) && before.ends_with("eq.")) {
                cited.insert(number.to_owned());
            }
        }
    }
    cited
}

struct EquationRow {
    equations: Vec<String>,
    source: String,
    test: String,
}

/// Rows of the table at the end of `docs/method.md`.
fn table() -> Vec<EquationRow> {
    let method = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/method.md");
    let method = std::fs::read_to_string(method).unwrap_or_else(|error| panic!("{error}"));
    let (_, table) = method
        .split_once("## Index of equations")
        .unwrap_or_else(|| panic!("docs/method.md has no table of equations"));
    let rows = table.lines().filter(|line| line.starts_with("| (") || line.starts_with("| –"));
    rows.map(|line| {
        let cells: Vec<&str> = line.trim_matches('|').split('|').map(str::trim).collect();
        let equations = cells[0]
            .split(',')
            .filter_map(|cell| Some(cell.trim().strip_prefix('(')?.strip_suffix(')')?.to_owned()));
        EquationRow {
            equations: equations.collect(),
            source: cells[2].into(),
            test: cells[3].into(),
        }
    })
    .collect()
}

/// Texts between backticks.
fn quoted(cell: &str) -> impl Iterator<Item = &str> {
    cell.split('`').skip(1).step_by(2)
}

#[test]
fn cited_equations_match_the_table() {
    let mut where_cited: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for (file, text) in sources() {
        for number in cited(&text) {
            where_cited.entry(number).or_default().push(file.clone());
        }
    }
    let rows = table();
    assert!(rows.len() > 10, "the table of equations is not read");
    for row in &rows {
        for number in &row.equations {
            let cited = where_cited.remove(number).unwrap_or_default();
            if row.source.starts_with("not yet") {
                assert!(cited.is_empty(), "({number}) is not `not yet`: {cited:?}");
                continue;
            }
            let named: Vec<&str> = quoted(&row.source).filter(|s| s.ends_with(".rs")).collect();
            let found = cited.iter().any(|file| named.contains(&file.as_str()));
            assert!(found, "({number}) is cited in {cited:?}, the table names {named:?}");
        }
    }
    assert!(where_cited.is_empty(), "not in the table of docs/method.md: {where_cited:?}");
}

/// True if a source file declares an item or a public field, or if a macro declares a type as
/// `Name:`.
fn declares(text: &str, item: &str) -> bool {
    let name = item.rsplit("::").next().unwrap_or(item);
    let ends = |at: usize| {
        text[at..].chars().next().is_none_or(|next| !next.is_alphanumeric() && next != '_')
    };
    let kinds = ["fn", "struct", "enum", "type"].map(|kind| format!("{kind} {name}"));
    let declared = |words: &String| {
        text.match_indices(words.as_str()).any(|(at, found)| ends(at + found.len()))
    };
    let field = format!("    pub {name}:");
    kinds.iter().any(declared)
        || text.contains(&format!("\n    {name}:\n"))
        || text.contains(&field)
}

/// Files and functions that ARCHITECTURE.md names under "Index" exist.
#[test]
fn architecture_names_existing_files_and_functions() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let read = |path: &str| std::fs::read_to_string(root.join(path));
    let text = read("ARCHITECTURE.md").unwrap_or_else(|error| panic!("{error}"));
    let (_, section) = text.split_once("## Index\n").expect("a section");
    let (section, _) = section.split_once("\n## ").expect("a next section");
    let rows: Vec<&str> = section.lines().filter(|line| line.contains("crates/")).collect();
    assert!(rows.len() > 5, "{rows:?}");
    for row in rows {
        let mut file = String::new();
        for name in quoted(row) {
            if name.ends_with(".rs") {
                file = read(name).unwrap_or_else(|error| panic!("`{name}`: {error}"));
            } else {
                assert!(declares(&file, name), "`{name}` is not where {row} says");
            }
        }
    }
}

/// Files and functions that the table names exist.
#[test]
fn table_names_existing_files_and_functions() {
    let sources = sources();
    for row in table() {
        for part in row.source.split("; ") {
            let names: Vec<&str> = quoted(part).collect();
            let (files, items): (Vec<&str>, Vec<&str>) =
                names.into_iter().partition(|name| name.ends_with(".rs"));
            for file in &files {
                assert!(sources.iter().any(|(name, _)| name == file), "no file `{file}`");
            }
            for item in items {
                let mut text = sources.iter().filter(|(file, _)| files.contains(&file.as_str()));
                assert!(text.any(|(_, text)| declares(text, item)), "`{item}` is not in {files:?}");
            }
        }
    }
}

/// Tests of the method that the table names exist; tests of decks are in the root package.
#[test]
fn table_names_existing_tests() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let read = |path: &str| std::fs::read_to_string(folder.join(path)).unwrap_or_default();
    let tests = [
        "../ddem-mechanics/src/element/tests.rs",
        "../ddem-mechanics/src/law/tests.rs",
        "../ddem-mechanics/src/rigid/tests.rs",
        "tests/it/rigid.rs",
        "tests/it/corotation.rs",
        "tests/it/resume.rs",
        "tests/it/in_situ.rs",
        "tests/it/excavation.rs",
    ]
    .map(read);
    for row in table() {
        for test in quoted(&row.test).filter(|test| !test.contains(".rs") && !test.contains('…'))
        {
            let found = tests.iter().any(|text| text.contains(&format!("fn {test}(")));
            assert!(found, "no test `{test}`");
        }
    }
}
