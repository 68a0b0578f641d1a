//! Reader of VTKHDF files, written from their published layout and independent of the writer.

use std::path::{Path, PathBuf};

use hdf5::File;

/// The frames of one file.
pub struct Frames {
    path: PathBuf,
}

impl Frames {
    /// Names the file.
    pub fn open(path: impl AsRef<Path>) -> Self {
        Self { path: path.as_ref().to_owned() }
    }

    fn numbers(&self, dataset: &str) -> Vec<f64> {
        let file = File::open(&self.path).expect("an HDF5 file");
        let dataset = file.dataset(&format!("VTKHDF/{dataset}")).expect("the array");
        dataset.read_raw().expect("numbers")
    }

    /// Times of the frames.
    pub fn times(&self) -> Vec<f64> {
        self.numbers("Steps/Values")
    }

    /// Points of the mesh.
    pub fn points(&self) -> Vec<[f64; 3]> {
        self.numbers("Points").as_chunks().0.to_vec()
    }

    /// All values of a time-dependent field, frame after frame.
    pub fn all(&self, group: &str, name: &str) -> Vec<f64> {
        self.numbers(&format!("{group}/{name}"))
    }

    /// Point vectors of the last frame.
    pub fn last_vectors(&self, name: &str) -> Vec<[f64; 3]> {
        let first = self.last_offset(name);
        let values = self.all("PointData", name);
        values.as_chunks().0[first..first + self.points().len()].to_vec()
    }

    /// Point scalars of the last frame.
    pub fn last_scalars(&self, name: &str) -> Vec<f64> {
        let first = self.last_offset(name);
        self.all("PointData", name)[first..first + self.points().len()].to_vec()
    }

    /// Point field of one frame; the number of points may differ between frames.
    pub fn at(&self, name: &str, frame: usize) -> Vec<f64> {
        let file = File::open(&self.path).expect("an HDF5 file");
        let dataset = file.dataset(&format!("VTKHDF/PointData/{name}")).expect("the array");
        let components = dataset.shape().get(1).copied().unwrap_or(1);
        let part = self.numbers("Steps/PartOffsets")[frame] as usize;
        let n = self.numbers("NumberOfPoints")[part] as usize;
        let first = self.numbers(&format!("Steps/PointDataOffsets/{name}"))[frame] as usize;
        self.all("PointData", name)[components * first..components * (first + n)].to_vec()
    }

    fn last_offset(&self, name: &str) -> usize {
        let offsets = self.numbers(&format!("Steps/PointDataOffsets/{name}"));
        *offsets.last().expect("a frame") as usize
    }
}
