//! Errors in Python, with the libraries' texts as the command line prints them.

use std::fmt::Display;
use std::panic::{AssertUnwindSafe, catch_unwind};

use pyo3::create_exception;
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;

create_exception!(
    vocc,
    VoccError,
    PyValueError,
    "An invalid request: the message has the cause, the value, the allowed range and the way out, as on the command line."
);

/// The exception for an error of a library.
pub fn refused(error: impl Display) -> PyErr {
    VoccError::new_err(error.to_string())
}

/// The value, or an exception if a library has rejected it.
pub fn check<T>(value: Result<T, impl Display>) -> PyResult<T> {
    value.map_err(refused)
}

/// The result of `work`. A panic of the library becomes an exception.
pub fn guarded<T>(work: impl FnOnce() -> PyResult<T>) -> PyResult<T> {
    catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|_| Err(own_fault()))
}

fn own_fault() -> PyErr {
    PyRuntimeError::new_err("vocc has an internal error: please report it with the call and the text on standard error")
}
