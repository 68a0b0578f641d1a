//! Files that a deck names: closed surfaces as STL, topographies as CSV or ESRI ASCII grids.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::io::{Cursor, Read};
use std::path::Path;
use std::sync::Arc;

use crate::schema::{Deck, FileIn, FileOf, Heights, SurfaceFile, Triangles, names};
use ddem_core::{ErrorCode, Fault, ModelError};

use super::fractures::fractures;
use super::rock_files::{is_surface, rock};
use crate::near::near;

/// Largest number of points of a grid of heights.
const MOST_POINTS: usize = 100_000_000;

/// Reads the files that a deck names and that have not been read; paths are relative to `folder`.
/// Surfaces with the name of a tunnel of the deck are those of the tunnel.
///
/// # Errors
///
/// Files cannot be read, or have other contents.
pub fn read_files(deck: &mut Deck, folder: &Path) -> Result<(), ModelError> {
    let (mut surfaces, mut grids, mut rocks) = (BTreeMap::new(), BTreeMap::new(), BTreeMap::new());
    let mut faults = Vec::new();
    deck.fill_tunnels();
    let cuts = names_of_cuts(deck);
    for (place, selector) in deck.selectors_mut() {
        for (key, file) in selector.files_mut() {
            let wrong = match file {
                FileIn::Triangles(file) if cuts.get(&file.path) == Some(&true) => Ok(()),
                FileIn::Triangles(file) => {
                    fill(file, folder, &mut surfaces, |_, file| triangles(file))
                        .map_err(|fault| maybe_tunnel(fault, &file.path, &cuts))
                }
                FileIn::Topography(file) => fill(file, folder, &mut grids, surface),
            };
            faults.extend(wrong.err().map(|mut fault| {
                fault.place = format!("{place}.{key}");
                fault
            }));
        }
    }
    let mut add = |place: String, wrong: Result<(), Fault>| {
        faults.extend(wrong.err().map(|mut fault| {
            fault.place = place;
            fault
        }));
    };
    for (place, file) in deck.rocks_mut() {
        add(place, fill(file, folder, &mut rocks, rock));
    }
    for (place, file) in deck.surfaces_mut() {
        add(place, fill(file, folder, &mut grids, surface));
    }
    let mut tables = BTreeMap::new();
    for (place, file) in deck.networks_mut() {
        add(place, fill(file, folder, &mut tables, |_, file| fractures(file)));
    }
    if faults.is_empty() { Ok(()) } else { Err(ModelError { faults }) }
}

/// Names of the cuts of a deck, each with true for a tunnel.
fn names_of_cuts(deck: &Deck) -> BTreeMap<String, bool> {
    let named = deck.cut.iter().filter_map(|cut| Some((cut.name.clone()?, cut.tunnel.is_some())));
    named.collect()
}

/// Fault of a file that cannot be read, if its path may be the name of a cut.
fn maybe_tunnel(fault: Fault, path: &str, cuts: &BTreeMap<String, bool>) -> Fault {
    if cuts.contains_key(path) {
        let message = format!("`{path}` is neither a tunnel nor a file that can be read");
        let help =
            "a cut has an inside if it is a `tunnel`; `cut = …` selects the joints of any cut";
        return Fault::new(fault.code, fault.place, message).help(help);
    }
    let tunnels = || cuts.iter().filter(|(_, tunnel)| **tunnel).map(|(name, _)| name.as_str());
    let near = names::nearest(path, tunnels());
    match near {
        Some(near) => {
            let all = names::list(tunnels());
            fault.help(format!("did you mean `{near}`? tunnels of this deck: {all}"))
        }
        None if path.contains(['.', '/', '\\']) => fault,
        None => {
            let all: Vec<&str> = tunnels().collect();
            let all = match all[..] {
                [] => "this deck has none".to_owned(),
                _ => format!("those of this deck are {}", names::list(all.iter().copied())),
            };
            fault.help(format!(
                "`inside` takes the name of a tunnel, {all}, or the path of a closed surface in the folder of \
                 the deck"
            ))
        }
    }
}

