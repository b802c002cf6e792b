//! The signal is judged in degrees, whatever a count is: the same releases and the same wild readings on
//! potentiometers of 20 to 3600 degrees of travel.

use crate::desk::{Desk, Swing};
use yawrig_firmware::slots::MemoryFlash;
use yawrig_shared::wire::{Flags, Reply, Request, Settings};

const TRAVELS_DEG: [f64; 4] = [20.0, 60.0, 340.0, 3600.0];
const NOISES_DEG: [f64; 3] = [0.02, 0.05, 0.2];

fn configured(degrees_per_count: f64) -> Desk {
    let mut desk = Desk::new(MemoryFlash::new());
    let degrees_per_count = degrees_per_count as f32;
    let settings = Settings { degrees_per_count, from_deg: 8.0, ..Settings::default() };
    assert_eq!(desk.ask(&Request::Configure(settings)), Reply::Done);
    desk
}

fn swing(travel_deg: f64, noise_deg: f64, wn: f64) -> Swing {
    let degrees_per_count = travel_deg / 65_536.0;
    Swing { from_deg: 9.0, noise_deg, degrees_per_count, ..Swing::new(wn, 0.01) }
}

#[test]
fn a_release_in_order_is_right_and_clean_at_every_scale() {
    for travel_deg in TRAVELS_DEG {
        for noise_deg in NOISES_DEG {
            for wn in [3.5, 12.0, 24.0] {
                let swing = swing(travel_deg, noise_deg, wn);
                let mut desk = configured(swing.degrees_per_count);
                desk.play(swing.counts(7));
                desk.end();
                let what = format!("{travel_deg} deg, noise {noise_deg}, wn {wn}");
                let [result] = desk.releases[..] else { panic!("{what}: {:?}", desk.releases) };
                assert_eq!(result.flags, Flags::default(), "{what}");
                let miss = f64::from(result.natural_frequency_rad_s.value) / wn - 1.0;
                assert!(miss.abs() < 2e-3, "{what}: wn off by {miss}");
            }
        }
    }
}

/// Single readings that are 5 to 8 deg off, three times the limit at which no model can be.
#[test]
fn wild_readings_are_bridged_and_said_at_every_scale() {
    for travel_deg in TRAVELS_DEG {
        for noise_deg in NOISES_DEG {
            let swing = swing(travel_deg, noise_deg, 8.0);
            let mut desk = configured(swing.degrees_per_count);
            let mut counts = swing.counts(3);
            for (n, at) in (5000..15_000).step_by(1111).enumerate() {
                let off = (5.0 + n as f64 / 3.0) / swing.degrees_per_count;
                // Towards the middle, where there is room.
                let away = if counts[at] > 32_768 { -off } else { off };
                counts[at] = (f64::from(counts[at]) + away) as u16;
            }
            desk.play(counts);
            desk.end();
            let what = format!("{travel_deg} deg, noise {noise_deg}");
            let [result] = desk.releases[..] else { panic!("{what}: {:?}", desk.releases) };
            assert_eq!(result.flags, Flags::SPIKES, "{what}");
            let miss = f64::from(result.damping_ratio.value) / swing.zeta - 1.0;
            assert!(miss.abs() < 0.05, "{what}: zeta off by {miss}");
        }
    }
}

/// Whatever scale was set before: with the right one the next release is found.
#[test]
fn a_wrong_scale_that_is_put_right_leaves_nothing_behind() {
    let swing = swing(340.0, 0.05, 8.0);
    let counts = swing.counts(1);
    let with =
        |degrees_per_count| Settings { degrees_per_count, from_deg: 8.0, ..Settings::default() };
    let right = with(swing.degrees_per_count as f32);
    for scale in [1e38, 1e9, 100.0, -100.0, 1.0, 1e-6, 1e-38] {
        let mut desk = configured(swing.degrees_per_count);
        desk.play(counts[..1000].iter().copied());
        let taken = desk.ask(&Request::Configure(with(scale)));
        assert_eq!(taken == Reply::Done, (1e-6..=100.0).contains(&scale.abs()), "{scale}");
        desk.play(counts[..500].iter().copied());
        assert_eq!(desk.ask(&Request::Configure(right)), Reply::Done);
        desk.play(counts.iter().copied());
        desk.end();
        let result = desk.releases.last().unwrap_or_else(|| panic!("{scale}: no release"));
        assert_eq!(result.flags, Flags::default(), "{scale}");
        let miss = f64::from(result.natural_frequency_rad_s.value) / 8.0 - 1.0;
        assert!(miss.abs() < 2e-3, "{scale}: {miss}");
    }
}

/// Settings that come while the model is held, or swings, take the noise and the rest they have seen with
/// them.
#[test]
fn a_scale_that_comes_in_mid_release_takes_effect_with_the_next() {
    let swing = swing(340.0, 0.05, 8.0);
    let mut desk = configured(swing.degrees_per_count);
    let counts = swing.counts(1);
    let settings = Settings {
        degrees_per_count: (20.0 / 65_536.0) as f32,
        from_deg: 8.0,
        ..Settings::default()
    };
    let (first, rest) = counts.split_at(5000);
    desk.play(first.iter().copied());
    assert_eq!(desk.ask(&Request::Configure(settings)), Reply::Done);
    // A program that puts back what a reset took away reads here that it is there again.
    assert_eq!(desk.status().settings, settings);
    desk.play(rest.iter().copied());
    // Comes to rest, is turned by hand and released again, on the finer potentiometer.
    let fine = Swing { degrees_per_count: 20.0 / 65_536.0, wn: 24.0, ..swing };
    desk.play((0..3000).map(|k| 32_768 + k / 500 % 2));
    let eased = |k: f64| 4.5 * (1.0 - (std::f64::consts::PI * k / 500.0).cos());
    desk.play((0..500_u16).map(|k| 32_768 + (eased(k.into()) / fine.degrees_per_count) as u16));
    desk.play(fine.counts(2));
    let [first, second] = desk.releases[..] else { panic!("{:?}", desk.releases) };
    assert_eq!((first.flags, second.flags), (Flags::default(), Flags::default()));
    let misses = [(first, 8.0), (second, 24.0)]
        .map(|(result, wn)| f64::from(result.natural_frequency_rad_s.value) / wn - 1.0);
    assert!(misses.iter().all(|miss| miss.abs() < 2e-3), "{misses:?}");
}
