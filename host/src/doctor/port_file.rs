//! What a Unix system knows of a port's file.

use nix::unistd::{access, AccessFlags};
use std::fs;
use std::os::unix::fs::{FileTypeExt, MetadataExt};
use std::path::Path;

/// The programs that have `path` open, as far as this user may see them: process and name.
pub fn holders(path: &Path) -> Vec<(u32, String)> {
    let Ok(path) = path.canonicalize() else { return Vec::new() };
    let Ok(processes) = fs::read_dir("/proc") else { return Vec::new() };
    let own = std::process::id();
    let numbers = processes.flatten().filter_map(|e| e.file_name().to_str()?.parse().ok());
    let holds = |process: &u32| {
        fs::read_dir(format!("/proc/{process}/fd")).is_ok_and(|files| {
            files.flatten().any(|file| fs::read_link(file.path()).is_ok_and(|to| to == path))
        })
    };
    let named = |process: u32| {
        let name = fs::read_to_string(format!("/proc/{process}/comm")).unwrap_or_default();
        (process, name.trim().to_owned())
    };
    let found = numbers.filter(|process| *process != own).filter(holds).map(named);
    let mut found: Vec<(u32, String)> = found.collect();
    // The maker of a pseudo-terminal has it open, too; its user has locked it: lockers come first.
    let lockers = lockers(&path);
    found.sort_by_key(|(process, _)| !lockers.contains(process));
    found
}

/// The processes that have locked a file, as serial programs do.
fn lockers(path: &Path) -> Vec<u32> {
    let Ok(inode) = fs::metadata(path).map(|meta| meta.ino()) else { return Vec::new() };
    let locks = fs::read_to_string("/proc/locks").unwrap_or_default();
    // `1: FLOCK  ADVISORY  WRITE 4711 00:1b:7 0 EOF`
    let holder = |line: &str| {
        let mut fields = line.split_whitespace().skip(1);
        let is_flock = fields.next()? == "FLOCK";
        let process = fields.nth(2)?.parse().ok()?;
        let of: u64 = fields.next()?.rsplit(':').next()?.parse().ok()?;
        (is_flock && of == inode).then_some(process)
    };
    locks.lines().filter_map(holder).collect()
}

/// Why a port may not be opened, and a command that puts it right, found without opening it; none where it
/// may be.
pub fn closed(path: &Path) -> Option<(String, String)> {
    let no_port = |found: &str| Some((found.to_owned(), "yawrig ports".to_owned()));
    let Ok(meta) = fs::metadata(path) else {
        return no_port("there is no such port");
    };
    if !meta.file_type().is_char_device() {
        return no_port("it is not a serial port");
    }
    if access(path, AccessFlags::R_OK | AccessFlags::W_OK).is_ok() {
        return None;
    }
    let shared = meta.mode() & 0o060 == 0o060 && meta.gid() != 0;
    Some(match group_name(meta.gid()) {
        Some(group) if shared => (
            format!("you may not open it: it is for the group {group}; that counts from your next login on"),
            format!("sudo usermod -aG {group} $USER"),
        ),
        _ => (
            format!("you may not open it (mode {:o})", meta.mode() & 0o777),
            format!("sudo chmod a+rw {}", path.display()),
        ),
    })
}

fn group_name(group: u32) -> Option<String> {
    let groups = fs::read_to_string("/etc/group").ok()?;
    groups.lines().find_map(|line| {
        let mut fields = line.split(':');
        let name = fields.next()?;
        (fields.nth(1)?.parse() == Ok(group)).then(|| name.to_owned())
    })
}
