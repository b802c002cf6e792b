//! Errors as Python sees them.

use pyo3::create_exception;
use pyo3::exceptions::{PyKeyboardInterrupt, PyValueError};
use pyo3::prelude::*;
use yawrig_base::error::{Error, Exit};

create_exception!(
    yawrig,
    YawrigError,
    PyValueError,
    "What failed, where and why, and one thing to do about it. `exit_code` is that of the program."
);

/// `error` as an exception with its sentence.
pub fn raised(py: Python<'_>, error: Error) -> PyErr {
    if error.exit == Exit::Interrupted {
        return PyKeyboardInterrupt::new_err(());
    }
    let raised = YawrigError::new_err(error.to_string());
    match raised.value(py).setattr("exit_code", error.exit as u8) {
        Ok(()) => raised,
        Err(other) => other,
    }
}
