//! The free decay of a record as the fits see it: block means on an even grid, and their noise floor.

use crate::effects::Scale;
use crate::error::Result;
use crate::fit::lines;
use crate::fit::noise::{Colour, Spectrum};
use crate::fit::noise_floor;
use crate::identify::gaps::{self, Warning};
use crate::identify::outliers::exclude_spikes;
use crate::identify::samples::{Means, Samples, Stretch};
use crate::identify::steady_line::SteadyLine;
use crate::identify::{self, Begin, End, Settings, WindowEstimate};
use crate::motion::simulate::Grid;
use crate::record::{resample, Derivative, Measurand, Record};
use crate::statistics::rms_of_uneven_sixths;
use crate::stop::Stop;
use std::borrow::Cow;
use std::f64::consts::TAU;
use std::sync::Arc;

/// Block means per cycle: those on which residual and noise floor are compared.
pub(crate) const MEANS_PER_CYCLE: f64 = 50.0;

/// Block means of a long release's beginning, for speed alone: what simulates a release for each guess is asked of
/// as many first. They are four hundred cycles, four times what pieces have together, or more where a cycle has
/// fewer than [`MEANS_PER_CYCLE`] samples.
pub(crate) const BEGINNING: usize = 20_000;

/// `record` with so many samples a second, and the samples it is made of where they did not come evenly.
fn evenly(record: &Record, rate_hz: f64) -> Result<(Cow<'_, Record>, Option<Record>)> {
    let mut samples = Samples::new(&record.time_s, &record.yaw_deg);
    if samples.is_uniform() {
        return Ok((Cow::Borrowed(record), None));
    }
    // A wild sample would bend the curve through its neighbours.
    exclude_spikes(&mut samples);
    let taken = samples.all().record(record);
    Ok((Cow::Owned(taken.resampled(rate_hz)?), Some(taken)))
}

/// `means` of `stretch` on their even grid: where samples are left out, a mean may lie off it, or be missing.
fn even(means: Means, stretch: &Stretch<'_>, step_s: f64) -> Means {
    if !stretch.excluded.contains(&true) || means.len() < 4 {
        return means;
    }
    let (time_s, yaw_deg) = resample::uniform(&means.time_s, &means.yaw_deg, 1.0 / step_s);
    Means { time_s, yaw_deg, ..means }
}

/// The readings of `stretch`, the last one that counts in place of those left out.
fn smooth(stretch: &Stretch<'_>) -> Vec<f64> {
    let mut last = stretch.yaw_deg[0];
    let rows = stretch.yaw_deg.iter().zip(stretch.excluded);
    let taken = rows.map(|(y, excluded)| {
        if !excluded {
            last = *y;
        }
        last
    });
    taken.collect()
}

/// Everything between release and rest.
fn settings() -> Settings {
    Settings { from_deg: 360.0, to_deg: 1e-3, ..Settings::default() }
}

/// What a motion, or what is known of it, depends on that is no number of its model.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Around {
    /// For own effects; 0: off, or not known.
    pub(crate) wind_speed_m_s: f64,
    /// What is recorded of it.
    pub(crate) observed: Derivative,
    /// Standard uncertainty of the record's clock rate, as a share of it.
    pub(crate) rate_u: f64,
}

/// A free decay. Angles in rad, time from the release in s. Of another measurand what is read is in its own
/// unit (of a rate rad/s), and the motion's coordinate takes the angle's place.
#[derive(Clone, Debug)]
pub struct FreeDecay {
    /// Instants of the block means.
    pub grid: Grid,
    /// Block means of the reading, with the sensor's zero in it.
    pub yaw_rad: Vec<f64>,
    /// Means before the last cycle, where dry friction takes all of the amplitude in it.
    pub(crate) smooth: usize,
    /// Samples in a mean.
    pub block: usize,
    /// Noise of one mean.
    pub noise_rad: f64,
    /// Noise of one sample.
    pub sample_noise_rad: f64,
    /// Of the samples, between the harmonics.
    pub(crate) spectrum: Arc<Spectrum>,
    /// The noise where it is correlated from sample to sample.
    pub(crate) colour: Option<Colour>,
    /// Of the oscillation, about; from the identification.
    pub frequency_rad_s: f64,
    /// Largest amplitude of the motion, at the beginning.
    pub amplitude_rad: f64,
    /// What is read of the motion.
    pub measurand: Measurand,
    /// Standard uncertainty of the record's clock rate, as a share of it: frequencies have it, too.
    pub(crate) rate_u: f64,
    /// Instant of the release, on the record's own clock.
    pub release_time_s: f64,
    /// How the free motion begins, and how what is fitted of it ends.
    pub begins: Begin,
    /// See there.
    pub ends: End,
    /// For own effects that depend on it; 0: off, or not known.
    pub wind_speed_m_s: f64,
    /// wn and zeta over three cycles each: the amplitude picture.
    pub windows: Vec<WindowEstimate>,
    /// Steady lines that are taken out of the reading.
    pub lines: Vec<SteadyLine>,
    /// What was done about samples that are missing, and about lines.
    pub warnings: Vec<Warning>,
    /// Fits to it end when this asks for it.
    pub stop: Stop,
}

