//! Fields on a mesh over time in one file that ParaView and PyVista open directly.
//!
//! The format is [VTKHDF](https://docs.vtk.org/en/latest/vtk_file_formats/vtkhdf_file_format/) 2.2,
//! `UnstructuredGrid` with time steps: ParaView 5.12 or newer, VTK 9.3 or newer. The mesh is stored
//! once, so blocks move by a `displacement` field and not by their points. Only a file of clouds
//! has other points at each step.
//!
//! Between two calls of [`Writer::append`] the file is closed. It can be viewed and copied, and it
//! survives the end of the process, at any moment. This module handles arrays without their meaning.

mod create;
mod data;
mod index;
mod results;
mod writer;

#[cfg(test)]
mod tests;

pub use crate::hdf::Savepoint;
pub use data::{Cells, Constant, FieldSpec, Grid, Location, NumberType};
pub use results::{FieldValues, Results};
pub use writer::{EarlierSteps, PointOwner, WriteRows, Writer};
