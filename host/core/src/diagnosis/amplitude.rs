//! The amplitude picture: natural frequency, damping ratio and mid-line of every three cycles against
//! amplitude, as measured and as each model predicts them.
//!
//! A model's values are those of its simulated reading, cut into windows and fitted exactly as the
//! measurement is: whatever the windows do to one they do to the other.

use crate::fit::at_amplitude::windows_of;
use crate::fit::at_amplitude::AtAmplitude;
use crate::fit::fitting::Fitted;
use crate::fit::free_decay::FreeDecay;
use crate::identify::windows::Window;
use crate::quantity::Quantity;
use crate::record::Said;
use serde::{Deserialize, Serialize};

/// A window of three cycles, as it was measured or as a model predicts it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct AmplitudePoint {
    /// Middle of the window, from the release.
    pub time_s: f64,
    /// Envelope there.
    pub amplitude_deg: f64,
    /// Uncertainties are those of the measurement; zero where a model predicts it.
    pub natural_frequency_rad_s: Quantity,
    /// Negative where the oscillation grows.
    pub damping_ratio: Quantity,
    /// Mid-line of the oscillation.
    pub midline_deg: Quantity,
}

/// What a model predicts for the same windows.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PredictedAmplitudes {
    /// Name of the model.
    pub name: String,
    /// One for each window of the measurement; empty where the simulation has run away.
    pub points: Vec<AmplitudePoint>,
}

/// What was measured in windows of three cycles, and what models predict for the same windows.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AmplitudePicture {
    /// What was recorded, where that is no angle in deg.
    #[serde(default, skip_serializing_if = "Said::is_none")]
    pub said: Said,
    /// In order of time, largest amplitude first where the oscillation decays.
    pub measured: Vec<AmplitudePoint>,
    /// In the order of the models.
    pub predictions: Vec<PredictedAmplitudes>,
}

/// The picture of `decay` with what each of `models`, fitted to it, predicts. A model whose simulation has
/// run away has no points.
///
/// ```
/// use yawrig_core::diagnosis::amplitude::picture;
/// use yawrig_core::fit::{fitting::fit_plain, free_decay::FreeDecay};
/// use yawrig_core::record::Record;
///
/// let time_s: Vec<f64> = (0..6000).map(|k| f64::from(k) / 300.0).collect();
/// let yaw_deg = time_s.iter().map(|t| 12.0 * (-0.06 * t).exp() * (6.0 * t).cos()).collect();
/// let decay = FreeDecay::from_record(&Record::new("mine", time_s, yaw_deg))?;
/// let plain = fit_plain(&decay, false, decay.yaw_rad.len());
/// let drawn = picture(&decay, &[("second order", &plain)]);
/// assert_eq!(drawn.measured.len(), drawn.predictions[0].points.len());
/// let zeta = drawn.measured[0].damping_ratio.value;
/// assert!((zeta / 0.01 - 1.0).abs() < 0.01, "{zeta}");
/// # Ok::<(), yawrig_core::error::Error>(())
/// ```
pub fn picture(decay: &FreeDecay, models: &[(&str, &Fitted)]) -> AmplitudePicture {
    let predictions = models.iter().map(|(name, model)| {
        let readings = model.readings(&decay.grid);
        let exact = |p: AmplitudePoint| AmplitudePoint {
            natural_frequency_rad_s: Quantity::exact(p.natural_frequency_rad_s.value),
            damping_ratio: Quantity::exact(p.damping_ratio.value),
            midline_deg: Quantity::exact(p.midline_deg.value),
            ..p
        };
        let points = points(decay, &readings).into_iter().map(exact).collect();
        PredictedAmplitudes { name: (*name).to_owned(), points }
    });
    AmplitudePicture {
        said: decay.measurand.said(),
        predictions: predictions.collect(),
        measured: points(decay, &decay.yaw_rad),
    }
}

