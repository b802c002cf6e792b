//! The clock counts samples in 32 bits and goes round after 49.7 days; the numbers of events in 16.

use yawrig_rig::{End, Motion, Samples, Sensor, Start};
use yawrig_shared::modal::Modal;
use yawrig_shared::wire::{Flags, Reply, Request, Status, TRIAL_SAMPLES};
use yawrig_tests::desk::Desk;
use yawrig_tests::networks::sound;

const TRUTH: Modal = Modal { natural_frequency_rad_s: 9.0, damping_ratio: 0.02 };

fn release() -> Vec<u16> {
    let start =
        Start { end: End::Below { amplitude_deg: 0.6, at_most_s: 60.0 }, ..Start::default() };
    let samples = Samples::new(Motion::new(&TRUTH), &start, &Sensor::default(), 5);
    samples.filter_map(|s| s.counts).collect()
}

/// A device whose clock stands at `sample`, as after a gap that long.
fn at(sample: u32) -> Desk {
    let mut desk = Desk::default();
    desk.lost(sample);
    assert_eq!(status(&mut desk).samples, sample);
    desk
}

fn status(desk: &mut Desk) -> Status {
    match desk.ask(&Request::Status) {
        Reply::Status(status) => status,
        other => panic!("{other:?}"),
    }
}

/// What it makes of a release that begins at `begin`, its moments counted from there.
fn made_of_it(begin: u32) -> String {
    let mut desk = at(begin);
    desk.play(release());
    assert_eq!(desk.releases.len(), 1, "{begin}: {:?}", desk.phases);
    for window in &mut desk.windows {
        for sample in [&mut window.start_sample, &mut window.end_sample, &mut window.sent_sample] {
            *sample = sample.wrapping_sub(begin);
        }
    }
    let result = &mut desk.releases[0];
    assert_eq!(result.flags, Flags::default(), "{begin}");
    for sample in [&mut result.release_sample, &mut result.finished_sample] {
        *sample = sample.wrapping_sub(begin);
    }
    format!("{:?} {:?} {:?}", desk.releases, desk.windows, desk.phases)
}

/// It goes round while the model is held, at the let-go, within every part of a window, at a window's end and
/// after.
#[test]
fn a_release_across_the_wrap_gives_the_same_bits() {
    let length = release().len() as u32;
    let plain = made_of_it(8000);
    // A step that falls on every place within a window sooner or later; whole blocks of eight samples.
    for before in (0..length + 400).step_by(8 * 23) {
        assert_eq!(
            made_of_it(0_u32.wrapping_sub(before / 8 * 8)),
            plain,
            "{before} samples before"
        );
    }
    // Just before, at and after the let-go at 2000.
    for before in [1992, 2000, 2008, 2016] {
        assert_eq!(made_of_it(0_u32.wrapping_sub(before)), plain, "{before} samples before");
    }
}

#[test]
fn a_release_is_ended_at_its_sample_across_the_wrap() {
    for (begin, after) in
        [(u32::MAX - 5000, 1000_u32), (u32::MAX - 5000, u32::MAX - 10), (50, 6000)]
    {
        let mut desk = at(begin);
        assert_eq!(desk.ask(&Request::EndRelease { after_samples: after }), Reply::Done);
        desk.play(release());
        let result = desk.releases.first().expect("a result");
        assert!(result.flags.has(Flags::CUT_SHORT), "{begin} {after}");
        assert_eq!(result.finished_sample, after.wrapping_sub(1), "{begin} {after}");
    }
}

#[test]
fn a_trial_is_given_up_in_time_across_the_wrap() {
    let mut desk = at(u32::MAX - TRIAL_SAMPLES / 2);
    let mut blob = sound();
    yawrig_shared::blob::set_generation(&mut blob, 3).expect("a blob");
    assert_eq!(desk.ask(&Request::FlashBegin { length: blob.len() as u32 }), Reply::Done);
    for (index, chunk) in blob.chunks(256).enumerate() {
        let bytes = chunk.iter().copied().collect();
        let chunk = Request::FlashChunk { offset: 256 * index as u32, bytes };
        assert_eq!(desk.ask(&chunk), Reply::Done);
    }
    assert_eq!(desk.ask(&Request::FlashTrial), Reply::Done);
    desk.play(vec![32_768; TRIAL_SAMPLES as usize]);
    assert!(status(&mut desk).network.on_trial, "not a sample too early");
    desk.play([32_768]);
    assert!(!status(&mut desk).network.on_trial, "nor too late");
}

#[test]
fn a_gap_counts_in_the_clock() {
    let mut desk = Desk::default();
    desk.play(vec![32_768; 1003]);
    desk.lost(500);
    desk.play(vec![32_768; 10]);
    desk.lost(3);
    let status = status(&mut desk);
    assert_eq!((status.samples, status.lost_samples), (1516, 503));
}
