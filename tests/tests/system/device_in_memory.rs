//! The firmware's device without a line or a thread: samples in, frames out.
//!
//! The motion is integrated step by step by the virtual rig, another chain than the closed form
//! the network was trained on.

use yawrig_rig::{End, Motion, Samples, Sensor, Start};
use yawrig_shared::derivatives::{Model, Wind, YawDerivatives};
use yawrig_shared::modal::Modal;
use yawrig_shared::wire::{self, Condition, Flags, Phase, Reply, Request, Settings};
use yawrig_tests::desk::Desk;

fn modal(natural_frequency_rad_s: f64, damping_ratio: f64) -> Modal {
    Modal { natural_frequency_rad_s, damping_ratio }
}

fn counts(truth: &Modal, start: &Start, sensor: &Sensor, seed: u64) -> Vec<u16> {
    Samples::new(Motion::new(truth), start, sensor, seed).filter_map(|s| s.counts).collect()
}

fn usual(truth: &Modal, seed: u64) -> Vec<u16> {
    let sensor = Sensor { offset_deg: 2.3, ..Sensor::default() };
    let end = End::Below { amplitude_deg: 0.3, at_most_s: 1800.0 };
    counts(truth, &Start { end, ..Start::default() }, &sensor, seed)
}

/// Whole range of the rig at 0.05 deg noise, each release found, held and let go by itself.
/// Expected: one window's error is some 0.03 % and 1.5 % rms (`yawrig train` prints it); a
/// release averages, but releases of high damping have only one.
#[test]
fn every_release_of_the_range_is_found_and_right() {
    println!("    wn    zeta windows   wn miss %  zeta miss %   zeta u %");
    for wn in [2.5, 4.0, 7.5, 12.0, 15.5, 20.0, 23.5, 26.5] {
        for zeta in [0.001, 0.003, 0.01, 0.03, 0.1] {
            let truth = modal(wn, zeta);
            let mut desk = Desk::default();
            desk.play(usual(&truth, 7));
            assert_eq!(desk.releases.len(), 1, "wn {wn} zeta {zeta}: {:?}", desk.phases);
            let result = desk.releases[0];
            assert!(!result.flags.unusable(), "wn {wn} zeta {zeta}: {:?}", result.flags);
            assert_eq!(result.flags.0 & !Flags::OUT_OF_RANGE.0, 0, "wn {wn} zeta {zeta}");
            assert_eq!(desk.windows.len(), usize::from(result.windows));
            let first = desk.windows[0];
            assert_eq!(first.sent_sample, first.end_sample, "sent by the sample that ends it");
            assert!((first.midline_deg - 2.3).abs() < 0.1, "mid-line {}", first.midline_deg);
            let miss_wn = 100.0 * (f64::from(result.natural_frequency_rad_s.value) / wn - 1.0);
            let miss_zeta = 100.0 * (f64::from(result.damping_ratio.value) / zeta - 1.0);
            let u = 100.0 * f64::from(result.damping_ratio.u) / zeta;
            println!(
                "{wn:6} {zeta:7} {:7}   {miss_wn:9.4}  {miss_zeta:11.3}   {u:8.3}",
                result.windows
            );
            assert!(miss_wn.abs() < 0.1, "wn {wn} zeta {zeta}: wn off by {miss_wn} %");
            // 5e-5 is the network's error near its lower edge.
            let allowed = 1.0 + 100.0 * 5e-5 / zeta;
            assert!(miss_zeta.abs() < allowed, "wn {wn} zeta {zeta}: zeta off by {miss_zeta} %");
        }
    }
}

#[test]
fn phases_come_in_order_and_numbers_have_no_gap() {
    let mut desk = Desk::default();
    for seed in 0..3 {
        desk.play(usual(&modal(7.5, 0.02), seed));
    }
    let release = [Phase::Held, Phase::Released, Phase::Ringing, Phase::Finished];
    // Between two releases the model is turned back by hand.
    let turned = [Phase::Waiting];
    let expected = [&release[..], &turned, &release, &turned, &release].concat();
    assert_eq!(desk.phases, expected);
    assert_eq!(desk.releases.iter().map(|r| r.release).collect::<Vec<_>>(), [0, 1, 2]);
    let expected: Vec<u16> = (0..desk.numbers.len() as u16).collect();
    assert_eq!(desk.numbers, expected);
}