fn points(decay: &FreeDecay, yaw_rad: &[f64]) -> Vec<AmplitudePoint> {
    let derivative = decay.measurand.derivative();
    let of = |w: &Window| {
        let AtAmplitude { amplitude_deg, natural_frequency_rad_s, damping_ratio } =
            w.at_amplitude(derivative);
        AmplitudePoint {
            time_s: 0.5 * (w.from_s + w.to_s),
            amplitude_deg,
            natural_frequency_rad_s,
            damping_ratio,
            midline_deg: Quantity::new(w.midline_deg, w.midline_u_deg),
        }
    };
    windows_of(decay, yaw_rad).iter().map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::Effect;
    use crate::fit::fitting::{fit_added, fit_plain};
    use crate::record::Record;
    use yawrig_rig::{Effects, Samples as RigSamples, Sensor, Start};
    use yawrig_shared::modal::Modal;

    /// A record of the rig's own integrator and sensor.
    fn decay(effect: &str) -> FreeDecay {
        let modal = Modal { natural_frequency_rad_s: 7.5, damping_ratio: 0.008 };
        let effects = Effects::new(vec![effect.parse().unwrap()]).unwrap();
        let sensor = Sensor { noise_deg: 0.05, ..Sensor::default() };
        let start = Start::default().limited(&modal, &effects);
        let samples = RigSamples::with_effects(&modal, &effects, &start, &sensor, 3).unwrap();
        let (time_s, yaw_deg) = samples.map(|s| (s.time_s, s.yaw_deg)).unzip();
        FreeDecay::from_record(&Record::new("rig", time_s, yaw_deg)).unwrap()
    }

    /// Share of the measured points that lie within three standard uncertainties of a prediction.
    fn share_within(
        picture: &AmplitudePicture,
        k: usize,
        of: fn(&AmplitudePoint) -> Quantity,
    ) -> f64 {
        let near = |m: &AmplitudePoint| {
            let p = &picture.predictions[k].points;
            let at = |p: &&AmplitudePoint| (p.time_s - m.time_s).abs();
            let nearest = p.iter().min_by(|a, b| at(a).total_cmp(&at(b))).expect("a point");
            of(m).holds(of(nearest).value, 3.0)
        };
        let within = picture.measured.iter().filter(|m| near(m)).count();
        within as f64 / picture.measured.len() as f64
    }

    #[test]
    fn the_right_effect_foretells_what_is_measured_and_a_second_order_model_does_not() {
        let friction = ("coulomb_friction:c=0.05", Effect::CoulombFriction);
        let stiffness = ("cubic_stiffness:k3=20", Effect::CubicStiffness);
        let damping: fn(&AmplitudePoint) -> Quantity = |p| p.damping_ratio;
        let frequency: fn(&AmplitudePoint) -> Quantity = |p| p.natural_frequency_rad_s;
        for ((hidden, effect), of) in [(friction, damping), (stiffness, frequency)] {
            let decay = decay(hidden);
            let plain = fit_plain(&decay, false, decay.yaw_rad.len());
            let with = fit_added(&decay, &plain, &effect);
            let picture = picture(&decay, &[("second order", &plain), (effect.id(), &with)]);
            assert!(picture.measured.len() > 5, "{}", picture.measured.len());
            let (without, with) = (share_within(&picture, 0, of), share_within(&picture, 1, of));
            println!("{hidden}: within three standard uncertainties {without:.2} without, {with:.2} with");
            assert!(without < 0.7 && with > 0.95, "{hidden}: {without} {with}");
        }
    }

    #[test]
    fn a_constant_moment_moves_the_midline() {
        let decay = decay("static_offset:m=1");
        let plain = fit_plain(&decay, false, decay.yaw_rad.len());
        let with = fit_added(&decay, &plain, &Effect::StaticOffset);
        let picture = picture(&decay, &[("static_offset", &with)]);
        let expected = (1.0 / 7.5_f64.powi(2)).to_degrees();
        for (m, p) in picture.measured.iter().zip(&picture.predictions[0].points) {
            assert!((m.midline_deg.value - expected).abs() < 0.02, "{m:?}");
            assert!((p.midline_deg.value - expected).abs() < 0.01, "{p:?}");
            assert_eq!(p.damping_ratio.u, 0.0);
        }
    }
}
