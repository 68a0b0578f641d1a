//! Checks of numbers, by case. Each check is a row of the page.

use super::page::{Part, keep, plain, recorded, rewrites};

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
    case("V5 direct shear", "cells_shear"),
    case("V5 pull", "v05_pull_thick"),
    case("V5 pull", "v05_pull_spring"),
    case("V5 pull", "v05_pull_softening"),
    case("Barton's law", "barton_bandis"),
    case("V6 wave through a joint", "v06_p_spring"),
    case("V6 wave through a joint", "v06_p_thick"),
    case("V6 wave through a joint", "v06_refined"),
    case("V6 wave through a joint", "v06_s_spring"),
    case("V6 wave through a joint", "v06_s_thick"),
    case("V6 wave through a joint", "cells_joint"),
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
    case("Cells of a region", "cells_pressed"),
    case("Cells of a region", "cells_in_place"),
    case("Cells of a region", "cells_blocks"),
    case("Cells of a region", "cells_slide"),
    case("Cells of a region", "cells_cantilever"),
    case("Cells and block theory", "cells_roof"),
    case("Cells and block theory", "cells_tunnel"),
    case("Cells and block theory", "cells_arch"),
    case("Cells that meet", "cells_glide"),
    case("Cells that meet", "cells_toss"),
    case("Cells that meet", "cells_meet"),
    case("Cells that meet", "cells_slit"),
    case("Cells that meet", "cells_topple"),
    case("Cells that meet", "cells_rock"),
    case("Cells that meet", "cells_strike"),
    case("Cells that meet", "cells_wedge"),
    case("Regions that touch", "regions_column"),
    case("Regions that touch", "regions_slope"),
    case("Regions that touch", "regions_glide"),
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
    case("V14 wave from below, cells", "cells_wave"),
    case("V14 free field", "v14_free_field"),
    case("V15 convergence", "v15_convergence_n2"),
    case("V15 convergence", "v15_convergence_n4"),
    case("V15 convergence", "v15_convergence_n8"),
    case("V15 convergence", "cells_sag"),
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

/// Largest allowed error of a number, as the case states it. The page records a smaller one: ten
/// times the error found.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Tolerance {
    /// Part of the exact value.
    Relative(f64),
    /// Absolute error. If it is 0, the number is a count, or one that must not change at all.
    Absolute(f64),
    /// Part of the size of the numbers that nearly cancel, with that size.
    Of(f64, f64),
}

use Tolerance::{Absolute, Of, Relative};

/// Error that rounding may leave, as a part of the size of the numbers: 45 units in the last place.
pub(crate) const ROUNDING: f64 = 1e-14;

/// Asserts that a number equals an exact answer from outside this program.
pub(crate) fn check(case: Case, quantity: &str, exact: f64, computed: f64, tolerance: Tolerance) {
    compare(Part::Exact, case, quantity, [exact, computed], tolerance);
}

/// Asserts that a number follows a conservation law, or equals that of another way or run.
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
    let bound = format!("at most {}", plain(most));
    bounded(case, quantity, computed <= most, [&bound, &plain(computed)]);
}

/// Asserts that a number is no smaller than a bound.
pub(crate) fn at_least(case: Case, quantity: &str, least: f64, computed: f64) {
    let bound = format!("at least {}", plain(least));
    bounded(case, quantity, computed >= least, [&bound, &plain(computed)]);
}

/// Asserts that a number lies between two bounds.
pub(crate) fn between(case: Case, quantity: &str, computed: f64, [low, high]: [f64; 2]) {
    let bound = format!("{} to {}", plain(low), plain(high));
    bounded(case, quantity, (low..=high).contains(&computed), [&bound, &plain(computed)]);
}

/// Asserts that an exact limit lies between the largest factor at which a model stands and the
/// smallest one at which it fails.
pub(crate) fn bracket(case: Case, quantity: &str, exact: f64, [stands, fails]: [f64; 2]) {
    let found =
        format!("{} stands, {} fails: {:.1e} wide", plain(stands), plain(fails), fails - stands);
    let holds = stands <= exact && exact <= fails;
    bounded(case, quantity, holds, [&format!("contains {}", plain(exact)), &found]);
}

/// Asserts that an exact limit lies between the largest number at which a model fails and the smallest
/// one at which it stands.
pub(crate) fn least(case: Case, quantity: &str, exact: f64, [fails, stands]: [f64; 2]) {
    let found =
        format!("{} fails, {} stands: {:.1e} wide", plain(fails), plain(stands), stands - fails);
    let holds = fails <= exact && exact <= stands;
    bounded(case, quantity, holds, [&format!("contains {}", plain(exact)), &found]);
}

fn bounded(case: Case, quantity: &str, holds: bool, [bound, computed]: [&str; 2]) {
    let cells = format!("{bound} | {computed}");
    assert!(holds, "{}, {}: {quantity} | {cells}", case.name, case.deck);
    keep(Part::Bound, case, quantity, &cells);
}

fn compare(part: Part, case: Case, quantity: &str, [exact, computed]: [f64; 2], stated: Tolerance) {
    let (error, most, unit) = match stated {
        Relative(most) => ((computed / exact - 1.0).abs(), most, " of it"),
        Absolute(most) => ((computed - exact).abs(), most, ""),
        Of(size, part) => ((computed - exact).abs(), part * size, ""),
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
    let (next, reason) = ratchet(error, most, stated);
    let cells = format!("{exact} | {computed} | {error:.1e} | {next:.1e}{unit}{reason}");
    keep(part, case, quantity, &cells);
}

/// Tolerance that the page records for an error: ten times the error, but not below rounding and
/// not above the stated tolerance.
fn ratchet(error: f64, most: f64, stated: Tolerance) -> (f64, String) {
    let (rounding, reason) = match stated {
        Relative(_) => (ROUNDING, ", rounding".to_owned()),
        Of(size, _) => (ROUNDING * size, format!(", rounding of {}", plain(size))),
        Absolute(_) => (0.0, String::new()),
    };
    assert!(rounding <= most, "less than rounding: {stated:?}");
    if 10.0 * error <= rounding {
        return (rounding, reason);
    }
    // Rounded down to two digits.
    let unit = 10_f64.powi(error.log10().floor() as i32);
    (((10.0 * error / unit).floor() * unit).min(most), String::new())
}
