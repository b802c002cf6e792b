//! What a converter, its place on the track and other sensors make of a refined damping ratio: the figures
//! that `yawrig doctor --device` and the book give.
//! `cargo test --release -p yawrig-tests --test system advice -- --nocapture` prints them; those of a Pico's
//! converter where `YAWRIG_CONVERTERS` names a folder of chips that were measured (`rp2040*.csv`,
//! `rp2350*.csv`: the mean code at each eighth of a code of the input).

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use std::f64::consts::TAU;
use std::path::{Path, PathBuf};
use yawrig_link::advice::{Choice, CHOICES};
use yawrig_rig::{End, Motion, Samples, Sensor, Start};
use yawrig_shared::modal::Modal;
use yawrig_shared::wire::{Reply, Request, Settings};
use yawrig_tests::converter::Converter;
use yawrig_tests::desk::Desk;

const TRAVEL_DEG: f64 = 340.0;
/// Releases of each choice, each through a chip of its own: a median of so many scatters by 15 %.
const RELEASES: u64 = 64;

/// A sensor with its converter: what a model at this angle reads, in units of the device's counts.
struct Reading {
    /// Readings a sample is the sum of, and their noise.
    together: usize,
    noise_deg: f64,
    deg_per_count: f64,
    counts: Box<dyn Fn(f64) -> f64 + Send + Sync>,
}

/// A converter of 12 bits on a potentiometer, `stretch` times as many codes a degree, resting at this code.
fn potentiometer(
    read: impl Fn(f64) -> f64 + Send + Sync + 'static,
    rest_code: f64,
    stretch: f64,
) -> Reading {
    let codes_per_deg = stretch * 4096.0 / TRAVEL_DEG;
    Reading {
        together: 16,
        noise_deg: 1.0 / codes_per_deg,
        deg_per_count: 1.0 / (16.0 * codes_per_deg),
        counts: Box::new(move |deg| read(rest_code + deg * codes_per_deg) - rest_code.round()),
    }
}

/// The mean code that a chip read at each eighth of a code of its input.
fn measured(chip: &Path) -> Vec<f64> {
    let text = std::fs::read_to_string(chip).expect("a measured converter");
    let codes = text.lines().skip(1).map(|line| line.split(',').nth(1).expect("two columns"));
    codes.map(|code| code.parse().expect("a number")).collect()
}

/// The chips that were measured, which are no part of the project: the environment says where they are.
fn chips(kinds: &[&str]) -> Option<Vec<PathBuf>> {
    let folder = PathBuf::from(std::env::var_os("YAWRIG_CONVERTERS")?);
    let files =
        std::fs::read_dir(folder).expect("a folder").map(|file| file.expect("a file").path());
    let is_one = |file: &PathBuf| {
        let name = file.file_name().expect("a name").to_string_lossy();
        name.ends_with(".csv") && kinds.iter().any(|kind| name.starts_with(kind))
    };
    let mut chips: Vec<PathBuf> = files.filter(is_one).collect();
    chips.sort();
    Some(chips)
}

/// Through a chip of these kinds; none where there is none.
fn chip(kinds: &[&str], seed: u64, rest_code: f64, stretch: f64) -> Option<Reading> {
    let chips = chips(kinds)?;
    let means = measured(&chips[seed as usize % chips.len()]);
    let read = move |code: f64| means[((8.0 * code) as usize).min(means.len() - 1)].round();
    Some(potentiometer(read, rest_code, stretch))
}

