//! The command line: one file a verb, each from arguments to a library call.

mod choices;
mod common;
mod compare;
mod critical_speed;
mod csv;
mod derivatives;
mod diagnose;
mod diagnosis_text;
mod fit;
mod identify;
mod law;
mod model;
mod plan;
mod releases;
mod roll;
mod simulate;
mod simulated;
mod transfer;
mod trials;
mod typeset;

// What needs a whole system, its files, devices and terminal: a browser has none of them.
#[cfg(not(target_family = "wasm"))]
mod campaign;
#[cfg(not(target_family = "wasm"))]
mod completions;
#[cfg(not(target_family = "wasm"))]
mod condition;
#[cfg(not(target_family = "wasm"))]
mod convert;
#[cfg(not(target_family = "wasm"))]
mod demo;
#[cfg(not(target_family = "wasm"))]
mod device;
#[cfg(not(target_family = "wasm"))]
mod device_arg;
#[cfg(not(target_family = "wasm"))]
mod doctor;
#[cfg(not(target_family = "wasm"))]
mod effects;
#[cfg(not(target_family = "wasm"))]
mod export;
#[cfg(not(target_family = "wasm"))]
mod flash;
#[cfg(not(target_family = "wasm"))]
mod groups;
#[cfg(not(target_family = "wasm"))]
mod history;
#[cfg(not(target_family = "wasm"))]
mod keygen;
#[cfg(not(target_family = "wasm"))]
mod keys;
#[cfg(not(target_family = "wasm"))]
mod monitor;
#[cfg(not(target_family = "wasm"))]
mod ports;
#[cfg(not(target_family = "wasm"))]
mod replay;
#[cfg(not(target_family = "wasm"))]
mod report;
#[cfg(not(target_family = "wasm"))]
mod story;
#[cfg(not(target_family = "wasm"))]
mod study;
#[cfg(not(target_family = "wasm"))]
mod train;
#[cfg(not(target_family = "wasm"))]
mod workbench;

use crate::answer::{Answer, Progress};
#[cfg(not(target_family = "wasm"))]
use crate::flags::named;
use clap::{Args, Command};
#[cfg(not(target_family = "wasm"))]
use clap::{CommandFactory, Parser, Subcommand};
use yawrig_base::error::{Error, Result};
use yawrig_core::record::Record;
#[cfg(not(target_family = "wasm"))]
use yawrig_model::revise::quoted;

/// Natural frequency, damping and aerodynamic derivatives from a yawing wind-tunnel model.
#[cfg(not(target_family = "wasm"))]
#[derive(Parser, Debug)]
#[command(version, about, max_term_width = 80)]
pub struct Cli {
    #[command(subcommand)]
    pub verb: Verb,
}

#[cfg(not(target_family = "wasm"))]
#[derive(Subcommand, Debug)]
pub enum Verb {
    Demo(demo::Demo),
    Identify(identify::Identify),
    Derivatives(derivatives::Derivatives),
    Campaign(campaign::CampaignArgs),
    Compare(compare::Compare),
    Diagnose(diagnose::Diagnose),
    Fit(fit::Fit),
    Add(effects::Add),
    Remove(effects::Remove),
    Reject(effects::Reject),
    Law(law::Law),
    History(history::History),
    Plan(plan::Plan),
    Export(export::Export),
    Simulate(simulate::Simulate),
    Convert(convert::Convert),
    Report(report::ReportArgs),
    Study(study::StudyArgs),
    /// Train a network and freeze it to a file
    Train(train::Train),
    /// Write a network to a device, verified
    Flash(flash::Flash),
    /// Show a device's firmware, protocol, network and slots
    Device(device::Device),
    /// Make a key to lock devices with, and to sign networks for them
    Keygen(keygen::Keygen),
    Monitor(monitor::Monitor),
    /// Play records into a device as its potentiometer and print its estimates
    Replay(replay::Replay),
    Workbench(workbench::Workbench),
    /// List the serial ports of this machine
    Ports(ports::Ports),
    Doctor(doctor::Doctor),
    Completions(completions::Completions),
}

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
    match verb {
        "identify" => parsed::<identify::Identify>(arguments)?.answer(records, progress),
        "diagnose" => parsed::<diagnose::Diagnose>(arguments)?.answer(records),
        #[cfg(not(target_family = "wasm"))]
        "compare" => parsed::<compare::Compare>(arguments)?.answer(records),
        #[cfg(not(target_family = "wasm"))]
        "law" => parsed::<law::Law>(arguments)?.answer(records),
        #[cfg(not(target_family = "wasm"))]
        verb => with_files(verb, arguments, progress),
        #[cfg(target_family = "wasm")]
        other => Err(no_answer(other)),
    }
}

fn no_answer(verb: &str) -> Error {
    Error::usage(format!("{verb} answers on the command line only"))
}

/// Of verbs that read or write other files than records, or make them. A journal and a report keep the command.
#[cfg(not(target_family = "wasm"))]
fn with_files(verb: &str, arguments: &[String], progress: &Progress) -> Result<Answer> {
    let words = std::iter::once(format!("yawrig {verb}"));
    let words: Vec<String> = words.chain(arguments.iter().map(|a| quoted(a))).collect();
    let command = words.join(" ");
    match verb {
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
        other => Err(no_answer(other)),
    }
}

fn parsed<T: Args>(arguments: &[String]) -> Result<T> {
    let command = T::augment_args(Command::new("yawrig").no_binary_name(true));
    let matches = command.try_get_matches_from(arguments);
    let found = matches.and_then(|matches| T::from_arg_matches(&matches));
    found.map_err(|e| {
        let text = e.to_string();
        let first = text.split("\n\n").next().unwrap_or_default();
        Error::usage(first.trim_start_matches("error: ").trim_end())
    })
}

/// Runs one verb: results on stdout, progress and messages on stderr.
#[cfg(not(target_family = "wasm"))]
pub fn run(cli: Cli) -> Result<()> {
    let done = match cli.verb {
        Verb::Derivatives(verb) => verb.run(),
        Verb::Campaign(arguments) => campaign::run(&arguments),
        Verb::Demo(arguments) => demo::run(&arguments),
        Verb::Identify(verb) => verb.run(),
        Verb::Compare(verb) => verb.run(),
        Verb::Diagnose(verb) => verb.run(),
        Verb::Fit(verb) => verb.run(),
        Verb::Add(verb) => verb.run(),
        Verb::Remove(verb) => verb.run(),
        Verb::Reject(verb) => verb.run(),
        Verb::Law(verb) => verb.run(),
        Verb::History(verb) => verb.run(),
        Verb::Plan(verb) => verb.run(),
        Verb::Export(verb) => verb.run(),
        Verb::Simulate(verb) => verb.run(),
        Verb::Convert(verb) => verb.run(),
        Verb::Report(verb) => verb.run(),
        Verb::Study(verb) => verb.run(),
        Verb::Train(arguments) => train::run(&arguments),
        Verb::Flash(arguments) => flash::run(&arguments),
        Verb::Device(arguments) => device::run(&arguments),
        Verb::Keygen(arguments) => keygen::run(&arguments),
        Verb::Monitor(arguments) => monitor::run(&arguments),
        Verb::Replay(arguments) => replay::run(&arguments),
        Verb::Workbench(verb) => verb.run(),
        Verb::Ports(arguments) => ports::run(&arguments),
        Verb::Doctor(verb) => verb.run(),
        Verb::Completions(verb) => verb.run(Cli::command()),
    };
    done.map_err(named)
}
