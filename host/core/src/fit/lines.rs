//! Steady lines in a reading, far above the oscillation: mains hum and its like, which means of samples would
//! fold down among the motion.

use crate::fit::noise::{periodogram, OF_RECORD};
use crate::identify::steady_line::SteadyLine;
use crate::record::Record;
use crate::statistics::median;
use std::f64::consts::{LN_2, PI, TAU};

/// `record` without `lines`.
pub(crate) fn without(record: &Record, lines: &[SteadyLine]) -> Record {
    let rows = record.time_s.iter().zip(&record.yaw_deg);
    let yaw_deg = rows.map(|(t, y)| y - lines.iter().map(|l| l.at(*t)).sum::<f64>()).collect();
    Record { yaw_deg, ..record.clone() }
}

/// The steady lines in `yaw_deg`, samples from `start_s` on every `step_s`, of an oscillation of
/// `natural_frequency_rad_s`.
pub(crate) fn steady(
    yaw_deg: &[f64],
    start_s: f64,
    step_s: f64,
    natural_frequency_rad_s: f64,
) -> Vec<SteadyLine> {
    let mut left = yaw_deg.to_vec();
    let mut lines = Vec::new();
    while lines.len() < 6 {
        // Beyond ten natural frequencies a line is none of the motion.
        let Some(bin) = strongest(&left, 10.0 * natural_frequency_rad_s * step_s) else { break };
        let line = fitted(&left, start_s, step_s, bin);
        if !is_steady(&left, start_s, step_s, &line) {
            break;
        }
        for (k, y) in left.iter_mut().enumerate() {
            *y -= line.at(start_s + k as f64 * step_s);
        }
        lines.push(line);
    }
    lines
}

/// The bin that stands most above its neighbourhood, beyond `from` rad/sample, if one does by far more than
/// noise reaches.
fn strongest(samples: &[f64], from: f64) -> Option<usize> {
    let power = periodogram(samples, &OF_RECORD);
    let lobe = OF_RECORD.lobe_bins.ceil() as usize;
    let first = (from / TAU * samples.len() as f64) as usize + lobe;
    let mut best: Option<(f64, usize)> = None;
    // The floor changes slowly: a median for each stretch of so many bins, and as many to each side.
    let near = 200;
    for from in (first..power.len().saturating_sub(lobe)).step_by(near) {
        let to = (from + near).min(power.len());
        let mut around =
            power[from.saturating_sub(near).max(first)..(to + near).min(power.len())].to_vec();
        if around.len() < near / 2 {
            continue;
        }
        let level = median(&mut around) / LN_2;
        for (bin, power) in power.iter().enumerate().take(to).skip(from) {
            let over = power / level;
            if over > 60.0 && best.is_none_or(|b| over > b.0) {
                best = Some((over, bin));
            }
        }
    }
    best.map(|b| b.1)
}

/// Whether every quarter of the record holds `line`, to half of its amplitude.
fn is_steady(samples: &[f64], start_s: f64, step_s: f64, line: &SteadyLine) -> bool {
    let part = samples.len() / 4;
    let turn = line.frequency_rad_s * step_s;
    let window: Vec<f64> = OF_RECORD.weights(part).collect();
    (0..4).all(|k| {
        let first = k * part;
        let samples = &samples[first..first + part];
        let own = sine(samples, &window, turn, start_s + first as f64 * step_s, step_s);
        let off = (own.cosine_deg - line.cosine_deg).hypot(own.sine_deg - line.sine_deg);
        off < 0.5 * line.amplitude_deg()
    })
}

/// The sine of most power within a bin of `bin`.
fn fitted(samples: &[f64], start_s: f64, step_s: f64, bin: usize) -> SteadyLine {
    let golden = 0.618_033_988_749_895;
    let bin_turn = TAU / samples.len() as f64;
    let window: Vec<f64> = OF_RECORD.weights(samples.len()).collect();
    let power = |turn: f64| sine(samples, &window, turn, start_s, step_s).amplitude_deg();
    // The main lobe has one top: golden section.
    let (mut low, mut high) = ((bin as f64 - 1.0) * bin_turn, (bin as f64 + 1.0) * bin_turn);
    while high - low > 1e-4 * bin_turn {
        let (a, b) = (high - golden * (high - low), low + golden * (high - low));
        if power(a) > power(b) {
            high = b;
        } else {
            low = a;
        }
    }
    sine(samples, &window, (0.5 * (low + high)).min(PI), start_s, step_s)
}

/// The sine of `turn` rad/sample in `samples`, as their `window` shows it.
fn sine(samples: &[f64], window: &[f64], turn: f64, start_s: f64, step_s: f64) -> SteadyLine {
    let n = samples.len() as f64;
    let middle = samples.iter().sum::<f64>() / n;
    let (mut cosine, mut sine, mut sum) = (0.0, 0.0, 0.0);
    for (k, (y, w)) in samples.iter().zip(window).enumerate() {
        let (sin, cos) = (turn * k as f64 % TAU).sin_cos();
        cosine += w * (y - middle) * cos;
        sine += w * (y - middle) * sin;
        sum += w;
    }
    let (cosine, sine) = (2.0 * cosine / sum, 2.0 * sine / sum);
    // From the first sample to the record's zero of time.
    let frequency_rad_s = turn / step_s;
    let (sin, cos) = (frequency_rad_s * start_s).sin_cos();
    SteadyLine {
        frequency_rad_s,
        cosine_deg: cosine * cos - sine * sin,
        sine_deg: sine * cos + cosine * sin,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};
    use rand_distr::StandardNormal;

    fn record(hum: impl Fn(f64) -> f64, seed: u64) -> Record {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        let time_s: Vec<f64> = (0..20_000).map(|k| 3.0 + f64::from(k) * 1e-3).collect();
        let swing = |t: f64| 10.0 * (-0.05 * t).exp() * (6.5 * t).cos();
        let yaw_deg = time_s
            .iter()
            .map(|t| swing(*t) + hum(*t) + 0.03 * rng.sample::<f64, _>(StandardNormal))
            .collect();
        Record::new("r", time_s, yaw_deg)
    }

    #[test]
    fn hum_is_found_and_taken_out_and_noise_and_bursts_are_left() {
        let hum = |t: f64| 0.08 * (TAU * 50.02 * t + 1.0).sin() + 0.02 * (TAU * 150.06 * t).cos();
        let with = record(hum, 1);
        let lines = steady(&with.yaw_deg, with.time_s[0], 1e-3, 6.5);
        let found: Vec<f64> = lines.iter().map(|l| l.frequency_rad_s / TAU).collect();
        assert_eq!(lines.len(), 2, "{found:?}");
        assert!((found[0] - 50.02).abs() < 2e-3 && (found[1] - 150.06).abs() < 2e-3, "{found:?}");
        let clean = record(|_| 0.0, 1);
        let left = without(&with, &lines).yaw_deg;
        let worst = left.iter().zip(&clean.yaw_deg).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(worst < 0.005, "{worst}");
        for seed in 2..12 {
            let noise = record(|_| 0.0, seed);
            assert_eq!(steady(&noise.yaw_deg, 3.0, 1e-3, 6.5), []);
        }
        // A part of the structure that rings for a second after the release is no steady line.
        let rings = record(|t| 0.5 * (3.0 - t).exp() * (TAU * 40.0 * t).sin(), 12);
        assert_eq!(steady(&rings.yaw_deg, 3.0, 1e-3, 6.5), []);
    }
}
