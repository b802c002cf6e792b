//! From the converter to the device: when conversions come, what is read of the ring DMA writes, and the
//! samples they make.

use crate::desk::{Desk, Swing};
use yawrig_firmware::conversions::{period, CONVERSIONS, CONVERSIONS_HZ};
use yawrig_firmware::input::Input;
use yawrig_firmware::ring::Reader;
use yawrig_firmware::sensors::potentiometer::Potentiometer;
use yawrig_firmware::slots::MemoryFlash;
use yawrig_firmware::sums::Sums;
use yawrig_shared::wire::{Phase, Reply, Request, Settings, STREAM_CHUNK};

#[test]
fn the_sampling_rate_is_exact_or_refused() {
    assert_eq!(CONVERSIONS_HZ, 16_000);
    assert_eq!(period(84_000_000), Some(5249));
    for clock_mhz in (2..=180).step_by(2) {
        let clock_hz = clock_mhz * 1_000_000;
        assert_eq!((period(clock_hz).expect("exact") + 1) * CONVERSIONS_HZ, clock_hz);
    }
    for inexact in [0, 15_999, 999_999, 84_000_001, 32_768] {
        assert_eq!(period(inexact), None);
    }
}

#[test]
fn every_reading_is_taken_once_or_counted_as_lost() {
    const RING: usize = 64;
    let mut memory = [u32::MAX; RING];
    // The count wraps on the way.
    let begun = u32::MAX - 5000;
    let mut reader = Reader::<RING>::new();
    while reader.overwritten(begun, 1) != 0 {}
    while reader.next(begun).is_some() {}
    let (mut written, mut expected, mut lost_in_all) = (begun, begun, 0);
    let mut state = 1_u32;
    for _ in 0..2000 {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        // Mostly a few, now and then more than the ring holds.
        let count = if state >> 28 == 0 { state >> 8 & 0xff } else { state >> 8 & 7 };
        for _ in 0..count {
            memory[written as usize % RING] = written;
            written = written.wrapping_add(1);
        }
        // The trigger of the next one may have been counted, or one more have come after the count.
        let triggers = match state >> 20 & 3 {
            0 => written.wrapping_add(1),
            1 => written.wrapping_sub(1),
            _ => written,
        };
        let made = Reader::<RING>::made(triggers, written % RING as u32).expect("they agree");
        assert_eq!(made, written);
        let lost = reader.overwritten(made, 1);
        assert!(lost == 0 || count > RING as u32 / 2);
        lost_in_all += lost;
        expected = expected.wrapping_add(lost);
        while let Some(at) = reader.next(made) {
            assert_eq!(memory[at], expected);
            expected = expected.wrapping_add(1);
        }
        assert_eq!(expected, written);
    }
    assert!(lost_in_all > 0 && written < begun, "both happened");
    // A reading that went missing shows, and all that was not taken counts.
    assert_eq!(Reader::<RING>::made(written.wrapping_add(2), written % RING as u32), None);
    assert_eq!(reader.begin_anew(written.wrapping_add(2)), 2);
    assert_eq!(reader.next(0), None);
}

#[test]
fn bytes_are_read_up_to_where_dma_writes() {
    let mut reader = Reader::<16>::new();
    let mut read = |position| {
        let mut found = Vec::new();
        while reader.has_before(position) {
            found.push(reader.next_before(position).expect("there is one"));
        }
        assert_eq!(reader.next_before(position), None);
        found
    };
    assert_eq!(read(0), []);
    assert_eq!(read(3), [0, 1, 2]);
    assert_eq!(read(3), []);
    assert_eq!(read(14), (3..14).collect::<Vec<_>>());
    // Around the end; DMA's counter shows 16 as 0.
    assert_eq!(read(2), [14, 15, 0, 1]);
    assert_eq!(read(16), (2..16).collect::<Vec<_>>());
}

