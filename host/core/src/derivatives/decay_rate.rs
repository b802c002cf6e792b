//! The decay rate zeta wn of one spring and axis against wind speed and amplitude: one linear law by
//! generalised least squares.

use crate::quantity::Quantity;
use crate::statistics::rare_chi_squared;
use nalgebra::{DMatrix, DVector};

/// A decay rate as some cycles of a release have it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sample {
    pub(super) wind_speed_m_s: f64,
    /// Of its condition: repeats share the tunnel's error.
    pub(super) wind_speed_u_m_s: f64,
    /// Means of the amplitude and of its square.
    pub(super) amplitude: [f64; 2],
    pub(super) rate_1_s: Quantity,
    /// Which release and condition it is of.
    pub(super) release: usize,
    pub(super) condition: usize,
    /// Standard deviation between releases of one condition beyond their own uncertainty, 1/s.
    pub(super) repeatability_1_s: f64,
}

/// By which power of the amplitude the decay rate grows, and whether that is the rig's or the wind's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Growth {
    pub(super) power: usize,
    pub(super) is_of_wind: bool,
}

/// sigma = s0 + s1 V (+ s2 V^2) (+ c A^p or c V A^p).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Form {
    pub(super) is_curved: bool,
    pub(super) growth: Option<Growth>,
}

impl Form {
    fn row(self, speed: f64, amplitude: [f64; 2]) -> DVector<f64> {
        let mut row = vec![1.0, speed];
        row.extend(self.is_curved.then_some(speed * speed));
        let of_growth = |g: Growth| amplitude[g.power - 1] * if g.is_of_wind { speed } else { 1.0 };
        row.extend(self.growth.map(of_growth));
        DVector::from_vec(row)
    }

    /// Its terms as they are written.
    pub(super) fn terms(self) -> Vec<&'static str> {
        let mut terms = vec!["1", "V"];
        terms.extend(self.is_curved.then_some("V^2"));
        terms.extend(self.growth.map(|growth| match (growth.power, growth.is_of_wind) {
            (1, false) => "A",
            (1, true) => "V A",
            (_, false) => "A^2",
            (_, true) => "V A^2",
        }));
        terms
    }
}

/// A form with its coefficients.
#[derive(Clone, Debug)]
pub(super) struct DecayRate {
    pub(super) form: Form,
    coefficients: DVector<f64>,
    /// Widened where the samples scatter about the law by more than chance.
    covariance: DMatrix<f64>,
    chi_squared: f64,
    degrees: f64,
}

/// Standard uncertainties off zero from which on a coefficient counts.
const SEEN: f64 = 2.0;

impl DecayRate {
    /// The form that the samples ask for: growth with amplitude where they show it, by whatever of the four
    /// growths leaves least; a parabola over the wind's speed where they refuse a straight line and four
    /// speeds allow it.
    pub(super) fn new(samples: &[Sample], speeds: usize) -> Option<Self> {
        let line = Form { is_curved: false, growth: None };
        let grown = [(1, false), (1, true), (2, false), (2, true)].map(|(power, is_of_wind)| {
            Self::fitted(samples, Form { growth: Some(Growth { power, is_of_wind }), ..line })
        });
        let best =
            grown.into_iter().flatten().min_by(|a, b| a.chi_squared.total_cmp(&b.chi_squared));
        let is_seen = |law: &Self| law.growth().is_some_and(|c| c.value.abs() >= SEEN * c.u);
        let straight = best.filter(is_seen).or_else(|| Self::fitted(samples, line))?;
        if !straight.is_refused() || speeds < 4 {
            return Some(straight);
        }
        let curved = Self::fitted(samples, Form { is_curved: true, ..straight.form });
        let is_better = |curved: &Self| {
            let scatter = (curved.chi_squared / curved.degrees).max(1.0);
            straight.chi_squared - curved.chi_squared > scatter * rare_chi_squared(1.0)
        };
        curved.filter(is_better).or(Some(straight))
    }

