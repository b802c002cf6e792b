//! `yawrig._native`: the verbs' answers about records in memory. What a user sees of it is in
//! `python/yawrig`.
//!
//! Records come and go as bytes, numbers of eight bytes each in the machine's order, and answers as the JSON
//! that the program prints.
#![deny(unsafe_code)]

mod entry;
mod error;
mod exchange;
mod keywords;
mod model;
mod work;

use error::{raised, YawrigError};
use exchange::{bytes, function, numbers, Bytes, Function};
use pyo3::prelude::*;
use pyo3::pybacked::PyBackedBytes;
use pyo3::types::PyTuple;
use std::ops::Range;
use std::path::PathBuf;
use std::sync::{Arc, Mutex};
use work::{worked, On};
use yawrig_base::error::Error;
use yawrig_base::message::Listener;
use yawrig_core::identify::several;
use yawrig_core::record::{Measurand, Record, Said};
use yawrig_records::place::{with_part, Part};
use yawrig_records::{Channel, Selection};
use yawrig_verbs::answer::Answer;

/// Whether a record's stamps were spread, and the relative uncertainty of its rate.
type Clock = (bool, f64);
/// Name, times and numbers, the clock, and what it says it holds, as JSON.
type Given = (String, PyBackedBytes, PyBackedBytes, Clock, String);
type GivenBack = (String, Bytes, Bytes, Clock, String);

/// What would be said on stderr.
static SAID: Mutex<Vec<String>> = Mutex::new(Vec::new());

struct Kept;

impl Listener for Kept {
    fn message(&self, text: String) {
        SAID.lock().unwrap_or_else(|e| e.into_inner()).push(text);
    }
}

fn record(given: Given) -> yawrig_base::error::Result<Record> {
    let (name, time_s, yaw_deg, (stamps_spread, rate_u), said) = given;
    let said: Said = from_json(&said)?;
    let record = Record::new(name, numbers(&time_s), numbers(&yaw_deg));
    yawrig_records::checked(Record { stamps_spread, rate_u, measurand: said.measurand(), ..record })
}

fn given(py: Python<'_>, record: &Record) -> PyResult<GivenBack> {
    let name = record.file.display().to_string();
    let said = to_json(py, &record.measurand)?;
    let [time_s, yaw_deg] = [&record.time_s, &record.yaw_deg].map(|of| bytes(py, of));
    Ok((name, time_s, yaw_deg, (record.stamps_spread, record.rate_u), said))
}

fn from_json<T: serde::de::DeserializeOwned>(text: &str) -> yawrig_base::error::Result<T> {
    serde_json::from_str(text).map_err(|e| Error::usage(format!("how it is to be read: {e}")))
}

fn to_json(py: Python<'_>, measurand: &Measurand) -> PyResult<String> {
    let said = serde_json::to_string(&measurand.said());
    said.map_err(|e| raised(py, Error::internal(e.to_string())))
}

/// selection as JSON; what it says numbers are, as JSON, and by what they are multiplied
fn said(arguments: &Bound<'_, PyTuple>) -> PyResult<(String, f64)> {
    let (selection,): (String,) = arguments.extract()?;
    let py = arguments.py();
    let meant = from_json(&selection).and_then(|selection| yawrig_records::measurand(&selection));
    let (measurand, scale) = meant.map_err(|e| raised(py, e))?;
    Ok((to_json(py, &measurand)?, scale))
}

/// The answer of a verb: its JSON, its sentence, functions that give the rest of it, and what else was said.
type Answered = (String, String, [Function; 3], Vec<String>);

