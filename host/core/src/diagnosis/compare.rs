//! Where a model fails: over time, amplitude, the phase plane and frequency.

use crate::fit::fitting::Fitted;
use crate::fit::free_decay::FreeDecay;
use crate::fit::structure::{WN, ZETA};
use crate::quantity::Quantity;
use crate::record::Measurand;
use crate::spectrum::power;
use crate::statistics::rms;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;
use std::ops::Range;

/// From zero to the largest angle or rate; of a cut on each side of zero.
const AMPLITUDE_BINS: usize = 8;
/// Cells of the phase plane on each side of zero.
const PHASE_CELLS: i32 = 4;

/// Residual (record less model) where it is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Where {
    /// Along the release, of equal length.
    pub time: Vec<TimeBin>,
    /// By the envelope of the oscillation.
    pub amplitude: Vec<AmplitudeBin>,
    /// Mean missing moment over yaw angle and yaw rate.
    pub phase: Vec<PhaseCell>,
    /// The missing moment at zero yaw against yaw rate: the damping law that is missing.
    pub damping_law: Vec<DampingPoint>,
    /// The missing moment at zero rate against yaw: the stiffness law that is missing.
    pub stiffness_law: Vec<StiffnessPoint>,
    /// What the record's noise alone makes of a point of those two laws, typically: its standard deviation.
    #[serde(default)]
    pub noise_rad_s2: f64,
    /// Power spectrum of the residual, shares that add up to 1 at most.
    pub frequency: Vec<FrequencyBin>,
    /// Lag-one correlation of the residual's block means: 0 for white.
    pub correlation: f64,
    /// Two standard deviations of the correlation of as many white residuals.
    pub correlation_of_white: f64,
}

/// Residual between two times.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TimeBin {
    /// Beginning of the bin, from the release.
    pub from_s: f64,
    /// End of the bin, from the release.
    pub to_s: f64,
    /// Of the residual of block means.
    pub rms_deg: f64,
}

/// Residual where the envelope lies between `from_deg` and `to_deg`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct AmplitudeBin {
    /// Smallest amplitude of the bin.
    pub from_deg: f64,
    /// Largest amplitude of the bin.
    pub to_deg: f64,
    /// Of the residual of block means.
    pub rms_deg: f64,
}

/// A cell of the plane of yaw angle and yaw rate.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PhaseCell {
    /// Middle of the cell.
    pub yaw_deg: f64,
    /// Middle of the cell.
    pub rate_deg_s: f64,
    /// b'' of the record less that of the model at the same state.
    pub moment_rad_s2: f64,
}

/// At zero yaw, mean over the passages with about this rate.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct DampingPoint {
    /// Yaw rate of the passages.
    pub rate_deg_s: f64,
    /// Missing moment over Izz; of the sign of the rate where it drives the motion.
    pub moment_rad_s2: f64,
    /// Standard uncertainty of the moment.
    pub u_rad_s2: f64,
}

/// At zero rate, mean over the turning points at about this angle.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct StiffnessPoint {
    /// Yaw angle of the turning points.
    pub yaw_deg: f64,
    /// Missing moment over Izz; of the sign of the angle where it takes stiffness away.
    pub moment_rad_s2: f64,
    /// Standard uncertainty of the moment.
    pub u_rad_s2: f64,
}

/// Share of the residual's power about `hz`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct FrequencyBin {
    /// Middle of the bin.
    pub hz: f64,
    /// Power in the bin over that of the whole residual, 0 to 1.
    pub share: f64,
    /// Power in the bin over that of white noise of the record's size.
    #[serde(default)]
    pub over_noise: f64,
}

/// Where `model` fails on `decay`. Rms of block means, deg.
///
/// ```
/// use yawrig_core::diagnosis::compare::locate;
/// use yawrig_core::fit::{fitting::fit_plain, free_decay::FreeDecay};
/// use yawrig_core::record::Record;
///
/// // A zero that drifts: the residual is largest at the ends of the record.
/// let time_s: Vec<f64> = (0..6000).map(|k| f64::from(k) / 300.0).collect();
/// let yaw_deg =
///     time_s.iter().map(|t| 12.0 * (-0.06 * t).exp() * (6.0 * t).cos() + 0.1 * t).collect();
/// let decay = FreeDecay::from_record(&Record::new("mine", time_s, yaw_deg))?;
/// let found = locate(&decay, &fit_plain(&decay, false, decay.yaw_rad.len()));
/// assert!(found.time.last().unwrap().rms_deg > 0.5);
/// # Ok::<(), yawrig_core::error::Error>(())
/// ```
pub fn locate(decay: &FreeDecay, model: &Fitted) -> Where {
    locate_within(decay, model, 0..model.residuals.len())
}

