//! The programs that have a port open, as far as the system shows them to this user.

use std::fmt;
use std::path::Path;

/// Most of a command that is shown.
const SHOWN: usize = 80;

/// A program that has a port open.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Holder {
    pub process: u32,
    /// As it was called, with its arguments.
    pub command: String,
}

impl Holder {
    fn is_ours(&self) -> bool {
        self.command.split_whitespace().next() == Some("yawrig")
    }

    /// What it does to who has the port open beside it.
    pub fn beside(&self) -> String {
        format!("{self} has the port open, too: what that reads is missing here")
    }

    /// A command that ends it.
    pub fn end(&self) -> String {
        let how = if self.is_ours() { "kill -INT" } else { "kill" };
        format!("{how} {}", self.process)
    }

    /// What ends it cleanly.
    pub fn help(&self) -> String {
        match self.is_ours() {
            true => format!(
                "end it with Ctrl-C where it runs, or from here with `{}`: what it has recorded is kept",
                self.end()
            ),
            false => format!("close it where it runs, or end it with `{}`", self.end()),
        }
    }
}

impl fmt::Display for Holder {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} (process {})", self.command, self.process)
    }
}

/// The programs but this one that have `path` open and may read from it. Who made a pseudo-terminal, and is at
/// its other end, is none of them.
#[cfg(not(target_os = "linux"))]
pub fn holders(_: &Path) -> Vec<Holder> {
    Vec::new()
}

#[cfg(target_os = "linux")]
pub use linux::holders;

#[cfg(target_os = "linux")]
mod linux {
    use super::{Holder, Path, SHOWN};
    use std::fs;

    /// The programs but this one that have `path` open and may read from it. Who made a pseudo-terminal, and
    /// is at its other end, is none of them.
    pub fn holders(path: &Path) -> Vec<Holder> {
        let Ok(path) = path.canonicalize() else { return Vec::new() };
        let Ok(processes) = fs::read_dir("/proc") else { return Vec::new() };
        let own = std::process::id();
        let numbers = processes.flatten().filter_map(|e| e.file_name().to_str()?.parse().ok());
        let others = numbers.filter(|process| *process != own && reads(*process, &path));
        others.map(|process| Holder { process, command: command(process) }).collect()
    }

    fn reads(process: u32, path: &Path) -> bool {
        let terminal = path.strip_prefix("/dev/pts").ok().map(|number| number.to_string_lossy());
        let Ok(files) = fs::read_dir(format!("/proc/{process}/fd")) else { return false };
        let mut reads = false;
        for file in files.flatten() {
            let Ok(to) = fs::read_link(file.path()) else { continue };
            let of_it = |key: &str| {
                let number = file.file_name();
                let about = format!("/proc/{process}/fdinfo/{}", number.to_string_lossy());
                let about = fs::read_to_string(about).ok()?;
                about.lines().find_map(|line| Some(line.strip_prefix(key)?.trim().to_owned()))
            };
            if to == path {
                // O_WRONLY of the access mode's two bits.
                let flags = of_it("flags:").and_then(|flags| u32::from_str_radix(&flags, 8).ok());
                reads |= flags.is_none_or(|flags| flags & 3 != 1);
            } else if to.ends_with("ptmx") && terminal.is_some() {
                let index = of_it("tty-index:");
                if index.as_deref() == terminal.as_deref() {
                    return false;
                }
            }
        }
        reads
    }

    /// The file's name without its folders, and the arguments.
    fn command(process: u32) -> String {
        let about = |what: &str| fs::read(format!("/proc/{process}/{what}")).unwrap_or_default();
        let line = String::from_utf8_lossy(&about("cmdline")).into_owned();
        let mut words = line.split('\0').filter(|word| !word.is_empty());
        let Some(first) = words.next() else {
            return String::from_utf8_lossy(&about("comm")).trim().to_owned();
        };
        let name = first.rsplit('/').next().unwrap_or(first);
        let all: Vec<&str> = std::iter::once(name).chain(words).collect();
        all.join(" ").chars().take(SHOWN).collect()
    }
}
