//! What the page is about: releases with their ticks, the model as it stands on the disk, and what has been
//! computed.

mod found;
mod source;
mod standing;

use super::shown_law::ShownLaw;
use serde::{Deserialize, Serialize};
use source::origin;
pub use source::RecordSource;
pub use standing::Standing;
use standing::{stamp, Stamp};
use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::{Arc, OnceLock};
use yawrig_base::error::{Error, Result};
use yawrig_campaign::CampaignFile;
use yawrig_core::diagnosis::diagnose::{Diagnosed, Diagnosis};
use yawrig_core::effects::Effect;
use yawrig_model::document::{is_model, of_file, Model, RecordEntry, DEFAULT};
use yawrig_model::records::{self, Listed};
use yawrig_records::place::{canonical, is_file};
use yawrig_records::Selection;
use yawrig_report::view::{Ghost, Loaded, View};

/// Views and trials kept, over all models.
const MAX_KEPT: usize = 400;

/// What a session begins with.
#[derive(Clone, Debug, Default)]
pub struct Opened {
    /// Records, a campaign or a model.
    pub files: Vec<PathBuf>,
    pub model: Option<PathBuf>,
    /// The user's own effects.
    pub own: Vec<Effect>,
    pub unknown_zero: bool,
}

/// What a release is used for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Use {
    Fit,
    HoldOut,
    Out,
}

#[derive(Clone, Debug)]
pub struct ListedRelease {
    pub entry: RecordEntry,
    pub used: Use,
    pub source: Arc<RecordSource>,
}

/// What several releases lack, judged as one.
#[derive(Clone)]
pub struct Together {
    /// Of which model and releases; with others it is no answer.
    pub about: String,
    /// The verdict, and what is left, as sentences.
    pub text: String,
    pub sentence: String,
}

pub struct Session {
    pub model_path: PathBuf,
    pub unknown_zero: bool,
    pub releases: Vec<ListedRelease>,
    pub campaign: Option<Arc<CampaignFile>>,
    pub own: Vec<Effect>,
    pub standing: Standing,
    stamp: Stamp,
    pub views: HashMap<(usize, u64), std::result::Result<Arc<View>, Error>>,
    pub diagnosed: HashMap<(usize, u64), Arc<Diagnosed>>,
    /// By release, model, and name.
    pub ghosts: HashMap<(usize, u64, String), Arc<Ghost>>,
    pub judged: Option<Arc<Diagnosis>>,
    /// What the ticked releases lack together.
    pub together: Option<Together>,
    pub shown_law: Option<Arc<ShownLaw>>,
    /// Why no step can be taken.
    pub read_only: Option<String>,
}

impl Session {
    /// # Errors
    /// Exit 3 where a file is not there or the model or campaign cannot be read, 2 where files are given
    /// twice or several models.
    pub fn new(options: &Opened) -> Result<Self> {
        let is_toml = |f: &&PathBuf| f.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml"));
        let (models, files): (Vec<&PathBuf>, Vec<&PathBuf>) =
            options.files.iter().partition(|f| is_toml(f) && is_model(f));
        let model_path = match (&options.model, models.as_slice()) {
            (None, []) => PathBuf::from(DEFAULT),
            (Some(path), []) => path.clone(),
            (None, [path]) => (*path).clone(),
            _ => {
                return Err(Error::usage("more than one model")
                    .help("give one model.toml, or records and --model"))
            }
        };
        let read_only = yawrig_base::files::check_writable(&model_path).err();
        if let Some(why) = &read_only {
            yawrig_base::warn!(
                "{}; the page opens for viewing only: no step can be taken",
                why.message
            );
        }
        let files: Vec<PathBuf> = files.into_iter().cloned().collect();
        let mut campaign = None;
        for file in files.iter().filter(is_toml) {
            let read = CampaignFile::read_listed(file)?;
            if campaign.replace(Arc::new(read)).is_some() {
                return Err(Error::usage("more than one campaign").help("give one campaign.toml"));
            }
        }
        let listed = records::listed(&files, &model_path)?;
        let mut session = Self {
            unknown_zero: options.unknown_zero,
            releases: Vec::new(),
            campaign,
            own: options.own.clone(),
            standing: Standing::default(),
            stamp: Stamp::default(),
            views: HashMap::new(),
            diagnosed: HashMap::new(),
            ghosts: HashMap::new(),
            judged: None,
            together: None,
            shown_law: None,
            read_only: read_only.map(|why| why.message),
            model_path,
        };
        session.standing = Standing::read(&session.model_path);
        if let Some(fault) = &session.standing.fault {
            return Err(fault.clone());
        }
        session.stamp = stamp(&session.model_path);
        if let Some(model) = &session.standing.model {
            let path = &session.model_path;
            let is_in = |e: &RecordEntry| records::find(model, path, e).is_some();
            if !listed.is_empty() && !listed.iter().any(|l| is_in(&l.entry)) {
                let what = format!("{} is about other records", path.display());
                return Err(Error::usage(what)
                    .help("begin another model for these with --model OTHER.toml, or leave the records out"));
            }
        }
        for Listed { entry, fault } in listed {
            session.include(entry, fault, Use::Fit);
        }
        session.check_usable()?;
        session.take_ticks();
        session.leave_out_bad();
        if session.campaign.is_none() {
            session.campaign = session.nearby_campaign();
        }
        Ok(session)
    }

