//! From the wiper's voltage to the damping ratio, through the whole of the board's image.
//!
//! The virtual rig integrates the motion and adds the noise, sixteen times a millisecond; the wiper makes a voltage of it and
//! the converter 12 bits of that. What the image refines is held against what was planted, in its own standard uncertainties.

use crate::harness::{Board, Both};
use yawrig_rig::{End, Motion, Samples, Sensor, Start};
use yawrig_shared::modal::Modal;
use yawrig_shared::wire::{Event, Flags, Reply, Request, Settings};

const SUPPLY_V: f64 = 3.3;
const TRAVEL_DEG: f64 = 340.0;
const CONVERSIONS_HZ: f64 = 16_000.0;

/// Where the rig rests on the potentiometer's track, 0 in its middle; how far it is let go from there; the noise.
#[derive(Clone, Copy, Debug)]
struct Case {
    zero_deg: f64,
    amplitude_deg: f64,
    noise_deg: f64,
}

/// Readings of the converter: its first step is at half of one (data sheet, 6.3.20).
fn readings(truth: &Modal, case: &Case, seed: u64) -> Vec<u16> {
    let end = End::Below { amplitude_deg: 0.7, at_most_s: 120.0 };
    let start = Start { amplitude_deg: case.amplitude_deg, hold_s: 2.0, end };
    let sensor = Sensor {
        rate_hz: CONVERSIONS_HZ,
        noise_deg: case.noise_deg,
        noise_correlation: 0.0,
        offset_deg: case.zero_deg,
        adc_step_deg: 0.0,
        ..Sensor::default()
    };
    let wiper_v = |yaw_deg: f64| SUPPLY_V * (0.5 + yaw_deg / TRAVEL_DEG);
    let reading = |volts: f64| (volts / SUPPLY_V * 4096.0).round().clamp(0.0, 4095.0) as u16;
    Samples::new(Motion::new(truth), &start, &sensor, seed)
        .map(|sample| reading(wiper_v(sample.yaw_deg)))
        .collect()
}

/// What is refined is what was planted, wherever the rig rests.
pub fn what_is_refined_is_what_was_planted<B: Board>() {
    // The middle of the track, where a rig is centred, lies on a multiple of 4096 counts.
    let cases = [(0.0, 12.0, 0.08), (0.3, 6.0, 0.05), (-21.25, 15.0, 0.2), (63.0, 9.0, 0.05)]
        .map(|(zero_deg, amplitude_deg, noise_deg)| Case { zero_deg, amplitude_deg, noise_deg });
    let truth = Modal { natural_frequency_rad_s: 12.0, damping_ratio: 0.012 };
    let degrees_per_count = (TRAVEL_DEG / 65_536.0) as f32;
    let settings = Settings { degrees_per_count, ..Settings::default() };
    println!(
        "{:>8} {:>9} {:>6} | zeta        off by u | wn           off by u",
        "zero", "let go", "noise"
    );
    let mut wrong = Vec::new();
    for (seed, case) in (1..).zip(cases) {
        // Another rig each time: one that jumps from rest to rest is noisy.
        let mut both = Both::<B>::start();
        assert_eq!(both.ask(&Request::Configure(settings)), Reply::Done);
        both.events.clear();
        both.convert(&readings(&truth, &case, seed));
        assert_eq!(both.ask(&Request::EndRelease { after_samples: 0 }), Reply::Done);
        // Its rest, while which it is refined.
        both.play(&[2048; 1600]);
        let refined = both.events.iter().find_map(|event| match event {
            Event::Refined(refined) => Some(*refined),
            _ => None,
        });
        let refined = refined.unwrap_or_else(|| panic!("{case:?}: {:?}", both.events));
        let (zeta, wn) = (refined.damping_ratio, refined.natural_frequency_rad_s);
        let off = [
            (f64::from(zeta.value) - truth.damping_ratio) / f64::from(zeta.u),
            (wn.value - truth.natural_frequency_rad_s) / f64::from(wn.u),
        ];
        let Case { zero_deg, amplitude_deg, noise_deg } = case;
        println!(
            "{zero_deg:8} {amplitude_deg:9} {noise_deg:6} | {:.8} {:+7.2} | {:.7} {:+7.2}",
            zeta.value, off[0], wn.value, off[1]
        );
        if off.iter().any(|off| off.abs() > 3.0) || refined.flags != Flags::default() {
            wrong.push(format!("{case:?}: {off:?}, {refined:?}"));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}
