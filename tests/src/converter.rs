//! A converter as chips have it: codes of unlike widths, four of them wide, and a bend; and releases that are
//! read through it.
//!
//! Wide is what erratum E11 of the RP2040 makes of codes 512, 1536, 2560 and 3584: the reading stands still
//! there while the voltage goes on for as long as over eight others or nine.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use yawrig_core::record::Record;
use yawrig_rig::{End, Motion, Samples, Sensor, Start};
use yawrig_shared::modal::Modal;
use yawrig_shared::wire::Settings;

const CODES: usize = 4096;
const WIDE: [usize; 4] = [512, 1536, 2560, 3584];
/// Width of the wide ones, rms of the others' differences, and how far the middle is bent; codes.
const WIDTH: f64 = 9.0;
const UNLIKE: f64 = 0.2;
const BEND: f64 = 2.0;
/// Conversions in a sample.
const TOGETHER: usize = 16;
/// Noise of one conversion, codes.
const NOISE: f64 = 1.0;
/// Of a potentiometer of 340 deg.
pub const DEG_PER_COUNT: f64 = 340.0 / 65_536.0;
const HELD_S: f64 = 2.0;

/// The voltage, in codes, at which each code begins.
pub struct Converter(Vec<f64>);

impl Converter {
    /// Each seed is another chip.
    pub fn chip(seed: u64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let unlike = Normal::new(1.0, UNLIKE).expect("a width");
        let widths: Vec<f64> = (0..CODES)
            .map(|code| match WIDE.contains(&code) {
                true => WIDTH,
                false => f64::max(unlike.sample(&mut random), 0.0),
            })
            .collect();
        let scale = CODES as f64 / widths.iter().sum::<f64>();
        let mut at = 0.0;
        let begins = widths.iter().map(|width| {
            let begins = at;
            at += scale * width;
            let x = begins / CODES as f64;
            begins + 4.0 * BEND * x * (1.0 - x)
        });
        Self(begins.collect())
    }

    /// One without wide codes, whose middle is bent by at most this, codes; their differences are half a code
    /// at most.
    pub fn even(seed: u64, bend: f64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let bend = random.random_range(-bend..bend);
        let begins = (0..CODES).map(|code| {
            let x = code as f64 / CODES as f64;
            code as f64 + random.random_range(-0.25..0.25) + 4.0 * bend * x * (1.0 - x)
        });
        Self(begins.collect())
    }

    /// All codes of one width.
    pub fn ideal() -> Self {
        Self((0..CODES).map(|code| code as f64).collect())
    }

    pub fn read(&self, codes: f64) -> u16 {
        self.0.partition_point(|begins| *begins <= codes).saturating_sub(1) as u16
    }
}

/// A release: what it is, the voltage of its rest in codes, how far it is let go.
#[derive(Clone, Copy, Debug)]
pub struct Release {
    pub wn: f64,
    pub zeta: f64,
    pub rest_code: f64,
    pub amplitude_deg: f64,
}

impl Release {
    /// One of wn 6 to 20 rad/s, zeta 0.004 to 0.02, let go at 11 to 16 deg, within two codes of this rest.
    pub fn random(rest_code: f64, random: &mut ChaCha8Rng) -> Self {
        let mut between = |low: f64, high: f64| low * (high / low).powf(random.random());
        let (wn, amplitude_deg) = (between(6.0, 20.0), between(11.0, 16.0));
        // No longer than half a minute.
        let zeta = between(0.004, 0.02).max(0.1 / wn);
        Self { wn, zeta, rest_code: rest_code + random.random_range(-2.0..2.0), amplitude_deg }
    }

    /// The samples of a device that reads it through this converter.
    pub fn counts(&self, converter: &Converter, seed: u64) -> Vec<u16> {
        let end = End::Below { amplitude_deg: 0.7, at_most_s: 60.0 };
        let start = Start { amplitude_deg: self.amplitude_deg, hold_s: HELD_S, end };
        let sensor = Sensor {
            rate_hz: 1000.0 * TOGETHER as f64,
            noise_deg: NOISE * TOGETHER as f64 * DEG_PER_COUNT,
            adc_step_deg: 0.0,
            ..Sensor::default()
        };
        let truth = Modal { natural_frequency_rad_s: self.wn, damping_ratio: self.zeta };
        let read =
            |deg: f64| converter.read(self.rest_code + deg / (TOGETHER as f64 * DEG_PER_COUNT));
        let readings: Vec<u16> = Samples::new(Motion::new(&truth), &start, &sensor, seed)
            .map(|sample| read(sample.yaw_deg))
            .collect();
        readings.chunks_exact(TOGETHER).map(|some| some.iter().sum()).collect()
    }
}

/// How a device is told of that potentiometer.
pub fn settings() -> Settings {
    Settings { degrees_per_count: DEG_PER_COUNT as f32, ..Settings::default() }
}

/// What `monitor --record` writes of such samples.
pub fn record(name: &str, counts: &[u16]) -> Record {
    let Settings { zero_counts, .. } = settings();
    let time_s = (0..counts.len()).map(|k| k as f64 * 1e-3).collect();
    let deg = |counts: &u16| (f64::from(*counts) - f64::from(zero_counts)) * DEG_PER_COUNT;
    Record::new(name, time_s, counts.iter().map(deg).collect())
}
