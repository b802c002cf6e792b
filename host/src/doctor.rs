//! What is wrong with a port, or with this machine, and one command that puts it right.

#[cfg(unix)]
mod port_file;
/// Elsewhere a port is no file: it is opened, and what that says is all there is.
#[cfg(not(unix))]
mod port_file {
    use std::path::Path;

    pub fn closed(_: &Path) -> Option<(String, String)> {
        None
    }
}

use port_file::closed;
use serde::Serialize;
use std::path::{Path, PathBuf};
use yawrig_base::error::{Error, Exit};
use yawrig_link::advice;
use yawrig_link::bench::{Bench, Target};
use yawrig_link::follow::check_measures;
use yawrig_link::holders::holders;
use yawrig_link::image;
use yawrig_link::port;

/// Result of a check.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum State {
    Well,
    /// Matters for some ports or verbs only.
    Missing,
    Wrong,
}

/// One check.
#[derive(Clone, Debug, Serialize)]
pub struct Check {
    pub check: String,
    pub state: State,
    pub found: String,
    /// A command that puts it right.
    pub command: Option<String>,
    #[serde(skip)]
    pub exit: Option<Exit>,
}

impl Check {
    fn well(check: &str, found: impl Into<String>) -> Self {
        let (check, found) = (check.to_owned(), found.into());
        Self { check, state: State::Well, found, command: None, exit: None }
    }

    fn wrong(check: &str, found: impl Into<String>, command: impl Into<String>) -> Self {
        let command = Some(command.into());
        Self { state: State::Wrong, command, exit: Some(Exit::Device), ..Self::well(check, found) }
    }

    fn missing(check: &str, found: impl Into<String>, command: &str) -> Self {
        let command = Some(command.to_owned());
        Self { state: State::Missing, command, ..Self::well(check, found) }
    }
}

/// Looks at a port and at what is behind it. A device is asked who it is and nothing else.
pub fn device(path: &str) -> Vec<Check> {
    if let Some((found, command)) = closed(Path::new(path)).filter(|_| !port::is_socket(path)) {
        return vec![Check::wrong(path, found, command)];
    }
    let others = holders(Path::new(path));
    let found = Bench::open(&Target::Port(path.to_owned()))
        .and_then(|mut bench| Ok((bench.client.status()?, bench.client.identity.clone())));
    let error = match found {
        Ok((status, identity)) => {
            let ours = concat!("yawrig ", env!("CARGO_PKG_VERSION"));
            let found = format!("{} on {} answers", identity.firmware, identity.board);
            if let Some(other) = others.first() {
                let found = format!("{found}, but {}; {}", other.beside(), other.help());
                return vec![Check::wrong(path, found, other.end())];
            }
            if let Err(error) = check_measures(&status) {
                return vec![Check::wrong(
                    path,
                    error.message,
                    format!("yawrig device --device {path}"),
                )];
            }
            // Behind the version the commit may stand.
            let version = identity.firmware.split(' ').take(2);
            if version.eq(ours.split(' ')) {
                let command = format!("yawrig device linearity RECORD... --device {path}");
                let advice = advice::of(&identity.board, &status)
                    .map(|found| Check::missing("sensor", found, &command));
                return [Check::well(path, found)].into_iter().chain(advice).collect();
            }
            let found = format!("{found}; this program is {ours}");
            let board = identity.board.as_str();
            let is_there =
                |boards: &str| !board.is_empty() && Path::new(boards).join(board).is_dir();
            let command = match image::SOURCES.is_some_and(is_there) {
                true => format!("firmware/boards/build {board}"),
                false => "yawrig --version".to_owned(),
            };
            return vec![Check::missing(path, found, &command)];
        }
        Err(error) => error,
    };
    let check = match &others[..] {
        [other, ..] if error.message.contains("another program") => {
            Check::wrong(path, format!("{other} has it open; {}", other.help()), other.end())
        }
        [other, ..] => {
            Check::wrong(path, format!("{}; {}", error.message, error.help), other.end())
        }
        [] if cfg!(unix) && !port::is_socket(path) && error.message.contains("another program") => {
            Check::wrong(
                path,
                "a program of another user has it open",
                format!("sudo fuser -v {path}"),
            )
        }
        _ => {
            let command = error.help.split('`').nth(1).map_or("yawrig ports", |command| command);
            Check::wrong(path, format!("{}; {}", error.message, error.help), command)
        }
    };
    vec![Check { exit: Some(error.exit), ..check }]
}

