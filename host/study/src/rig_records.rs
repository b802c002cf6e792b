//! Releases of the virtual rig whose frequency and damping vary with amplitude, and the inputs of networks
//! from them.

use super::decays::{normalised, RECORD_POINTS, RECORD_S};
use yawrig_base::error::Result;
use yawrig_core::identify::least_squares;
use yawrig_core::identify::samples::Samples;
use yawrig_core::record::Record;
use yawrig_rig::{Condition, Effect, Effects, End, Rig, Sensor, Start};
use yawrig_shared::features::{features, FeatureKind, Features};
use yawrig_shared::history::History;
use yawrig_shared::modal::Modal;
use yawrig_shared::window::{Finding, Limits, Tracker, Window, SAMPLE_RATE_HZ};

/// Softening: natural frequency at 10 deg over that of small oscillations, less one.
const FREQUENCY_CHANGE: f64 = -0.004;
/// Drag on the model, 1/rad: at 10 deg a fifth of the damping of spring K4 in the wind.
const QUADRATIC_DAMPING: f64 = 0.018;
const TEN_DEG_RAD: f64 = 10.0 * std::f64::consts::PI / 180.0;

/// Cubic stiffness and quadratic damping that change a release as Fig 4.20 shows.
pub fn effects(small: &Modal) -> Result<Effects> {
    // wn(a)^2 = wn^2 + 3/4 k3 a^2.
    let change = (1.0 + FREQUENCY_CHANGE).powi(2) - 1.0;
    let k3 = change * small.stiffness_rad2_s2() / (0.75 * TEN_DEG_RAD * TEN_DEG_RAD);
    let softening: Effect = format!("cubic_stiffness:k3={k3}").parse()?;
    let drag: Effect = format!("quadratic_damping:d={QUADRATIC_DAMPING}").parse()?;
    Ok(Effects::new(vec![softening, drag])?)
}

/// Equivalent natural frequency (rad/s) and damping ratio of an oscillation of this amplitude under
/// [`effects`].
pub fn at_amplitude(small: &Modal, amplitude_rad: f64) -> [f64; 2] {
    let change = (1.0 + FREQUENCY_CHANGE).powi(2) - 1.0;
    let stiffness =
        small.stiffness_rad2_s2() * (1.0 + change * (amplitude_rad / TEN_DEG_RAD).powi(2));
    let wn = stiffness.sqrt();
    let damping_rad_s = small.damping_rad_s()
        + 8.0 / (3.0 * std::f64::consts::PI) * QUADRATIC_DAMPING * wn * amplitude_rad;
    [wn, damping_rad_s / (2.0 * wn)]
}

/// How long a model is held before its release, s.
const HOLD_S: f64 = 0.5;

/// A release from 15 deg, 1 kHz, watched for at most a minute.
pub fn release(rig: &Rig, condition: &Condition, vary: bool, seed: u64) -> Result<Record> {
    let off = Condition { wind_speed_m_s: 0.0, ..*condition };
    let effects = if vary { effects(&rig.modal(&off)?)? } else { Effects::default() };
    let end = End::Below { amplitude_deg: 0.8, at_most_s: 60.0 };
    let start = Start { amplitude_deg: 15.0, hold_s: HOLD_S, end };
    let sensor = Sensor { offset_deg: 1.0, ..Sensor::default() };
    let release = rig.release_with(condition, &effects, &start, &sensor, seed)?;
    let (time_s, yaw_deg) = release.samples.map(|s| (s.time_s, s.yaw_deg)).unzip();
    Ok(Record::new(condition.spring.name, time_s, yaw_deg))
}

/// Every window of three cycles below 10 deg, found by the device's code.
pub fn windows(record: &Record, kind: FeatureKind) -> Vec<(Window, Features)> {
    track(record, |window, history| Some((*window, features(kind, history, window))))
}

fn track<T>(record: &Record, found: impl Fn(&Window, &History<f32>) -> Option<T>) -> Vec<T> {
    let mut tracker = Box::new(Tracker::<f32>::new(0.0, 1.0, Limits::default()));
    let mut all = Vec::new();
    for yaw_deg in &record.yaw_deg {
        if let (_, Some(Finding::Window(window))) = tracker.push(*yaw_deg as f32) {
            all.extend(found(&window, tracker.history()));
        }
    }
    all
}

/// Where eight seconds are cut from a record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cut {
    /// From the release on, where the model is at its largest angle.
    Release,
    /// From the first zero crossing below 10 deg on, found to a fraction of a sample.
    Crossing,
}

/// Eight seconds of a record.
pub struct EightSeconds {
    /// First moment, in samples of 1 kHz.
    start: f64,
    sign: f64,
}

impl EightSeconds {
    /// `None` where the record is too short.
    pub fn new(record: &Record, cut: Cut) -> Option<Self> {
        let rate_hz = f64::from(SAMPLE_RATE_HZ);
        let found = match cut {
            Cut::Release => Self { start: HOLD_S * rate_hz, sign: 1.0 },
            Cut::Crossing => {
                let (window, _) = windows(record, FeatureKind::BinMeans).into_iter().next()?;
                let start = f64::from(window.start.sample) + f64::from(window.start.fraction);
                Self { start, sign: if window.rising { 1.0 } else { -1.0 } }
            }
        };
        let last = found.start + RECORD_S * rate_hz + 1.0;
        (last < record.yaw_deg.len() as f64).then_some(found)
    }

    /// 160 points 50 ms apart, or the means over 50 ms about them, as [`super::decays::WholeRecord`] has
    /// them.
    pub fn row(&self, record: &Record, means: bool, by_rms: bool) -> Vec<f64> {
        let step = RECORD_S * f64::from(SAMPLE_RATE_HZ) / RECORD_POINTS as f64;
        let at = |x: f64| {
            let (low, share) = (x.floor().max(0.0) as usize, x - x.floor());
            record.yaw_deg[low] * (1.0 - share) + record.yaw_deg[low + 1] * share
        };
        let point = |i: usize| {
            let centre = self.start + step * i as f64;
            match means {
                false => self.sign * at(centre),
                true => {
                    let offsets = (0..step as usize).map(|k| k as f64 + 0.5 - 0.5 * step);
                    let sum: f64 = offsets.map(|o| at((centre + o).max(0.0))).sum();
                    self.sign * sum / step
                }
            }
        };
        normalised((0..RECORD_POINTS).map(point).collect(), by_rms)
    }

    /// Natural frequency and damping ratio of the sinusoid that fits these eight seconds best.
    pub fn least_squares(&self, record: &Record, about_rad_s: f64) -> Option<[f64; 2]> {
        let first = self.start.ceil() as usize;
        let last = first + (RECORD_S * f64::from(SAMPLE_RATE_HZ)) as usize;
        let (time_s, yaw_deg) = (&record.time_s[first..last], &record.yaw_deg[first..last]);
        let samples = Samples::new(time_s, yaw_deg);
        let mode = least_squares::fit_mode(&samples.all(), about_rad_s)?.mode;
        Some([mode.natural_frequency_rad_s(), mode.damping_ratio()])
    }
}
