//! The last samples of the potentiometer, with block sums, in a fixed buffer.
//!
//! Sums over long stretches are put together from block sums of eight samples, so a bin of two
//! hundred samples costs about thirty additions, and rounding does not grow with the stretch.

/// Samples kept: three cycles of the slowest oscillation (2.5 rad/s: 7540 samples) and the
/// stretch after it until the window is closed.
pub const LENGTH: usize = 8192;
/// Samples in a block; the release logic looks at block means (8 ms at 1 kHz).
pub const BLOCK: usize = 8;
const BLOCKS: usize = LENGTH / BLOCK;

/// A moment in device time: a sample's index and a fraction of the sample period, in samples.
///
/// Kept in two parts since an `f32` alone cannot hold both the index of a long run and a
/// hundredth of a sample.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Moment {
    pub sample: u32,
    pub fraction: f32,
}

impl Moment {
    /// This moment minus `origin`'s sample, in samples. The clock may have wrapped between them.
    pub fn since(self, origin: u32) -> f32 {
        self.sample.wrapping_sub(origin) as i32 as f32 + self.fraction
    }

    /// `offset` samples after sample `origin` (before it where negative).
    pub fn after(origin: u32, offset: f32) -> Self {
        let whole = libm::floorf(offset);
        Self { sample: origin.wrapping_add(whole as i32 as u32), fraction: offset - whole }
    }

    /// The first sample at or after this moment.
    pub fn next_sample(self) -> u32 {
        self.sample.wrapping_add((self.fraction > 0.0) as u32)
    }
}

/// Ring of the last `N` samples in `B` blocks of [`BLOCK`]; [`LENGTH`] if not said otherwise. `S` is `i16` on
/// the device and `f32` where the host wants no quantisation; `scale` turns either into degrees.
#[derive(Clone, Debug)]
pub struct History<S, const N: usize = LENGTH, const B: usize = BLOCKS> {
    samples: [S; N],
    block_sums: [f32; B],
    running: f32,
    next: u32,
    filled: u32,
    scale: f32,
}

impl<S: Copy + Default + Into<f32>, const N: usize, const B: usize> History<S, N, B> {
    /// An empty history; `scale` in degrees per unit of `S`.
    // Or else it would be made on the stack and then copied.
    #[inline(always)]
    pub const fn new(zero: S, scale: f32) -> Self {
        Self { samples: [zero; N], block_sums: [0.0; B], running: 0.0, next: 0, filled: 0, scale }
    }

    /// Sets the degrees per unit for all samples, those already there too.
    pub fn set_scale(&mut self, scale: f32) {
        self.scale = scale;
    }

    /// Index the next sample will have.
    pub fn next_index(&self) -> u32 {
        self.next
    }

    /// Index of the oldest sample that is still there.
    pub fn oldest(&self) -> u32 {
        self.next.wrapping_sub(self.filled)
    }

    /// Passes over whole blocks that never came, and forgets what was before them.
    pub fn skip(&mut self, blocks: u32) {
        self.next = self.next.wrapping_add(blocks.wrapping_mul(BLOCK as u32));
        self.filled = 0;
    }

    /// Appends a sample; the mean of its block in degrees where it completes one.
    #[inline]
    pub fn push(&mut self, sample: S) -> Option<f32> {
        let at = self.next as usize % N;
        self.samples[at] = sample;
        self.running += sample.into();
        self.next = self.next.wrapping_add(1);
        self.filled = (self.filled + 1).min(N as u32);
        if at % BLOCK != BLOCK - 1 {
            return None;
        }
        let sum = self.running;
        self.block_sums[at / BLOCK] = sum;
        self.running = 0.0;
        Some(sum * (self.scale / BLOCK as f32))
    }

    /// The sample with this index in degrees. The caller asks only for what is still there.
    #[inline]
    pub fn degrees(&self, index: u32) -> f32 {
        self.raw(index) * self.scale
    }

    #[inline]
    fn raw(&self, index: u32) -> f32 {
        self.samples[index as usize % N].into()
    }

    /// Mean of one completed block in degrees, by the index of any sample in it.
    #[inline]
    pub fn block_mean(&self, index: u32) -> f32 {
        self.block_sums[index as usize % N / BLOCK] * (self.scale / BLOCK as f32)
    }

