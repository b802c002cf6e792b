//! Matrix pencil: poles of a short, evenly sampled stretch without a start value.
//!
//! Y. Hua, T. K. Sarkar, "Matrix pencil method for estimating parameters of exponentially damped/undamped
//! sinusoids in noise", IEEE Trans. ASSP 38 (1990). Statistically near the information limit for few cycles,
//! which makes it a start for least squares, not the answer.

use nalgebra::DMatrix;

/// One pole e^(s T) as its decay rate -Re s (1/s) and frequency Im s (rad/s).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Pole {
    pub(crate) decay_rate_1_s: f64,
    pub(crate) frequency_rad_s: f64,
}

/// Oscillating poles of a constant plus so many damped sinusoids in `values`, sampled every `step_s`.
/// Empty where the stretch is too short or holds no oscillation.
pub(crate) fn poles(values: &[f64], step_s: f64, modes: usize) -> Vec<Pole> {
    // A pair of poles for each mode and a real one for the offset.
    let most = 2 * modes + 1;
    let n = values.len();
    let pencil = n / 2;
    if pencil < most || n - pencil < most {
        return Vec::new();
    }
    let hankel = DMatrix::from_fn(n - pencil, pencil + 1, |i, j| values[i + j]);
    // The right singular vectors from the small Gram matrix: squared conditioning is no harm to a start.
    let eigen = (hankel.transpose() * &hankel).symmetric_eigen();
    let mut order: Vec<usize> = (0..=pencil).collect();
    order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
    let signal = eigen.eigenvectors.select_columns(&order[..most]);
    let (upper, lower) = (signal.rows(0, pencil), signal.rows(1, pencil));
    let Some(inverse) = (upper.transpose() * upper).try_inverse() else { return Vec::new() };
    let shift = inverse * upper.transpose() * lower;
    shift
        .complex_eigenvalues()
        .iter()
        .filter(|z| z.im > 1e-9 && z.norm() > 0.0)
        .map(|z| Pole {
            decay_rate_1_s: -z.norm().ln() / step_s,
            frequency_rad_s: z.arg() / step_s,
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pole_is_found_with_its_sign_of_damping() {
        for decay in [-0.2, 0.0, 0.3] {
            let y: Vec<f64> = (0..48)
                .map(|k| {
                    let t = k as f64 * 0.04;
                    (-decay * t).exp() * (9.0 * t + 0.3).cos() * 5.0 + 1.5
                })
                .collect();
            let poles = poles(&y, 0.04, 1);
            assert_eq!(poles.len(), 1);
            assert!((poles[0].decay_rate_1_s - decay).abs() < 1e-5, "{poles:?}");
            assert!((poles[0].frequency_rad_s - 9.0).abs() < 1e-5, "{poles:?}");
        }
    }

    #[test]
    fn too_short_a_stretch_has_no_poles() {
        assert!(poles(&[1.0, 2.0, 1.0, 2.0], 0.1, 1).is_empty());
    }
}
