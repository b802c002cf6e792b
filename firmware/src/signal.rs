//! Whether the readings are those of a potentiometer on a swinging model.
//!
//! Sample by sample: steps no model makes, and readings that do not change. Block by block: the noise, by the
//! fourth difference of the block means, in which the fastest swing of interest leaves less than a hundredth
//! of a degree's noise and a mains hum of a tenth of a degree as much as noise of a quarter.

use yawrig_shared::history::BLOCK;

/// A step between two samples that no model makes: 60 deg at 26.5 rad/s pass 1.6 deg in 1 ms.
const WILD_DEG: f32 = 3.0;
/// And not by noise alone: the step of two samples has 1.4 times the rms of one, and four times that once in
/// an hour.
const WILD_NOISE: f32 = 6.0;
/// Samples in a row that the last good one bridges as if nothing had been: the model goes on by a tenth of a
/// radian.
pub const BRIDGED: u32 = 5;
/// Readings in a row that follow from each other: the signal is back.
const BACK: u8 = 5;
/// Longest gap that a release goes on after, in samples: 100 ms, and those by which it is seen that it is
/// over.
pub const LONGEST_GAP: u32 = 100 + BACK as u32;
/// Whatever comes next is taken.
const ANYTHING: u32 = u32::MAX;
/// No oscillation gives so many equal readings: at the slowest turning point, 1 deg and 2.5 rad/s, a
/// converter of 12 bits over a full turn stays at one count for 340.
const STUCK_SAMPLES: u16 = 500;
/// Blocks over which the noise is averaged: 4 s.
const AVERAGED: u16 = 508;
/// Block means before the one that makes a fourth difference.
const ORDER: u16 = 4;
/// Mean size of the fourth difference of white noise with an rms of one: sqrt(70) sqrt(2 / pi).
const GAIN: f32 = 6.676;
/// Root of [`BLOCK`]. Instructions of a sample in the mean, rustup's compiler: 220 with libm's root, 205 with
/// micromath's or this.
const ROOT_OF_BLOCK: f32 = 2.0 * core::f32::consts::SQRT_2;
const _: () = assert!(BLOCK == 8);
/// As white noise of a sample, degrees: more than a potentiometer in order has, and more than any signal has.
const NOISY_DEG: f32 = 0.25;
const SENSELESS_DEG: f32 = 2.5;

/// Readings that were not the model's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gap {
    /// Samples.
    pub length: u32,
    /// The reading came back to what no model gets to from the last good one.
    pub jumped: bool,
}

/// Follows the readings.
#[derive(Clone, Copy, Debug)]
pub struct Signal {
    degrees_per_count: f32,
    wild_counts: u32,
    /// The last good reading, and the last one.
    last: i16,
    raw: i16,
    /// Wild readings up to here, or [`ANYTHING`]; the last so many of them follow from each other.
    wild: u32,
    following: u8,
    /// Equal readings up to here.
    same: u16,
    /// A gap that is over, or longer than a release goes on after.
    gap: Option<Gap>,
    /// Means of the last four blocks, oldest first.
    means: [f32; ORDER as usize],
    /// Blocks whose fourth difference still has a step of the signal's own in it, or its beginning.
    unsettled: u16,
    averaged: u16,
    /// Mean size of the fourth differences, degrees; and of those of noise whose block means have an rms of
    /// one.
    fourth: f32,
    gain: f32,
}

/// What fourth differences of block means show of noise that is on straight lines between readings so many
/// samples apart, over what they would of white noise with the same block means.
fn shown(spread: u32) -> f32 {
    match spread {
        ..2 => 1.0,
        2..4 => 0.9577,
        4 => 0.8780,
        5..8 => 0.8270,
        8..10 => 0.6238,
        _ => 0.4776,
    }
}

