//! What is to be measured: a campaign, or one condition, from a file or from single quantities.

use super::simulated;
use super::CampaignFile;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use yawrig_base::error::{Error, Result};
use yawrig_core::derivatives::campaign::{Campaign, InertiaEntry, ReleaseEntry};
use yawrig_rig::{Rig, Spring, SPRINGS};
use yawrig_shared::axis::Axis;
use yawrig_text::nearest;

/// What is to be released.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// Its releases are made in their order; each entry's file is the name of the record to be.
    pub campaign: Campaign,
    /// Its first release over and over, instead of one after the other.
    pub stays: bool,
}

/// What a user says of it.
#[derive(Clone, Debug, Default, Deserialize, Serialize)]
#[serde(default, deny_unknown_fields)]
pub struct Wanted {
    /// The releases of this file one after the other; their records need not be there.
    pub campaign: Option<PathBuf>,
    /// `campaign.toml#N`: release N of this file over and over; without `#N` what it says of model, air and
    /// rig.
    pub condition: Option<String>,
    pub spring: Option<String>,
    pub axis: Option<Axis>,
    pub wind_speed_m_s: Option<f64>,
    pub density_kg_m3: Option<f64>,
    /// About that axis.
    pub inertia_kg_m2: Option<f64>,
    pub length_m: Option<f64>,
    pub frontal_area_m2: Option<f64>,
    pub stiffness_n_per_m: Option<f64>,
    pub spring_arm_m: Option<f64>,
    pub axis_offset_m: Option<f64>,
}

impl Wanted {
    /// A name for the folder of its records.
    pub fn name(&self) -> String {
        let of_file = |file: &Path| {
            let stem = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
            let folder = file.parent().and_then(Path::file_name);
            folder.map_or(stem.clone(), |folder| format!("{}-{stem}", folder.to_string_lossy()))
        };
        let condition = self.condition.as_deref().map(|c| c.rsplit_once('#').map_or(c, |(f, _)| f));
        match self.campaign.as_deref().or(condition.map(Path::new)) {
            Some(file) => of_file(file),
            None => "conditions".to_owned(),
        }
    }

    /// What is to be measured, if that was said.
    ///
    /// # Errors
    /// Exit 2 where something is missing or no number that can be; those of the file.
    pub fn plan(&self, is_built_in: bool) -> Result<Option<Plan>> {
        if let Some(file) = &self.campaign {
            let campaign = self.changed(CampaignFile::read_listed(file)?.campaign, None)?;
            return Ok(Some(Plan { campaign, stays: false }));
        }
        if self.condition.is_none() && self.spring.is_none() {
            let of_it = [self.wind_speed_m_s, self.inertia_kg_m2, self.stiffness_n_per_m];
            let more = of_it.into_iter().chain(self.of_the_rig().map(|(_, value)| value));
            if self.axis.is_some() || more.flatten().next().is_some() {
                return Err(Error::usage("a condition without a spring")
                    .help("name the spring, or a release of a campaign's file"));
            }
            return Ok(None);
        }
        let (mut campaign, entry) = match &self.condition {
            Some(text) => from_file(text)?,
            None => (self.described(is_built_in)?, None),
        };
        let spring = match (&self.spring, &entry) {
            (Some(spring), _) => spring.clone(),
            (None, Some(entry)) => entry.spring.clone(),
            (None, None) => {
                return Err(Error::usage("a condition without #N says nothing of a release")
                    .help("add #N, or spring, axis and wind speed"))
            }
        };
        // It names the record, too.
        if spring.trim().is_empty()
            || spring.contains(|c: char| "/\\#".contains(c) || c.is_control())
        {
            return Err(Error::usage(format!("{spring:?} names no spring"))
                .help("give a name without '/', '\\' and '#', such as K3"));
        }
        let known = campaign.release.iter().find(|r| r.spring == spring).cloned();
        let built_in = Spring::named(&spring).ok().filter(|_| is_built_in);
        let of_file = known.as_ref().map(|r| r.spring_stiffness_n_per_m);
        let stiffness =
            self.stiffness_n_per_m.or(of_file).or(built_in.map(|s| s.stiffness_n_per_m));
        let stiffness = stiffness.ok_or_else(|| unknown_spring(&spring, &campaign, is_built_in))?;
        let axis = self.axis.or(entry.as_ref().map(|e| e.axis)).unwrap_or(Axis::Mid);
        let wind_speed_m_s =
            self.wind_speed_m_s.or(entry.as_ref().map(|e| e.wind_speed_m_s)).ok_or_else(|| {
                Error::usage(format!("spring {spring} without a wind speed"))
                    .help("give one, 0 for off")
            })?;
        let setting =
            if wind_speed_m_s == 0.0 { "off".to_owned() } else { wind_speed_m_s.to_string() };
        let file = format!("{spring}-{axis}-{setting}.csv");
        campaign.release = vec![ReleaseEntry {
            spring_stiffness_u_n_per_m: known
                .filter(|r| r.spring_stiffness_n_per_m == stiffness)
                .and_then(|r| r.spring_stiffness_u_n_per_m),
            density_kg_m3: entry.as_ref().and_then(|e| e.density_kg_m3),
            at: entry.as_ref().map(|e| e.at.clone()).unwrap_or_default(),
            wind_speed_u_m_s: entry
                .filter(|e| e.wind_speed_m_s == wind_speed_m_s)
                .and_then(|e| e.wind_speed_u_m_s),
            ..ReleaseEntry::new(&file, (&spring, stiffness), axis, wind_speed_m_s)
        }];
        Ok(Some(Plan { campaign: self.changed(campaign, Some(axis))?, stays: true }))
    }