impl FreeDecay {
    /// Phase of the oscillation at the first `count` means, about: what the windows' frequencies add up to.
    pub(crate) fn phase_rad(&self, count: usize) -> Vec<f64> {
        let times: Vec<f64> = self.windows.iter().map(|w| w.time_s - self.release_time_s).collect();
        let frequency = |t: f64| {
            let next = times.partition_point(|known| *known < t);
            let [below, above] = [next.saturating_sub(1), next.min(times.len() - 1)];
            let [a, b] = [below, above].map(|k| self.windows[k].natural_frequency_rad_s);
            match times[above] > times[below] {
                true => {
                    a + (b - a)
                        * ((t - times[below]) / (times[above] - times[below])).clamp(0.0, 1.0)
                }
                false => a,
            }
        };
        let mut phase_rad = 0.0;
        let of = |k: usize| {
            phase_rad += frequency(self.grid.time_s(k)) * self.grid.step_s;
            phase_rad
        };
        (0..count).map(of).collect()
    }

    /// Everything between release and rest.
    ///
    /// # Errors
    /// Naming the file: no oscillation in it, or fewer than three cycles.
    pub fn from_record(record: &Record) -> Result<Self> {
        Self::of_reading(record, Vec::new())
    }

    /// The same of `record`, from which `lines` are taken out already.
    fn of_reading(record: &Record, lines: Vec<SteadyLine>) -> Result<Self> {
        let as_read = record;
        let (record, mut warnings) = gaps::without(record);
        let rate_hz = record.timing().rate_hz;
        let (record, uneven) = evenly(&record, rate_hz)?;
        let record = &*record;
        let prepared =
            identify::prepare(record, &settings()).map_err(|refusal| refusal.of(record))?;
        let stretch = prepared.stretch();
        let frequency = prepared.span.frequency_rad_s;
        if lines.is_empty() {
            let found =
                lines::steady(&smooth(&stretch), stretch.start_s(), stretch.step_s, frequency);
            if !found.is_empty() {
                return Self::of_reading(&lines::without(as_read, &found), found);
            }
        }
        let line = |line: &SteadyLine| Warning::Line {
            record: record.file.display().to_string(),
            line: *line,
            unit: record.measurand.unit().to_owned(),
        };
        warnings.extend(lines.iter().map(line));
        let per_cycle = TAU / frequency / stretch.step_s;
        let block = (per_cycle / MEANS_PER_CYCLE).floor().max(1.0) as usize;
        let step_s = block as f64 * stretch.step_s;
        let means = even(stretch.block_means(block), &stretch, step_s);
        let release_time_s = prepared.span.release_time_s;
        let measurand = record.measurand.clone();
        let of_model = |shown: f64| measurand.of_model(shown);
        let yaw_rad: Vec<f64> = means.yaw_deg.iter().map(|y| of_model(*y)).collect();
        let grid = Grid {
            start_s: means.time_s[0] - release_time_s,
            step_s,
            count: yaw_rad.len(),
            mean_width_s: if block > 1 { step_s } else { 0.0 },
        };
        let smooth = means.time_s.partition_point(|t| *t < prepared.span.smooth_to_s);
        let kept: Vec<f64> = stretch.kept().map(|s| of_model(s.1)).collect();
        let uneven = uneven.map(|taken| {
            let sample = of_model(rms_of_uneven_sixths(&taken.time_s, &taken.yaw_deg));
            (sample, sample * noise_floor::share_of_noise(&taken.time_s, rate_hz, block))
        });
        let left = of_model(prepared.noise_rms_deg());
        let noise =
            noise_floor::noise(&kept, &yaw_rad, block, frequency * stretch.step_s, uneven, left);
        let windows = prepared.window_estimates();
        let amplitude_deg = windows.iter().map(|w| w.amplitude_deg).fold(0.0, f64::max);
        let amplitude_rad = of_model(amplitude_deg);
        let reading_rad = measurand.derivative().recorded(amplitude_rad, frequency);
        Ok(Self {
            noise_rad: noise
                .mean_rad
                .max(1e-9 * reading_rad)
                .max(of_model(noise_floor::of_steps(as_read, measurand.shown(noise.sample_rad)))),
            spectrum: noise.spectrum.into(),
            colour: noise.colour,
            sample_noise_rad: noise.sample_rad,
            grid,
            yaw_rad,
            smooth,
            block,
            frequency_rad_s: frequency,
            amplitude_rad,
            release_time_s,
            begins: prepared.span.begin,
            ends: prepared.span.end,
            wind_speed_m_s: 0.0,
            lines,
            warnings,
            stop: Stop::default(),
            windows,
            measurand,
            rate_u: record.rate_u,
        })
    }

