//! Where in a release the model is, told from the potentiometer alone.
//!
//! Held: block means stay within a band for longer than half the slowest period, which no
//! oscillation of interest does. Released: they leave that band. Ringing: three turning points,
//! so that there is a mid-line and an amplitude. Finished: the amplitude is below the range.

use yawrig_shared::history::BLOCK;
use yawrig_shared::window::Extreme;
use yawrig_shared::wire::Phase;

/// Longer than half a period at 2.5 rad/s (1.26 s), in samples.
const STILL_SAMPLES: u32 = 1304;
/// Peak to peak, degrees: above the noise of block means, far below any release.
const STILL_BAND_DEG: f32 = 0.5;
/// A model that has rung down and moves this many times the lower end of the range is moved anew.
const STIRRED: f32 = 2.0;

/// What the release logic wants done.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Step {
    /// Let go from rest here: track from this turning point.
    LetGo(Extreme),
    /// Came to rest: whatever was going on is over.
    AtRest,
    /// Moves again without having been held: track anew.
    Stirred,
}

/// Follows the block means.
#[derive(Clone, Copy, Debug)]
pub struct Watch {
    phase: Phase,
    still_blocks: u32,
    still_low: f32,
    still_high: f32,
    still_sum: f32,
}

impl Default for Watch {
    fn default() -> Self {
        Self::new()
    }
}

impl Watch {
    pub const fn new() -> Self {
        Self {
            phase: Phase::Waiting,
            still_blocks: 0,
            still_low: 0.0,
            still_high: 0.0,
            still_sum: 0.0,
        }
    }

    pub fn phase(&self) -> Phase {
        self.phase
    }

    /// Sets what the turning points and windows have shown.
    pub fn set_phase(&mut self, phase: Phase) {
        self.phase = phase;
    }

    /// Takes the next block mean; `at` is the block's middle, `midline_deg` the last known one.
    pub fn block(
        &mut self,
        at: u32,
        mean_deg: f32,
        midline_deg: Option<f32>,
        to_deg: f32,
    ) -> Option<Step> {
        let was = self.rest_deg();
        let within = self.still_blocks > 0
            && mean_deg.max(self.still_high) - mean_deg.min(self.still_low) <= STILL_BAND_DEG;
        if within {
            self.still_low = self.still_low.min(mean_deg);
            self.still_high = self.still_high.max(mean_deg);
            self.still_sum += mean_deg;
            self.still_blocks += 1;
        } else {
            (self.still_low, self.still_high, self.still_sum) = (mean_deg, mean_deg, mean_deg);
            self.still_blocks = 1;
        }
        let still = self.still_blocks * BLOCK as u32 >= STILL_SAMPLES;
        // A sum of many blocks loses the newest ones' digits.
        if self.still_blocks >= 4096 {
            self.still_sum *= 0.5;
            self.still_blocks /= 2;
        }
        match self.phase {
            Phase::Held if !still => {
                self.phase = Phase::Released;
                let at = at.wrapping_sub(BLOCK as u32);
                Some(Step::LetGo(Extreme { at, yaw_deg: was }))
            }
            Phase::Held => None,
            _ if still => {
                self.phase = Phase::Held;
                Some(Step::AtRest)
            }
            Phase::Finished => {
                let away = midline_deg.map_or(0.0, |c| (mean_deg - c).abs());
                (away > STIRRED * to_deg).then(|| {
                    self.phase = Phase::Waiting;
                    Step::Stirred
                })
            }
            _ => None,
        }
    }

    fn rest_deg(&self) -> f32 {
        self.still_sum / self.still_blocks.max(1) as f32
    }
}
