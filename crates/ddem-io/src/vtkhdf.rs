//! Fields on a mesh over time in one file which ParaView and PyVista open as it is.
//!
//! The format is [VTKHDF](https://docs.vtk.org/en/latest/vtk_file_formats/vtkhdf_file_format/)
//! 2.2, `UnstructuredGrid` with time steps: ParaView 5.12 or newer, VTK 9.3 or newer. The mesh is
//! stored once, so bodies move through a `displacement` field and not through their points; only those
//! of a file of clouds are others at each step.
//!
//! Between two [`Writer::append`] the file is closed: it can be viewed, copied, and it survives
//! the death of the process. This module knows arrays, not what they mean.

mod create;
mod data;
mod results;
mod writer;

#[cfg(test)]
mod tests;

pub use data::{Cells, Constant, FieldSpec, Grid, Location, NumberType};
pub use results::{FieldValues, Results};
pub use writer::{PointOwner, WriteRows, Writer};
