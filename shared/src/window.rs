//! Three-cycle windows of a decaying oscillation, found while it is recorded.
//!
//! Extremes of the block means give the mid-line and bracket each zero crossing; a straight line
//! through the samples about a crossing times it to a fraction of a sample. A regression over
//! the window's crossings (start, half period, and an alternating term that takes up what is left
//! of the mid-line's error) then says where the third cycle *will* end, so that the window is
//! closed by the first sample at or after its end and not when later samples have confirmed it.

use crate::crossing::{line_through, regress, Crossing, Fit, HALF_CYCLES};
pub use crate::crossing::{Extreme, CYCLES};
use crate::history::{History, Moment, BLOCK};
use heapless::Deque;

/// Rate of the device's samples.
pub const SAMPLE_RATE_HZ: f32 = 1000.0;

/// No free oscillation's swing is so much larger than the one before: damping ratios down to -0.058.
const GROWN: f32 = 1.2;

/// What the tracker looks for. All in degrees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// The first peak inside a window is at most this high above the mid-line.
    pub from_deg: f32,
    /// The oscillation has ended once a peak is lower than this.
    pub to_deg: f32,
    /// Smallest movement that counts as an extreme, well above the noise of a block mean.
    pub least_swing_deg: f32,
}

impl Default for Limits {
    fn default() -> Self {
        Self { from_deg: 10.0, to_deg: 1.0, least_swing_deg: 0.4 }
    }
}

/// Three consecutive cycles, from a zero crossing to the sixth after it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Window {
    pub start: Moment,
    /// Length of the three cycles in samples.
    pub length: f32,
    /// Height of the mid-line, degrees.
    pub midline_deg: f32,
    /// Whether the first half cycle lies above the mid-line.
    pub rising: bool,
    /// First sample at or after the end of the third cycle.
    pub end: u32,
}

impl Window {
    /// The moment a share (0 to 1) of the way through.
    pub fn moment(&self, share: f32) -> Moment {
        Moment::after(self.start.sample, self.start.fraction + share * self.length)
    }
}

/// From one turning point to the next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Swing {
    pub from: Extreme,
    pub to: Extreme,
}

impl Swing {
    pub fn size_deg(&self) -> f32 {
        (self.to.yaw_deg - self.from.yaw_deg).abs()
    }
}

/// What one sample brought to light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Finding {
    /// A turning point; `amplitude_deg` above the mid-line once there have been three.
    Extreme { extreme: Extreme, amplitude_deg: Option<f32> },
    /// Three cycles are complete.
    Window(Window),
    /// A swing larger than a free one, after a turn by hand or a push: what was before this turning point is
    /// another motion, and is forgotten.
    Anew { from: Extreme },
}

/// Follows an oscillation sample by sample.
// In this order, or else the device's samples would be made on the stack and then copied.
#[derive(Clone, Debug)]
#[repr(C)]
pub struct Tracker<S> {
    history: History<S>,
    limits: Limits,
    /// Nothing has turned yet, and the model was not let go from rest.
    mid_swing: bool,
    /// Highest and lowest block mean since the last extreme.
    high: Option<Extreme>,
    low: Option<Extreme>,
    /// When it last was near the highest or the lowest one, and near the last extreme: a model that is held
    /// there has not been let go before that.
    near_high: u32,
    near_low: u32,
    left: u32,
    /// Last three extremes, newest last.
    extremes: Deque<Extreme, 3>,
    /// 1: rising towards a maximum, -1: falling, 0: not known yet.
    heading: i8,
    midline: Midline,
    crossings: Deque<Crossing, HALF_CYCLES>,
    crossings_seen: u32,
    /// Number of the crossing the next window starts at, once one has started.
    starts_at: Option<u32>,
    end: Option<Moment>,
}

#[derive(Clone, Copy, Debug, Default)]
struct Midline {
    degrees: f32,
    count: u32,
}

impl Midline {
    /// Averages over the last eight estimates, so that a slow drift is followed.
    fn add(&mut self, degrees: f32) {
        self.count = (self.count + 1).min(8);
        self.degrees += (degrees - self.degrees) / self.count as f32;
    }
}

impl<S: Copy + Default + Into<f32>> Tracker<S> {
    /// A tracker without samples; `scale` in degrees per unit of `S`, `zero` the zero of `S`.
    // Or else it would be made on the stack and then copied.
    #[inline(always)]
    pub const fn new(zero: S, scale: f32, limits: Limits) -> Self {
        Self {
            history: History::new(zero, scale),
            limits,
            mid_swing: true,
            high: None,
            low: None,
            near_high: 0,
            near_low: 0,
            left: 0,
            extremes: Deque::new(),
            heading: 0,
            midline: Midline { degrees: 0.0, count: 0 },
            crossings: Deque::new(),
            crossings_seen: 0,
            starts_at: None,
            end: None,
        }
    }

    pub fn history(&self) -> &History<S> {
        &self.history
    }

