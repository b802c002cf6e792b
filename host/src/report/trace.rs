//! A record and its models as they are drawn: few enough numbers, with every extreme kept.

use serde::{Deserialize, Serialize};
use yawrig_core::fit::fitting::Fitted;
use yawrig_core::fit::swing::Swing;

/// A free decay with what models make of it. Times from the release.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Trace {
    pub time_s: Vec<f64>,
    pub measured_deg: Vec<f64>,
    pub models: Vec<ModelTrace>,
    /// Values of which `time_s.len()` are left: the fits' means over a fiftieth of a period.
    pub of: usize,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ModelTrace {
    pub name: String,
    pub yaw_deg: Vec<f64>,
    /// Measured less model.
    pub residual_deg: Vec<f64>,
}

/// Fewest values of a curve.
const FEWEST: usize = 200;

/// Values per curve where `numbers` are shared by `curves` of them.
pub fn values(numbers: usize, curves: usize) -> usize {
    (numbers / curves.max(1)).max(FEWEST)
}

/// `swing` and `models` in at most `most` values each: the whole, or the least and the largest value of each of half as
/// many stretches, in the order in which they come.
pub fn of(swing: &Swing, models: &[(&str, &Fitted)], most: usize) -> Trace {
    let time_s: Vec<f64> = (0..swing.yaw_rad.len()).map(|k| swing.grid.time_s(k)).collect();
    let degrees = |rad: &[f64]| -> Vec<f64> { rad.iter().map(|y| y.to_degrees()).collect() };
    let measured = degrees(&swing.yaw_rad);
    let models = models.iter().map(|(name, model)| {
        let yaw = degrees(&model.readings(&swing.grid));
        let residual: Vec<f64> = measured.iter().zip(&yaw).map(|(y, m)| y - m).collect();
        ModelTrace {
            name: (*name).to_owned(),
            yaw_deg: decimated(&yaw, most),
            residual_deg: decimated(&residual, most),
        }
    });
    Trace {
        models: models.collect(),
        time_s: times(&time_s, most),
        measured_deg: decimated(&measured, most),
        of: time_s.len(),
    }
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
    let extremes =
        |stretch: &[f64]| {
            let at =
                |better: fn(f64, f64) -> bool| {
                    (1..stretch.len()).fold(0, |best, k| {
                        if better(stretch[k], stretch[best]) {
                            k
                        } else {
                            best
                        }
                    })
                };
            let (low, high) = (at(|a, b| a < b), at(|a, b| a > b));
            [stretch[low.min(high)], stretch[low.max(high)]].map(rounded)
        };
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

#[cfg(test)]
mod tests {
    use super::*;

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
