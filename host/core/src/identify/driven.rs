//! Where the model is driven or pushed before it is left to itself.
//!
//! What a free decay loses in a cycle depends on its amplitude alone, and smoothly so. Where the amplitude was
//! kept up until it falls for good, its logarithm has a kink; where it rose, something had pushed it. Two modes
//! that beat rise, too, but turn round smoothly, and fall as fast as they have risen, again and again.

use super::ends::PUSHED_RATIO;
use super::envelope::{rises, Point, POINTS_PER_CYCLE, RISES};
use super::release::Search;
use super::Begin;
use crate::solver::linear_fit;
use crate::statistics::median;

/// Share of the amplitude at the release down to which the fall after it, and what is before it, is looked at.
const FALL: f64 = 0.75;
/// Share of the loss after the release that is left before it: dry friction and drag leave 0.8 and more.
const MIN_CHANGE: f64 = 0.3;
/// Cycles, and share of the time that the fall after it takes, in which the amplitude was kept up.
const DRIVEN_CYCLES: usize = 3;
const DRIVEN_SHARE: f64 = 0.3;
/// Share of the squares of a smooth curve with as many numbers that a kink leaves: most of what the curve misses
/// has to be the kink.
const SHARPER: f64 = 0.5;
/// Share of the fall that a kink leaves: what shakes a model makes it stand and fall, too, but wanders. Of planted
/// drives with noise up to 2 % of the amplitude it is up to 0.025, of planted random moments from 0.037 on.
const LEFT: f64 = 0.03;
/// Points that the logarithm of the amplitude is laid through, about.
const POINTS: usize = 64;
/// Fewest of them before the release.
const MIN_POINTS: usize = 6;
/// The share of the largest amplitude that has to be left at the release.
const FALLS_TO: f64 = 0.5;
/// A push's fall takes that many times as long as its rise.
const FALLS_LONGER: usize = 3;
/// Share of the amplitude after a push down to which it is a free decay.
const DIED_OUT: f64 = 0.05;
/// Most points that are looked at: of a longer envelope every second, third, ...
const MAX_POINTS: usize = 8192;
/// Loss of amplitude while it is kept up, over what noise makes of it.
const LOSS_OVER_NOISE: f64 = 6.0;

/// A kink of the amplitude's logarithm.
struct Kink {
    at: usize,
    /// Amplitudes before it that it is seen by.
    before: usize,
    /// Sum of squares that it leaves, as a share of a smooth curve's with as many numbers.
    leaves: f64,
}

impl Search<'_> {
    /// The time from which the model is left alone, and what it was before; none where its decay begins
    /// otherwise.
    pub(super) fn left_alone(&self) -> Option<(f64, Begin)> {
        let every = self.points.len().div_ceil(MAX_POINTS);
        let amplitude = self.smoothed(every);
        let largest = amplitude.iter().copied().fold(0.0, f64::max);
        let cycle = (POINTS_PER_CYCLE / every).max(1);
        // An amplitude is of a cycle about it: half a cycle later it is free for certain.
        let free = |k: usize| (k + cycle.div_ceil(2), Begin::Driven);
        let driven = self.kept_up_until(&amplitude, largest, every).map(free);
        let swings: Vec<bool> = self.points.iter().step_by(every).map(Point::swings).collect();
        let pushed = pushed(&amplitude, &swings, largest, cycle).map(|[begun, peak]| {
            // A slow one is over at its peak; of a fast one the search sees to the end.
            match peak - begun > DRIVEN_CYCLES * cycle {
                true => (peak, Begin::Driven),
                false => (begun, Begin::Pushed),
            }
        });
        let (at, begin) = driven.into_iter().chain(pushed).max_by_key(|(at, _)| *at)?;
        Some((self.points[(at * every).min(self.points.len() - 1)].time_s, begin))
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

    /// The number of the amplitude until which it was kept up: the last kink, where it is sharpest.
    fn kept_up_until(&self, amplitude: &[f64], largest: f64, every: usize) -> Option<usize> {
        let least = self.least();
        let kink = |k: usize| {
            (amplitude[k] > FALLS_TO * largest).then(|| self.kink(amplitude, least, every, k))?
        };
        let last = (0..amplitude.len()).rev().find_map(kink)?;
        let near = (last.at.saturating_sub(last.before)..=last.at).filter_map(kink);
        near.min_by(|a, b| a.leaves.total_cmp(&b.leaves)).map(|kink| kink.at)
    }

    /// The kink at amplitude number `k`, if it stands or rises before it and falls after it.
    fn kink(&self, amplitude: &[f64], least: f64, every: usize, k: usize) -> Option<Kink> {
        let level = amplitude[k];
        let reaches = |share: f64| (k..amplitude.len()).find(|&j| amplitude[j] < share * level);
        let last = amplitude.len() - 1;
        let fewest = (DRIVEN_CYCLES * POINTS_PER_CYCLE).div_ceil(every).max(MIN_POINTS);
        let fallen = reaches(FALL).unwrap_or(last).max(k + fewest).min(last);
        if rises(&amplitude[k..reaches(FALLS_TO).unwrap_or(amplitude.len())], level) {
            return None;
        }
        let kept_up = amplitude[..k].iter().rev().take_while(|a| **a > FALL * level).count();
        let before = (fallen - k).max(fewest).min(kept_up);
        let long = before >= fewest && before as f64 >= DRIVEN_SHARE * (fallen - k) as f64;
        // What a hand stops does not decay after it.
        let decays = amplitude[k..].iter().take_while(|a| **a > least).count() > fewest;
        if !long || !decays {
            return None;
        }
        let apart = (fallen + before - k).div_ceil(POINTS);
        let points = || {
            let log = |j: usize| ((j as f64 - k as f64) / (fallen - k) as f64, amplitude[j].ln());
            (k - before..=fallen).step_by(apart).map(log)
        };
        // A line up to it, and a fall that may be bent.
        let kinked = |t: f64| [1.0, t, t.max(0.0), t.max(0.0).powi(2)];
        let smooth = |t: f64| [1.0, t, t * t, t.powi(3)];
        let x = linear_fit(points().map(|(t, y)| (kinked(t), y)))?;
        let curve = linear_fit(points().map(|(t, y)| (smooth(t), y)))?;
        let left = squares(&x, kinked, points());
        let leaves = left / squares(&curve, smooth, points());
        // Losses in the time of the fall: before it, at its beginning, and of all of it.
        let (early, late) = (-x[1], -x[1] - x[2]);
        let fall = late - x[3];
        let expected = level * fall * before as f64 / (fallen - k) as f64;
        let is_kink = leaves < SHARPER
            && early < MIN_CHANGE * late
            && (left / points().count() as f64).sqrt() < LEFT * fall
            && expected > LOSS_OVER_NOISE * self.amplitude_noise();
        is_kink.then_some(Kink { at: k, before, leaves })
    }
}

