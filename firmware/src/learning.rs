//! What the refined estimates of a rig's releases have shown of the network's own error there.
//!
//! A network's error is smooth in what it says, so on one rig a line corrects it: an offset and a gain for
//! each output, the most probable ones (Bayes' linear regression). How large the error is beforehand the
//! releases say, too (empirical Bayes): as much as their noise does not explain, and no more than the
//! network's training found. Where noise explains all of it nothing is corrected, nor where the line is
//! little more certain than the network itself. What is learnt belongs to one network on one rig and is
//! forgotten with either, and where a release contradicts it: then the rig is another than was said.
//!
//! The flash keeps it ([`crate::records`]): 0 rig u32, 4 network u32, then the lines, little-endian `f32`s.
//! After a reset it holds as soon as the same rig is said to be mounted; what was forgotten is superseded in
//! the flash, too.

use crate::estimator::by_noise;
use crate::records::{append, newest, Tag};
use embedded_storage::nor_flash::NorFlash;
use yawrig_shared::checksum::crc32_of;
use yawrig_shared::network::Estimate;
use yawrig_shared::wire::{Condition, Forgotten, Learnt, Measured, Refusal};

/// Over this share of its value an output's error may have become another.
const ALIKE: f32 = 0.2;
/// An error is corrected once it is so many times as large as it is uncertain: else noise of one release
/// would go into the next.
const KNOWN: f32 = 3.0;
/// Beyond so many standard uncertainties a release contradicts what was learnt.
const CONTRADICTED: f32 = 4.0;

/// A network's mean over a release's windows, not corrected, with the standard uncertainty that noise gives
/// it.
#[derive(Clone, Copy, Debug)]
pub struct Seen {
    pub release: u32,
    pub means: [Measured; 2],
    /// Of so many windows.
    pub windows: u16,
    /// The network's error of one window, rms.
    pub single: [f32; 2],
    /// The network's error without noise, rms.
    pub bias: [f32; 2],
}

/// An output's error as a line: weighted sums over releases, in `x`, its relative distance from the first
/// one.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Line {
    first: f32,
    bias: f32,
    weight: f32,
    x: f32,
    xx: f32,
    error: f32,
    x_error: f32,
    /// Of the squares of the errors, each over its variance; and how many.
    squares: f32,
    count: f32,
}

/// Numbers of a line.
const NUMBERS: usize = 9;
/// What the flash keeps.
const BYTES: usize = 8 + 2 * 4 * NUMBERS;

impl Line {
    const NONE: Self = Self {
        first: 0.0,
        bias: 0.0,
        weight: 0.0,
        x: 0.0,
        xx: 0.0,
        error: 0.0,
        x_error: 0.0,
        squares: 0.0,
        count: 0.0,
    };

    fn numbers(&self) -> [f32; NUMBERS] {
        let Self { first, bias, weight, x, xx, error, x_error, squares, count } = *self;
        [first, bias, weight, x, xx, error, x_error, squares, count]
    }

    fn new(numbers: [f32; NUMBERS]) -> Self {
        let [first, bias, weight, x, xx, error, x_error, squares, count] = numbers;
        Self { first, bias, weight, x, xx, error, x_error, squares, count }
    }

    fn x_of(&self, value: f32) -> f32 {
        (value - self.first) / self.first
    }

    /// What is to be added at this value; nothing where that is not known well enough.
    fn at(&self, value: f32) -> Option<Measured> {
        // More than noise, by two standard deviations of what noise does.
        let beyond = self.squares - self.count - 2.0 * libm::sqrtf(2.0 * self.count);
        if beyond <= 0.0 {
            return None;
        }
        let size = (beyond / self.weight).min(self.bias * self.bias);
        // The sums, and what is known beforehand: an offset of that size, and a gain by which the error is
        // another one within [`ALIKE`].
        let offset = 1.0 / size;
        let (a, b, c) = (self.weight + offset, self.x, self.xx + offset * ALIKE * ALIKE);
        let determinant = a * c - b * b;
        let x = self.x_of(value);
        let variance = (c - 2.0 * b * x + a * x * x) / determinant;
        let constant = (c * self.error - b * self.x_error) / determinant;
        let slope = (a * self.x_error - b * self.error) / determinant;
        let known = KNOWN * KNOWN * variance < size;
        known.then(|| Measured { value: constant + slope * x, u: libm::sqrtf(variance) })
    }

