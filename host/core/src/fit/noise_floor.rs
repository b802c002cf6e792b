//! What readings and the means of their blocks scatter by: noise, or the step of a quantised sensor.

use crate::fit::noise::{Colour, Spectrum};
use crate::record::{resample, Record};
use crate::statistics::{median, rms_of_sixths, rms_of_thirds};
use std::f64::consts::TAU;

/// What readings scatter by.
pub(crate) struct Noise {
    pub(crate) spectrum: Spectrum,
    pub(crate) colour: Option<Colour>,
    /// Of one reading.
    pub(crate) sample_rad: f64,
    /// Of a mean of a block of them.
    pub(crate) mean_rad: f64,
}

/// The noise of readings `kept` and of the `means` of blocks of them. `uneven`: that of readings whose clock
/// is not even, one of them and a mean. `left`: what the modes that were found leave of a reading.
pub(crate) fn noise(
    kept: &[f64],
    means: &[f64],
    block: usize,
    radians_per_sample: f64,
    uneven: Option<(f64, f64)>,
    left: f64,
) -> Noise {
    let spectrum = Spectrum::of_record(kept, radians_per_sample);
    let colour = spectrum.colour(block);
    if let Some(known) = colour {
        let mean_rad = known.mean_variance(block).sqrt();
        return Noise { spectrum, colour, sample_rad: known.sample_rad(), mean_rad };
    }
    // White noise is known best from the single samples; where the means show more, from them.
    let (sample_rad, mean) = match uneven {
        None => {
            let thirds = rms_of_thirds(kept);
            (thirds, white_floor(means, thirds, block))
        }
        Some((sample, mean)) => (sample, mean.max(rms_of_sixths(means))),
    };
    // Of forty means a cycle sixth differences leave next to nothing of the oscillation. Of a coarser record
    // they hold some of it, and what its modes leave some misfit: each is the noise or more.
    let is_fine = TAU / radians_per_sample / block as f64 >= 40.0;
    let mean_rad = if is_fine { mean } else { mean.min(left / (block as f64).sqrt()) };
    Noise { spectrum, colour, sample_rad, mean_rad }
}

/// Share of white noise that is left in means of `block` values at `rate_hz` of the curve through samples at
/// `time_s`: of a sequence as white as noise, and the same every time (a sine of a phase that grows with the
/// square).
pub(crate) fn share_of_noise(time_s: &[f64], rate_hz: f64, block: usize) -> f64 {
    let phase = |k: usize| (std::f64::consts::PI * std::f64::consts::SQRT_2 * (k * k) as f64) % TAU;
    let white: Vec<f64> = (0..time_s.len()).map(|k| phase(k).sin()).collect();
    let (_, even) = resample::uniform(time_s, &white, rate_hz);
    let means: Vec<f64> =
        even.chunks_exact(block).map(|m| m.iter().sum::<f64>() / block as f64).collect();
    let square = |y: &[f64]| y.iter().map(|y| y * y).sum::<f64>() / y.len() as f64;
    (square(&means) / square(&white)).sqrt()
}

/// Noise of a mean of `block` samples of `sample_noise` each: white, unless the means themselves show
/// another.
fn white_floor(means: &[f64], sample_noise: f64, block: usize) -> f64 {
    let white = sample_noise / (block as f64).sqrt();
    let shown = rms_of_sixths(means);
    // A difference that their scatter explains.
    if block > 1 && (shown / white - 1.0).abs() < 0.25 {
        white
    } else {
        shown
    }
}

/// The step of a quantised sensor, deg; none where a value is hardly ever read again.
fn step_deg(record: &Record) -> Option<f64> {
    let mut values = record.yaw_deg.clone();
    values.sort_unstable_by(f64::total_cmp);
    // What rounding makes of one value.
    let least = match record.measurand.is_of_angle() {
        true => 1e-6,
        false => 1e-9 * (values[values.len() - 1] - values[0]),
    };
    let mut gaps: Vec<f64> = Vec::new();
    let mut taken = 1;
    for pair in values.windows(2) {
        let gap = pair[1] - pair[0];
        if gap > least {
            taken += 1;
            gaps.push(gap);
        }
    }
    if gaps.is_empty() || values.len() < 4 * taken {
        return None;
    }
    Some(median(&mut gaps))
}

/// The rms that no model of the means goes below: a step's, where noise of a sample, in deg, does not blur
/// the steps, and means are no better than single readings.
pub(crate) fn of_steps(record: &Record, sample_noise_deg: f64) -> f64 {
    let step = step_deg(record).filter(|step| sample_noise_deg < 0.5 * step);
    step.map_or(0.0, |step| step / 12f64.sqrt())
}