/// Changes the paths of the files that a deck names from relative to `folder` to relative to the
/// working directory of the program.
pub fn join_paths(deck: &mut Deck, folder: &Path) {
    let cuts = names_of_cuts(deck);
    for (_, selector) in deck.selectors_mut() {
        for (_, file) in selector.files_mut() {
            let path = match file {
                FileIn::Triangles(file) if cuts.get(&file.path) == Some(&true) => continue,
                FileIn::Triangles(file) => &mut file.path,
                FileIn::Topography(file) => &mut file.path,
            };
            *path = folder.join(&*path).to_string_lossy().into_owned();
        }
    }
    for (_, FileOf { path, .. }) in deck.rocks_mut() {
        *path = folder.join(&*path).to_string_lossy().into_owned();
    }
    for (_, FileOf { path, .. }) in deck.surfaces_mut() {
        *path = folder.join(&*path).to_string_lossy().into_owned();
    }
    for (_, FileOf { path, .. }) in deck.networks_mut() {
        *path = folder.join(&*path).to_string_lossy().into_owned();
    }
}

/// Opens a file. Pipes and devices are refused before they are opened: a pipe may wait for ever, and a device such as
/// `/dev/zero` has no end.
pub(super) fn open(path: &Path) -> std::io::Result<File> {
    let about = std::fs::metadata(path)?;
    if about.is_dir() {
        return Err(std::io::ErrorKind::IsADirectory.into());
    }
    if !about.is_file() {
        return Err(std::io::Error::other("it is a pipe or a device, not a file"));
    }
    File::open(path)
}

/// Reads a file only once, even if a deck names it several times.
fn fill<T>(
    file: &mut FileOf<T>,
    folder: &Path,
    known: &mut BTreeMap<String, Arc<T>>,
    read: impl Fn(&Path, File) -> Result<T, Fault>,
) -> Result<(), Fault> {
    if file.content.is_some() {
        return Ok(());
    }
    if let Some(content) = known.get(&file.path) {
        file.content = Some(content.clone());
        return Ok(());
    }
    let path = folder.join(&file.path);
    let opened = open(&path).map_err(|error: std::io::Error| {
        let message = format!("cannot read `{}`: {error}", path.display());
        let fault = Fault::new(ErrorCode::InvalidFile, "", message);
        match near(&path, |_| true) {
            Some(near) => {
                let near = near.strip_prefix(folder).unwrap_or(&near);
                fault.help(format!("did you mean `{}`?", near.display()))
            }
            None => fault.help("paths are relative to the folder of the deck"),
        }
    })?;
    let content = Arc::new(read(&path, opened).map_err(|mut fault| {
        fault.message = format!("`{}`: {}", path.display(), fault.message);
        fault
    })?);
    known.insert(file.path.clone(), content.clone());
    file.content = Some(content);
    Ok(())
}

const STL: &str = "a surface is an STL file, in text or in binary";

/// Surface of a file: triangles of an STL file, otherwise heights.
fn surface(path: &Path, mut file: File) -> Result<SurfaceFile, Fault> {
    let mut bytes = Vec::new();
    file.read_to_end(&mut bytes).map_err(no_stl)?;
    let named = is_surface(&path.to_string_lossy());
    if named || bytes.trim_ascii_start().starts_with(b"solid") || is_binary(&bytes) {
        return triangles_of(bytes).map(SurfaceFile::Triangles);
    }
    heights(bytes).map(SurfaceFile::Heights)
}

/// Triangles of an STL file, in text or in binary.
pub(super) fn triangles(mut file: File) -> Result<Triangles, Fault> {
    let mut bytes = Vec::new();
    file.read_to_end(&mut bytes).map_err(no_stl)?;
    triangles_of(bytes)
}

fn no_stl(error: std::io::Error) -> Fault {
    Fault::new(ErrorCode::InvalidFile, "", format!("this is no STL file: {error}")).help(STL)
}

fn triangles_of(bytes: Vec<u8>) -> Result<Triangles, Fault> {
    let mut file = Cursor::new(plain(bytes)?);
    let all = stl_io::create_stl_reader(&mut file).map_err(no_stl)?;
    let corners = |triangle: stl_io::Triangle| {
        triangle.vertices.map(|corner| [0, 1, 2].map(|k| f64::from(corner[k])))
    };
    let all: Result<Vec<_>, _> = all.map(|triangle| triangle.map(corners)).collect();
    Ok(Triangles(all.map_err(no_stl)?))
}