    /// What else there is to say of model, air and rig.
    fn of_the_rig(&self) -> [(&'static str, Option<f64>); 5] {
        [
            ("density_kg_m3", self.density_kg_m3),
            ("length_m", self.length_m),
            ("frontal_area_m2", self.frontal_area_m2),
            ("spring_arm_m", self.spring_arm_m),
            ("axis_offset_m", self.axis_offset_m),
        ]
    }

    /// The built-in rig, or what the flags say of another.
    fn described(&self, is_built_in: bool) -> Result<Campaign> {
        let needed =
            self.of_the_rig().into_iter().chain([("stiffness_n_per_m", self.stiffness_n_per_m)]);
        let missing: Vec<&str> =
            needed.filter(|(_, g)| g.is_none()).map(|(name, _)| name).collect();
        if !is_built_in && !missing.is_empty() {
            return Err(Error::usage(format!(
                "the rig at the device is not described: {} are missing",
                missing.join(", ")
            ))
            .help("give the campaign.toml of this rig as condition, beside spring, axis and wind speed"));
        }
        let mut campaign = simulated::describe(&Rig::default(), &[]);
        if !is_built_in {
            campaign.model.name = "model".to_owned();
            campaign.rig.clock_u_ppm = None;
        }
        Ok(campaign)
    }

    /// With what the flags say of model, air and rig; the inertia is that about `axis`, or about each.
    fn changed(&self, mut campaign: Campaign, axis: Option<Axis>) -> Result<Campaign> {
        let Campaign { model, air, rig, .. } = &mut campaign;
        let entries = [
            &mut air.density_kg_m3,
            &mut model.length_m,
            &mut model.frontal_area_m2,
            &mut rig.spring_arm_m,
            &mut rig.axis_offset_m,
        ];
        for (entry, (name, value)) in entries.into_iter().zip(self.of_the_rig()) {
            if let Some(value) = value {
                *entry = positive(name, value)?;
            }
        }
        if let Some(stiffness) = self.stiffness_n_per_m {
            positive("stiffness_n_per_m", stiffness)?;
        }
        let Some(inertia) = self.inertia_kg_m2 else { return Ok(campaign) };
        positive("inertia_kg_m2", inertia)?;
        let Some(axis) = axis else {
            return Err(Error::usage("inertia_kg_m2 with a whole campaign: about which axis?")
                .help("write it into the campaign's file, under [inertia]"));
        };
        let known = campaign.inertia.get_or_insert_with(InertiaEntry::default);
        match axis {
            Axis::Mid => known.mid_kg_m2 = Some(inertia),
            Axis::Front => known.front_kg_m2 = Some(inertia),
        }
        Ok(campaign)
    }
}

fn positive(name: &str, value: f64) -> Result<f64> {
    if value.is_finite() && value > 0.0 {
        return Ok(value);
    }
    Err(Error::usage(format!("{name} {value} is not a positive number")).help("correct it"))
}

/// A spring that neither the file nor the built-in rig has.
fn unknown_spring(spring: &str, campaign: &Campaign, is_built_in: bool) -> Error {
    let of_file = campaign.release.iter().map(|release| release.spring.as_str());
    let built_in = SPRINGS.iter().map(|spring| spring.name).filter(|_| is_built_in);
    let help = match nearest(spring, of_file.chain(built_in)) {
        Some(near) => format!("did you mean {near}? Or give its stiffness_n_per_m"),
        None => "give its stiffness_n_per_m".to_owned(),
    };
    Error::usage(format!("nothing says how stiff spring {spring} is")).help(help)
}

/// `campaign.toml#N`: the file, and its N-th release where there is an N.
fn from_file(text: &str) -> Result<(Campaign, Option<ReleaseEntry>)> {
    let (file, number) = match text.rsplit_once('#') {
        Some((file, number)) => (file, Some(number)),
        None => (text, None),
    };
    let read = CampaignFile::read_listed(Path::new(file))?;
    let count = read.campaign.release.len();
    let Some(number) = number else { return Ok((read.campaign, None)) };
    let place = number.parse::<usize>().ok().and_then(|n| n.checked_sub(1)).filter(|n| *n < count);
    let place = place.ok_or_else(|| {
        Error::usage(format!("{text}: {file} has releases 1 to {count}"))
            .help("give the number of one of them")
    })?;
    let entry = read.campaign.release[place].clone();
    Ok((read.campaign, Some(entry)))
}
