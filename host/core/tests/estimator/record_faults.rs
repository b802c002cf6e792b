//! Faults planted in the rig's records, and sound ones.

use yawrig_core::record::faults::{copies, Facts, FaultKind};
use yawrig_core::record::Record;
use yawrig_rig::{Effects, End, Samples, Sensor, Start};
use yawrig_shared::modal::Modal;

const WN: f64 = 9.0;

fn record_of(noise_deg: f64, adc_step_deg: f64, damping_ratio: f64, seed: u64) -> Record {
    let modal = Modal { natural_frequency_rad_s: WN, damping_ratio };
    let sensor =
        Sensor { rate_hz: 200.0, noise_deg, adc_step_deg, offset_deg: 1.3, ..Sensor::default() };
    let start = Start { amplitude_deg: 12.0, hold_s: 1.0, end: End::After(31.0) };
    let samples =
        Samples::with_effects(&modal, &Effects::default(), &start, &sensor, seed).unwrap();
    let (time_s, yaw_deg) = samples.map(|s| (s.time_s, s.yaw_deg)).unzip();
    Record::new("rig", time_s, yaw_deg)
}

fn faults(record: &Record) -> Vec<FaultKind> {
    let end = record.time_s[record.len() - 1];
    Facts::new(record, 1.2, end, WN).faults.into_iter().map(|fault| fault.kind).collect()
}

#[test]
fn sound_records_have_no_fault() {
    for noise in [0.0, 0.02, 0.1] {
        for step in [0.0, 0.005, 0.088, 0.18] {
            for zeta in [0.0005, 0.005, 0.02] {
                let record = record_of(noise, step, zeta, 7);
                assert_eq!(faults(&record), [], "{noise} {step} {zeta}");
            }
        }
    }
}

#[test]
fn a_reading_that_is_cut_off_is_found() {
    for (noise, step) in [(0.0, 0.005), (0.05, 0.005), (0.05, 0.0), (0.02, 0.088)] {
        for level in [9.0, -6.0] {
            let mut record = record_of(noise, step, 0.005, 3);
            let cut = |y: f64| if level > 0.0 { y.min(level) } else { y.max(level) };
            record.yaw_deg.iter_mut().for_each(|y| *y = cut(*y));
            assert_eq!(faults(&record), [FaultKind::Clipped], "{noise} {step} {level}");
        }
    }
}

#[test]
fn a_dead_spot_is_found() {
    for (noise, step) in [(0.0, 0.005), (0.03, 0.005), (0.03, 0.0)] {
        // The wiper leaves the track: the reading stays where it was, or falls to an end.
        for falls_to in [None, Some(-40.0)] {
            let mut record = record_of(noise, step, 0.005, 4);
            let mut last = 0.0;
            for y in &mut record.yaw_deg {
                if (2.0..2.8).contains(y) {
                    *y = falls_to.unwrap_or(last);
                } else {
                    last = *y;
                }
            }
            let found = faults(&record);
            assert!(found.contains(&FaultKind::DeadSpot), "{noise} {step} {falls_to:?}: {found:?}");
        }
    }
}

#[test]
fn samples_that_are_lost_or_twice_are_found_whatever_the_clock_says() {
    for seed in 1..6 {
        let whole = record_of(0.05, 0.005, 0.005, seed);
        let at = 1200 + 173 * seed as usize;
        // A tenth of a period, and nearly a half.
        for lost in [14, 60] {
            let mut record = whole.clone();
            record.yaw_deg.drain(at..at + lost);
            record.time_s.truncate(record.yaw_deg.len());
            assert_eq!(faults(&record), [FaultKind::LostSamples], "{seed} {lost}");
        }
        let mut record = whole.clone();
        let again = record.yaw_deg[at..at + 20].to_vec();
        record.yaw_deg.splice(at..at, again);
        record.yaw_deg.truncate(record.time_s.len());
        assert_eq!(faults(&record), [FaultKind::LostSamples], "{seed} twice");
    }
}

#[test]
fn copies_are_known_by_their_readings() {
    let of = |record: &Record| Facts::new(record, 1.2, 30.0, WN);
    let (one, other) = (record_of(0.05, 0.005, 0.005, 1), record_of(0.05, 0.005, 0.005, 2));
    // A part of the first, on another clock.
    let part = |range: std::ops::Range<usize>| {
        let time_s = (0..range.len()).map(|k| k as f64 / 100.0).collect();
        Record::new("part", time_s, one.yaw_deg[range].to_vec())
    };
    let (late, all) = (part(1000..one.len()), part(0..one.len()));
    let facts = [of(&one), of(&other), of(&late), of(&all)];
    assert_eq!(copies(&facts), [(0, 2), (0, 3)]);
    assert!(facts[0].is_same(&facts[3]) && !facts[0].is_same(&facts[2]));
}
