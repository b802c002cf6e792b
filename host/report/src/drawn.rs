//! What is drawn of a curve: few enough numbers, short enough, with every extreme kept.

use serde::Serialize;

/// Values over time, not finite where there are none.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Series {
    pub time_s: Vec<f64>,
    pub values: Vec<f64>,
}

/// A stretch of time cut into equal parts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stretches {
    pub from_s: f64,
    pub to_s: f64,
    pub count: usize,
}

impl Stretches {
    fn width_s(&self) -> f64 {
        (self.to_s - self.from_s) / self.count as f64
    }

    /// Two instants of each: a quarter and three quarters through it.
    pub fn times_s(&self) -> Vec<f64> {
        let width = self.width_s();
        (0..2 * self.count).map(|k| self.from_s + (0.5 * k as f64 + 0.25) * width).collect()
    }
}

impl Series {
    pub fn new(time_s: Vec<f64>, values: Vec<f64>) -> Self {
        Self { time_s, values }
    }

    /// The least and the largest value of each stretch, the earlier first, so that no extreme is lost; where
    /// the values lie farther apart than the stretches, the straight line between them.
    pub fn drawn(&self, stretches: &Stretches) -> Vec<Option<f64>> {
        let width = stretches.width_s();
        let mut out = Vec::with_capacity(2 * stretches.count);
        let mut end = self.time_s.partition_point(|t| *t < stretches.from_s);
        for k in 0..stretches.count {
            let begin = end;
            let until = stretches.from_s + (k + 1) as f64 * width;
            while end < self.time_s.len() && self.time_s[end] < until {
                end += 1;
            }
            out.extend(match extremes(&self.values[begin..end]) {
                Some(both) => both.map(Some),
                None => [0.75, 0.25].map(|back| self.between(end, until - back * width)),
            });
        }
        out
    }

    /// On the straight line between the neighbours of `time_s`; `near` is an index about there.
    fn between(&self, near: usize, time_s: f64) -> Option<f64> {
        let mut after = near.min(self.time_s.len());
        while after > 0 && self.time_s[after - 1] > time_s {
            after -= 1;
        }
        let before = after.checked_sub(1)?;
        let (t0, t1) = (self.time_s[before], *self.time_s.get(after)?);
        let share = (time_s - t0) / (t1 - t0);
        let value = self.values[before] + share * (self.values[after] - self.values[before]);
        value.is_finite().then_some(value)
    }
}

/// The least and the largest in the order in which they come; none where fewer than two values are finite.
fn extremes(values: &[f64]) -> Option<[f64; 2]> {
    let finite = || (0..values.len()).filter(|&k| values[k].is_finite());
    let first = finite().next()?;
    let low = finite().fold(first, |best, k| if values[k] < values[best] { k } else { best });
    let high = finite().fold(first, |best, k| if values[k] > values[best] { k } else { best });
    (finite().count() > 1).then(|| [values[low.min(high)], values[low.max(high)]])
}

/// The width of a stretch; 1: nothing is left out.
fn width(count: usize, most: usize) -> usize {
    if count <= most {
        1
    } else {
        (2 * count).div_ceil(most)
    }
}

/// Two values of each stretch: the least and the largest, the earlier first.
pub fn decimated(values: &[f64], most: usize) -> Vec<f64> {
    let width = width(values.len(), most);
    if width == 1 {
        return values.iter().copied().map(rounded).collect();
    }
    let extremes = |stretch: &[f64]| extremes(stretch).unwrap_or([stretch[0]; 2]).map(rounded);
    values.chunks(width).flat_map(extremes).collect()
}

/// The times that belong to [`decimated`]: a quarter and three quarters through each stretch.
pub fn times(time_s: &[f64], most: usize) -> Vec<f64> {
    let width = width(time_s.len(), most);
    if width == 1 {
        return time_s.iter().copied().map(rounded).collect();
    }
    let quarters = |stretch: &[f64]| {
        let (first, last) = (stretch[0], stretch[stretch.len() - 1]);
        [0.25, 0.75].map(|share| rounded(first + share * (last - first)))
    };
    time_s.chunks(width).flat_map(quarters).collect()
}