    /// Of the releases that were named at the start one at least must be good.
    ///
    /// # Errors
    /// What is wrong with the first, where none is.
    fn check_usable(&self) -> Result<()> {
        let mut first = None;
        for release in &self.releases {
            // Read now what will be looked at anyway.
            let _ = release.source.loaded();
            match release.source.fault() {
                None => return Ok(()),
                Some(fault) => first = first.or(Some(fault)),
            }
        }
        first.map_or(Ok(()), |fault| Err(fault.clone()))
    }

    /// Takes the ticks away from releases that are known to be bad data.
    pub fn leave_out_bad(&mut self) {
        for release in self.releases.iter_mut().filter(|r| r.source.fault().is_some()) {
            release.used = Use::Out;
        }
    }

    /// The campaign without the releases that are known to be bad data.
    pub fn usable_campaign(&self) -> Option<CampaignFile> {
        let campaign = self.campaign.as_ref()?;
        let bad: Vec<&PathBuf> = (self.releases.iter())
            .filter(|r| r.source.fault().is_some())
            .map(|r| &r.source.path)
            .collect();
        let is_bad = |path: PathBuf| {
            let same = |other: &&PathBuf| {
                **other == path || is_file(&path) && canonical(other).ok() == canonical(&path).ok()
            };
            !is_file(&path) || bad.iter().any(same)
        };
        Some(campaign.only(|index| !is_bad(campaign.record_path(index))))
    }

    /// The campaign whose file lies beside the records, where it is about all of them.
    fn nearby_campaign(&self) -> Option<Arc<CampaignFile>> {
        let first = self.releases.first()?.source.path.parent()?.join("campaign.toml");
        let campaign = CampaignFile::read_listed(&first).ok()?;
        let paths: Vec<Option<PathBuf>> = (0..campaign.campaign.release.len())
            .map(|k| canonical(&campaign.record_path(k)).ok())
            .collect();
        let all = self.releases.iter().all(|r| {
            r.entry.made_under.is_some() && paths.contains(&canonical(&r.source.path).ok())
        });
        all.then(|| Arc::new(campaign))
    }

    /// A release that joins the list later is no part of a model that is there until it is ticked.
    pub fn used_when_new(&self) -> Use {
        if self.standing.model.is_some() {
            Use::Out
        } else {
            Use::Fit
        }
    }

    /// Adds a release, unless it is there already; `fault` is what is known to be wrong with it before it is
    /// read.
    pub fn include(&mut self, entry: RecordEntry, fault: Option<Error>, used: Use) -> usize {
        let path = Model::record_path(&self.model_path, &entry);
        let same = canonical(&path).ok();
        if let Some(k) = self.releases.iter().position(|r| {
            r.source.path == path || same.is_some() && canonical(&r.source.path).ok() == same
        }) {
            return k;
        }
        let wind_speed_m_s = entry.made_under.as_ref().map_or(0.0, |m| m.wind_speed_m_s);
        let loaded = fault.map_or_else(OnceLock::new, |fault| OnceLock::from(Err(fault)));
        let reading = entry.reading.clone();
        let origin = origin(&path);
        let source = Arc::new(RecordSource { path, origin, reading, wind_speed_m_s, loaded });
        self.releases.push(ListedRelease { entry, used, source });
        self.releases.len() - 1
    }

    /// The ticks as the model has them; a release it does not name is left out.
    fn take_ticks(&mut self) {
        let Some(model) = self.standing.model.clone() else { return };
        let mut named = Vec::new();
        for entry in &model.records {
            let used = if entry.held_out { Use::HoldOut } else { Use::Fit };
            let k = self.include(entry.clone(), None, used);
            self.releases[k].used = used;
            self.releases[k].entry = entry.clone();
            named.push(k);
        }
        for (k, release) in self.releases.iter_mut().enumerate() {
            if !named.contains(&k) {
                release.used = Use::Out;
            }
        }
        self.leave_out_bad();
    }

    /// Reads a release that is bad data again: it may have been corrected.
    pub fn read_again(&mut self, id: usize) {
        if self.releases[id].source.fault().is_some() {
            self.forget(id);
        }
    }

