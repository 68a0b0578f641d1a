//! One check, and the table of all of them.

use std::fmt::Write as _;
use std::path::Path;
use std::sync::Mutex;

use super::shared;

/// A case of the verification, and the deck that it runs.
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
    case("Barton–Bandis", "barton_bandis"),
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

/// What a computed number may differ by.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Tolerance {
    /// This part of the exact value.
    Relative(f64),
    /// This much.
    Absolute(f64),
    /// It may be anything up to the value given as exact.
    AtMost,
    /// It must lie between these.
    BlendedLaw(f64, f64),
}

use Tolerance::{Absolute, AtMost, BlendedLaw, Relative};

/// A line of the table: where it belongs, and its cells.
type Row = (usize, String);

static ROWS: Mutex<Vec<Row>> = Mutex::new(Vec::new());

/// Asserts that a number is right, and keeps it for the table.
pub(crate) fn check(case: Case, quantity: &str, exact: f64, computed: f64, tolerance: Tolerance) {
    let error = match tolerance {
        Relative(_) => (computed / exact - 1.0).abs(),
        _ => (computed - exact).abs(),
    };
    let (right, allowed) = match tolerance {
        Relative(most) => (error <= most, format!("{most:.0e} of it")),
        Absolute(most) => (error <= most, format!("{most:.1e}")),
        AtMost => (computed <= exact, "at most".to_owned()),
        BlendedLaw(low, high) => ((low..=high).contains(&computed), format!("{low} to {high}")),
    };
    let error = if matches!(tolerance, AtMost) { "–".to_owned() } else { format!("{error:.1e}") };
    let Case { name, deck } = case;
    let link = format!("[{deck}](../examples/verification/{deck}.toml)");
    let (exact, computed) = (plain(exact), plain(computed));
    let row =
        format!("| {name} | {link} | {quantity} | {exact} | {computed} | {error} | {allowed} |");
    println!("{row}");
    assert!(right, "{name}, {deck}: {quantity} is {computed}, not {exact} (±{allowed})");
    let order = CASES.iter().position(|c| *c == case).expect("a case of the list");
    let mut rows = ROWS.lock().expect("no check has failed");
    rows.push((order, row));
    if let Some(path) = std::env::var_os("DDEM_VERIFICATION") {
        write(&shared::root("").join(path), &rows);
    }
}

/// Seven digits, with a power of ten where it is shorter.
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
        format!("{number:.6e}")
    }
}

const HEAD: &str = "\
# Verification

Every row is asserted by `cargo test --test verification`, and this page is written by

```
DDEM_VERIFICATION=docs/verification.md cargo test --test verification
```

Exact values are closed forms, equilibrium, or an independent finite element model
(`tests/fem`, `tests/data`); the header of each deck says which. SI units. \"At most\": the exact
column holds the bound.

| Case | Deck | Quantity | Exact | Computed | Error | Tolerance |
|---|---|---|---|---|---|---|
";

/// Writes the table of what has been checked so far.
fn write(path: &Path, rows: &[Row]) {
    let mut rows = rows.to_vec();
    rows.sort_by_key(|row| row.0);
    let mut text = HEAD.to_owned();
    for (_, row) in rows {
        writeln!(text, "{row}").expect("a string takes everything");
    }
    std::fs::write(path, text).expect("the table can be written");
}

#[test]
fn the_table_has_every_case_and_every_deck_is_a_case() {
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
