//! The table of L2A that a transmitter carries.

use std::path::PathBuf;

use link::l2a_table::{Illuminance, Interval, L2aTable};
use numpy::ndarray::Array2;
use numpy::{IntoPyArray, PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::types::PyType;
use sim::l2a::file::RatioFile;
use studies::table::TableFile;

use crate::errors::{check, refused};

/// The optimum LED-to-ambient ratio (L2A) by illuminance and LED interval, as a transmitter carries it: rounded to 1/8192.
///
/// `file` is the path of a table's TOML file; by default, the table is the firmware's own.
///
/// Raises VoccError if the file has no table that a transmitter can use.
///
/// >>> import vocc
/// >>> shipped = vocc.Table()
/// >>> 0.2 <= shipped.l2a(illuminance_lx=500, interval=1) <= 4
/// True
/// >>> shipped.ratios.shape == (len(shipped.illuminance_lx), len(shipped.interval))
/// True
#[pyclass(frozen, module = "vocc")]
pub struct Table {
    file: TableFile,
    carried: L2aTable,
}

#[pymethods]
impl Table {
    #[new]
    #[pyo3(signature = (file=None))]
    fn new(file: Option<PathBuf>) -> PyResult<Self> {
        let Some(path) = file else {
            return Ok(Self::shipped());
        };
        let (file, carried) = check(TableFile::read_with_table(&path))?;
        Ok(Self { file, carried })
    }

    /// The table of a TOML text.
    #[classmethod]
    fn from_toml(_class: &Bound<'_, PyType>, text: &str) -> PyResult<Self> {
        Self::of(check(TableFile::from_toml(text))?)
    }

    /// The L2A that a transmitter looks up, in 1/sr: between nodes, bilinear in the logarithms; outside, that of the edge.
    fn l2a(&self, illuminance_lx: f64, interval: f64) -> PyResult<f64> {
        for (name, value) in [("illuminance_lx", illuminance_lx), ("interval", interval)] {
            if !(value >= 0.0 && value.is_finite()) {
                return Err(refused(format!("{name} = {value}: give a number from 0 up")));
            }
        }
        let light = Illuminance::saturating_from_num(illuminance_lx);
        let interval = Interval::saturating_from_num(interval);
        Ok(self.carried.l2a(light, interval).to_num())
    }

    /// Ambient illuminances of its rows in lux, ascending.
    #[getter]
    fn illuminance_lx<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let lights = self.carried.illuminances_lx().into_iter();
        lights.map(|light| light.to_num()).collect::<Vec<_>>().into_pyarray(py)
    }

    /// LED intervals of its columns, ascending.
    #[getter]
    fn interval<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let intervals = self.carried.intervals().into_iter();
        intervals.map(|interval| interval.to_num()).collect::<Vec<_>>().into_pyarray(py)
    }

    /// Its L2A in 1/sr: a row for each illuminance, a column for each interval.
    #[getter]
    fn ratios<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let shape = (self.carried.illuminances_lx().len(), self.carried.intervals().len());
        let ratios = self.carried.values().into_iter().map(|ratio| ratio.to_num());
        let ratios = Array2::from_shape_vec(shape, ratios.collect());
        Ok(check(ratios)?.into_pyarray(py))
    }

    /// The table's file as TOML, with its origin: `vocc table` accepts it.
    fn to_toml(&self) -> PyResult<String> {
        check(self.file.to_toml())
    }

    fn __repr__(&self) -> String {
        format!(
            "Table({} illuminances, {} intervals)",
            self.carried.illuminances_lx().len(),
            self.carried.intervals().len()
        )
    }
}

impl Table {
    /// A table of a search's result.
    ///
    /// # Errors
    /// If a transmitter cannot use it.
    pub fn of(file: TableFile) -> PyResult<Self> {
        let carried = check(file.ratios.table())?;
        Ok(Self { file, carried })
    }

    fn shipped() -> Self {
        let carried = L2aTable::shipped();
        let interval: Vec<f64> = carried.intervals().iter().map(|i| i.to_num()).collect();
        let lights = carried.illuminances_lx().into_iter();
        let ratios: Vec<f64> = carried.values().iter().map(|ratio| ratio.to_num()).collect();
        let l2a = ratios.chunks(interval.len()).map(<[f64]>::to_vec).collect();
        let empty = RatioFile::empty(lights.map(|light| light.to_num()).collect(), interval);
        Self {
            file: TableFile::plain(RatioFile { l2a, ..empty }),
            carried,
        }
    }
}