/// To a tenth of a millidegree or millisecond: below what a drawing shows.
fn rounded(x: f64) -> f64 {
    (x * 1e4).round() / 1e4
}

/// Five digits: more than a drawing shows.
pub fn short(x: f64) -> f64 {
    if x == 0.0 || !x.is_finite() {
        return x;
    }
    let scale = 10f64.powi(4 - x.abs().log10().floor() as i32);
    (x * scale).round() / scale
}

/// The same of many.
pub fn shorts<T: IntoShort>(values: impl IntoIterator<Item = T>) -> Vec<T> {
    values.into_iter().map(T::into_short).collect()
}

/// What can be written in five digits.
pub trait IntoShort: Serialize {
    fn into_short(self) -> Self;
}

impl IntoShort for f64 {
    fn into_short(self) -> Self {
        short(self)
    }
}

impl IntoShort for Option<f64> {
    fn into_short(self) -> Self {
        self.map(short)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn series(count: usize, step_s: f64, of: impl Fn(usize) -> f64) -> Series {
        Series::new((0..count).map(|k| k as f64 * step_s).collect(), (0..count).map(of).collect())
    }

    #[test]
    fn every_extreme_is_kept_in_its_order() {
        let series = series(1000, 0.001, |k| match k {
            437 => 9.0,
            439 => -7.0,
            _ => 0.0,
        });
        let drawn = series.drawn(&Stretches { from_s: 0.0, to_s: 1.0, count: 20 });
        assert_eq!(drawn.len(), 40);
        assert_eq!((drawn[16], drawn[17]), (Some(9.0), Some(-7.0)));
        assert!(drawn.iter().enumerate().all(|(k, v)| *v == Some(0.0) || k == 16 || k == 17));
    }

    #[test]
    fn between_samples_is_a_straight_line_and_beyond_them_nothing() {
        let series = series(3, 1.0, |k| 10.0 * k as f64);
        let stretches = Stretches { from_s: -1.0, to_s: 3.0, count: 16 };
        let drawn = series.drawn(&stretches);
        for (t, v) in stretches.times_s().iter().zip(&drawn) {
            match (0.0..=2.0).contains(t) {
                true => assert!((v.unwrap() - 10.0 * t).abs() < 1e-9, "{t} {v:?}"),
                false => assert_eq!(*v, None, "{t}"),
            }
        }
    }

    #[test]
    fn gaps_stay_gaps() {
        let series = series(100, 0.01, |k| if k < 50 { f64::NAN } else { 1.0 });
        let drawn = series.drawn(&Stretches { from_s: 0.0, to_s: 1.0, count: 10 });
        assert_eq!(drawn[..10], [None; 10]);
        assert_eq!(drawn[12..], [Some(1.0); 8]);
    }

    #[test]
    fn five_digits() {
        assert_eq!(
            shorts([1.234_567_8, -0.001_234_567, 0.0, 123_456.7]),
            [1.2346, -0.001_234_6, 0.0, 123_460.0]
        );
    }

    #[test]
    fn extremes_stay_and_their_order_too() {
        let mut values: Vec<f64> = (0..1000).map(|k| f64::from(k % 10) * 0.125).collect();
        values[437] = 9.0;
        values[439] = -7.0;
        let few = decimated(&values, 100);
        assert_eq!(few.len(), 100);
        let (up, down) = (few.iter().position(|v| *v == 9.0), few.iter().position(|v| *v == -7.0));
        assert!(up.unwrap() < down.unwrap());
        let times = times(&(0..1000).map(f64::from).collect::<Vec<_>>(), 100);
        assert_eq!(times.len(), few.len());
        assert!(times.windows(2).all(|t| t[0] < t[1]));
        assert_eq!(decimated(&values, 1000), values);
    }
}
