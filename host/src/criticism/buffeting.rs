//! Random forcing recognised: the likelihood of a Kalman filter with process noise against one without.
//!
//! State (b, r) of the plain model, driven by a white random moment of intensity q, read with white noise. The
//! likelihood is that of the innovations, the noise's variance concentrated out: R. H. Jones, Technometrics 22 (1980).
//! A deterministic effect that is missing also raises q; it is told by forcing that goes with the swing's amplitude,
//! since buffeting is as strong at the end of a record as at its beginning.

use super::fitting::Fitted;
use super::simulate::Grid;
use super::swing::Swing;

/// A swing under random forcing.
#[derive(Clone, Debug)]
pub struct Buffeted {
    pub natural_frequency_rad_s: f64,
    pub damping_ratio: f64,
    /// rad2/s3.
    pub intensity: f64,
    /// Standard uncertainties of ln q, wn and zeta from the curvature of the likelihood.
    pub deviations: [f64; 3],
    /// Minus twice the log likelihood, on the scale of n ln(residual sum of squares / n).
    pub deviance: f64,
    /// Rms of the innovations over their expected one at the noise floor: 1 if explained.
    pub over_noise: f64,
    /// Lag-one correlation of the innovations.
    pub correlation: f64,
    /// Intensity in the first half over that in the second.
    pub early_over_late: f64,
    /// Dependence of the innovations on the state, in standard deviations.
    pub state_dependence: f64,
}

struct Run {
    deviance: f64,
    noise_variance: f64,
    innovations: Vec<f64>,
    /// The state foretold for each innovation.
    states: Vec<[f64; 2]>,
}

/// Filters `yaw` with the model; `ratio` is q over the noise's variance. Discrete noise for a step short against the
/// period.
fn filter(grid: &Grid, yaw: &[f64], wn: f64, zeta: f64, ratio: f64) -> Option<Run> {
    let h = grid.step_s;
    let decay = zeta * wn;
    let wd = (wn * wn - decay * decay).sqrt();
    if wd.is_nan() {
        return None;
    }
    let e = (-decay * h).exp();
    let (s, c) = (wd * h).sin_cos();
    let f =
        [[e * (c + decay / wd * s), e * s / wd], [-wn * wn * e * s / wd, e * (c - decay / wd * s)]];
    let q = [ratio * h.powi(3) / 3.0, ratio * h * h / 2.0, ratio * h];
    // Known to nothing at first: the first means fix it, and are left out of the likelihood.
    let (mut x, mut p) = ([yaw[0], 0.0], [1e6, 0.0, 1e6 * wn * wn]);
    let (mut sum, mut logs, mut n) = (0.0, 0.0, 0.0);
    let mut innovations = Vec::with_capacity(yaw.len());
    let mut states = Vec::with_capacity(yaw.len());
    for (k, &y) in yaw.iter().enumerate() {
        let variance = p[0] + 1.0;
        let innovation = y - x[0];
        if k >= 4 {
            sum += innovation * innovation / variance;
            logs += variance.ln();
            n += 1.0;
            innovations.push(innovation / variance.sqrt());
            states.push(x);
        }
        let gain = [p[0] / variance, p[1] / variance];
        x = [x[0] + gain[0] * innovation, x[1] + gain[1] * innovation];
        p = [p[0] - gain[0] * p[0], p[1] - gain[0] * p[1], p[2] - gain[1] * p[1]];
        x = [f[0][0] * x[0] + f[0][1] * x[1], f[1][0] * x[0] + f[1][1] * x[1]];
        let a = [
            [f[0][0] * p[0] + f[0][1] * p[1], f[0][0] * p[1] + f[0][1] * p[2]],
            [f[1][0] * p[0] + f[1][1] * p[1], f[1][0] * p[1] + f[1][1] * p[2]],
        ];
        p = [
            a[0][0] * f[0][0] + a[0][1] * f[0][1] + q[0],
            a[0][0] * f[1][0] + a[0][1] * f[1][1] + q[1],
            a[1][0] * f[1][0] + a[1][1] * f[1][1] + q[2],
        ];
    }
    let noise_variance = sum / n;
    let deviance = n * noise_variance.ln() + logs;
    deviance.is_finite().then_some(Run { deviance, noise_variance, innovations, states })
}

/// Cells of yaw angle on which innovations are averaged, for either direction of motion.
const CELLS: usize = 15;

