//! A damped sinusoid and an offset, fitted to means of a record by damped Gauss-Newton steps, a few at a
//! time.
//!
//! ```text
//! y_k = c + a Re z_k + b Im z_k,  z_k = exp((-s + i w) k),  k = 0, 1, ... the means' numbers
//! ```
//! Each step solves (J'J) d = J'r for the five parameters (Gauss-Newton; Nocedal and Wright, Numerical
//! Optimization, 2006, 10.3) and is halved until the sum of squares falls. The minimum has a neighbour for
//! each wrong count of cycles, so the first steps see the first cycles only, and each horizon is twice as
//! long as the one before. At the minimum s^2 (J'J)^-1 is the Cramer-Rao bound of a damped sinusoid in white
//! noise (Yao and Pandit, IEEE Trans. Signal Process. 43, 1995); for noise with a colour s^2 gives way to its
//! spectral density at w, which is all that the narrow columns of J see.
//!
//! A mean takes some 90 instructions in `f32`. What has to be known to a hundred-millionth, the phase after
//! hundreds of cycles and the sums over thousands of means, is in `f64`, at the ends of pieces of [`PIECE`]
//! means.

use crate::decimated::POINTS;

/// Means a call of [`Fit::work`] looks at.
pub const PIECE: usize = 64;
/// Length of the first horizon, cycles.
const FIRST_CYCLES: f64 = 3.0;
/// Fewest means that are fitted.
pub const MIN_POINTS: usize = 8;
/// Steps on a horizon that is not the last, and on the last.
const STEPS: [u8; 2] = [1, 5];
/// The last step gains less than this share of one mean's variance: a thirtieth of a standard uncertainty.
const CLOSE: f64 = 1e-3;
/// Parameters a, b, c, s, w.
const N: usize = 5;
/// The upper triangle of J'J row by row, then J'r, then r'r.
const SUMS: usize = N * (N + 1) / 2 + N + 1;

/// A complex number.
#[derive(Clone, Copy, Debug)]
struct Complex(f64, f64);

impl Complex {
    #[inline(never)]
    fn times(self, other: Self) -> Self {
        Self(self.0 * other.0 - self.1 * other.1, self.0 * other.1 + self.1 * other.0)
    }

    /// exp of it: a power series on a small part, squared up again.
    fn exp(self) -> Self {
        const SQUARINGS: u32 = 4;
        const SHARE: f64 = 1.0 / (1_u32 << SQUARINGS) as f64;
        let small = Self(self.0 * SHARE, self.1 * SHARE);
        let mut sum = Self(1.0, 0.0);
        for n in (1..=10).rev() {
            let term = small.times(sum);
            let part = 1.0 / f64::from(n);
            sum = Self(1.0 + term.0 * part, term.1 * part);
        }
        (0..SQUARINGS).fold(sum, |power, _| power.times(power))
    }
}

/// z_k along the means: exact where a piece begins, by rotation within it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Phasor {
    piece: Complex,
    per_piece: Complex,
    per_point: (f32, f32),
}

impl Phasor {
    pub(crate) const NONE: Self =
        Self { piece: Complex(0.0, 0.0), per_piece: Complex(0.0, 0.0), per_point: (0.0, 0.0) };

    #[inline(never)]
    pub(crate) fn new(decay: f64, frequency: f64) -> Self {
        let point = Complex(-decay, frequency).exp();
        let squarings = PIECE.trailing_zeros();
        let per_piece = (0..squarings).fold(point, |power, _| power.times(power));
        Self { piece: Complex(1.0, 0.0), per_piece, per_point: (point.0 as f32, point.1 as f32) }
    }

    /// At the beginning of the next piece.
    pub(crate) fn next_piece(&mut self) -> (f32, f32) {
        let begin = self.piece;
        self.piece = begin.times(self.per_piece);
        (begin.0 as f32, begin.1 as f32)
    }

    #[inline(always)]
    pub(crate) fn turn(&self, (re, im): (f32, f32)) -> (f32, f32) {
        let (c, s) = self.per_point;
        (re * c - im * s, re * s + im * c)
    }
}

/// a, b, c in units of the means; s and w per mean, rad.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameters {
    pub cosine: f64,
    pub sine: f64,
    pub offset: f64,
    pub decay: f64,
    pub frequency: f64,
}

impl Parameters {
    pub(crate) const NONE: Self =
        Self { cosine: 0.0, sine: 0.0, offset: 0.0, decay: 0.0, frequency: 0.0 };

    /// `columns` of s and w are scaled by the horizon's length.
    #[inline(never)]
    fn moved(&self, step: &[f64; N], share: f64, length: f64) -> Self {
        Self {
            cosine: self.cosine + share * step[0],
            sine: self.sine + share * step[1],
            offset: self.offset + share * step[2],
            decay: self.decay + share * step[3] / length,
            frequency: self.frequency + share * step[4] / length,
        }
    }
}

