//! Whether the readings are those of a potentiometer on a swinging model.
//!
//! Sample by sample: steps no model makes, and readings that do not change. Block by block: the noise, by the
//! fourth difference of the block means, in which the fastest swing of interest leaves less than a hundredth of a
//! degree's noise and a mains hum of a tenth of a degree as much as noise of a quarter.

use yawrig_shared::history::BLOCK;

/// A step between two samples that no model makes: 60 deg at 26.5 rad/s pass 1.6 deg in 1 ms.
const WILD_DEG: f32 = 3.0;
/// Wild samples in a row that are bridged by the last good one; after more the signal has jumped.
const BRIDGED: u8 = 5;
/// Whatever comes next is taken.
const ANYTHING: u8 = u8::MAX;
/// No oscillation gives so many equal readings: at the slowest turning point, 1 deg and 2.5 rad/s, a converter of 12 bits
/// over a full turn stays at one count for 340.
const STUCK_SAMPLES: u16 = 500;
/// Blocks over which the noise is averaged: 4 s.
const AVERAGED: u16 = 512;
/// Mean size of the fourth difference of white noise with an rms of one: sqrt(70) sqrt(2 / pi).
const GAIN: f32 = 6.676;
/// Root of [`BLOCK`]. Instructions of a sample in the mean, rustup's compiler: 220 with libm's root, 205 with micromath's or this.
const ROOT_OF_BLOCK: f32 = 2.0 * core::f32::consts::SQRT_2;
const _: () = assert!(BLOCK == 8);
/// As white noise of a sample, degrees: more than a potentiometer in order has, and more than any signal has.
const NOISY_DEG: f32 = 0.25;
const SENSELESS_DEG: f32 = 2.5;

fn wild_counts(degrees_per_count: f32) -> u32 {
    (WILD_DEG / degrees_per_count.abs()) as u32
}

/// Follows the readings.
#[derive(Clone, Copy, Debug)]
pub struct Signal {
    wild_counts: u32,
    last: i16,
    /// Wild samples up to here, or [`ANYTHING`].
    wild: u8,
    /// Equal readings up to here.
    same: u16,
    /// Samples bridged, and jumps, since they were last asked for.
    spikes: u16,
    jumps: u16,
    /// Means of the last four blocks, oldest first.
    means: [f32; 4],
    averaged: u16,
    /// Mean size of the fourth differences, degrees.
    fourth: f32,
}

impl Signal {
    pub fn new(degrees_per_count: f32) -> Self {
        Self {
            wild_counts: wild_counts(degrees_per_count),
            last: 0,
            wild: ANYTHING,
            same: 0,
            spikes: 0,
            jumps: 0,
            means: [0.0; 4],
            averaged: 0,
            fourth: 0.0,
        }
    }

    /// Counts mean other degrees from now on, `times` as many as before; what is known of the noise stays known.
    pub fn rescale(&mut self, degrees_per_count: f32, times: f32) {
        self.wild_counts = wild_counts(degrees_per_count);
        self.means = self.means.map(|mean| mean * times);
        self.fourth *= times.abs();
    }

    /// The last good reading.
    pub fn last(&self) -> i16 {
        self.last
    }

    /// Takes a reading; gives what is to be measured: the reading, or the last good one where this one is wild.
    #[inline]
    pub fn sample(&mut self, raw: i16) -> i16 {
        let step = i32::from(raw) - i32::from(self.last);
        if step.unsigned_abs() > self.wild_counts {
            return self.wild(raw);
        }
        if self.wild != 0 {
            self.settled();
        }
        self.same = if step == 0 { self.same.saturating_add(1) } else { 0 };
        self.last = raw;
        raw
    }

    #[cold]
    fn wild(&mut self, raw: i16) -> i16 {
        if self.wild < BRIDGED {
            self.wild += 1;
            return self.last;
        }
        self.jumps += u16::from(self.wild == BRIDGED);
        self.wild = 0;
        self.same = 0;
        self.last = raw;
        raw
    }

    #[cold]
    fn settled(&mut self) {
        if self.wild != ANYTHING {
            self.spikes = self.spikes.saturating_add(u16::from(self.wild));
        }
        self.wild = 0;
    }

    /// After a gap: the next reading may be anything.
    pub fn rejoin(&mut self) {
        self.wild = ANYTHING;
        self.same = 0;
    }

    /// Takes the mean of a block, degrees.
    pub fn block(&mut self, mean_deg: f32) {
        let [a, b, c, d] = self.means;
        self.means = [b, c, d, mean_deg];
        let fourth = (a + mean_deg - 4.0 * (b + d) + 6.0 * c).abs();
        // The first ones begin at zero degrees, wherever the model is.
        self.averaged = (self.averaged + 1).min(AVERAGED);
        if self.averaged <= 4 {
            return;
        }
        self.fourth += (fourth - self.fourth) / f32::from(self.averaged - 4);
    }

    /// Rms of the noise of a block's mean, degrees.
    pub fn block_noise_deg(&self) -> f32 {
        self.fourth / GAIN
    }

    /// Rms of the white noise a sample would have to have, degrees.
    fn noise_deg(&self) -> f32 {
        self.block_noise_deg() * ROOT_OF_BLOCK
    }

    pub fn is_noisy(&self) -> bool {
        self.noise_deg() > NOISY_DEG
    }

    /// Whether this is no potentiometer's signal at all.
    pub fn is_senseless(&self) -> bool {
        self.noise_deg() > SENSELESS_DEG
    }

    pub fn is_stuck(&self) -> bool {
        self.same >= STUCK_SAMPLES
    }

    /// Whether samples were bridged, and whether the signal jumped, since this was last asked.
    pub fn take_spikes_and_jumps(&mut self) -> (bool, bool) {
        let found = (self.spikes > 0, self.jumps > 0);
        (self.spikes, self.jumps) = (0, 0);
        found
    }
}
