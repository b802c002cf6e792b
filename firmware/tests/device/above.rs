//! Releases that stay above the range, or fall to it late.

use crate::desk::{Desk, Swing};
use yawrig_firmware::slots::MemoryFlash;
use yawrig_shared::wire::{counting, Counting, Flags, Refined};

/// The one refined result of a release from `swing.from_deg`, checked against what was planted.
fn refined(swing: &Swing, seed: u32) -> Refined {
    let mut desk = Desk::new(MemoryFlash::new());
    desk.play(swing.counts(seed));
    desk.end();
    let [refined] = desk.refined[..] else { panic!("{swing:?}: {:?}", desk.refined) };
    let counts = counting(desk.releases.last(), Some(&refined));
    assert_eq!(counts, Some(Counting::Refined), "{swing:?}: {refined:?}");
    let (wn, zeta) = (refined.natural_frequency_rad_s, refined.damping_ratio);
    let off = [
        (wn.value - swing.wn) / f64::from(wn.u),
        (f64::from(zeta.value) - swing.zeta) / f64::from(zeta.u),
    ];
    // By chance of the sixteen of both tests: once in a thousand.
    assert!(off.iter().all(|off| off.abs() < 4.0), "{swing:?}: {off:.1?} {refined:?}");
    refined
}

/// From 14 deg to no less than 10.2, the range beginning at 10: the record is what there is, and is all of it.
#[test]
fn a_release_that_never_falls_to_the_range_is_refined_by_what_there_is() {
    let wind_up = Swing::HELD as f64 * 1e-3;
    for (seed, (wn, zeta)) in
        [(3.0, 0.002), (8.0, 0.002), (8.0, 5e-4), (26.5, 1e-3)].iter().enumerate()
    {
        let seconds = wind_up + (14.0_f64 / 10.2).ln() / (zeta * wn);
        let swing = Swing { from_deg: 14.0, seconds, ..Swing::new(*wn, *zeta) };
        let found = refined(&swing, seed as u32 + 1);
        assert_eq!(found.flags.without(Flags::WIDENED), Flags::CUT_SHORT, "{swing:?}");
        // But for the hold, its first swing and what the buffer's coarsest mean leaves over.
        let lacking = seconds - wind_up - f64::from(found.samples) * 1e-3;
        let swing_seconds = std::f64::consts::PI / wn;
        assert!(lacking < swing_seconds + 0.3, "{swing:?}: {lacking:.2} s are not used");
    }
}

/// What was above is no part of the record then: over half a minute of it, which the buffer holds in longer
/// means, and of the fastest more than it holds at all.
#[test]
fn a_record_begins_within_the_range_however_long_it_was_above() {
    for (seed, (wn, zeta, from_deg)) in
        [(3.0, 0.02, 12.0), (8.0, 2e-3, 20.0), (8.0, 5e-4, 12.0), (26.5, 1e-4, 20.0)]
            .into_iter()
            .enumerate()
    {
        let to_range = (from_deg / 10.0_f64).ln() / (zeta * wn);
        let seconds = Swing::HELD as f64 * 1e-3 + to_range + 40.0;
        let swing = Swing { from_deg, seconds, ..Swing::new(wn, zeta) };
        let found = refined(&swing, seed as u32 + 11);
        let begins = f64::from(found.from_sample - Swing::HELD as u32) * 1e-3;
        // A height is known to the noise, and a cycle ends where it ends.
        let known = swing.noise_deg / (10.0 * zeta * wn) + 2.0 * std::f64::consts::PI / wn;
        assert!(
            (begins - to_range).abs() < known,
            "{swing:?}: from {begins:.2} s, the range from {to_range:.2} s"
        );
    }
}

/// Less than a window's three cycles above it: what was asked for has not begun, and there is no result to be
/// taken for one.
#[test]
fn too_short_a_record_above_the_range_is_not_refined() {
    for (wn, cycles) in [(3.0, 2.6), (8.0, 1.5), (26.5, 2.6)] {
        let seconds = Swing::HELD as f64 * 1e-3 + cycles * 2.0 * std::f64::consts::PI / wn;
        let swing = Swing { from_deg: 20.0, seconds, ..Swing::new(wn, 0.01) };
        let mut desk = Desk::new(MemoryFlash::new());
        desk.play(swing.counts(5));
        desk.end();
        assert!(desk.refined.is_empty(), "{swing:?}: {:?}", desk.refined);
        let [release] = &desk.releases[..] else { panic!("{swing:?}: {:?}", desk.releases) };
        assert!(release.flags.has(Flags::TOO_FEW_CYCLES), "{swing:?}: {release:?}");
        assert_eq!(counting(Some(release), None), None);
    }
}
