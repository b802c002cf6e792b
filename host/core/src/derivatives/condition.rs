//! Repeated releases of one condition, averaged.

use super::at::At;
use super::campaign::{Campaign, ReleaseEntry};
use super::repeats::{chi_squared, excess_scatter, mean, Mean};
use crate::identify::flag::Flag;
use crate::identify::uncertainty::Lacking;
use crate::identify::{AtAmplitude, Identification, OneMode};
use crate::quantity::Quantity;
use serde::Serialize;
use std::collections::HashMap;
use yawrig_shared::axis::Axis;

/// What a method found in one record.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Identified {
    /// Of the linear part, undamped.
    pub natural_frequency_rad_s: Quantity,
    /// Negative where the oscillation grows.
    pub damping_ratio: Quantity,
    /// Beginning of what was analysed, on the record's clock.
    pub from_s: f64,
    /// End of what was analysed, on the record's clock.
    pub to_s: f64,
    /// What a reader must know besides.
    pub flags: Vec<Flag>,
    /// What of the uncertainties is for a law that the linear model lacks.
    #[serde(skip)]
    pub lacking: Lacking,
    /// How wn and zeta go with amplitude, where that is known.
    #[serde(skip)]
    pub at_amplitude: Vec<AtAmplitude>,
    /// wn and zeta of every three cycles, where the method has them.
    #[serde(skip)]
    pub by_window: Vec<AtAmplitude>,
}

impl Identified {
    /// With nothing to be said besides.
    pub fn new(
        natural_frequency_rad_s: Quantity,
        damping_ratio: Quantity,
        from_s: f64,
        to_s: f64,
    ) -> Self {
        Self {
            natural_frequency_rad_s,
            damping_ratio,
            from_s,
            to_s,
            flags: Vec::new(),
            lacking: Lacking::default(),
            at_amplitude: Vec::new(),
            by_window: Vec::new(),
        }
    }

    /// The first method's answer of an identification, `None` where no method had one: its one mode over the
    /// whole window, not the mean over it, since derivatives are those of a linear model, and the uncertainty
    /// has to hold what that lacks.
    pub fn from_identification(identification: Identification) -> Option<Self> {
        let window = identification.window;
        let estimate = identification.estimates.into_iter().next()?;
        let stored = || OneMode {
            natural_frequency_rad_s: estimate.natural_frequency_rad_s,
            damping_ratio: estimate.damping_ratio,
            lacking: Lacking::default(),
        };
        let mode = estimate.one_mode.unwrap_or_else(stored);
        Some(Self {
            natural_frequency_rad_s: mode.natural_frequency_rad_s,
            damping_ratio: mode.damping_ratio,
            from_s: window.from_s,
            to_s: window.to_s,
            flags: estimate.flags,
            lacking: mode.lacking,
            at_amplitude: estimate.at_amplitude,
            by_window: estimate.by_window,
        })
    }
}

/// How releases of one condition scatter.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Scatter {
    /// Standard deviation of wn between releases.
    pub natural_frequency_rad_s: f64,
    /// Against what the fits state, per degree of freedom; `null` where a release claims to be exact.
    pub natural_frequency_chi_squared: Option<f64>,
    /// Standard deviation of the damping ratio between releases.
    pub damping_ratio: f64,
    /// Against what the fits state, per degree of freedom.
    pub damping_chi_squared: Option<f64>,
}

/// Wind speeds closer than this, relative, are one condition.
pub(crate) const SAME_SPEED: f64 = 0.02;

/// Whether two wind speeds in m/s are the same setting; off is only the same as off.
pub fn is_same_speed(a: f64, b: f64) -> bool {
    a == b || (a > 0.0 && b > 0.0 && (a - b).abs() <= SAME_SPEED * a.max(b))
}

/// Whether two releases are repeats of each other: the same spring, axis, wind and settings.
pub fn are_repeats(a: &ReleaseEntry, b: &ReleaseEntry) -> bool {
    (&a.spring, a.axis, &a.at) == (&b.spring, b.axis, &b.at)
        && is_same_speed(a.wind_speed_m_s, b.wind_speed_m_s)
}

