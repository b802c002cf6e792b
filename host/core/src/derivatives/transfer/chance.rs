//! How often chance gives as much: chi squared and F of even degrees, for which both are finite sums. Two
//! columns, and lags of two numbers, have no others.

/// What chance does less often is not taken for chance: once in a hundred, as of repeats.
pub(super) const RARE: f64 = 0.01;

/// How often chance exceeds this chi squared of an even number of degrees of freedom.
pub(super) fn chi_squared_tail(chi_squared: f64, degrees: usize) -> f64 {
    let half = 0.5 * chi_squared.max(0.0);
    // Logarithms, for many degrees.
    let mut log_term = -half;
    let mut sum = log_term.exp();
    for j in 1..degrees / 2 {
        log_term += (half / j as f64).ln();
        sum += log_term.exp();
    }
    sum.min(1.0)
}

/// How often chance exceeds this F of an even number of degrees over another number of them.
pub(super) fn f_tail(f: f64, over: usize, under: usize) -> f64 {
    let (m, d) = (over as f64, under as f64);
    let x = d / (d + m * f.max(0.0));
    let (mut term, mut sum) = (1.0, 1.0);
    for j in 1..over / 2 {
        term *= (0.5 * d + j as f64 - 1.0) / j as f64 * (1.0 - x);
        sum += term;
    }
    (x.powf(0.5 * d) * sum).min(1.0)
}

/// A probability as a reader takes it in.
pub(super) fn in_words(probability: f64) -> String {
    match probability {
        p if p < 1e-6 => "less than once in a million".to_owned(),
        p if p < RARE => {
            let times = p.recip();
            let digit = 10f64.powf(times.log10().floor());
            format!("once in {:.0}", (times / digit).round() * digit)
        }
        p if p < 0.015 => "once in a hundred".to_owned(),
        p => format!("{:.0} times in a hundred", 100.0 * p),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Abramowitz and Stegun, tables 26.8 and 26.9.
    #[test]
    fn tails_are_those_of_the_tables() {
        for (chi, degrees, p) in [
            (9.210_34, 2, 0.01),
            (13.276_7, 4, 0.01),
            (23.684_8, 14, 0.05),
            (36.123_3, 14, 0.001),
            (124.342, 100, 0.05),
        ] {
            assert!((chi_squared_tail(chi, degrees) / p - 1.0).abs() < 1e-4, "{chi}");
        }
        for (f, over, under, p) in [
            (6.9266, 2, 12, 0.01),
            (5.9943, 4, 10, 0.01),
            (3.8853, 2, 12, 0.05),
            (99.0, 2, 2, 0.01),
        ] {
            assert!((f_tail(f, over, under) / p - 1.0).abs() < 1e-4, "{f}");
        }
        // Not lost in rounding.
        assert!((chi_squared_tail(4000.0, 4000) - 0.5).abs() < 0.01);
        assert_eq!([chi_squared_tail(1e9, 14), chi_squared_tail(0.0, 14)], [0.0, 1.0]);
        assert!((f_tail(4.0, 4, 1_000_000) - chi_squared_tail(16.0, 4)).abs() < 1e-5);
    }

    #[test]
    fn a_probability_in_words() {
        assert_eq!(in_words(0.583), "58 times in a hundred");
        assert_eq!(in_words(0.012), "once in a hundred");
        assert_eq!(in_words(0.0031), "once in 300");
        assert_eq!(in_words(1e-9), "less than once in a million");
    }
}