/// The same over some of the block means; the correlation stays that of all.
pub fn locate_within(decay: &FreeDecay, model: &Fitted, part: Range<usize>) -> Where {
    let (yaw, rate) = model.motion().of_angle().readings_and_rates(&decay.grid);
    let (yaw, rate) = (&yaw[part.clone()], &rate[part.clone()]);
    let wn = model.parameters[WN];
    let residual: Vec<f64> = model.residuals[part.clone()].iter().map(|r| -r).collect();
    // Of a rate or an acceleration the residual shows no moment but by integration.
    let states = match decay.measurand.shows_rest() {
        true => missing_moments(decay, model, &residual, yaw, rate),
        false => Vec::new(),
    };
    let (b_max, r_max) = (largest(yaw), largest(rate));
    let damping = cut(&states, r_max, |s| (s.yaw_rad * wn, s.rate_rad_s));
    let stiffness = cut(&states, b_max, |s| (s.rate_rad_s / wn, s.yaw_rad));
    let mut passages: Vec<usize> =
        damping.iter().chain(&stiffness).map(|point| point.passages).collect();
    passages.sort_unstable();
    let typical = passages.get(passages.len() / 2).map_or(f64::INFINITY, |n| *n as f64);
    let start_s = decay.grid.time_s(part.start);
    let measurand = &decay.measurand;
    Where {
        time: time(decay, start_s, &residual),
        amplitude: amplitude(measurand, &residual, yaw, rate, wn),
        damping_law: damping
            .into_iter()
            .map(|Along { along, moment, .. }| DampingPoint {
                rate_deg_s: measurand.shown(along),
                moment_rad_s2: moment.value,
                u_rad_s2: moment.u,
            })
            .collect(),
        stiffness_law: stiffness
            .into_iter()
            .map(|Along { along, moment, .. }| StiffnessPoint {
                yaw_deg: measurand.shown(along),
                moment_rad_s2: moment.value,
                u_rad_s2: moment.u,
            })
            .collect(),
        noise_rad_s2: noise_of_moment(decay, model) / typical.sqrt(),
        phase: phase(measurand, &states, b_max, r_max),
        frequency: frequency(decay, &residual),
        correlation: model.correlation,
        correlation_of_white: 2.0 / (model.count as f64).sqrt(),
    }
}

fn time(decay: &FreeDecay, start_s: f64, residual: &[f64]) -> Vec<TimeBin> {
    let width = residual.len().div_ceil(20).max(1);
    residual
        .chunks(width)
        .enumerate()
        .map(|(i, chunk)| TimeBin {
            from_s: start_s + decay.grid.step_s * (i * width) as f64,
            to_s: start_s + decay.grid.step_s * (i * width + chunk.len()) as f64,
            rms_deg: decay.measurand.shown(rms(chunk.iter().copied())),
        })
        .collect()
}

fn amplitude(
    measurand: &Measurand,
    residual: &[f64],
    yaw: &[f64],
    rate: &[f64],
    wn: f64,
) -> Vec<AmplitudeBin> {
    let size: Vec<f64> = yaw.iter().zip(rate).map(|(b, r)| b.hypot(r / wn)).collect();
    let largest = largest(&size);
    let edge = |k: usize| largest * k as f64 / AMPLITUDE_BINS as f64;
    (0..AMPLITUDE_BINS)
        .filter_map(|k| {
            let inside = |a: f64| a > edge(k) && a <= edge(k + 1);
            let values = residual.iter().zip(&size).filter(|(_, a)| inside(**a)).map(|(r, _)| *r);
            let bin = AmplitudeBin {
                from_deg: measurand.shown(edge(k)),
                to_deg: measurand.shown(edge(k + 1)),
                rms_deg: measurand.shown(rms(values)),
            };
            (!bin.rms_deg.is_nan()).then_some(bin)
        })
        .collect()
}

/// The missing moment at a state of the model.
struct Missing {
    yaw_rad: f64,
    rate_rad_s: f64,
    moment_rad_s2: f64,
}

