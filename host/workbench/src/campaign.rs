//! A campaign.toml made on the page, as `yawrig campaign init` makes it.

use super::app::App;
use serde::{Deserialize, Serialize};
use serde_json::{json, Value};
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;
use yawrig_base::error::{Error, Result};
use yawrig_base::files;
use yawrig_campaign::check::{check, check_text, Checked};
use yawrig_campaign::doubted;
use yawrig_campaign::init::{
    begun, numbers, placed, records, stiffness, Given, NewCampaign, Placing,
};
use yawrig_campaign::pattern::{Named, Pattern};
use yawrig_campaign::simulated::{refuse_existing, CAMPAIGN_FILE};
use yawrig_campaign::CampaignFile;
use yawrig_model::records::entries;
use yawrig_records::Selection;

/// A record and what is known of it.
#[derive(Deserialize, Serialize)]
pub struct PlacedRecord {
    file: String,
    #[serde(flatten)]
    named: Named,
}

/// The form as it stands.
#[derive(Deserialize)]
pub struct CampaignForm {
    folder: String,
    placed: Vec<PlacedRecord>,
    given: Given,
}

/// A folder below the one that the program was started in.
fn within(folder: &str) -> Result<PathBuf> {
    let path = Path::new(folder);
    let is_below = path.components().all(|c| matches!(c, Component::Normal(_) | Component::CurDir));
    match is_below {
        true if path.is_dir() => Ok(path.to_owned()),
        true => Err(Error::usage(format!("{folder}: there is no such folder"))
            .help("give one below the folder that yawrig was started in")),
        false => Err(Error::usage(format!(
            "{folder}: only folders below the one that yawrig was started in"
        ))
        .help("start the workbench in the records' folder")),
    }
}

/// The campaign's file in `folder`, as it would be typed.
fn file_of(folder: &Path) -> PathBuf {
    match folder == Path::new(".") {
        true => PathBuf::from(CAMPAIGN_FILE),
        false => folder.join(CAMPAIGN_FILE),
    }
}

/// The records of a folder, and the numbers that no name says.
///
/// # Errors
/// Exit 2 for a folder that is not below this one, 3 where it cannot be read.
pub fn begin(folder: &str) -> Result<Value> {
    let path = within(folder)?;
    let name = path.canonicalize().ok();
    let name = name.as_deref().and_then(Path::file_name).unwrap_or_default().to_string_lossy();
    Ok(json!({
        "folder": name,
        "files": records(&path)?,
        "numbers": numbers(),
        "stiffness": stiffness(),
        "exists": file_of(&path).exists(),
    }))
}

/// What names like `pattern` say; or what is wrong with it, which is an answer while it is typed.
///
/// # Errors
/// Exit 2 for a folder that is not below this one.
pub fn by_pattern(folder: &str, pattern: &str) -> Result<Value> {
    let folder = within(folder)?;
    Ok(match Pattern::new(pattern).and_then(|pattern| placed(&folder, &pattern)) {
        Ok(Placing { found, .. }) => {
            let found = found.into_iter().map(|(file, named)| PlacedRecord { file, named });
            json!({ "placed": found.collect::<Vec<_>>() })
        }
        Err(error) => json!({ "fault": { "message": error.message, "help": error.help } }),
    })
}

impl CampaignForm {
    /// The file's place and text.
    fn text(self) -> Result<(PathBuf, String)> {
        let folder = within(&self.folder)?;
        let out = file_of(&folder);
        let found = self.placed.into_iter().map(|p| (p.file, p.named)).collect();
        let NewCampaign { text, .. } = begun(&folder, &out, found, &self.given);
        Ok((out, text))
    }

    /// What is wrong with it so far, its records apart.
    ///
    /// # Errors
    /// Exit 2 for a folder that is not below this one.
    pub fn check(self) -> Result<Value> {
        let (out, text) = self.text()?;
        Ok(told(&check_text(&text, &out, false)))
    }

    /// Writes the file, looks at everything in it, and opens it where nothing is wrong and no campaign is
    /// open.
    ///
    /// # Errors
    /// Exit 2 where the file is there already and not to be written `over`, 3 where it cannot be written.
    pub fn write(self, app: &Arc<App>, over: bool) -> Result<Value> {
        let (out, text) = self.text()?;
        if !over {
            refuse_existing(&out)?;
        }
        files::write_atomically(&out, text.as_bytes())?;
        let checked = check(&out)?;
        let is_open = checked.errors().next().is_none() && open(app, &out)?;
        let mut told = told(&checked);
        told["file"] = json!(out.display().to_string());
        told["is_open"] = json!(is_open);
        Ok(told)
    }
}

/// What is wrong and what is doubtful, a line each.
fn told(checked: &Checked) -> Value {
    let wrong: Vec<String> = checked.errors().map(doubted::line).collect();
    let open = checked.doubtful().filter(|doubt| !doubt.accepted);
    let doubtful: Vec<String> = open.map(doubted::line).collect();
    json!({ "wrong": wrong, "doubtful": doubtful, "notes": checked.notes })
}

/// Lists the releases of the campaign at `path`. Whether there was none.
fn open(app: &Arc<App>, path: &Path) -> Result<bool> {
    let model_path = app.session().model_path.clone();
    let campaign = CampaignFile::read_listed(path)?;
    let entries = entries(&[path.to_owned()], &Selection::default(), &model_path)?;
    let mut session = app.session();
    if session.campaign.is_some() || !session.releases.is_empty() {
        return Ok(false);
    }
    session.campaign = Some(Arc::new(campaign));
    for entry in entries {
        let used = session.used_when_new();
        session.include(entry, None, used);
    }
    drop(session);
    app.news.all_may_differ();
    app.work.wake();
    Ok(true)
}