/// Number of triangles that a binary STL file announces; `None` if it is too short.
fn announced(bytes: &[u8]) -> Option<u32> {
    let four = bytes.get(80..84).and_then(|four| <[u8; 4]>::try_from(four).ok());
    four.map(u32::from_le_bytes)
}

/// True if a file has the length of a binary STL file with the announced number of triangles.
fn is_binary(bytes: &[u8]) -> bool {
    announced(bytes).is_some_and(|count| 84 + 50 * count as usize == bytes.len())
}

/// STL file with a beginning that the reader accepts. Some programs begin binary files with
/// "solid", too, and some leave out the name in text files.
fn plain(mut bytes: Vec<u8>) -> Result<Vec<u8>, Fault> {
    let count = announced(&bytes);
    let wanted = count.map_or(usize::MAX, |count| 84 + 50 * count as usize);
    let start = bytes.iter().position(|byte| !byte.is_ascii_whitespace()).unwrap_or(0);
    let is_text = bytes[start..].starts_with(b"solid");
    if wanted == bytes.len() || (!is_text && wanted < bytes.len()) {
        bytes[..5].fill(b' ');
        return Ok(bytes);
    }
    if is_text {
        let end = bytes.iter().skip(start).position(|byte| *byte == b'\n');
        let rest = end.map_or(&b""[..], |end| &bytes[start + end..]);
        return Ok([b"solid surface", rest].concat());
    }
    let message = match count {
        Some(count) => {
            format!("this is no STL file: it would have {count} triangles in {} bytes", bytes.len())
        }
        None => "this is no STL file: it is too short".to_owned(),
    };
    Err(Fault::new(ErrorCode::InvalidFile, "", message).help(STL))
}

/// Heights as an ESRI ASCII grid, which begins with `ncols`, or else as CSV.
fn heights(bytes: Vec<u8>) -> Result<Heights, Fault> {
    let text = String::from_utf8(bytes)
        .map_err(|error| no_grid(format!("this is not text: {}", error.utf8_error())))?;
    let first = text.split_whitespace().next().unwrap_or_default();
    if first.eq_ignore_ascii_case("ncols") || first.eq_ignore_ascii_case("nrows") {
        raster(&text)
    } else {
        table(&text)
    }
}

const FORMATS: &str = "heights are CSV with the columns x, y, z, a row for each point of a grid, or an ESRI ASCII grid";

fn no_grid(message: impl Into<String>) -> Fault {
    Fault::new(ErrorCode::InvalidFile, "", message).help(FORMATS)
}

/// Finite number in a text; `None` if there is none.
fn number(text: &str) -> Option<f64> {
    text.trim().parse().ok().filter(|number: &f64| number.is_finite())
}

/// Heights from rows of x, y and z in any order, with or without a line of headings.
fn table(text: &str) -> Result<Heights, Fault> {
    let first = text.lines().find(|line| !line.starts_with('#'));
    let separator = match first.unwrap_or_default() {
        line if line.contains(';') => b';',
        line if line.contains('\t') => b'\t',
        _ => b',',
    };
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .delimiter(separator)
        .trim(csv::Trim::All)
        .comment(Some(b'#'))
        .flexible(true)
        .from_reader(text.as_bytes());
    let mut points = Vec::new();
    for (index, record) in reader.records().enumerate() {
        let record =
            record.unwrap_or_else(|error| unreachable!("UTF-8 with rows of any length: {error}"));
        let line = record.position().map_or(index as u64 + 1, csv::Position::line);
        let numbers: Vec<Option<f64>> = record.iter().take(3).map(number).collect();
        match numbers[..] {
            [Some(x), Some(y), Some(z)] => points.push([x, y, z]),
            // A height may be missing, as an empty field or nan.
            [Some(x), Some(y), None] if missing(&record[2]) => points.push([x, y, f64::NAN]),
            // Headings.
            _ if index == 0 && numbers.iter().all(Option::is_none) => {}
            _ => {
                let found: String = record.iter().collect::<Vec<_>>().join(", ");
                let found: String = found.chars().take(40).collect();
                return Err(no_grid(format!(
                    "line {line}: expected three numbers, found `{found}`"
                )));
            }
        }
    }
    gridded(&points)
}

