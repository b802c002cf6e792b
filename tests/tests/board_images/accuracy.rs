//! From the wiper's voltage to the damping ratio, through the whole of the board's image.
//!
//! The virtual rig integrates the motion and adds the noise, sixteen times a millisecond of the board's own
//! clock, which is off by as much as its crystal may be; the wiper makes a voltage of it and the converter 12
//! bits of that. What the image refines is held against what was planted, in its own standard uncertainties.

use crate::harness::{Board, Both};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use yawrig_rig::{End, Motion, Samples, Sensor, Start};
use yawrig_shared::modal::Modal;
use yawrig_shared::wire::{Event, Flags, Reply, Request, Settings};

const SUPPLY_V: f64 = 3.3;
const TRAVEL_DEG: f64 = 340.0;
const CONVERSIONS_HZ: f64 = 16_000.0;
/// Most that a result may be off, in its own standard uncertainties.
const MAX_OFF: f64 = 3.0;

/// What is planted, where the rig rests on the potentiometer's track, 0 in its middle, how far it is let go
/// from there, the noise of a conversion, and how fast the board's clock is.
#[derive(Clone, Copy, Debug)]
struct Case {
    wn: f64,
    zeta: f64,
    zero_deg: f64,
    amplitude_deg: f64,
    noise_deg: f64,
    clock_ppm: f64,
}

/// Readings of the converter: its first step is at half of one (data sheet, 6.3.20).
fn readings(case: &Case, seed: u64) -> Vec<u16> {
    let end = End::Below { amplitude_deg: 0.7, at_most_s: 60.0 };
    let start = Start { amplitude_deg: case.amplitude_deg, hold_s: 2.0, end };
    let sensor = Sensor {
        rate_hz: CONVERSIONS_HZ * (1.0 + 1e-6 * case.clock_ppm),
        noise_deg: case.noise_deg,
        noise_correlation: 0.0,
        offset_deg: case.zero_deg,
        adc_step_deg: 0.0,
        ..Sensor::default()
    };
    let wiper_v = |yaw_deg: f64| SUPPLY_V * (0.5 + yaw_deg / TRAVEL_DEG);
    let reading = |volts: f64| (volts / SUPPLY_V * 4096.0).round().clamp(0.0, 4095.0) as u16;
    let truth = Modal { natural_frequency_rad_s: case.wn, damping_ratio: case.zeta };
    Samples::new(Motion::new(&truth), &start, &sensor, seed)
        .map(|sample| reading(wiper_v(sample.yaw_deg)))
        .collect()
}

/// How far the image's refined natural frequency and damping ratio are off, in their standard uncertainties;
/// between them the natural frequency once more, as it would be by a clock that is right, whose error else is
/// most of it.
/// And whether it takes the model to lack something.
fn off<B: Board>(case: &Case, seed: u64) -> ([f64; 3], bool) {
    // Another rig each time: one that jumps from rest to rest is noisy.
    let mut both = Both::<B>::start();
    let degrees_per_count = (TRAVEL_DEG / 65_536.0) as f32;
    let settings = Settings { degrees_per_count, ..Settings::default() };
    assert_eq!(both.ask(&Request::Configure(settings)), Reply::Done);
    both.events.clear();
    both.convert(&readings(case, seed));
    assert_eq!(both.ask(&Request::EndRelease { after_samples: 0 }), Reply::Done);
    // Its rest, while which it is refined.
    both.play(&[2048; 1600]);
    let refined = both.events.iter().find_map(|event| match event {
        Event::Refined(refined) => Some(*refined),
        _ => None,
    });
    let refined = refined.unwrap_or_else(|| panic!("{case:?}: {:?}", both.events));
    let flags = refined.flags.of_record().without(Flags::WIDENED);
    assert_eq!(flags, Flags::default(), "{case:?}: {refined:?}");
    let (zeta, wn) = (refined.damping_ratio, refined.natural_frequency_rad_s);
    let by_clock = 1e-6 * f64::from(B::CLOCK_U_PPM) * wn.value;
    let u_alone = (f64::from(wn.u).powi(2) - by_clock * by_clock).sqrt();
    let off = [
        (wn.value - case.wn) / f64::from(wn.u),
        (wn.value * (1.0 + 1e-6 * case.clock_ppm) - case.wn) / u_alone,
        (f64::from(zeta.value) - case.zeta) / f64::from(zeta.u),
    ];
    let Case { zero_deg, amplitude_deg, noise_deg, clock_ppm, .. } = case;
    println!(
        "{:7.3} {:7.5} {zero_deg:7.2} {amplitude_deg:5.1} {noise_deg:6.3} {clock_ppm:+6.1} | {:+6.2} {:+6.2} {:+6.2}",
        case.wn, case.zeta, off[0], off[1], off[2]
    );
    (off, refined.flags.has(Flags::WIDENED))
}

