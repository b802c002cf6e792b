//! All that is wrong with a campaign, at once.

use super::init::MISSING;
use super::{doubts, looked_at, CampaignFile};
use std::path::Path;
use yawrig_base::disk;
use yawrig_base::error::{Error, Result};
use yawrig_core::derivatives::condition::Identified;
use yawrig_core::derivatives::plausible::{Doubt, Kind};
use yawrig_core::derivatives::Computed;
use yawrig_core::identify::{identify, Method, Settings};
use yawrig_core::record::Record;

/// What is wrong with a campaign and what is doubtful, the errors first, in the order of its file.
#[derive(Clone, Debug, Default)]
pub struct Checked {
    pub doubts: Vec<Doubt>,
    /// What a reader of its derivatives must know besides.
    pub notes: Vec<String>,
    pub releases: usize,
    pub springs: usize,
}

impl Checked {
    /// What refuses it.
    pub fn errors(&self) -> impl Iterator<Item = &Doubt> {
        self.doubts.iter().filter(|doubt| doubt.is_error)
    }

    /// What does not.
    pub fn doubtful(&self) -> impl Iterator<Item = &Doubt> {
        self.doubts.iter().filter(|doubt| !doubt.is_error)
    }
}

/// Looks at everything in the campaign at `path`, its records too.
///
/// # Errors
/// Exit 3 where the file cannot be read.
pub fn check(path: &Path) -> Result<Checked> {
    let named = path.display();
    let text = disk::read_to_string(path).map_err(|e| {
        Error::data(format!("cannot read {named}: {e}")).help("give the path of a campaign.toml")
    })?;
    Ok(check_text(&text, path, true))
}

/// The same of `text`, which stands or will stand at `path`; its records are opened only with `records`.
pub fn check_text(text: &str, path: &Path, records: bool) -> Checked {
    let (filled, doubts_of_text) = filled(text, path);
    let mut checked = Checked { doubts: doubts_of_text, ..Checked::default() };
    let is_whole = checked.doubts.is_empty();
    let file = match CampaignFile::parsed(&filled, path) {
        Ok(file) => file,
        Err(error) => {
            checked.doubts.push(unplaced(path, Kind::Entry, &error));
            return checked;
        }
    };
    checked.releases = file.campaign.release.len();
    let mut springs: Vec<&str> = file.campaign.release.iter().map(|r| r.spring.as_str()).collect();
    springs.sort_unstable();
    springs.dedup();
    checked.springs = springs.len();
    // A spring that is not named has no stiffness either.
    let faults = file.faults().into_iter().filter(|fault| !fault.to_string().contains(MISSING));
    checked.doubts.extend(faults.map(|fault| unplaced(path, Kind::Entry, &fault)));
    if is_whole {
        let reference = file.check_references().err();
        checked.doubts.extend(reference.iter().map(|e| unplaced(path, Kind::Reference, e)));
    }
    let at = |index, error: &Error| {
        let line = file.line_in_release(index, None);
        Doubt { line, release: Some(index), ..unplaced(path, Kind::Record, error) }
    };
    if !records {
        let missing = |index| file.check_record(index).err().map(|error| at(index, &error));
        checked.doubts.extend((0..checked.releases).filter_map(missing));
        if checked.doubts.is_empty() {
            checked.doubts = doubts(&file, &[], &[]);
        }
        return checked;
    }
    // Each of several bad records is said.
    let found = match looked_at(&file, &of) {
        Ok(found) => found,
        Err(error) => {
            checked.doubts.push(unplaced(path, Kind::Record, &error));
            return checked;
        }
    };
    let (mut identified, mut facts) = (Vec::new(), Vec::new());
    for (index, found) in found.into_iter().enumerate() {
        match file.check_record(index).and(found) {
            Ok((of, its)) => (identified.push(of), facts.push(its)).0,
            Err(error) => checked.doubts.push(at(index, &error)),
        }
    }
    if checked.doubts.is_empty() {
        checked.doubts = doubts(&file, &identified, &facts);
        if checked.errors().next().is_none() {
            match Computed::new(&file.campaign, &identified) {
                Ok(computed) => checked.notes = computed.notes(),
                Err(error) => checked.doubts.push(unplaced(path, Kind::Entry, &error.into())),
            }
        }
    }
    checked
}

/// `text` as if all that is missing were there, and that it is missing.
fn filled(text: &str, path: &Path) -> (String, Vec<Doubt>) {
    let (mut filled, mut missing) = (String::new(), Vec::new());
    for (index, line) in text.lines().enumerate() {
        let (entry, comment) = line.split_once('#').unwrap_or((line, ""));
        let key = entry.split('=').next().unwrap_or("").trim();
        let value = entry.split_once('=').map_or("", |(_, value)| value.trim());
        let is_missing = value.contains(MISSING) || value == "nan";
        if is_missing {
            let what = comment.trim().trim_start_matches(MISSING).trim_start_matches(':').trim();
            let doubt = Doubt::new(Kind::Missing, format!("{key} is missing: {what}"), "");
            let (file, line) = (Some(path.display().to_string()), Some(index + 1));
            missing.push(Doubt { file, line, ..doubt.field(key).error_if(true) });
        }
        filled += &match (is_missing, key) {
            (true, "axis") => "axis = \"mid\"".to_owned(),
            (true, "spring") => format!("spring = \"{MISSING} {index}\""),
            (true, "wind_speed_m_s") => "wind_speed_m_s = 0.0".to_owned(),
            (true, key) => format!("{key} = 1.0"),
            (false, _) => line.to_owned(),
        };
        filled.push('\n');
    }
    (filled, missing)
}

/// An error as it names its place itself.
fn unplaced(path: &Path, kind: Kind, error: &Error) -> Doubt {
    let named = path.display().to_string();
    let rest = error.message.strip_prefix(&format!("{named}, line "));
    let placed = rest.and_then(|rest| rest.split_once(": "));
    let (line, what) = match placed.and_then(|(n, what)| Some((n.parse().ok()?, what))) {
        Some((line, what)) => (Some(line), what),
        None => {
            let what = error.message.strip_prefix(&format!("{named}: "));
            (None, what.unwrap_or(&error.message))
        }
    };
    let doubt = Doubt::new(kind, what, error.help.clone()).error_if(true);
    Doubt { file: Some(named), line, ..doubt }
}

fn of(record: &Record) -> Result<Identified> {
    Identified::from_identification(identify(
        record,
        &[Method::LeastSquares],
        &Settings::default(),
    )?)
    .ok_or_else(|| Error::internal(format!("{}: no estimate", record.file.display())))
}
