//! The curves of a measured law: natural cubic splines through values at knots, from zero on.

use nalgebra::{DMatrix, DVector};

/// Knots of each curve besides zero.
pub(crate) const KNOTS: usize = 10;
/// Rates at which damping is asked for lie nearer at small rates, where friction bends it.
const RATE_POWER: i32 = 2;
const YAW_POWER: i32 = 1;
/// Power of the distance between knots with which a bend there costs: where knots are near, the law may bend.
const LOCAL: f64 = 2.5;
/// Least distance between knots that are moved to where a law bends, as a share of the mean.
const NEAREST_KNOTS: f64 = 0.1;
/// Density of knots: the curvature to this power, and a share of the mean everywhere.
const CURVATURE_POWER: f64 = 0.5;
const EVERYWHERE: f64 = 0.2;

/// Where a curve's values are given, as shares of the largest yaw angle or rate; the last is 1.
pub type Knots = [f64; KNOTS];

/// A curve of a measured law.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// k: restoring moment, the same on both sides.
    Stiffness,
    /// e: restoring moment that differs from side to side.
    UnevenStiffness,
    /// d: dissipation, the same both ways.
    Damping,
    /// u: dissipation that differs from way to way.
    UnevenDamping,
}

impl Part {
    /// In the order in which a law's parameters and knots are kept.
    pub const ALL: [Self; 4] =
        [Self::Stiffness, Self::UnevenStiffness, Self::Damping, Self::UnevenDamping];

    /// As files write it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Stiffness => "stiffness",
            Self::UnevenStiffness => "uneven_stiffness",
            Self::Damping => "damping",
            Self::UnevenDamping => "uneven_damping",
        }
    }

    pub(super) fn letter(self) -> char {
        match self {
            Self::Stiffness => 'k',
            Self::UnevenStiffness => 'e',
            Self::Damping => 'd',
            Self::UnevenDamping => 'u',
        }
    }

    pub(crate) fn is_of_yaw(self) -> bool {
        matches!(self, Self::Stiffness | Self::UnevenStiffness)
    }

    /// Knots where nothing is known of where the law bends.
    pub fn even_knots(self) -> Knots {
        let power = if self.is_of_yaw() { YAW_POWER } else { RATE_POWER };
        std::array::from_fn(|k| rounded(((k + 1) as f64 / KNOTS as f64).powi(power)))
    }

    /// Of the same sign as yaw angle or rate.
    pub(crate) fn is_odd(self) -> bool {
        matches!(self, Self::Stiffness | Self::Damping)
    }
}

/// A curve's knots on [0, 1] and the slopes that a natural spline through values there has.
#[derive(Clone, Debug)]
pub(super) struct Shape {
    /// With zero.
    knots: [f64; KNOTS + 1],
    /// From values at all knots but the first, where the curve is zero, to slopes at all.
    slopes: DMatrix<f64>,
    flat_at_zero: bool,
}

impl Shape {
    pub(super) fn new(part: Part, at: &Knots) -> Self {
        let flat_at_zero = part != Part::UnevenStiffness;
        let mut knots = [0.0; KNOTS + 1];
        knots[1..].copy_from_slice(at);
        let n = KNOTS;
        let h = |i: usize| knots[i + 1] - knots[i];
        // Slopes m from continuity of the second derivative: A m = B v.
        let mut a = DMatrix::<f64>::zeros(n + 1, n + 1);
        let mut b = DMatrix::<f64>::zeros(n + 1, n);
        let mut value = |row: usize, knot: usize, x: f64| {
            if knot > 0 {
                b[(row, knot - 1)] += x;
            }
        };
        for i in 1..n {
            a[(i, i - 1)] = 1.0 / h(i - 1);
            a[(i, i)] = 2.0 / h(i - 1) + 2.0 / h(i);
            a[(i, i + 1)] = 1.0 / h(i);
            value(i, i - 1, -3.0 / h(i - 1).powi(2));
            value(i, i, 3.0 / h(i - 1).powi(2) - 3.0 / h(i).powi(2));
            value(i, i + 1, 3.0 / h(i).powi(2));
        }
        if flat_at_zero {
            a[(0, 0)] = 1.0;
        } else {
            (a[(0, 0)], a[(0, 1)]) = (2.0, 1.0);
            value(0, 1, 3.0 / h(0));
        }
        (a[(n, n - 1)], a[(n, n)]) = (1.0, 2.0);
        value(n, n - 1, -3.0 / h(n - 1));
        value(n, n, 3.0 / h(n - 1));
        let slopes = a.lu().solve(&b).expect("a diagonally dominant matrix");
        Self { knots, slopes, flat_at_zero }
    }

    /// Rows whose squares add up to the integral of the squared second derivative, less where knots are near.
    pub(super) fn roughness(&self) -> DMatrix<f64> {
        let n = KNOTS;
        let x = |i: usize| self.knots[i];
        let mut rows = DMatrix::zeros(n, n);
        for i in 1..n {
            let (back, ahead) = (x(i) - x(i - 1), x(i + 1) - x(i));
            let between = 0.5 * (back + ahead);
            let w = between.sqrt() / between * local(between);
            rows[(i, i)] = w / ahead;
            rows[(i, i - 1)] = -w * (1.0 / ahead + 1.0 / back);
            if i > 1 {
                rows[(i, i - 2)] = w / back;
            }
        }
        let first = x(1);
        // Flat at zero: the curve's mirror image goes on. Else only its size is held, weakly.
        rows[(0, if self.flat_at_zero { 0 } else { n - 1 })] = match self.flat_at_zero {
            true => 2.0 / (first * first) * (0.5 * first).sqrt() * local(first),
            false => 1.0,
        };
        rows
    }