fn missing(field: &str) -> bool {
    field.is_empty() || ["nan", "na", "null"].iter().any(|word| field.eq_ignore_ascii_case(word))
}

/// Heights of a grid, sorted, from its points.
fn gridded(points: &[[f64; 3]]) -> Result<Heights, Fault> {
    let axis = |k: usize| {
        let mut all: Vec<f64> = points.iter().map(|point| point[k] + 0.0).collect();
        all.sort_by(f64::total_cmp);
        all.dedup();
        all
    };
    let (x, y) = (axis(0), axis(1));
    let all = x.len().saturating_mul(y.len());
    let size = format!("{} different x and {} different y", x.len(), y.len());
    if x.len() < 2 || y.len() < 2 {
        return Err(no_grid(format!(
            "a grid has two rows and columns or more, and here are {size}"
        )));
    }
    if all > MOST_POINTS || all > 4 * points.len() + 100 {
        let message = format!(
            "{} points with {size} are no grid: most crossings of rows and columns have none",
            points.len()
        );
        return Err(no_grid(message));
    }
    let mut z = vec![f64::NAN; all];
    let mut seen = BTreeSet::new();
    for [px, py, pz] in points {
        let at = |axis: &[f64], value: f64| axis.partition_point(|other| *other < value);
        let index = at(&x, *px) + x.len() * at(&y, *py);
        if !seen.insert(index) {
            return Err(no_grid(format!("there are two heights at x = {px}, y = {py}")));
        }
        z[index] = *pz;
    }
    Ok(Heights { x, y, z, rim: 0.0 })
}

/// Heights of an ESRI ASCII grid: they are at the centres of cells, and the first row is in the
/// north.
fn raster(text: &str) -> Result<Heights, Fault> {
    let mut words = text.split_whitespace().peekable();
    let mut header = BTreeMap::new();
    // Heights may be missing as `nan`.
    let height = |word: &str| if missing(word) { Some(f64::NAN) } else { number(word) };
    while let Some(word) = words.peek().filter(|word| height(word).is_none()) {
        let key = word.to_ascii_lowercase();
        words.next();
        let value = words.next().and_then(height);
        let value = value.ok_or_else(|| no_grid(format!("`{key}` has no number")))?;
        header.insert(key, value);
    }
    let value = |key: &str| header.get(key).copied();
    let needed = |key: &str| value(key).ok_or_else(|| no_grid(format!("`{key}` is missing")));
    let (columns, rows, cell) = (needed("ncols")?, needed("nrows")?, needed("cellsize")?);
    let whole = |number: f64| number.fract() == 0.0 && (2.0..=MOST_POINTS as f64).contains(&number);
    if !whole(columns)
        || !whole(rows)
        || columns * rows > MOST_POINTS as f64
        || cell.is_nan()
        || cell <= 0.0
    {
        let message = format!("{columns} columns and {rows} rows of cells of {cell} m are no grid");
        return Err(no_grid(message));
    }
    let start =
        |axis: &str| match (value(&format!("{axis}llcenter")), value(&format!("{axis}llcorner"))) {
            (Some(centre), _) => Ok(centre),
            (None, Some(corner)) => Ok(corner + cell / 2.0),
            (None, None) => Err(no_grid(format!("`{axis}llcorner` is missing"))),
        };
    let (west, south) = (start("x")?, start("y")?);
    let (columns, rows) = (columns as usize, rows as usize);
    let numbers: Option<Vec<f64>> = words.map(height).collect();
    let numbers = numbers.ok_or_else(|| no_grid("a height is no number"))?;
    if numbers.len() != columns * rows {
        let message =
            format!("{columns} columns and {rows} rows have not {} heights", numbers.len());
        return Err(no_grid(message));
    }
    let none = value("nodata_value").unwrap_or(-9999.0);
    let held = |z: &f64| if *z == none { f64::NAN } else { *z };
    let along = |start: f64, count: usize| (0..count).map(|i| start + cell * i as f64).collect();
    let z = numbers.chunks(columns).rev().flatten().map(held).collect();
    Ok(Heights { x: along(west, columns), y: along(south, rows), z, rim: cell / 2.0 })
}
