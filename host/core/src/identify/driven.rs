//! Where the model is driven before it is left to itself.
//!
//! What a free decay loses in a cycle is least at the smallest amplitude, whether it is lost to viscous
//! damping, dry friction or drag: its envelope is convex. Where the amplitude stands or rises and from then
//! on falls for good, something had kept it up until there.

use super::envelope::POINTS_PER_CYCLE;
use super::release::Search;
use crate::solver::linear_fit;
use crate::statistics::median;

/// Shares of the amplitude at the release between which the fall after it is looked at: below the first it is
/// sure to have begun, above the last it is still the same.
const FALL: [f64; 2] = [0.97, 0.75];
/// Share of the loss after the release that is left before it: dry friction and drag leave 0.8 and more.
const LEAST_CHANGE: f64 = 0.3;
/// Cycles, and share of the time that the fall after it takes, in which the amplitude was kept up.
const DRIVEN_CYCLES: usize = 3;
const DRIVEN_SHARE: f64 = 0.3;
/// Points that a straight line is laid through, at least.
const FEWEST_POINTS: usize = 6;
/// A rise from the least amplitude so far: beats rise again, what is pushed, too.
const RISES: f64 = 1.15;
/// The share of the amplitude at the release that has to be reached, and the one above which no rise is
/// allowed for some time more, in times that this takes: two equal modes beat as the size of a cosine does,
/// which is down to a half at 60 degrees and up to a quarter again at 104.5, 1.74 times that.
const FALLS_TO: f64 = 0.5;
const RETURNS_TO: f64 = 0.25;
const RETURNS_AFTER: f64 = 1.8;
/// Most points that are looked at: of a longer envelope every second, third, ...
const MOST_POINTS: usize = 8192;
/// Loss of amplitude while it is kept up, over what noise makes of it.
const LOSS_OVER_NOISE: f64 = 6.0;

impl Search<'_> {
    /// The time until which the model was driven; none where its decay begins otherwise.
    pub(super) fn driven_until(&self) -> Option<f64> {
        let every = self.points.len().div_ceil(MOST_POINTS);
        let amplitude = self.smoothed(every);
        let largest = amplitude.iter().copied().fold(0.0, f64::max);
        // The last one: what comes before was ended by being driven.
        let kinks = (0..amplitude.len()).rev().filter(|&k| amplitude[k] > FALLS_TO * largest);
        let at = kinks.map(|k| self.kink(&amplitude, every, k)).find_map(|kink| kink)?;
        let hop_s = self.period / POINTS_PER_CYCLE as f64 * every as f64;
        Some(self.points[0].time_s + at * hop_s)
    }

    /// So many of the amplitudes, each the median of the cycle about it: a wild sample makes a spike of a
    /// cycle.
    fn smoothed(&self, every: usize) -> Vec<f64> {
        let half = POINTS_PER_CYCLE / 2;
        let last = self.points.len() - 1;
        let middle = |k: usize| {
            let about = &self.points[k.saturating_sub(half)..=(k + half).min(last)];
            let mut values: Vec<f64> = about.iter().map(|p| p.amplitude_deg).collect();
            median(&mut values)
        };
        (0..=last).step_by(every).map(middle).collect()
    }

    /// Where among the amplitudes the release is, if they stand or rise until about number `k` and fall for
    /// good after it.
    fn kink(&self, amplitude: &[f64], every: usize, k: usize) -> Option<f64> {
        let level = amplitude[k];
        let reaches = |share: f64| (k..amplitude.len()).find(|&j| amplitude[j] < share * level);
        let [begun, fallen] = [reaches(FALL[0])?, reaches(FALL[1])?];
        let halved = reaches(FALLS_TO)?;
        let until = k + (RETURNS_AFTER * (halved - k) as f64) as usize;
        let mut least = f64::INFINITY;
        let rises = amplitude[k..until.min(amplitude.len())].iter().any(|a| {
            least = least.min(*a);
            *a > RETURNS_TO * level && *a > RISES * least
        });
        // Where the record ends before: beats do not stand as long as they fall.
        let stood = amplitude[..k].iter().rev();
        let stood = stood.take_while(|a| **a > FALL[1] * level && **a < level / FALL[0]).count();
        if rises || (until > amplitude.len() && stood < until - k) {
            return None;
        }
        let kept_up = amplitude[..k].iter().rev().take_while(|a| **a > FALLS_TO * level);
        let before = (fallen - k).min(kept_up.count());
        let long = before * every >= DRIVEN_CYCLES * POINTS_PER_CYCLE
            && before >= FEWEST_POINTS
            && before as f64 >= DRIVEN_SHARE * (fallen - k) as f64;
        if !long {
            return None;
        }
        let fall = |points: std::ops::Range<usize>| {
            let rows = points.map(|j| ([1.0, (j as f64) - k as f64], amplitude[j]));
            linear_fit(rows)
        };
        // Straight lines through both: what they lose in a point.
        let [early, late] = [fall(k - before..k + 1)?, fall(begun..fallen + 1)?];
        let latest = fall(k - before / 2..k + 1)?;
        let expected = -late[1] * before as f64;
        let is_seen = expected > LOSS_OVER_NOISE * self.amplitude_noise();
        // Behind a push it would fall already.
        let slowest = early[1].min(latest[1]);
        let stands = -slowest < LEAST_CHANGE * -late[1] && is_seen;
        let is_kink = stands && amplitude[k - before..k].iter().all(|a| *a < level / FALL[0]);
        is_kink.then(|| k as f64 + (early[0] - late[0]) / (late[1] - early[1]))
    }
}