/// How a missing moment comes from the residuals about an instant: the residual e obeys e'' + 2 zeta wn e' +
/// wn^2 e = missing moment, with e, e' and e'' from a local parabola over so much of a cycle to either side.
fn weights(decay: &FreeDecay, model: &Fitted) -> Vec<f64> {
    let (wn, zeta) = (model.parameters[WN], model.parameters[ZETA]);
    let h = decay.grid.step_s;
    let half = ((0.12 * decay.per_cycle()) as usize).max(1);
    let k: Vec<f64> = (0..=2 * half).map(|i| i as f64 - half as f64).collect();
    let n = k.len() as f64;
    let (s2, s4) = k.iter().fold((0.0, 0.0), |(a, b), x| (a + x * x, b + x.powi(4)));
    let weight = |x: &f64| {
        let curve = (n * x * x - s2) / (n * s4 - s2 * s2);
        let level = (1.0 - curve * s2) / n;
        2.0 * curve / (h * h) + 2.0 * zeta * wn * x / s2 / h + wn * wn * level
    };
    k.iter().map(weight).collect()
}

/// Standard deviation that the record's noise alone gives the missing moment at an instant. Those of one
/// passage through a line of the phase plane are nearly one.
fn noise_of_moment(decay: &FreeDecay, model: &Fitted) -> f64 {
    decay.noise_rad * weights(decay, model).iter().map(|w| w * w).sum::<f64>().sqrt()
}

fn missing_moments(
    decay: &FreeDecay,
    model: &Fitted,
    residual: &[f64],
    yaw: &[f64],
    rate: &[f64],
) -> Vec<Missing> {
    let weights = weights(decay, model);
    let half = weights.len() / 2;
    if residual.len() <= 2 * half {
        return Vec::new();
    }
    let at = |i: usize| {
        let about = &residual[i - half..=i + half];
        let moment = weights.iter().zip(about).map(|(w, e)| w * e).sum();
        Missing { yaw_rad: yaw[i], rate_rad_s: rate[i], moment_rad_s2: moment }
    };
    (half..residual.len() - half).map(at).collect()
}

/// Means in the cells of the plane.
fn phase(measurand: &Measurand, states: &[Missing], b_max: f64, r_max: f64) -> Vec<PhaseCell> {
    if b_max == 0.0 || r_max == 0.0 {
        return Vec::new();
    }
    let side = 2 * PHASE_CELLS + 1;
    let mut sums = vec![(0.0, 0.0); (side * side) as usize];
    for s in states {
        let b = cell(s.yaw_rad, b_max, PHASE_CELLS) + PHASE_CELLS;
        let r = cell(s.rate_rad_s, r_max, PHASE_CELLS) + PHASE_CELLS;
        let sum = &mut sums[(b * side + r) as usize];
        *sum = (sum.0 + 1.0, sum.1 + s.moment_rad_s2);
    }
    let width = f64::from(PHASE_CELLS) + 0.5;
    (0..side * side)
        .filter(|at| sums[*at as usize].0 >= 3.0)
        .map(|at| PhaseCell {
            yaw_deg: measurand.shown(f64::from(at / side - PHASE_CELLS) / width * b_max),
            rate_deg_s: measurand.shown(f64::from(at % side - PHASE_CELLS) / width * r_max),
            moment_rad_s2: sums[at as usize].1 / sums[at as usize].0,
        })
        .collect()
}

/// Which of `cells` on each side of zero `x` falls in, -most to most being all of them.
fn cell(x: f64, most: f64, cells: i32) -> i32 {
    ((x / most * (f64::from(cells) + 0.5)).round() as i32).clamp(-cells, cells)
}

/// A point of a cut.
struct Along {
    along: f64,
    moment: Quantity,
    passages: usize,
}

