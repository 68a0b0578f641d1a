//! Contents of the files of a deck as numbers, which a checkpoint keeps.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::rock_files::is_surface;
use crate::schema::{
    Deck, FileCells, FileIn, FileOf, FractureTable, Heights, RockFile, SurfaceFile, Triangles,
};

/// Contents of the files of a deck, as numbers, by their paths.
pub fn file_contents(deck: &Deck) -> BTreeMap<String, Vec<f64>> {
    let mut deck = deck.clone();
    let mut contents = BTreeMap::new();
    for (_, selector) in deck.selectors_mut() {
        for (_, file) in selector.files_mut() {
            let (path, numbers) = match file {
                FileIn::Triangles(FileOf { path, content: Some(content) }) => {
                    (path, content.0.iter().flatten().flatten().copied().collect())
                }
                FileIn::Topography(FileOf { path, content: Some(content) }) => {
                    (path, surface_numbers(content))
                }
                _ => continue,
            };
            contents.insert(path.clone(), numbers);
        }
    }
    for (_, FileOf { path, content }) in deck.rocks_mut() {
        let numbers = content.as_ref().map(|content| match &**content {
            // As those of other uses of the file.
            RockFile::Surface(surface) => surface.0.iter().flatten().flatten().copied().collect(),
            RockFile::Cells(cells) => cells.numbers(),
        });
        contents.insert(path.clone(), numbers.unwrap_or_default());
    }
    for (_, FileOf { path, content }) in deck.surfaces_mut() {
        let numbers = content.as_ref().map(|content| surface_numbers(content));
        contents.insert(path.clone(), numbers.unwrap_or_default());
    }
    for (_, FileOf { path, content }) in deck.networks_mut() {
        let rows = content.iter().flat_map(|content| &content.0);
        contents.insert(path.clone(), rows.flatten().copied().collect());
    }
    contents
}

/// Sets the file contents of a deck to those of [`file_contents`]. Returns false if any are
/// missing.
pub fn restore_files(deck: &mut Deck, contents: &BTreeMap<String, Vec<f64>>) -> bool {
    let mut all = true;
    for (_, selector) in deck.selectors_mut() {
        for (_, file) in selector.files_mut() {
            match file {
                FileIn::Triangles(file) => {
                    let numbers = contents.get(&file.path);
                    file.content = numbers.map(|numbers| Arc::new(triangles_of(numbers)));
                    all &= file.content.is_some();
                }
                FileIn::Topography(file) => all &= restore_surface(file, contents),
            }
        }
    }
    for (_, file) in deck.rocks_mut() {
        let rock = |numbers: &Vec<f64>| match is_surface(&file.path) {
            true => Some(RockFile::Surface(triangles_of(numbers))),
            false => FileCells::from_numbers(numbers).map(RockFile::Cells),
        };
        file.content = contents.get(&file.path).and_then(rock).map(Arc::new);
        all &= file.content.is_some();
    }
    for (_, file) in deck.surfaces_mut() {
        all &= restore_surface(file, contents);
    }
    for (_, file) in deck.networks_mut() {
        let numbers = contents.get(&file.path);
        let rows = numbers.map(|numbers| numbers.as_chunks().0.to_vec());
        file.content = rows.map(|rows| Arc::new(FractureTable(rows)));
        all &= file.content.is_some();
    }
    all
}

/// Numbers of a surface: those of triangles as in other uses of the file.
fn surface_numbers(surface: &SurfaceFile) -> Vec<f64> {
    match surface {
        SurfaceFile::Triangles(of) => of.0.iter().flatten().flatten().copied().collect(),
        SurfaceFile::Heights(Heights { x, y, z, rim }) => {
            let sizes = [x.len() as f64, y.len() as f64, *rim];
            sizes.iter().chain(x).chain(y).chain(z).copied().collect()
        }
    }
}

/// Sets the content of a surface; false if it is missing.
fn restore_surface(file: &mut FileOf<SurfaceFile>, contents: &BTreeMap<String, Vec<f64>>) -> bool {
    let surface = |numbers: &Vec<f64>| {
        let heights = if is_surface(&file.path) { None } else { heights_of(numbers) };
        heights.map_or_else(|| triangles_of(numbers).into(), SurfaceFile::Heights)
    };
    file.content = contents.get(&file.path).map(surface).map(Arc::new);
    file.content.is_some()
}

fn triangles_of(numbers: &[f64]) -> Triangles {
    let corner = |k: usize, of: &[f64]| [of[3 * k], of[3 * k + 1], of[3 * k + 2]];
    Triangles(numbers.chunks_exact(9).map(|nine| [0, 1, 2].map(|k| corner(k, nine))).collect())
}

fn heights_of(numbers: &[f64]) -> Option<Heights> {
    let (sizes, rest) = numbers.split_at_checked(3)?;
    let (x, rest) = rest.split_at_checked(sizes[0] as usize)?;
    let (y, z) = rest.split_at_checked(sizes[1] as usize)?;
    let whole = z.len() == x.len() * y.len();
    whole.then(|| Heights { x: x.into(), y: y.into(), z: z.into(), rim: sizes[2] })
}
