//! The conventional method of the thesis (3.4 and 3.5): spectrum and time to half amplitude.
//!
//! 10 Hz low-pass, amplitude window, damped frequency at the highest bin of the power spectral density (plain
//! periodogram of the window, filled up with zeros to a power of two: 16384 at 1 kHz puts a bin at the 23.39
//! rad/s of the thesis's Table 4.7), one maximum a cycle, a fifth-degree polynomial through them, the time at
//! which it has fallen to half, and (3.23) to (3.25). Two options replace its weak points: the bin by an
//! interpolated peak, the half amplitude by a regression over all maxima.

use super::flag::Flag;
use super::lowpass;
pub use super::settings::{Conventional as Options, Decay, SpectralPeak};
use super::uncertainty::Lacking;
use super::{Prepared, Values};
use crate::quantity::Quantity;
use crate::spectrum::Periodogram;
use nalgebra::{DMatrix, DVector};
use std::f64::consts::{LN_2, TAU};
use yawrig_shared::modal::Modal;

/// Corner of the low-pass, thesis 3.5 step 1.
const CORNER_HZ: f64 = 10.0;
/// Above this the low-pass takes more than one percent of the oscillation.
const HIGHEST_HZ: f64 = 5.7;
/// Degree of the polynomial through the maxima, thesis 3.4.3.
const DEGREE: usize = 5;
/// How far the window is filled up with zeros for an interpolated peak.
const FILLED: usize = 4;

/// The method on a prepared record; why not in words.
pub(crate) fn values(prepared: &Prepared<'_>) -> Result<Values, String> {
    let options = prepared.settings.conventional;
    let mut flags = Vec::new();
    let rate_hz = prepared.samples.rate_hz();
    let even = prepared.evenly_sampled(rate_hz, &mut flags)?;
    let filtered = match lowpass::zero_phase(&even.yaw_deg, rate_hz, CORNER_HZ) {
        Some(filtered) => filtered,
        None => {
            flags.push(Flag::LowPassNotApplied);
            even.yaw_deg.clone()
        }
    };
    let from = even.time_s.partition_point(|&t| t < prepared.span.from_s);
    let to = even.time_s.partition_point(|&t| t < prepared.span.to_s);
    let (time, yaw) = (&even.time_s[from..to], &filtered[from..to]);
    let step_s = 1.0 / rate_hz;

    let frequency_hz = damped_frequency(yaw, step_s, options.spectral_peak)
        .ok_or("no peak in the power spectral density")?;
    if frequency_hz.value > HIGHEST_HZ && !flags.contains(&Flag::LowPassNotApplied) {
        flags.push(Flag::LowPassTooNear);
    }
    let peaks = maxima(time, yaw, 1.0 / frequency_hz.value);
    let half_life_s = match options.decay {
        Decay::HalfAmplitude => {
            // White noise after the low-pass, twice its corner of the whole band.
            let passed = (2.0 * CORNER_HZ / rate_hz).min(1.0).sqrt();
            half_amplitude(&peaks, passed * prepared.noise_rms_deg())?
        }
        Decay::Regression => regression(&peaks)?,
    };
    let modal = Modal::from_damped_frequency_and_half_life(frequency_hz.value, half_life_s.value);
    let (wn, zeta) = (modal.natural_frequency_rad_s, modal.damping_ratio);
    // wn^2 = wd^2 + s^2 and zeta = s/wn, with s = ln 2 / t_half.
    let (u_wd, u_s) = (TAU * frequency_hz.u, LN_2 * half_life_s.u / half_life_s.value.powi(2));
    let wd = TAU * frequency_hz.value;
    Ok(Values {
        natural_frequency_rad_s: Quantity::new(wn, (wd / wn * u_wd).hypot(zeta * u_s)),
        damping_ratio: Quantity::new(zeta, (u_s / wn).hypot(zeta / wn * u_wd)),
        windows: Vec::new(),
        at_amplitude: Vec::new(),
        flags,
        cramer_rao: None,
        lacking: Lacking::default(),
    })
}

/// Damped frequency in Hz. Its uncertainty is that of the bin, or of the peak of a fine spectrum.
fn damped_frequency(yaw: &[f64], step_s: f64, peak: SpectralPeak) -> Option<Quantity> {
    let length = match peak {
        SpectralPeak::Plain => yaw.len(),
        SpectralPeak::Interpolated => FILLED * yaw.len(),
    };
    let periodogram = Periodogram::new(yaw, step_s, length);
    let bin = periodogram.strongest_bin(&(0.0..=f64::INFINITY), |_, _| 1.0)?;
    // Anywhere within half a bin: a rectangular distribution.
    let width = periodogram.resolution_hz / 12.0_f64.sqrt();
    Some(match peak {
        SpectralPeak::Plain => Quantity::new(periodogram.frequency_hz(bin), width),
        SpectralPeak::Interpolated => Quantity::new(periodogram.interpolated_hz(bin), width),
    })
}

/// A maximum of the angle above the middle of its cycle.
#[derive(Clone, Copy, Debug)]
struct Peak {
    time_s: f64,
    amplitude_deg: f64,
}