    /// This form through the samples: once for its slope, with which the wind speeds' uncertainties count, and
    /// once with them.
    pub(super) fn fitted(samples: &[Sample], form: Form) -> Option<Self> {
        let first = Self::with_slope(samples, form, |_| 0.0)?;
        Self::with_slope(samples, form, |speed| first.slope(speed))
    }

    fn with_slope(samples: &[Sample], form: Form, slope: impl Fn(f64) -> f64) -> Option<Self> {
        let n = samples.len();
        let shared = |i: usize, j: usize| {
            let (a, b) = (&samples[i], &samples[j]);
            let of_wind = |s: &Sample| slope(s.wind_speed_m_s) * s.wind_speed_u_m_s;
            let mut shared = 0.0;
            if a.condition == b.condition {
                shared += of_wind(a) * of_wind(b);
            }
            if a.release == b.release {
                shared += a.repeatability_1_s * b.repeatability_1_s;
            }
            if i == j {
                shared += a.rate_1_s.u.powi(2);
            }
            shared
        };
        let width = form.row(0.0, [0.0; 2]).len();
        let rows = DMatrix::from_fn(n, width, |i, k| {
            form.row(samples[i].wind_speed_m_s, samples[i].amplitude)[k]
        });
        let rates = DVector::from_fn(n, |i, _| samples[i].rate_1_s.value);
        let factor = DMatrix::from_fn(n, n, shared).cholesky()?.l();
        let (rows, rates) =
            (factor.solve_lower_triangular(&rows)?, factor.solve_lower_triangular(&rates)?);
        let covariance = (rows.transpose() * &rows).cholesky()?.inverse();
        let coefficients = &covariance * rows.transpose() * &rates;
        let chi_squared = (rates - rows * &coefficients).norm_squared();
        let degrees = n.checked_sub(width).filter(|degrees| *degrees > 0)? as f64;
        let mut law = Self { form, coefficients, covariance, chi_squared, degrees };
        if law.is_refused() {
            law.covariance *= chi_squared / degrees;
        }
        Some(law)
    }

    fn is_refused(&self) -> bool {
        self.chi_squared > rare_chi_squared(self.degrees)
    }

    /// c, where there is one.
    pub(super) fn growth(&self) -> Option<Quantity> {
        let last = self.coefficients.len() - 1;
        let u = self.covariance[(last, last)].sqrt();
        self.form.growth.map(|_| Quantity::new(self.coefficients[last], u))
    }

    /// Whether it grows with amplitude beyond its uncertainty.
    pub(super) fn is_seen_to_grow(&self) -> bool {
        self.growth().is_some_and(|c| c.value >= SEEN * c.u)
    }

    /// By the wind's speed, at rest.
    pub(super) fn slope(&self, speed: f64) -> f64 {
        let curve = if self.form.is_curved { 2.0 * speed * self.coefficients[2] } else { 0.0 };
        self.coefficients[1] + curve
    }

    /// At this wind speed and amplitude, 1/s.
    pub(super) fn at(&self, speed: f64, amplitude_deg: f64) -> Quantity {
        let row = self.form.row(speed, [amplitude_deg, amplitude_deg.powi(2)]);
        let u = (row.transpose() * &self.covariance * &row)[0].sqrt();
        Quantity::new(row.dot(&self.coefficients), u)
    }

    /// The amplitude at which it is zero at this wind speed; `None` where it is not negative at rest or not
    /// seen to grow.
    pub(super) fn limit_cycle_deg(&self, speed: f64) -> Option<Quantity> {
        let (growth, c) = self.form.growth.zip(self.growth())?;
        let c = if growth.is_of_wind { c.value * speed } else { c.value };
        let at_rest = self.at(speed, 0.0).value;
        if !self.is_seen_to_grow() || at_rest >= 0.0 {
            return None;
        }
        let power = growth.power as f64;
        let amplitude = (-at_rest / c).powf(power.recip());
        let by_amplitude = power * c * amplitude.powf(power - 1.0);
        Some(Quantity::new(amplitude, self.at(speed, amplitude).u / by_amplitude))
    }
}