/// What `x` leaves of the points.
fn squares<const N: usize>(
    x: &[f64; N],
    row: impl Fn(f64) -> [f64; N],
    points: impl Iterator<Item = (f64, f64)>,
) -> f64 {
    let off = |(t, y): (f64, f64)| y - row(t).iter().zip(x).map(|(r, x)| r * x).sum::<f64>();
    points.map(|point| off(point).powi(2)).sum()
}

/// The numbers of the amplitudes at which the last push begins to raise them and has raised them most, if the
/// model swung before it and what follows it falls for good, and for longer than what it swung before.
fn pushed(amplitude: &[f64], swings: &[bool], largest: f64, cycle: usize) -> Option<[usize; 2]> {
    let mut peak = amplitude.len() - 1;
    let mut pushed = None;
    for k in (0..amplitude.len()).rev() {
        if amplitude[k] > amplitude[peak] {
            peak = k;
        }
        if amplitude[peak] > FALLS_TO * largest && amplitude[peak] > PUSHED_RATIO * amplitude[k] {
            pushed = Some(k);
            break;
        }
    }
    // Down to where it began to rise.
    let risen = pushed?;
    let low = (0..=risen).rev().take_while(|k| amplitude[*k] <= amplitude[risen]);
    let low = low.min_by(|a, b| amplitude[*a].total_cmp(&amplitude[*b]))?;
    let begun = (low..=peak).find(|k| amplitude[*k] > RISES * amplitude[low]).unwrap_or(low);
    let level = amplitude[peak];
    let swung = swings[..begun].iter().filter(|s| **s).count();
    let after = amplitude.len() - peak;
    let free = amplitude[peak..].iter().take_while(|a| **a > DIED_OUT * level).count();
    // Where samples are lost it falls for a moment, too, and as fast.
    let fallen = amplitude[begun.saturating_sub(2 * cycle)] / amplitude[low];
    let is_dip = peak - begun <= 2 * cycle && fallen.powi(2) >= level / amplitude[low];
    let is_push = swung > DRIVEN_CYCLES * cycle
        && !is_dip
        && after > FALLS_LONGER * (peak - begun)
        && !rises(&amplitude[peak..], level)
        && free > swung.min(longest_fall(&amplitude[..=low]));
    is_push.then_some([begun, peak])
}

/// Most amplitudes in a row without a rise.
fn longest_fall(amplitude: &[f64]) -> usize {
    let (mut longest, mut begun, mut least) = (0, 0, f64::INFINITY);
    for (k, a) in amplitude.iter().enumerate() {
        least = least.min(*a);
        if *a > RISES * least {
            (begun, least) = (k, *a);
        }
        longest = longest.max(k - begun);
    }
    longest
}