/// The largest value of each cycle, a cycle being what lies between two rising passages through the middle.
/// Of the parts before the first and after the last passage those count that must hold a maximum.
fn maxima(time: &[f64], yaw: &[f64], period: f64) -> Vec<Peak> {
    let mean = yaw.iter().sum::<f64>() / yaw.len() as f64;
    let mut ends: Vec<usize> = Vec::new();
    for k in 1..yaw.len() {
        let rises = yaw[k - 1] < mean && yaw[k] >= mean;
        if rises && ends.last().is_none_or(|&last| time[k] - time[last] > 0.6 * period) {
            ends.push(k);
        }
    }
    let (Some(&first), Some(&last)) = (ends.first(), ends.last()) else { return Vec::new() };
    if time[first] - time[0] > 0.75 * period {
        ends.insert(0, 0);
    }
    if time[yaw.len() - 1] - time[last] > 0.3 * period {
        ends.push(yaw.len());
    }
    let extremes: Vec<(usize, f64, f64)> = ends
        .windows(2)
        .map(|w| {
            let cycle = &yaw[w[0]..w[1]];
            let lowest = cycle.iter().copied().fold(f64::INFINITY, f64::min);
            let (at, &highest) =
                cycle.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1)).expect("not empty");
            (w[0] + at, highest, lowest)
        })
        .collect();
    // A maximum, twice the minimum after it and the next maximum: their mean is the middle also of a fast
    // decay.
    let middles: Vec<f64> =
        extremes.windows(2).map(|w| 0.25 * (w[0].1 + 2.0 * w[0].2 + w[1].1)).collect();
    let middle = middles.iter().sum::<f64>() / middles.len() as f64;
    extremes
        .into_iter()
        .map(|(at, high, _)| Peak { time_s: time[at], amplitude_deg: high - middle })
        .filter(|p| p.amplitude_deg > 0.0)
        .collect()
}

/// Time to half amplitude in s of the polynomial through the maxima, by interpolation; each maximum is known
/// to `noise_deg` at best.
fn half_amplitude(peaks: &[Peak], noise_deg: f64) -> Result<Quantity, String> {
    let n = peaks.len();
    if n < 3 {
        return Err(format!("{n} maxima are too few for a decay"));
    }
    let (first, last) = (peaks[0].time_s, peaks[n - 1].time_s);
    let degree = DEGREE.min(n - 1);
    let row = |t: f64| {
        let x = 2.0 * (t - first) / (last - first) - 1.0;
        DVector::from_fn(degree + 1, |i, _| x.powi(i as i32))
    };
    let design = DMatrix::from_fn(n, degree + 1, |k, i| row(peaks[k].time_s)[i]);
    let values = DVector::from_iterator(n, peaks.iter().map(|p| p.amplitude_deg));
    let svd = design.clone().svd(true, true);
    let coefficients = svd.solve(&values, 1e-12).map_err(str::to_owned)?;
    let at = |t: f64| coefficients.dot(&row(t));
    let half = 0.5 * at(first);
    let steps = 2000;
    let time = |i: usize| first + (last - first) * i as f64 / steps as f64;
    let below = (1..=steps)
        .find(|&i| at(time(i)) <= half)
        .ok_or("the amplitude does not fall to half inside the window; a regression over all maxima needs no such fall")?;
    let (mut a, mut b) = (time(below - 1), time(below));
    for _ in 0..60 {
        let middle = 0.5 * (a + b);
        if at(middle) > half {
            a = middle
        } else {
            b = middle
        }
    }
    let half_life = 0.5 * (a + b) - first;
    // The polynomial's own error at the two places, carried to the time by its slope.
    let freedom = (n - degree - 1).max(1);
    let misfit = (&design * &coefficients - values).norm_squared() / freedom as f64;
    let variance = misfit.max(noise_deg * noise_deg);
    let contrast = row(a) - row(first) * 0.5;
    let inverse = (design.transpose() * design).try_inverse().ok_or("the maxima coincide")?;
    let h = 1e-4 * (last - first);
    let slope = (at(a + h) - at(a - h)) / (2.0 * h);
    let u = (variance * contrast.dot(&(inverse * &contrast))).sqrt() / slope.abs();
    Ok(Quantity::new(half_life, u))
}

/// ln 2 over the slope of a straight line through the logarithms of the maxima, s.
fn regression(peaks: &[Peak]) -> Result<Quantity, String> {
    let n = peaks.len() as f64;
    if peaks.len() < 3 {
        return Err(format!("{n} maxima are too few for a decay"));
    }
    let x0 = peaks.iter().map(|p| p.time_s).sum::<f64>() / n;
    let y0 = peaks.iter().map(|p| p.amplitude_deg.ln()).sum::<f64>() / n;
    let xx: f64 = peaks.iter().map(|p| (p.time_s - x0).powi(2)).sum();
    let xy: f64 = peaks.iter().map(|p| (p.time_s - x0) * (p.amplitude_deg.ln() - y0)).sum();
    let slope = xy / xx;
    // The logarithm's noise grows as the amplitude falls: each maximum's own residual stands for its
    // variance.
    let scatter: f64 = peaks
        .iter()
        .map(|p| {
            let residual = p.amplitude_deg.ln() - y0 - slope * (p.time_s - x0);
            ((p.time_s - x0) * residual).powi(2)
        })
        .sum();
    let u_slope = (scatter * n / (n - 2.0)).sqrt() / xx;
    let half_life = -LN_2 / slope;
    Ok(Quantity::new(half_life, half_life.abs() * u_slope / slope.abs()))
}
