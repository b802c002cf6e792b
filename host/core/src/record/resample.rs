//! A cubic spline through irregular samples, read at a uniform rate.
//!
//! Reference: C. de Boor, "A Practical Guide to Splines" (1978), chapter IV: slopes from a tridiagonal
//! system, the third derivative continuous at the second and the last but one sample (not-a-knot).

/// Time stamps and values at `rate_hz`, starting at the first sample. At least four samples.
pub(crate) fn uniform(time: &[f64], value: &[f64], rate_hz: f64) -> (Vec<f64>, Vec<f64>) {
    let slopes = slopes(time, value);
    let start = time[0];
    // The last step may fall short of the end by a rounding error.
    let count = ((time[time.len() - 1] - start) * rate_hz + 1e-6).floor() as usize + 1;
    let mut interval = 0;
    (0..count)
        .map(|i| {
            let t = start + i as f64 / rate_hz;
            while interval + 2 < time.len() && time[interval + 1] <= t {
                interval += 1;
            }
            let k = interval;
            let h = time[k + 1] - time[k];
            let (u, rise) = ((t - time[k]) / h, value[k + 1] - value[k]);
            let (a, b) = (h * slopes[k] - rise, rise - h * slopes[k + 1]);
            (t, value[k] + u * (rise + (1.0 - u) * ((1.0 - u) * a + u * b)))
        })
        .unzip()
}

/// The spline's slope at every sample.
fn slopes(time: &[f64], value: &[f64]) -> Vec<f64> {
    let n = time.len();
    let h = |k: usize| time[k + 1] - time[k];
    let chord = |k: usize| (value[k + 1] - value[k]) / h(k);
    let mut upper = vec![0.0; n];
    let mut slope = vec![0.0; n];
    let (h0, h1) = (h(0), h(1));
    let edge = |near: f64, next: f64, near_chord: f64, next_chord: f64| {
        let both = near + next;
        ((near + 2.0 * both) * next * near_chord + near * near * next_chord) / both
    };
    upper[0] = (h0 + h1) / h1;
    slope[0] = edge(h0, h1, chord(0), chord(1)) / h1;
    for k in 1..n - 1 {
        let (before, after) = (h(k - 1), h(k));
        let pivot = 2.0 * (before + after) - after * upper[k - 1];
        upper[k] = before / pivot;
        slope[k] =
            (3.0 * (after * chord(k - 1) + before * chord(k)) - after * slope[k - 1]) / pivot;
    }
    let (last, previous) = (h(n - 2), h(n - 3));
    let lower = last + previous;
    let pivot = previous - lower * upper[n - 2];
    slope[n - 1] =
        (edge(last, previous, chord(n - 2), chord(n - 3)) - lower * slope[n - 2]) / pivot;
    for k in (0..n - 1).rev() {
        slope[k] -= upper[k] * slope[k + 1];
    }
    slope
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A cubic comes back exactly, ends included, from irregular samples: the spline and its ends are right.
    #[test]
    fn a_cubic_is_its_own_spline() {
        let cubic = |t: f64| 1.0 - 2.0 * t + 3.0 * t * t - 0.5 * t * t * t;
        let time: Vec<f64> = (0..20).map(|i| f64::from(i) + 0.3 * f64::from(i % 3)).collect();
        let value: Vec<f64> = time.iter().map(|t| cubic(*t)).collect();
        let (t, v) = uniform(&time, &value, 10.0);
        assert_eq!(t.len(), 194);
        for (t, v) in t.iter().zip(v) {
            assert!((v - cubic(*t)).abs() < 1e-9 * (1.0 + cubic(*t).abs()), "at {t}");
        }
    }

    /// The documented error for a sinusoid, at the rig's fastest mode and at a slow one, 20 Hz both.
    #[test]
    fn error_of_a_sinusoid_at_20_hz() {
        for f in [4.2, 1.25] {
            // Gain lost at f and images at 20 - f and 20 + f Hz, to leading order of the spline's response.
            let images = (f / (20.0f64 - f)).powi(4) + (f / (20.0 + f)).powi(4);
            let bound = 2.05 * images;
            let w = 2.0 * std::f64::consts::PI * f;
            let time: Vec<f64> = (0..400).map(|i| f64::from(i) * 0.05).collect();
            let value: Vec<f64> = time.iter().map(|t| (w * t).sin()).collect();
            let (t, v) = uniform(&time, &value, 1000.0);
            let worst = t
                .iter()
                .zip(v)
                .filter(|(t, _)| **t > 1.0 && **t < 19.0)
                .map(|(t, v)| (v - (w * t).sin()).abs())
                .fold(0.0, f64::max);
            println!("{f} Hz at 20 Hz: worst error {worst:.2e} of the amplitude");
            assert!(worst < bound, "{f} Hz: {worst} above {bound}");
        }
    }

    #[test]
    fn samples_on_the_grid_stay_as_they_are() {
        let time: Vec<f64> = (0..500).map(|i| f64::from(i) * 1e-3).collect();
        let value: Vec<f64> = time.iter().map(|t| (9.0 * t).cos()).collect();
        let (t, v) = uniform(&time, &value, 1000.0);
        assert_eq!(t.len(), 500);
        for (a, b) in v.iter().zip(&value) {
            assert!((a - b).abs() < 1e-12);
        }
    }
}
