//! Files that a deck names, and the places in the deck that name them.

use std::borrow::Cow;
use std::fmt;
use std::marker::PhantomData;
use std::sync::Arc;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{Error, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::{Deck, RockFile, Sheet, Where};

/// A file that a deck names. The deck holds the path; the program that reads the deck adds the
/// content.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FileOf<T> {
    /// Path, relative to the deck.
    pub path: String,
    /// Contents of the file; `None` until it has been read.
    pub content: Option<Arc<T>>,
}

/// Corners of the triangles of a surface, shape `(n, 3, 3)` `[m]`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Triangles(pub Vec<[[f64; 3]; 3]>);

/// Discs of a network, a row for each: x, y, z `[m]`, dip, dip direction `[degrees]`, radius `[m]`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FractureTable(pub Vec<[f64; 6]>);

/// Heights over a grid of x and y.
#[derive(Clone, Debug, Default)]
pub struct Heights {
    /// Coordinates of the columns of the grid, increasing `[m]`.
    pub x: Vec<f64>,
    /// Coordinates of the rows of the grid, increasing `[m]`.
    pub y: Vec<f64>,
    /// Heights, x fastest, NaN where there is none, shape `(y, x)` `[m]`.
    pub z: Vec<f64>,
    /// Distance beyond the grid within which the outermost heights apply `[m]`: half a cell of a
    /// raster, whose heights are those of the cell centres.
    pub rim: f64,
}

/// Surface of a file: triangles, or heights over a grid.
#[derive(Clone, Debug, PartialEq)]
pub enum SurfaceFile {
    /// Triangles of an STL file.
    Triangles(Triangles),
    /// Heights of a CSV file or an ESRI ASCII grid.
    Heights(Heights),
}

impl From<Heights> for SurfaceFile {
    fn from(heights: Heights) -> Self {
        Self::Heights(heights)
    }
}

impl From<Triangles> for SurfaceFile {
    fn from(triangles: Triangles) -> Self {
        Self::Triangles(triangles)
    }
}

impl PartialEq for Heights {
    /// Compares grids; heights that are missing in both are equal.
    fn eq(&self, other: &Self) -> bool {
        let bits = |z: &[f64]| z.iter().map(|z| z.to_bits()).collect::<Vec<_>>();
        let axes = self.x == other.x && self.y == other.y && self.rim == other.rim;
        axes && bits(&self.z) == bits(&other.z)
    }
}

impl<T> FileOf<T> {
    /// A file that has not been read.
    pub fn new(path: impl Into<String>) -> Self {
        Self { path: path.into(), content: None }
    }
}

impl<T> Serialize for FileOf<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(&self.path)
    }
}

impl<'de, T> Deserialize<'de> for FileOf<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Path<T>(PhantomData<T>);

        impl<T> Visitor<'_> for Path<T> {
            type Value = FileOf<T>;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("the path of a file, in quotes")
            }

            fn visit_str<E: Error>(self, path: &str) -> Result<FileOf<T>, E> {
                Ok(FileOf::new(path))
            }
        }

        deserializer.deserialize_any(Path(PhantomData))
    }
}

impl<T> JsonSchema for FileOf<T> {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> Cow<'static, str> {
        Cow::Borrowed("File")
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({ "type": "string" })
    }
}

/// One of the files that a deck names.
#[derive(Debug)]
pub enum FileIn<'a> {
    /// A closed surface.
    Triangles(&'a mut FileOf<Triangles>),
    /// A topography.
    Topography(&'a mut FileOf<SurfaceFile>),
}

impl Where {
    /// Files that the `where` names, each with its place below `where`.
    pub fn files_mut(&mut self) -> impl Iterator<Item = (&'static str, FileIn<'_>)> {
        let inside = self.inside.as_mut().map(|file| ("inside", FileIn::Triangles(file)));
        let sheets = [("above.topography", &mut self.above), ("below.topography", &mut self.below)];
        let heights = sheets.into_iter().filter_map(|(key, sheet)| match sheet {
            Some(Sheet::Topography { topography }) => Some((key, FileIn::Topography(topography))),
            _ => None,
        });
        inside.into_iter().chain(heights)
    }
}

/// Every `where` of a deck, with its place in the deck.
macro_rules! selectors {
    ($deck:expr, $iter:ident, $option:ident, $one:ident) => {{
        let mut selectors = Vec::new();
        let mut add = |section: &str, index: usize, selector| {
            selectors.push((format!("{section}[{index}].where"), selector));
        };
        $deck.cut.$iter().enumerate().for_each(|(i, e)| add("cut", i, $one!(e.r#where)));
        $deck.join.$iter().enumerate().for_each(|(i, e)| add("join", i, $one!(e.r#where)));
        $deck.assign.$iter().enumerate().for_each(|(i, e)| add("assign", i, $one!(e.r#where)));
        $deck.remove.$iter().enumerate().for_each(|(i, e)| add("remove", i, $one!(e.r#where)));
        $deck.refine.$iter().enumerate().for_each(|(i, e)| add("refine", i, $one!(e.r#where)));
        $deck.fix.$iter().enumerate().for_each(|(i, e)| add("fix", i, $one!(e.r#where)));
        $deck.load.$iter().enumerate().for_each(|(i, e)| add("load", i, $one!(e.r#where)));
        $deck.charge.$iter().enumerate().for_each(|(i, e)| add("charge", i, $one!(e.r#where)));
        $deck.boundary.$iter().enumerate().for_each(|(i, e)| add("boundary", i, $one!(e.r#where)));
        $deck.initial.$iter().enumerate().for_each(|(i, e)| add("initial", i, $one!(e.r#where)));
        for (i, probe) in $deck.probe.$iter().enumerate() {
            // A probe at a point has no `where`.
            if let Some(selector) = probe.r#where.$option() {
                add("probe", i, selector);
            }
        }
        selectors
    }};
}
macro_rules! shared {
    ($selector:expr) => {
        &$selector
    };
}
macro_rules! exclusive {
    ($selector:expr) => {
        &mut $selector
    };
}

impl Deck {
    /// Every `where`, with its place in the deck.
    pub fn selectors(&self) -> Vec<(String, &Where)> {
        selectors!(self, iter, as_ref, shared)
    }

    /// Files of regions, each with its place in the deck.
    pub fn rocks_mut(&mut self) -> impl Iterator<Item = (String, &mut FileOf<RockFile>)> {
        let regions = self.region.iter_mut().enumerate();
        regions.filter_map(|(i, of)| Some((format!("region[{i}].file"), of.file.as_mut()?)))
    }

    /// Surfaces that cut, each with its place in the deck.
    pub fn surfaces_mut(&mut self) -> impl Iterator<Item = (String, &mut FileOf<SurfaceFile>)> {
        let cuts = self.cut.iter_mut().enumerate();
        cuts.filter_map(|(i, cut)| Some((format!("cut[{i}].surface"), cut.surface.as_mut()?)))
    }

    /// Files of networks of fractures, each with its place in the deck.
    pub fn networks_mut(&mut self) -> impl Iterator<Item = (String, &mut FileOf<FractureTable>)> {
        let cuts = self.cut.iter_mut().enumerate();
        cuts.filter_map(|(i, cut)| {
            Some((format!("cut[{i}].dfn.file"), cut.dfn.as_mut()?.file.as_mut()?))
        })
    }

    /// Every `where`, mutable, with its place in the deck.
    pub fn selectors_mut(&mut self) -> Vec<(String, &mut Where)> {
        selectors!(self, iter_mut, as_mut, exclusive)
    }
}