/// Which releases belong together: one spring and axis at one wind speed.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Setting {
    pub(crate) spring: String,
    pub(crate) axis: Axis,
    /// Mean over the releases; 0: wind off.
    pub(crate) wind_speed_m_s: f64,
    /// The largest of theirs: repeats share the tunnel's error.
    pub(crate) wind_speed_u_m_s: f64,
    /// Mean over the releases.
    pub(crate) density_kg_m3: f64,
    /// What else they were made under.
    pub(crate) at: At,
    /// Indices into the campaign's releases.
    pub(crate) releases: Vec<usize>,
}

impl Setting {
    fn is_wind_on(&self) -> bool {
        self.wind_speed_m_s > 0.0
    }
}

/// The settings in the order of their first release. Wind speeds within 2 % of each other are one.
pub(crate) fn settings(campaign: &Campaign) -> Vec<Setting> {
    let mut settings: Vec<Setting> = Vec::new();
    let mut places: HashMap<_, Vec<usize>> = HashMap::new();
    let air = campaign.air.density_kg_m3;
    for (index, release) in campaign.release.iter().enumerate() {
        let speed = release.wind_speed_m_s;
        let known = places.entry((&release.spring, release.axis)).or_default();
        let same = known.iter().find(|&&i| {
            settings[i].at == release.at && is_same_speed(settings[i].wind_speed_m_s, speed)
        });
        let place = same.copied().unwrap_or_else(|| {
            known.push(settings.len());
            settings.push(Setting {
                spring: release.spring.clone(),
                axis: release.axis,
                wind_speed_m_s: speed,
                wind_speed_u_m_s: 0.0,
                density_kg_m3: air,
                at: release.at.clone(),
                releases: Vec::new(),
            });
            settings.len() - 1
        });
        let setting = &mut settings[place];
        setting.releases.push(index);
        let count = setting.releases.len() as f64;
        setting.wind_speed_m_s += (speed - setting.wind_speed_m_s) / count;
        let density = campaign.density_kg_m3(release);
        setting.density_kg_m3 += (density - setting.density_kg_m3) / count;
        let u = release.wind_speed_u_m_s.unwrap_or(0.0);
        setting.wind_speed_u_m_s = setting.wind_speed_u_m_s.max(u);
    }
    settings
}

/// All releases of one spring and axis at one wind speed.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Condition {
    pub(crate) setting: Setting,
    pub(crate) natural_frequency_rad_s: Mean,
    /// 2 zeta wn.
    pub(crate) damping_rad_s: Mean,
    /// How both go with amplitude in its first release.
    pub(crate) at_amplitude: Vec<AtAmplitude>,
}

impl Condition {
    /// What is to be said where its repeats scatter by more than chance.
    pub(super) fn scatter(&self) -> Option<String> {
        let of = |mean: &Mean, name: &str| {
            (mean.birge_ratio > 1.0).then(|| format!("{:.1} times in {name}", mean.birge_ratio))
        };
        let both = [of(&self.natural_frequency_rad_s, "wn"), of(&self.damping_rad_s, "2 zeta wn")];
        let times: Vec<String> = both.into_iter().flatten().collect();
        let Setting { spring, axis, wind_speed_m_s, releases, .. } = &self.setting;
        (!times.is_empty()).then(|| {
            format!(
                "spring {spring}, {axis} axis, {wind_speed_m_s:.3} m/s: its {} releases scatter more than their fits state, {}, \
                 which chance does once in a hundred at most; the uncertainty of their mean is widened by that",
                releases.len(),
                times.join(" and ")
            )
        })
    }
}