/// Sums over the means for one step.
#[derive(Clone, Copy, Debug)]
struct Sums([f64; SUMS]);

impl Sums {
    fn squares(&self) -> f64 {
        self.0[SUMS - 1]
    }

    fn gradient(&self) -> [f64; N] {
        core::array::from_fn(|i| self.0[SUMS - 1 - N + i])
    }

    /// Lower triangle of the Cholesky factor of J'J; none where its columns are not independent. Those of s
    /// and w may be left out, where nothing swings yet and they are zero.
    // By hand: with nalgebra's `inverse` a piece of the work takes 52 873 instructions of 26 000.
    #[inline(never)]
    fn factor(&self, without_swing: bool) -> Option<[[f64; N]; N]> {
        let mut l = [[0.0; N]; N];
        for i in 0..N {
            for j in 0..=i {
                // Row j of the triangle begins after j rows of N, N - 1, ...
                let whole = self.0[j * (2 * N + 1 - j) / 2 + i - j];
                let known = l[i][..j].iter().zip(&l[j]).map(|(a, b)| a * b);
                let rest = whole - known.sum::<f64>();
                if i != j {
                    l[i][j] = rest / l[j][j];
                } else if without_swing && i >= 3 {
                    l[i][i] = 1.0;
                } else if rest > 1e-9 * whole {
                    l[i][i] = libm::sqrt(rest);
                } else {
                    return None;
                }
            }
        }
        Some(l)
    }
}

/// Solves L L' x = `right`.
#[inline(never)]
fn solved(l: &[[f64; N]; N], mut right: [f64; N]) -> [f64; N] {
    for i in 0..N {
        for k in 0..i {
            right[i] -= l[i][k] * right[k];
        }
        right[i] /= l[i][i];
    }
    for i in (0..N).rev() {
        for k in i + 1..N {
            right[i] -= l[k][i] * right[k];
        }
        right[i] /= l[i][i];
    }
    right
}

/// Where a fit is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Progress {
    Going,
    Done,
    /// No minimum with an oscillation in it was found.
    Failed,
}

/// What the next call of [`Fit::work`] does; each takes some ten thousand instructions at most.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Next {
    /// Begins to look at the horizon.
    Begin,
    Look,
    /// Thinks about what it saw.
    Decide,
    /// Is at the minimum: says how well it is known.
    Finish,
}

/// A fit under way to a stretch of the means, always the same one.
#[derive(Clone, Debug)]
pub struct Fit {
    /// Length of the stretch.
    count: usize,
    horizon: usize,
    /// The best so far, with the step from it, and what is tried.
    best: Parameters,
    best_squares: f64,
    /// Variance of one mean's residual; a step that raises the sum of squares by less is no worse.
    variance: f64,
    step: [f64; N],
    share: f64,
    tried: Parameters,
    steps: u8,
    next: Next,
    /// Means of the horizon that were looked at.
    at: usize,
    phasor: Phasor,
    sums: Sums,
    covariance: [f64; 3],
}

impl Fit {
    /// None yet.
    pub const NONE: Self = Self {
        count: 0,
        horizon: 0,
        best: Parameters::NONE,
        best_squares: 0.0,
        variance: 0.0,
        step: [0.0; N],
        share: 0.0,
        tried: Parameters::NONE,
        steps: 0,
        next: Next::Begin,
        at: 0,
        phasor: Phasor::NONE,
        sums: Sums([0.0; SUMS]),
        covariance: [0.0; 3],
    };

    /// From natural frequency and decay (per mean, rad) that keep their phase for some cycles.
    pub fn new(count: usize, decay: f64, frequency: f64) -> Self {
        let first = FIRST_CYCLES * core::f64::consts::TAU / frequency;
        let horizon = (first as usize).clamp(MIN_POINTS, POINTS).min(count);
        let start = Parameters { decay, frequency, ..Parameters::NONE };
        Self {
            count,
            horizon,
            best: start,
            tried: start,
            best_squares: f64::INFINITY,
            ..Self::NONE
        }
    }

    /// Goes on by one piece of `points`, all of them at each call.
    #[inline(never)]
    pub fn work(&mut self, points: &[i16]) -> Progress {
        match self.next {
            Next::Begin => {
                self.phasor = Phasor::new(self.tried.decay, self.tried.frequency);
                self.sums = Sums([0.0; SUMS]);
                self.at = 0;
                self.next = Next::Look;
            }
            Next::Look => {
                let end = (self.at + PIECE).min(self.horizon);
                self.look(&points[self.at..end]);
                self.at = end;
                if end == self.horizon {
                    self.next = Next::Decide;
                }
            }
            Next::Decide => match self.decide() {
                Some(next) => self.next = next,
                None => return Progress::Failed,
            },
            Next::Finish => {
                return if self.finish() { Progress::Done } else { Progress::Failed };
            }
        }
        Progress::Going
    }

