//! A record with its free decay found, and the residual and the flags of any method's values on it.

use super::answer::MIN_PER_CYCLE;
use super::cycle::Cycle;
use super::damped_sinusoid::{DampedSinusoid, Mode};
use super::envelope::ENVELOPE_SAMPLES;
use super::flag::Flag;
use super::gaps::{self, Filled, Gap};
use super::least_squares::{self, ModeFit};
use super::oscillation;
use super::outliers;
use super::over_window::{self, OverWindow, Ranges};
use super::release::{self, Amplitudes, FreeSpan};
use super::samples::{Samples, Stretch};
use super::trend::{self, Trends};
use super::uncertainty::{self, Bound, Lacking, Uncertainty};
use super::windows::{self, Window};
use super::{
    AmplitudeWindow, AtAmplitude, Estimate, Method, OneMode, Refusal, Settings, WindowEstimate,
};
use crate::quantity::Quantity;
use crate::record::Record;
use crate::statistics::{median, sample_noise};
use std::f64::consts::TAU;
use std::sync::OnceLock;

/// Below this many cycles a flag says so.
const FEW_CYCLES: f64 = 6.0;
/// Rms of the residual about the oscillation's frequency, in what three-cycle fits leave there, above which a
/// flag is set. Few bins are behind either: by chance 1 % of records of four cycles come here, of longer ones
/// hardly any.
const MISFIT_OVER_NOISE: f64 = 2.5;
/// Raw rms of a residual over that of the noise, which a reader sees to be more.
const VISIBLE: f64 = 1.1;

/// A record as every method gets it.
pub(crate) struct Prepared<'a> {
    pub(crate) record: &'a Record,
    pub(crate) samples: Samples<'a>,
    pub(crate) span: FreeSpan,
    pub(crate) windows: Vec<Window>,
    pub(crate) settings: Settings,
    /// Spectral density of what three-cycle fits leave, about the oscillation's frequency; as a variance.
    density: f64,
    /// One mode over the whole window.
    whole: Option<ModeFit>,
    uncertainty: OnceLock<Option<Uncertainty>>,
    over_window: OnceLock<Option<OverWindow>>,
}

/// A method's values, before they are compared with the record.
#[derive(Clone, Debug)]
pub(crate) struct Values {
    pub(crate) natural_frequency_rad_s: Quantity,
    pub(crate) damping_ratio: Quantity,
    /// The method's own windows of three cycles, where it has them.
    pub(crate) windows: Vec<WindowEstimate>,
    pub(crate) at_amplitude: Vec<AtAmplitude>,
    /// What only the method knows.
    pub(crate) flags: Vec<Flag>,
    pub(crate) cramer_rao: Option<Bound>,
    pub(crate) lacking: Lacking,
}

/// Finds the free decay in `record` and fits its three-cycle windows and the whole.
///
/// # Errors
/// See [`Refusal`].
pub(crate) fn prepare<'a>(
    record: &'a Record,
    settings: &Settings,
) -> Result<Prepared<'a>, Refusal> {
    if record.len() < ENVELOPE_SAMPLES {
        return Err(Refusal::NoOscillation);
    }
    let mut samples = Samples::new(&record.time_s, &record.yaw_deg);
    outliers::exclude_spikes(&mut samples);
    let amplitudes = Amplitudes::new(settings, &record.measurand);
    let seen = |amplitudes: Amplitudes| seen_with(samples.clone(), amplitudes, record);
    let (samples, span, windows, density) = match seen(amplitudes) {
        // Amplitudes that were asked for and are lost in something else: those that the record has.
        Err(refusal) if !settings.only_between => {
            let mut seen = seen(amplitudes.all()).map_err(|_| refusal)?;
            let flags = &mut seen.1.flags;
            if !flags.contains(&Flag::AmplitudeOutsideWindow) {
                flags.push(Flag::AmplitudeOutsideWindow);
            }
            seen
        }
        seen => seen?,
    };
    let per_cycle = TAU / span.frequency_rad_s * samples.rate_hz();
    if per_cycle < MIN_PER_CYCLE {
        return Err(Refusal::TooCoarse { per_cycle });
    }
    let whole = least_squares::fit_mode(&span.stretch(&samples), span.frequency_rad_s);
    let (uncertainty, over_window) = (OnceLock::new(), OnceLock::new());
    let settings = *settings;
    Ok(Prepared {
        record,
        samples,
        span,
        windows,
        settings,
        density,
        whole,
        uncertainty,
        over_window,
    })
}

