//! Cells of rock, before a model is built.

use ddem_deck::{BlockVerdict, CutRock, RockPlane};
use pyo3::prelude::*;

use crate::model::PyModel;
use crate::worker::{Pool, build_on_worker_thread, outcome};
use crate::{arrays, fields};

#[pymethods]
impl PyModel {
    /// Table of the cells of the regions, as :meth:`cells` has it with their polyhedra.
    ///
    /// Returns
    /// -------
    /// Table
    ///     Row for each cell, with the columns of ``blocks.csv``: `volume`, `width`, `faces`, `hexes`,
    ///     `centroid`, and by block theory `mode` and `factor`, among others; see :class:`Cells`.
    ///
    /// Raises
    /// ------
    /// ModelError
    ///     All faults of regions and cuts, each with the line of the script that made the entry.
    fn blocks<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.cells(py)?.getattr("table")
    }

    /// Cuts the regions, and finds by block theory which blocks can move.
    ///
    /// Returns
    /// -------
    /// Cells
    ///     The table of the cells, as `ddem cut` writes it, and their polyhedra.
    ///
    /// Raises
    /// ------
    /// ModelError
    ///     All faults of regions and cuts, each with the line of the script that made the entry.
    ///
    /// Examples
    /// --------
    /// >>> rock = ddem.Material(density=2700, young=50e9, poisson=0.25)
    /// >>> fault = ddem.Joint(normal_stiffness=5e9, shear_stiffness=1e9, friction=22)
    /// >>> model = ddem.Model()
    /// >>> model.add_region(box=((0, 0, 0), (4, 4, 4)), material=rock)
    /// >>> model.cut(plane={"dip": 60, "dip_direction": 250, "through": (2, 2, 2)}, joint=fault)
    /// >>> model.cells().table["volume"]
    /// array([32., 32.])
    fn cells<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let (deck, _) = self.parts_with_files(py)?;
        let title = deck.title.clone();
        let (cut, stopped) = build_on_worker_thread(py, &Pool::of(1), None, move |_| {
            deck.cut_regions().map(|rock| (rock.verdicts(), rock))
        })?;
        let (verdicts, rock) = outcome(cut, stopped, |error| self.located(py, &error))?;
        let (planes, of_faces) = rock.planes();
        let complex = &rock.complex;
        let faces = || complex.cells().iter().flat_map(|cell| &cell.faces);
        let mut starts = vec![0_i64];
        starts.extend(faces().scan(0, |end, face| {
            *end += face.corners.len() as i64;
            Some(*end)
        }));
        let corners = faces().flat_map(|face| face.corners.iter().map(|&corner| i64::from(corner)));
        let owners = complex.cells().iter().enumerate();
        let owners = owners.flat_map(|(cell, of)| of.faces.iter().map(move |_| cell as i64));
        let rows = of_faces.into_iter().map(|row| row.map_or(-1, |row| row as i64));
        let points = complex.points().iter().map(|point| <[f64; 3]>::from(*point)).collect();
        py.import("ddem._cells")?.getattr("Cells")?.call1((
            title,
            cell_array(py, &rock, &verdicts)?,
            plane_array(py, &rock, &planes)?,
            arrays::rows(py, points)?,
            fields::integers(py, corners.collect())?,
            fields::integers(py, starts)?,
            fields::integers(py, owners.collect())?,
            fields::integers(py, rows.collect())?,
        ))
    }
}

/// Texts as an array of NumPy, whose type is as wide as the longest.
fn texts<'py>(py: Python<'py>, texts: Vec<String>) -> PyResult<(String, Bound<'py, PyAny>)> {
    let widest = texts.iter().map(|text| text.chars().count()).max().unwrap_or_default();
    let kind = format!("U{}", widest.max(1));
    let array = py.import("numpy")?.call_method1("array", (texts, kind.as_str()))?;
    Ok((kind, array))
}

