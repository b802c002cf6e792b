//! A white random moment behind an oscillator: the Kalman filter's steps, and the whitening of what the
//! moment adds to readings.

use crate::motion::oscillator::{Flow, Grid};

/// From one reading of the oscillator's angle to the next, the noise of a reading being of unit variance.
pub(crate) struct Step {
    /// Of the state, angle and rate.
    pub(crate) transition: [[f64; 2]; 2],
    /// Covariance (bb, br, rr) that the moment adds to the state.
    pub(crate) added: [f64; 3],
    /// The next reading by the state before it.
    read: [f64; 2],
    /// Covariance of what the moment adds to that reading with the state after it, and its variance.
    read_added: [f64; 3],
}

impl Step {
    /// A moment of this `intensity`, and readings every `h` (s), of the angle itself or of its mean since the
    /// last one; none where the model does not oscillate.
    pub(crate) fn new(
        h: f64,
        wn: f64,
        zeta: f64,
        intensity: f64,
        is_of_means: bool,
    ) -> Option<Self> {
        if zeta.abs() >= 1.0 || zeta.is_nan() {
            return None;
        }
        let flow = |s: f64| Flow::new(wn, zeta, s).0;
        // What a kick makes of angle, rate and mean in the rest of a step, by Simpson's rule over that rest.
        let kicked = |s: f64| {
            let [_, q, _, v] = flow(s);
            [q, v, (1.0 - v - 2.0 * zeta * wn * q) / (wn * wn * h)]
        };
        let mut sums = [[0.0; 3]; 3];
        for (k, weight) in [1.0, 4.0, 2.0, 4.0, 1.0].into_iter().enumerate() {
            let by = kicked(0.25 * k as f64 * h);
            for (sums, one) in sums.iter_mut().zip(by) {
                for (sum, other) in sums.iter_mut().zip(by) {
                    *sum += intensity * h / 12.0 * weight * one * other;
                }
            }
        }
        let [p, q, u, v] = flow(h);
        let of_angle = -(u + 2.0 * zeta * wn * (p - 1.0)) / (wn * wn * h);
        let (read, seen) = match is_of_means {
            true => ([of_angle, kicked(h)[2]], 2),
            false => ([p, q], 0),
        };
        Some(Self {
            transition: [[p, q], [u, v]],
            added: [sums[0][0], sums[0][1], sums[1][1]],
            read,
            read_added: [sums[seen][0], sums[seen][1], sums[seen][seen]],
        })
    }

    /// The reading that is expected after the state `x`.
    pub(crate) fn expected(&self, x: [f64; 2]) -> f64 {
        self.read[0] * x[0] + self.read[1] * x[1]
    }

    /// The state after a reading that is off the expected one by `innovation`.
    pub(crate) fn next(&self, x: [f64; 2], gain: [f64; 2], innovation: f64) -> [f64; 2] {
        let f = &self.transition;
        [0, 1].map(|i| f[i][0] * x[0] + f[i][1] * x[1] + gain[i] * innovation)
    }

    /// Variance and gain of a reading after a state of covariance `p`, and the covariance after it.
    pub(crate) fn filtered(&self, p: [f64; 3]) -> (f64, [f64; 2], [f64; 3]) {
        let (f, g) = (&self.transition, &self.read);
        let own = [p[0] * g[0] + p[1] * g[1], p[1] * g[0] + p[2] * g[1]];
        let variance = g[0] * own[0] + g[1] * own[1] + self.read_added[2] + 1.0;
        let c = [0, 1].map(|i| f[i][0] * own[0] + f[i][1] * own[1] + self.read_added[i]);
        let gain = c.map(|c| c / variance);
        let a = [0, 1].map(|i| [f[i][0] * p[0] + f[i][1] * p[1], f[i][0] * p[1] + f[i][1] * p[2]]);
        let at = |i: usize, j: usize, added: f64| {
            a[i][0] * f[j][0] + a[i][1] * f[j][1] + added - gain[i] * c[j]
        };
        let [bb, br, rr] = self.added;
        (variance, gain, [at(0, 0, bb), at(0, 1, br), at(1, 1, rr)])
    }
}

/// Turns what a model leaves into white innovations of unit size in units of the noise: the filter's gains
/// for a start that is known, the model having its own.
pub(crate) struct Whitener {
    step: Step,
    covariances: Vec<[f64; 3]>,
    gains: Vec<[f64; 2]>,
    roots: Vec<f64>,
    /// From the state before a reading to the reading's instant, and back from the next.
    there: [Flow; 2],
}

impl Whitener {
    /// `ratio`: intensity over the noise's variance.
    pub(crate) fn new(grid: &Grid, wn: f64, zeta: f64, ratio: f64) -> Option<Self> {
        let step = Step::new(grid.step_s, wn, zeta, ratio, grid.mean_width_s > 0.0)?;
        let mut p = [0.0_f64; 3];
        let (mut covariances, mut gains, mut roots) = (Vec::new(), Vec::new(), Vec::new());
        for _ in 0..grid.count {
            let (variance, gain, next) = step.filtered(p);
            covariances.push(p);
            gains.push(gain);
            roots.push(variance.sqrt());
            p = next;
        }
        let on = if grid.mean_width_s > 0.0 { 0.5 } else { 1.0 } * grid.step_s;
        let there = [on, on - grid.step_s].map(|time_s| Flow::new(wn, zeta, time_s));
        Some(Self { step, covariances, gains, roots, there })
    }

