//! The verbs that a program can ask, too, a file each: their arguments, what they answer, what they print.
//!
//! A program that holds records in memory asks [`answer()`]; on the command line the same verbs `run`.
#![forbid(unsafe_code)]

pub mod answer;
mod batch;
pub mod choices;
mod commands;
pub mod common;
pub mod compare;
pub mod course;
mod critical_speed;
mod csv;
pub mod derivatives;
pub mod diagnose;
mod diagnosis_text;
pub mod effects;
pub mod export;
pub mod fit;
pub mod flags;
pub mod history;
pub mod identify;
pub mod law;
pub mod model;
pub mod plan;
pub mod releases;
pub mod report;
mod roll;
pub mod simulate;
mod simulated;
mod transfer;
mod trials;
mod typeset;

use answer::{Answer, Progress};
use clap::{Args, Command};
use yawrig_base::error::{Error, Result};
use yawrig_core::record::Record;
use yawrig_model::revise::quoted;

/// What a verb answers, asked as on the command line, about `records` in memory: those that are its files, by
/// their names. With none of them it reads its files.
///
/// # Errors
/// As the verb, and exit 2 for one that answers on the command line only.
pub fn answer(
    verb: &str,
    arguments: &[String],
    records: Vec<Record>,
    progress: &Progress,
) -> Result<Answer> {
    // Of verbs that write, a journal and a report keep the command.
    let words = std::iter::once(format!("yawrig {verb}"));
    let words: Vec<String> = words.chain(arguments.iter().map(|a| quoted(a))).collect();
    let command = words.join(" ");
    match verb {
        "identify" => parsed::<identify::Identify>(arguments)?.answer(records, progress),
        "diagnose" => parsed::<diagnose::Diagnose>(arguments)?.answer(records),
        "compare" => parsed::<compare::Compare>(arguments)?.answer(records),
        "law" => parsed::<law::Law>(arguments)?.answer(records),
        "simulate" => parsed::<simulate::Simulate>(arguments)?.answer(),
        "derivatives" => parsed::<derivatives::Derivatives>(arguments)?.answer(progress),
        "plan" => parsed::<plan::Plan>(arguments)?.answer(progress),
        "fit" => parsed::<fit::Fit>(arguments)?.answer(command),
        "add" => parsed::<effects::Add>(arguments)?.answer(command),
        "remove" => parsed::<effects::Remove>(arguments)?.answer(command),
        "reject" => parsed::<effects::Reject>(arguments)?.answer(command),
        "history" => parsed::<history::History>(arguments)?.answer(command),
        "export" => parsed::<export::Export>(arguments)?.answer(),
        "report" => parsed::<report::ReportArgs>(arguments)?.answer(command),
        other => Err(Error::usage(format!("{other} answers on the command line only"))),
    }
}

/// A verb with `arguments`, as the command line has them.
///
/// # Errors
/// Exit 2 for what the command line refuses.
pub fn parsed<T: Args>(arguments: &[String]) -> Result<T> {
    let command = T::augment_args(Command::new("yawrig").no_binary_name(true));
    let matches = command.try_get_matches_from(arguments);
    let found = matches.and_then(|matches| T::from_arg_matches(&matches));
    found.map_err(|e| {
        let text = e.to_string();
        let first = text.split("\n\n").next().unwrap_or_default();
        Error::usage(first.trim_start_matches("error: ").trim_end())
    })
}
