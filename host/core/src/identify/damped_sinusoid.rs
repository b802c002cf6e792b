//! One damped mode in a record, as a least-squares problem.
//!
//! y(t) = e^(-s t) (a cos w t + b sin w t) + c, with s = zeta wn the decay rate and w = wn sqrt(1 - zeta^2)
//! the damped frequency. Amplitude, phase, offset, wn and zeta in other coordinates: these five are free of
//! singularities, also at zero amplitude and at negative damping.

use super::samples::Stretch;
use crate::solver::{Problem, Rows};

/// Samples handled at a time.
const SAMPLES_AT_A_TIME: usize = 128;

/// A mode with its time origin. Angles in deg.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mode {
    /// Time at which the phase and the amplitude below hold, s.
    pub origin_s: f64,
    /// Part in cos(w t) at the origin.
    pub cosine_deg: f64,
    /// Part in sin(w t) at the origin.
    pub sine_deg: f64,
    /// Mid-line of the oscillation.
    pub offset_deg: f64,
    /// zeta wn; negative for a growing oscillation.
    pub decay_rate_1_s: f64,
    /// wn sqrt(1 - zeta^2), positive.
    pub damped_frequency_rad_s: f64,
}

impl Mode {
    pub(crate) fn from_parameters(origin_s: f64, p: &[f64]) -> Self {
        let [cosine, mut sine, offset, decay, mut frequency] = numbers(p);
        if frequency < 0.0 {
            (sine, frequency) = (-sine, -frequency);
        }
        Self {
            origin_s,
            cosine_deg: cosine,
            sine_deg: sine,
            offset_deg: offset,
            decay_rate_1_s: decay,
            damped_frequency_rad_s: frequency,
        }
    }
    /// The parameters of the same motion counted from another origin.
    pub(crate) fn parameters_at(&self, origin_s: f64) -> [f64; 5] {
        let t = origin_s - self.origin_s;
        let e = (-self.decay_rate_1_s * t).exp();
        let (s, c) = (self.damped_frequency_rad_s * t).sin_cos();
        [
            e * (self.cosine_deg * c + self.sine_deg * s),
            e * (self.sine_deg * c - self.cosine_deg * s),
            self.offset_deg,
            self.decay_rate_1_s,
            self.damped_frequency_rad_s,
        ]
    }
    /// Undamped: wn.
    pub fn natural_frequency_rad_s(&self) -> f64 {
        self.damped_frequency_rad_s.hypot(self.decay_rate_1_s)
    }
    /// Negative where the oscillation grows.
    pub fn damping_ratio(&self) -> f64 {
        self.decay_rate_1_s / self.natural_frequency_rad_s()
    }
    /// Envelope of the oscillation about its offset.
    pub(crate) fn amplitude_deg(&self, time_s: f64) -> f64 {
        self.cosine_deg.hypot(self.sine_deg)
            * (-self.decay_rate_1_s * (time_s - self.origin_s)).exp()
    }
    pub(crate) fn yaw_deg(&self, time_s: f64) -> f64 {
        let [a, _, c, _, _] = self.parameters_at(time_s);
        a + c
    }
    pub(crate) fn rate_deg_s(&self, time_s: f64) -> f64 {
        let [a, b, _, s, w] = self.parameters_at(time_s);
        w * b - s * a
    }
    /// (wn, zeta) by (s, w): the matrix that carries the covariance over.
    pub(crate) fn modal_jacobian(&self) -> [[f64; 2]; 2] {
        let (s, w) = (self.decay_rate_1_s, self.damped_frequency_rad_s);
        let wn = self.natural_frequency_rad_s();
        [[s / wn, w / wn], [w * w / wn.powi(3), -s * w / wn.powi(3)]]
    }
}

/// Residuals model - record over a stretch, time counted from the stretch's first sample.
pub struct DampedSinusoid<'a> {
    /// What the mode is compared with.
    pub stretch: Stretch<'a>,
}