/// Looks at this machine: its ports, unopened, and the programs that some verbs need.
pub fn machine() -> Vec<Check> {
    let mut checks = Vec::new();
    match port::list() {
        Ok(ports) if ports.is_empty() => {
            checks.push(Check::well("serial ports", "none; is the board plugged in?"));
        }
        Ok(ports) => checks.extend(ports.iter().map(|port| {
            let path = Path::new(&port.path);
            if let Some((found, command)) = closed(path) {
                return Check::wrong(&port.path, found, command);
            }
            match holders(path).first() {
                Some(other) => Check::wrong(
                    &port.path,
                    format!("{other} has it open; {}", other.help()),
                    other.end(),
                ),
                None if cfg!(unix) => {
                    Check::well(&port.path, format!("{}, free", port.description))
                }
                None => Check::well(&port.path, &port.description),
            }
        })),
        Err(error) => checks.push(Check::wrong("serial ports", error.message, "yawrig ports")),
    }
    if cfg!(unix) {
        checks.push(tool(
            "qemu-system-arm",
            "--device qemu",
            "sudo apt-get install qemu-system-arm",
        ));
        checks.push(toolchain());
        checks.push(tool("chromium", "the tests of the web page", "sudo apt-get install chromium"));
    }
    // No port was named: a blocked one is no error.
    for check in checks.iter_mut().filter(|check| check.state == State::Wrong) {
        check.state = State::Missing;
    }
    checks
}

fn in_path(program: &str) -> Option<PathBuf> {
    let path = std::env::var_os("PATH")?;
    std::env::split_paths(&path).map(|folder| folder.join(program)).find(|file| file.is_file())
}

fn tool(program: &str, needed_for: &str, command: &str) -> Check {
    match in_path(program) {
        Some(file) => Check::well(program, file.display().to_string()),
        None => Check::missing(program, format!("not there; needed for {needed_for}"), command),
    }
}

/// Whether the ARM image could be built.
fn toolchain() -> Check {
    const NAME: &str = "ARM toolchain";
    const NEEDED: &str = "not there; needed for the ARM image";
    if Path::new("/usr/bin/cargo").exists() && in_path("rust-lld").is_some() {
        return Check::well(NAME, "Debian's own Rust");
    }
    const DEBIAN: &str =
        "sudo apt-get install rustc-web cargo-web rust-web-src rust-web-llvm lld-22";
    const RUSTUP: &str = "rustup target add thumbv7em-none-eabihf";
    let Some(rustc) = in_path("rustc") else {
        return match in_path("apt-get") {
            Some(_) => Check::missing(NAME, NEEDED, DEBIAN),
            None => Check::missing(NAME, format!("{NEEDED}; install rustup first"), RUSTUP),
        };
    };
    let asked = std::process::Command::new(rustc).args(["--print", "sysroot"]).output();
    let root = asked.map(|o| String::from_utf8_lossy(&o.stdout).trim().to_owned());
    let target = root.map(|root| PathBuf::from(root).join("lib/rustlib/thumbv7em-none-eabihf"));
    match target {
        Ok(target) if target.is_dir() => Check::well(NAME, target.display().to_string()),
        _ if in_path("rustup").is_some() => Check::missing(NAME, NEEDED, RUSTUP),
        _ => Check::missing(NAME, NEEDED, DEBIAN),
    }
}

/// The first thing that is wrong as an error; none where all is well.
pub fn verdict(checks: &[Check]) -> Option<Error> {
    let wrong = checks.iter().find(|check| check.state == State::Wrong)?;
    let error =
        Error::new(wrong.exit.unwrap_or(Exit::Device), format!("{}: {}", wrong.check, wrong.found));
    Some(match &wrong.command {
        Some(command) => error.help(command.clone()),
        None => error,
    })
}
