//! A file that was dropped on the page: kept in the folder that yawrig was started in.

use std::path::{Path, PathBuf};
use yawrig_base::error::{Error, Result};
use yawrig_base::files;

/// Names that are tried where one is taken.
const MAX_OF_A_NAME: usize = 1000;

/// Keeps `bytes` as `name` in this folder, as another name where a file with other contents has that one; the
/// name.
///
/// # Errors
/// Exit 2 for a name that is none of a file here, 3 where there is no room.
pub fn kept(name: &str, bytes: &[u8]) -> Result<PathBuf> {
    let path = Path::new(name);
    let is_plain = path.components().count() == 1 && path.file_name().is_some();
    if !is_plain || name.starts_with('.') {
        return Err(Error::usage(format!("{name:?} is no name of a file")).help("rename it"));
    }
    let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let ending = path.extension().map_or(String::new(), |e| format!(".{}", e.to_string_lossy()));
    let numbered = (2..MAX_OF_A_NAME).map(|n| PathBuf::from(format!("{stem}-{n}{ending}")));
    for path in std::iter::once(path.to_owned()).chain(numbered) {
        match std::fs::read(&path) {
            Ok(there) if there == bytes => return Ok(path),
            Ok(_) => {}
            Err(_) if path.exists() => {}
            Err(_) => {
                files::write_atomically(&path, bytes)?;
                return Ok(path);
            }
        }
    }
    Err(Error::data(format!("{name}: there are too many of that name")).help("rename it"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_names_of_files_are_kept() {
        for name in ["../a.csv", "a/b.csv", "", ".bashrc"] {
            assert!(kept(name, b"x").is_err(), "{name}");
        }
    }
}
