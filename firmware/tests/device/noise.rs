//! A model that is held is seen to be, whatever the potentiometer's noise up to 1 deg rms.

use crate::desk::{Desk, Swing};
use yawrig_firmware::slots::MemoryFlash;
use yawrig_shared::wire::{Flags, Phase};

/// Let go at 12 deg. At 1 deg of noise the last windows, at 2 deg, are known to some per cent; a release's
/// mean, weighted by the amplitude squared, to 2 % at most.
#[test]
fn held_and_let_go_are_seen_at_any_noise() {
    let mut wrong = Vec::new();
    for noise_deg in [0.02, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.7, 1.0] {
        for wn in [3.5, 8.0, 16.0, 24.0] {
            for seed in 1..4 {
                // To its rest, and five seconds there.
                let mut swing = Swing { noise_deg, ..Swing::new(wn, 0.01) };
                swing.seconds = 7.0 + (12.0_f64 / 0.1).ln() / (swing.zeta * wn);
                let mut desk = Desk::new(MemoryFlash::new());
                let counts = swing.counts(seed);
                desk.play(counts[..Swing::HELD - 200].iter().copied());
                let held = desk.device.phase();
                desk.play(counts[Swing::HELD - 200..].iter().copied());
                let releases = std::mem::take(&mut desk.releases);
                let what = format!("noise {noise_deg}, wn {wn}, seed {seed}");
                if held != Phase::Held {
                    wrong.push(format!("{what}: {held:?} where it is held"));
                }
                let Some(result) = releases.first() else {
                    wrong.push(format!("{what}: no release"));
                    continue;
                };
                let miss = f64::from(result.natural_frequency_rad_s.value) / wn - 1.0;
                if result.flags.has(Flags::MID_SWING) || result.windows == 0 || miss.abs() > 0.02 {
                    wrong.push(format!("{what}: off by {miss}, {result:?}"));
                }
                // Beyond 0.7 deg the end of a slow swing may be taken for another one, and its flag says what
                // it is.
                let flagged = releases.iter().all(|release| release.flags.has(Flags::NOISY));
                if releases.len() > 1 && !(noise_deg > 0.7 && flagged) {
                    wrong.push(format!("{what}: {} releases", releases.len()));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{} of 108: {wrong:#?}", wrong.len());
}
