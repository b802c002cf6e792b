//! A record as the methods see it: time stamps, angles, which samples are left out, whether the grid is even.

use crate::record::Record;
use crate::statistics::median;

/// Largest deviation of a time stamp from an even grid, in steps, that is taken for rounding.
const GRID_TOLERANCE: f64 = 2e-3;

/// A whole record with what is known of its samples.
#[derive(Clone, Debug)]
pub struct Samples<'a> {
    time_s: &'a [f64],
    yaw_deg: &'a [f64],
    excluded: Vec<bool>,
    /// Median time step.
    step_s: f64,
    uniform: bool,
}

impl<'a> Samples<'a> {
    /// `time_s` rising, as long as `yaw_deg`. Of fewer than two samples the step is not a number.
    pub fn new(time_s: &'a [f64], yaw_deg: &'a [f64]) -> Self {
        assert_eq!(time_s.len(), yaw_deg.len());
        let span_s = match time_s {
            [first, .., last] => last - first,
            _ => f64::NAN,
        };
        let mean_step = span_s / (time_s.len() as f64 - 1.0);
        let uniform = time_s.iter().enumerate().all(|(k, t)| {
            (t - time_s[0] - k as f64 * mean_step).abs() <= GRID_TOLERANCE * mean_step
        });
        let step_s = if uniform {
            mean_step
        } else {
            let mut steps: Vec<f64> = time_s.windows(2).map(|w| w[1] - w[0]).collect();
            median(&mut steps)
        };
        Self { time_s, yaw_deg, excluded: vec![false; yaw_deg.len()], step_s, uniform }
    }
    /// Samples a second, from the median time step.
    pub(crate) fn rate_hz(&self) -> f64 {
        1.0 / self.step_s
    }
    pub(crate) fn is_uniform(&self) -> bool {
        self.uniform
    }
    pub(crate) fn len(&self) -> usize {
        self.yaw_deg.len()
    }
    pub(crate) fn excluded(&self) -> usize {
        self.excluded.iter().filter(|&&e| e).count()
    }
    pub(crate) fn exclude(&mut self, index: usize) {
        self.excluded[index] = true;
    }
    /// The samples from `from_s` on by themselves.
    pub(crate) fn after(&self, from_s: f64) -> Self {
        let first = self.time_s.partition_point(|t| *t < from_s).min(self.len() - 2);
        Self {
            time_s: &self.time_s[first..],
            yaw_deg: &self.yaw_deg[first..],
            excluded: self.excluded[first..].to_vec(),
            ..*self
        }
    }
    /// The whole record as one stretch.
    pub fn all(&self) -> Stretch<'_> {
        self.stretch(0, self.len())
    }
    /// Samples `from..to` by index.
    pub(crate) fn stretch(&self, from: usize, to: usize) -> Stretch<'_> {
        Stretch {
            time_s: &self.time_s[from..to],
            yaw_deg: &self.yaw_deg[from..to],
            excluded: &self.excluded[from..to],
            step_s: self.step_s,
            uniform: self.uniform,
            first: from,
        }
    }
    /// Samples with `from_s <= t < to_s`.
    pub(crate) fn between(&self, from_s: f64, to_s: f64) -> Stretch<'_> {
        self.all().between(from_s, to_s)
    }
}

/// Consecutive samples of a record.
#[derive(Clone, Copy, Debug)]
pub struct Stretch<'a> {
    pub(crate) time_s: &'a [f64],
    pub(crate) yaw_deg: &'a [f64],
    pub(crate) excluded: &'a [bool],
    /// Median time step of the record.
    pub(crate) step_s: f64,
    /// Whether all time stamps lie on an even grid.
    pub(crate) uniform: bool,
    /// Index in the record of the first sample.
    pub(crate) first: usize,
}

