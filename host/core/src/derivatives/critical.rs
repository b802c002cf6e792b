//! The wind speed from which on the model swings by itself, and how far.
//!
//! Quasi-steady, the wind adds 1/2 rho V A l^2 Cn_r / (2 Izz) to the decay rate zeta wn: a straight line over
//! the wind's speed V. Where it falls through zero an oscillation grows, up to the amplitude whose own damping
//! ends that. Reference: A. Mansor, M. A. Passmore, "Estimation of bluff body transient aerodynamics using an
//! oscillating model rig", J. Wind Eng. Ind. Aerodyn. 96 (2008) 1218.

use super::at::At;
use super::condition::{damping_rad_s, Condition, Identified};
use super::decay_rate::{DecayRate, Sample};
use crate::quantity::Quantity;
use serde::{Deserialize, Serialize};
use yawrig_shared::axis::Axis;

/// Of the largest speed and amplitude measured: what is further out is no result but an extrapolation.
const REACH: f64 = 1.5;
/// Largest standard uncertainty of a critical speed, of itself: with more it is not told from the next speed of
/// a campaign, which are about a fifth apart.
const LARGEST_U: f64 = 0.1;
/// Standard uncertainties of the decay rate whose zeros bound the critical speed's interval.
const INTERVAL: f64 = 2.0;
/// How far above the critical speed amplitudes are foretold, of that speed.
const ABOVE: f64 = 1.3;
/// Samples that a release counts as at most: neighbouring windows are averaged, which loses nothing that a law
/// this smooth could show, and keeps the covariance of a large campaign small.
const SAMPLES: usize = 12;

/// The speed from which on one spring and axis swing by themselves.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CriticalSpeed {
    /// Name of the springs.
    pub spring: String,
    /// The axis that the model turns about.
    pub axis: Axis,
    /// What else it was made under.
    #[serde(default, skip_serializing_if = "At::is_empty")]
    pub at: At,
    /// Where the damping of small amplitudes falls through zero.
    pub wind_speed_m_s: Quantity,
    /// The law's damping ratio at rest at each speed measured, speeds rising.
    pub damping: Vec<DampingAtRest>,
    /// What the decay rate zeta wn is a sum of: `1`, `V`, `V^2`, and by what it goes with the amplitude A:
    /// `A`, `V A`, `A^2`, `V A^2`.
    pub terms: Vec<String>,
    /// How far the model swings by itself; empty where no damping is seen that grows with amplitude.
    pub limit_cycle: Vec<LimitCycle>,
    /// The further release, on one of a few speeds, after which the critical speed would be known best.
    pub narrowed_by: Option<NarrowedBy>,
}

impl CriticalSpeed {
    /// Where it swings by itself, in a sentence.
    pub fn sentence(&self) -> String {
        let Self { spring, axis, at, wind_speed_m_s, .. } = self;
        let setting = if at.is_empty() { String::new() } else { format!(", {at}") };
        format!(
            "Swings by itself from {wind_speed_m_s} m/s on (spring {spring}, axis {axis}{setting})."
        )
    }

    /// The same, with the amplitudes that it goes to.
    pub fn with_cycles(&self) -> String {
        let cycle = |l: &LimitCycle| {
            let speed = (1e4 * l.wind_speed_m_s).round() / 1e4;
            format!(" At {speed} m/s it goes to {} deg.", l.amplitude_deg)
        };
        let cycles: String = self.limit_cycle.iter().map(cycle).collect();
        format!("{} {}{cycles}", self.sentence(), self.law())
    }

    /// The law behind it.
    pub fn law(&self) -> String {
        format!(
            "The decay rate zeta wn is fitted by {}; V: wind speed, A: amplitude. Zeta at rest is that of small amplitudes.",
            self.terms.join(", ")
        )
    }

    /// Each speed that something is known of: the damping ratio at rest where it was measured, and the
    /// amplitude of the oscillation that stays. Measured speeds first.
    pub fn rows(&self) -> Vec<(f64, Option<Quantity>, Option<Quantity>)> {
        let cycle = |speed: f64| {
            let its = self.limit_cycle.iter().find(|cycle| cycle.wind_speed_m_s == speed);
            its.map(|cycle| cycle.amplitude_deg)
        };
        let measured = self.damping.iter().map(|d| d.wind_speed_m_s);
        let foretold = self.limit_cycle.iter().map(|l| l.wind_speed_m_s);
        let foretold = foretold.filter(|speed| measured.clone().all(|m| m != *speed));
        let rest = self.damping.iter().map(|d| (d.wind_speed_m_s, Some(d.damping_ratio)));
        rest.chain(foretold.map(|speed| (speed, None)))
            .map(|(speed, zeta)| (speed, zeta, cycle(speed)))
            .collect()
    }
}

