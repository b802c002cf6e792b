//! Models of records as functions of time, and of time and state.

use crate::error::raised;
use crate::exchange::{bytes, function, numbers, Bytes, Function};
use crate::work::{worked, On};
use pyo3::prelude::*;
use pyo3::pybacked::PyBackedBytes;
use std::sync::Arc;
use yawrig_base::error::Error;
use yawrig_verbs::answer::{self, Answer};
use yawrig_verbs::course::Course;

/// Name of the record; when the model begins, its state there and the units of that; its functions.
type Model = (String, f64, Bytes, Vec<String>, [Function; 4]);

/// Of each record.
pub fn all(py: Python<'_>, answer: &Arc<Answer>) -> PyResult<Vec<Model>> {
    let of = answer.clone();
    let courses = worked(py, On::OneThread, None, move |_| {
        let fits = of.fits()?;
        let course = |(name, decay, model)| (name, Course::new(decay, model));
        Ok(fits.into_iter().map(course).collect::<Vec<_>>())
    })?;
    let model = |(at, (name, course)): (usize, (String, Course))| {
        let (start_s, state, units) = (course.start_s(), course.state(), course.units());
        let functions = functions(py, answer, at, Arc::new(course))?;
        Ok((name, start_s, bytes(py, &state), units, functions))
    };
    courses.into_iter().enumerate().map(model).collect()
}

/// Record and model over time; readings; how fast a state changes; what a state reads.
fn functions(
    py: Python<'_>,
    answer: &Arc<Answer>,
    at: usize,
    course: Arc<Course>,
) -> PyResult<[Function; 4]> {
    let of = answer.clone();
    let curves = function(py, c"curves", move |arguments| {
        let (py, of) = (arguments.py(), of.clone());
        let found = worked(py, On::OneThread, None, move |_| {
            let (_, decay, model) = of.fits()?.swap_remove(at);
            Ok(answer::curves(decay, model))
        })?;
        Ok([found.time_s, found.angle_deg, found.model_deg].map(|curve| bytes(py, &curve)))
    })?;
    let of = course.clone();
    let readings = function(py, c"readings", move |arguments| {
        let (py, of) = (arguments.py(), of.clone());
        let (time_s,): (PyBackedBytes,) = arguments.extract()?;
        let found = worked(py, On::OneThread, None, move |_| Ok(of.readings(&numbers(&time_s))))?;
        Ok(bytes(py, &found))
    })?;
    // What takes a microsecond needs no thread.
    let (of, whole) = (course.clone(), answer.clone());
    let slopes = function(py, c"slopes", move |arguments| {
        let py = arguments.py();
        if let Some(random) = whole.random() {
            let what = format!(
                "{random} is random: how this model moves on is no function of time and state"
            );
            let help = "compare(record, effects=[...]) fits a model without it";
            return Err(raised(py, Error::usage(what).help(help)));
        }
        let (time_s, states): (PyBackedBytes, PyBackedBytes) = arguments.extract()?;
        let each = |(t, state): (&f64, &[f64])| of.slope(*t, state);
        let found: Vec<f64> = py.detach(|| {
            let (time_s, states) = (numbers(&time_s), numbers(&states));
            time_s.iter().zip(states.chunks(of.state().len())).flat_map(each).collect()
        });
        Ok(bytes(py, &found))
    })?;
    let of = course;
    let reads = function(py, c"reads", move |arguments| {
        let py = arguments.py();
        let (time_s, states): (PyBackedBytes, PyBackedBytes) = arguments.extract()?;
        let each = |(t, state): (&f64, &[f64])| of.reading(*t, state);
        let found: Vec<f64> = py.detach(|| {
            let (time_s, states) = (numbers(&time_s), numbers(&states));
            time_s.iter().zip(states.chunks(of.state().len())).map(each).collect()
        });
        Ok(bytes(py, &found))
    })?;
    Ok([curves, readings, slopes, reads])
}
