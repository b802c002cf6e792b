//! The command line: one file a verb, each from arguments to a library call.

mod identify;
mod simulate;

use crate::error::Result;
use clap::{Parser, Subcommand};

/// Natural frequency, damping and aerodynamic derivatives from a yawing wind-tunnel model.
#[derive(Parser, Debug)]
#[command(version, about)]
pub struct Cli {
    #[command(subcommand)]
    pub verb: Verb,
}

#[derive(Subcommand, Debug)]
pub enum Verb {
    Identify(identify::Identify),
    Simulate(simulate::Simulate),
}

/// Runs one verb: results on stdout, progress and messages on stderr.
pub fn run(cli: Cli) -> Result<()> {
    match cli.verb {
        Verb::Identify(verb) => verb.run(),
        Verb::Simulate(verb) => verb.run(),
    }
}
