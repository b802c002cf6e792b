//! Writes the manual pages of the program and of its verbs: `man FOLDER`.

use clap::CommandFactory;

fn main() -> std::io::Result<()> {
    let folder = std::env::args_os().nth(1).expect("a folder");
    clap_mangen::generate_to(yawrig::cli::Cli::command(), folder)
}
