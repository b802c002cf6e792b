//! A record of any length in a fixed buffer: means of the samples, and what the noise is.
//!
//! Where the buffer is full, neighbouring means become one. The mean of a damped sinusoid over a stretch is
//! that sinusoid at the stretch's middle times one complex constant, which amplitude and phase take up; so
//! natural frequency and damping ratio are those of the samples, and at five means a cycle their information
//! is lost to 7 %.
//!
//! The noise is measured by what no oscillation has: third differences of neighbouring samples, and sixth
//! differences of means over 8, 16, ... samples, each scale of which sees the noise at about nine tenths of
//! its highest frequency.

use yawrig_shared::history::{History, BLOCK};

/// Means in the buffer.
pub const POINTS: usize = 4096;
/// A mean takes at most this share of a cycle.
const COARSEST: f32 = 0.25;
/// The first amplitude in units of the buffer: half its range.
const AMPLITUDE_UNITS: f32 = 16_384.0;
/// Where the amplitude is less, the unit is that of this one.
const MIN_AMPLITUDE_DEG: f32 = 1e-3;
/// Scales on which sixth differences are taken: 8 to 1024 samples.
const SCALES: usize = 8;
const ORDER: usize = 6;
/// Mean squares of a third difference and of a sixth of white noise of variance one: sums of squared
/// binomials.
const THIRD: f32 = 20.0;
const SIXTH: f32 = 924.0;
/// Longest mean for which sixth differences leave next to nothing of the oscillation, rad: (2 sin(x / 2))^12
/// / 924 of its power, 6e-10.
const SMOOTH_RAD: f32 = 0.3;
/// Overlapping sixth differences that are as good as an independent one: sum of their squared correlations.
const OVERLAP: f32 = 3.17;
/// Fewest independent ones that a scale is believed with.
const BELIEVED: f32 = 30.0;

/// What sixth differences on a scale see of noise that is on straight lines between readings so many samples
/// apart, over what they would of white noise as strong at low frequencies.
fn seen_between(spread: u32, scale: usize) -> f32 {
    let seen: [f32; SEEN] = match spread {
        ..2 => [1.0; SEEN],
        2..4 => [0.8259, 0.9129, 0.9565, 0.9782, 0.9891],
        4 => [0.5865, 0.7932, 0.8966, 0.9483, 0.9742],
        5..8 => [0.4741, 0.7370, 0.8685, 0.9343, 0.9671],
        8..10 => [0.1931, 0.5715, 0.7858, 0.8929, 0.9464],
        _ => [0.0868, 0.4625, 0.7311, 0.8656, 0.9328],
    };
    seen[scale.min(SEEN - 1)]
}
/// Scales on which it differs.
const SEEN: usize = 5;

/// Noise of a sample, as white noise has it whose means are those found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Noise {
    pub variance_deg2: f32,
    /// Degrees of freedom with which it is known.
    pub freedom: f32,
}

/// Sixth differences of the means on one scale.
#[derive(Clone, Copy, Debug, Default)]
struct Scale {
    /// The first mean of a pair for the next scale.
    first: f32,
    differences: [f32; ORDER],
    seen: u32,
    squares: f32,
}

impl Scale {
    /// Takes the next mean; returns the mean of two where there are two.
    fn add(&mut self, mean: f32) -> Option<f32> {
        let mut change = mean;
        for last in &mut self.differences {
            change -= core::mem::replace(last, change);
        }
        self.seen += 1;
        if self.seen > ORDER as u32 {
            self.squares += change * change;
        }
        let pair = 0.5 * (self.first + mean);
        self.first = mean;
        self.seen.is_multiple_of(2).then_some(pair)
    }

    /// Variance of one mean of so many samples as that of a sample.
    fn noise(&self, samples: f32) -> Option<Noise> {
        let count = self.seen.saturating_sub(ORDER as u32) as f32;
        let noise = Noise {
            variance_deg2: samples * self.squares / (SIXTH * count),
            freedom: count / OVERLAP,
        };
        (noise.freedom >= BELIEVED).then_some(noise)
    }
}

/// Means of a free decay.
#[derive(Clone, Debug)]
pub struct Decimated {
    points: [i16; POINTS],
    count: usize,
    /// Blocks of [`BLOCK`] samples in a mean.
    blocks: u32,
    /// Of the mean that is coming.
    sum_deg: f32,
    summed: u32,
    /// The whole buffer is taken, and longer means would resolve too little of the oscillation.
    full: bool,
    unit_deg: f32,
    /// What the means count from.
    reference_deg: f32,
    from_sample: u32,
    /// Samples in a cycle, once known.
    cycle: f32,
    /// Samples from one of the sensor's readings to the next.
    spread: u32,
    thirds: f32,
    thirds_seen: u32,
    scales: [Scale; SCALES],
}

/// A constant, so that the device is made where it stays and not put together elsewhere on the stack.
const NO_SCALES: [Scale; SCALES] =
    [Scale { first: 0.0, differences: [0.0; ORDER], seen: 0, squares: 0.0 }; SCALES];

impl Default for Decimated {
    fn default() -> Self {
        Self::new()
    }
}

impl Decimated {
    #[inline(always)]
    pub const fn new() -> Self {
        Self {
            points: [0; POINTS],
            count: 0,
            blocks: 1,
            sum_deg: 0.0,
            summed: 0,
            full: false,
            unit_deg: 1.0,
            reference_deg: 0.0,
            from_sample: 0,
            cycle: f32::INFINITY,
            spread: 1,
            thirds: 0.0,
            thirds_seen: 0,
            scales: NO_SCALES,
        }
    }

