//! Single wild samples, found before anything is known of the oscillation.

use super::samples::Samples;
use crate::statistics::{median, sample_noise};

/// How far, in standard deviations of white noise, a sample may lie from the median of its neighbours: far
/// enough that correlated noise, which changes less from sample to sample than it seems to here, loses none.
const NOISE_FACTOR: f64 = 12.0;
/// Share of the record's range below which a sample off the curve of its neighbours does no harm.
const MIN_OF_RANGE: f64 = 1e-3;
/// Times that samples left out are put on the curve of their neighbours, which may have been left out as
/// well.
const SPIKE_SWEEPS: usize = 30;
/// Samples the median is taken over: a run of up to two wild ones is seen.
const MEDIAN_OF: usize = 5;

/// Leaves out samples that stand off from the median of their five neighbours by more than noise and the
/// signal's own curvature explain. A record sampled too coarsely for that loses none; the fits look again.
pub(crate) fn exclude_spikes(samples: &mut Samples<'_>) {
    let yaw = samples.all().yaw_deg;
    let n = yaw.len();
    if n < 4 * MEDIAN_OF {
        return;
    }
    let half = MEDIAN_OF / 2;
    // At the ends the five outermost samples serve, so that a wild first sample does not stand for its own
    // median.
    let middle: Vec<f64> = (0..n)
        .map(|k| {
            let from = k.saturating_sub(half).min(n - MEDIAN_OF);
            median_of_five(&yaw[from..from + MEDIAN_OF])
        })
        .collect();
    let off: Vec<f64> = yaw.iter().zip(&middle).map(|(y, m)| (y - m).abs()).collect();
    let noise = sample_noise(yaw);
    let step = smallest_step(yaw);
    let curvature = |k: usize| {
        let at = |i: isize| middle[(k as isize + i).clamp(0, n as isize - 1) as usize];
        (-4..=4).map(|i| (at(i + 2) - 2.0 * at(i) + at(i - 2)).abs()).fold(0.0, f64::max)
    };
    // Where a cycle has hardly five samples, every one stands off from its neighbours.
    let coarse = |k: usize| {
        let near = &yaw[k.saturating_sub(MEDIAN_OF)..(k + MEDIAN_OF + 1).min(n)];
        let mut steps: Vec<f64> = near.windows(2).map(|w| (w[1] - w[0]).abs()).collect();
        3.0 * median(&mut steps)
    };
    let least = (NOISE_FACTOR * noise).max(3.0 * step);
    let wild: Vec<usize> = (0..n)
        .filter(|&k| off[k] > least && off[k] > least + 2.0 * curvature(k) && off[k] > coarse(k))
        .collect();
    let range = |y: &[f64]| {
        let [low, high] = [f64::min, f64::max].map(|of| y.iter().copied().reduce(of));
        high.unwrap_or(0.0) - low.unwrap_or(0.0)
    };
    let least = (3.0 * step).max(MIN_OF_RANGE * range(&middle));
    for k in off_the_curve(samples.all().time_s, yaw.to_vec(), wild, least) {
        samples.exclude(k);
    }
}

/// `wild`, and samples off the curve through their six neighbours by more than `least`, the noise, and many
/// times what those beside them are: where a cycle has some ten samples, the median of neighbours sees less.
fn off_the_curve(time_s: &[f64], mut yaw: Vec<f64>, wild: Vec<usize>, least: f64) -> Vec<usize> {
    let n = yaw.len();
    let mut steps: Vec<f64> = time_s.windows(2).map(|t| t[1] - t[0]).collect();
    let longest = 1.5 * median(&mut steps);
    let is_even = |k: usize| {
        (3..n - 3).contains(&k) && time_s[k - 3..=k + 3].windows(2).all(|t| t[1] - t[0] < longest)
    };
    let off = |yaw: &[f64], k: usize| {
        let pair = |i: usize| yaw[k - i] + yaw[k + i];
        yaw[k] - (15.0 * pair(1) - 6.0 * pair(2) + pair(3)) / 20.0
    };
    let is_known: Vec<bool> = (0..n).map(|k| is_even(k) || !(3..n - 3).contains(&k)).collect();
    let mut found = wild;
    let mut offs = vec![0.0; n];
    loop {
        // On the curve, as far as their neighbours are.
        for _ in 0..SPIKE_SWEEPS {
            for &k in found.iter().filter(|&&k| is_even(k)) {
                yaw[k] -= off(&yaw, k);
            }
        }
        (0..n).filter(|&k| is_even(k)).for_each(|k| offs[k] = off(&yaw, k));
        // Where samples are missing nothing is known of how far one is off.
        let known = |range: std::ops::Range<usize>| -> Vec<f64> {
            range.filter(|&k| is_known[k]).map(|k| offs[k].abs()).collect()
        };
        let noise = median(&mut known(0..n)) / 0.6745;
        // The larger side: where the model is let go, the other stands still.
        let beside = |k: usize| {
            let side = |range: std::ops::Range<usize>| match known(range.clone()) {
                few if 2 * few.len() < range.len() => f64::INFINITY,
                mut offs => median(&mut offs),
            };
            side(k.saturating_sub(11)..k - 3).max(side(k + 4..(k + 12).min(n)))
        };
        // Two wild neighbours bend the curve of each other: which they are cannot be seen here.
        let is_alone = |k: usize| {
            let bent = |beside: usize| (offs[beside] + 0.75 * offs[k]).abs() < 0.25 * offs[k].abs();
            bent(k - 1) && bent(k + 1)
        };
        let wild = (4..n - 4).filter(|&k| {
            let off = offs[k].abs();
            off > least.max(NOISE_FACTOR * noise) && off > NOISE_FACTOR * beside(k) && is_alone(k)
        });
        // The largest only: it pulls the curve of its neighbours along.
        let Some(largest) = wild.max_by(|&a, &b| offs[a].abs().total_cmp(&offs[b].abs())) else {
            return found;
        };
        if found.contains(&largest) || found.len() > n / 20 {
            return found;
        }
        found.push(largest);
    }
}

