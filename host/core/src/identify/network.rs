//! The frozen network over consecutive windows, by the code the device runs.

use super::flag::Flag;
use super::uncertainty::Lacking;
use super::{Prepared, Values, WindowEstimate};
use crate::quantity::Quantity;
use std::sync::OnceLock;
use yawrig_firmware::estimator::Collector;
use yawrig_firmware::BUILT_IN;
use yawrig_shared::blob;
use yawrig_shared::features::features;
use yawrig_shared::network::Network;
use yawrig_shared::window::{Finding, Limits, Tracker, SAMPLE_RATE_HZ};
use yawrig_shared::wire::Measured;

/// The network compiled into the device.
fn built_in() -> Result<&'static Network, String> {
    static NETWORK: OnceLock<Option<Network>> = OnceLock::new();
    NETWORK
        .get_or_init(|| blob::decode(BUILT_IN).ok().map(|(_, payload)| payload.network))
        .as_ref()
        .ok_or_else(|| "the network compiled in does not pass its checks here".to_owned())
}

/// The network's answer: its weighted mean over consecutive windows, as the device gives it; why
/// there is none in words.
pub(crate) fn values(prepared: &Prepared<'_>) -> Result<Values, String> {
    let network = built_in()?;
    let analysed = prepared.window();
    let derivative = prepared.record.measurand.derivative();
    let frequency = prepared.span.frequency_rad_s;
    let recorded = |amplitude: f64| derivative.recorded(amplitude, frequency) as f32;
    let mut flags = Vec::new();
    let record = prepared.evenly_sampled(f64::from(SAMPLE_RATE_HZ), &mut flags)?;
    let limits = Limits {
        // The first peak lies a little below the envelope, noise a little above it.
        from_deg: recorded(1.02 * analysed.from_deg),
        to_deg: recorded(analysed.to_deg),
        least_swing_deg: recorded(0.4 * analysed.to_deg),
    };
    // Half a cycle ahead, for the first turning point of a record that is cut into is not used.
    let lead_s = 0.5 * (analysed.to_s - analysed.from_s) / analysed.cycles;
    let begin_s = (analysed.from_s - lead_s).max(prepared.span.release_time_s);
    let begin = record.time_s.partition_point(|&t| t < begin_s);
    let end = record.time_s.partition_point(|&t| t <= analysed.to_s);
    // Tens of kilobytes: not on the stack of a worker thread.
    let mut tracker = Box::new(Tracker::<f32>::new(0.0, 1.0, limits));
    let mut collector = Collector::default();
    let mut windows = Vec::new();
    for yaw_deg in &record.yaw_deg[begin..end] {
        let (_, Some(Finding::Window(window))) = tracker.push(*yaw_deg as f32) else { continue };
        let features = features(network.features, tracker.history(), &window);
        let estimate = network.estimate(&features);
        collector.add(&estimate, features.amplitude_deg, &network.numbers);
        if !network.holds(&estimate) && !flags.contains(&Flag::OutsideTrainedRange) {
            flags.push(Flag::OutsideTrainedRange);
        }
        let middle = window.moment(0.5).since(0);
        windows.push(WindowEstimate {
            time_s: record.time_s[begin] + f64::from(middle) / f64::from(SAMPLE_RATE_HZ),
            amplitude_deg: derivative.of_motion(f64::from(features.amplitude_deg), frequency),
            natural_frequency_rad_s: f64::from(estimate.natural_frequency_rad_s),
            damping_ratio: f64::from(estimate.damping_ratio),
        });
    }
    if windows.is_empty() {
        return Err("no three cycles that the device could analyse".to_owned());
    }
    let [wn, zeta] = collector.result(network.test_rms, network.bias_rms);
    let quantity = |m: Measured| Quantity::new(f64::from(m.value), f64::from(m.u));
    Ok(Values {
        natural_frequency_rad_s: quantity(wn),
        damping_ratio: quantity(zeta),
        windows,
        at_amplitude: Vec::new(),
        flags,
        cramer_rao: None,
        lacking: Lacking::default(),
    })
}

#[cfg(test)]
mod tests {
    use super::super::{identify, Method, Settings};
    use super::*;
    use crate::record::Record;
    use yawrig_rig::{Motion, Samples, Sensor, Start};
    use yawrig_shared::modal::Modal;

    /// The rig's stepwise integration through its sensor, not the closed form trained on.
    fn record(wn: f64, zeta: f64, rate_hz: f64) -> Record {
        let truth = Modal { natural_frequency_rad_s: wn, damping_ratio: zeta };
        let sensor = Sensor { rate_hz, offset_deg: -3.0, ..Sensor::default() };
        let samples = Samples::new(Motion::new(&truth), &Start::default(), &sensor, 5);
        let (time_s, yaw_deg) = samples.map(|s| (s.time_s, s.yaw_deg)).unzip();
        Record::new("made.csv", time_s, yaw_deg)
    }

    #[test]
    fn finds_what_was_planted_at_any_rate() {
        for (wn, zeta, rate_hz) in [(7.5, 0.012, 1000.0), (15.5, 0.003, 500.0), (4.0, 0.05, 200.0)]
        {
            let found =
                identify(&record(wn, zeta, rate_hz), &[Method::Network], &Settings::default());
            let estimate = &found.unwrap().estimates[0];
            let miss_wn = estimate.natural_frequency_rad_s.value / wn - 1.0;
            let miss_zeta = estimate.damping_ratio.value / zeta - 1.0;
            println!("wn {wn} zeta {zeta} {rate_hz} Hz: {miss_wn:+.1e} {miss_zeta:+.1e}");
            // A window's own error is some 1e-4 and 6e-3; several are averaged.
            assert!(miss_wn.abs() < 5e-4 && miss_zeta.abs() < 0.02, "{wn} {zeta} {rate_hz}");
            assert!(estimate.windows.len() >= 2);
            assert_eq!(estimate.flags.contains(&Flag::Resampled), rate_hz != 1000.0);
        }
    }

    #[test]
    fn says_when_a_window_is_outside_what_it_was_trained_on() {
        let fast = identify(&record(30.0, 0.005, 1000.0), &[Method::Network], &Settings::default());
        assert!(fast.unwrap().estimates[0].flags.contains(&Flag::OutsideTrainedRange));
    }
}
