//! Tessellations of Neper, format 2 and later (<https://neper.info/doc/fileformat.html>).

use std::iter::Peekable;

use ddem_core::Fault;
use ddem_core::problem::Vec3;

use super::rock_files::{ReadCell, ReadCells, wrong};

const FORMAT: &str = "a `.tess` file is a tessellation in space, as `neper -T -n 100` writes it";

/// Words of a text with the numbers of their lines.
struct Words<'a, I: Iterator<Item = (usize, &'a str)>> {
    words: Peekable<I>,
    line: usize,
}

/// Corners, and the numbers of those of each face.
#[derive(Default)]
struct FaceTable {
    points: Vec<[f64; 3]>,
    faces: Vec<Vec<u32>>,
}

/// Cells of a tessellation, with the names of their numbers, and the volume of the domain.
pub(super) fn cells(text: &str) -> Result<ReadCells, Fault> {
    let lines = (1..).zip(text.lines());
    let words =
        lines.flat_map(|(line, text)| text.split_whitespace().map(move |word| (line, word)));
    let mut words = Words { words: words.peekable(), line: 1 };
    if words.next() != Some("***tess") {
        return Err(wrong("this is no tessellation: it does not begin with `***tess`").help(FORMAT));
    }
    let (mut table, mut cells, mut domain) = (FaceTable::default(), Vec::new(), None);
    while let Some(word) = words.next() {
        match word {
            "***end" => break,
            "**format" => words.format()?,
            "**general" => words.dimension()?,
            "**vertex" => table.points = words.entries("a vertex", Words::vertex)?,
            "**face" => {
                let n = table.points.len();
                table.faces = words.entries("a face", |words| words.face(n))?;
            }
            "**polyhedron" => {
                cells = words.entries("a polyhedron", |words| words.polyhedron(&table.faces))?;
            }
            "**domain" => domain = words.domain()?,
            // Cells, edges, periodicity and scales, and the rest of sections.
            _ => {}
        }
    }
    for (cell, number) in cells.iter_mut().zip(1..) {
        cell.name = format!("{number}");
    }
    // Grain growth can leave a grain without volume, and so without faces.
    cells.retain(|cell| !cell.faces.is_empty());
    if cells.is_empty() {
        return Err(wrong("there is no polyhedron").help(FORMAT));
    }
    Ok(ReadCells { points: table.points, cells, domain })
}