impl DampedSinusoid<'_> {
    /// e^(-s t) cos w t and e^(-s t) sin w t for one block. On an even grid a table of SAMPLES_AT_A_TIME
    /// powers is turned by the block's own factor: two roundings per sample and no recurrence that could
    /// drift.
    fn basis(&self, at: usize, p: &[f64], table: &Option<Table>, basis: &mut Basis) {
        let [.., decay, frequency] = numbers(p);
        let n = basis.len.min(self.stretch.len() - at);
        basis.len = n;
        let origin = self.stretch.start_s();
        if let Some(table) = table {
            let start = at as f64 * self.stretch.step_s;
            let e = (-decay * start).exp();
            let (s, c) = (frequency * start).sin_cos();
            let (re, im) = (e * c, e * s);
            for j in 0..n {
                basis.time[j] = start + j as f64 * self.stretch.step_s;
                basis.cosine[j] = re * table.cosine[j] - im * table.sine[j];
                basis.sine[j] = re * table.sine[j] + im * table.cosine[j];
            }
        } else {
            for j in 0..n {
                let t = self.stretch.time_s[at + j] - origin;
                let e = (-decay * t).exp();
                let (s, c) = (frequency * t).sin_cos();
                basis.time[j] = t;
                basis.cosine[j] = e * c;
                basis.sine[j] = e * s;
            }
        }
    }

    fn table(&self, p: &[f64]) -> Option<Table> {
        let [.., decay, frequency] = numbers(p);
        self.stretch.uniform.then(|| {
            let mut table =
                Table { cosine: [0.0; SAMPLES_AT_A_TIME], sine: [0.0; SAMPLES_AT_A_TIME] };
            for j in 0..SAMPLES_AT_A_TIME.min(self.stretch.len()) {
                let t = j as f64 * self.stretch.step_s;
                let e = (-decay * t).exp();
                let (s, c) = (frequency * t).sin_cos();
                table.cosine[j] = e * c;
                table.sine[j] = e * s;
            }
            table
        })
    }

    /// Record - model at every sample, those left out included.
    pub fn residuals_deg(&self, mode: &Mode) -> Vec<f64> {
        let p = mode.parameters_at(self.stretch.start_s());
        let [cosine, sine, offset, ..] = p;
        let table = self.table(&p);
        let mut out = Vec::with_capacity(self.stretch.len());
        let mut basis = Basis::new();
        while out.len() < self.stretch.len() {
            let at = out.len();
            basis.len = SAMPLES_AT_A_TIME;
            self.basis(at, &p, &table, &mut basis);
            for j in 0..basis.len {
                let model = cosine * basis.cosine[j] + sine * basis.sine[j] + offset;
                out.push(self.stretch.yaw_deg[at + j] - model);
            }
        }
        out
    }
}

/// a, b, c, s and w of the head's formula.
fn numbers(p: &[f64]) -> [f64; 5] {
    p.try_into().expect("five numbers")
}

struct Table {
    cosine: [f64; SAMPLES_AT_A_TIME],
    sine: [f64; SAMPLES_AT_A_TIME],
}

struct Basis {
    len: usize,
    time: [f64; SAMPLES_AT_A_TIME],
    cosine: [f64; SAMPLES_AT_A_TIME],
    sine: [f64; SAMPLES_AT_A_TIME],
}

impl Basis {
    fn new() -> Self {
        let zero = [0.0; SAMPLES_AT_A_TIME];
        Self { len: SAMPLES_AT_A_TIME, time: zero, cosine: zero, sine: zero }
    }
}