#[test]
fn windows_lie_within_the_range_asked_for() {
    let mut desk = Desk::default();
    let settings = Settings { from_deg: 6.0, to_deg: 2.0, ..Settings::default() };
    assert_eq!(desk.ask(&Request::Configure(settings)), Reply::Done);
    desk.play(usual(&modal(9.0, 0.004), 1));
    let amplitudes: Vec<f32> = desk.windows.iter().map(|w| w.amplitude_deg).collect();
    assert!(amplitudes.len() > 8, "{amplitudes:?}");
    assert!(amplitudes.iter().all(|a| (1.9..6.0).contains(a)), "{amplitudes:?}");
}

#[test]
fn settings_that_make_no_sense_are_refused() {
    let mut desk = Desk::default();
    let wrong = [
        Settings { from_deg: 1.0, to_deg: 2.0, ..Settings::default() },
        Settings { to_deg: 0.0, ..Settings::default() },
        Settings { degrees_per_count: f32::NAN, ..Settings::default() },
        Settings { degrees_per_count: 1e38, ..Settings::default() },
        Settings { degrees_per_count: -1e-38, ..Settings::default() },
        Settings { from_deg: f32::INFINITY, ..Settings::default() },
        Settings { to_deg: 1e-38, ..Settings::default() },
    ];
    for settings in wrong {
        let reply = desk.ask(&Request::Configure(settings));
        assert_eq!(reply, Reply::Refused(wire::Refusal::Settings), "{settings:?}");
    }
}

#[test]
fn a_release_too_small_says_so() {
    let mut desk = Desk::default();
    let start = Start { amplitude_deg: 0.15, hold_s: 2.0, end: End::After(15.0) };
    desk.play(counts(&modal(7.5, 0.01), &start, &Sensor::default(), 1));
    desk.end();
    let flags = desk.releases.first().expect("a result").flags;
    assert!(flags.has(Flags::TOO_SMALL) && flags.unusable(), "{flags:?}");
}

#[test]
fn a_release_with_too_few_cycles_says_so() {
    let mut desk = Desk::default();
    let start = Start { amplitude_deg: 12.0, hold_s: 2.0, end: End::After(4.0) };
    desk.play(counts(&modal(7.5, 0.01), &start, &Sensor::default(), 1));
    desk.end();
    let result = desk.releases.first().expect("a result");
    assert_eq!(result.windows, 0);
    assert!(result.flags.has(Flags::TOO_FEW_CYCLES) && result.flags.has(Flags::CUT_SHORT));
}

#[test]
fn a_saturated_converter_says_so() {
    let mut desk = Desk::default();
    // At 0.005 deg a count the converter ends at 163.8 deg; this one ends at 8 deg.
    let settings = Settings {
        degrees_per_count: 0.005,
        full_scale_counts: 32768 + 1600,
        ..Settings::default()
    };
    desk.ask(&Request::Configure(settings));
    let samples = usual(&modal(7.5, 0.02), 1);
    desk.play(samples.into_iter().map(|c| c.min(32768 + 1600)));
    let result = desk.releases.first().expect("a result");
    assert!(result.flags.has(Flags::SATURATED) && result.flags.unusable(), "{:?}", result.flags);
    // Windows after the clipped swings are clean and are still reported.
    assert!(desk.windows.iter().all(|w| w.amplitude_deg < 6.0), "{:?}", desk.windows);
}