    pub fn limits(&self) -> &Limits {
        &self.limits
    }

    /// New limits and scale, for the next release.
    pub fn configure(&mut self, scale: f32, limits: Limits) {
        self.history.set_scale(scale);
        self.limits = limits;
    }

    /// Mid-line in degrees, once three extremes have been seen.
    pub fn midline_deg(&self) -> Option<f32> {
        (self.midline.count > 0).then_some(self.midline.degrees)
    }

    /// Samples between turning points, once three have been seen.
    pub fn half_period(&self) -> Option<u32> {
        let (first, last) = (self.extremes.front()?, self.extremes.back()?);
        self.extremes.is_full().then(|| last.at.wrapping_sub(first.at) / 2)
    }

    /// The newest swing, from one turning point to the next, once there have been two.
    pub fn swing(&self) -> Option<Swing> {
        let mut e = self.extremes.iter().rev();
        let (to, from) = (e.next()?, e.next()?);
        Some(Swing { from: *from, to: *to })
    }

    /// What has come of the swing since the newest turning point.
    pub fn unfinished_swing(&self) -> Option<Swing> {
        let to = if self.heading > 0 { self.high } else { self.low };
        Some(Swing { from: *self.extremes.back()?, to: to? })
    }

    /// Passes over whole blocks of samples that never came; to be restarted then.
    pub fn skip(&mut self, blocks: u32) {
        self.history.skip(blocks);
    }

    /// Forgets the oscillation, not the samples. `held` is where the model was let go, if it was:
    /// that is the new oscillation's first extreme.
    pub fn restart(&mut self, held: Option<Extreme>) {
        self.mid_swing = held.is_none();
        (self.high, self.low) = (held, held);
        let at = held.map_or(self.history.next_index(), |held| held.at);
        (self.near_high, self.near_low) = (at, at);
        self.extremes.clear();
        self.heading = 0;
        self.midline = Midline::default();
        self.crossings.clear();
        self.crossings_seen = 0;
        self.starts_at = None;
        self.end = None;
    }

    /// Takes the next sample. Returns the mean of the block it completed, if it did, and what it
    /// brought to light.
    #[inline]
    pub fn push(&mut self, sample: S) -> (Option<f32>, Option<Finding>) {
        let index = self.history.next_index();
        let block = self.history.push(sample);
        if let Some(window) = self.close(index) {
            // An extreme that this same sample would confirm is confirmed by the next block.
            return (block, Some(Finding::Window(window)));
        }
        let Some(mean) = block else { return (None, None) };
        let finding = self.turn(index.wrapping_sub(BLOCK as u32 / 2), mean);
        (Some(mean), finding)
    }

    /// Extremes with hysteresis: a maximum is one when the block means have fallen half of
    /// its own height below it: late enough for noise at 1 deg, early enough for the next crossing.
    fn turn(&mut self, at: u32, mean: f32) -> Option<Finding> {
        let now = Extreme { at, yaw_deg: mean };
        let high = *self.high.get_or_insert(now);
        let low = *self.low.get_or_insert(now);
        if mean > high.yaw_deg {
            self.high = Some(now);
        }
        if mean < low.yaw_deg {
            self.low = Some(now);
        }
        let near = self.limits.least_swing_deg;
        if mean > high.yaw_deg - near {
            self.near_high = at;
        }
        if mean < low.yaw_deg + near {
            self.near_low = at;
        }
        let swing = match (self.extremes.back(), self.heading) {
            (Some(last), 1) => high.yaw_deg - last.yaw_deg,
            (Some(last), -1) => last.yaw_deg - low.yaw_deg,
            _ => 0.0,
        };
        let enough = (0.25 * swing).max(self.limits.least_swing_deg);
        let (extreme, heading, left) = if self.heading >= 0 && high.yaw_deg - mean > enough {
            (high, -1, self.near_high)
        } else if self.heading <= 0 && mean - low.yaw_deg > enough {
            (low, 1, self.near_low)
        } else {
            return None;
        };
        self.heading = heading;
        (self.high, self.low) = (Some(now), Some(now));
        (self.near_high, self.near_low) = (at, at);
        let left_before = core::mem::replace(&mut self.left, left);
        if core::mem::take(&mut self.mid_swing) {
            // Where the record began, or too near it to be sure that it turned there.
            return None;
        }
        if self.extremes.is_full() {
            self.extremes.pop_front();
        }
        // Room was made above.
        let _ = self.extremes.push_back(extreme);
        if let Some(mut from) = self.grown() {
            from.at = left_before;
            self.restart(Some(from));
            (self.high, self.low, self.heading) = (Some(now), Some(now), heading);
            (self.near_high, self.near_low, self.mid_swing) = (at, at, false);
            // There is room for three.
            let _ = self.extremes.push_back(from);
            let _ = self.extremes.push_back(extreme);
            return Some(Finding::Anew { from });
        }
        let amplitude_deg = self.place_midline();
        self.cross();
        Some(Finding::Extreme { extreme, amplitude_deg })
    }

