//! `yawrig doctor`: what is wrong, and what puts it right.

use crate::doctor::{self, State};
use clap::Args;
use serde_json::json;
use yawrig_base::error::Result;
use yawrig_verbs::common::{print_json, print_line, SCHEMA_VERSION};

/// Say what is wrong with a port or with this machine, and one command that puts it right
#[derive(Args, Debug)]
pub struct Doctor {
    /// The serial port to look at, and the device behind it; without it no port is opened
    #[arg(short, long, value_name = "PORT")]
    device: Option<String>,
    /// Print one JSON object
    #[arg(short, long)]
    json: bool,
}

impl Doctor {
    pub fn run(&self) -> Result<()> {
        let checks = match &self.device {
            Some(path) => doctor::device(path),
            None => doctor::machine(),
        };
        if self.json {
            print_json(&json!({"schema_version": SCHEMA_VERSION, "checks": checks}))?;
        } else {
            for check in &checks {
                let state = match check.state {
                    State::Well => "ok",
                    State::Missing => "missing",
                    State::Wrong => "WRONG",
                };
                let remedy =
                    check.command.as_ref().map_or(String::new(), |c| format!("\n          {c}"));
                print_line(&format!("{state:8}  {}: {}{remedy}", check.check, check.found))?;
            }
        }
        doctor::verdict(&checks).map_or(Ok(()), Err)
    }
}