impl<'a, I: Iterator<Item = (usize, &'a str)>> Words<'a, I> {
    fn next(&mut self) -> Option<&'a str> {
        let (line, word) = self.words.next()?;
        self.line = line;
        Some(word)
    }

    /// Word that `read` understands.
    fn read<T>(&mut self, what: &str, read: impl Fn(&str) -> Option<T>) -> Result<T, Fault> {
        let found = self.next();
        found.and_then(read).ok_or_else(|| {
            let found = found.map_or_else(
                || "the end of the file".to_owned(),
                |word| format!("`{}`", word.chars().take(40).collect::<String>()),
            );
            let line = self.line;
            wrong(format!("line {line}: expected {what}, found {found}")).help(FORMAT)
        })
    }

    fn number(&mut self, what: &str) -> Result<f64, Fault> {
        self.read(what, |word| word.parse().ok().filter(|number: &f64| number.is_finite()))
    }

    fn count(&mut self, what: &str) -> Result<usize, Fault> {
        self.read(what, |word| word.parse().ok())
    }

    /// Number of one of `n` things, from 0, and true if its sign is negative.
    fn signed(&mut self, what: &str, n: usize) -> Result<(u32, bool), Fault> {
        self.read(what, |word| {
            let number: i64 = word.parse().ok()?;
            let index = usize::try_from(number.unsigned_abs()).ok()?.checked_sub(1)?;
            (index < n).then_some((index as u32, number < 0))
        })
    }

    /// Entries of a section: their count, and for each its number and what `read` reads.
    fn entries<T>(
        &mut self,
        what: &str,
        mut read: impl FnMut(&mut Self) -> Result<T, Fault>,
    ) -> Result<Vec<T>, Fault> {
        let n = self.count("a count")?;
        // The count may be wrong: no room is taken before there are entries.
        let mut entries = Vec::new();
        for number in 1..=n {
            self.read(&format!("number {number} of {what}"), |word| {
                (word.parse() == Ok(number)).then_some(())
            })?;
            entries.push(read(self)?);
        }
        Ok(entries)
    }

    /// Checks the number of the format.
    fn format(&mut self) -> Result<(), Fault> {
        let format = self.number("the number of the format")?;
        if format >= 2.0 {
            return Ok(());
        }
        let message = format!("the format is {format}; 2 and later ones are read");
        Err(wrong(message).help("write the file with Neper 3 or later"))
    }

    /// Checks that the tessellation is one in space.
    fn dimension(&mut self) -> Result<(), Fault> {
        match self.count("the dimension")? {
            3 => Ok(()),
            _ => Err(wrong("the tessellation is flat, or a line").help(FORMAT)),
        }
    }

    fn point(&mut self) -> Result<[f64; 3], Fault> {
        Ok([self.number("x")?, self.number("y")?, self.number("z")?])
    }

    fn vertex(&mut self) -> Result<[f64; 3], Fault> {
        let point = self.point()?;
        self.count("the state of a vertex")?;
        Ok(point)
    }

    /// List of the numbers of things, of which there are `n`.
    fn list(&mut self, what: &str, n: usize) -> Result<Vec<(u32, bool)>, Fault> {
        let count = self.count("a count")?;
        let mut list = Vec::new();
        for _ in 0..count {
            list.push(self.signed(what, n)?);
        }
        Ok(list)
    }

    /// Skips numbers and labels.
    fn skip(&mut self, n: usize) -> Result<(), Fault> {
        for _ in 0..n {
            self.read("a number or a label", |_| Some(()))?;
        }
        Ok(())
    }

    /// Corners of a face.
    fn face(&mut self, n_points: usize) -> Result<Vec<u32>, Fault> {
        let corners = self.list("the number of a vertex", n_points)?;
        let edges = self.count("a count")?;
        self.skip(edges)?;
        self.skip(4 + 2 + 3)?;
        Ok(corners.into_iter().map(|(corner, _)| corner).collect())
    }

    /// Faces of a polyhedron, turned outward.
    fn polyhedron(&mut self, faces: &[Vec<u32>]) -> Result<ReadCell, Fault> {
        let own = self.list("the number of a face", faces.len())?;
        let turned = |(face, inward): (u32, bool)| {
            let corners = faces[face as usize].iter().copied();
            if inward { corners.rev().collect() } else { corners.collect() }
        };
        Ok(ReadCell { name: String::new(), faces: own.into_iter().map(turned).collect() })
    }

    /// Volume of a convex domain `[m³]`; `None` if its faces are not given.
    fn domain(&mut self) -> Result<Option<f64>, Fault> {
        let (mut points, mut faces) = (Vec::new(), Vec::new());
        while self.words.peek().is_some_and(|(_, word)| !word.starts_with("**")) {
            match self.next() {
                Some("*vertex") => {
                    points = self.entries("a vertex of the domain", |words| {
                        let point = words.point()?;
                        words.skip(1)?;
                        let n = words.count("a count")?;
                        words.skip(n)?;
                        Ok(Vec3::from(point))
                    })?;
                }
                Some("*face") => {
                    let n = points.len();
                    faces = self.entries("a face of the domain", |words| words.domain_face(n))?;
                }
                _ => {}
            }
        }
        let middle = points.iter().sum::<Vec3>() / points.len().max(1) as f64;
        let at = |corner: u32| points[corner as usize] - middle;
        let cone = |corners: &Vec<u32>| {
            let triangles = corners.windows(2).skip(1);
            triangles.map(|two| at(corners[0]).dot(&at(two[0]).cross(&at(two[1])))).sum::<f64>()
        };
        let volume = faces.iter().map(|face| cone(face).abs()).sum::<f64>() / 6.0;
        Ok((volume > 0.0).then_some(volume))
    }

    /// Corners of a face of the domain.
    fn domain_face(&mut self, n_points: usize) -> Result<Vec<u32>, Fault> {
        let corners = self.list("the number of a vertex of the domain", n_points)?;
        let edges = self.count("a count")?;
        self.skip(edges)?;
        self.skip(1)?;
        let parameters = self.count("a count")?;
        self.skip(parameters)?;
        self.skip(1)?;
        let tiles = self.count("a count")?;
        self.skip(tiles)?;
        Ok(corners.into_iter().map(|(corner, _)| corner).collect())
    }
}