/// The conditions ([`settings`]), each with the means over its releases.
///
/// Releases scatter more than their fits' uncertainties say; that excess is pooled over all repeated
/// conditions (wind off and wind on apart, relative for wn, absolute for 2 zeta wn), since two or three
/// repeats of one tell little, and it counts for the conditions released once too. Where the repeats of one
/// condition scatter more than their fits state by more than chance, its mean's uncertainty is the stated one
/// times the Birge ratio at least (R. T. Birge, Phys. Rev. 40, 1932).
pub(crate) fn group(campaign: &Campaign, identified: &[Identified]) -> Vec<Condition> {
    let values = |setting: &Setting, of: fn(&Identified) -> Quantity| -> Vec<Quantity> {
        setting.releases.iter().map(|&index| of(&identified[index])).collect()
    };
    let settings = settings(campaign);
    let wn = |found: &Identified| found.natural_frequency_rad_s;
    let scatter = [false, true].map(|wind_on| {
        let members = || settings.iter().filter(|setting| setting.is_wind_on() == wind_on);
        let relative: Vec<_> = members().map(|setting| relative(&values(setting, wn))).collect();
        let dampings: Vec<_> = members().map(|setting| values(setting, damping_rad_s)).collect();
        [excess_scatter(&relative), excess_scatter(&dampings)]
    });
    let condition = |setting: Setting| {
        let [of_frequency, of_damping] = scatter[usize::from(setting.is_wind_on())];
        let frequencies = values(&setting, wn);
        // Repeats lack the same law: their mean knows of it what each does.
        let found = || setting.releases.iter().map(|&index| &identified[index]);
        let most = |of: fn(&Identified) -> f64| found().map(of).fold(0.0, f64::max);
        Condition {
            natural_frequency_rad_s: mean(&frequencies, of_frequency * frequencies[0].value)
                .lacking(most(|found| found.lacking.natural_frequency_rad_s)),
            damping_rad_s: mean(&values(&setting, damping_rad_s), of_damping)
                .lacking(most(lacking_damping_rad_s)),
            at_amplitude: identified[setting.releases[0]].at_amplitude.clone(),
            setting,
        }
    };
    settings.into_iter().map(condition).collect()
}

/// 2 zeta wn; the two are estimated independently of each other at small damping.
pub(super) fn damping_rad_s(found: &Identified) -> Quantity {
    let (wn, zeta) = (found.natural_frequency_rad_s, found.damping_ratio);
    Quantity::new(2.0 * zeta.value * wn.value, 2.0 * (zeta.u * wn.value).hypot(zeta.value * wn.u))
}

/// What of its uncertainty is for a law that the linear model lacks.
fn lacking_damping_rad_s(found: &Identified) -> f64 {
    let (wn, zeta) = (found.natural_frequency_rad_s.value, found.damping_ratio.value);
    let Lacking { natural_frequency_rad_s, damping_ratio } = found.lacking;
    2.0 * (damping_ratio * wn).hypot(zeta * natural_frequency_rad_s)
}

fn relative(values: &[Quantity]) -> Vec<Quantity> {
    let scale = values[0].value;
    values.iter().map(|q| Quantity::new(q.value / scale, q.u / scale)).collect()
}

/// How repeats of one condition scatter; `None` for what was released once.
pub(super) fn scatter(found: &[&Identified]) -> Option<Scatter> {
    let freedom = found.len().checked_sub(1).filter(|n| *n > 0)? as f64;
    let of = |of: &dyn Fn(&Identified) -> Quantity| {
        let values: Vec<Quantity> = found.iter().map(|f| of(f)).collect();
        let mean = values.iter().map(|q| q.value).sum::<f64>() / values.len() as f64;
        let squares: f64 = values.iter().map(|q| (q.value - mean).powi(2)).sum();
        let chi = chi_squared(&values).map(|(chi, freedom, _)| chi / freedom);
        ((squares / freedom).sqrt(), chi)
    };
    let (natural_frequency_rad_s, natural_frequency_chi_squared) =
        of(&|f| f.natural_frequency_rad_s);
    let (damping_ratio, damping_chi_squared) = of(&|f| f.damping_ratio);
    Some(Scatter {
        natural_frequency_rad_s,
        natural_frequency_chi_squared,
        damping_ratio,
        damping_chi_squared,
    })
}