/// verb, arguments, records, progress
fn ask(arguments: &Bound<'_, PyTuple>) -> PyResult<Answered> {
    type Arguments = (String, Vec<String>, Vec<Given>, Option<Py<PyAny>>);
    let (verb, options, records, progress): Arguments = arguments.extract()?;
    let py = arguments.py();
    // One record is identified sooner than threads are begun.
    let on = match verb == "identify" && records.len() == 1 {
        true => On::OneThread,
        false => On::AllCores,
    };
    let answer = worked(py, on, progress, move |counter| {
        let records = records.into_iter().map(record).collect::<Result<Vec<_>, _>>()?;
        yawrig_verbs::answer(&verb, &options, records, &|done, all| counter.set(done, all))
    });
    let said = std::mem::take(&mut *SAID.lock().unwrap_or_else(|e| e.into_inner()));
    let answer = Arc::new(answer?);
    Ok((answer.json.clone(), answer.sentence.clone(), rest(py, &answer)?, said))
}

/// The record that was made; the models of the records; pictures.
fn rest(py: Python<'_>, answer: &Arc<Answer>) -> PyResult<[Function; 3]> {
    let of = answer.clone();
    let made = function(py, c"made", move |arguments| {
        of.made().map(|record| given(arguments.py(), record)).transpose()
    })?;
    let of = answer.clone();
    let models = function(py, c"models", move |arguments| model::all(arguments.py(), &of))?;
    let of = answer.clone();
    let pictures = function(py, c"pictures", move |arguments| {
        let of = of.clone();
        worked(arguments.py(), On::AllCores, None, move |_| of.pictures())
    })?;
    Ok([made, models, pictures])
}

/// path, selection as JSON
fn read(arguments: &Bound<'_, PyTuple>) -> PyResult<GivenBack> {
    let (path, selection): (PathBuf, String) = arguments.extract()?;
    let py = arguments.py();
    let selection: Selection = from_json(&selection).map_err(|e| raised(py, e))?;
    let read =
        worked(py, On::AllCores, None, move |_| yawrig_records::read_selected(&path, &selection))?;
    given(py, &read)
}

/// name, columns (name, unit, numbers), selection as JSON
fn of_table(arguments: &Bound<'_, PyTuple>) -> PyResult<GivenBack> {
    type Column = (String, Option<String>, PyBackedBytes);
    let (name, columns, selection): (PathBuf, Vec<Column>, String) = arguments.extract()?;
    let py = arguments.py();
    let selection: Selection = from_json(&selection).map_err(|e| raised(py, e))?;
    let channel = |(name, unit, values): Column| Channel {
        name,
        unit,
        step_s: None,
        values: Ok(numbers(&values)),
    };
    let channels = columns.into_iter().map(channel).collect();
    let read = worked(py, On::AllCores, None, move |_| {
        yawrig_records::of_channels(&name, channels, &selection)
    })?;
    given(py, &read)
}

/// The releases in a record, named by their numbers.
fn releases(arguments: &Bound<'_, PyTuple>) -> PyResult<Vec<GivenBack>> {
    let (of,): (Given,) = arguments.extract()?;
    let py = arguments.py();
    let parts = worked(py, On::OneThread, None, move |_| {
        let whole = record(of)?;
        let parts = several::releases(&whole);
        let named = |(k, part): (usize, &Range<usize>)| {
            let file = with_part(&whole.file, Part::Release(k + 1));
            Record { file, ..several::sliced(&whole, part) }
        };
        Ok(parts.iter().enumerate().map(named).collect::<Vec<Record>>())
    })?;
    parts.iter().map(|part| given(py, part)).collect()
}

/// All that is in the module.
fn fill(module: &Bound<'_, PyModule>) -> PyResult<()> {
    let py = module.py();
    yawrig_base::message::listen(&Kept);
    yawrig_base::settings::spell(&keywords::Keywords);
    module.add("YawrigError", py.get_type::<YawrigError>())?;
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add("ask", function(py, c"ask", ask)?)?;
    module.add("read", function(py, c"read", read)?)?;
    module.add("of_table", function(py, c"of_table", of_table)?)?;
    module.add("said", function(py, c"said", said)?)?;
    module.add("releases", function(py, c"releases", releases)?)
}
