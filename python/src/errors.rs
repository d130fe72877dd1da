//! What is wrong, in Python's words: the library's own, as the command line prints them.

use std::fmt::Display;
use std::panic::{AssertUnwindSafe, catch_unwind};

use pyo3::create_exception;
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;

create_exception!(
    vocc,
    VoccError,
    PyValueError,
    "What was asked for cannot be: says what is wrong, with the value, the range and the way out, as the command line does."
);

/// What a library refuses.
pub fn refused(error: impl Display) -> PyErr {
    VoccError::new_err(error.to_string())
}

/// A value, unless a library refuses it.
pub fn check<T>(value: Result<T, impl Display>) -> PyResult<T> {
    value.map_err(refused)
}

/// The outcome of work in which a fault of the library's own does not reach Python as a panic.
pub fn guarded<T>(work: impl FnOnce() -> PyResult<T>) -> PyResult<T> {
    catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|_| Err(own_fault()))
}

fn own_fault() -> PyErr {
    PyRuntimeError::new_err("vocc has met a fault of its own: please report it with what was asked for and what standard error says")
}
