//! The command line: all verbs, and, one file each, those that only it asks, from arguments to a library call.

mod campaign;
mod completions;
mod condition;
mod convert;
mod demo;
mod device;
mod device_arg;
mod doctor;
mod flash;
mod groups;
mod keygen;
mod keys;
mod monitor;
mod ports;
mod replay;
mod story;
mod study;
mod train;
mod workbench;

use clap::{CommandFactory, Parser, Subcommand};
use yawrig_base::error::Result;
use yawrig_verbs::flags::named;
use yawrig_verbs::{
    compare, derivatives, diagnose, effects, export, fit, history, identify, law, plan, report,
    simulate,
};

/// Natural frequency, damping and aerodynamic derivatives from a yawing wind-tunnel model.
#[derive(Parser, Debug)]
#[command(version, about, max_term_width = 80)]
pub struct Cli {
    #[command(subcommand)]
    pub verb: Verb,
}

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

/// Runs one verb: results on stdout, progress and messages on stderr.
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