/// Damping ratio of small amplitudes at a wind speed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct DampingAtRest {
    /// 0: wind off.
    pub wind_speed_m_s: f64,
    /// Negative where the oscillation grows.
    pub damping_ratio: Quantity,
}

/// The oscillation that neither grows nor decays at a wind speed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LimitCycle {
    /// Above the critical one.
    pub wind_speed_m_s: f64,
    /// Of the motion.
    pub amplitude_deg: Quantity,
}

/// A release, as good as that at the highest speed, and what it would do.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct NarrowedBy {
    /// Where it is to be made.
    pub wind_speed_m_s: f64,
    /// The critical speed's standard uncertainty after it.
    pub u_m_s: f64,
}

/// Of each spring and axis whose damping falls to zero; `None` where none does.
pub(super) fn speeds(
    conditions: &[Condition],
    identified: &[Identified],
) -> Option<Vec<CriticalSpeed>> {
    let mut found = Vec::new();
    let mut seen = Vec::new();
    for on in conditions.iter().map(|c| &c.setting).filter(|s| s.wind_speed_m_s > 0.0) {
        let key = (&on.spring, on.axis, &on.at);
        if seen.contains(&key) {
            continue;
        }
        seen.push(key);
        let is_its = |c: &&Condition| (&c.setting.spring, c.setting.axis) == (&on.spring, on.axis);
        let of_rig = || conditions.iter().filter(is_its);
        let offs = of_rig().filter(|c| c.setting.wind_speed_m_s == 0.0);
        let off = on.at.reference(offs.map(|c| (c, &c.setting.at)));
        let with_wind =
            of_rig().filter(|c| c.setting.wind_speed_m_s > 0.0 && c.setting.at == on.at);
        let mut its: Vec<&Condition> = off.into_iter().chain(with_wind).collect();
        its.sort_by(|a, b| a.setting.wind_speed_m_s.total_cmp(&b.setting.wind_speed_m_s));
        found.extend(critical_speed(&its, identified));
    }
    (!found.is_empty()).then_some(found)
}

/// Of conditions of one spring, axis and setting, their speeds rising.
fn critical_speed(conditions: &[&Condition], identified: &[Identified]) -> Option<CriticalSpeed> {
    let setting = &conditions.last()?.setting;
    if conditions.len() < 3 {
        return None;
    }
    let samples = samples(conditions, identified);
    let law = DecayRate::new(&samples, conditions.len())?;
    let fastest = setting.wind_speed_m_s;
    let critical = zero(&law, REACH * fastest)?;
    let at_rest = |c: &&Condition| {
        let (speed, wn) = (c.setting.wind_speed_m_s, c.natural_frequency_rad_s.value);
        DampingAtRest {
            wind_speed_m_s: speed,
            damping_ratio: law.at(speed, 0.0).by(|rate| rate / wn),
        }
    };
    let step = round_step((ABOVE - 1.0) * critical.value / 3.0);
    let round = |from: f64, to: f64| {
        let first = (from / step).ceil().max(1.0) as i64;
        (first..).map(move |k| k as f64 * step).take_while(move |speed| *speed <= to)
    };
    let measured = conditions.iter().map(|c| c.setting.wind_speed_m_s);
    let mut above: Vec<f64> = round(critical.value, ABOVE * critical.value)
        .chain(measured.filter(|speed| *speed > critical.value))
        .collect();
    above.sort_by(f64::total_cmp);
    above.dedup();
    let largest_deg = samples.iter().map(|s| s.amplitude[0]).fold(0.0, f64::max);
    let limit_cycle = above.into_iter().filter_map(|wind_speed_m_s| {
        let amplitude_deg = law.limit_cycle_deg(wind_speed_m_s)?;
        // Next to the critical speed it is as good as anything from zero on.
        let is_known = amplitude_deg.value > INTERVAL * amplitude_deg.u;
        let is_near = amplitude_deg.value <= REACH * largest_deg;
        (is_known && is_near).then_some(LimitCycle { wind_speed_m_s, amplitude_deg })
    });
    let further = round(0.5 * critical.value, critical.value + step).filter_map(|speed| {
        let law = DecayRate::fitted(&with_another(&samples, speed), law.form)?;
        Some(NarrowedBy {
            wind_speed_m_s: speed,
            u_m_s: law.at(critical.value, 0.0).u / law.slope(critical.value).abs(),
        })
    });
    Some(CriticalSpeed {
        spring: setting.spring.clone(),
        axis: setting.axis,
        at: setting.at.clone(),
        wind_speed_m_s: critical,
        damping: conditions.iter().map(at_rest).collect(),
        terms: law.form.terms().into_iter().map(str::to_owned).collect(),
        limit_cycle: limit_cycle.collect(),
        narrowed_by: further
            .min_by(|a, b| a.u_m_s.total_cmp(&b.u_m_s))
            .filter(|best| best.u_m_s < critical.u),
    })
}