impl Problem for DampedSinusoid<'_> {
    fn parameters(&self) -> usize {
        5
    }

    fn evaluate(&self, p: &[f64], rows: &mut dyn Rows) {
        let [a, b, c, ..] = numbers(p);
        let table = self.table(p);
        let mut basis = Basis::new();
        let (mut residual, mut by_decay, mut by_frequency) =
            ([0.0; SAMPLES_AT_A_TIME], [0.0; SAMPLES_AT_A_TIME], [0.0; SAMPLES_AT_A_TIME]);
        let ones = [1.0; SAMPLES_AT_A_TIME];
        let mut at = 0;
        while at < self.stretch.len() {
            basis.len = SAMPLES_AT_A_TIME;
            self.basis(at, p, &table, &mut basis);
            let n = basis.len;
            let y = &self.stretch.yaw_deg[at..at + n];
            for j in 0..n {
                let (u, v, t) = (basis.cosine[j], basis.sine[j], basis.time[j]);
                let swing = a * u + b * v;
                residual[j] = swing + c - y[j];
                by_decay[j] = -t * swing;
                by_frequency[j] = t * (b * u - a * v);
            }
            let excluded = &self.stretch.excluded[at..at + n];
            let kept = if excluded.contains(&true) {
                let mut kept = 0;
                for j in (0..n).filter(|&j| !excluded[j]) {
                    for column in [
                        &mut residual,
                        &mut basis.cosine,
                        &mut basis.sine,
                        &mut by_decay,
                        &mut by_frequency,
                    ] {
                        column[kept] = column[j];
                    }
                    kept += 1;
                }
                kept
            } else {
                n
            };
            rows.block(
                &residual[..kept],
                &[
                    &basis.cosine[..kept],
                    &basis.sine[..kept],
                    &ones[..kept],
                    &by_decay[..kept],
                    &by_frequency[..kept],
                ],
            );
            at += n;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::samples::Samples;
    use crate::solver::check;

    fn record(jitter: f64) -> (Vec<f64>, Vec<f64>) {
        let t: Vec<f64> =
            (0..700).map(|k| 2.0 + 0.01 * (k as f64 + jitter * ((k * 7) % 5) as f64)).collect();
        let y = t.iter().map(|t| (3.1 * t).cos() + 0.4).collect();
        (t, y)
    }

    #[test]
    fn jacobian_agrees_with_differences_on_even_and_jittered_grids_with_samples_left_out() {
        for jitter in [0.0, 0.05] {
            let (t, y) = record(jitter);
            let mut samples = Samples::new(&t, &y);
            samples.exclude(5);
            samples.exclude(300);
            assert_eq!(samples.is_uniform(), jitter == 0.0);
            let problem = DampedSinusoid { stretch: samples.all() };
            for decay in [-0.1, 0.0, 0.3] {
                let error = check::jacobian_error(&problem, &[1.3, -0.4, 0.2, decay, 3.0]);
                assert!(error < 1e-7, "{error}");
            }
            assert_eq!(check::residuals(&problem, &[1.0, 0.0, 0.0, 0.0, 1.0]).len(), 698);
        }
    }

    #[test]
    fn the_table_gives_what_the_functions_give() {
        let (t, y) = record(0.0);
        let samples = Samples::new(&t, &y);
        let p = [2.0, -1.0, 0.3, 0.05, 7.1];
        let mode = Mode::from_parameters(t[0], &p);
        let residuals = DampedSinusoid { stretch: samples.all() }.residuals_deg(&mode);
        for k in 0..t.len() {
            assert!((residuals[k] - (y[k] - mode.yaw_deg(t[k]))).abs() < 1e-12);
        }
    }

    #[test]
    fn moving_the_origin_changes_nothing_and_the_rate_is_the_slope() {
        let mode = Mode::from_parameters(1.0, &[2.0, -1.0, 0.3, 0.05, 7.1]);
        let moved = Mode::from_parameters(4.0, &mode.parameters_at(4.0));
        assert!((mode.yaw_deg(6.5) - moved.yaw_deg(6.5)).abs() < 1e-12);
        let slope = (mode.yaw_deg(2.0 + 1e-5) - mode.yaw_deg(2.0 - 1e-5)) / 2e-5;
        assert!((slope - mode.rate_deg_s(2.0)).abs() < 1e-6);
    }

    #[test]
    fn modal_jacobian_agrees_with_differences() {
        let at = |s: f64, w: f64| {
            let m = Mode::from_parameters(0.0, &[1.0, 0.0, 0.0, s, w]);
            [m.natural_frequency_rad_s(), m.damping_ratio()]
        };
        let j = Mode::from_parameters(0.0, &[1.0, 0.0, 0.0, 0.4, 5.0]).modal_jacobian();
        let h = 1e-6;
        for (i, row) in j.iter().enumerate() {
            let by_decay = (at(0.4 + h, 5.0)[i] - at(0.4 - h, 5.0)[i]) / (2.0 * h);
            let by_frequency = (at(0.4, 5.0 + h)[i] - at(0.4, 5.0 - h)[i]) / (2.0 * h);
            assert!((row[0] - by_decay).abs() < 1e-8 && (row[1] - by_frequency).abs() < 1e-8);
        }
    }
}
