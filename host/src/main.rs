#![forbid(unsafe_code)]

use clap::Parser;

fn main() -> std::process::ExitCode {
    let arguments = yawrig::cli::Cli::parse();
    yawrig::interrupt::install();
    match yawrig::cli::run(arguments) {
        Ok(()) => std::process::ExitCode::SUCCESS,
        Err(error) => {
            yawrig::say!("yawrig: {error}");
            std::process::ExitCode::from(error.exit as u8)
        }
    }
}
