//! The wind's moment as one causal function of the yaw angle: a rational function of s' = s l / V (K. L. Roger,
//! AGARD CP-228, 1977; M. Karpel, J. Aircraft 19, 1982).

/// s' of a free oscillation, real and imaginary part: -zeta wn l / V and its damped frequency times l / V.
pub(super) type Motion = [f64; 2];

/// Cn(s') = a0 + a1 s' + sum of a s' / (s' + b) over the lags.
///
/// As a list of numbers: a0, a1, and of each lag a and ln b.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Cause {
    pub(super) a0: f64,
    pub(super) a1: f64,
    /// a and b of each.
    pub(super) lags: Vec<[f64; 2]>,
}

impl Cause {
    pub(super) fn new(numbers: &[f64]) -> Self {
        let lags = numbers[2..].chunks_exact(2).map(|lag| [lag[0], lag[1].exp()]).collect();
        Self { a0: numbers[0], a1: numbers[1], lags }
    }

    /// Cn_beta and Cn_r of a motion, and what each of the numbers does to them.
    ///
    /// Two real numbers stand for Cn at s' as Cn_beta + Cn_r s'. Of a lag, s' / (s' + b) = (|s'|^2 + b s') /
    /// |s' + b|^2: without decay, at s' = i k, these are k^2 / (k^2 + b^2) and b / (k^2 + b^2).
    pub(super) fn columns(&self, [re, im]: Motion) -> ([f64; 2], Vec<[f64; 2]>) {
        let square = re * re + im * im;
        let mut values = [self.a0, self.a1];
        let mut slopes = vec![[1.0, 0.0], [0.0, 1.0]];
        for &[a, b] in &self.lags {
            let under = (re + b).powi(2) + im * im;
            let of_a = [square / under, b / under];
            let by_b = 2.0 * (re + b) / under;
            slopes.push(of_a);
            slopes.push([-a * b * of_a[0] * by_b, a * b * (1.0 / under - of_a[1] * by_b)]);
            values = [values[0] + a * of_a[0], values[1] + a * of_a[1]];
        }
        (values, slopes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// In complex numbers, by hand: (x + iy) / (u + iv).
    fn over([x, y]: [f64; 2], [u, v]: [f64; 2]) -> [f64; 2] {
        let under = u * u + v * v;
        [(x * u + y * v) / under, (y * u - x * v) / under]
    }

    #[test]
    fn two_real_numbers_stand_for_the_function_of_a_motion_that_decays() {
        let cause = Cause { a0: 0.5, a1: -0.125, lags: vec![[-0.09, 0.55], [0.03, 2.0]] };
        for [re, im] in [[0.0, 0.3], [-0.05, 0.9], [0.02, 1.4]] {
            let lags = cause.lags.iter().map(|&[a, b]| over([a * re, a * im], [re + b, im]));
            let whole = lags.fold([0.5 - 0.125 * re, -0.125 * im], |sum, lag| {
                [sum[0] + lag[0], sum[1] + lag[1]]
            });
            let ([cn_beta, cn_r], _) = cause.columns([re, im]);
            assert!((cn_beta + cn_r * re - whole[0]).abs() < 1e-14);
            assert!((cn_r * im - whole[1]).abs() < 1e-14);
        }
        let one = Cause { lags: vec![[-0.09, 0.55]], ..cause };
        let k = 0.8f64;
        let ([cn_beta, cn_r], _) = one.columns([0.0, k]);
        assert!((cn_beta - (0.5 - 0.09 * k * k / (k * k + 0.3025))).abs() < 1e-15);
        assert!((cn_r - (-0.125 - 0.09 * 0.55 / (k * k + 0.3025))).abs() < 1e-15);
    }

    #[test]
    fn slopes_are_those_of_finite_changes() {
        let numbers = [0.5, -0.125, -0.09, 0.55f64.ln(), 0.03, 2f64.ln()];
        let motion = [-0.04, 0.7];
        let (_, slopes) = Cause::new(&numbers).columns(motion);
        for (i, slope) in slopes.iter().enumerate() {
            let changed = |by: f64| {
                let mut numbers = numbers;
                numbers[i] += by;
                Cause::new(&numbers).columns(motion).0
            };
            let (up, down) = (changed(1e-6), changed(-1e-6));
            for c in 0..2 {
                assert!(((up[c] - down[c]) / 2e-6 - slope[c]).abs() < 1e-9, "{i} {c}");
            }
        }
    }
}
