//! What a model would read of a motion that is known already: its plain part in closed form, everything else
//! as it acts along that motion.

use crate::motion::oscillator::{Flow, Grid, Motion};
use crate::motion::own_motion::Walker;
use crate::motion::pace::Pace;

impl Motion {
    /// The reading at every instant of `grid`, rad: that of the plain part under the moments of the effects
    /// where the motion has the angles and rates `states`. Of states of its own it is its own reading; behind
    /// a random moment, which moves them, it is what is left without that moment's response.
    pub(crate) fn readings_along(&self, states: &[[f64; 2]], grid: &Grid) -> Vec<f64> {
        let (wn, h) = (self.natural_frequency_rad_s, grid.step_s);
        let plain = |[b, r]: [f64; 2]| -wn * (wn * b + 2.0 * self.damping_ratio * r);
        let Flow([p, q, u, v]) = self.flow(h);
        let Flow([_, turned, _, kicked]) = self.flow(0.5 * h);
        let mut walker = Walker::new(self, 1.0, 0, grid.start_s, Pace::Own);
        let (mut b, mut r) = (self.yaw_rad, self.rate_rad_s);
        let mut before: Option<([f64; 2], f64)> = None;
        let mut out = Vec::with_capacity(grid.count);
        for (k, state) in states.iter().enumerate().take(grid.count) {
            if before.is_some_and(|(last, _)| last[1] * state[1] < 0.0) {
                walker.memories.turn(state[0]);
            }
            if let Some((last, _)) = before {
                walker.states = walker.states_along([last, *state], [grid.time_s(k - 1), h]);
            }
            let moment = walker.acceleration_at(*state, grid.time_s(k)) - plain(*state);
            if let Some((_, last)) = before {
                let kick = 0.5 * h * (last + moment);
                (b, r) = (p * b + q * r + turned * kick, u * b + v * r + kicked * kick);
            }
            out.push(b);
            before = Some((*state, moment));
        }
        self.read(grid, &mut out, [self.rate_rad_s, r]);
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::{Effect, Terms};

    /// Along its own motion a model reads what it reads: friction, play, a curved spring and a memory, to the
    /// step of a splitting.
    #[test]
    fn along_its_own_motion_a_model_reads_its_own_reading() {
        let effects: [(Effect, &[f64]); 4] = [
            (Effect::CoulombFriction, &[0.02]),
            (Effect::FreePlay, &[0.004]),
            (Effect::CubicStiffness, &[60.0]),
            (Effect::Hysteresis, &[1.5, 0.05]),
        ];
        for (effect, numbers) in effects {
            let motion = Motion {
                natural_frequency_rad_s: 7.0,
                damping_ratio: 0.01,
                yaw_rad: 0.2,
                rate_rad_s: 0.1,
                terms: Terms::new([(effect.clone(), numbers)]),
            };
            let grid = Grid { start_s: 0.0, step_s: 0.02, count: 300, mean_width_s: 0.02 };
            let point = Grid { mean_width_s: 0.0, ..grid };
            let (yaw, rate) = motion.readings_and_rates(&point);
            let states: Vec<[f64; 2]> = yaw.into_iter().zip(rate).map(|(b, r)| [b, r]).collect();
            let own = motion.readings(&grid);
            let along = motion.readings_along(&states, &grid);
            let without = Motion { terms: Terms::default(), ..motion }.readings(&grid);
            let rms = |a: &[f64], b: &[f64]| {
                let squares = a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
                (squares / 300.0).sqrt()
            };
            let (off, acts) = (rms(&own, &along), rms(&own, &without));
            println!("{effect}: off by {off:.2e} of {acts:.2e}");
            assert!(off < 0.03 * acts, "{effect}");
        }
    }
}