    /// The same free decay from where the model was let go, and whether it was held before; none where it
    /// begins there already. The noise floor is kept.
    pub(crate) fn begun_at_release(&self, record: &Record) -> Option<(Self, bool)> {
        let record = &lines::without(record, &self.lines);
        let prepared = identify::prepare(record, &settings()).ok()?;
        let begin_s = self.release_time_s + self.grid.start_s;
        let all = prepared.samples.all();
        if !all.uniform || all.time_s[0] >= begin_s {
            return None;
        }
        let before = all.between(all.time_s[0], begin_s).block_means(self.block);
        let level = *before.yaw_deg.first()?;
        // A model that is held moves little.
        let still = self.measurand.shown((6.0 * self.noise_rad).max(0.03 * self.reading_rad()));
        let inside = before.yaw_deg.iter().take_while(|y| (*y - level).abs() <= still).count();
        let held = inside as f64 > 0.5 * self.per_cycle();
        let release_time_s = if held { before.time_s[inside - 1] } else { all.time_s[0] };
        // Within so small a part of a cycle the first mean is not late.
        if begin_s - release_time_s < 0.15 * self.per_cycle() * self.grid.step_s {
            return None;
        }
        // The first means after the hold may still hold some of it.
        let from_s = release_time_s + if held { 2.0 * self.grid.step_s } else { 0.0 };
        let stretch = all.between(from_s, prepared.span.to_s);
        let means = even(stretch.block_means(self.block), &stretch, self.grid.step_s);
        let yaw_rad: Vec<f64> = means.yaw_deg.iter().map(|y| self.measurand.of_model(*y)).collect();
        let grid =
            Grid { start_s: means.time_s[0] - release_time_s, count: yaw_rad.len(), ..self.grid };
        let smooth = self.smooth + yaw_rad.len() - self.yaw_rad.len();
        Some((Self { grid, yaw_rad, smooth, release_time_s, ..self.clone() }, held))
    }

