//! What a script of the sources builds, for another processor than this program's.

use crate::error::{Error, Result};
use crate::interrupt;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// The path that `script` prints when it has built it, which is then there.
///
/// # Errors
/// What `fail` makes of why it cannot be built; exit 130 where the user stops it.
pub fn by(script: &Path, arguments: &[&str], fail: impl Fn(&str) -> Error) -> Result<PathBuf> {
    let mut child = Command::new(script)
        .args(arguments)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .map_err(|e| fail(&e.to_string()))?;
    // Both pipes are read at once, so that neither fills while the other is waited for.
    let mut messages = child.stderr.take();
    let reading = std::thread::spawn(move || {
        let mut text = String::new();
        if let Some(pipe) = &mut messages {
            let _ = pipe.read_to_string(&mut text);
        }
        text
    });
    let output = child.wait_with_output().map_err(|e| fail(&e.to_string()))?;
    let messages = reading.join().unwrap_or_default();
    interrupt::check()?;
    if !output.status.success() {
        return Err(fail(&format!("it said\n{}", messages.trim_end())));
    }
    let path = String::from_utf8_lossy(&output.stdout).trim().to_owned();
    match Path::new(&path).exists() {
        true => Ok(PathBuf::from(path)),
        false => Err(fail(&format!("it names '{path}', which is not there"))),
    }
}
