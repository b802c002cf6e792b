//! What a fit leaves of a record, held against the noise.
//!
//! Where only noise is left, the power of the residual's means over a twelfth of a cycle goes by a chi-square
//! law: over the noise's it is one, and scatters with the degrees of freedom of either. Beyond what chance
//! does once in a thousand records, and beyond 1.7 times the noise's power, which leaves room for noise of
//! some colour, something is missing. On means of a fiftieth of a cycle, the measure of the host, that is
//! 1.08 times the noise; a misfit at 1.5 times the noise has six times the noise's power.
//!
//! Beside it stands the spectral density of the residual about the damped frequency, from which standard
//! uncertainties follow for noise of any colour (Bartlett's averaged periodogram, Biometrika 37, 1950).

use crate::envelope::Envelope;
use crate::refine::{Parameters, Phasor, PIECE};

/// Means a cycle on which residual and noise are compared.
const PER_CYCLE: f32 = 12.0;
/// And those the host compares them on.
const HOST_PER_CYCLE: f32 = 50.0;
/// Power of the residual over that of the noise at which something is missing: at least, and in standard
/// deviations.
const MISSING: f32 = 1.7;
const BEYOND_CHANCE: f32 = 3.0;
/// Numbers that a fit takes out of the residual; and those of them that lie about the damped frequency, as
/// complex ones.
const PARAMETERS: f32 = 5.0;
const ABSORBED: f32 = 2.0;
/// Variance of a mean that was rounded.
const ROUNDING: f32 = 1.0 / 12.0;
/// Segments of the averaged periodogram, and at most so many a cycle.
const SEGMENTS: f32 = 24.0;
const SEGMENTS_PER_CYCLE: f32 = 3.0;

/// A residual in figures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Judged {
    /// Rms of the residual over that of the noise, on means of a fiftieth of a cycle.
    pub over_noise: f32,
    /// More is left than noise.
    pub misfit: bool,
    /// Something is likely to be missing.
    pub widened: bool,
    /// Spectral density at the damped frequency over the variance: 1 for white noise; and what of it stands for
    /// what is missing, in decay and in frequency.
    pub colour: f32,
    pub missing: [f32; 2],
}

/// A judgement under way.
#[derive(Clone, Debug)]
pub struct Residual {
    model: Parameters,
    /// The model's, and one that does not decay; made when they are needed.
    swing: Phasor,
    turning: Phasor,
    phasors: u8,
    at: usize,
    /// Means in a twelfth of a cycle, and in a segment.
    together: u32,
    segment: u32,
    /// Of the twelfth and of the segment that are coming.
    sum: f32,
    summed: u32,
    transform: (f32, f32),
    transformed: u32,
    /// Sums of squares: of all, of twelfths, of segments.
    squares: f32,
    twelfths: (f32, u32),
    segments: (f32, u32),
    envelope: Envelope,
}

impl Residual {
    /// None yet.
    pub const NONE: Self = Self {
        model: Parameters::NONE,
        swing: Phasor::NONE,
        turning: Phasor::NONE,
        phasors: 0,
        at: 0,
        together: 1,
        segment: 1,
        sum: 0.0,
        summed: 0,
        transform: (0.0, 0.0),
        transformed: 0,
        squares: 0.0,
        twelfths: (0.0, 0),
        segments: (0.0, 0),
        envelope: Envelope::NONE,
    };

    /// Of `count` means about `model`.
    pub fn new(model: &Parameters, count: usize) -> Self {
        let per_cycle = (core::f64::consts::TAU / model.frequency) as f32;
        let cycles = count as f32 / per_cycle;
        let segments = (SEGMENTS_PER_CYCLE * cycles).clamp(1.0, SEGMENTS);
        Self {
            model: *model,
            together: ((per_cycle / PER_CYCLE) as u32).max(1),
            segment: ((count as f32 / segments) as u32).max(1),
            envelope: Envelope::new(model, count),
            ..Self::NONE
        }
    }

