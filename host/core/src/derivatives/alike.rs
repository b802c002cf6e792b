//! How far a law that the linear model lacks is the same with the wind on and off: then what it puts into wn
//! and damping cancels in their difference.

use super::condition::Condition;
use crate::identify::AtAmplitude;

/// Correlation of the errors that a missing law puts into wn, and into 2 zeta wn, of a condition with wind
/// and of the one without. It shows in how wn^2 and 2 zeta wn at an amplitude depart from those that were
/// fitted to the whole, by `s_on` and `s_off`: of the two errors' squares sum (s_on - s_off)^2 / sum (s_on^2
/// + s_off^2) is left in their difference.
pub(super) fn alike(on: &Condition, off: &Condition) -> [f64; 2] {
    let wn = |a: &AtAmplitude| a.natural_frequency_rad_s.value;
    let stiffness = |c: &Condition| {
        let wn = c.natural_frequency_rad_s;
        [wn.value.powi(2), 2.0 * wn.value * wn.u_lacking]
    };
    let damping = |c: &Condition| [c.damping_rad_s.value, c.damping_rad_s.u_lacking];
    let curves = [&on.at_amplitude[..], &off.at_amplitude];
    [
        correlation(curves, |a| wn(a).powi(2), stiffness(on), stiffness(off)),
        correlation(curves, |a| 2.0 * a.damping_ratio.value * wn(a), damping(on), damping(off)),
    ]
}

/// Of a number with its fitted value and what of its uncertainty is for the missing law.
fn correlation(
    [on, off]: [&[AtAmplitude]; 2],
    of: impl Fn(&AtAmplitude) -> f64,
    [fitted_on, u_on]: [f64; 2],
    [fitted_off, u_off]: [f64; 2],
) -> f64 {
    let departures: Vec<(f64, f64)> = off
        .iter()
        .filter_map(|there| Some((AtAmplitude::between(on, there.amplitude_deg)?, there)))
        .map(|(on, off)| (of(&on) - fitted_on, of(off) - fitted_off))
        .collect();
    // Of fewer amplitudes that both releases have nothing is said.
    if departures.len() < 3 {
        return 0.0;
    }
    let each: f64 = departures.iter().map(|(on, off)| on * on + off * off).sum();
    let left: f64 = departures.iter().map(|(on, off)| (on - off).powi(2)).sum();
    let alike = (1.0 - left / each) * (u_on * u_on + u_off * u_off) / (2.0 * u_on * u_off);
    if alike.is_finite() {
        alike.clamp(0.0, 1.0)
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quantity::Quantity;

    /// Damping that dry friction raises by `friction` over the amplitude, beside 2 zeta wn of `linear`.
    fn release(wn: f64, linear: f64, friction: f64) -> Vec<AtAmplitude> {
        let at = |amplitude_deg: f64| AtAmplitude {
            amplitude_deg,
            natural_frequency_rad_s: Quantity::new(wn, 0.001),
            damping_ratio: Quantity::new((linear + friction / amplitude_deg) / (2.0 * wn), 0.0001),
        };
        [10.0, 7.0, 5.0, 3.0, 2.0, 1.0].map(at).to_vec()
    }

    fn damping_alike(on: &[AtAmplitude], off: &[AtAmplitude], fitted: [f64; 2]) -> f64 {
        let damping =
            |a: &AtAmplitude| 2.0 * a.damping_ratio.value * a.natural_frequency_rad_s.value;
        correlation([on, off], damping, [fitted[0], 0.3], [fitted[1], 0.3])
    }

    #[test]
    fn friction_of_the_rig_cancels_and_friction_by_the_wind_does_not() {
        let off = release(8.0, 0.1, 0.5);
        // Fitted: as at 3 deg.
        let at_3_deg = |linear: f64, friction: f64| linear + friction / 3.0;
        let fitted = [at_3_deg(0.4, 0.5), at_3_deg(0.1, 0.5)];
        assert!(damping_alike(&release(7.5, 0.4, 0.5), &off, fitted) > 0.999);
        // A difference of a fifth between two errors of one size leaves 0.2^2 / (1 + 1.2^2) of the squares.
        let more = [at_3_deg(0.4, 0.6), fitted[1]];
        assert!((damping_alike(&release(7.5, 0.4, 0.6), &off, more) - 0.984).abs() < 0.002);
        // With wind the fit is that of 7 deg: 6 (0.5 / 3 - 0.5 / 7)^2 of 0.371 is left.
        let other = [0.4 + 0.5 / 7.0, fitted[1]];
        assert!((damping_alike(&release(7.5, 0.4, 0.5), &off, other) - 0.853).abs() < 0.002);
        let linear = release(8.0, 0.1, 0.0);
        assert!(damping_alike(&release(7.5, 0.4, 0.5), &linear, [fitted[0], 0.1]) < 1e-9);
        assert_eq!(
            damping_alike(&release(7.5, 0.4, -0.5), &off, [at_3_deg(0.4, -0.5), fitted[1]]),
            0.0
        );
    }

    #[test]
    fn between_amplitudes_it_goes_with_the_logarithm_and_outside_there_is_nothing() {
        let all = release(8.0, 0.1, 0.5);
        let there = AtAmplitude::between(&all, 50f64.sqrt() / 2f64.sqrt()).unwrap();
        assert!((there.damping_ratio.value - all[2].damping_ratio.value).abs() < 1e-12);
        assert!([10.1, 0.9].iter().all(|beyond| AtAmplitude::between(&all, *beyond).is_none()));
    }
}