    /// Reads a release as `reading` says from now on.
    pub fn read_as(&mut self, id: usize, reading: &Selection) {
        if !reading.is_empty() && self.releases[id].entry.reading != *reading {
            self.releases[id].entry.reading = reading.clone();
            self.forget(id);
        }
    }

    /// What was read of a release is read anew.
    fn forget(&mut self, id: usize) {
        let release = &mut self.releases[id];
        let RecordSource { path, origin, wind_speed_m_s, .. } = &*release.source;
        release.source = Arc::new(RecordSource {
            path: path.clone(),
            origin: origin.clone(),
            reading: release.entry.reading.clone(),
            wind_speed_m_s: *wind_speed_m_s,
            loaded: OnceLock::new(),
        });
        self.forget_what_was_found(id);
    }

    /// A release is another part of its record from now on, which is `loaded` already.
    pub fn cut(&mut self, id: usize, entry: RecordEntry, path: PathBuf, loaded: Loaded) {
        let release = &mut self.releases[id];
        let made_under = release.entry.made_under.clone();
        let old = &release.entry;
        let condition = match old.condition == of_file(&old.file) {
            true => entry.condition,
            false => old.condition.clone(),
        };
        let held_out = release.entry.held_out;
        let RecordSource { origin, wind_speed_m_s, .. } = &*release.source;
        let (origin, wind_speed_m_s) = (origin.clone(), *wind_speed_m_s);
        release.entry = RecordEntry { condition, held_out, made_under, ..entry };
        let reading = release.entry.reading.clone();
        let loaded = OnceLock::from(Ok(loaded));
        release.source = Arc::new(RecordSource { path, origin, reading, wind_speed_m_s, loaded });
        self.forget_what_was_found(id);
    }

    /// Whether a release still is this part of its record.
    pub fn is_of(&self, id: usize, source: &Arc<RecordSource>) -> bool {
        self.releases.get(id).is_some_and(|release| Arc::ptr_eq(&release.source, source))
    }

    /// Reads the model again where its files have changed. Whether they had.
    pub fn refresh(&mut self) -> bool {
        let now = stamp(&self.model_path);
        if now == self.stamp {
            return false;
        }
        self.stamp = now;
        let ticks_were_changed = self.are_ticks_changed();
        let records = |s: &Standing| s.model.as_ref().map(|m| m.records.clone());
        let before = records(&self.standing);
        self.standing = Standing::read(&self.model_path);
        let same = |a: &[RecordEntry], b: &[RecordEntry]| {
            let place = |e: &RecordEntry| (e.file.clone(), e.held_out, e.condition.clone());
            a.iter().map(place).eq(b.iter().map(place))
        };
        let unchanged = match (&before, &records(&self.standing)) {
            (Some(a), Some(b)) => same(a, b),
            _ => false,
        };
        // Ticks that the user has set and not applied yet survive steps that are not about them.
        if !(unchanged && ticks_were_changed) {
            self.take_ticks();
        }
        if self.views.len() + self.ghosts.len() > MAX_KEPT {
            let key = self.standing.key;
            self.views.retain(|k, _| k.1 == key);
            self.ghosts.retain(|k, _| k.1 == key);
            self.diagnosed.retain(|k, _| k.1 == key);
        }
        true
    }

    /// Whether the ticks differ from the model's.
    pub fn are_ticks_changed(&self) -> bool {
        let Some(model) = &self.standing.model else { return false };
        let of_model = |release: &ListedRelease| {
            let entry = model.records.iter().find(|e| e.file == release.entry.file);
            entry.map_or(Use::Out, |e| if e.held_out { Use::HoldOut } else { Use::Fit })
        };
        self.releases.iter().any(|r| of_model(r) != r.used)
    }

    /// The records of the model that the ticks ask for.
    pub fn wanted(&self) -> Vec<RecordEntry> {
        let chosen = self.releases.iter().filter(|r| r.used != Use::Out);
        chosen
            .map(|r| RecordEntry { held_out: r.used == Use::HoldOut, ..r.entry.clone() })
            .collect()
    }

    /// The model that the next fit would be of.
    pub fn next_model(&self) -> Model {
        let unknown_zero = self.unknown_zero;
        let begun = || Model { unknown_zero, ..Model::default() };
        let model = self.standing.model.as_deref().cloned().unwrap_or_else(begun);
        let is_new = self.standing.model.is_none() || self.are_ticks_changed();
        let records = if is_new { self.wanted() } else { model.records.clone() };
        Model { records, ..model }
    }

    /// Of the releases that are ticked to be fitted.
    pub fn fitted_sources(&self) -> Vec<Arc<RecordSource>> {
        let fitted = self.releases.iter().filter(|r| r.used == Use::Fit);
        fitted.map(|r| r.source.clone()).collect()
    }

    pub fn release(&self, id: usize) -> Result<&ListedRelease> {
        self.releases.get(id).ok_or_else(|| Error::usage(format!("there is no release {id}")))
    }
}
