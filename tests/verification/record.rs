//! Checks, and the page that lists all of them.

use std::fmt::Write as _;
use std::path::Path;
use std::sync::{Mutex, OnceLock};

use super::shared;

/// Case of the verification with its deck.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Case {
    /// Name in the table.
    pub(crate) name: &'static str,
    /// Name of the deck in `examples/verification`.
    pub(crate) deck: &'static str,
}

const fn case(name: &'static str, deck: &'static str) -> Case {
    Case { name, deck }
}

/// All cases, in the order of the table.
pub(crate) const CASES: &[Case] = &[
    case("V1 Poisson effect", "v01_poisson"),
    case("V1 base of the paper", "v01_paper_base"),
    case("V1 rigid blocks", "v01_rigid"),
    case("V2 compression wave", "v02_p_wave"),
    case("V2 shear wave", "v02_s_wave"),
    case("V2 bar wave", "v02_bar_wave"),
    case("V3 beam", "v03_beam"),
    case("V3 beam", "v03_beam_t0001"),
    case("V3 beam", "v03_beam_t005"),
    case("V4 incline", "v04_slides"),
    case("V4 incline", "v04_stays"),
    case("V4 incline", "v04_stages"),
    case("V4 incline, in contact", "v04_contact_slides"),
    case("V4 incline, in contact", "v04_contact_stays"),
    case("V4 incline, in contact", "v04_contact_steep"),
    case("V4 toppling", "v04_topples"),
    case("V4 toppling", "v04_topples_joint"),
    case("Blocks at rest", "v04_column"),
    case("Blocks at rest", "v04_edge"),
    case("Blocks at rest", "v04_corbel"),
    case("Blocks that slide", "v04_neighbours"),
    case("Blocks that slide", "slide_plane"),
    case("V5 direct shear", "v05_shear_thick"),
    case("V5 direct shear", "v05_shear_spring"),
    case("V5 direct shear", "v05_shear_softening"),
    case("V5 direct shear", "v05_sledge"),
    case("V5 pull", "v05_pull_thick"),
    case("V5 pull", "v05_pull_spring"),
    case("V5 pull", "v05_pull_softening"),
    case("Barton's law", "barton_bandis"),
    case("V6 wave through a joint", "v06_p_spring"),
    case("V6 wave through a joint", "v06_p_thick"),
    case("V6 wave through a joint", "v06_refined"),
    case("V6 wave through a joint", "v06_s_spring"),
    case("V6 wave through a joint", "v06_s_thick"),
    case("V7 shear failure", "v07_shear"),
    case("V8 beam with cracks", "v08_beam_cracks"),
    case("Relaxation beyond strength", "relax_strength"),
    case("Limit strength", "limit_plane"),
    case("Limit strength", "limit_column"),
    case("Limit strength", "limit_wedges"),
    case("Factor of safety, toppling", "limit_topple"),
    case("Limit strength", "limit_slope"),
    case("Relaxation of a crack", "relax_crack"),
    case("Relaxation, large turns", "relax_bend"),
    case("Relaxation by increments", "relax_stretch"),
    case("Relaxation by increments", "relax_weaken"),
    case("Relaxation far away", "relax_far"),
    case("Cantilever", "cantilever_standard"),
    case("Cantilever", "cantilever_incompatible"),
    case("Cantilever", "cantilever_default"),
    case("V9 rocking block", "v09_rocking"),
    case("V10 large rotation", "v10_spin"),
    case("V10 large rotation", "v10_spin_rigid"),
    case("V10 large rotation", "v10_spin_blocks"),
    case("V10 what breaks in flight", "v10_apart_spring"),
    case("V10 what breaks in flight", "v10_apart_thick"),
    case("V10 collision", "v10_collide"),
    case("V10 collision", "v10_wall"),
    case("Blocks that meet", "meet_toss"),
    case("Blocks that meet", "meet_cubes"),
    case("V11 energy", "v11_energy"),
    case("V11 energy", "v11_damped"),
    case("Blast", "blast_piston"),
    case("Blast", "blast_column"),
    case("Blast", "blast_sphere"),
    case("Blast", "blast_sphere_fine"),
    case("V12 blast", "v12_blast"),
    case("V13 half space", "v13_half_space"),
    case("V14 waves that leave", "v14_p"),
    case("V14 waves that leave", "v14_s"),
    case("V14 wave from below", "v14_wave"),
    case("V14 free field", "v14_free_field"),
    case("V15 convergence", "v15_convergence_n2"),
    case("V15 convergence", "v15_convergence_n4"),
    case("V15 convergence", "v15_convergence_n8"),
    case("V15 convergence", "v15_time_1"),
    case("V15 convergence", "v15_time_2"),
    case("V15 convergence", "v15_time_4"),
    case("V15 convergence", "v15_time_reference"),
    case("V16 overburden", "v16_overburden"),
    case("V16 excavated face", "v16_face"),
    case("V17 round tunnel", "v17_tunnel_4"),
    case("V17 round tunnel", "v17_tunnel_8"),
    case("V17 round tunnel", "v17_tunnel_refined"),
];