    fn add(&mut self, value: f32, error: f32, variance: f32) {
        let (x, weight) = (self.x_of(value), 1.0 / variance);
        self.weight += weight;
        self.x += weight * x;
        self.xx += weight * x * x;
        self.error += weight * error;
        self.x_error += weight * x * error;
        self.squares += weight * error * error;
        self.count += 1.0;
    }
}

/// What is known of one network on one rig.
#[derive(Clone, Copy, Debug)]
pub struct Learning {
    /// Of which rig it is.
    rig: u32,
    /// It is the one that was said to be mounted.
    mounted: bool,
    lines: [Line; 2],
    /// The release whose refined estimate is still to come.
    seen: Option<Seen>,
    forgotten: Option<Forgotten>,
    /// The flash does not hold it as it is, and whether it is still to be tried.
    unsaved: bool,
    due: bool,
}

/// A number for a spring, an axis and the model on them.
fn rig_of(condition: &Condition) -> u32 {
    let Condition { rig, model, .. } = condition;
    let (length, area) = (model.length_m.to_le_bytes(), model.frontal_area_m2.to_le_bytes());
    crc32_of(&[&rig.to_le_bytes(), &length, &area])
}

impl Default for Learning {
    fn default() -> Self {
        Self::new()
    }
}

impl Learning {
    /// Nothing yet.
    pub const fn new() -> Self {
        Self {
            rig: 0,
            mounted: false,
            lines: [Line::NONE; 2],
            seen: None,
            forgotten: None,
            unsaved: false,
            due: false,
        }
    }

    /// The coming releases are made under this condition.
    pub fn mount(&mut self, condition: &Condition) {
        self.mount_rig(rig_of(condition));
    }

    fn mount_rig(&mut self, rig: u32) {
        if self.rig != rig {
            self.forget(Forgotten::Rig);
        }
        (self.rig, self.mounted) = (rig, true);
    }

    /// What was learnt holds no longer.
    pub fn forget(&mut self, why: Forgotten) {
        self.seen = None;
        if self.lines != [Line::NONE; 2] {
            self.lines = [Line::NONE; 2];
            self.forgotten = Some(why);
            self.changed();
        }
    }

    fn changed(&mut self) {
        (self.unsaved, self.due) = (true, true);
    }

    /// What is known, for who asks.
    pub fn learnt(&self) -> Learnt {
        let [a, b] = self.lines.map(|line| line.count as u16);
        Learnt { releases: a.max(b), kept: !self.unsaved, forgotten: self.forgotten }
    }

    /// Takes up what the flash has kept of this network.
    #[inline(never)]
    pub fn recall<F: NorFlash>(&mut self, flash: &mut F, network: u32) {
        let mounted = Some(self.rig).filter(|_| self.mounted);
        *self = Self::new();
        let newest = newest(flash);
        if let Some(record) = newest.learnt {
            let word = |at: usize| {
                let [a, b, c, d] = [0, 1, 2, 3].map(|byte| record.body[at + byte]);
                u32::from_le_bytes([a, b, c, d])
            };
            let number = |index: usize| f32::from_bits(word(8 + 4 * index));
            self.rig = word(0);
            self.lines = [0, NUMBERS]
                .map(|first| Line::new(core::array::from_fn(|index| number(first + index))));
            if word(4) != network {
                self.forget(Forgotten::Network);
            }
        } else if newest.torn_learnt {
            self.forgotten = Some(Forgotten::Damaged);
        }
        if let Some(rig) = mounted {
            self.mount_rig(rig);
        }
    }

