//! Page that lists all checks: docs/verification.md.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::Path;
use std::sync::{Mutex, OnceLock};

use super::record::{CASES, Case, ROUNDING};
use super::shared;

/// Section of the page to which a row belongs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Part {
    Exact,
    Bound,
    Consistency,
}

/// Row of a table of the page.
#[derive(Clone, Debug)]
struct PageRow {
    part: Part,
    /// Number of the case.
    order: usize,
    /// Name of the test.
    test: String,
    /// First cells, up to the quantity, which no other row of the section has.
    key: String,
    /// Cells after the quantity.
    cells: String,
}

static ROWS: Mutex<Vec<PageRow>> = Mutex::new(Vec::new());

/// True if the page is to be written.
pub(crate) fn rewrites() -> bool {
    std::env::var_os("DDEM_VERIFICATION").is_some()
}

/// Text of the page.
fn page() -> &'static str {
    static PAGE: OnceLock<String> = OnceLock::new();
    let read = || std::fs::read_to_string(shared::root("docs/verification.md")).expect("the page");
    PAGE.get_or_init(read)
}

/// Rows of a section of the page.
fn rows(part: Part) -> impl Iterator<Item = &'static str> {
    let heading = heading(part);
    let mut sections = page().split("\n## ");
    let section = sections.find(|section| section.starts_with(heading)).unwrap_or_default();
    section.lines().filter(|line| line.starts_with("| ") && !line.starts_with("| Case |"))
}

/// Tolerance of a row of the page.
pub(crate) fn recorded(part: Part, case: Case, quantity: &str) -> Option<f64> {
    let start = format!("{} |", key(case, quantity));
    let row = rows(part).find(|row| row.starts_with(&start))?;
    number(row.trim_end_matches(" |").rsplit(" | ").next()?)
}

/// Number at the start of a cell.
fn number(cell: &str) -> Option<f64> {
    cell.split([' ', ',']).next()?.parse().ok()
}

fn heading(part: Part) -> &'static str {
    match part {
        Part::Exact => "Exact",
        Part::Bound => "Bounds",
        Part::Consistency => "Consistency",
    }
}

fn key(Case { name, deck }: Case, quantity: &str) -> String {
    format!("| {name} | [{deck}](../examples/verification/{deck}.toml) | {quantity}")
}

/// Stores a row for the page, and writes the page on request.
pub(crate) fn keep(part: Part, case: Case, quantity: &str, cells: &str) {
    assert!(!quantity.contains('|'), "{quantity}: the character separates cells");
    let key = key(case, quantity);
    println!("{key} | {cells} |");
    let order = CASES.iter().position(|c| *c == case).expect("a case of the list");
    // Tests run side by side: rows of one case are in the order of the names of the tests.
    let test = std::thread::current().name().unwrap_or_default().to_owned();
    let row = PageRow { part, order, test, key, cells: cells.to_owned() };
    let mut rows = ROWS.lock().expect("no check has failed");
    let first = rows.iter().all(|other| (other.part, &other.key) != (part, &row.key));
    rows.push(row);
    if let Some(path) = std::env::var_os("DDEM_VERIFICATION") {
        write(&shared::root("").join(path), &rows);
    }
    drop(rows);
    assert!(first, "two rows for {}, {quantity}", case.deck);
}

/// Number with seven digits, or with a power of ten if that is shorter.
pub(crate) fn plain(number: f64) -> String {
    let size = number.abs();
    if number == 0.0 {
        "0".to_owned()
    } else if (1e-2..1e6).contains(&size) {
        let digits = (6 - size.log10().floor() as i32).max(0) as usize;
        let text = format!("{number:.digits$}");
        if text.contains('.') {
            text.trim_end_matches('0').trim_end_matches('.').to_owned()
        } else {
            text
        }
    } else {
        let text = format!("{number:.6e}");
        let (digits, power) = text.split_once('e').unwrap_or((&text, "0"));
        format!("{}e{power}", digits.trim_end_matches('0').trim_end_matches('.'))
    }
}

const HEAD: &str = "\
# Verification

`cargo test --test verification` asserts every row. This command writes the page:

```
DDEM_VERIFICATION=docs/verification.md cargo test --test verification
```

Numbers are in SI units. An error or a tolerance is absolute, or relative to the exact value (`of it`). A tolerance is
at most ten times the error found, so a change that makes the error ten times larger fails the tests. The only exception
is rounding: no tolerance is below 1e-14 of the size of the numbers, 45 units in the last place. Such a row is marked
`rounding`, with the size of the numbers that nearly cancel if it is not that of the exact value.
";

const EXACT: &str = "
## Exact

The exact value does not come from this program. It comes from a closed form, from equilibrium, or from an independent
finite element model (`tests/fem`, `tests/data`). The header of each deck names the source, and the assumptions by which
the model differs from it (rigid blocks of Housner, beams, a tunnel cut from cubes).