/// The free decay in `samples`, less what is wild in its windows, with these and the spectral density of what
/// they leave.
fn seen_with<'a>(
    mut samples: Samples<'a>,
    amplitudes: Amplitudes,
    record: &Record,
) -> Result<(Samples<'a>, FreeSpan, Vec<Window>, f64), Refusal> {
    let white_noise_deg = sample_noise(&record.yaw_deg);
    let mut span = release::find(&samples, amplitudes)?;
    let (to_s, frequency) = (span.to_s, span.frequency_rad_s);
    let (mut windows, mut density) = windows::windows(&mut samples, span.from_s, to_s, frequency);
    if let Some(from_s) = windows::settled_from_s(&windows, frequency, white_noise_deg) {
        span.from_s = from_s;
        if !span.flags.contains(&Flag::PushedAtStart) {
            span.flags.push(Flag::PushedAtStart);
        }
        (windows, density) = windows::windows(&mut samples, from_s, to_s, frequency);
    }
    match oscillation::is_one(&windows, &samples, &span, white_noise_deg) {
        true => Ok((samples, span, windows, density)),
        false => Err(Refusal::NoOscillation),
    }
}

impl Prepared<'_> {
    /// The analysed part of the record.
    pub(crate) fn stretch(&self) -> Stretch<'_> {
        self.span.stretch(&self.samples)
    }

    /// The record without its wild samples on an even grid.
    ///
    /// # Errors
    /// In words, where too few samples are left, or none for longer than can be filled.
    pub(crate) fn evenly_sampled(
        &self,
        rate_hz: f64,
        flags: &mut Vec<Flag>,
    ) -> Result<Record, String> {
        let samples = &self.samples;
        let even = samples.is_uniform() && (samples.rate_hz() / rate_hz - 1.0).abs() < 1e-6;
        if even && samples.excluded() == 0 {
            return Ok(self.record.clone());
        }
        if !even {
            flags.push(Flag::Resampled);
        }
        let (time_s, yaw_deg) = samples.all().kept().unzip();
        let kept = self.record.with(time_s, yaw_deg);
        let kept = match gaps::filled(&kept) {
            None => kept,
            Some(Filled { record, parting, .. }) => {
                let inside =
                    |gap: &&Gap| gap.from_s < self.span.to_s && gap.to_s > self.span.from_s;
                if let Some(gap) = parting.iter().find(inside) {
                    return Err(format!("{gap}, and this method needs them all along"));
                }
                flags.push(Flag::GapsFilled);
                record
            }
        };
        kept.resampled(rate_hz).map_err(|e| e.to_string())
    }

    /// Standard deviation of the noise; see [`super::Identification::noise_rms_deg`].
    pub(crate) fn noise_rms_deg(&self) -> f64 {
        match &self.whole {
            Some(whole) if !self.misfit(&whole.mode).above_noise => whole.fit.variance().sqrt(),
            _ => {
                let mut variances: Vec<f64> =
                    self.windows.iter().map(|w| w.noise_deg.powi(2)).collect();
                median(&mut variances).sqrt()
            }
        }
    }

    /// The analysed amplitudes and times.
    pub(crate) fn window(&self) -> AmplitudeWindow {
        let (from_s, to_s) = (self.span.from_s, self.span.to_s);
        let derivative = self.record.measurand.derivative();
        let amplitude = |w: &Window, time_s: f64| {
            let middle = 0.5 * (w.from_s + w.to_s);
            w.motion_amplitude_deg(derivative)
                * (w.damping_ratio * w.natural_frequency_rad_s * (middle - time_s)).exp()
        };
        let frequencies: f64 = self.windows.iter().map(|w| w.natural_frequency_rad_s).sum();
        AmplitudeWindow {
            from_deg: amplitude(&self.windows[0], from_s),
            to_deg: amplitude(&self.windows[self.windows.len() - 1], to_s),
            cycles: frequencies / self.windows.len() as f64 / TAU * (to_s - from_s),
            from_s,
            to_s,
        }
    }

    /// wn and zeta over three cycles each, and the motion's amplitude.
    pub(crate) fn window_estimates(&self) -> Vec<WindowEstimate> {
        let derivative = self.record.measurand.derivative();
        let of = |w: &Window| WindowEstimate {
            time_s: 0.5 * (w.from_s + w.to_s),
            amplitude_deg: w.motion_amplitude_deg(derivative),
            natural_frequency_rad_s: w.natural_frequency_rad_s,
            damping_ratio: w.damping_ratio,
        };
        self.windows.iter().map(of).collect()
    }

    fn at_amplitudes(&self) -> Vec<AtAmplitude> {
        windows::at_amplitudes(&self.windows, self.record.measurand.derivative())
    }

    fn by_window(&self) -> Vec<AtAmplitude> {
        let derivative = self.record.measurand.derivative();
        self.windows.iter().map(|w| w.at_amplitude(derivative)).collect()
    }

    /// Least squares over all of the window.
    pub(crate) fn least_squares(&self) -> Result<Values, String> {
        let Some(found) = &self.whole else {
            return self.of_windows().ok_or_else(|| "no mode could be fitted".into());
        };
        let u = self.uncertainty().ok_or("the fit leaves a parameter open")?;
        let mode = &found.mode;
        Ok(Values {
            natural_frequency_rad_s: Quantity::new(
                mode.natural_frequency_rad_s(),
                u.natural_frequency_rad_s,
            ),
            damping_ratio: Quantity::new(mode.damping_ratio(), u.damping_ratio),
            windows: self.window_estimates(),
            at_amplitude: self.at_amplitudes(),
            flags: Vec::new(),
            cramer_rao: Some(u.bound),
            lacking: u.lacking,
        })
    }

    /// Where no one mode can be followed through the whole window, its frequency changing by so much: the
    /// mean of every three cycles', and their spread, since one number then stands for many.
    fn of_windows(&self) -> Option<Values> {
        if self.windows.len() < 2 {
            return None;
        }
        let n = self.windows.len() as f64;
        let spread = |of: fn(&Window) -> f64| {
            let mean = self.windows.iter().map(of).sum::<f64>() / n;
            let squares: f64 = self.windows.iter().map(|w| (of(w) - mean).powi(2)).sum();
            Quantity::new(mean, (squares / (n - 1.0)).sqrt())
        };
        Some(Values {
            natural_frequency_rad_s: spread(|w| w.natural_frequency_rad_s),
            damping_ratio: spread(|w| w.damping_ratio),
            windows: self.window_estimates(),
            at_amplitude: self.at_amplitudes(),
            flags: Vec::new(),
            cramer_rao: None,
            lacking: Lacking::default(),
        })
    }

    /// The estimate with what the record says about it: its residual, flags, and where one mode does not
    /// explain it the mean over the window and how far wn and zeta change over it. Of windows too few for
    /// that the uncertainty holds the change, since one number then stands for many.
    ///
    /// # Errors
    /// In words, where no oscillation has these values.
    pub(crate) fn judged(&self, method: Method, values: Values) -> Result<Estimate, String> {
        let trends = trend::of(&self.windows);
        let one_mode = trends.holding(OneMode {
            natural_frequency_rad_s: values.natural_frequency_rad_s,
            damping_ratio: values.damping_ratio,
            lacking: values.lacking,
        });
        let over = self.over_window(&trends);
        let (wn, zeta) = match (&over, method) {
            (Some(over), Method::LeastSquares) => {
                (over.natural_frequency_rad_s, over.damping_ratio)
            }
            (Some(_), _) => (values.natural_frequency_rad_s, values.damping_ratio),
            (None, _) => (one_mode.natural_frequency_rad_s, one_mode.damping_ratio),
        };
        let ranges = over.map_or_else(|| self.ranges(&trends, wn, zeta), |over| over.ranges);
        let [frequency_changes, damping_changes] = over.map_or([false; 2], |over| over.changes);
        let decay_rate = zeta.value * wn.value;
        let damped_frequency = (wn.value.powi(2) - decay_rate.powi(2)).sqrt();
        let mode = least_squares::linear_start(&self.stretch(), decay_rate, damped_frequency)
            .ok_or("no oscillation has its values")?;
        let misfit = self.misfit(&mode);
        let mut flags = values.flags;
        flags.extend(&self.span.flags);
        let tests = [
            (!self.samples.is_uniform(), Flag::IrregularTimeStamps),
            (self.record.stamps_spread, Flag::StampsSpread),
            (self.samples.excluded() > 0, Flag::OutliersExcluded),
            (self.window().cycles < FEW_CYCLES, Flag::FewCycles),
            (trends.frequency.is_some() || frequency_changes, Flag::AmplitudeDependentFrequency),
            (trends.damping.is_some() || damping_changes, Flag::AmplitudeDependentDamping),
            (
                misfit.above_noise && !self.is_explained_near(&misfit, wn, zeta),
                Flag::ResidualAboveNoise,
            ),
            (zeta.value < -2.0 * zeta.u, Flag::Grows),
        ];
        flags.extend(tests.iter().filter(|(found, _)| *found).map(|(_, flag)| *flag));
        flags.sort_unstable();
        Ok(Estimate {
            method,
            natural_frequency_rad_s: wn,
            damping_ratio: zeta,
            natural_frequency_range_rad_s: ranges.natural_frequency_rad_s,
            damping_ratio_range: ranges.damping_ratio,
            cycle: Cycle::new(wn, zeta),
            residual_rms_deg: misfit.rms_deg,
            windows: values.windows,
            at_amplitude: values.at_amplitude,
            flags,
            cramer_rao: values.cramer_rao,
            by_window: match method {
                Method::LeastSquares => self.by_window(),
                Method::Conventional | Method::Network => Vec::new(),
            },
            one_mode: Some(one_mode),
        })
    }

    /// Of the one mode over the whole window.
    fn uncertainty(&self) -> Option<Uncertainty> {
        let derivative = self.record.measurand.derivative();
        let of = |whole: &ModeFit| whole.uncertainty(&self.stretch(), derivative);
        *self.uncertainty.get_or_init(|| self.whole.as_ref().and_then(of))
    }

    /// Means over the window, where one mode does not do: where more than noise and what shakes a linear rig is
    /// left of it, or wn or zeta change.
    fn over_window(&self, trends: &Trends) -> Option<OverWindow> {
        *self.over_window.get_or_init(|| {
            let changes = trends.frequency.is_some() || trends.damping.is_some();
            let does = |(whole, u): (&ModeFit, Uncertainty)| {
                let is_noise = u.is_shaken || !self.misfit(&whole.mode).above_noise;
                u.lacking == Lacking::default() && is_noise
            };
            if !changes && self.whole.as_ref().zip(self.uncertainty()).is_some_and(does) {
                return None;
            }
            let derivative = self.record.measurand.derivative();
            let ends = [self.span.from_s, self.span.to_s];
            over_window::of(&self.samples, ends, &self.windows, derivative)
        })
    }

    /// Of few windows: their own, of what changes.
    fn ranges(&self, trends: &Trends, wn: Quantity, zeta: Quantity) -> Ranges {
        let range = |changes: Option<f64>, value: f64, of: fn(&Window) -> f64| {
            let windows = self.windows.iter().filter(|_| changes.is_some()).map(of);
            windows.fold([value; 2], |[low, high], each| [low.min(each), high.max(each)])
        };
        Ranges {
            natural_frequency_rad_s: range(trends.frequency, wn.value, |w| {
                w.natural_frequency_rad_s
            }),
            damping_ratio: range(trends.damping, zeta.value, |w| w.damping_ratio),
        }
    }

    /// Whether one mode explains the record, this method's values are its within their own uncertainty, and
    /// what they leave is no more than the noise to the eye.
    fn is_explained_near(&self, misfit: &Misfit, wn: Quantity, zeta: Quantity) -> bool {
        let Some(ModeFit { mode, .. }) = &self.whole else { return false };
        let near = |q: Quantity, value: f64| (q.value - value).abs() <= 3.0 * q.u;
        near(wn, mode.natural_frequency_rad_s())
            && near(zeta, mode.damping_ratio())
            && misfit.rms_deg <= VISIBLE * self.noise_rms_deg()
            && !self.misfit(mode).above_noise
    }

    /// What `mode` leaves of the window. Compared about its own frequency, where a misfit lies and where
    /// neither the sample noise nor a wandering zero hides it.
    fn misfit(&self, mode: &Mode) -> Misfit {
        let stretch = self.stretch();
        let residuals = DampedSinusoid { stretch }.residuals_deg(mode);
        let kept = || residuals.iter().zip(stretch.excluded).filter(|(_, e)| !**e).map(|(r, _)| r);
        let rms_deg = (kept().map(|r| r * r).sum::<f64>() / kept().count() as f64).sqrt();
        let density =
            uncertainty::spectral_density(&stretch, &residuals, mode.damped_frequency_rad_s);
        Misfit { rms_deg, above_noise: density > MISFIT_OVER_NOISE.powi(2) * self.density }
    }
}

struct Misfit {
    rms_deg: f64,
    above_noise: bool,
}