    /// What features are made of, whatever the ring's length.
    pub fn view(&self) -> View<'_, S> {
        View { samples: &self.samples, block_sums: &self.block_sums, scale: self.scale }
    }
}

/// A ring's samples and block sums. One code for rings of all lengths, which are powers of two.
#[derive(Clone, Copy, Debug)]
pub struct View<'a, S> {
    samples: &'a [S],
    block_sums: &'a [f32],
    scale: f32,
}

impl<S: Copy + Default + Into<f32>> View<'_, S> {
    #[inline]
    fn raw(&self, index: u32) -> f32 {
        let at = index as usize & (self.samples.len() - 1);
        self.samples.get(at).copied().unwrap_or_default().into()
    }

    #[inline]
    fn block_sum(&self, index: u32) -> f32 {
        let at = (index as usize / BLOCK) & (self.block_sums.len() - 1);
        self.block_sums.get(at).copied().unwrap_or_default()
    }

    /// Value in degrees at a moment, interpolated linearly between samples.
    pub fn at(&self, moment: Moment) -> f32 {
        let low = self.raw(moment.sample);
        let high = self.raw(moment.sample.wrapping_add((moment.fraction > 0.0) as u32));
        (low + (high - low) * moment.fraction) * self.scale
    }

    /// Mean in degrees between two moments: the integral of the straight lines between samples
    /// over the stretch's length, its ends at fractions of a sample included.
    pub fn mean(&self, from: Moment, to: Moment) -> f32 {
        let first = from.next_sample();
        let last = to.sample;
        let length = to.since(from.sample) - from.fraction;
        let whole = last.wrapping_sub(first) as i32;
        if whole < 1 || length <= 0.0 {
            let middle = Moment::after(from.sample, from.fraction + 0.5 * length);
            return self.at(middle);
        }
        let (y_first, y_last) = (self.raw(first), self.raw(last));
        let mut area = self.sum(first, last) - 0.5 * (y_first + y_last);
        let lead = Moment { sample: first, fraction: 0.0 }.since(from.sample) - from.fraction;
        if lead > 0.0 {
            let slope = y_first - self.raw(from.sample);
            area += lead * (y_first - 0.5 * lead * slope);
        }
        if to.fraction > 0.0 {
            let slope = self.raw(last.wrapping_add(1)) - y_last;
            area += to.fraction * (y_last + 0.5 * to.fraction * slope);
        }
        area / length * self.scale
    }

    /// Sum of the samples `first..=last` in units of `S`.
    fn sum(&self, first: u32, last: u32) -> f32 {
        let end = last.wrapping_add(1);
        let mut at = first;
        let mut total = 0.0;
        while at != end && !(at as usize).is_multiple_of(BLOCK) {
            total += self.raw(at);
            at = at.wrapping_add(1);
        }
        // A block whose last sample is not there yet has no sum.
        while end.wrapping_sub(at) >= BLOCK as u32 {
            total += self.block_sum(at);
            at = at.wrapping_add(BLOCK as u32);
        }
        while at != end {
            total += self.raw(at);
            at = at.wrapping_add(1);
        }
        total
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mean_of_a_ramp_is_its_middle_wherever_the_ends_fall() {
        let mut history = History::<f32>::new(0.0, 0.5);
        for i in 0..100 {
            history.push(i as f32);
        }
        for (from, to) in
            [(3.0_f32, 90.0_f32), (3.25, 90.75), (7.9, 8.05), (7.5, 9.0), (16.0, 24.0)]
        {
            let (a, b) = (Moment::after(0, from), Moment::after(0, to));
            let expected = 0.5 * 0.5 * (from + to);
            assert!((history.view().mean(a, b) - expected).abs() < 1e-5, "{from}..{to}");
        }
    }

    #[test]
    fn survives_its_own_wrap_around_and_the_clock_s() {
        let mut history = History::<i16>::new(0, 1.0);
        history.next = u32::MAX - 1003;
        for i in 0..(LENGTH as i32 + 3000) {
            history.push((i % 100) as i16);
        }
        let end = history.next_index();
        let from = Moment { sample: end.wrapping_sub(4000), fraction: 0.0 };
        let to = Moment { sample: end.wrapping_sub(1), fraction: 0.0 };
        assert!((history.view().mean(from, to) - 49.5).abs() < 0.05);
        assert_eq!(history.oldest(), end.wrapping_sub(LENGTH as u32));
    }
}
