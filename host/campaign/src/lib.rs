//! `campaign.toml`: the conditions each record was made under, and what is computed from them.
//!
//! Every `..._u_...` entry is the standard uncertainty of the entry it is named after, in its unit; left out,
//! it is taken as zero, and listed as assumed.
#![forbid(unsafe_code)]

pub mod check;
mod diagnose;
pub mod doubted;
mod evaluate;
pub mod init;
pub mod pattern;
pub mod plan;
pub mod simulated;

pub use diagnose::diagnose;
pub use evaluate::{doubts, evaluate, looked_at, table, Identify};

use serde::Deserialize;
use std::collections::HashMap;
use std::fmt;
use std::path::{Path, PathBuf};
use toml::Spanned;
use yawrig_base::disk;
use yawrig_base::error::{Error, Result};
use yawrig_base::settings;
use yawrig_core::derivatives::at::Value;
use yawrig_core::derivatives::campaign::{Campaign, ReleaseEntry, SCHEMA_VERSION};
use yawrig_core::record::Record;
use yawrig_records::format::is_record;
use yawrig_records::{place, Selection};

/// A campaign with the path it was read from.
#[derive(Clone, Debug, PartialEq)]
pub struct CampaignFile {
    pub path: PathBuf,
    pub campaign: Campaign,
    /// Line of each `[[release]]` in the file, counted from 1.
    pub release_lines: Vec<usize>,
    /// As it was read, to say on which line an entry stands.
    text: String,
}

/// Only the positions of the releases in the text.
#[derive(Deserialize)]
struct Places {
    #[serde(default)]
    release: Vec<Spanned<toml::Table>>,
}

impl CampaignFile {
    /// Reads and checks a campaign from which derivatives can be computed.
    ///
    /// # Errors
    /// As [`Self::read_releases`]; besides, a wind-on release without its wind-off reference, or none at all.
    pub fn read(path: &Path) -> Result<Self> {
        let file = Self::read_releases(path)?;
        file.check_references()?;
        Ok(file)
    }

    /// Reads and checks a campaign, with the wind off alone, or on alone, too.
    ///
    /// # Errors
    /// Exit 3, naming file and line: not TOML, an entry missing, unknown or out of range, a record that is
    /// not there or listed twice, one spring with two stiffnesses.
    pub fn read_releases(path: &Path) -> Result<Self> {
        let file = Self::read_listed(path)?;
        (0..file.campaign.release.len()).try_for_each(|index| file.check_record(index))?;
        Ok(file)
    }

    /// As [`Self::read_releases`], whether the records are there or not.
    ///
    /// # Errors
    /// As there, except for a record that is missing: see [`Self::check_record`].
    pub fn read_listed(path: &Path) -> Result<Self> {
        let named = path.display();
        let text = disk::read_to_string(path).map_err(|e| {
            Error::data(format!("cannot read {named}: {e}"))
                .help("give the path of a campaign.toml")
        })?;
        if is_record(&text) {
            return Err(Error::data(format!("{named} is a record, not a campaign"))
                .help("write a campaign.toml that names it: `yawrig campaign init` does"));
        }
        let file = Self::parsed(&text, path)?;
        file.check()?;
        Ok(file)
    }

    /// The campaign in `text`, which was read from `path`; its numbers are not checked.
    fn parsed(text: &str, path: &Path) -> Result<Self> {
        let named = path.display();
        let malformed = |e: &toml::de::Error| {
            let line = e.span().map_or(1, |span| line_of(text, span.start));
            Error::data(format!("{named}, line {line}: {}", e.message()))
                .help(format!("correct the entry; {}", whole_file()))
        };
        let mut campaign: Campaign = toml::from_str(text).map_err(|e| malformed(&e))?;
        let places: Places = toml::from_str(text).map_err(|e| malformed(&e))?;
        let release_lines =
            places.release.iter().map(|release| line_of(text, release.span().start)).collect();
        let filled = campaign.fill_in();
        let file = Self { path: path.to_owned(), campaign, release_lines, text: text.to_owned() };
        filled.map(|()| file.clone()).map_err(|(release, what)| {
            let error = match release {
                Some(index) => file.error_at(index, what),
                None => Error::data(format!("{named}: {what}")),
            };
            error.help(format!("state each quantity once; {}", whole_file()))
        })
    }

    /// Where the record of release `index` is.
    pub fn record_path(&self, index: usize) -> PathBuf {
        let folder = self.path.parent().unwrap_or(Path::new(""));
        folder.join(&self.campaign.release[index].file)
    }

    /// The record of release `index`.
    ///
    /// # Errors
    /// Exit 3 where it cannot be read.
    pub fn record(&self, index: usize) -> Result<Record> {
        let motion = self.campaign.motion;
        let reading = Selection { motion, ..Selection::default() };
        yawrig_records::read_selected(&self.record_path(index), &reading)
    }

