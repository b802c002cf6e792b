//! Where in a release the model is, from the potentiometer alone.
//!
//! Held: block means stay within a band for longer than the model's swings take, or, where they are
//! not known, than half the period of a slow one. Released: they leave their rest. Ringing: three turning
//! points, so that there is a mid-line and an amplitude. Finished: the amplitude is below the range.

use yawrig_shared::history::BLOCK;
use yawrig_shared::window::Extreme;
use yawrig_shared::wire::Phase;

/// Longer than half a period at 2.5 rad/s (1.26 s), in samples; slower models take longer.
const STILL_SAMPLES: u32 = 1304;
/// The same for the last of a decay, of which half a period may show one side alone: its rest would be put
/// off its mid-line, and its other side would look like a release.
const DIED_DOWN_SAMPLES: u32 = 1800;
/// Peak to peak, degrees: above the noise of the means it is held against, far below any release.
const STILL_BAND_DEG: f32 = 0.35;
/// And below the smallest swing that is analysed, which goes from one side to the other.
const STILL_BAND_SHARE: f32 = 1.5;
/// The same where the noise of the means is more: so many times it holds all of some forty normal deviates
/// but once in ten thousand; up to 1 deg of a sample's noise, or an oscillation would be taken for noise.
const STILL_BAND_NOISE: f32 = 6.5;
const MAX_BAND_DEG: f32 = 1.15;
/// Blocks whose mean that is: 32 ms take little from the fastest swing and most from noise and hum.
const SMOOTHED: u32 = 4;
/// How far from its rest a held model must be to have been let go: this, or where the band is narrow so many
/// times the band; and beyond this share of the lower end of the range.
const LET_GO_DEG: f32 = 0.5;
const LET_GO_BANDS: f32 = 1.5;
const LET_GO_SHARE: f32 = 0.5;
/// And beyond this many times the noise of a block's mean.
const LET_GO_NOISE: f32 = 6.0;
/// Time constant of the rest's drift, blocks: 1 s.
const DRIFT_BLOCKS: f32 = 128.0;
/// A model that has rung down and moves this many times the lower end of the range is moved anew.
const STIRRED: f32 = 2.0;
/// And by more than noise alone comes to in an hour.
const STIRRED_NOISE: f32 = 8.0;

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
    /// The latest stretch of block means within the band: its length and its ends.
    still_blocks: u32,
    /// Sum of the block means that make the next smooth one, and how many they are.
    smooth_sum: f32,
    smooth_blocks: u32,
    still_low: f32,
    still_high: f32,
    /// Where the model is held, following a slow drift.
    rest_deg: f32,
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
            smooth_sum: 0.0,
            smooth_blocks: 0,
            still_low: 0.0,
            still_high: 0.0,
            rest_deg: 0.0,
        }
    }

    pub fn phase(&self) -> Phase {
        self.phase
    }

    /// Where the model is held, or was.
    pub fn rest_deg(&self) -> f32 {
        self.rest_deg
    }

    /// Sets what the turning points and windows have shown.
    pub fn set_phase(&mut self, phase: Phase) {
        self.phase = phase;
    }

    /// The block means come on another scale from now on, `times` as large as before.
    pub fn rescale(&mut self, times: f32) {
        let ends = [self.still_low * times, self.still_high * times];
        (self.still_low, self.still_high) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
        self.smooth_sum *= times;
        self.rest_deg *= times;
    }

    /// Takes the next block mean and its noise's rms; `at` is the block's middle, `midline_deg` the last
    /// known one; the model's swings are known to take so many samples at least.
    pub fn block(
        &mut self,
        at: u32,
        mean_deg: f32,
        noise_deg: f32,
        swing_samples: u32,
        midline_deg: Option<f32>,
        to_deg: f32,
    ) -> Option<Step> {
        // A mean of four blocks has half the noise of one.
        let least_band_deg = STILL_BAND_DEG.min(STILL_BAND_SHARE * to_deg);
        let band_deg = (0.5 * STILL_BAND_NOISE * noise_deg).clamp(least_band_deg, MAX_BAND_DEG);
        let still = self.still(mean_deg, band_deg, swing_samples);
        match self.phase {
            Phase::Held => {
                let rest_deg = self.rest_deg;
                self.rest_deg += (mean_deg - rest_deg) / DRIFT_BLOCKS;
                // The last of a decay oscillates about its rest, too, but not so far.
                let band = LET_GO_DEG.min(LET_GO_BANDS * band_deg);
                let least = band.max(LET_GO_SHARE * to_deg).max(LET_GO_NOISE * noise_deg);
                let let_go = (mean_deg - rest_deg).abs() > least;
                let_go.then(|| {
                    self.phase = Phase::Released;
                    let at = at.wrapping_sub(BLOCK as u32);
                    Step::LetGo(Extreme { at, yaw_deg: rest_deg })
                })
            }
            _ if still => {
                self.phase = Phase::Held;
                self.rest_deg = 0.5 * (self.still_low + self.still_high);
                Some(Step::AtRest)
            }
            Phase::Finished => {
                let away = midline_deg.map_or(0.0, |c| (mean_deg - c).abs());
                (away > (STIRRED * to_deg).max(STIRRED_NOISE * noise_deg)).then(|| {
                    self.phase = Phase::Waiting;
                    Step::Stirred
                })
            }
            _ => None,
        }
    }

    /// Whether the model has kept to the band for long enough.
    fn still(&mut self, mean_deg: f32, band_deg: f32, swing_samples: u32) -> bool {
        self.smooth_sum += mean_deg;
        self.smooth_blocks += 1;
        if self.smooth_blocks < SMOOTHED {
            return false;
        }
        let mean_deg = self.smooth_sum / SMOOTHED as f32;
        (self.smooth_sum, self.smooth_blocks) = (0.0, 0);
        let (low, high) = (self.still_low.min(mean_deg), self.still_high.max(mean_deg));
        if self.still_blocks > 0 && high - low <= band_deg {
            (self.still_low, self.still_high) = (low, high);
            self.still_blocks = self.still_blocks.saturating_add(SMOOTHED);
        } else {
            (self.still_low, self.still_high) = (mean_deg, mean_deg);
            self.still_blocks = SMOOTHED;
        }
        let needed = if self.phase == Phase::Finished { DIED_DOWN_SAMPLES } else { STILL_SAMPLES };
        self.still_blocks.saturating_mul(BLOCK as u32) >= needed.max(swing_samples)
    }
}