/// Structured array of the cells, with the columns of `blocks.csv`.
fn cell_array<'py>(
    py: Python<'py>,
    rock: &CutRock,
    verdicts: &[BlockVerdict],
) -> PyResult<Bound<'py, PyAny>> {
    let n = rock.properties.len();
    let number = |of: &dyn Fn(usize) -> f64| arrays::components(py, (0..n).map(of).collect(), 1);
    let count = |of: &dyn Fn(usize) -> usize| {
        fields::integers(py, (0..n).map(|cell| of(cell) as i64).collect())
    };
    let text = |of: &dyn Fn(usize) -> String| texts(py, (0..n).map(of).collect());
    let complex = &rock.complex;
    let cell = |cell: usize| &complex.cells()[cell];
    let plunge_trend = |i: usize, d: usize| verdicts[i].plunge_trend.map_or(f64::NAN, |at| at[d]);
    let centroids = rock.properties.iter().map(|of| <[f64; 3]>::from(of.centroid)).collect();
    let (region_type, regions) = text(&|i| rock.region_name(cell(i).region as usize))?;
    let (material_type, materials) = text(&|i| rock.region(i).material.clone())?;
    let (cut_type, cuts) = text(&|i| rock.cut_names(i).join(";"))?;
    let (mode_type, modes) = text(&|i| verdicts[i].mode.name().to_owned())?;
    let names = |cuts: &[u32]| cuts.iter().map(|&cut| rock.cut_name(cut)).collect::<Vec<_>>();
    let (on_type, on) = text(&|i| names(&verdicts[i].on).join(";"))?;
    let columns = vec![
        ("volume", "f8", number(&|i| rock.properties[i].volume)?),
        ("surface", "f8", number(&|i| rock.surface(i))?),
        ("free_area", "f8", number(&|i| verdicts[i].free_area)?),
        ("width", "f8", number(&|i| rock.properties[i].width)?),
        ("faces", "i8", count(&|i| cell(i).faces.len())?),
        ("vertices", "i8", count(&|i| cell(i).vertices().len())?),
        ("hexes", "i8", count(&|i| rock.n_elements(i))?),
        ("centroid", "f8", arrays::rows(py, centroids)?),
        ("region", region_type.as_str(), regions),
        ("material", material_type.as_str(), materials),
        ("block", "i8", count(&|i| rock.blocks[i] as usize)?),
        ("cuts", cut_type.as_str(), cuts),
        ("mode", mode_type.as_str(), modes),
        ("factor", "f8", number(&|i| verdicts[i].factor.unwrap_or(f64::NAN))?),
        ("plunge", "f8", number(&|i| plunge_trend(i, 0))?),
        ("trend", "f8", number(&|i| plunge_trend(i, 1))?),
        ("on", on_type.as_str(), on),
    ];
    arrays::structured(py, n, columns)
}

/// Structured array of the planes of the cuts.
fn plane_array<'py>(
    py: Python<'py>,
    rock: &CutRock,
    planes: &[RockPlane],
) -> PyResult<Bound<'py, PyAny>> {
    let number =
        |of: &dyn Fn(&RockPlane) -> f64| arrays::components(py, planes.iter().map(of).collect(), 1);
    let (cut_type, cuts) =
        texts(py, planes.iter().map(|plane| rock.cut_name(plane.cut)).collect())?;
    let joined = planes.iter().map(|plane| plane.joined).collect::<Vec<_>>();
    let columns = vec![
        ("cut", cut_type.as_str(), cuts),
        ("joined", "?", numpy::PyArray1::from_vec(py, joined).into_any()),
        ("normal", "f8", arrays::rows(py, planes.iter().map(|plane| plane.normal).collect())?),
        ("dip", "f8", number(&|plane| plane.dip)?),
        ("dip_direction", "f8", number(&|plane| plane.dip_direction)?),
        ("area", "f8", number(&|plane| plane.area)?),
    ];
    arrays::structured(py, planes.len(), columns)
}
