//! Repeated releases of one condition, averaged.

use super::campaign::Campaign;
use crate::identify::flag::Flag;
use crate::identify::Identification;
use crate::quantity::Quantity;
use serde::Serialize;
use std::collections::HashMap;
use yawrig_shared::axis::Axis;

/// What a method found in one record.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Identified {
    pub natural_frequency_rad_s: Quantity,
    pub damping_ratio: Quantity,
    /// Beginning and end of what was analysed, on the record's clock.
    pub from_s: f64,
    pub to_s: f64,
    /// What a reader must know besides.
    pub flags: Vec<Flag>,
}

impl Identified {
    /// The first method's answer of an identification; `None` where no method had one.
    pub fn of(identification: Identification) -> Option<Self> {
        let window = identification.window;
        let estimate = identification.estimates.into_iter().next()?;
        Some(Self {
            natural_frequency_rad_s: estimate.natural_frequency_rad_s,
            damping_ratio: estimate.damping_ratio,
            from_s: window.from_s,
            to_s: window.to_s,
            flags: estimate.flags,
        })
    }
}

/// A mean and where its standard uncertainty comes from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mean {
    pub value: f64,
    pub u_fit: f64,
    pub u_repeatability: f64,
}

impl Mean {
    pub fn u(&self) -> f64 {
        self.u_fit.hypot(self.u_repeatability)
    }
}

/// Wind speeds closer than this, relative, are one condition.
const SAME_SPEED: f64 = 0.02;

/// Whether two wind speeds in m/s are the same setting; off is only the same as off.
pub fn is_same_speed(a: f64, b: f64) -> bool {
    a == b || (a > 0.0 && b > 0.0 && (a - b).abs() <= SAME_SPEED * a.max(b))
}

/// Which releases belong together: one spring and axis at one wind speed.
#[derive(Clone, Debug, PartialEq)]
pub struct Setting {
    pub spring: String,
    pub axis: Axis,
    /// Mean over the releases; 0: wind off.
    pub wind_speed_m_s: f64,
    /// The largest of theirs: repeats share the tunnel's error.
    pub wind_speed_u_m_s: f64,
    /// Indices into the campaign's releases.
    pub releases: Vec<usize>,
}

/// The settings in the order of their first release. Wind speeds within 2 % of each other are one.
pub fn settings(campaign: &Campaign) -> Vec<Setting> {
    let mut settings: Vec<Setting> = Vec::new();
    let mut places: HashMap<_, Vec<usize>> = HashMap::new();
    for (index, release) in campaign.release.iter().enumerate() {
        let speed = release.wind_speed_m_s;
        let known = places.entry((&release.spring, release.axis)).or_default();
        let same = known.iter().find(|&&i| is_same_speed(settings[i].wind_speed_m_s, speed));
        let place = same.copied().unwrap_or_else(|| {
            known.push(settings.len());
            settings.push(Setting {
                spring: release.spring.clone(),
                axis: release.axis,
                wind_speed_m_s: speed,
                wind_speed_u_m_s: 0.0,
                releases: Vec::new(),
            });
            settings.len() - 1
        });
        let setting = &mut settings[place];
        setting.releases.push(index);
        setting.wind_speed_m_s += (speed - setting.wind_speed_m_s) / setting.releases.len() as f64;
        let u = release.wind_speed_u_m_s.unwrap_or(0.0);
        setting.wind_speed_u_m_s = setting.wind_speed_u_m_s.max(u);
    }
    settings
}

/// All releases of one spring and axis at one wind speed.
#[derive(Clone, Debug, PartialEq)]
pub struct Condition {
    pub spring: String,
    pub axis: Axis,
    /// Mean over the releases; 0: wind off.
    pub wind_speed_m_s: f64,
    /// The largest of theirs: repeats share the tunnel's error.
    pub wind_speed_u_m_s: f64,
    /// Indices into the campaign's releases.
    pub releases: Vec<usize>,
    pub natural_frequency_rad_s: Mean,
    /// 2 zeta wn.
    pub damping_rad_s: Mean,
}

impl Condition {
    fn is_wind_on(&self) -> bool {
        self.wind_speed_m_s > 0.0
    }
}

