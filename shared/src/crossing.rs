//! Passages through the mid-line: each timed by a straight line, a window by a regression over all
//! of its own.

use crate::history::{History, Moment, BLOCK};
use heapless::Deque;
use nalgebra::{Cholesky, SMatrix, SVector};

/// Cycles in a window (thesis 4.5.2).
pub const CYCLES: usize = 3;
pub(crate) const HALF_CYCLES: usize = 2 * CYCLES;

/// Fewest crossings that may fix a window: two cycles and the alternating term's degree of freedom.
const MIN_CROSSINGS: usize = 5;
/// Half-width of the straight line through a crossing, as a share of the half period between
/// the extremes about it. At a sixth the sine still deviates by 4 % of its own height only, and
/// does so symmetrically.
const LINE_SHARE: f32 = 1.0 / 6.0;
const LINE_SAMPLES: core::ops::RangeInclusive<i32> = 3..=200;

/// A turning point of the block means.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extreme {
    pub at: u32,
    pub yaw_deg: f32,
}

/// A passage through the mid-line.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Crossing {
    pub at: Moment,
    /// Square of the line's slope: the weight of its time.
    pub weight: f32,
    pub rising: bool,
    /// Counted from the first of the release.
    pub number: u32,
}

/// The moment of the crossing between two extremes, half a period apart without a hold, and the slope in
/// degrees per sample.
pub(crate) fn line_through<S: Copy + Default + Into<f32>>(
    history: &History<S>,
    midline_deg: f32,
    before: Extreme,
    after: Extreme,
    half_period: u32,
) -> Option<(Moment, f32)> {
    let sign = if after.yaw_deg > before.yaw_deg { 1.0 } else { -1.0 };
    // Block means are monotone between extremes but for noise: bisect.
    let (mut low, mut high) = (before.at, after.at);
    while high.wrapping_sub(low) > BLOCK as u32 {
        let middle = low.wrapping_add(high.wrapping_sub(low) / 2);
        if (history.block_mean(middle) - midline_deg) * sign < 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    let reach = ((half_period as f32 * LINE_SHARE) as i32)
        .clamp(*LINE_SAMPLES.start(), *LINE_SAMPLES.end());
    let newest = history.next_index().wrapping_sub(1);
    let mut centre = low.wrapping_add(high.wrapping_sub(low) / 2);
    let mut found = None;
    for _ in 0..3 {
        let first = centre.wrapping_sub(reach as u32);
        let kept = first.wrapping_sub(history.oldest()) as i32 >= 0
            && newest.wrapping_sub(centre) as i32 >= reach;
        if !kept {
            return found;
        }
        let (mut sum, mut moment) = (0.0_f32, 0.0_f32);
        for k in -reach..=reach {
            let y = history.degrees(centre.wrapping_add(k as u32)) - midline_deg;
            sum += y;
            moment += k as f32 * y;
        }
        let n = (2 * reach + 1) as f32;
        let slope = moment * 3.0 / (n * reach as f32 * (reach + 1) as f32);
        if slope * sign <= 0.0 {
            return found;
        }
        // Not `clamp`, whose panic would bring all of core's printing of floats into the image.
        let most = half_period as f32;
        let offset = (-(sum / n) / slope).max(-most).min(most);
        let at = Moment::after(centre, offset);
        found = Some((at, slope));
        let nearest = at.sample.wrapping_add((at.fraction >= 0.5) as u32);
        if nearest == centre {
            break;
        }
        centre = nearest;
    }
    found
}

/// Weighted regression over a window's crossings: where its half cycles lie.
pub(crate) fn regress(crossings: &Deque<Crossing, HALF_CYCLES>) -> Option<Fit> {
    if crossings.len() < MIN_CROSSINGS {
        return None;
    }
    let first = crossings.front()?;
    let origin = first.at.sample;
    // Normal equations for t = start + k half + (-1)^k alternation.
    let mut a = SMatrix::<f32, 3, 3>::zeros();
    let mut b = SVector::<f32, 3>::zeros();
    for crossing in crossings.iter() {
        let k = crossing.number.wrapping_sub(first.number);
        let row = SVector::from([1.0, k as f32, if k.is_multiple_of(2) { 1.0 } else { -1.0 }]);
        let weighted = row * (crossing.weight / first.weight);
        a += weighted * row.transpose();
        b += weighted * crossing.at.since(origin);
    }
    let [[start, half, _]] = Cholesky::new(a)?.solve(&b).data.0;
    let length = HALF_CYCLES as f32 * half;
    Some(Fit {
        start: Moment::after(origin, start),
        length,
        end: Moment::after(origin, start + length),
        rising: first.rising,
        next: first.number.wrapping_add(HALF_CYCLES as u32),
    })
}

/// A window as its crossings give it.
pub(crate) struct Fit {
    pub start: Moment,
    /// Of its three cycles, samples.
    pub length: f32,
    pub end: Moment,
    pub rising: bool,
    /// Number of the crossing at its end.
    pub next: u32,
}