    /// Goes on by one piece of `points`; true where that was the last.
    #[inline(never)]
    pub fn work(&mut self, points: &[i16]) -> bool {
        self.phasors += u8::from(self.phasors < 3);
        match self.phasors {
            1 => self.swing = Phasor::new(self.model.decay, self.model.frequency),
            2 => self.turning = Phasor::new(0.0, self.model.frequency),
            _ if self.at < points.len() => self.look(points),
            _ => return self.envelope.work(),
        }
        false
    }

    fn look(&mut self, points: &[i16]) {
        let (mut z, mut turn) = (self.swing.next_piece(), self.turning.next_piece());
        let (swing, turning) = (self.swing, self.turning);
        let end = (self.at + PIECE).min(points.len());
        let Parameters { cosine, sine, offset, .. } = self.model;
        let (a, b, c) = (cosine as f32, sine as f32, offset as f32);
        for &point in &points[self.at..end] {
            let r = f32::from(point) - (a * z.0 + b * z.1 + c);
            self.add(r, turn);
            z = swing.turn(z);
            turn = turning.turn(turn);
        }
        self.at = end;
    }

    fn add(&mut self, r: f32, turn: (f32, f32)) {
        self.squares += r * r;
        self.sum += r;
        self.summed += 1;
        if self.summed == self.together {
            self.twelfths.0 += self.sum * self.sum;
            self.twelfths.1 += 1;
            (self.sum, self.summed) = (0.0, 0);
        }
        let (re, im) = (r * turn.0, r * turn.1);
        self.envelope.add(re, im);
        self.transform.0 += re;
        self.transform.1 += im;
        self.transformed += 1;
        if self.transformed == self.segment {
            let (re, im) = self.transform;
            self.segments.0 += re * re + im * im;
            self.segments.1 += 1;
            (self.transform, self.transformed) = ((0.0, 0.0), 0);
        }
    }

    /// The judgement; `noise` is the variance of one mean, in the same units, known with so many degrees of
    /// freedom. Steps of the sensor's stand still while the model turns, however many samples make a mean:
    /// `steps` is their variance.
    pub fn judged(&self, noise: f32, noise_freedom: f32, steps: f32) -> Judged {
        // Means are rounded to whole units.
        let noise = noise.max(ROUNDING);
        let together = self.together as f32;
        let freedom = |count: u32, taken: f32| (count as f32 - taken).max(1.0);
        let variance = self.squares / freedom(self.at as u32, PARAMETERS);
        let power = self.twelfths.0 / together / freedom(self.twelfths.1, PARAMETERS);
        let density = self.segments.0 / self.segment as f32 / freedom(self.segments.1, ABSORBED);
        // Where chance leads, by Wilson and Hilferty (PNAS 17, 1931).
        let spread = 2.0 / 9.0 * (1.0 / freedom(self.twelfths.1, PARAMETERS) + 1.0 / noise_freedom);
        let root = 1.0 - spread + BEYOND_CHANCE * libm::sqrtf(spread);
        let chance = root * root * root;
        // Excess power is the same on finer means, and the noise is more.
        let per_cycle = (core::f64::consts::TAU / self.model.frequency) as f32 / together;
        let share = (power / noise - 1.0) * per_cycle / HOST_PER_CYCLE;
        let mut colour = density / variance;
        if self.segments.1 < SEGMENTS as u32 {
            // Known from so few, it is no proof of less than a white one's, nor of less than the noise.
            colour = colour.max(1.0).max(noise / variance);
        }
        let missing = self.envelope.missing();
        Judged {
            over_noise: libm::sqrtf((1.0 + share).max(0.0)),
            misfit: power > MISSING.max(chance) * noise.max(together * steps),
            widened: missing.likely,
            colour,
            missing: missing.added.map(|added| added / variance),
        }
    }
}