/// The case of a deck.
pub(crate) fn of(deck: &str) -> Case {
    *CASES.iter().find(|case| case.deck == deck).expect("a case of the list")
}

/// Largest allowed error of a number, as the case states it. The table records a smaller one: ten
/// times the error found.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Tolerance {
    /// Relative to the exact value.
    Relative(f64),
    /// Absolute error.
    Absolute(f64),
}

use Tolerance::{Absolute, Relative};

/// Section of the page to which a row belongs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Part {
    Exact,
    Bound,
    Consistency,
}

/// Row of a table: its section, the number of its case and the name of its test, its cells.
type Row = (Part, (usize, String), String);

static ROWS: Mutex<Vec<Row>> = Mutex::new(Vec::new());

/// Asserts that a number equals an exact answer from outside this program.
pub(crate) fn check(case: Case, quantity: &str, exact: f64, computed: f64, tolerance: Tolerance) {
    compare(Part::Exact, case, quantity, [exact, computed], tolerance);
}

/// Asserts that a number follows a conservation law, or equals that of the same run in another way.
pub(crate) fn consistent(
    case: Case,
    quantity: &str,
    expected: f64,
    computed: f64,
    tolerance: Tolerance,
) {
    compare(Part::Consistency, case, quantity, [expected, computed], tolerance);
}

/// Asserts that a number is no larger than a bound.
pub(crate) fn at_most(case: Case, quantity: &str, most: f64, computed: f64) {
    bounded(case, quantity, computed, computed <= most, &format!("at most {}", plain(most)));
}

/// Asserts that a number is no smaller than a bound.
pub(crate) fn at_least(case: Case, quantity: &str, least: f64, computed: f64) {
    bounded(case, quantity, computed, computed >= least, &format!("at least {}", plain(least)));
}

/// Asserts that a number lies between two bounds.
pub(crate) fn between(case: Case, quantity: &str, computed: f64, [low, high]: [f64; 2]) {
    let bound = format!("{} to {}", plain(low), plain(high));
    bounded(case, quantity, computed, (low..=high).contains(&computed), &bound);
}

fn bounded(case: Case, quantity: &str, computed: f64, holds: bool, bound: &str) {
    let cells = format!("{quantity} | {bound} | {}", plain(computed));
    assert!(holds, "{}, {}: {cells}", case.name, case.deck);
    keep(Part::Bound, case, &cells);
}

fn compare(part: Part, case: Case, quantity: &str, [exact, computed]: [f64; 2], stated: Tolerance) {
    let (error, most, unit) = match stated {
        Relative(most) => ((computed / exact - 1.0).abs(), most, " of it"),
        Absolute(most) => ((computed - exact).abs(), most, ""),
    };
    let recorded = recorded(part, case, quantity);
    let allowed = if rewrites() { most } else { recorded.map_or(most, |known| known.min(most)) };
    let [exact, computed] = [plain(exact), plain(computed)];
    let what = format!("{}, {}: {quantity}", case.name, case.deck);
    assert!(
        error <= allowed,
        "{what} is {computed}, not {exact}: off by {error:.1e} of {allowed:.1e}"
    );
    assert!(rewrites() || recorded.is_some(), "docs/verification.md lacks {what}");
    let (next, reason) = ratchet(error, most, matches!(stated, Relative(_)));
    keep(
        part,
        case,
        &format!("{quantity} | {exact} | {computed} | {error:.1e} | {next:.1e}{unit}{reason}"),
    );
}

/// Tolerance that the table records for an error: ten times the error, but not below rounding and
/// not above the stated tolerance.
fn ratchet(error: f64, stated: f64, relative: bool) -> (f64, &'static str) {
    let rounding = if relative { 1e-9 } else { 1e-6 * stated }.min(stated);
    if 10.0 * error <= rounding {
        return (rounding, ", rounding");
    }
    // Rounded down to two digits.
    let unit = 10_f64.powi(error.log10().floor() as i32);
    (((10.0 * error / unit).floor() * unit).min(stated), "")
}

/// True if the page is to be written.
fn rewrites() -> bool {
    std::env::var_os("DDEM_VERIFICATION").is_some()
}

/// Tolerance of a row of the page.
fn recorded(part: Part, case: Case, quantity: &str) -> Option<f64> {
    static PAGE: OnceLock<String> = OnceLock::new();
    let read = || std::fs::read_to_string(shared::root("docs/verification.md")).expect("the page");
    let page = PAGE.get_or_init(read);
    let heading = heading(part);
    let table = page.split("\n## ").find(|table| table.starts_with(heading))?;
    let start = format!("{} {quantity} |", first_cells(case));
    let row = table.lines().find(|row| row.starts_with(&start))?;
    let cell = row.trim_end_matches(" |").rsplit("| ").next()?;
    cell.split([' ', ',']).next()?.parse().ok()
}