impl<'a> Stretch<'a> {
    pub(crate) fn len(&self) -> usize {
        self.yaw_deg.len()
    }
    pub(crate) fn is_empty(&self) -> bool {
        self.yaw_deg.is_empty()
    }
    /// Of a stretch that has samples.
    pub(crate) fn start_s(&self) -> f64 {
        self.time_s[0]
    }
    /// From the first sample to one step after the last; of no samples no time.
    pub(crate) fn duration_s(&self) -> f64 {
        match self.time_s {
            [first, .., last] => last - first + self.step_s,
            [_] => self.step_s,
            [] => 0.0,
        }
    }
    pub(crate) fn between(&self, from_s: f64, to_s: f64) -> Stretch<'a> {
        let a = self.time_s.partition_point(|&t| t < from_s);
        let b = self.time_s.partition_point(|&t| t < to_s).max(a);
        Stretch {
            time_s: &self.time_s[a..b],
            yaw_deg: &self.yaw_deg[a..b],
            excluded: &self.excluded[a..b],
            first: self.first + a,
            ..*self
        }
    }
    /// `(t, y)` of the samples that count.
    pub(crate) fn kept(&self) -> impl Iterator<Item = (f64, f64)> + 'a {
        let this = *self;
        (0..this.len())
            .filter(move |&k| !this.excluded[k])
            .map(move |k| (this.time_s[k], this.yaw_deg[k]))
    }
    /// What counts of `record`, whose samples these are.
    pub(crate) fn record(&self, record: &Record) -> Record {
        let (time_s, yaw_deg) = self.kept().unzip();
        record.with(time_s, yaw_deg)
    }
    /// Means over consecutive bins of `samples` nominal steps; a bin without a sample is left out.
    pub(crate) fn block_means(&self, samples: usize) -> Means {
        let mut means = Means { time_s: Vec::new(), yaw_deg: Vec::new(), uniform: self.uniform };
        if self.is_empty() {
            return means;
        }
        let samples = samples.max(1);
        means.time_s.reserve(self.len() / samples + 1);
        means.yaw_deg.reserve(self.len() / samples + 1);
        let mut push = |range: std::ops::Range<usize>, full: bool| {
            let (mut n, mut t, mut y) = (0.0, 0.0, 0.0);
            for k in range.filter(|&k| !self.excluded[k]) {
                n += 1.0;
                t += self.time_s[k];
                y += self.yaw_deg[k];
            }
            if n > 0.0 {
                means.time_s.push(t / n);
                means.yaw_deg.push(y / n);
            }
            means.uniform &= full && n as usize == samples;
        };
        if self.uniform {
            // A last bin that is not full is dropped: its mean would lie off the grid.
            for k in 0..self.len() / samples {
                push(k * samples..(k + 1) * samples, true);
            }
        } else {
            let width = samples as f64 * self.step_s;
            let mut from = 0;
            while from < self.len() {
                let bin = ((self.time_s[from] - self.time_s[0]) / width).floor();
                let end = self.time_s[0] + (bin + 1.0) * width;
                let to = from + self.time_s[from..].partition_point(|&t| t < end).max(1);
                push(from..to, false);
                from = to;
            }
        }
        means
    }
}

/// Block means of a stretch.
#[derive(Clone, Debug)]
pub(crate) struct Means {
    pub(crate) time_s: Vec<f64>,
    pub(crate) yaw_deg: Vec<f64>,
    pub(crate) uniform: bool,
}

impl Means {
    pub(crate) fn len(&self) -> usize {
        self.yaw_deg.len()
    }
    /// The means as a stretch of their own; `excluded` is all false and as long as they are.
    pub(crate) fn stretch<'a>(&'a self, excluded: &'a [bool]) -> Stretch<'a> {
        let n = self.len();
        let step_s =
            if n > 1 { (self.time_s[n - 1] - self.time_s[0]) / (n - 1) as f64 } else { 1.0 };
        Stretch {
            time_s: &self.time_s,
            yaw_deg: &self.yaw_deg,
            excluded: &excluded[..n],
            step_s,
            uniform: self.uniform,
            first: 0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounded_time_stamps_are_even_and_jittered_ones_are_not() {
        let rounded: Vec<f64> = (0..100).map(|k| (k as f64 / 3.0 * 1e3).round() / 1e3).collect();
        let jittered: Vec<f64> =
            (0..100).map(|k| 0.05 * (k as f64 + 0.1 * (k % 3) as f64)).collect();
        let y = vec![0.0; 100];
        assert!(Samples::new(&rounded, &y).is_uniform());
        assert!(!Samples::new(&jittered, &y).is_uniform());
        assert!((Samples::new(&rounded, &y).rate_hz() - 3.0).abs() < 0.01);
    }

    #[test]
    fn block_means_skip_what_is_left_out() {
        let t: Vec<f64> = (0..7).map(f64::from).collect();
        let y = vec![1.0, 100.0, 3.0, 4.0, 5.0, 6.0, 7.0];
        let mut samples = Samples::new(&t, &y);
        samples.exclude(1);
        let means = samples.all().block_means(2);
        assert_eq!(means.yaw_deg, [1.0, 3.5, 5.5]);
        assert_eq!(means.time_s, [0.0, 2.5, 4.5]);
        assert!(!means.stretch(&[false; 3]).uniform);
    }
}