/// The conditions ([`settings`]), each with the means over its releases.
///
/// Releases scatter more than their fits' uncertainties say; that excess is pooled over all repeated conditions
/// (wind off and wind on apart, relative for wn, absolute for 2 zeta wn), since two or three repeats of one tell
/// little, and it counts for the conditions released once too.
pub fn group(campaign: &Campaign, identified: &[Identified]) -> Vec<Condition> {
    let nothing = Mean { value: 0.0, u_fit: 0.0, u_repeatability: 0.0 };
    let condition = |setting: Setting| Condition {
        spring: setting.spring,
        axis: setting.axis,
        wind_speed_m_s: setting.wind_speed_m_s,
        wind_speed_u_m_s: setting.wind_speed_u_m_s,
        releases: setting.releases,
        natural_frequency_rad_s: nothing,
        damping_rad_s: nothing,
    };
    let mut conditions: Vec<Condition> = settings(campaign).into_iter().map(condition).collect();
    for wind_on in [false, true] {
        let mut members: Vec<&mut Condition> =
            conditions.iter_mut().filter(|condition| condition.is_wind_on() == wind_on).collect();
        let values = |of: fn(&Identified) -> Quantity| -> Vec<Vec<Quantity>> {
            let read = |condition: &&mut Condition| {
                condition.releases.iter().map(|&index| of(&identified[index])).collect()
            };
            members.iter().map(read).collect()
        };
        let frequencies = values(|found| found.natural_frequency_rad_s);
        let dampings = values(damping_rad_s);
        let relative: Vec<Vec<Quantity>> =
            frequencies.iter().map(|values| relative(values)).collect();
        let (tau_frequency, tau_damping) = (excess_scatter(&relative), excess_scatter(&dampings));
        for (place, condition) in members.iter_mut().enumerate() {
            let middle = frequencies[place][0].value;
            condition.natural_frequency_rad_s = mean(&frequencies[place], tau_frequency * middle);
            condition.damping_rad_s = mean(&dampings[place], tau_damping);
        }
    }
    conditions
}

/// 2 zeta wn; the two are estimated independently of each other at small damping.
fn damping_rad_s(found: &Identified) -> Quantity {
    let (wn, zeta) = (found.natural_frequency_rad_s, found.damping_ratio);
    Quantity::new(2.0 * zeta.value * wn.value, 2.0 * (zeta.u * wn.value).hypot(zeta.value * wn.u))
}

fn relative(values: &[Quantity]) -> Vec<Quantity> {
    let scale = values[0].value;
    values.iter().map(|q| Quantity::new(q.value / scale, q.u / scale)).collect()
}

/// Standard deviation between releases beyond their own uncertainties, pooled over the groups by moments; 0 where
/// there is none or nothing was repeated.
fn excess_scatter(groups: &[Vec<Quantity>]) -> f64 {
    let (mut excess, mut freedom) = (0.0, 0.0);
    for group in groups.iter().filter(|group| group.len() > 1) {
        let n = group.len() as f64;
        let mean = group.iter().map(|q| q.value).sum::<f64>() / n;
        let scatter: f64 = group.iter().map(|q| (q.value - mean).powi(2)).sum();
        let expected: f64 = group.iter().map(|q| q.u * q.u).sum::<f64>() * (n - 1.0) / n;
        excess += scatter - expected;
        freedom += n - 1.0;
    }
    if freedom > 0.0 {
        (excess / freedom).max(0.0).sqrt()
    } else {
        0.0
    }
}

/// Weighted by 1 / (u^2 + tau^2); unweighted where a release claims to be exact.
fn mean(values: &[Quantity], tau: f64) -> Mean {
    let variances = values.iter().map(|q| q.u * q.u + tau * tau);
    let weights: Vec<f64> = if variances.clone().all(|variance| variance > 0.0) {
        variances.map(f64::recip).collect()
    } else {
        vec![1.0; values.len()]
    };
    let total: f64 = weights.iter().sum();
    let shares: Vec<f64> = weights.iter().map(|weight| weight / total).collect();
    let both = || values.iter().zip(&shares);
    Mean {
        value: both().map(|(q, share)| share * q.value).sum(),
        u_fit: both().map(|(q, share)| (share * q.u).powi(2)).sum::<f64>().sqrt(),
        u_repeatability: tau.abs() * shares.iter().map(|share| share * share).sum::<f64>().sqrt(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scatter_within_the_fits_uncertainty_is_not_counted_twice() {
        let group =
            vec![Quantity::new(1.0, 0.1), Quantity::new(1.1, 0.1), Quantity::new(0.95, 0.1)];
        assert_eq!(excess_scatter(std::slice::from_ref(&group)), 0.0);
        let mean = mean(&group, 0.0);
        assert!((mean.value - 3.05 / 3.0).abs() < 1e-12);
        assert!((mean.u() - 0.1 / 3f64.sqrt()).abs() < 1e-12);
    }

    #[test]
    fn scatter_beyond_it_is_found_and_pooled() {
        let exact = |values: &[f64]| values.iter().map(|v| Quantity::exact(*v)).collect::<Vec<_>>();
        let groups = [exact(&[1.0, 1.2]), exact(&[5.0]), exact(&[3.0, 3.0, 3.3])];
        // Sums of squares 0.02 and 0.06 over three degrees of freedom.
        let tau = excess_scatter(&groups);
        assert!((tau - (0.08f64 / 3.0).sqrt()).abs() < 1e-12);
        assert!((mean(&groups[2], tau).u_repeatability - tau / 3f64.sqrt()).abs() < 1e-12);
        assert_eq!(mean(&groups[1], tau).u_repeatability, tau, "counts for what was released once");
    }

    #[test]
    fn a_better_release_weighs_more() {
        let mean = mean(&[Quantity::new(1.0, 0.1), Quantity::new(2.0, 0.2)], 0.0);
        assert!((mean.value - 1.2).abs() < 1e-12);
        assert!((mean.u_fit - (1.0f64 / (100.0 + 25.0)).sqrt()).abs() < 1e-12);
    }
}
