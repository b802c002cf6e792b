//! What the refined estimates of a rig's releases have shown of the network's own error there.
//!
//! A network's error is smooth in what it says, so on one rig a line corrects it: an offset and a gain for each output, the
//! most probable ones (Bayes' linear regression). How large the error is beforehand the releases say, too (empirical
//! Bayes): as much as their noise does not explain, and no more than the network's training found. Where noise explains
//! all of it nothing is corrected, nor where the line is little more certain than the network itself. What is learnt
//! belongs to one network on one rig and is forgotten with either, with the power, and where a release contradicts it: then
//! the rig is another than was said.

use serde::{Deserialize, Serialize};
use yawrig_shared::derivatives::Model;
use yawrig_shared::network::Estimate;
use yawrig_shared::wire::{Condition, Measured};

/// Over this share of its value an output's error may have become another.
const ALIKE: f32 = 0.2;
/// An error is corrected once it is so many times as large as it is uncertain: else noise of one release would go into the
/// next.
const KNOWN: f32 = 3.0;
/// Beyond so many standard uncertainties a release contradicts what was learnt.
const CONTRADICTED: f32 = 4.0;

/// A network's mean over a release's windows, not corrected, with the standard uncertainty that noise gives it.
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

/// An output's error as a line: weighted sums over releases, in `x`, its relative distance from the first one.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
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

impl Line {
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
        // The sums, and what is known beforehand: an offset of that size, and a gain by which the error is another one
        // within [`ALIKE`].
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
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub struct Learning {
    rig: Option<(u32, Model)>,
    lines: [Line; 2],
    /// The release whose refined estimate is still to come.
    #[serde(skip)]
    seen: Option<Seen>,
}

impl Learning {
    /// Nothing yet.
    pub const fn new() -> Self {
        const NOTHING: Line = Line {
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
        Self { rig: None, lines: [NOTHING; 2], seen: None }
    }

    /// The coming releases are made under this condition.
    pub fn mount(&mut self, condition: &Condition) {
        let rig = Some((condition.rig, condition.model));
        if self.rig != rig {
            *self = Self { rig, ..Self::new() };
        }
    }

    /// Another network runs.
    pub fn forget(&mut self) {
        *self = Self { rig: self.rig, ..Self::new() };
    }

    /// The network's estimate with what is known of its error.
    pub fn corrected(&self, estimate: &Estimate) -> Estimate {
        let add = |line: &Line, value: f32| value + line.at(value).map_or(0.0, |error| error.value);
        Estimate {
            natural_frequency_rad_s: add(&self.lines[0], estimate.natural_frequency_rad_s),
            damping_ratio: add(&self.lines[1], estimate.damping_ratio),
        }
    }

    /// A release's mean with what is known of its error, which then is uncertain by that and no longer by the network's.
    pub fn result(&self, seen: &Seen) -> [Measured; 2] {
        core::array::from_fn(|output| {
            let Measured { value, u } = seen.means[output];
            let bias = seen.bias[output];
            let error = self.lines[output].at(value).unwrap_or(Measured { value: 0.0, u: bias });
            Measured { value: value + error.value, u: libm::sqrtf(u * u + error.u * error.u) }
        })
    }

    /// A release of the rig is over, and what is refined of it is still to come.
    pub fn expect(&mut self, seen: Seen) {
        self.seen = Some(seen).filter(|_| self.rig.is_some());
    }

    /// It has come, of a record that nothing is the matter with.
    pub fn learn(&mut self, release: u32, refined: [Measured; 2]) {
        let Some(seen) = self.seen.take_if(|seen| seen.release == release) else { return };
        let found: [_; 2] = core::array::from_fn(|output| {
            let (mean, truth) = (seen.means[output], refined[output]);
            let scatter = mean.u * mean.u;
            let windows = f32::from(seen.windows);
            // The scatter of few windows says little of itself (Student); that of the fewest nothing.
            let noise = if seen.windows > 4 {
                scatter * (windows - 1.0) / (windows - 3.0)
            } else {
                scatter.max(seen.single[output] * seen.single[output] / windows)
            };
            (truth.value - mean.value, noise + truth.u * truth.u)
        });
        let contradicts = (0..2).any(|output| {
            let (error, variance) = found[output];
            let known = self.lines[output].at(seen.means[output].value);
            known.is_some_and(|known| {
                let off = error - known.value;
                off * off > CONTRADICTED * CONTRADICTED * (variance + known.u * known.u)
            })
        });
        if contradicts {
            self.forget();
        }
        for (output, (error, variance)) in found.into_iter().enumerate() {
            let (value, bias) = (seen.means[output].value, seen.bias[output]);
            let line = &mut self.lines[output];
            // Neither a network that says nothing of its error nor an output of zero is learnt about.
            if variance > 0.0 && bias > 0.0 && value != 0.0 {
                if line.weight == 0.0 {
                    *line = Line { first: value, bias, ..Line::default() };
                }
                line.add(value, error, variance);
            }
        }
    }
}