    /// Adds a piece to the sums.
    #[inline(never)]
    fn look(&mut self, points: &[i16]) {
        let Parameters { cosine, sine, offset, .. } = self.tried;
        let (a, b, c) = (cosine as f32, sine as f32, offset as f32);
        let per_point = 1.0 / self.horizon as f32;
        let mut t = self.at as f32 * per_point;
        let mut z = self.phasor.next_piece();
        let mut f = [0.0_f32; SUMS];
        for &point in points {
            let (re, im) = z;
            let swing = a * re + b * im;
            let r = f32::from(point) - (swing + c);
            let by_decay = -t * swing;
            let by_frequency = t * (b * re - a * im);
            f[0] += re * re;
            f[1] += re * im;
            f[2] += re;
            f[3] += re * by_decay;
            f[4] += re * by_frequency;
            f[5] += im * im;
            f[6] += im;
            f[7] += im * by_decay;
            f[8] += im * by_frequency;
            f[10] += by_decay;
            f[11] += by_frequency;
            f[12] += by_decay * by_decay;
            f[13] += by_decay * by_frequency;
            f[14] += by_frequency * by_frequency;
            f[15] += re * r;
            f[16] += im * r;
            f[17] += r;
            f[18] += by_decay * r;
            f[19] += by_frequency * r;
            f[20] += r * r;
            z = self.phasor.turn(z);
            t += per_point;
        }
        f[9] = points.len() as f32;
        for (sum, piece) in self.sums.0.iter_mut().zip(f) {
            *sum += f64::from(piece);
        }
    }

    /// What is next, after a look at the whole horizon.
    fn decide(&mut self) -> Option<Next> {
        // Without an oscillation s and w change nothing: first a, b and c alone.
        let first = self.best_squares == f64::INFINITY && self.best.cosine == 0.0;
        self.steps += 1;
        if self.sums.squares() > self.best_squares + self.variance {
            if self.steps > STEPS[1] {
                return None;
            }
            self.share *= 0.25;
        } else {
            let l = self.sums.factor(first)?;
            let gradient = self.sums.gradient();
            self.best = self.tried;
            self.step = solved(&l, gradient);
            self.share = 1.0;
            self.best_squares = self.sums.squares();
            let gain: f64 = (0..N).map(|i| self.step[i] * gradient[i]).sum();
            let freedom = self.horizon.saturating_sub(N) as f64;
            let variance = (self.best_squares - gain).max(0.0) / freedom;
            self.variance = variance;
            let last = self.horizon == self.count;
            let close = !first && gain <= CLOSE * variance;
            if last && (close || self.steps > STEPS[1]) {
                return Some(Next::Finish);
            }
            if !last && (close || self.steps > STEPS[0]) {
                self.lengthen();
                return Some(Next::Begin);
            }
        }
        self.tried = self.best.moved(&self.step, self.share, self.horizon as f64);
        Some(Next::Begin)
    }

    /// The next horizon, from one step further on this one.
    fn lengthen(&mut self) {
        self.best = self.best.moved(&self.step, self.share, self.horizon as f64);
        self.tried = self.best;
        self.best_squares = f64::INFINITY;
        self.horizon = (2 * self.horizon).min(self.count);
        self.steps = 0;
    }

    /// The last step, and how well the minimum is known; false where it is no oscillation.
    fn finish(&mut self) -> bool {
        let length = self.horizon as f64;
        self.best = self.best.moved(&self.step, 1.0, length);
        let Some(l) = self.sums.factor(false) else { return false };
        // The inverse of L L' is in its last two rows and columns that of L's own last two.
        let variance = self.variance / (length * length);
        let across = l[4][3] / l[3][3];
        let ww = variance / (l[4][4] * l[4][4]);
        self.covariance = [variance / (l[3][3] * l[3][3]) + across * across * ww, -across * ww, ww];
        // Half a cycle at least, and no more than half of one in a mean.
        let half = core::f64::consts::PI;
        self.best.frequency * length > half && self.best.frequency < half
    }

    /// The best there is.
    pub fn parameters(&self) -> &Parameters {
        &self.best
    }

    /// At the minimum: covariance of s and w (ss, sw, ww; per mean, rad) for a white residual.
    pub fn covariance(&self) -> [f64; 3] {
        self.covariance
    }
}

#[cfg(test)]
mod tests;