#[test]
fn lost_samples_are_said_and_few_are_bridged() {
    let samples = usual(&modal(7.5, 0.01), 1);
    let half = samples.len() / 2;
    for (lost, windows_go_on) in [(3_u32, true), (500, false)] {
        let mut desk = Desk::default();
        desk.play(samples[..half].iter().copied());
        let before = desk.windows.len();
        desk.device.lost(lost);
        desk.listen();
        desk.play(samples[half + lost as usize..].iter().copied());
        desk.end();
        let result = desk.releases.first().expect("a result");
        assert!(result.flags.has(Flags::LOST_SAMPLES), "{lost}: {:?}", result.flags);
        assert!(result.flags.unusable());
        assert_eq!(result.flags.has(Flags::CUT_SHORT), !windows_go_on, "{lost}");
        assert!(desk.windows.len() > before, "{lost}: windows after the gap");
    }
}

#[test]
fn a_record_that_starts_in_mid_swing_is_taken_from_there() {
    let mut desk = Desk::default();
    let truth = modal(4.0, 0.01);
    let samples = usual(&truth, 3);
    desk.play(samples[2000 + 900..].iter().copied());
    let result = desk.releases.first().expect("a result");
    assert!(result.flags.has(Flags::MID_SWING) && !result.flags.unusable());
    assert!((f64::from(result.natural_frequency_rad_s.value) / 4.0 - 1.0).abs() < 1e-3);
}

#[test]
fn turning_the_model_by_hand_is_no_release() {
    let mut desk = Desk::default();
    // Held at 0, turned to 15 deg within a second, held there.
    let angle = |ms: u32| match ms {
        0..=1999 => 0.0,
        2000..=2999 => {
            15.0 * (1.0 - ((f64::from(ms) - 2000.0) / 1000.0 * std::f64::consts::PI).cos()) / 2.0
        }
        _ => 15.0,
    };
    desk.play((0..6000).map(|ms| (32768.0 + angle(ms) / 0.005) as u16));
    assert!(desk.releases.is_empty(), "{:?}", desk.releases);
    assert_eq!(desk.phases, [Phase::Held, Phase::Released, Phase::Held]);
}

#[test]
fn a_release_stirred_up_again_without_being_held_is_a_new_one() {
    let mut desk = Desk::default();
    let held = usual(&modal(9.0, 0.02), 1);
    let unheld = Start { hold_s: 0.0, ..Start::default() };
    let sensor = Sensor { offset_deg: 2.3, ..Sensor::default() };
    desk.play(held);
    desk.play(counts(&modal(9.0, 0.02), &unheld, &sensor, 2));
    assert_eq!(desk.releases.len(), 2, "{:?}", desk.phases);
    assert!(desk.releases[1].flags.has(Flags::MID_SWING));
    assert!(!desk.releases[1].flags.unusable());
}

#[test]
fn the_device_gives_derivatives_once_it_holds_a_reference() {
    let model = Model { length_m: 0.625, frontal_area_m2: 0.036 };
    let wind = |speed_m_s| Wind { density_kg_m3: 1.2, speed_m_s };
    let condition = |speed| Condition { rig: 1, wind: wind(speed), model, inertia_kg_m2: 0.101 };
    let off = modal(7.784, 0.0041);
    let planted = YawDerivatives { cn_beta: 0.5321, cn_r: -0.0901 };
    let on = planted.wind_on(&off, 0.101, &wind(10.0), &model).unwrap();
    let mut desk = Desk::default();
    // Wind on without a reference: no derivatives.
    desk.ask(&Request::Condition(condition(10.0)));
    desk.play(usual(&on, 1));
    assert_eq!(desk.releases[0].derivatives, None);
    assert!(desk.releases[0].flags.has(Flags::NO_REFERENCE));
    desk.ask(&Request::Condition(condition(0.0)));
    desk.play(usual(&off, 2));
    assert_eq!(desk.releases[1].derivatives, None);
    desk.ask(&Request::Condition(condition(10.0)));
    desk.play(usual(&on, 3));
    let found = desk.releases[2].derivatives.expect("derivatives");
    assert!((f64::from(found.cn_beta.value) / planted.cn_beta - 1.0).abs() < 0.02, "{found:?}");
    assert!((f64::from(found.cn_r.value) / planted.cn_r - 1.0).abs() < 0.06, "{found:?}");
}