/// How far the innovations' means over yaw angle and direction are from nought, in standard deviations of their sum of
/// squares: a random moment does not know the state, a missing law does.
fn state_dependence(run: &Run) -> f64 {
    let largest = run.states.iter().fold(f64::MIN_POSITIVE, |m, x| m.max(x[0].abs()));
    let power = run.innovations.iter().map(|v| v * v).sum::<f64>();
    let variance = power / run.innovations.len() as f64;
    let mut cells = [(0.0, 0.0); 2 * CELLS];
    for (v, x) in run.innovations.iter().zip(&run.states) {
        let k = ((x[0] / largest + 1.0) * 0.5 * CELLS as f64) as usize;
        let cell = &mut cells[2 * k.min(CELLS - 1) + usize::from(x[1] > 0.0)];
        *cell = (cell.0 + 1.0, cell.1 + v);
    }
    let filled: Vec<f64> =
        cells.iter().filter(|c| c.0 >= 3.0).map(|c| c.1 * c.1 / c.0 / variance).collect();
    let n = filled.len().max(1) as f64;
    (filled.iter().sum::<f64>() - n) / (2.0 * n).sqrt()
}

/// The likeliest random forcing, from the plain model's fit.
pub fn fit(swing: &Swing, plain: &Fitted) -> Option<Buffeted> {
    let noise = swing.noise_rad.powi(2);
    let wn = plain.parameters[0];
    let zero = if plain.structure.zero_unknown { plain.parameters[4] } else { 0.0 };
    let yaw: Vec<f64> = swing.yaw_rad.iter().map(|y| y - zero).collect();
    let size = (wn.powi(3) * swing.amplitude_rad.powi(2) / noise).ln();
    let at =
        |p: &[f64; 3], yaw: &[f64]| filter(&swing.grid, yaw, wn * (1.0 + p[1]), p[2], p[0].exp());
    let value = |p: &[f64; 3]| at(p, &yaw).map_or(f64::INFINITY, |run| run.deviance);
    let mut p = [size - 12.0, 0.0, plain.parameters[1]];
    for guess in [-18.0, -15.0, -9.0, -6.0] {
        let other = [size + guess, p[1], p[2]];
        if value(&other) < value(&p) {
            p = other;
        }
    }
    let p = descend(value, p, [1.0, 1e-3, 3e-3]);
    let run = at(&p, &yaw)?;
    let half = yaw.len() / 2;
    let level = |part: &[f64]| {
        let value = |l: f64| at(&[l, p[1], p[2]], part).map_or(f64::INFINITY, |run| run.deviance);
        descend(|q: &[f64; 3]| value(q[0]), p, [1.0, 0.0, 0.0])[0]
    };
    let early_over_late = (level(&yaw[..half]) - level(&yaw[half..])).exp();
    let lag: f64 = run.innovations.windows(2).map(|w| w[0] * w[1]).sum();
    let power: f64 = run.innovations.iter().map(|v| v * v).sum();
    let deviations = [0, 1, 2].map(|i| {
        let h = [0.05, 1e-5, 1e-5][i];
        let moved = |s: f64| {
            let mut q = p;
            q[i] += s * h;
            value(&q)
        };
        let curvature = (moved(1.0) - 2.0 * value(&p) + moved(-1.0)) / (h * h);
        (2.0 / curvature.max(f64::MIN_POSITIVE)).sqrt()
    });
    Some(Buffeted {
        natural_frequency_rad_s: wn * (1.0 + p[1]),
        damping_ratio: p[2],
        intensity: p[0].exp() * run.noise_variance,
        deviations: [deviations[0], deviations[1] * wn, deviations[2]],
        deviance: run.deviance,
        over_noise: (run.noise_variance / noise).sqrt(),
        correlation: lag / power,
        early_over_late,
        state_dependence: state_dependence(&run),
    })
}

/// Pattern search along the coordinates: the likelihood is cheap and has one valley here.
fn descend(f: impl Fn(&[f64; 3]) -> f64, mut p: [f64; 3], mut step: [f64; 3]) -> [f64; 3] {
    let mut here = f(&p);
    for _ in 0..400 {
        let mut moved = false;
        for i in 0..3 {
            if step[i] == 0.0 {
                continue;
            }
            let mut gained = false;
            for sign in [1.0, -1.0] {
                let mut q = p;
                q[i] += sign * step[i];
                let there = f(&q);
                if there < here {
                    (p, here, gained) = (q, there, true);
                    break;
                }
            }
            step[i] *= if gained { 1.6 } else { 0.4 };
            moved |= gained;
        }
        if !moved && step[0] < 0.01 && step[1] < 1e-6 && step[2] < 1e-6 {
            break;
        }
    }
    p
}