    pub(super) fn curve(&self, values: &[f64], reach: f64) -> Curve {
        let slopes = &self.slopes * DVector::from_column_slice(values);
        let at = |k: usize| if k == 0 { 0.0 } else { values[k - 1] };
        let mut pieces = [[0.0; 4]; KNOTS];
        for (k, piece) in pieces.iter_mut().enumerate() {
            let h = self.knots[k + 1] - self.knots[k];
            let (rise, m0, m1) = (at(k + 1) - at(k), h * slopes[k], h * slopes[k + 1]);
            *piece = [at(k), m0, 3.0 * rise - 2.0 * m0 - m1, m0 + m1 - 2.0 * rise];
        }
        let scale = reach.recip();
        Curve { edges: self.knots, pieces, end_slope: slopes[KNOTS], scale }
    }

    /// The curve through `values`, up to `reach`, as powers: slope and half the second derivative at zero,
    /// and for each knot (its place first) a sixth of the third derivative's jump there.
    pub(super) fn powers(&self, values: &[f64], reach: f64) -> ([f64; 2], [(f64, f64); KNOTS + 1]) {
        let pieces = self.curve(values, reach).pieces;
        let h = |k: usize| (self.knots[k + 1] - self.knots[k]) * reach;
        let mut before = 0.0;
        let jump = |k: usize| {
            let third = pieces.get(k).map_or(0.0, |piece| piece[3] / h(k).powi(3));
            let jump = third - before;
            before = third;
            (self.knots[k] * reach, jump)
        };
        let [_, slope, bend, _] = pieces[0];
        ([slope / h(0), bend / h(0).powi(2)], std::array::from_fn(jump))
    }

    /// Knots that lie nearer where the curve through `values` bends.
    pub(super) fn bent(&self, values: &[f64]) -> Knots {
        let slopes = &self.slopes * DVector::from_column_slice(values);
        let width = |k: usize| self.knots[k + 1] - self.knots[k];
        let bends: Vec<f64> = (0..KNOTS)
            .map(|k| ((slopes[k + 1] - slopes[k]).abs() / width(k)).powf(CURVATURE_POWER))
            .collect();
        let mean = bends.iter().enumerate().map(|(k, b)| b * width(k)).sum::<f64>();
        let density: Vec<f64> = bends.iter().map(|b| b + EVERYWHERE * mean).collect();
        let mut share = vec![0.0];
        for (k, d) in density.iter().enumerate() {
            share.push(share[k] + d * width(k));
        }
        let all = share[KNOTS];
        if all <= 0.0 {
            return std::array::from_fn(|k| self.knots[k + 1]);
        }
        let mut out = [1.0; KNOTS];
        let mut k = 0;
        for (i, out) in out.iter_mut().enumerate().take(KNOTS - 1) {
            let wanted = (i + 1) as f64 / KNOTS as f64 * all;
            while share[k + 1] < wanted {
                k += 1;
            }
            *out = self.knots[k] + (wanted - share[k]) / density[k];
        }
        apart(out)
    }
}

/// Weight of a bend where knots are `between` apart, as a factor on a row.
fn local(between: f64) -> f64 {
    (between * KNOTS as f64).powf(0.5 * LOCAL)
}

/// A place that files hold in few digits.
fn rounded(x: f64) -> f64 {
    (1e4 * x).round() / 1e4
}

/// Knots that are too near to each other moved apart.
fn apart(mut knots: Knots) -> Knots {
    let least = NEAREST_KNOTS / KNOTS as f64;
    let mut before = 0.0;
    for x in &mut knots {
        *x = x.max(before + least);
        before = *x;
    }
    knots[KNOTS - 1] = 1.0;
    for k in (0..KNOTS - 1).rev() {
        knots[k] = rounded(knots[k].min(knots[k + 1] - least));
    }
    knots
}

/// A spline with its numbers.
#[derive(Clone, Debug)]
pub(super) struct Curve {
    edges: [f64; KNOTS + 1],
    pieces: [[f64; 4]; KNOTS],
    end_slope: f64,
    scale: f64,
}

impl Curve {
    #[inline]
    pub(super) fn at(&self, size: f64) -> f64 {
        let x = size * self.scale;
        if x >= 1.0 {
            let [a, b, c, d] = self.pieces[KNOTS - 1];
            return a + b + c + d + self.end_slope * (x - 1.0);
        }
        let k: usize = self.edges[1..KNOTS].iter().map(|edge| usize::from(x >= *edge)).sum();
        let t = (x - self.edges[k]) / (self.edges[k + 1] - self.edges[k]);
        let [a, b, c, d] = self.pieces[k];
        a + t * (b + t * (c + t * d))
    }
}

/// The curves of a measured law with their numbers, as the integration follows them.
#[derive(Clone, Debug)]
pub(crate) struct Curves(pub(super) Vec<(Part, Curve)>);

impl Curves {
    /// What the law adds to b'' but for its friction, rad/s2.
    #[inline]
    pub(crate) fn moment(&self, yaw_rad: f64, rate_rad_s: f64) -> f64 {
        let moment = |(part, curve): &(Part, Curve)| {
            let x = if part.is_of_yaw() { yaw_rad } else { rate_rad_s };
            let size = curve.at(x.abs());
            if part.is_odd() && x < 0.0 {
                size
            } else {
                -size
            }
        };
        self.0.iter().map(moment).sum()
    }
}