/// The mean's stated uncertainty against its error over many releases. The network's bias is
/// part of it, so for these middling cases the coverage of one standard uncertainty must be at
/// least the normal's 68 % less the spread of 60 draws (6 %, twice).
#[test]
fn stated_uncertainties_cover_the_error() {
    let (mut within, mut all) = ([0, 0], 0);
    for seed in 0..60_u64 {
        let truth = modal(5.0 + 0.3 * seed as f64, 0.004 + 0.0003 * seed as f64);
        let mut desk = Desk::default();
        desk.play(usual(&truth, seed));
        let result = desk.releases[0];
        let covers = |m: wire::Measured, t: f64| (f64::from(m.value) - t).abs() <= f64::from(m.u);
        within[0] +=
            usize::from(covers(result.natural_frequency_rad_s, truth.natural_frequency_rad_s));
        within[1] += usize::from(covers(result.damping_ratio, truth.damping_ratio));
        all += 1;
    }
    println!("k = 1 covers wn in {} and zeta in {} of {all}", within[0], within[1]);
    assert!(within.iter().all(|&w| w as f64 >= 0.56 * all as f64), "{within:?} of {all}");
}

/// The same release again, whatever it came after: its record is its own. What was there before shows in the
/// noise that turning points are found from, and by it in the rounding of the means.
#[test]
fn a_refined_estimate_does_not_depend_on_the_release_before() {
    let mut one = usual(&modal(7.5, 0.02), 1);
    // The device takes samples by eights.
    one.truncate(one.len() / 8 * 8);
    let other = usual(&modal(20.0, 0.01), 2);
    let refined = |records: [&[u16]; 2]| {
        let mut desk = Desk::default();
        records.iter().for_each(|record| desk.play(record.iter().copied()));
        desk.end();
        desk.refined
    };
    let (alone, after) = (refined([&other, &[]]), refined([&one, &other]));
    let [first, second] = after[..] else { panic!("{after:?}") };
    assert_eq!(refined([&one, &[]]), [first]);
    assert_eq!((first.release, second.release), (0, 1));
    let [alone] = alone[..] else { panic!("{alone:?}") };
    assert_eq!(second.from_sample - one.len() as u32, alone.from_sample);
    assert_eq!(second.samples, alone.samples);
    let (a, b) = (second.natural_frequency_rad_s, alone.natural_frequency_rad_s);
    assert!((a.value - b.value).abs() < f64::from(0.05 * b.u), "{second:?} {alone:?}");
    let (a, b) = (second.damping_ratio, alone.damping_ratio);
    assert!((a.value - b.value).abs() < 0.05 * b.u, "{second:?} {alone:?}");
}

/// A board that is too busy to refine loses no release, and no estimate becomes another release's.
#[test]
fn a_refinement_that_waits_holds_up_nothing() {
    let mut desk = Desk::default();
    let records = [usual(&modal(7.5, 0.02), 1), usual(&modal(20.0, 0.01), 2)];
    for count in records.iter().flatten() {
        desk.device.sample(*count);
        desk.listen();
    }
    assert_eq!(desk.releases.len(), 2);
    assert!(desk.refined.is_empty());
    desk.end();
    let [refined] = desk.refined[..] else { panic!("{:?}", desk.refined) };
    assert_eq!(refined.release, 0);
    assert!((refined.natural_frequency_rad_s.value / 7.5 - 1.0).abs() < 1e-4, "{refined:?}");
}

#[test]
fn an_oscillation_that_grows_is_refined_too() {
    let mut desk = Desk::default();
    let truth = modal(7.5, -0.004);
    let start = Start { amplitude_deg: 2.0, hold_s: 2.0, end: End::After(60.0) };
    desk.play(counts(&truth, &start, &Sensor::default(), 1));
    desk.end();
    let refined = desk.refined.first().expect("a refined estimate");
    let miss = f64::from(refined.damping_ratio.value) + 0.004;
    assert!(miss.abs() < 4.0 * f64::from(refined.damping_ratio.u), "{refined:?}");
    assert!(!refined.flags.has(Flags::MISFIT), "{refined:?}");
}