/// A ring that DMA has gone round unread is noticed, and nothing of it is taken for new; the end of the ring
/// alone is nothing.
#[test]
fn a_ring_that_is_overtaken_is_noticed() {
    let mut reader = Reader::<16>::new();
    let take = |reader: &mut Reader<16>, position| {
        let mut found = Vec::new();
        while let Some(at) = reader.next_before(position) {
            found.push(at);
        }
        found
    };
    assert!(!reader.overtaken(false, 10));
    assert_eq!(take(&mut reader, 10).len(), 10);
    // Round the end and not past the reader.
    assert!(reader.is_behind(4) && !reader.overtaken(true, 4));
    assert_eq!(take(&mut reader, 4), [10, 11, 12, 13, 14, 15, 0, 1, 2, 3]);
    // The flag of a wrap that came after it was looked at, cleared by the position: no second time.
    assert!(!reader.is_behind(4) && !reader.overtaken(false, 5));
    assert_eq!(take(&mut reader, 5), [4]);
    // Eighteen bytes since: the two that are left are of a frame whose beginning is gone.
    assert!(reader.overtaken(true, 7));
    assert_eq!(take(&mut reader, 7), []);
    assert_eq!(take(&mut reader, 9), [7, 8]);
}

/// What is overwritten is left out by whole samples: those after it are of sixteen conversions of their own.
#[test]
fn samples_stay_whole_where_conversions_were_overwritten() {
    let mut reader = Reader::<64>::new();
    assert_eq!((reader.overwritten(16, 16), reader.waiting(16)), (0, 16));
    while reader.next(16).is_some() {}
    for (made, lost) in [(72, 0), (73, 16), (90, 32), (106, 48)] {
        let mut reader = reader;
        assert_eq!(reader.overwritten(made, 16), lost, "{made}");
        let first = reader.next(made).expect("one is left");
        assert_eq!(first, (16 + lost as usize) % 64, "{made}");
    }
}

/// A sample follows the readings in a straight line from end to end: where one reading of the sixteen rises
/// by a step, the sample does by one count, at the middle of the converter and at every other multiple of
/// 4096 as well.
#[test]
fn a_sample_is_linear_in_its_readings_and_its_ends_are_known() {
    const RING: usize = 64;
    let stream = Request::Stream { samples: 1 << 20 };
    let mut desk = Desk::new(MemoryFlash::new());
    let mut counts = Vec::new();
    let mut reader = Reader::<RING>::new();
    let mut input = Input::new(Potentiometer::<CONVERSIONS>);
    let mut written = 0;
    let sums = (0..=CONVERSIONS * 0x0fff).step_by(7).chain(4090..4100).chain(32_760..32_776);
    let sums: Vec<u32> = sums.chain([CONVERSIONS * 0x0fff]).collect();
    assert_eq!(desk.ask(&stream), Reply::Done);
    for sum in &sums {
        // As even as noise would leave them.
        let reading = |at: usize| (sum / CONVERSIONS + u32::from(at as u32 % 16 < sum % 16)) as u16;
        written += CONVERSIONS;
        assert!(reader.give(written, Some(written), reading, &mut input, &mut desk.device));
        counts.extend(desk.streamed());
    }
    // Those that fill no message yet.
    let whole = sums.len() / STREAM_CHUNK * STREAM_CHUNK;
    assert_eq!(counts.len(), whole);
    for (sum, counts) in sums.iter().zip(&counts) {
        assert_eq!(u32::from(*counts), *sum);
    }
    assert_eq!(u32::from(Settings::default().full_scale_counts), CONVERSIONS * 0x0fff);
}

