//! A free motion of one mode, or of two that beat, continued beyond the cycles it was fitted to.

use super::damped_sinusoid::Mode;
use super::pencil;
use super::samples::Stretch;
use crate::record::Derivative;
use crate::solver::linear_fit;

/// Cycles of two modes in which they are told apart.
pub(super) const BEATING_CYCLES: f64 = 5.0;

/// The modes' sum. Angles in deg.
pub(super) struct FreeMotion {
    modes: Vec<Mode>,
}

impl FreeMotion {
    pub(super) fn one(mode: Mode) -> Self {
        Self { modes: vec![mode] }
    }

    /// Two modes in an evenly sampled stretch of some cycles.
    pub(super) fn two(stretch: &Stretch<'_>) -> Option<Self> {
        let poles = pencil::poles(stretch.yaw_deg, stretch.step_s, 2);
        let [a, b] = poles[..].try_into().ok()?;
        let origin_s = stretch.start_s();
        let row = |(time_s, yaw_deg): (f64, f64)| {
            let t = time_s - origin_s;
            let [[ac, a_s], [bc, bs]] = [a, b].map(|pole: pencil::Pole| {
                let (s, c) = (pole.frequency_rad_s * t).sin_cos();
                let e = (-pole.decay_rate_1_s * t).exp();
                [e * c, e * s]
            });
            ([1.0, ac, a_s, bc, bs], yaw_deg)
        };
        let [middle, ac, a_s, bc, bs] = linear_fit(stretch.kept().map(row))?;
        let mode = |pole: pencil::Pole, cosine, sine, middle| {
            let numbers = [cosine, sine, middle, pole.decay_rate_1_s, pole.frequency_rad_s];
            Mode::from_parameters(origin_s, &numbers)
        };
        let mut modes = vec![mode(a, ac, a_s, middle), mode(b, bc, bs, 0.0)];
        modes.sort_by(|a, b| b.amplitude_deg(origin_s).total_cmp(&a.amplitude_deg(origin_s)));
        Some(Self { modes })
    }

    /// The mode with the largest amplitude.
    pub(super) fn main(&self) -> &Mode {
        &self.modes[0]
    }

    pub(super) fn yaw_deg(&self, time_s: f64) -> f64 {
        self.modes.iter().map(|m| m.yaw_deg(time_s)).sum()
    }

    /// Rate and acceleration of what is recorded.
    pub(super) fn slopes(&self, time_s: f64) -> [f64; 2] {
        let slopes = self.modes.iter().map(|m| {
            let rate = m.rate_deg_s(time_s);
            let off = m.yaw_deg(time_s) - m.offset_deg;
            let wn2 = m.natural_frequency_rad_s().powi(2);
            [rate, -2.0 * m.decay_rate_1_s * rate - wn2 * off]
        });
        slopes.fold([0.0; 2], |[r, a], [rate, acceleration]| [r + rate, a + acceleration])
    }

    /// The largest that it can be.
    pub(super) fn amplitude_deg(&self, time_s: f64) -> f64 {
        self.modes.iter().map(|m| m.amplitude_deg(time_s)).sum()
    }

    /// Coordinate and rate of the motion of which `derivative` is recorded.
    pub(super) fn state(&self, derivative: Derivative, time_s: f64) -> [f64; 2] {
        let states = self.modes.iter().map(|m| {
            let recorded = [m.yaw_deg(time_s) - m.offset_deg, m.rate_deg_s(time_s)];
            derivative.state(recorded, m.natural_frequency_rad_s(), m.damping_ratio())
        });
        states.fold([0.0; 2], |[x, v], [of_x, of_v]| [x + of_x, v + of_v])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::samples::Samples;

    #[test]
    fn two_modes_are_continued_backwards() {
        let mode = |t: f64, a: f64, s: f64, w: f64| a * (-s * t).exp() * (w * t).cos();
        let yaw = |t: f64| 1.5 + mode(t, 8.0, 0.05, 6.0) + mode(t, 5.0, 0.1, 7.5);
        let time_s: Vec<f64> = (0..125).map(|k| 2.0 + f64::from(k) * 0.04).collect();
        let yaw_deg: Vec<f64> = time_s.iter().map(|t| yaw(*t)).collect();
        let motion = FreeMotion::two(&Samples::new(&time_s, &yaw_deg).all()).expect("two modes");
        assert!((motion.yaw_deg(0.3) - yaw(0.3)).abs() < 1e-4);
        let step = 1e-5;
        let slope = (yaw(0.3 + step) - yaw(0.3 - step)) / (2.0 * step);
        let [rate, acceleration] = motion.slopes(0.3);
        let bend = (yaw(0.3 + step) - 2.0 * yaw(0.3) + yaw(0.3 - step)) / (step * step);
        assert!((rate - slope).abs() < 1e-3 && (acceleration - bend).abs() < 1e-2);
        assert!((motion.main().damped_frequency_rad_s - 6.0).abs() < 1e-5);
    }
}
