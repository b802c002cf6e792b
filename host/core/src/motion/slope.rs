//! The right-hand side of a motion's differential equation, for whoever integrates it by other means.

use super::oscillator::{Motion, Walk};
use super::own_effects::States;
use super::own_motion::Walker;
use super::pace::Pace;
use crate::record::Derivative;

impl Motion {
    /// b'' at this angle and rate and at the first instant, rad/s2; what remembers, as if it began there, and
    /// own effects' states as if it was held there.
    ///
    /// ```
    /// use yawrig_core::effects::{Effect, Terms};
    /// use yawrig_core::motion::simulate::Motion;
    ///
    /// let terms = Terms::new([(Effect::CoulombFriction, &[0.3][..])]);
    /// let (natural_frequency_rad_s, damping_ratio) = (7.0, 0.01);
    /// let motion =
    ///     Motion { natural_frequency_rad_s, damping_ratio, yaw_rad: 0.2, rate_rad_s: 0.0, terms };
    /// let expected = -49.0 * 0.1 - 2.0 * 0.01 * 7.0 * 0.5 - 0.3;
    /// assert!((motion.acceleration_rad_s2(0.1, 0.5) - expected).abs() < 1e-12);
    /// ```
    pub fn acceleration_rad_s2(&self, yaw_rad: f64, rate_rad_s: f64) -> f64 {
        let there = Self { yaw_rad, rate_rad_s, ..self.clone() };
        let states = there.own_states_held_at(yaw_rad);
        let walker = Walker::from(&there, [1.0, 0.0], 0, Pace::Own, states);
        walker.acceleration_at([yaw_rad, rate_rad_s], 0.0)
    }

    /// The state that determines what follows: yaw angle (rad), yaw rate (rad/s), of each moment that
    /// remembers what it remembers (of hysteresis the deflection of what yields, rad), and the states of own
    /// effects, each in its unit; at the first instant, `start_s` from the release.
    pub fn state(&self, start_s: f64) -> Vec<f64> {
        let remembered = self.memories(start_s).states(self.yaw_rad);
        let state = [self.yaw_rad, self.rate_rad_s].into_iter().chain(remembered);
        state.chain(self.own_states(start_s)).collect()
    }

    /// How fast each number of `state`, ordered as in [`Self::state`], changes `time_s` from the release, per
    /// s. A model that dry friction holds at rest stays there.
    ///
    /// # Panics
    /// Where `state` has no angle and rate.
    ///
    /// ```
    /// use yawrig_core::effects::{Effect, Terms};
    /// use yawrig_core::motion::simulate::Motion;
    ///
    /// let terms = Terms::new([(Effect::CoulombFriction, &[0.3][..])]);
    /// let (natural_frequency_rad_s, damping_ratio) = (7.0, 0.01);
    /// let motion =
    ///     Motion { natural_frequency_rad_s, damping_ratio, yaw_rad: 0.2, rate_rad_s: 0.0, terms };
    /// let slope = motion.slope(0.0, &[0.1, 0.5]);
    /// assert_eq!(slope[0], 0.5);
    /// assert!((slope[1] - (-49.0 * 0.1 - 2.0 * 0.01 * 7.0 * 0.5 - 0.3)).abs() < 1e-12);
    /// assert_eq!(motion.slope(0.0, &[0.006, 0.0]), [0.0, 0.0]);
    /// ```
    pub fn slope(&self, time_s: f64, state: &[f64]) -> Vec<f64> {
        let (yaw_rad, rate_rad_s) = (state[0], state[1]);
        let there = Self { yaw_rad, rate_rad_s, ..self.clone() };
        let mut walker = Walker::from(&there, [1.0, 0.0], 0, Pace::Own, States::default());
        let own = state.len() - walker.own.count;
        walker.states[..walker.own.count].copy_from_slice(&state[own..]);
        walker.memories = self.terms.memories_at(yaw_rad, &state[2..own]);
        let acceleration = walker.acceleration(yaw_rad, rate_rad_s, time_s);
        let remembered = walker.memories.slopes(rate_rad_s);
        let rates = walker.state_rates([yaw_rad, rate_rad_s], time_s);
        let own = rates.into_iter().take(walker.own.count);
        [rate_rad_s, acceleration].into_iter().chain(remembered).chain(own).collect()
    }

    /// What the sensor shows of `state`, ordered as in [`Self::state`], `time_s` from the release: of an
    /// angle rad.
    ///
    /// # Panics
    /// As [`Self::slope`].
    pub fn reading_of(&self, time_s: f64, state: &[f64]) -> f64 {
        let seen = match self.terms.observed {
            Derivative::None => state[0],
            Derivative::Rate => state[1],
            Derivative::Acceleration => self.slope(time_s, state)[1],
        };
        self.terms.reading(seen, time_s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::{Effect, Terms};
    use crate::motion::oscillator::Grid;
    use crate::motion::runge_kutta::stepped;

    /// So many steps to an instant of the grid.
    fn integrated(motion: &Motion, grid: &Grid, steps: usize) -> Vec<f64> {
        let mut state = motion.state(grid.start_s);
        let h = grid.step_s / steps as f64;
        let mut out = Vec::new();
        for k in 0..grid.count {
            out.push(motion.reading_of(grid.time_s(k), &state));
            for i in 0..steps {
                stepped(motion, grid.time_s(k) + i as f64 * h, h, &mut state);
            }
        }
        out
    }

    fn same(effects: &[(Effect, &[f64])], observed: Derivative, steps: usize, within: f64) {
        let mut terms = Terms::new(effects.iter().cloned());
        (terms.precise, terms.observed) = (true, observed);
        let motion = Motion {
            natural_frequency_rad_s: 7.0,
            damping_ratio: 0.01,
            yaw_rad: 0.2,
            rate_rad_s: -0.1,
            terms,
        };
        let grid = Grid { start_s: 0.3, step_s: 0.02, count: 150, mean_width_s: 0.0 };
        let expected = motion.readings(&grid);
        let found = integrated(&motion, &grid, steps);
        let size = expected.iter().fold(0.0, |m: f64, y| m.max(y.abs()));
        for (a, b) in found.iter().zip(&expected) {
            assert!((a - b).abs() < within * size, "{effects:?} {observed:?}: {a} {b}");
        }
    }

    #[test]
    fn it_is_the_motions_own_equation() {
        let smooth = [
            (Effect::CubicStiffness, &[30.0][..]),
            (Effect::QuadraticDamping, &[0.3]),
            (Effect::StaticOffset, &[0.4]),
            (Effect::HarmonicForcing, &[0.5, 4.0, 0.3]),
            (Effect::StiffnessDrift, &[0.01]),
            (Effect::SensorNonlinearity, &[0.1]),
        ];
        for observed in [Derivative::None, Derivative::Rate, Derivative::Acceleration] {
            same(&smooth, observed, 20, 1e-7);
        }
    }

    /// Steps that run over a corner err with their length.
    #[test]
    fn corners_and_what_remembers_are_in_it() {
        for effect in [
            (Effect::CoulombFriction, &[0.3][..]),
            (Effect::FreePlay, &[0.02]),
            (Effect::Hysteresis, &[20.0, 0.03]),
        ] {
            same(&[effect, (Effect::CubicStiffness, &[30.0])], Derivative::None, 100, 1e-4);
        }
    }
}