/// As chips that were measured have them, or as their makers' data sheets do.
fn reading(choice: Choice, seed: u64) -> Option<Reading> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut place = |code: f64| code + random.random_range(-3.0..3.0);
    let both = ["rp2040", "rp2350"];
    Some(match choice {
        Choice::Centred => return chip(&both, seed, place(2048.0), 1.0),
        Choice::Beside => return chip(&both, seed, place(1848.0), 1.0),
        Choice::OnAStep => return chip(&both[..1], seed, place(2560.0), 1.0),
        Choice::FourTimesTheTravel => return chip(&both, seed, place(2048.0), 4.0),
        // 12 bits, no wide codes; integral error up to 1 code, differential 0.5 typically.
        Choice::Mcp3208 => {
            let converter = Converter::even(seed, 1.0);
            potentiometer(move |code| f64::from(converter.read(code)), place(2048.0), 1.0)
        }
        // 16 bits of twice the supply, so 26 400 codes; integral error up to 1 of them, noise of as much.
        Choice::Ads1115 => {
            let codes_per_deg = 26_400.0 / TRAVEL_DEG;
            let bend = random.random_range(-1.0..1.0);
            Reading {
                together: 1,
                noise_deg: 1.0 / codes_per_deg,
                deg_per_count: 1.0 / codes_per_deg,
                counts: Box::new(move |deg| {
                    let x = 0.5 + deg / TRAVEL_DEG;
                    (deg * codes_per_deg + 4.0 * bend * x * (1.0 - x)).round()
                }),
            }
        }
        // 12 bits a turn; integral error up to 1 deg, which is once and twice a turn, noise 0.04 deg.
        Choice::As5600 => {
            let [once, twice] = [0.75, 0.25].map(|deg| (deg, random.random_range(0.0..TAU)));
            Reading {
                together: 1,
                noise_deg: 0.04,
                deg_per_count: 360.0 / 4096.0,
                counts: Box::new(move |deg| {
                    let turned = deg.to_radians();
                    let error =
                        once.0 * (turned + once.1).sin() + twice.0 * (2.0 * turned + twice.1).sin();
                    ((deg + error) * 4096.0 / 360.0).round()
                }),
            }
        }
    })
}

/// By how much of itself a refined damping ratio is off.
fn off(choice: Choice, seed: u64) -> Option<f64> {
    let reading = reading(choice, seed)?;
    let mut random = ChaCha8Rng::seed_from_u64(1_000_000 + seed);
    let mut between = |low: f64, high: f64| low * (high / low).powf(random.random());
    let (wn, zeta, amplitude_deg) = (between(6.0, 20.0), between(0.006, 0.02), between(11.0, 16.0));
    let truth = Modal { natural_frequency_rad_s: wn, damping_ratio: zeta };
    let end = End::Below { amplitude_deg: 0.7, at_most_s: 90.0 };
    let start = Start { amplitude_deg, hold_s: 2.0, end };
    let sensor = Sensor {
        rate_hz: 1000.0 * reading.together as f64,
        noise_deg: reading.noise_deg,
        adc_step_deg: 0.0,
        ..Sensor::default()
    };
    let zero = 32_768.0;
    let readings: Vec<f64> = Samples::new(Motion::new(&truth), &start, &sensor, seed)
        .map(|sample| (reading.counts)(sample.yaw_deg))
        .collect();
    let mut desk = Desk::default();
    let settings =
        Settings { degrees_per_count: reading.deg_per_count as f32, ..Settings::default() };
    assert_eq!(desk.ask(&Request::Configure(settings)), Reply::Done);
    desk.play(readings.chunks_exact(reading.together).map(|some| {
        let sum: f64 = some.iter().sum();
        (zero + sum) as u16
    }));
    assert_eq!(desk.ask(&Request::EndRelease { after_samples: 0 }), Reply::Done);
    while desk.device.idle() {}
    desk.listen();
    let refined = desk.refined.last().unwrap_or_else(|| panic!("{choice:?}, {seed}"));
    Some(f64::from(refined.damping_ratio.value) / zeta - 1.0)
}

#[test]
fn what_is_said_of_each_choice_is_what_it_does() {
    let mut wrong = Vec::new();
    println!("{:30} | half are off by more, % | said", "");
    for choice in CHOICES {
        let off: Option<Vec<f64>> = (0..RELEASES)
            .into_par_iter()
            .map(|seed| Some(100.0 * off(choice, seed)?.abs()))
            .collect();
        let Some(mut off) = off else {
            println!("YAWRIG_CONVERTERS names no folder: not {}", choice.name());
            continue;
        };
        off.sort_by(f64::total_cmp);
        let (median, said) = (off[off.len() / 2], choice.damping_error_percent());
        println!("{:30} | {median:23.3} | {said}", choice.name());
        // Three times the scatter, and what rounding to one digit takes.
        // No number is not near either.
        let is_near = (median / said - 1.0).abs() < 0.5;
        wrong.extend((!is_near).then_some((choice, median, said)));
    }
    assert!(wrong.is_empty(), "{wrong:?}");
}
