//! A `campaign.toml` from a folder of records and what their names say, its gaps marked.

use super::pattern::{Named, Pattern};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use yawrig_base::error::{Error, Result};
use yawrig_core::derivatives::at::Value;
use yawrig_core::derivatives::plausible::ranges::{Range, RANGES, STIFFNESS};
use yawrig_records::format;
use yawrig_shared::axis::Axis;

/// The word that stands where something is missing.
pub const MISSING: &str = "MISSING";
/// Folders in folders, at most.
const DEEPEST: usize = 4;

/// What was found in a folder.
#[derive(Clone, Debug, Default)]
pub struct NewCampaign {
    pub text: String,
    pub releases: usize,
    pub springs: Vec<String>,
    /// Records whose names do not look so.
    pub left_over: Vec<String>,
}

/// A number that no name says.
#[derive(Clone, Debug, Serialize)]
pub struct Number {
    #[serde(skip)]
    section: &'static str,
    pub name: &'static str,
    /// With its unit and what is usual.
    pub what: String,
}

/// What each of [`RANGES`] is.
const WORDS: [&str; 5] = [
    "reference length",
    "frontal area",
    "air density (1.2 at 20 C and sea level)",
    "distance of each spring from the axis",
    "how far the front axis lies ahead of the middle one",
];

/// In the order of the file.
pub fn numbers() -> Vec<Number> {
    let number = |(range, what): (&Range, &str)| Number {
        section: range.section,
        name: range.name,
        what: format!("{what}, {}", range.usual_text()),
    };
    RANGES.iter().zip(WORDS).map(number).collect()
}

/// Of one spring.
pub fn stiffness() -> String {
    STIFFNESS.usual_text()
}

/// Numbers that are known already.
#[derive(Clone, Debug, Default, Deserialize)]
pub struct Given {
    #[serde(default)]
    pub numbers: BTreeMap<String, f64>,
    #[serde(default)]
    pub stiffness_n_per_m: BTreeMap<String, f64>,
}

/// Looks through `folder` for records that are called as `pattern` says; the campaign's file will be `out`.
///
/// # Errors
/// Exit 3 where the folder cannot be read or nothing in it is called so.
pub fn begin(folder: &Path, pattern: &Pattern, out: &Path) -> Result<NewCampaign> {
    let Placing { found, left_over } = placed(folder, pattern)?;
    Ok(NewCampaign { left_over, ..begun(folder, out, found, &Given::default()) })
}

/// Files of `folder` and of the folders in it, as they are called there.
///
/// # Errors
/// Exit 3 where it cannot be read.
fn files(folder: &Path) -> Result<Vec<String>> {
    let mut files = Vec::new();
    gather(folder, DEEPEST, &mut files)?;
    files.sort();
    let within = |file: &PathBuf| {
        file.strip_prefix(folder).unwrap_or(file).to_string_lossy().replace('\\', "/")
    };
    Ok(files.iter().map(within).collect())
}

/// Those among them that are called like records.
///
/// # Errors
/// Exit 3 where the folder cannot be read.
pub fn records(folder: &Path) -> Result<Vec<String>> {
    let is_record = |name: &String| format::is_named_so(Path::new(name));
    Ok(files(folder)?.into_iter().filter(is_record).collect())
}

/// What names say, and the records that are called otherwise.
pub struct Placing {
    pub found: Vec<(String, Named)>,
    pub left_over: Vec<String>,
}

/// What the names in `folder` say that are as `pattern`; and the records whose names are not.
///
/// # Errors
/// As [`begin`].
pub fn placed(folder: &Path, pattern: &Pattern) -> Result<Placing> {
    let mut left_over = Vec::new();
    let mut found = Vec::new();
    for within in files(folder)? {
        match pattern.named(&within) {
            Some(named) => found.push((within, named)),
            None if format::is_named_so(Path::new(&within)) => left_over.push(within),
            None => {}
        }
    }
    if found.is_empty() {
        let what = format!("{}: no file's name matches the pattern", folder.display());
        let example = left_over.first().map_or(String::new(), |name| format!(", as in {name}"));
        return Err(Error::data(what).help(format!(
            "put {{spring}}, {{wind}}, {{axis}} and {{n}} where those stand in the names{example}"
        )));
    }
    Ok(Placing { found, left_over })
}

/// The campaign at `out` of the records in `folder` that were `found`.
pub fn begun(folder: &Path, out: &Path, found: Vec<(String, Named)>, given: &Given) -> NewCampaign {
    let seen = |(within, named): (String, Named)| (seen_from(out, &folder.join(within)), named);
    let mut found: Vec<(String, Named)> = found.into_iter().map(seen).collect();
    found.sort_by(|(a, na), (b, nb)| {
        let key = |n: &Named| (n.spring.clone(), n.axis, n.wind_speed_m_s.map(f64::to_bits));
        key(na).cmp(&key(nb)).then(a.cmp(b))
    });
    let mut begun = NewCampaign { releases: found.len(), ..NewCampaign::default() };
    for (_, named) in &found {
        if let Some(spring) = named.spring.clone().filter(|s| !begun.springs.contains(s)) {
            begun.springs.push(spring);
        }
    }
    begun.text = text(folder, &begun.springs, &found, given);
    begun
}

