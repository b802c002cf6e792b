//! Whether wn or zeta changes with amplitude: the first sign of a missing effect.

use super::windows::Window;
use super::OneMode;

/// How many standard uncertainties a slope must differ from zero: windows are few and their uncertainties
/// estimates.
const SIGNIFICANT: f64 = 5.0;

/// Spread over the windows (weighted standard deviation) of what changes with amplitude; `None` where it does
/// not.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Trends {
    /// rad/s.
    pub(super) frequency: Option<f64>,
    pub(super) damping: Option<f64>,
}

impl Trends {
    /// `one` mode with uncertainties that hold the spread over the windows of what changes with amplitude.
    pub(super) fn holding(&self, mut one: OneMode) -> OneMode {
        let OneMode { natural_frequency_rad_s: wn, damping_ratio: zeta, lacking } = &mut one;
        let spreads = [
            (&mut wn.u, &mut lacking.natural_frequency_rad_s, self.frequency),
            (&mut zeta.u, &mut lacking.damping_ratio, self.damping),
        ];
        for (u, lacking, spread) in spreads {
            let more = spread.map_or(0.0, |spread| spread * spread - *u * *u).max(0.0).sqrt();
            (*u, *lacking) = (u.hypot(more), lacking.hypot(more));
        }
        one
    }
}

pub(super) fn of(windows: &[Window]) -> Trends {
    let spread = |value: fn(&Window) -> (f64, f64)| {
        let points: Vec<(f64, f64, f64)> = windows
            .iter()
            .map(|w| (w.amplitude_deg, value(w)))
            .filter(|(_, (_, u))| *u > 0.0 && u.is_finite())
            .map(|(a, (v, u))| (a, v, u.powi(-2)))
            .collect();
        significant_spread(&points)
    };
    Trends {
        frequency: spread(|w| (w.natural_frequency_rad_s, w.natural_frequency_u)),
        damping: spread(|w| (w.damping_ratio, w.damping_ratio_u)),
    }
}

/// Weighted regression on amplitude of (amplitude, value, weight = 1/u^2); the spread beyond the windows' own
/// noise where the slope is significant.
fn significant_spread(points: &[(f64, f64, f64)]) -> Option<f64> {
    let weight: f64 = points.iter().map(|p| p.2).sum();
    let mean = |f: &dyn Fn(&(f64, f64, f64)) -> f64| {
        points.iter().map(|p| p.2 * f(p)).sum::<f64>() / weight
    };
    let (x0, y0) = (mean(&|p| p.0), mean(&|p| p.1));
    let xx = mean(&|p| (p.0 - x0).powi(2));
    let xy = mean(&|p| (p.0 - x0) * (p.1 - y0));
    let yy = mean(&|p| (p.1 - y0).powi(2));
    // The slope xy/xx is known to 1/sqrt(weight xx).
    let significant = points.len() > 1 && xy.abs() * (weight / xx).sqrt() > SIGNIFICANT;
    let noise = points.len() as f64 / weight;
    significant.then(|| (yy - noise).max(xy * xy / xx).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn windows(damping: impl Fn(f64) -> f64) -> Vec<Window> {
        (1..=10)
            .map(|k| {
                let amplitude_deg = f64::from(k);
                Window {
                    from_s: 0.0,
                    to_s: 1.0,
                    amplitude_deg,
                    midline_deg: 0.0,
                    midline_u_deg: 0.01,
                    natural_frequency_rad_s: 7.5 + 0.001 * f64::from(k % 2),
                    natural_frequency_u: 0.001,
                    damping_ratio: damping(amplitude_deg),
                    damping_ratio_u: 0.001,
                    noise_deg: 0.1,
                    noise_near_deg: 0.1,
                    motion_deg: 5.0,
                }
            })
            .collect()
    }

    #[test]
    fn what_changes_with_amplitude_has_a_spread_and_what_scatters_has_none() {
        let trends = of(&windows(|a| 0.01 + 0.002 * a));
        // Standard deviation of 1..=10 is 2.87.
        assert!((trends.damping.unwrap() - 0.00574).abs() < 0.0002, "{trends:?}");
        assert_eq!(trends.frequency, None);
        assert_eq!(of(&windows(|_| 0.01)).damping, None);
        assert_eq!(of(&windows(|a| 0.01 + 0.02 * a)[..1]).damping, None);
    }
}
