//! `yawrig completions`: what a shell needs to complete verbs and flags.

use clap::{Args, Command};
use clap_complete::{generate, Shell};
use yawrig_base::error::{Error, Result};
use yawrig_verbs::common::print;

/// Print the completions of verbs and flags for a shell, to be put where it looks for them
#[derive(Args, Debug)]
pub struct Completions {
    shell: Shell,
}

impl Completions {
    /// Those of `program`.
    pub fn run(&self, mut program: Command) -> Result<()> {
        let mut script = Vec::new();
        generate(self.shell, &mut program, "yawrig", &mut script);
        let script = String::from_utf8(script)
            .map_err(|e| Error::internal(format!("completions are no text: {e}")))?;
        print(&script)
    }
}
