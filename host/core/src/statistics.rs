//! The median of numbers, how many correlated ones count as independent, and white noise of a series from
//! what no slow motion leaves in it.

/// Middle value (mean of the two middle ones for an even number); reorders. NaN for none.
pub fn median(values: &mut [f64]) -> f64 {
    let n = values.len();
    if n == 0 {
        return f64::NAN;
    }
    let (below, middle, _) = values.select_nth_unstable_by(n / 2, f64::total_cmp);
    if n % 2 == 1 {
        *middle
    } else {
        let middle = *middle;
        0.5 * (middle + below.iter().copied().fold(f64::NEG_INFINITY, f64::max))
    }
}

/// Value with half of the weight below it and half above; each counts alike where no weight is above zero.
/// Reorders the pairs of value and weight; NaN for none.
pub(crate) fn weighted_median(values: &mut [(f64, f64)]) -> f64 {
    if values.iter().all(|(_, weight)| *weight <= 0.0) {
        return median(&mut values.iter().map(|(value, _)| *value).collect::<Vec<f64>>());
    }
    values.sort_by(|a, b| a.0.total_cmp(&b.0));
    let total: f64 = values.iter().map(|(_, weight)| weight).sum();
    let mut below = 0.0;
    let middle = |(_, weight): &&(f64, f64)| {
        below += weight;
        2.0 * below >= total
    };
    values.iter().find(middle).map_or(f64::NAN, |(value, _)| *value)
}

/// Root of the mean square; NaN for none.
pub(crate) fn rms(values: impl IntoIterator<Item = f64>) -> f64 {
    weighted_rms(values.into_iter().map(|value| (1.0, value)))
}

/// The same of values behind their weights.
pub(crate) fn weighted_rms(values: impl IntoIterator<Item = (f64, f64)>) -> f64 {
    let add = |sum: (f64, f64), (w, value): (f64, f64)| (sum.0 + w, sum.1 + w * value.powi(2));
    let (weights, squares) = values.into_iter().fold((0.0, 0.0), add);
    (squares / weights).sqrt()
}

/// Chi squared of so many degrees of freedom that chance exceeds once in a hundred, within 1 % (E. B. Wilson
/// and M. M. Hilferty, Proc. Nat. Acad. Sci. 17, 1931).
pub(crate) fn rare_chi_squared(freedom: f64) -> f64 {
    // The normal deviate that is exceeded as often.
    const DEVIATE: f64 = 2.326_348;
    let variance = 2.0 / (9.0 * freedom);
    freedom * (1.0 - variance + DEVIATE * variance.sqrt()).powi(3)
}

/// The normal deviate that chance exceeds as often as chi squared of so many degrees of freedom this `value`:
/// the same approximation the other way round.
pub(crate) fn of_chi_squared(value: f64, freedom: f64) -> f64 {
    let variance = 2.0 / (9.0 * freedom);
    ((value / freedom).cbrt() - (1.0 - variance)) / variance.sqrt()
}

/// Lag-one correlation of what scatters about zero, of several series together.
pub(crate) fn correlation(series: &[Vec<f64>]) -> f64 {
    let lag: f64 = series.iter().map(|y| y.windows(2).map(|w| w[0] * w[1]).sum::<f64>()).sum();
    let power: f64 = series.iter().map(|y| y.iter().map(|y| y * y).sum::<f64>()).sum();
    if power > 0.0 {
        lag / power
    } else {
        0.0
    }
}

/// Share of residuals that count as independent where neighbours have this correlation: (1 - c)/(1 + c) of
/// them.
pub(crate) fn independent_share(correlation: f64) -> f64 {
    let c = correlation.clamp(0.0, 0.999);
    (1.0 - c) / (1.0 + c)
}

/// Third differences: 1 + 9 + 9 + 1 variances of white noise, and little of a well sampled free decay.
fn thirds(y: &[f64]) -> impl Iterator<Item = f64> + '_ {
    y.windows(4).map(|y| y[3] - 3.0 * y[2] + 3.0 * y[1] - y[0])
}