    /// Something is to be kept ([`Learning::keep`]).
    pub fn is_due(&self) -> bool {
        self.due
    }

    /// Keeps what is known of this network in the flash. Where that takes it not it is tried again with the
    /// next release.
    #[inline(never)]
    pub fn keep<F: NorFlash>(&mut self, flash: &mut F, network: u32) -> Result<(), Refusal> {
        self.due = false;
        let mut bytes = [0; BYTES];
        bytes[..4].copy_from_slice(&self.rig.to_le_bytes());
        bytes[4..8].copy_from_slice(&network.to_le_bytes());
        let numbers = self.lines.iter().flat_map(Line::numbers);
        for (place, number) in bytes[8..].chunks_exact_mut(4).zip(numbers) {
            place.copy_from_slice(&number.to_le_bytes());
        }
        append(flash, Tag::Learnt, &bytes)?;
        self.unsaved = false;
        Ok(())
    }

    /// What is to be added to an output, once its rig was said.
    fn error_at(&self, output: usize, value: f32) -> Option<Measured> {
        self.lines[output].at(value).filter(|_| self.mounted)
    }

    /// The network's estimate with what is known of its error.
    pub fn corrected(&self, estimate: &Estimate) -> Estimate {
        let add = |output: usize, value: f32| {
            value + self.error_at(output, value).map_or(0.0, |error| error.value)
        };
        Estimate {
            natural_frequency_rad_s: add(0, estimate.natural_frequency_rad_s),
            damping_ratio: add(1, estimate.damping_ratio),
            ..*estimate
        }
    }

    /// A release's mean with what is known of its error, which then is uncertain by that and no longer by the
    /// network's.
    pub fn result(&self, seen: &Seen) -> [Measured; 2] {
        core::array::from_fn(|output| {
            let Measured { value, u } = seen.means[output];
            let bias = seen.bias[output];
            let error = self.error_at(output, value).unwrap_or(Measured { value: 0.0, u: bias });
            Measured { value: value + error.value, u: libm::sqrtf(u * u + error.u * error.u) }
        })
    }

    /// A release of the rig is over, and what is refined of it is still to come.
    pub fn expect(&mut self, seen: Seen) {
        self.seen = Some(seen).filter(|_| self.mounted);
    }

    /// It has come, of a record that nothing is the matter with.
    pub fn learn(&mut self, release: u32, refined: [Measured; 2]) {
        let Some(seen) = self.seen.take_if(|seen| seen.release == release) else { return };
        let found: [_; 2] = core::array::from_fn(|output| {
            let (mean, truth) = (seen.means[output], refined[output]);
            let single = seen.single[output] * seen.single[output];
            let noise = by_noise(mean.u * mean.u, seen.windows, single);
            (truth.value - mean.value, noise + truth.u * truth.u)
        });
        let contradicts = (0..2).any(|output| {
            let (error, variance) = found[output];
            let known = self.error_at(output, seen.means[output].value);
            known.is_some_and(|known| {
                let off = error - known.value;
                off * off > CONTRADICTED * CONTRADICTED * (variance + known.u * known.u)
            })
        });
        if contradicts {
            self.forget(Forgotten::Contradicted);
        }
        for (output, (error, variance)) in found.into_iter().enumerate() {
            let (value, bias) = (seen.means[output].value, seen.bias[output]);
            let line = &mut self.lines[output];
            // Neither a network that says nothing of its error nor an output of zero is learnt about.
            if variance > 0.0 && bias > 0.0 && value != 0.0 {
                if line.weight == 0.0 {
                    *line = Line { first: value, bias, ..Line::NONE };
                }
                line.add(value, error, variance);
                (self.unsaved, self.due) = (true, true);
            }
        }
    }
}
