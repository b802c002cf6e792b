#![forbid(unsafe_code)]

fn main() -> std::process::ExitCode {
    yawrig_base::message::listen(&yawrig::terminal::Terminal);
    yawrig_base::settings::spell(&yawrig_verbs::flags::Flags);
    let arguments = yawrig::cli::Cli::from_command_line();
    // Catches SIGINT, SIGTERM and SIGHUP from now on; a second one ends the process at once.
    let _ = ctrlc::set_handler(|| {
        if yawrig_base::interrupt::request() {
            std::process::exit(130);
        }
    });
    match yawrig::cli::run(arguments) {
        Ok(()) => std::process::ExitCode::SUCCESS,
        Err(error) => {
            yawrig::say!("yawrig: {error}");
            std::process::ExitCode::from(error.exit as u8)
        }
    }
}