    /// Line of the entry `field` of release `index`, or of the release where it is elsewhere.
    pub fn line_in_release(&self, index: usize, field: Option<&str>) -> Option<usize> {
        let first = *self.release_lines.get(index)?;
        let Some(field) = field else { return Some(first) };
        let of_entry = lines_from(&self.text, first).find(|(_, line)| is_entry(line, field));
        let spring = &self.campaign.release[index].spring;
        let of_spring = || self.line_of_entry(&format!("stiffness_n_per_m.{spring}"));
        let of_spring = || of_spring().filter(|_| field.starts_with("spring_stiffness"));
        of_entry.map(|(line, _)| line).or_else(of_spring).or(Some(first))
    }

    /// Line of `section.entry`.
    pub fn line_of_entry(&self, name: &str) -> Option<usize> {
        let (section, entry) = name.split_once('.')?;
        let head =
            |line: &str| line.split('#').next().unwrap_or("").trim() == format!("[{section}]");
        let begins = 1 + self.text.lines().position(head)?;
        let is_it = |(_, line): &(usize, &str)| is_entry(line, entry);
        Some(lines_from(&self.text, begins).find(is_it).map_or(begins, |(line, _)| line))
    }

    /// An error at release `index`.
    pub fn error_at(&self, index: usize, what: impl fmt::Display) -> Error {
        Error::data(format!("{}, line {}: {what}", self.path.display(), self.release_lines[index]))
    }

    fn check(&self) -> Result<()> {
        self.faults().into_iter().next().map_or(Ok(()), Err)
    }

    /// Every entry that cannot be, in the order of the file.
    fn faults(&self) -> Vec<Error> {
        let mut faults = Vec::new();
        let named = self.path.display();
        let Campaign { schema_version, model, air, rig, inertia, release, .. } = &self.campaign;
        if *schema_version != SCHEMA_VERSION {
            faults.push(
                Error::data(format!("{named}: schema_version is {schema_version}"))
                    .help(format!("this program reads schema_version {SCHEMA_VERSION}")),
            );
        }
        let inertia = inertia.clone().unwrap_or_default();
        for (name, value) in [
            ("model.length_m", Some(model.length_m)),
            ("model.frontal_area_m2", Some(model.frontal_area_m2)),
            ("air.density_kg_m3", Some(air.density_kg_m3)),
            ("rig.spring_arm_m", Some(rig.spring_arm_m)),
            ("rig.axis_offset_m", Some(rig.axis_offset_m)),
            ("inertia.mid_kg_m2", inertia.mid_kg_m2),
            ("inertia.front_kg_m2", inertia.front_kg_m2),
        ] {
            if value.is_some_and(|value| !is_positive(value)) {
                let help = match name {
                    "air.density_kg_m3" => "give it, or temperature_deg_c and pressure_pa",
                    _ => "correct the entry",
                };
                let what = format!("{named}: {name} is not a positive number");
                faults.push(Error::data(what).help(help));
            }
        }
        for (name, u) in [
            ("model.length_u_m", model.length_u_m),
            ("model.frontal_area_u_m2", model.frontal_area_u_m2),
            ("air.density_u_kg_m3", air.density_u_kg_m3),
            ("rig.spring_arm_u_m", rig.spring_arm_u_m),
            ("rig.axis_offset_u_m", rig.axis_offset_u_m),
            ("rig.clock_u_ppm", rig.clock_u_ppm),
            ("inertia.mid_u_kg_m2", inertia.mid_u_kg_m2),
            ("inertia.front_u_kg_m2", inertia.front_u_kg_m2),
        ] {
            if u.is_some_and(|u| !is_not_negative(u)) {
                faults.push(
                    Error::data(format!("{named}: {name} is not a standard uncertainty"))
                        .help("give zero or a positive number"),
                );
            }
        }
        if release.is_empty() {
            faults.push(
                Error::data(format!("{named}: there is no [[release]] in it"))
                    .help("add one [[release]] for each record"),
            );
        }
        let (mut files, mut springs) = (HashMap::new(), HashMap::new());
        for (index, release) in release.iter().enumerate() {
            faults.extend(self.check_numbers(index).err());
            if let Some(earlier) = files.insert(&release.file, index) {
                let first = self.release_lines[earlier];
                let what = format!("record {} is listed already, on line {first}", release.file);
                faults.push(self.error_at(index, what).help("list each record once"));
            }
            let said = |x: f64| (!x.is_nan()).then_some(x);
            let stiffness =
                (said(release.spring_stiffness_n_per_m), release.spring_stiffness_u_n_per_m);
            let (earlier, other) = *springs.entry(&release.spring).or_insert((index, stiffness));
            if other != stiffness {
                let first = self.release_lines[earlier];
                let what =
                    format!("spring {} has another stiffness on line {first}", release.spring);
                faults.push(self.error_at(index, what).help("give each spring one stiffness"));
            }
        }
        faults
    }