/// Moment along a line through the plane, where the first coordinate of `split` is about zero, against the
/// second: means over the passages through the line, and their standard uncertainties from the passages'
/// scatter.
fn cut(states: &[Missing], along_max: f64, split: impl Fn(&Missing) -> (f64, f64)) -> Vec<Along> {
    let inside = |s: &Missing| {
        let (across, along) = split(s);
        // The tangent of the angle from the line, in the plane.
        across.abs() < 0.25 * along.abs()
    };
    let most = AMPLITUDE_BINS as i32;
    let mut cells = vec![Vec::<(f64, f64)>::new(); 2 * AMPLITUDE_BINS + 1];
    for passage in states.chunk_by(|a, b| inside(a) == inside(b)).filter(|c| inside(&c[0])) {
        let n = passage.len() as f64;
        let along = passage.iter().map(|s| split(s).1).sum::<f64>() / n;
        let moment = passage.iter().map(|s| s.moment_rad_s2).sum::<f64>() / n;
        cells[(cell(along, along_max, most) + most) as usize].push((along, moment));
    }
    let mean = |passages: Vec<(f64, f64)>| {
        let n = passages.len() as f64;
        let along = passages.iter().map(|p| p.0).sum::<f64>() / n;
        let moment = passages.iter().map(|p| p.1).sum::<f64>() / n;
        let scatter = passages.iter().map(|p| (p.1 - moment).powi(2)).sum::<f64>() / (n - 1.0);
        let moment = Quantity::new(moment, (scatter / n).sqrt());
        Along { along, moment, passages: passages.len() }
    };
    cells.into_iter().filter(|passages| passages.len() >= 2).map(mean).collect()
}

fn largest(values: &[f64]) -> f64 {
    values.iter().filter(|v| v.is_finite()).fold(0.0, |m, v| m.max(v.abs()))
}

fn frequency(decay: &FreeDecay, residual: &[f64]) -> Vec<FrequencyBin> {
    let n = residual.len();
    let power = power(residual.to_vec());
    let total: f64 = power.iter().sum::<f64>().max(f64::MIN_POSITIVE);
    // Of white noise, in each of these.
    let square = residual.iter().map(|e| e * e).sum::<f64>() / n as f64;
    let noise = total * decay.noise_rad.powi(2) / square / power.len() as f64;
    let spacing = 1.0 / (n as f64 * decay.grid.step_s);
    // Four bins from each harmonic to the next, up to the sixth.
    let bins = 24;
    let width = 6.0 * decay.frequency_rad_s / TAU / bins as f64;
    (0..bins)
        .map(|k| {
            let inside = |i: &usize| (*i as f64 * spacing / width) as usize == k;
            let inside = || (0..power.len()).filter(inside).map(|i| power[i]);
            let (sum, count) = (inside().sum::<f64>(), inside().count());
            FrequencyBin {
                hz: (k as f64 + 0.5) * width,
                share: sum / total,
                over_noise: if count > 0 { sum / (count as f64 * noise) } else { 0.0 },
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::fitting::fit_plain;
    use crate::record::Record;
    use rand::SeedableRng;
    use rand_distr::{Distribution, Normal};

    /// A damped mode with white noise, of which a second-order model leaves the noise alone.
    fn noisy(seed: u64) -> Where {
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        let noise = Normal::new(0.0, 0.05).unwrap();
        let time_s: Vec<f64> = (0..15_000).map(|k| f64::from(k) / 500.0).collect();
        let yaw = |t: &f64| 12.0 * (-0.05 * t).exp() * (6.0 * t).cos() + noise.sample(&mut random);
        let yaw_deg = time_s.iter().map(yaw).collect();
        let decay = FreeDecay::from_record(&Record::new("noisy", time_s, yaw_deg)).unwrap();
        locate(&decay, &fit_plain(&decay, false, decay.yaw_rad.len()))
    }

    #[test]
    fn what_is_left_of_noise_is_as_large_as_it_is_said_to_be() {
        let all: Vec<Where> = (1..=20).map(noisy).collect();
        // 24 bins of some seven frequencies each: 480 means of a sum that is 1 on average, deviation 0.02.
        let powers: Vec<f64> =
            all.iter().flat_map(|w| &w.frequency).map(|f| f.over_noise).collect();
        let mean = powers.iter().sum::<f64>() / powers.len() as f64;
        assert!((mean - 1.0).abs() < 0.08, "{mean}");
        // Points of the laws in units of it, whose passages are not equally many and not quite independent.
        let points = all.iter().flat_map(|w| {
            let damping = w.damping_law.iter().map(|p| p.moment_rad_s2);
            let stiffness = w.stiffness_law.iter().map(|p| p.moment_rad_s2);
            damping.chain(stiffness).map(|m| m / w.noise_rad_s2).collect::<Vec<_>>()
        });
        let points: Vec<f64> = points.collect();
        let within = points.iter().filter(|m| m.abs() < 2.0).count();
        let size = rms(points.iter().copied());
        assert!((0.7..1.4).contains(&size), "{size}");
        assert!(within as f64 > 0.88 * points.len() as f64, "{within} of {}", points.len());
    }
}