    pub(crate) fn whiten(&self, series: &mut [f64]) {
        let mut x = [0.0; 2];
        for ((y, gain), root) in series.iter_mut().zip(&self.gains).zip(&self.roots) {
            let innovation = *y - self.step.expected(x);
            *y = innovation / root;
            x = self.step.next(x, *gain, innovation);
        }
    }

    /// Angle and rate at the instant of each reading, of the random motion that is in `series`, from all of
    /// it: P. de Jong, J. Am. Stat. Assoc. 84 (1989).
    pub(crate) fn smoothed(&self, series: &[f64]) -> Vec<[f64; 2]> {
        let (f, g) = (&self.step.transition, &self.step.read);
        let mut x = [0.0; 2];
        let mut filtered = Vec::with_capacity(series.len());
        for (y, gain) in series.iter().zip(&self.gains) {
            let innovation = y - self.step.expected(x);
            filtered.push((x, innovation));
            x = self.step.next(x, *gain, innovation);
        }
        let mut ahead = [0.0; 2];
        let mut next: Option<[f64; 2]> = None;
        let mut states = vec![[0.0; 2]; series.len()];
        for (k, (x, innovation)) in filtered.into_iter().enumerate().rev() {
            let (p, gain) = (self.covariances[k], self.gains[k]);
            let scaled = innovation / self.roots[k].powi(2);
            ahead = [0, 1].map(|j| {
                g[j] * scaled + (0..2).map(|i| (f[i][j] - gain[i] * g[j]) * ahead[i]).sum::<f64>()
            });
            let before = [
                x[0] + p[0] * ahead[0] + p[1] * ahead[1],
                x[1] + p[1] * ahead[0] + p[2] * ahead[1],
            ];
            let at =
                |Flow([p, q, u, v]): Flow, x: [f64; 2]| [p * x[0] + q * x[1], u * x[0] + v * x[1]];
            let here = at(self.there[0], before);
            states[k] = match next {
                Some(next) => {
                    let back = at(self.there[1], next);
                    [0, 1].map(|i| 0.5 * (here[i] + back[i]))
                }
                None => here,
            };
            next = Some(before);
        }
        states
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    /// A thousand kicks in a step, each followed in closed form.
    #[test]
    fn a_step_is_that_of_as_many_small_ones() {
        let (h, wn, zeta, intensity, fine) = (0.1, 5.0, 0.03, 2.0, 1000);
        let step = Step::new(h, wn, zeta, intensity, true).unwrap();
        let of = |s: f64| Flow::new(wn, zeta, s).0;
        let mean = |from_s: f64, which: usize| {
            let at = |k: i32| of((f64::from(k) + 0.5) * (h - from_s) / 100.0)[which];
            (0..100).map(at).sum::<f64>() / 100.0 * (h - from_s) / h
        };
        assert!((step.read[0] - mean(0.0, 0)).abs() < 1e-5);
        assert!((step.read[1] - mean(0.0, 1)).abs() < 1e-5 * h);
        let mut sums = [0.0; 3];
        for k in 0..fine {
            let kick_s = (f64::from(k) + 0.5) * h / f64::from(fine);
            let ([_, q, _, v], m) = (of(h - kick_s), mean(kick_s, 1));
            for (sum, one) in sums.iter_mut().zip([q * m, v * m, m * m]) {
                *sum += one * intensity * h / f64::from(fine);
            }
        }
        for (a, b) in step.read_added.iter().zip(sums) {
            assert!((a / b - 1.0).abs() < 5e-3, "{a} {b}");
        }
    }

    /// Of an oscillator that is kicked every millisecond, read every tenth of a second with noise a fifth of
    /// its motion: the angle is found to half of that, and the rate as well as the angle is read.
    #[test]
    fn a_kicked_motion_is_found_from_what_is_read_of_it() {
        let (wn, zeta, noise, fine) = (5.0, 0.03, 0.02, 100);
        let grid = Grid { start_s: 0.0, step_s: 0.1, count: 2000, mean_width_s: 0.1 };
        let (h, intensity) = (grid.step_s / f64::from(fine), 0.15);
        let Flow([p, q, u, v]) = Flow::new(wn, zeta, h);
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let (mut x, mut readings, mut truth) = ([0.0; 2], Vec::new(), Vec::new());
        for _ in 0..grid.count {
            let mut sum = 0.0;
            for k in 0..fine {
                if k == fine / 2 {
                    truth.push(x);
                }
                x = [p * x[0] + q * x[1], u * x[0] + v * x[1] + (intensity * h).sqrt() * normal()];
                sum += x[0];
            }
            readings.push(sum / f64::from(fine) + noise * normal());
        }
        let whitener = Whitener::new(&grid, wn, zeta, intensity / (noise * noise)).unwrap();
        let found = whitener.smoothed(&readings);
        let rms = |of: &dyn Fn(usize) -> f64| {
            ((20..1980).map(|k| of(k).powi(2)).sum::<f64>() / 1960.0).sqrt()
        };
        let off = [0, 1].map(|i| rms(&|k| found[k][i] - truth[k][i]) / rms(&|k| truth[k][i]));
        let read = rms(&|k| readings[k] - truth[k][0]) / rms(&|k| truth[k][0]);
        println!("angle off by {:.4}, rate by {:.4}, a reading by {read:.4}", off[0], off[1]);
        assert!(off[0] < 0.6 * read && off[1] < 1.5 * read);
    }
}
