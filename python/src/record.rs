//! Small typed results: attributes, a representation, and a dictionary with the same names.

use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

/// Defines a class of results: frozen, with a getter for each field, `to_dict` and a representation.
macro_rules! record {
    ($(#[$about:meta])* $name:ident { $($(#[$of:meta])* $field:ident: $type:ty,)* }) => {
        $(#[$about])*
        #[pyo3::pyclass(frozen, get_all, module = "vocc")]
        pub struct $name {
            $($(#[$of])* pub $field: $type,)*
        }

        #[pyo3::pymethods]
        impl $name {
            /// All attributes by name, with nested records as dictionaries: for pandas, JSON and the like.
            fn to_dict<'py>(
                slf: &pyo3::Bound<'py, Self>,
            ) -> pyo3::PyResult<pyo3::Bound<'py, pyo3::types::PyDict>> {
                crate::record::to_dict(slf.as_any(), &[$(stringify!($field)),*])
            }

            fn __repr__(slf: &pyo3::Bound<'_, Self>) -> pyo3::PyResult<String> {
                crate::record::repr(slf.as_any(), &[$(stringify!($field)),*])
            }
        }
    };
}
pub(crate) use record;

/// The attributes of a record by name.
pub fn to_dict<'py>(record: &Bound<'py, PyAny>, names: &[&str]) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(record.py());
    for name in names {
        dict.set_item(name, plain(record.getattr(*name)?)?)?;
    }
    Ok(dict)
}

/// A value with its records converted to dictionaries.
fn plain(value: Bound<'_, PyAny>) -> PyResult<Bound<'_, PyAny>> {
    if let Ok(list) = value.cast::<PyList>() {
        let items = list.iter().map(plain).collect::<PyResult<Vec<_>>>()?;
        return Ok(PyList::new(value.py(), items)?.into_any());
    }
    match value.hasattr("to_dict")? {
        true => value.call_method0("to_dict"),
        false => Ok(value),
    }
}

/// `Name(attribute=value, …)`; arrays are shown by their shapes.
pub fn repr(record: &Bound<'_, PyAny>, names: &[&str]) -> PyResult<String> {
    let shown = names.iter().map(|name| {
        let value = record.getattr(*name)?;
        let text = match value.getattr("shape") {
            Ok(shape) => format!("<array of shape {}>", shape.repr()?),
            Err(_) => value.repr()?.to_string(),
        };
        Ok(format!("{name}={text}"))
    });
    let shown = shown.collect::<PyResult<Vec<_>>>()?;
    Ok(format!("{}({})", record.get_type().name()?, shown.join(", ")))
}
