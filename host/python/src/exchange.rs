//! Numbers and functions as they go to Python and come from it.

use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyCFunction, PyTuple};
use pyo3::IntoPyObjectExt;
use std::ffi::CStr;

pub type Bytes = Py<PyBytes>;
pub type Function = Py<PyCFunction>;

pub fn numbers(bytes: &[u8]) -> Vec<f64> {
    let (whole, _) = bytes.as_chunks();
    whole.iter().map(|eight| f64::from_ne_bytes(*eight)).collect()
}

pub fn bytes(py: Python<'_>, numbers: &[f64]) -> Bytes {
    let bytes: Vec<u8> = numbers.iter().flat_map(|number| number.to_ne_bytes()).collect();
    PyBytes::new(py, &bytes).unbind()
}

/// A function of Python's.
pub fn function<R: for<'py> IntoPyObject<'py>>(
    py: Python<'_>,
    name: &'static CStr,
    does: impl Fn(&Bound<'_, PyTuple>) -> PyResult<R> + Send + Sync + 'static,
) -> PyResult<Function> {
    let does = move |arguments: &Bound<'_, PyTuple>,
                     _: Option<&Bound<'_, _>>|
          -> PyResult<Py<PyAny>> { does(arguments)?.into_py_any(arguments.py()) };
    Ok(PyCFunction::new_closure(py, Some(name), None, does)?.unbind())
}
