//! All that is wrong with a campaign, at once.

use super::init::MISSING;
use super::{evaluate, CampaignFile};
use std::path::Path;
use yawrig_base::error::{Error, Result};
use yawrig_core::derivatives::condition::Identified;
use yawrig_core::identify::{identify, Method, Settings};
use yawrig_core::record::Record;

/// What is wrong with a campaign and what is doubtful, in the order of its file.
#[derive(Clone, Debug, Default)]
pub struct Checked {
    pub wrong: Vec<String>,
    pub doubtful: Vec<String>,
    pub releases: usize,
    pub springs: usize,
}

/// Looks at everything in the campaign at `path`, its records too.
///
/// # Errors
/// Exit 3 where the file cannot be read.
pub fn check(path: &Path) -> Result<Checked> {
    let named = path.display();
    let text = std::fs::read_to_string(path).map_err(|e| {
        Error::data(format!("cannot read {named}: {e}")).help("give the path of a campaign.toml")
    })?;
    Ok(check_text(&text, path, true))
}

/// The same of `text`, which stands or will stand at `path`; its records are opened only with `records`.
pub fn check_text(text: &str, path: &Path, records: bool) -> Checked {
    let named = path.display();
    let mut checked = Checked::default();
    // What is missing is said once, and the rest looked at as if it were there.
    let mut filled = String::new();
    for (index, line) in text.lines().enumerate() {
        let (entry, comment) = line.split_once('#').unwrap_or((line, ""));
        let key = entry.split('=').next().unwrap_or("").trim();
        let value = entry.split_once('=').map_or("", |(_, value)| value.trim());
        let is_missing = value.contains(MISSING) || value == "nan";
        if is_missing {
            let what = comment.trim().trim_start_matches(MISSING).trim_start_matches(':').trim();
            checked.wrong.push(format!("{named}, line {}: {key} is missing: {what}", index + 1));
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
    let is_whole = checked.wrong.is_empty();
    let file = match CampaignFile::parsed(&filled, path) {
        Ok(file) => file,
        Err(error) => {
            checked.wrong.push(error.to_string());
            return checked;
        }
    };
    checked.releases = file.campaign.release.len();
    let mut springs: Vec<&str> = file.campaign.release.iter().map(|r| r.spring.as_str()).collect();
    springs.sort_unstable();
    springs.dedup();
    checked.springs = springs.len();
    // A spring that is not named has no stiffness either.
    let faults = file.faults().into_iter().map(|fault| fault.to_string());
    checked.wrong.extend(faults.filter(|fault| !fault.contains(MISSING)));
    if is_whole {
        checked.wrong.extend(file.check_references().err().iter().map(Error::to_string));
    }
    for index in 0..checked.releases {
        let looked_at = || if records { found(&file, index).map(drop) } else { Ok(()) };
        let fault = file.check_record(index).and_then(|()| looked_at());
        checked.wrong.extend(fault.err().iter().map(Error::to_string));
    }
    if records && checked.wrong.is_empty() {
        let by = |record: &Record| of(record);
        match evaluate(&file, "least-squares", &by) {
            Ok(table) => checked.doubtful = table.notes,
            Err(error) => checked.wrong.push(error.to_string()),
        }
    }
    checked
}

fn found(file: &CampaignFile, index: usize) -> Result<Identified> {
    of(&yawrig_records::read(&file.record_path(index))?)
}

fn of(record: &Record) -> Result<Identified> {
    Identified::of(identify(record, &[Method::LeastSquares], &Settings::default())?)
        .ok_or_else(|| Error::internal(format!("{}: no estimate", record.file.display())))
}