    /// What a law that is smooth over the rate can hold of it: without the cycle in which dry friction stops
    /// the model.
    pub(crate) fn smooth(&self) -> Cow<'_, Self> {
        self.beginning(self.smooth)
    }

    /// Its first `count` means; all where there are no more.
    pub(crate) fn beginning(&self, count: usize) -> Cow<'_, Self> {
        if count >= self.yaw_rad.len() {
            return Cow::Borrowed(self);
        }
        let grid = Grid { count, ..self.grid };
        Cow::Owned(Self { grid, yaw_rad: self.yaw_rad[..count].to_vec(), ..self.clone() })
    }

    /// With the floor of coloured noise as the record and the `residuals` of a good model show it; where the
    /// record itself shows none, if they do so beyond doubt.
    pub(crate) fn with_noise_of(mut self, residuals: &[f64]) -> Self {
        let turn = TAU / self.per_cycle();
        let shown = self.spectrum.with_residuals(residuals, turn, self.block);
        let colour = match self.colour {
            Some(_) => shown.some_colour(self.block),
            None => shown.colour(self.block),
        };
        if let Some(colour) = colour {
            let most = residuals.iter().map(|r| r * r).sum::<f64>() / residuals.len() as f64;
            let colour = colour.at_most(most, self.block);
            self.noise_rad = colour.mean_variance(self.block).sqrt().max(1e-9 * self.reading_rad());
            self.sample_noise_rad = colour.sample_rad();
            self.colour = Some(colour);
        }
        self
    }

    /// Noise of the mean of `together` neighbouring means, and its correlation with the next such mean's.
    pub(crate) fn noise_of(&self, together: usize) -> (f64, f64) {
        match &self.colour {
            None => (self.noise_rad / (together as f64).sqrt(), 0.0),
            Some(colour) => {
                let block = self.block * together;
                let variance = colour.mean_variance(block);
                (variance.sqrt(), colour.next_covariance(block) / variance)
            }
        }
    }

    /// Largest amplitude of what is read.
    pub(crate) fn reading_rad(&self) -> f64 {
        self.measurand.derivative().recorded(self.amplitude_rad, self.frequency_rad_s)
    }

    /// What its motion, or what is known of it, depends on that is no number of a model.
    pub(crate) fn around(&self) -> Around {
        Around {
            wind_speed_m_s: self.wind_speed_m_s,
            observed: self.measurand.derivative(),
            rate_u: self.rate_u,
        }
    }

    pub(crate) fn scale(&self) -> Scale {
        Scale {
            amplitude_rad: self.amplitude_rad,
            reading_rad: self.reading_rad(),
            natural_frequency_rad_s: self.frequency_rad_s,
            duration_s: self.grid.step_s * self.grid.count as f64,
        }
    }

    /// The mean over the windows of what `of` takes of each.
    pub(crate) fn mean_of_windows(&self, of: fn(&WindowEstimate) -> f64) -> f64 {
        self.windows.iter().map(of).sum::<f64>() / self.windows.len().max(1) as f64
    }

    /// Whether the amplitude rises again after it has fallen, from one window to the next or within one.
    pub(crate) fn beats(&self) -> bool {
        let largest = self.windows.iter().map(|w| w.amplitude_deg).fold(0.0, f64::max);
        // At small amplitudes a rise may be the noise's.
        let shown = |w: &WindowEstimate| w.amplitude_deg > 0.15 * largest;
        let rises = |w: &[WindowEstimate]| {
            w[1].amplitude_deg > 1.03 * w[0].amplitude_deg || w[1].damping_ratio < -0.003
        };
        self.windows.iter().any(|w| w.damping_ratio > 0.0)
            && self.windows.windows(2).any(|w| shown(&w[1]) && rises(w))
    }

    /// Means in a cycle.
    pub fn per_cycle(&self) -> f64 {
        TAU / self.frequency_rad_s / self.grid.step_s
    }

    /// Raw rms of a single sample about a model whose means are off by `rms_rad`, deg or the measurand's
    /// unit: what the means leave out is the samples' noise.
    pub fn raw_rms_deg(&self, rms_rad: f64) -> f64 {
        let hidden = self.sample_noise_rad.powi(2) * (1.0 - 1.0 / self.block as f64);
        self.measurand.shown((rms_rad * rms_rad + hidden).sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// At some 80 samples a cycle, with stamps up to a third of a step off an even clock: what is left of the
    /// true motion at the noise floor's means is the noise floor.
    #[test]
    fn the_noise_floor_of_uneven_samples_is_that_of_their_curve() {
        use rand::{Rng, SeedableRng};
        use rand_distr::StandardNormal;
        let mut ratios = Vec::new();
        for (seed, per_cycle) in [(1, 80.0), (2, 80.0), (3, 160.0), (4, 160.0)] {
            let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
            let step_s = TAU / 6.0 / per_cycle;
            let swing = |t: f64| 20.0 * (-0.05 * t).exp() * (6.0 * t).cos();
            let time_s: Vec<f64> =
                (0..4000).map(|k| step_s * (f64::from(k) + rng.random_range(-0.3..0.3))).collect();
            let noisy = |t: &f64| swing(*t) + 0.1 * rng.sample::<f64, _>(StandardNormal);
            let yaw_deg = time_s.iter().map(noisy).collect();
            let record = Record::new("r", time_s, yaw_deg);
            let decay = FreeDecay::from_record(&record).expect("a free decay");
            let start_s = decay.release_time_s + decay.grid.start_s;
            let off = |(k, y): (usize, &f64)| {
                let t = start_s + k as f64 * decay.grid.step_s;
                (y.to_degrees() - swing(t)).powi(2)
            };
            let squares: f64 = decay.yaw_rad.iter().enumerate().map(off).sum();
            let left_deg = (squares / decay.yaw_rad.len() as f64).sqrt();
            ratios.push(decay.noise_rad.to_degrees() / left_deg);
            assert!((decay.sample_noise_rad.to_degrees() / 0.1 - 1.0).abs() < 0.06);
        }
        // Four thousand samples, neighbours shared: two to three per cent.
        assert!(ratios.iter().all(|ratio| (ratio - 1.0).abs() < 0.06), "{ratios:?}");
    }

    #[test]
    fn what_is_left_out_moves_nothing_after_it() {
        // Ten samples a cycle: a mean is a sample.
        let swing = |t: f64| 20.0 * (-0.05 * t).exp() * (6.0 * t).cos();
        let time_s: Vec<f64> = (0..400).map(|k| f64::from(k) * 0.1).collect();
        let mut yaw_deg: Vec<f64> = time_s.iter().map(|t| swing(*t)).collect();
        let record = |yaw_deg: &[f64]| Record::new("r", time_s.clone(), yaw_deg.to_vec());
        let without = FreeDecay::from_record(&record(&yaw_deg)).expect("a free decay");
        yaw_deg[60] += 30.0;
        yaw_deg[200] -= 25.0;
        let with = FreeDecay::from_record(&record(&yaw_deg)).expect("a free decay");
        assert_eq!(with.grid, without.grid);
        for (k, (a, b)) in with.yaw_rad.iter().zip(&without.yaw_rad).enumerate() {
            let allowed_deg = if k == 60 || k == 200 { 0.1 } else { 1e-9 };
            assert!((a - b).to_degrees().abs() < allowed_deg, "mean {k}: {a} and {b}");
        }
    }
}
