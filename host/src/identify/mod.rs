//! Natural frequency and damping ratio of recorded free decays.
//!
//! [`identify`] finds the free swing in a record and hands the part inside the amplitude window to each method.
//! Angles in deg, as recorded; damping ratio negative where the oscillation grows.

pub mod batch;
pub mod conventional;
pub mod damped_sinusoid;
pub mod envelope;
pub mod flag;
pub mod least_squares;
mod lowpass;
pub mod network;
pub mod outliers;
pub mod pencil;
pub mod release;
pub mod samples;
pub mod spectrum;
mod trend;
pub mod uncertainty;
pub mod windows;

use crate::error::{Error, Result};
use crate::quantity::Quantity;
use crate::record::Record;
use flag::Flag;
use samples::{median, Samples, Stretch};
use serde::{Deserialize, Serialize};
use std::path::Path;
use windows::Window;

/// Fewest cycles an estimate is made from.
pub const FEWEST_CYCLES: f64 = 3.0;
/// Below this many cycles a flag says so.
const FEW_CYCLES: f64 = 6.0;
/// A record whose three-cycle fits explain less than this of it holds no oscillation worth the name.
const LEAST_EXPLAINED: f64 = 0.5;
/// Residual of an estimate over the whole window, in residuals of the three-cycle fits, that needs a word.
const ABOVE_NOISE: f64 = 1.5;

/// How records are analysed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Amplitude at which the analysis starts, deg.
    pub from_deg: f64,
    /// Amplitude at which it ends, deg.
    pub to_deg: f64,
    pub conventional: conventional::Options,
}

impl Default for Settings {
    fn default() -> Self {
        Self { from_deg: 10.0, to_deg: 1.0, conventional: conventional::Options::default() }
    }
}

/// How wn and zeta are had from the swing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    LeastSquares,
    Conventional,
    Network,
}

/// Why a record gives nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Refusal {
    NoOscillation,
    TooFewCycles { cycles: f64 },
}

impl Refusal {
    /// The error for a file.
    pub fn of_file(self, file: &Path) -> Error {
        let file = file.display();
        match self {
            Refusal::NoOscillation => Error::data(format!("{file}: no oscillation found"))
                .help("check that the record holds a released swing in its second column"),
            Refusal::TooFewCycles { cycles } => Error::data(format!(
                "{file}: {cycles:.1} cycles of free oscillation, at least {FEWEST_CYCLES:.0} are needed"
            ))
            .help("record a longer swing, or widen the amplitude window with --from-deg and --to-deg"),
        }
    }
}

/// All that was found in one record.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Identification {
    pub file: String,
    /// Beginning of the free motion on the record's own clock; the first sample where the release came before it
    /// (flag `starts_in_mid_swing`).
    pub release_time_s: f64,
    pub rate_hz: f64,
    pub window: AmplitudeWindow,
    /// Standard deviation of what three-cycle fits leave.
    pub noise_rms_deg: f64,
    /// Wild samples left out.
    pub outliers: usize,
    pub estimates: Vec<Estimate>,
    /// Methods that could not say anything about this record.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub unavailable: Vec<Unavailable>,
}

/// What was analysed: amplitudes at its ends, not those asked for.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct AmplitudeWindow {
    pub from_deg: f64,
    pub to_deg: f64,
    pub cycles: f64,
    pub from_s: f64,
    pub to_s: f64,
}

/// One method's answer.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Estimate {
    pub method: Method,
    pub natural_frequency_rad_s: Quantity,
    pub damping_ratio: Quantity,
    /// Raw rms of record minus the mode with these two values, amplitude, phase and offset fitted.
    pub residual_rms_deg: f64,
    /// Three cycles each, in order of time.
    pub windows: Vec<WindowEstimate>,
    pub flags: Vec<Flag>,
    /// Least standard deviations any unbiased method could reach in white noise of the residual's size.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cramer_rao: Option<uncertainty::Bound>,
}

/// wn and zeta over three cycles.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct WindowEstimate {
    /// Middle of the window.
    pub time_s: f64,
    /// Envelope there.
    pub amplitude_deg: f64,
    pub natural_frequency_rad_s: f64,
    pub damping_ratio: f64,
}

/// A method without an answer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Unavailable {
    pub method: Method,
    pub reason: String,
}

/// A record with its swing found, as every method gets it.
pub struct Prepared<'a> {
    pub record: &'a Record,
    pub samples: Samples<'a>,
    pub swing: release::Swing,
    pub windows: Vec<Window>,
    pub settings: Settings,
}

