//! Files of regions that have been cut: `blocks.csv`, `fractures.csv` and `blocks.vtkhdf`.

mod table;

pub use table::table;

use std::path::Path;

use ddem_deck::{BlockVerdict, CutRock, Deck, Source};

use crate::folder::{self, Earlier, Folder};
use crate::output_error::OutputError;
use crate::run::RunFailure;
use crate::vtkhdf::{Cells, Constant, FieldSpec, Grid, Location, Writer};

/// Columns of `blocks.csv`, a row for each cell.
const COLUMNS: [&str; 20] = [
    "cell",
    "volume",
    "surface",
    "free_area",
    "width",
    "faces",
    "vertices",
    "hexes",
    "x",
    "y",
    "z",
    "region",
    "material",
    "block",
    "cuts",
    "mode",
    "factor",
    "plunge",
    "trend",
    "on",
];

/// Columns of `fractures.csv`, a row for each disc or polygon. A deck reads the file as `dfn.file`.
const FRACTURES: [&str; 9] =
    ["fracture", "cut", "x", "y", "z", "dip", "dip_direction", "radius", "area"];

/// Writes the cells of a deck to a folder, and returns the folder.
///
/// # Errors
///
/// The folder or its files cannot be written.
pub fn write(
    rock: &CutRock,
    (deck, source): (&Deck, &Source),
    out: &Path,
    earlier: Earlier,
) -> Result<Folder, RunFailure> {
    let name = Path::new(source.name()).file_name().unwrap_or_default().to_string_lossy();
    let folder = folder::prepare(out, &name, &deck.title, source.text(), earlier)?;
    let verdicts = rock.verdicts();
    rows(rock, &verdicts, &folder.cells())?;
    if !rock.fractures.is_empty() {
        fractures(rock, &folder.fractures())?;
    }
    hexahedra(rock, &verdicts, &folder.blocks())?;
    Ok(folder)
}

fn rows(rock: &CutRock, verdicts: &[BlockVerdict], path: &Path) -> Result<(), OutputError> {
    let wrong = |error| OutputError::csv(path, "writing", error);
    let mut writer = csv::Writer::from_path(path).map_err(wrong)?;
    writer.write_record(COLUMNS).map_err(wrong)?;
    for (number, cell) in rock.complex.cells().iter().enumerate() {
        let (of, verdict) = (&rock.properties[number], &verdicts[number]);
        let text = |value: Option<f64>| value.map_or_else(String::new, |value| value.to_string());
        let on: Vec<String> = verdict.on.iter().map(|&cut| rock.cut_name(cut)).collect();
        let row = [
            number.to_string(),
            of.volume.to_string(),
            rock.surface(number).to_string(),
            verdict.free_area.to_string(),
            of.width.to_string(),
            cell.faces.len().to_string(),
            cell.vertices().len().to_string(),
            rock.n_elements(number).to_string(),
            of.centroid.x.to_string(),
            of.centroid.y.to_string(),
            of.centroid.z.to_string(),
            rock.region_name(cell.region as usize),
            rock.region(number).material.clone(),
            rock.blocks[number].to_string(),
            rock.cut_names(number).join(";"),
            verdict.mode.name().to_owned(),
            text(verdict.factor),
            text(verdict.plunge_trend.map(|[plunge, _]| plunge)),
            text(verdict.plunge_trend.map(|[_, trend]| trend)),
            on.join(";"),
        ];
        writer.write_record(row).map_err(wrong)?;
    }
    writer.flush().map_err(|error| OutputError::io(path, "writing", error))
}

fn fractures(rock: &CutRock, path: &Path) -> Result<(), OutputError> {
    let wrong = |error| OutputError::csv(path, "writing", error);
    let mut writer = csv::Writer::from_path(path).map_err(wrong)?;
    writer.write_record(FRACTURES).map_err(wrong)?;
    for (number, of) in rock.fractures.iter().enumerate() {
        let [x, y, z] = of.centre;
        let numbers = [x, y, z, of.dip, of.dip_direction, of.radius, of.area];
        let names = [number.to_string(), rock.cut_name(of.cut)];
        let row = names.into_iter().chain(numbers.map(|number| number.to_string()));
        writer.write_record(row).map_err(wrong)?;
    }
    writer.flush().map_err(|error| OutputError::io(path, "writing", error))
}

/// Writes the hexahedra of the cells, with the numbers of cell, block and region, volume, width, and
/// the mode and the factor of block theory.
fn hexahedra(rock: &CutRock, verdicts: &[BlockVerdict], path: &Path) -> Result<(), OutputError> {
    let hexes = rock.complex.hexes();
    let points = hexes.points.into_iter().map(Into::into).collect();
    let grid = Grid { points, cells: Cells::Hexahedra(hexes.hexes) };
    let of = |number: &dyn Fn(usize) -> u32| -> Vec<i32> {
        hexes.cells.iter().map(|&cell| number(cell as usize) as i32).collect()
    };
    let cells = of(&|cell| cell as u32);
    let blocks = of(&|cell| rock.blocks[cell]);
    let regions = of(&|cell| rock.complex.cells()[cell].region);
    let modes = of(&|cell| verdicts[cell].mode as u32);
    let constant = |name, values| Constant { name, location: Location::Cell, values };
    let constants = [("cell", &cells), ("block", &blocks), ("region", &regions), ("mode", &modes)]
        .map(|(name, values)| constant(name, values));
    let fields = ["volume", "width", "factor"].map(|name| FieldSpec::cell(name, 1));
    let mut writer = Writer::create(path, &grid, &constants, &fields)?;
    writer.append(0.0, None, &|field, rows, out| {
        for (value, row) in out.iter_mut().zip(rows) {
            let cell = hexes.cells[row] as usize;
            let (properties, factor) = (&rock.properties[cell], verdicts[cell].factor);
            *value = [properties.volume, properties.width, factor.unwrap_or(f64::NAN)][field];
        }
    })?;
    Ok(())
}