| Case | Deck | Quantity | Exact | Computed | Error | Tolerance |
|---|---|---|---|---|---|---|
";

const BOUNDS: &str = "
## Bounds

The number must keep a limit, from theory or from what the case shows: stable blocks must not creep, unstable ones must
fall, and the order of convergence must be that of the scheme. Blocks that meet must not gain energy. Only one row may
gain 0.5 %: very stiff springs that fail within a step recover the gain in a few steps. A limit strength or a factor of
safety is known up to a bracket. The model stands at its lower end and fails at its upper end, and the exact value must
lie between them; a least strength or thickness is the other way round.

| Case | Deck | Quantity | Bound | Computed |
|---|---|---|---|---|
";

const CONSISTENCY: &str = "
## Consistency

The expected value comes from this program, too: from a conservation law, from a second way to compute the quantity, or
from a second run with another method or another loading rate. The quantity says which, unless its expected value is 0.

| Case | Deck | Quantity | Expected | Computed | Error | Tolerance |
|---|---|---|---|---|---|---|
";

/// Results of runs that are too long for every check.
const LARGE: &str = include_str!("large.md");

/// Writes the page of the checks so far.
fn write(path: &Path, rows: &[PageRow]) {
    let mut rows = rows.to_vec();
    rows.sort_by(|a, b| (a.part, a.order, &a.test).cmp(&(b.part, b.order, &b.test)));
    let mut text = HEAD.to_owned();
    for (part, head) in
        [(Part::Exact, EXACT), (Part::Bound, BOUNDS), (Part::Consistency, CONSISTENCY)]
    {
        text += head;
        for row in rows.iter().filter(|row| row.part == part) {
            writeln!(text, "{} | {} |", row.key, row.cells).expect("a string takes everything");
        }
    }
    text += "\n";
    text += LARGE;
    std::fs::write(path, text).expect("the page can be written");
}

/// Cells of a row: case, deck, quantity and so on.
fn cells(row: &str) -> Vec<&str> {
    row.trim_matches(['|', ' ']).split(" | ").collect()
}

/// Every tolerance is at most ten times the error that the row shows, or that of rounding.
#[test]
fn tolerances_are_ten_times_the_error() {
    if rewrites() {
        return;
    }
    let all: Vec<&str> = rows(Part::Exact).chain(rows(Part::Consistency)).collect();
    assert!(all.len() > 400, "{} rows", all.len());
    for row in all {
        let [.., error, tolerance] = cells(row)[..] else { panic!("{row}") };
        let error = number(error).expect("an error");
        let most = number(tolerance).expect("a tolerance");
        assert!(error <= most, "{row}");
        let Some((_, reason)) = tolerance.split_once(", ") else {
            assert!(most <= 10.6 * error, "{row}");
            continue;
        };
        let of = reason.strip_prefix("rounding").unwrap_or_else(|| panic!("no reason: {row}"));
        let size = of.strip_prefix(" of ").map_or(1.0, |size| size.parse().expect("a size"));
        assert!(most <= 1.06 * ROUNDING * size, "{row}");
    }
}

#[test]
fn rows_are_unique_and_complete() {
    if rewrites() {
        return;
    }
    for (part, columns) in [(Part::Exact, 7), (Part::Bound, 5), (Part::Consistency, 7)] {
        let mut known = BTreeSet::new();
        for row in rows(part) {
            let cells = cells(row);
            // A bar within a cell would be a column of its own.
            assert_eq!((cells.len(), row.matches('|').count()), (columns, columns + 1), "{row}");
            assert!(known.insert((cells[1], cells[2])), "twice: {row}");
        }
    }
}

#[test]
fn every_deck_is_a_case_of_the_table() {
    for file in std::fs::read_dir(shared::root("examples/verification")).expect("the decks") {
        let name = file.expect("a deck").file_name().into_string().expect("plain names");
        let deck = name.strip_suffix(".toml").expect("decks alone");
        assert!(CASES.iter().any(|case| case.deck == deck), "{deck} is not verified");
    }
    if rewrites() {
        return;
    }
    for Case { name, deck } in CASES {
        let start = format!("| {name} | [{deck}]");
        assert!(page().contains(&start), "docs/verification.md lacks {name}, {deck}");
    }
}

/// The page has the tolerances; a header with another one would contradict it.
#[test]
fn decks_state_no_tolerance() {
    for Case { deck, .. } in CASES {
        let text = shared::example(deck);
        for line in text.lines().filter(|line| line.trim_start().starts_with('#')) {
            let states = ["Tolerance", "Assert"].into_iter().find(|word| line.contains(word));
            assert_eq!(states, None, "{deck}: {line}");
        }
    }
}
