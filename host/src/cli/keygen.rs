//! `yawrig keygen`: a key to lock devices with.

use clap::Args;
use std::path::PathBuf;
use yawrig_base::error::Result;
use yawrig_link::key;
use yawrig_verbs::common::print_line;

#[derive(Args, Debug)]
pub struct Keygen {
    /// Where the private key goes; never overwritten, readable by you alone
    out: PathBuf,
}

pub fn run(arguments: &Keygen) -> Result<()> {
    let public = key::generate(&arguments.out)?;
    print_line(&format!(
        "private key written to {}; keep it: nothing else opens what is locked with it\npublic key {}",
        arguments.out.display(),
        key::hex(&public)
    ))
}