impl Signal {
    pub fn new(degrees_per_count: f32) -> Self {
        Self {
            degrees_per_count,
            wild_counts: (WILD_DEG / degrees_per_count.abs()) as u32,
            last: 0,
            raw: 0,
            wild: ANYTHING,
            following: 0,
            same: 0,
            gap: None,
            means: [0.0; ORDER as usize],
            // The first ones begin at zero degrees, wherever the model is.
            unsettled: ORDER,
            averaged: 0,
            fourth: 0.0,
            gain: GAIN,
        }
    }

    /// Readings of the sensor come so many samples from one another.
    pub fn set_spread(&mut self, samples: u32) {
        self.gain = GAIN * shown(samples);
    }

    /// Counts mean other degrees from now on, `times` as many as before; what is known of the noise stays
    /// known.
    pub fn rescale(&mut self, degrees_per_count: f32, times: f32) {
        self.degrees_per_count = degrees_per_count;
        self.means = self.means.map(|mean| mean * times);
        self.fourth *= times.abs();
        self.set_wild();
    }

    /// The last good reading.
    pub fn last(&self) -> i16 {
        self.last
    }

    /// Takes a reading; gives what is to be measured: the reading, or the last good one where this one is
    /// wild. Readings at an end of the converter, where a lost contact leaves it, say nothing of where the
    /// model is.
    #[inline]
    pub fn sample(&mut self, raw: i16, at_end: bool) -> i16 {
        self.same = if raw == self.raw { self.same.saturating_add(1) } else { 0 };
        let step = self.is_step(self.last, raw);
        if step || self.wild != 0 {
            return self.wild(raw, step, at_end);
        }
        self.raw = raw;
        self.last = raw;
        raw
    }

    #[inline]
    fn is_step(&self, from: i16, to: i16) -> bool {
        (i32::from(to) - i32::from(from)).unsigned_abs() > self.wild_counts
    }

    #[cold]
    fn wild(&mut self, raw: i16, step: bool, at_end: bool) -> i16 {
        let follows = !at_end && !self.is_step(self.raw, raw);
        self.following = if follows { self.following.saturating_add(1) } else { 0 };
        self.raw = raw;
        // One reading near the last good one is no proof of many that were not.
        let back = self.following >= BACK || !step && self.wild <= BRIDGED;
        if back || self.wild == ANYTHING {
            if self.wild != ANYTHING {
                self.gap = Some(Gap { length: self.wild, jumped: step });
                if step || self.wild > BRIDGED {
                    self.unsettled = ORDER;
                }
            }
            (self.wild, self.following) = (0, 0);
            self.last = raw;
            return raw;
        }
        self.wild = (self.wild + 1).min(ANYTHING - 1);
        if self.wild <= LONGEST_GAP {
            return self.last;
        }
        if self.wild == LONGEST_GAP + 1 {
            self.gap = Some(Gap { length: self.wild, jumped: true });
            self.unsettled = ORDER;
        }
        raw
    }

    /// The gap that this reading ended, or made too long.
    #[inline]
    pub fn take_gap(&mut self) -> Option<Gap> {
        self.gap.take()
    }

    /// After a gap: the next reading may be anything.
    pub fn rejoin(&mut self) {
        self.wild = ANYTHING;
        self.same = 0;
        self.unsettled = ORDER;
    }

    /// Takes the mean of a block, degrees.
    pub fn block(&mut self, mean_deg: f32) {
        let [a, b, c, d] = self.means;
        self.means = [b, c, d, mean_deg];
        let fourth = (a + mean_deg - 4.0 * (b + d) + 6.0 * c).abs();
        if self.unsettled > 0 {
            self.unsettled -= 1;
            return;
        }
        self.averaged = (self.averaged + 1).min(AVERAGED);
        self.fourth += (fourth - self.fourth) / f32::from(self.averaged);
        self.set_wild();
    }

    fn set_wild(&mut self) {
        let wild_deg = WILD_DEG.max(WILD_NOISE * self.noise_deg());
        self.wild_counts = (wild_deg / self.degrees_per_count.abs()) as u32;
    }

    /// Rms of the noise of a block's mean, degrees.
    pub fn block_noise_deg(&self) -> f32 {
        self.fourth / self.gain
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
}