/// All cases: none is off by more than it may be, nor are they in the mean.
fn hold<B: Board>(cases: &[Case]) {
    println!("{}: natural frequency, damping ratio, rest, let go, noise (deg), clock (ppm) | off by u, each", B::NAME);
    let (mut all, mut widened) = ([const { Vec::new() }; 3], 0);
    for (seed, case) in (1..).zip(cases) {
        let (off, is_widened) = off::<B>(case, seed);
        for (all, off) in all.iter_mut().zip(off) {
            all.push(off);
        }
        widened += usize::from(is_widened);
    }
    // Chance does it once in sixty at most.
    assert!(widened * 60 <= cases.len(), "{}: {widened} of {}", B::NAME, cases.len());
    for (off, name) in
        all.iter().zip(["natural frequency", "the same by a right clock", "damping ratio"])
    {
        let n = off.len() as f64;
        let mean = off.iter().sum::<f64>() / n;
        let rms = (off.iter().map(|z| z * z).sum::<f64>() / n).sqrt();
        let most = off.iter().fold(0.0_f64, |most, z| most.max(z.abs()));
        println!("{name}: off by {mean:+.2} u in the mean, {rms:.2} rms, {most:.2} at most");
        assert!(most <= MAX_OFF, "{}: {name}: {off:+.2?}", B::NAME);
        // And no bias: three standard uncertainties of a mean of so many.
        assert!(mean.abs() <= 3.0 / n.sqrt(), "{}: {name}: {off:+.2?}", B::NAME);
    }
}

/// What is refined is what was planted, wherever the rig rests.
pub fn what_is_refined_is_what_was_planted<B: Board>() {
    // The middle of the track, where a rig is centred, lies on a multiple of 4096 counts.
    let fast = 3_f64.sqrt() * f64::from(B::CLOCK_U_PPM);
    let cases = [
        (0.0, 12.0, 0.08, 0.0),
        (0.3, 6.0, 0.05, fast),
        (-21.25, 15.0, 0.2, -fast),
        (63.0, 9.0, 0.05, 0.5 * fast),
    ];
    let case = |(zero_deg, amplitude_deg, noise_deg, clock_ppm)| Case {
        wn: 12.0,
        zeta: 0.03,
        zero_deg,
        amplitude_deg,
        noise_deg,
        clock_ppm,
    };
    hold::<B>(&cases.map(case));
}

/// The same of sixty rigs, over all that a rig may be.
pub fn what_is_refined_is_what_was_planted_on_sixty_rigs<B: Board>() {
    let mut random = ChaCha8Rng::seed_from_u64(60);
    let fast = 3_f64.sqrt() * f64::from(B::CLOCK_U_PPM);
    let mut case = |_| {
        let mut between = |low: f64, high: f64| low * (high / low).powf(random.random());
        let wn = between(4.0, 26.0);
        // A decay of one to seven seconds.
        let zeta = (between(0.15, 1.0) / wn).min(0.1);
        let (amplitude_deg, noise_deg) = (between(3.0, 16.0), between(0.02, 0.3));
        let zero_deg = random.random_range(-140.0..140.0);
        let clock_ppm = random.random_range(-fast..fast);
        Case { wn, zeta, zero_deg, amplitude_deg, noise_deg, clock_ppm }
    };
    let cases: Vec<Case> = (0..60).map(&mut case).collect();
    hold::<B>(&cases);
}
