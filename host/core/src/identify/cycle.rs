//! Natural frequency and damping ratio in the words of other fields.

use crate::quantity::Quantity;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// One cycle of a free decay. Uncertainties are carried over as if those of wn and zeta were independent.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Cycle {
    /// Damped: cycles a second, as they are counted in the record.
    pub frequency_hz: Quantity,
    /// Of one damped cycle.
    pub period_s: Quantity,
    /// 1/(2 zeta); none where the oscillation does not decay, or may not within its uncertainty.
    pub quality_factor: Option<Quantity>,
    /// Of two maxima on the same side, one after the other: ln(A0/A1).
    pub logarithmic_decrement: Quantity,
}

impl Cycle {
    /// Of natural frequency, rad/s, and damping ratio.
    pub fn new(natural_frequency_rad_s: Quantity, damping_ratio: Quantity) -> Self {
        let (wn, zeta) = (natural_frequency_rad_s, damping_ratio);
        let damped = (1.0 - zeta.value.powi(2)).max(f64::MIN_POSITIVE).sqrt();
        let hz = wn.value * damped / TAU;
        let hz_u = (wn.u * damped / TAU).hypot(hz * zeta.value * zeta.u / damped.powi(2));
        let decays = zeta.value > zeta.u;
        let q = || Quantity::new(0.5 / zeta.value, 0.5 * zeta.u / zeta.value.powi(2));
        Self {
            frequency_hz: Quantity::new(hz, hz_u),
            period_s: Quantity::new(1.0 / hz, hz_u / hz.powi(2)),
            quality_factor: decays.then(q),
            logarithmic_decrement: Quantity::new(
                TAU * zeta.value / damped,
                TAU * zeta.u / damped.powi(3),
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_words_agree_with_a_decay_and_their_uncertainties_with_differences() {
        let (wn, zeta) = (6.0, 0.1);
        let of = |wn, zeta| Cycle::new(Quantity::new(wn, 0.0), Quantity::new(zeta, 0.0));
        let cycle = Cycle::new(Quantity::new(wn, 0.02), Quantity::new(zeta, 0.003));
        let yaw = |t: f64| (-zeta * wn * t).exp() * (wn * (1.0 - zeta * zeta).sqrt() * t).cos();
        let period_s = cycle.period_s.value;
        let decrement = (yaw(0.3) / yaw(0.3 + period_s)).ln();
        assert!((decrement - cycle.logarithmic_decrement.value).abs() < 1e-12);
        assert_eq!(cycle.quality_factor.map(|q| q.value), Some(5.0));
        let step = 1e-6;
        for read in [
            (|c: &Cycle| c.frequency_hz) as fn(&Cycle) -> Quantity,
            |c| c.period_s,
            |c| c.quality_factor.expect("it decays"),
            |c| c.logarithmic_decrement,
        ] {
            let at = |dw: f64, dz: f64| read(&of(wn + dw, zeta + dz)).value;
            let by_wn = (at(step, 0.0) - at(-step, 0.0)) / (2.0 * step) * 0.02;
            let by_zeta = (at(0.0, step) - at(0.0, -step)) / (2.0 * step) * 0.003;
            assert!((read(&cycle).u / by_wn.hypot(by_zeta) - 1.0).abs() < 1e-6);
        }
        let grows = Cycle::new(Quantity::new(6.0, 0.1), Quantity::new(-0.01, 0.001));
        assert_eq!(grows.quality_factor, None);
    }
}