/// Standard deviation of white noise by the median of third differences, which wild values do not move; 0 for
/// fewer than four values. At a few tens of samples a cycle it is an upper bound.
pub(crate) fn sample_noise(y: &[f64]) -> f64 {
    let mut thirds: Vec<f64> = thirds(y).map(f64::abs).collect();
    if thirds.is_empty() {
        return 0.0;
    }
    // 0.6745 sigma is a normal's median deviation.
    median(&mut thirds) / (0.6745 * 20.0_f64.sqrt())
}

/// The same by the root mean square of third differences without the largest: sharper.
pub(crate) fn rms_of_thirds(y: &[f64]) -> f64 {
    trimmed_rms(thirds(y).collect()) / 20.0_f64.sqrt()
}

/// The same of order six: an oscillation of fifty means a cycle leaves 4e-6 of its amplitude in them.
pub(crate) fn rms_of_sixths(y: &[f64]) -> f64 {
    let d = y
        .windows(7)
        .map(|y| y[0] + y[6] - 6.0 * (y[1] + y[5]) + 15.0 * (y[2] + y[4]) - 20.0 * y[3])
        .collect();
    trimmed_rms(d) / 924.0_f64.sqrt()
}

/// The same at uneven times: of seven neighbours the combination in which no polynomial of fifth degree
/// leaves anything, divided by what unit noise leaves.
pub(crate) fn rms_of_uneven_sixths(time_s: &[f64], y: &[f64]) -> f64 {
    let sixths = time_s.windows(7).zip(y.windows(7)).map(|(t, y)| {
        let weight = |k: usize| (0..7).filter(|j| *j != k).map(|j| 1.0 / (t[k] - t[j])).product();
        let weights: [f64; 7] = std::array::from_fn(weight);
        let sum: f64 = weights.iter().zip(y).map(|(w, y)| w * y).sum();
        sum / weights.iter().map(|w| w * w).sum::<f64>().sqrt()
    });
    trimmed_rms(sixths.collect())
}

/// Root mean square without values beyond four of it: corners and wild samples are no noise.
fn trimmed_rms(mut values: Vec<f64>) -> f64 {
    for _ in 0..3 {
        if values.is_empty() {
            return 0.0;
        }
        let rms = rms(values.iter().copied());
        values.retain(|v| v.abs() <= 4.0 * rms);
    }
    rms(values)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_of_the_weight_is_on_either_side_of_a_weighted_median() {
        assert_eq!(weighted_median(&mut [(9.0, 1.0), (1.0, 1.0), (2.0, 1.0)]), 2.0);
        assert_eq!(weighted_median(&mut [(9.0, 5.0), (1.0, 1.0), (2.0, 1.0)]), 9.0);
        assert_eq!(weighted_median(&mut [(9.0, 0.0), (1.0, 0.0), (2.0, 1.0)]), 2.0);
        assert_eq!(weighted_median(&mut [(9.0, 0.0), (1.0, 0.0)]), 5.0);
        assert!(weighted_median(&mut []).is_nan());
    }

    #[test]
    fn the_median_of_even_and_odd_numbers() {
        assert_eq!(median(&mut [3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(&mut [4.0, 1.0, 3.0, 2.0]), 2.5);
        assert!(median(&mut []).is_nan());
    }

    #[test]
    fn all_find_the_noise_on_a_slow_motion() {
        let mut state = 7_u64;
        let mut uniform = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        // Twelve uniform numbers add up to variance one.
        let y: Vec<f64> = (0..4000)
            .map(|k| {
                let noise: f64 = (0..12).map(|_| uniform()).sum::<f64>() - 6.0;
                10.0 * (f64::from(k) * 0.01).sin() + 0.05 * noise
            })
            .collect();
        let time_s: Vec<f64> = (0..4000).map(f64::from).collect();
        let uneven = rms_of_uneven_sixths(&time_s, &y);
        assert!((uneven / rms_of_sixths(&y) - 1.0).abs() < 1e-9, "the same where they are even");
        for found in [sample_noise(&y), rms_of_thirds(&y), rms_of_sixths(&y), uneven] {
            assert!((found / 0.05 - 1.0).abs() < 0.06, "{found}");
        }
        assert_eq!(sample_noise(&y[..3]), 0.0);
    }
}
