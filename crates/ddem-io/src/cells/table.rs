//! Short table about the cells of a deck.

use std::fmt::Write;

use ddem_core::counted;
use ddem_deck::{CutRock, SmallKind};

/// Number of the thinnest cells that are listed.
const LISTED: usize = 10;

/// Numbers and volumes of the cells of each region, and the thinnest cells with what cut them. `added` is the
/// [inertia](CutRock::added_inertia) added to each region.
#[must_use]
pub fn table(rock: &CutRock, added: &[f64]) -> String {
    let mut text = String::new();
    let n = rock.complex.cells().len();
    let blocks = rock.blocks.iter().max().map_or(0, |last| last + 1);
    let joints = rock.common.iter().filter(|face| rock.is_joint(face)).count();
    let elements: usize = (0..n).map(|cell| rock.n_elements(cell)).sum();
    // A string takes any text.
    let _ = writeln!(
        text,
        "{} in {}, {}, {}",
        counted(n, "cell"),
        counted(blocks as usize, "block"),
        counted(joints, "joint face"),
        counted(elements, "element")
    );
    for (number, left_out) in rock.left_out_joints().iter().enumerate() {
        let _ = writeln!(text, "join[{number}] leaves {} out", counted(*left_out, "joint face"));
    }
    text.push('\n');
    let width = (0..rock.regions().len()).map(|region| rock.region_name(region).chars().count());
    let width = width.max().unwrap_or(0).max("region".len());
    let _ = writeln!(
        text,
        "{:width$}  {:>8}  {:>12}  {:>12}  {:>12}  {:>12}",
        "region", "cells", "volume m³", "smallest m³", "largest m³", "width m"
    );
    for region in 0..rock.regions().len() {
        let volumes = || rock.cells_of(region).iter().map(|&cell| rock.properties[cell].volume);
        let _ = writeln!(
            text,
            "{:width$}  {:>8}  {:>12.6}  {:>12.3e}  {:>12.3e}  {:>12.4}",
            rock.region_name(region),
            volumes().count(),
            volumes().sum::<f64>(),
            volumes().fold(f64::INFINITY, f64::min),
            volumes().fold(0.0, f64::max),
            rock.median_width(region),
        );
    }
    text.push('\n');
    for (region, added) in added.iter().enumerate() {
        text += &thin(rock, region, *added);
    }
    if rock.complex.n_uncut() > 0 {
        let _ = writeln!(
            text,
            "{} left a cell whole, because the plane passes nearly through its corners",
            counted(rock.complex.n_uncut(), "cut")
        );
    }
    text += &idle_fractures(rock);
    text + &thinnest(rock)
}

/// Line on the discs and polygons that cut no cell.
fn idle_fractures(rock: &CutRock) -> String {
    let idle = rock.idle_fractures();
    if idle == 0 {
        return String::new();
    }
    format!(
        "{idle} of {} cut no cell: none lies there that `where` selects, or they cover at most a twentieth of its section\n",
        counted(rock.fractures.len(), "fracture")
    )
}

/// Line on the cells of a region that are thin, what becomes of them, and the inertia added.
fn thin(rock: &CutRock, region: usize, added: f64) -> String {
    let small = rock.regions()[region].small;
    let least = small.width * rock.median_width(region);
    let cells = rock.cells_of(region);
    let total: f64 = cells.iter().map(|&cell| rock.properties[cell].volume).sum();
    let is_thin = |cell: &&usize| rock.treatment(**cell).is_some();
    let thin: Vec<_> = cells.iter().filter(is_thin).map(|&cell| rock.properties[cell]).collect();
    if thin.is_empty() && added == 0.0 {
        return String::new();
    }
    // The sum of no numbers is −0.
    let share = 100.0 * thin.iter().fold(0.0, |sum, of| sum + of.volume) / total;
    let added = format!("{:.3} % of the mass", 100.0 * added);
    let effect = match small.is {
        SmallKind::Scaled => format!("more inertia there and at sharp corners, {added}"),
        SmallKind::Rigid => format!("rigid, with more inertia, {added}"),
        SmallKind::Removed => "removed".to_owned(),
    };
    format!(
        "{}: {} of {} cells are thinner than {least:.4} m, with {share:.3} % of the volume: {effect}\n",
        rock.region_name(region),
        thin.len(),
        cells.len(),
    )
}

fn thinnest(rock: &CutRock) -> String {
    let mut cells: Vec<usize> = (0..rock.complex.cells().len()).collect();
    cells.sort_by(|&a, &b| rock.properties[a].width.total_cmp(&rock.properties[b].width));
    let mut text = format!(
        "\n{:>8}  {:>10}  {:>10}  {:<28}  cut by\n",
        "thinnest", "width m", "volume m³", "centroid"
    );
    for &cell in cells.iter().take(LISTED) {
        let of = &rock.properties[cell];
        let place = of.centroid.iter().map(|part| format!("{part:.3}")).collect::<Vec<_>>();
        let place = format!("[{}]", place.join(", "));
        let _ = writeln!(
            text,
            "{cell:>8}  {:>10.3e}  {:>10.3e}  {place:<28}  {}",
            of.width,
            of.volume,
            rock.cut_names(cell).join(", ")
        );
    }
    text
}
