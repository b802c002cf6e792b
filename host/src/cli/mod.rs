//! The command line: one file a verb, each from arguments to a library call.

mod derivatives;
mod simulate;

use crate::error::{Error, Result};
use clap::{Parser, Subcommand};
use std::io::{ErrorKind, Write};

/// Natural frequency, damping and aerodynamic derivatives from a yawing wind-tunnel model.
#[derive(Parser, Debug)]
#[command(version, about)]
pub struct Cli {
    #[command(subcommand)]
    pub verb: Verb,
}

#[derive(Subcommand, Debug)]
pub enum Verb {
    Derivatives(derivatives::Derivatives),
    Simulate(simulate::Simulate),
}

/// Runs one verb: results on stdout, progress and messages on stderr.
pub fn run(cli: Cli) -> Result<()> {
    match cli.verb {
        Verb::Derivatives(verb) => verb.run(),
        Verb::Simulate(verb) => verb.run(),
    }
}

/// Writes results to stdout. A reader that has gone (`| head`) is not an error.
fn print(text: &str) -> Result<()> {
    let mut out = std::io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(e) if e.kind() != ErrorKind::BrokenPipe => {
            Err(Error::internal(format!("cannot write to stdout: {e}")))
        }
        _ => Ok(()),
    }
}
