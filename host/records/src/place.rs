//! `r.csv#2`: one of several releases in one file; `r.csv#12.5s..40s`: what lies between these times.

use std::fmt;
use std::path::{Path, PathBuf};
use yawrig_base::disk;

/// A part of a record.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Part {
    /// One of its releases, from 1.
    Release(usize),
    /// What lies between two times of its own clock.
    Between(Times),
}

/// Times of a record's own clock; its beginning or end where one is not said.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Times {
    pub from_s: Option<f64>,
    pub to_s: Option<f64>,
}

impl fmt::Display for Part {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let time = |s: Option<f64>| s.map_or(String::new(), |s| format!("{s}s"));
        match self {
            Self::Release(number) => write!(f, "{number}"),
            Self::Between(Times { from_s, to_s }) => {
                write!(f, "{}..{}", time(*from_s), time(*to_s))
            }
        }
    }
}

impl Part {
    fn new(text: &str) -> Option<Self> {
        let Some((from, to)) = text.split_once("..") else {
            return text.parse().ok().filter(|n| *n > 0).map(Self::Release);
        };
        let time = |text: &str| match text {
            "" => Some(None),
            _ => Some(Some(text.strip_suffix('s')?.parse().ok()?)),
        };
        Some(Self::Between(Times { from_s: time(from)?, to_s: time(to)? }))
    }
}

/// The file that `named` means, `-` being standard input, and which part of it; the whole of it where none is
/// named.
pub fn parted(named: &Path) -> (PathBuf, Option<Part>) {
    let part = || {
        if disk::exists(named) && !named.to_str()?.starts_with("-#") {
            return None;
        }
        let (file, part) = named.to_str()?.rsplit_once('#')?;
        Some((PathBuf::from(file), Some(Part::new(part)?)))
    };
    part().unwrap_or_else(|| (named.to_owned(), None))
}

/// The name of this part of `file`.
pub fn with_part(file: &Path, part: Part) -> PathBuf {
    let mut name = file.as_os_str().to_owned();
    name.push(format!("#{part}"));
    name.into()
}

/// As [`Path::is_file`].
pub fn is_file(named: &Path) -> bool {
    disk::is_file(&parted(named).0)
}

/// Whether it is `-`, the record that comes by standard input, or a release of it.
pub fn is_standard_input(named: &Path) -> bool {
    parted(named).0.as_os_str() == "-"
}

/// As [`Path::canonicalize`]; standard input has its name everywhere.
///
/// # Errors
/// Where the file is not there.
pub fn canonical(named: &Path) -> std::io::Result<PathBuf> {
    if is_standard_input(named) {
        return Ok(named.to_owned());
    }
    let (file, part) = parted(named);
    let real = disk::canonicalize(file)?;
    Ok(part.map_or(real.clone(), |part| with_part(&real, part)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_is_read_as_it_is_written() {
        let between = |from_s, to_s| Part::Between(Times { from_s, to_s });
        for part in [
            Part::Release(3),
            between(Some(-1.5), Some(40.25)),
            between(None, Some(7.0)),
            between(Some(12.0), None),
        ] {
            let named = with_part(Path::new("no such.csv"), part);
            assert_eq!(parted(&named), (PathBuf::from("no such.csv"), Some(part)), "{named:?}");
        }
        for none in ["r.csv#0", "r.csv#2..x", "r.csv"] {
            assert_eq!(parted(Path::new(none)).1, None);
        }
    }
}