    /// Whether the record of release `index` is there.
    ///
    /// # Errors
    /// Exit 3 where it is not, naming file and line.
    pub fn check_record(&self, index: usize) -> Result<()> {
        let path = self.record_path(index);
        if place::is_file(&path) {
            return Ok(());
        }
        Err(self.error_at(index, format!("record {} is not there", path.display())).help(
            "put it there, or correct its file entry: paths are relative to the campaign's file",
        ))
    }

    /// The campaign without the releases for which `keep` is false.
    pub fn only(&self, keep: impl Fn(usize) -> bool) -> Self {
        let kept = || (0..self.campaign.release.len()).filter(|index| keep(*index));
        let mut only = self.clone();
        only.campaign.release = kept().map(|k| self.campaign.release[k].clone()).collect();
        only.release_lines = kept().map(|k| self.release_lines[k]).collect();
        only
    }

    fn check_references(&self) -> Result<()> {
        let release = &self.campaign.release;
        let missing =
            |r: &ReleaseEntry| r.wind_speed_m_s > 0.0 && self.campaign.reference_of(r).is_none();
        if let Some(index) = release.iter().position(missing) {
            return Err(self.no_reference(index));
        }
        if release.iter().all(|release| release.wind_speed_m_s == 0.0) {
            let named = self.path.display();
            return Err(Error::data(format!("{named}: no release was made with the wind on"))
                .help("add the wind-on releases, with their wind_speed_m_s"));
        }
        Ok(())
    }

    fn check_numbers(&self, index: usize) -> Result<()> {
        let release = &self.campaign.release[index];
        if release.spring_stiffness_n_per_m.is_nan() {
            let what = format!("the stiffness of spring {} is not said", release.spring);
            return Err(self.error_at(index, what).help(format!(
                "give it in N/m, {} = 119.0 say, under [stiffness_n_per_m]",
                release.spring
            )));
        }
        if !is_positive(release.spring_stiffness_n_per_m) {
            return Err(self
                .error_at(index, "spring_stiffness_n_per_m is not a positive number")
                .help("correct the entry"));
        }
        if !is_not_negative(release.wind_speed_m_s) {
            return Err(self
                .error_at(index, "wind_speed_m_s is negative or not a number")
                .help("give 0 for wind off; dynamic_pressure_pa may stand in its place"));
        }
        if release.density_kg_m3.is_some_and(|density| !is_positive(density)) {
            return Err(self
                .error_at(index, "density_kg_m3 is not a positive number")
                .help("correct the entry, or leave it out where it is that of [air]"));
        }
        if let Some(name) = release.at.unusable_name() {
            return Err(self
                .error_at(index, format!("at.\"{name}\" cannot be a setting's name"))
                .help("name it by letters, digits, _ and -, and unlike any other entry"));
        }
        let is_number = |value: &Value| !matches!(value, Value::Number(x) if !x.is_finite());
        if let Some((name, _)) = release.at.0.iter().find(|(_, value)| !is_number(value)) {
            return Err(self
                .error_at(index, format!("at.{name} is not a number"))
                .help("give a number, or a configuration's name in quotes"));
        }
        for (name, u) in [
            ("spring_stiffness_u_n_per_m", release.spring_stiffness_u_n_per_m),
            ("wind_speed_u_m_s", release.wind_speed_u_m_s),
        ] {
            if u.is_some_and(|u| !is_not_negative(u)) {
                return Err(self
                    .error_at(index, format!("{name} is not a standard uncertainty"))
                    .help("give zero or a positive number"));
            }
        }
        Ok(())
    }

    fn no_reference(&self, index: usize) -> Error {
        let ReleaseEntry { file, spring, axis, at, .. } = &self.campaign.release[index];
        let under = if at.is_empty() { String::new() } else { format!(" that serves {at}") };
        let what = format!(
            "{file} was made with the wind on, but there is no wind-off release of spring {spring} on the {axis} axis{under}"
        );
        self.error_at(index, what).help(format!(
            "add a [[release]] with spring = \"{spring}\", axis = \"{axis}\", wind_speed_m_s = 0.0"
        ))
    }
}

fn is_positive(value: f64) -> bool {
    value.is_finite() && value > 0.0
}

fn is_not_negative(value: f64) -> bool {
    value.is_finite() && value >= 0.0
}

fn whole_file() -> String {
    format!("`{}` shows a whole file", settings::command("campaign", &[], &[("help", "")]))
}

/// The lines after line `first`, a section's head, up to the next one, counted from 1.
fn lines_from(text: &str, first: usize) -> impl Iterator<Item = (usize, &str)> {
    let after = text.lines().enumerate().skip(first).map(|(index, line)| (index + 1, line));
    after.take_while(|(_, line)| !line.trim_start().starts_with('['))
}

fn is_entry(line: &str, name: &str) -> bool {
    line.split('=').next().is_some_and(|key| key.trim().trim_matches('"') == name)
}

fn line_of(text: &str, offset: usize) -> usize {
    text.as_bytes()[..offset.min(text.len())].iter().filter(|byte| **byte == b'\n').count() + 1
}

#[cfg(test)]
mod derivatives_tests;
#[cfg(test)]
mod tests;