fn heading(part: Part) -> &'static str {
    match part {
        Part::Exact => "Exact",
        Part::Bound => "Bounds",
        Part::Consistency => "Consistency",
    }
}

fn first_cells(Case { name, deck }: Case) -> String {
    format!("| {name} | [{deck}](../examples/verification/{deck}.toml) |")
}

/// Stores a row for the page, and writes the page on request.
fn keep(part: Part, case: Case, cells: &str) {
    let row = format!("{} {cells} |", first_cells(case));
    println!("{row}");
    let order = CASES.iter().position(|c| *c == case).expect("a case of the list");
    let mut rows = ROWS.lock().expect("no check has failed");
    // Tests run side by side: rows of one case are in the order of the names of the tests.
    let test = std::thread::current().name().unwrap_or_default().to_owned();
    rows.push((part, (order, test), row));
    if let Some(path) = std::env::var_os("DDEM_VERIFICATION") {
        write(&shared::root("").join(path), &rows);
    }
}

/// Number with seven digits, or with a power of ten if that is shorter.
fn plain(number: f64) -> String {
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

Numbers are in SI units. A tolerance is at most ten times the error found. If the error is rounding, the tolerance is
that of rounding, and the row is marked `rounding`. In all other rows a change that makes the error ten times larger
fails the tests.
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

The number must keep a limit, from theory or from what the case shows. Energy must not grow, stable blocks must not
creep, and unstable ones must fall. The order of convergence must be at least that of the scheme.

| Case | Deck | Quantity | Bound | Computed |
|---|---|---|---|---|
";

const CONSISTENCY: &str = "
## Consistency

The expected value comes from a conservation law, or from a second way to compute the same quantity in the same run.

| Case | Deck | Quantity | Expected | Computed | Error | Tolerance |
|---|---|---|---|---|---|---|
";

/// Results of runs that are too long for every check.
const LARGE: &str = include_str!("large.md");

/// Writes the page of the checks so far.
fn write(path: &Path, rows: &[Row]) {
    let mut rows = rows.to_vec();
    rows.sort_by(|a, b| (a.0, &a.1).cmp(&(b.0, &b.1)));
    let mut text = HEAD.to_owned();
    for (part, head) in
        [(Part::Exact, EXACT), (Part::Bound, BOUNDS), (Part::Consistency, CONSISTENCY)]
    {
        text += head;
        for (_, _, row) in rows.iter().filter(|row| row.0 == part) {
            writeln!(text, "{row}").expect("a string takes everything");
        }
    }
    text += "\n";
    text += LARGE;
    std::fs::write(path, text).expect("the page can be written");
}

/// Tolerances are ten times the error found, unless the row states a reason.
#[test]
fn tolerances_are_ten_times_the_error() {
    if rewrites() {
        return;
    }
    let text = std::fs::read_to_string(shared::root("docs/verification.md")).expect("the page");
    let tables =
        text.split("\n## ").filter(|t| t.starts_with("Exact") || t.starts_with("Consistency"));
    let rows: Vec<&str> =
        tables.flat_map(str::lines).filter(|row| row.starts_with("| V")).collect();
    assert!(rows.len() > 300, "{} rows", rows.len());
    for row in rows {
        let cells: Vec<&str> = row.trim_matches(['|', ' ']).split(" | ").collect();
        let [.., error, tolerance] = cells[..] else { panic!("{row}") };
        let number = |cell: &str| cell.split([' ', ',']).next().and_then(|x| x.parse::<f64>().ok());
        let (error, most) =
            (number(error).expect("an error"), number(tolerance).expect("a tolerance"));
        assert!(tolerance.contains(", ") || most <= 10.6 * error, "{row}");
    }
}

#[test]
fn every_deck_is_a_case_of_the_table() {
    for file in std::fs::read_dir(shared::root("examples/verification")).expect("the decks") {
        let name = file.expect("a deck").file_name().into_string().expect("plain names");
        let deck = name.strip_suffix(".toml").expect("decks alone");
        assert!(CASES.iter().any(|case| case.deck == deck), "{deck} is not verified");
    }
    if std::env::var_os("DDEM_VERIFICATION").is_some() {
        return;
    }
    let text = std::fs::read_to_string(shared::root("docs/verification.md")).expect("the table");
    for Case { name, deck } in CASES {
        let start = format!("| {name} | [{deck}]");
        assert!(text.contains(&start), "docs/verification.md lacks {name}, {deck}");
    }
}