    /// Empties it for a free decay of this amplitude about this mid-line, from this sample on.
    pub fn begin(&mut self, from_sample: u32, amplitude_deg: f32, midline_deg: f32) {
        self.count = 0;
        self.blocks = 1;
        (self.sum_deg, self.summed) = (0.0, 0);
        self.full = false;
        self.unit_deg = amplitude_deg.max(MIN_AMPLITUDE_DEG) / AMPLITUDE_UNITS;
        self.reference_deg = midline_deg;
        self.from_sample = from_sample;
        self.cycle = f32::INFINITY;
        (self.thirds, self.thirds_seen) = (0.0, 0);
        self.scales = NO_SCALES;
    }

    /// Says how many samples a cycle takes.
    pub fn set_cycle(&mut self, samples: f32) {
        self.cycle = samples;
    }

    /// Readings of the sensor come so many samples from one another.
    pub fn set_spread(&mut self, samples: u32) {
        self.spread = samples;
    }

    pub fn points(&self) -> &[i16] {
        &self.points[..self.count]
    }

    pub fn from_sample(&self) -> u32 {
        self.from_sample
    }

    /// Samples in a mean.
    pub fn samples_per_point(&self) -> u32 {
        self.blocks * BLOCK as u32
    }

    /// Cycles that it holds; none before it is known how long they are.
    pub fn cycles(&self) -> f32 {
        self.count as f32 * self.samples_per_point() as f32 / self.cycle
    }

    pub fn unit_deg(&self) -> f32 {
        self.unit_deg
    }

    /// Forgets what came at or after this sample.
    pub fn end_before(&mut self, sample: u32) {
        let whole = sample.wrapping_sub(self.from_sample) / self.samples_per_point();
        self.count = self.count.min(whole as usize);
    }

    /// Forgets what came before this sample; false where it is too late to, as later samples are missing or
    /// none has come.
    pub fn begin_after(&mut self, sample: u32) -> bool {
        let first = sample.wrapping_sub(self.from_sample).div_ceil(self.samples_per_point());
        if self.full || first as usize > self.count {
            return false;
        }
        self.points.copy_within(first as usize..self.count, 0);
        self.count -= first as usize;
        self.from_sample = self.from_sample.wrapping_add(first * self.samples_per_point());
        true
    }

    /// Takes the block of the history that begins with this sample and is complete.
    #[inline(never)]
    pub fn block<S: Copy + Default + Into<f32>>(&mut self, history: &History<S>, first: u32) {
        if self.full {
            return;
        }
        for half in 0..2 {
            let at = |k: u32| history.degrees(first.wrapping_add(4 * half + k));
            let third = at(3) - 3.0 * (at(2) - at(1)) - at(0);
            self.thirds += third * third;
        }
        self.thirds_seen += 2;
        let mean_deg = history.block_mean(first) - self.reference_deg;
        let mut mean = Some(mean_deg);
        for scale in &mut self.scales {
            mean = mean.and_then(|mean| scale.add(mean));
        }
        self.sum_deg += mean_deg;
        self.summed += 1;
        if self.summed == self.blocks {
            self.push();
        }
    }

    fn push(&mut self) {
        if self.count == POINTS {
            if 2.0 * self.samples_per_point() as f32 > COARSEST * self.cycle {
                self.full = true;
            } else {
                // What has been summed up is now the half of a mean.
                self.halve();
            }
            return;
        }
        let mean_deg = self.sum_deg / self.summed as f32;
        (self.sum_deg, self.summed) = (0.0, 0);
        while (mean_deg / self.unit_deg).abs() > f32::from(i16::MAX) {
            // An oscillation that grows.
            self.unit_deg *= 2.0;
            self.points[..self.count].iter_mut().for_each(|point| *point /= 2);
        }
        let units = mean_deg / self.unit_deg;
        self.points[self.count] = (units + 0.5_f32.copysign(units)) as i16;
        self.count += 1;
    }

    /// Neighbours become one.
    fn halve(&mut self) {
        self.count = POINTS / 2;
        for k in 0..self.count {
            let pair = i32::from(self.points[2 * k]) + i32::from(self.points[2 * k + 1]);
            // Halves up and down by turns: rounding has no mean.
            self.points[k] = ((pair + (k & 1) as i32) >> 1) as i16;
        }
        self.blocks *= 2;
    }

    /// The noise, from third differences of the samples or, where it is stronger at lower frequencies, from
    /// means as long as a swing of `turn_rad` per sample lets.
    pub fn noise(&self, turn_rad: f32) -> Noise {
        let freedom = self.thirds_seen.max(1) as f32;
        let white = Noise { variance_deg2: self.thirds / (THIRD * freedom), freedom };
        let mut samples = BLOCK as f32;
        let mut shown = white;
        for (index, scale) in self.scales.iter().enumerate() {
            let Some(noise) = scale.noise(samples) else { break };
            if samples * turn_rad > SMOOTH_RAD {
                break;
            }
            shown = noise;
            shown.variance_deg2 /= seen_between(self.spread, index);
            samples *= 2.0;
        }
        if self.spread > 1 {
            // Samples lie on straight lines, on which there is no noise.
            return shown;
        }
        if shown.variance_deg2 > white.variance_deg2 {
            shown
        } else {
            white
        }
    }
}