fn gather(folder: &Path, deep: usize, files: &mut Vec<PathBuf>) -> Result<()> {
    let fail = |e: std::io::Error| {
        Error::data(format!("cannot read {}: {e}", folder.display()))
            .help("give the folder that the records are in")
    };
    for entry in std::fs::read_dir(folder).map_err(fail)? {
        let path = entry.map_err(fail)?.path();
        if path.is_dir() && deep > 0 {
            gather(&path, deep - 1, files)?;
        } else if path.is_file() {
            files.push(path);
        }
    }
    Ok(())
}

/// The path of `file` as the campaign at `out` names it.
fn seen_from(out: &Path, file: &Path) -> String {
    let folder = out.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let (Ok(folder), Ok(real)) = (folder.canonicalize(), file.canonicalize()) else {
        return file.display().to_string();
    };
    yawrig_base::files::portable(real.strip_prefix(&folder).unwrap_or(&real))
}

/// A line of what is missing: its name, its unit in words, and what is usual.
fn missing(name: &str, what: &str) -> String {
    format!("{name} = nan  # {MISSING}: {what}\n")
}

fn known_or_missing(name: &str, what: &str, known: Option<&f64>) -> String {
    known.map_or_else(|| missing(name, what), |value| format!("{name} = {value:?}\n"))
}

/// A line, off as yet, for the standard uncertainty of the entry before it.
fn uncertainty(name: &str) -> String {
    let (of, unit) = match name.strip_suffix("_kg_m3") {
        Some(of) => (of, "kg_m3"),
        None => name.rsplit_once('_').unwrap_or((name, "")),
    };
    format!(
        "# {of}_u_{unit} = 0.0  # its standard uncertainty; left out it is assumed to be zero\n"
    )
}

fn quoted(text: &str) -> String {
    toml::Value::String(text.to_owned()).to_string()
}

fn text(folder: &Path, springs: &[String], found: &[(String, Named)], given: &Given) -> String {
    let name = folder.canonicalize().ok();
    let name = name
        .as_deref()
        .and_then(Path::file_name)
        .unwrap_or_default()
        .to_string_lossy()
        .into_owned();
    let mut out = format!(
        "# What each record was made under. Lines with {MISSING} are to be filled in; then: yawrig campaign check\n\
         schema_version = 1\n\n[model]\nname = {}\n",
        quoted(&name)
    );
    let numbers = numbers();
    for (k, Number { section, name, what }) in numbers.iter().enumerate() {
        if k > 0 && numbers[k - 1].section != *section {
            let _ = write!(out, "\n[{section}]\n");
        }
        out += &known_or_missing(name, what, given.numbers.get(*name));
        out += &uncertainty(name);
    }
    out += "\n[stiffness_n_per_m]  # of one spring; Kr = 2 Ks arm^2\n";
    for spring in springs {
        let known = given.stiffness_n_per_m.get(spring);
        out += &known_or_missing(&quoted(spring), &stiffness(), known);
    }
    for (file, named) in found {
        let _ = write!(out, "\n[[release]]\nfile = {}\n", quoted(file));
        let unknown = match named.unknown.is_empty() {
            true => String::new(),
            false => format!(" (the name says {})", named.unknown.join(", ")),
        };
        match &named.spring {
            Some(spring) => out += &format!("spring = {}\n", quoted(spring)),
            None => out += &format!("spring = \"{MISSING}\"  # {MISSING}: which spring{unknown}\n"),
        }
        match named.axis {
            Some(axis) => out += &format!("axis = \"{axis}\"\n"),
            None => {
                let [mid, front] = Axis::BOTH;
                out += &format!("axis = \"{MISSING}\"  # {MISSING}: {mid} or {front}{unknown}\n");
            }
        }
        match named.wind_speed_m_s {
            Some(speed) => out += &format!("wind_speed_m_s = {speed:?}\n"),
            None => {
                out += &missing(
                    "wind_speed_m_s",
                    &format!("m/s, 0 for wind off; usual: 5 to 40{unknown}"),
                )
            }
        }
        if !named.at.is_empty() {
            let setting = |(name, value): (&String, &Value)| match value {
                Value::Number(x) => format!("{name} = {x:?}"),
                Value::Text(text) => format!("{name} = {}", quoted(text)),
            };
            let settings: Vec<String> = named.at.0.iter().map(setting).collect();
            let _ = writeln!(out, "at = {{ {} }}", settings.join(", "));
        }
    }
    out
}