impl Prepared<'_> {
    /// The analysed part of the record.
    pub fn stretch(&self) -> Stretch<'_> {
        self.swing.stretch(&self.samples)
    }
    /// The mode over all of it.
    fn mode(&self) -> Option<least_squares::ModeFit> {
        least_squares::fit_mode(&self.stretch(), self.swing.frequency_rad_s)
    }
    /// Standard deviation of what three-cycle fits leave.
    pub fn noise_rms_deg(&self) -> f64 {
        let mut variances: Vec<f64> = self.windows.iter().map(|w| w.noise_deg.powi(2)).collect();
        median(&mut variances).sqrt()
    }
    /// The analysed amplitudes and times.
    pub fn window(&self) -> AmplitudeWindow {
        let (from_s, to_s) = (self.swing.from_s, self.swing.to_s);
        let amplitude = |w: &Window, time_s: f64| {
            let middle = 0.5 * (w.from_s + w.to_s);
            w.amplitude_deg
                * (w.damping_ratio * w.natural_frequency_rad_s * (middle - time_s)).exp()
        };
        let cycles = self.windows.iter().map(|w| w.natural_frequency_rad_s).sum::<f64>()
            / self.windows.len() as f64
            / std::f64::consts::TAU
            * (to_s - from_s);
        AmplitudeWindow {
            from_deg: amplitude(&self.windows[0], from_s),
            to_deg: amplitude(&self.windows[self.windows.len() - 1], to_s),
            cycles,
            from_s,
            to_s,
        }
    }
    /// The estimate with what the record says about it: flags, and where its values change with amplitude an
    /// uncertainty that holds the change, since one number then stands for many.
    fn judged(&self, mut estimate: Estimate) -> Estimate {
        let flags = &mut estimate.flags;
        flags.extend(&self.swing.flags);
        let trends = trend::of(&self.windows);
        if let Some(spread) = trends.frequency {
            flags.push(Flag::AmplitudeDependentFrequency);
            let u = &mut estimate.natural_frequency_rad_s.u;
            *u = u.hypot(spread);
        }
        if let Some(spread) = trends.damping {
            flags.push(Flag::AmplitudeDependentDamping);
            let u = &mut estimate.damping_ratio.u;
            *u = u.hypot(spread);
        }
        let tests = [
            (!self.samples.is_uniform(), Flag::IrregularTimeStamps),
            (self.samples.excluded() > 0, Flag::OutliersExcluded),
            (self.window().cycles < FEW_CYCLES, Flag::FewCycles),
            (
                estimate.residual_rms_deg > ABOVE_NOISE * self.noise_rms_deg(),
                Flag::ResidualAboveNoise,
            ),
            (estimate.damping_ratio.value < -2.0 * estimate.damping_ratio.u, Flag::Grows),
        ];
        flags.extend(tests.iter().filter(|(found, _)| *found).map(|(_, flag)| *flag));
        flags.sort_unstable();
        estimate
    }
}

/// Finds the swing of `record` and fits its three-cycle windows.
///
/// # Errors
/// See [`Refusal`].
pub fn prepare<'a>(
    record: &'a Record,
    settings: &Settings,
) -> std::result::Result<Prepared<'a>, Refusal> {
    let mut samples = Samples::new(&record.time_s, &record.yaw_deg);
    outliers::exclude_spikes(&mut samples);
    let swing = release::find(&samples, settings)?;
    let windows = windows::windows(&mut samples, swing.from_s, swing.to_s, swing.frequency_rad_s);
    let mut explained: Vec<f64> = windows.iter().map(|w| w.explained).collect();
    if explained.is_empty() || median(&mut explained) < LEAST_EXPLAINED {
        return Err(Refusal::NoOscillation);
    }
    Ok(Prepared { record, samples, swing, windows, settings: *settings })
}

/// Applies `methods` to a record.
///
/// # Errors
/// Exit 3, naming the file: no oscillation in it, fewer than three cycles, or no method with an answer.
pub fn identify(
    record: &Record,
    methods: &[Method],
    settings: &Settings,
) -> Result<Identification> {
    let prepared = prepare(record, settings).map_err(|refusal| refusal.of_file(&record.file))?;
    let mut estimates = Vec::new();
    let mut unavailable = Vec::new();
    for &method in methods {
        let answer = match method {
            Method::LeastSquares => least_squares_estimate(&prepared),
            Method::Conventional => conventional::estimate(&prepared),
            Method::Network => network::estimate(&prepared),
        };
        match answer {
            Ok(estimate) => estimates.push(prepared.judged(estimate)),
            Err(reason) => unavailable.push(Unavailable { method, reason }),
        }
    }
    if let (true, Some(first)) = (estimates.is_empty(), unavailable.first()) {
        return Err(Error::data(format!("{}: {}", record.file.display(), first.reason))
            .help("try another --method"));
    }
    Ok(Identification {
        file: record.file.display().to_string(),
        release_time_s: prepared.swing.release_time_s,
        rate_hz: prepared.samples.rate_hz(),
        window: prepared.window(),
        noise_rms_deg: prepared.noise_rms_deg(),
        outliers: prepared.samples.excluded(),
        estimates,
        unavailable,
    })
}

fn least_squares_estimate(prepared: &Prepared<'_>) -> std::result::Result<Estimate, String> {
    let found =
        prepared.mode().ok_or("the fit of one mode to the whole window did not converge")?;
    let stretch = prepared.stretch();
    let u = found.uncertainty(&stretch).ok_or("the fit does not determine its parameters")?;
    Ok(Estimate {
        method: Method::LeastSquares,
        natural_frequency_rad_s: Quantity::new(
            found.mode.natural_frequency_rad_s(),
            u.natural_frequency_rad_s,
        ),
        damping_ratio: Quantity::new(found.mode.damping_ratio(), u.damping_ratio),
        residual_rms_deg: found.residual_rms_deg(),
        windows: prepared.windows.iter().map(WindowEstimate::of).collect(),
        flags: Vec::new(),
        cramer_rao: Some(u.bound),
    })
}

impl WindowEstimate {
    fn of(w: &Window) -> Self {
        Self {
            time_s: 0.5 * (w.from_s + w.to_s),
            amplitude_deg: w.amplitude_deg,
            natural_frequency_rad_s: w.natural_frequency_rad_s,
            damping_ratio: w.damping_ratio,
        }
    }
}