/// The decay rates of every release: of its windows, or where a method has none its one value.
fn samples(conditions: &[&Condition], identified: &[Identified]) -> Vec<Sample> {
    let releases = || conditions.iter().flat_map(|c| &c.setting.releases);
    let has_windows = releases().all(|&release| !identified[release].by_window.is_empty());
    let mut samples = Vec::new();
    for (condition, its) in conditions.iter().enumerate() {
        let setting = &its.setting;
        for &release in &setting.releases {
            let found = &identified[release];
            let sample = |amplitude, rate_1_s| Sample {
                wind_speed_m_s: setting.wind_speed_m_s,
                wind_speed_u_m_s: setting.wind_speed_u_m_s,
                amplitude,
                rate_1_s,
                release,
                condition,
                repeatability_1_s: 0.5
                    * its.damping_rad_s.u_repeatability
                    * (setting.releases.len() as f64).sqrt(),
            };
            if !has_windows {
                samples.push(sample([0.0; 2], damping_rad_s(found).by(|damping| 0.5 * damping)));
                continue;
            }
            let together = found.by_window.len().div_ceil(SAMPLES);
            for windows in found.by_window.chunks(together) {
                let (mut weights, mut sums) = (0.0, [0.0; 3]);
                for w in windows {
                    let (wn, zeta) = (w.natural_frequency_rad_s.value, w.damping_ratio);
                    let weight = (zeta.u * wn).powi(-2);
                    let a = w.amplitude_deg;
                    weights += weight;
                    let each = [a, a * a, zeta.value * wn];
                    sums.iter_mut().zip(each).for_each(|(sum, value)| *sum += weight * value);
                }
                let [a, a2, rate] = sums.map(|sum| sum / weights);
                samples.push(sample([a, a2], Quantity::new(rate, weights.powf(-0.5))));
            }
        }
    }
    samples
}

/// Where the law falls through zero at rest, no further than `reach`, with half the interval in which it is
/// within so many standard uncertainties of zero (after E. C. Fieller, J. R. Stat. Soc. B 16, 1954): with a
/// slope that is little known this ends far out, or nowhere. `None` where it is not known well enough.
fn zero(law: &DecayRate, reach: f64) -> Option<Quantity> {
    let rate = |speed: f64| law.at(speed, 0.0);
    let root = crossing(|speed| rate(speed).value, 0.0, reach)?;
    let below = |speed: f64| rate(speed).value - INTERVAL * rate(speed).u;
    let above = |speed: f64| rate(speed).value + INTERVAL * rate(speed).u;
    let from = crossing(below, 0.0, root)?;
    let to = crossing(above, root, root + 2.0 * INTERVAL * LARGEST_U * root)?;
    let u = (to - from) / (2.0 * INTERVAL);
    (u <= LARGEST_U * root).then_some(Quantity::new(root, u))
}

/// Where `of` falls through zero between the two, looked for in hundredths and then halved.
fn crossing(of: impl Fn(f64) -> f64, from: f64, to: f64) -> Option<f64> {
    let at = |k: i32| from + (to - from) * f64::from(k) / 100.0;
    let k = (0..100).find(|&k| of(at(k)) > 0.0 && of(at(k + 1)) <= 0.0)?;
    let (mut positive, mut negative) = (at(k), at(k + 1));
    for _ in 0..60 {
        let middle = 0.5 * (positive + negative);
        *(if of(middle) > 0.0 { &mut positive } else { &mut negative }) = middle;
    }
    Some(0.5 * (positive + negative))
}

/// The largest of 1, 2, 5, 10 and so on that is no larger.
fn round_step(largest: f64) -> f64 {
    let decade = 10f64.powf(largest.log10().floor());
    [5.0, 2.0].iter().map(|m| m * decade).find(|step| *step <= largest).unwrap_or(decade)
}

/// With a release as at the highest speed, at another.
fn with_another(samples: &[Sample], speed: f64) -> Vec<Sample> {
    let last = samples.last().map(|s| s.release);
    let another = samples.iter().filter(|s| Some(s.release) == last).map(|s| Sample {
        wind_speed_m_s: speed,
        wind_speed_u_m_s: s.wind_speed_u_m_s * speed / s.wind_speed_m_s,
        release: usize::MAX,
        condition: usize::MAX,
        ..*s
    });
    samples.iter().copied().chain(another).collect()
}