fn median_of_five(v: &[f64]) -> f64 {
    let (a, b) = (v[0].min(v[1]), v[0].max(v[1]));
    let (c, d) = (v[2].min(v[3]), v[2].max(v[3]));
    // The smallest and the largest of the four cannot be the median.
    let (e, f) = (a.max(c), b.min(d));
    let (low, high) = (e.min(f), e.max(f));
    // `clamp` would panic where the bounds are no numbers.
    v[4].max(low).min(high)
}

/// The converter's step, where the record shows one: the smallest difference between neighbours that is not
/// zero.
fn smallest_step(yaw: &[f64]) -> f64 {
    let smallest = yaw
        .windows(2)
        .map(|w| (w[1] - w[0]).abs())
        .filter(|d| *d > 0.0)
        .fold(f64::INFINITY, f64::min);
    if smallest.is_finite() {
        smallest
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(yaw: &[f64]) -> Vec<usize> {
        let t: Vec<f64> = (0..yaw.len()).map(|k| k as f64 * 0.01).collect();
        let mut samples = Samples::new(&t, yaw);
        exclude_spikes(&mut samples);
        let excluded = samples.all().excluded;
        (0..yaw.len()).filter(|&k| excluded[k]).collect()
    }

    fn swing(n: usize, step: f64) -> Vec<f64> {
        (0..n)
            .map(|k| {
                let t = k as f64 * 0.01;
                let y = 3.0 + if t < 1.0 { 10.0 } else { 10.0 * (7.0 * (t - 1.0)).cos() };
                if step > 0.0 {
                    (y / step).round() * step
                } else {
                    y
                }
            })
            .collect()
    }

    #[test]
    fn spikes_are_found_and_nothing_else() {
        for step in [0.0, 0.09] {
            let mut yaw = swing(1500, step);
            assert!(found(&yaw).is_empty(), "step {step}");
            for k in [0, 50, 400, 401, 777, 1499] {
                yaw[k] += if k % 2 == 0 { 12.0 } else { -60.0 };
            }
            assert_eq!(found(&yaw), [0, 50, 400, 401, 777, 1499], "step {step}");
        }
    }

    #[test]
    fn a_fast_mode_sampled_coarsely_loses_nothing() {
        // Long held and long at rest, so that the swing is a small part of the record.
        let swing = (0..100).map(|k| {
            let t = 0.05 * k as f64;
            10.0 * (-t).exp() * (26.0 * t).cos()
        });
        let yaw: Vec<f64> =
            vec![10.0; 200].into_iter().chain(swing).chain(vec![0.0; 200]).collect();
        assert!(found(&yaw).is_empty());
    }

    #[test]
    fn spikes_in_a_swing_of_ten_samples_a_cycle_are_found() {
        let swing = |k: usize| 40.0 * (-0.004 * k as f64).exp() * (0.6 * k as f64).cos();
        // Between the samples' noise and the swing.
        let noise = |k: usize| 0.1 * (k as f64 * 12.9898).sin();
        let mut yaw: Vec<f64> = (0..400).map(|k| swing(k) + noise(k)).collect();
        assert!(found(&yaw).is_empty());
        yaw[37] += 9.0;
        yaw[201] -= 6.0;
        assert_eq!(found(&yaw), [37, 201]);
    }

    #[test]
    fn where_samples_are_missing_at_random_none_is_wild_for_that() {
        let mut number = 1u64;
        let mut draw = || {
            number = number.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (number >> 40) as f64 / (1u64 << 24) as f64
        };
        let (mut t, mut yaw) = (Vec::new(), Vec::new());
        for k in 0..20_000 {
            let time_s = 0.01 * f64::from(k);
            let noise = (0..4).map(|_| draw() - 0.5).sum::<f64>();
            if draw() > 0.1 {
                t.push(time_s);
                yaw.push(20.0 * (-0.01 * time_s).exp() * (7.0 * time_s).cos() + 0.05 * noise);
            }
        }
        let excluded = |yaw: &[f64]| {
            let mut samples = Samples::new(&t, yaw);
            exclude_spikes(&mut samples);
            let excluded = samples.all().excluded;
            (0..yaw.len()).filter(|&k| excluded[k]).collect::<Vec<usize>>()
        };
        assert!(excluded(&yaw).is_empty(), "{:?}", excluded(&yaw).len());
        yaw[5000] += 15.0;
        assert_eq!(excluded(&yaw), [5000]);
    }

    #[test]
    fn samples_that_are_no_numbers_end_nothing() {
        let mut yaw = swing(1500, 0.0);
        yaw[300..310].fill(f64::NAN);
        yaw[777] += 60.0;
        yaw[1200] = f64::INFINITY;
        assert!(found(&yaw).contains(&777));
        found(&[f64::NAN; 100]);
        assert_eq!(median_of_five(&[f64::NAN, 2.0, 1.0, f64::NAN, 3.0]), 2.0);
        assert!(median_of_five(&[f64::NAN; 5]).is_nan());
    }

    #[test]
    fn five_values_have_the_median_that_sorting_gives() {
        let mut v = [3.0, 1.0, 4.0, 1.5, 9.0];
        for rotation in 0..5 {
            v.rotate_left(1);
            let _ = rotation;
            assert_eq!(median_of_five(&v), 3.0);
        }
    }
}