/// The error of a sample against that of one conversion, 340 deg over 12 bits, the model moving slowly: a
/// quarter where the potentiometer's noise is half a step or more, and next to nothing gained where there is
/// none to blur the steps.
#[test]
fn sixteen_conversions_lower_the_noise_floor_to_a_quarter() {
    const STEP_DEG: f64 = 340.0 / 4096.0;
    let mut state = 1_u64;
    let mut even = || {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    println!("noise deg   one conversion deg rms   sixteen deg rms   ratio");
    for (noise_steps, most) in [(0.0, 1.01), (0.25, 0.45), (0.5, 0.28), (1.0, 0.26), (2.0, 0.26)] {
        let (mut single, mut summed) = (0.0, 0.0);
        let count = 20_000;
        for k in 0..count {
            // Over some hundred steps, each place between two of them as often as any other.
            let at = 1000.0 + 100.0 * f64::from(k) / f64::from(count);
            let mut read = || {
                let noise: f64 = (0..12).map(|_| even()).sum::<f64>() - 6.0;
                (at + noise_steps * noise).round().clamp(0.0, 4095.0) as u32
            };
            let readings: [u32; CONVERSIONS as usize] = std::array::from_fn(|_| read());
            let sample = f64::from(readings.iter().sum::<u32>()) / f64::from(CONVERSIONS);
            single += (f64::from(readings[0]) - at).powi(2);
            summed += (sample - at).powi(2);
        }
        let [single, summed] =
            [single, summed].map(|sum| STEP_DEG * (sum / f64::from(count)).sqrt());
        let ratio = summed / single;
        println!("{:9.4}   {single:22.4}   {summed:15.4}   {ratio:5.3}", noise_steps * STEP_DEG);
        assert!(ratio < most, "{noise_steps}: {ratio}");
    }
}

/// Samples of the conversions in a ring as DMA writes it; of those the board was too late for, the time.
#[test]
fn a_ring_s_samples_reach_the_device_whole_and_only_they_feed_the_watchdog() {
    const RING: usize = 1024;
    let mut desk = Desk::new(MemoryFlash::new());
    let mut reader = Reader::<RING>::new();
    let mut input = Input::new(Potentiometer::<CONVERSIONS>);
    let mut ring = [0_u16; RING];
    let mut written = 0_u32;
    let mut convert = |conversions: u32, written: &mut u32| {
        for _ in 0..conversions {
            // The converter's upper bits may hold anything.
            ring[*written as usize % RING] = 0xf000 | 2048;
            *written += 1;
        }
        ring
    };
    let mut give = |written: u32, made: Option<u32>, ring: &[u16; RING], desk: &mut Desk| {
        let came = reader.give(written, made, |at| ring[at], &mut input, &mut desk.device);
        desk.listen();
        (came, desk.device.samples())
    };
    // Half a sample is none yet.
    let mut ring = convert(8, &mut written);
    assert_eq!(give(written, Some(written), &ring, &mut desk), (false, 0));
    ring = convert(8 + 3 * CONVERSIONS + 5, &mut written);
    assert_eq!(give(written, Some(written), &ring, &mut desk), (true, 4));
    // The converter stands still: nothing comes, whatever is asked.
    assert_eq!(give(written, Some(written), &ring, &mut desk), (false, 4));
    // Away for more than the ring holds: its time passes, and what is left of it is measured.
    ring = convert(100 * CONVERSIONS, &mut written);
    assert_eq!(give(written, Some(written), &ring, &mut desk), (true, 104));
    let lost = desk.status().lost_samples;
    assert!((37..=38).contains(&lost), "{lost}");
    // A conversion went missing: with nothing measured, nothing feeds the watchdog.
    assert_eq!(give(written + 2, None, &ring, &mut desk), (false, 105));
    assert_eq!(desk.status().lost_samples, lost + 1);
    // From its beginning on again, the converter's first conversion in the ring's first place.
    written = 0;
    ring = convert(CONVERSIONS, &mut written);
    assert_eq!(give(written, Some(written), &ring, &mut desk), (true, 106));
}

/// The converter begins anew where one went missing, and its first conversion is the next sample's: as much
/// time is lost as has gone by since the last sample, to the nearest millisecond, the conversion that was on
/// its way or not.
#[test]
fn a_conversion_that_went_missing_costs_the_time_that_went_by() {
    for (conversions, lost) in [(1, 1), (16, 1), (17, 1), (23, 1), (25, 2), (33, 2), (160, 10)] {
        let mut desk = Desk::new(MemoryFlash::new());
        let mut reader = Reader::<64>::new();
        let mut input = Input::new(Potentiometer::<CONVERSIONS>);
        let mut give = |triggers, made, desk: &mut Desk| {
            reader.give(triggers, made, |_| 2048, &mut input, &mut desk.device)
        };
        assert!(give(CONVERSIONS, Some(CONVERSIONS), &mut desk));
        assert!(!give(CONVERSIONS + conversions, None, &mut desk));
        assert_eq!(desk.status().lost_samples, lost, "{conversions}");
        assert_eq!(desk.device.samples(), 1 + lost);
    }
}

/// What an interrupt sums up in time is given to the device whole and in order, the count of conversions and
/// of samples going round or not; what it was too late for is missing, and says so.
#[test]
fn samples_are_summed_up_in_time_and_kept_for_the_program() {
    const RING: usize = 64;
    let sums = Sums::<RING, 16>::new();
    let mut desk = Desk::new(MemoryFlash::new());
    let (mut reader, mut input) = (Reader::new(), Input::new(Potentiometer::<CONVERSIONS>));
    // Each sample of another count; the converter's upper bits may hold anything.
    let reading = |first: u32| move |at: usize| 0xf000 | (first + at as u32 / CONVERSIONS) as u16;
    assert_eq!(desk.ask(&Request::Stream { samples: 1 << 20 }), Reply::Done);
    // Twice a few, with the last reading still on its way, or one more come than was counted.
    for (written, triggers) in [(24, 25), (40, 39)] {
        sums.collect(triggers, written, reading(100));
    }
    assert!(sums.give(&mut reader, &mut input, &mut desk.device));
    assert!(!sums.give(&mut reader, &mut input, &mut desk.device));
    assert_eq!((desk.device.samples(), desk.status().lost_samples), (2, 0));
    // The program stays away: what is not kept is lost.
    for sample in 3..=22_u32 {
        let written = sample * CONVERSIONS;
        sums.collect(written, written % RING as u32, reading(sample / 4 * 4 + 96));
    }
    assert!(sums.give(&mut reader, &mut input, &mut desk.device));
    assert_eq!((desk.device.samples(), desk.status().lost_samples), (22, 20 - (16 - 8)));
    // The interrupt does: readings were overwritten, and nothing is summed up until all begins anew.
    let late = 22 * CONVERSIONS + RING as u32;
    sums.collect(late, late % RING as u32, reading(0));
    assert!(sums.is_torn());
    sums.collect(late + CONVERSIONS, (late + CONVERSIONS) % RING as u32, reading(0));
    assert!(!sums.give(&mut reader, &mut input, &mut desk.device));
    desk.device.lost(sums.begin_anew(late + CONVERSIONS));
    let mut reader = Reader::new();
    assert_eq!((desk.device.samples(), sums.is_torn()), (27, false));
    sums.collect(CONVERSIONS, CONVERSIONS, reading(7));
    assert!(sums.give(&mut reader, &mut input, &mut desk.device));
    // A conversion without its reading is missing, too: as much time as has gone by, at least a sample.
    for (conversions, lost) in [(2, 1), (17, 1), (25, 2), (160, 10)] {
        sums.collect(CONVERSIONS + conversions, (CONVERSIONS + conversions + 2) % 64, reading(0));
        assert!(sums.is_torn());
        assert_eq!(sums.begin_anew(CONVERSIONS + conversions), lost);
        sums.collect(CONVERSIONS, CONVERSIONS, reading(0));
    }
}

/// What the converter says is missing is told after those samples that were summed up before.
#[test]
fn samples_that_wait_are_taken_one_by_one_and_none_is_lost_when_all_begins_anew() {
    let sums = Sums::<64, 16>::new();
    let mut desk = Desk::new(MemoryFlash::new());
    let (mut reader, mut input) = (Reader::new(), Input::new(Potentiometer::<CONVERSIONS>));
    sums.collect(3 * CONVERSIONS, 3 * CONVERSIONS, |_| 2048);
    sums.tear();
    sums.collect(4 * CONVERSIONS, 0, |_| 2048);
    for taken in 1..=3 {
        assert!(sums.give_one(&mut reader, &mut input, &mut desk.device));
        assert_eq!(desk.device.samples(), taken);
    }
    assert!(!sums.give_one(&mut reader, &mut input, &mut desk.device));
    assert!(sums.is_torn());
    assert_eq!(sums.begin_anew(4 * CONVERSIONS), 1);
}

/// On while the model is held, blinking while it rings, dark but for a flash a second where nothing happens.
#[test]
fn the_light_tells_the_phase() {
    let mut desk = Desk::new(MemoryFlash::new());
    let (mut lit, mut all) = ([0; 3], [0; 3]);
    let mut counts = Swing::new(8.0, 0.01).counts(1);
    counts.extend([32_768; 10_000]);
    for count in counts {
        desk.play([count]);
        let kind = match desk.device.phase() {
            Phase::Held => 0,
            Phase::Released | Phase::Ringing => 1,
            Phase::Waiting | Phase::Finished => 2,
        };
        all[kind] += 1;
        lit[kind] += u32::from(desk.device.is_lit());
    }
    let share = |kind: usize| f64::from(lit[kind]) / f64::from(all[kind]);
    assert!(all.iter().all(|samples| *samples > 1000), "{all:?}");
    assert_eq!(lit[0], all[0]);
    assert!((share(1) - 0.5).abs() < 0.02, "{lit:?} of {all:?}");
    assert!((0.01..0.06).contains(&share(2)), "{lit:?} of {all:?}");
}
