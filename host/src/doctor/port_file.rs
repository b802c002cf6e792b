//! What a Unix system knows of a port's file.

use nix::unistd::{access, AccessFlags};
use std::fs;
use std::os::unix::fs::{FileTypeExt, MetadataExt};
use std::path::Path;

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