    /// The turning point at which a swing began that is no free one's successor.
    fn grown(&self) -> Option<Extreme> {
        let mut e = self.extremes.iter();
        let (e0, e1, e2) = (e.next()?, e.next()?, e.next()?);
        let (before, after) = ((e1.yaw_deg - e0.yaw_deg).abs(), (e2.yaw_deg - e1.yaw_deg).abs());
        let grown = after > GROWN * before && after - before > self.limits.least_swing_deg;
        grown.then_some(*e1)
    }

    /// Mid-line from three extremes: e0 - c, e1 - c, e2 - c are a geometric series whatever the
    /// damping (Aitken). Returns the newest extreme's height above it.
    fn place_midline(&mut self) -> Option<f32> {
        let mut e = self.extremes.iter().map(|e| e.yaw_deg);
        let (e0, e1, e2) = (e.next()?, e.next()?, e.next()?);
        let curvature = e0 - 2.0 * e1 + e2;
        self.midline.add(e0 - (e1 - e0) * (e1 - e0) / curvature);
        Some((e2 - self.midline.degrees).abs())
    }

    /// Times the crossings between the last extremes: the newest one, or the two newest ones
    /// when the mid-line has only just become known.
    fn cross(&mut self) {
        let mut e = self.extremes.iter().copied();
        let (Some(e0), Some(e1), Some(e2)) = (e.next(), e.next(), e.next()) else { return };
        let half_period = e2.at.wrapping_sub(e1.at);
        if self.crossings_seen == 0 {
            // The first extreme may be anywhere in a hold.
            let first = e1.at.wrapping_sub(e0.at);
            let held = first > half_period + half_period / 4;
            self.time_crossing(e0, e1, if held { half_period } else { first });
        }
        self.time_crossing(e1, e2, half_period);
    }

    fn time_crossing(&mut self, before: Extreme, after: Extreme, half_period: u32) {
        self.crossings_seen += 1;
        let number = self.crossings_seen;
        let amplitude = (after.yaw_deg - self.midline.degrees).abs();
        let wanted = match self.starts_at {
            Some(first) => number >= first,
            None => amplitude <= self.limits.from_deg,
        };
        if !wanted {
            return;
        }
        let found = line_through(&self.history, self.midline.degrees, before, after, half_period);
        let Some((at, slope)) = found else { return };
        self.starts_at.get_or_insert(number);
        let crossing = Crossing { at, weight: slope * slope, rising: slope > 0.0, number };
        if self.crossings.push_back(crossing).is_err() {
            // Six crossings through which no line goes: begin anew with this one.
            self.crossings.clear();
            self.starts_at = Some(number);
            let _ = self.crossings.push_back(crossing);
        }
        self.end = self.fit().map(|fit| fit.end);
    }

    fn fit(&self) -> Option<Fit> {
        regress(&self.crossings)
    }

    /// Closes the window when sample `index` is the first at or after its end.
    #[inline]
    fn close(&mut self, index: u32) -> Option<Window> {
        let end = self.end?.next_sample();
        if (index.wrapping_sub(end) as i32) < 0 {
            return None;
        }
        let fit = self.fit();
        self.end = None;
        self.crossings.clear();
        let fit = fit?;
        self.starts_at = Some(fit.next);
        let too_old = fit.start.sample.wrapping_sub(self.history.oldest()) as i32 <= 0;
        if too_old || fit.length <= 0.0 {
            return None;
        }
        let mut window = Window {
            start: fit.start,
            length: fit.length,
            midline_deg: 0.0,
            rising: fit.rising,
            end: index,
        };
        window.midline_deg = self.window_midline(&window);
        Some(window)
    }

    /// Mid-line from the means of the six half cycles: about it they alternate and shrink by
    /// one factor q each, so every neighbouring pair gives it.
    fn window_midline(&self, window: &Window) -> f32 {
        let mut means = [0.0_f32; HALF_CYCLES];
        let mut from = window.start;
        for (i, mean) in means.iter_mut().enumerate() {
            let to = window.moment((i + 1) as f32 / HALF_CYCLES as f32);
            *mean = self.history.view().mean(from, to);
            from = to;
        }
        let (mut product, mut square) = (0.0_f32, 0.0_f32);
        for i in 0..HALF_CYCLES - 2 {
            let step = means[i + 1] - means[i];
            product -= (means[i + 2] - means[i + 1]) * step;
            square += step * step;
        }
        let q = if square > 0.0 { (product / square).clamp(0.0, 2.0) } else { 1.0 };
        // Weights 1 2 2 2 1: an error of q then cancels between neighbours.
        let pair = |i: usize| (means[i + 1] + q * means[i]) / (1.0 + q);
        (pair(0) + 2.0 * (pair(1) + pair(2) + pair(3)) + pair(4)) / 8.0
    }
}
