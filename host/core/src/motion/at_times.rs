//! A motion at instants that lie on no even grid.

use crate::motion::oscillator::{Grid, Motion};
use crate::record::Derivative;

/// The reading at each of `time_s`, from the release, in order, rad; the motion's state is that at `start_s`,
/// before which there is none (NaN).
pub fn readings_at(motion: &Motion, start_s: f64, time_s: &[f64]) -> Vec<f64> {
    let Some(&end_s) = time_s.last() else { return Vec::new() };
    // A cubic between steps of a thousandth of a cycle errs, with the rates at both ends, by 1e-9 of the
    // amplitude, by 1e-7 where dry friction turns over within a step.
    let step_s = std::f64::consts::TAU / motion.natural_frequency_rad_s / 1000.0;
    let count = ((end_s - start_s) / step_s).max(0.0).ceil() as usize + 3;
    let grid = Grid { start_s, step_s, count, mean_width_s: 0.0 };
    let unread = Motion { terms: motion.terms.unread(), ..motion.clone() };
    let (seen, rates) = unread.readings_and_rates(&grid);
    let slope = |k: usize| match motion.terms.observed {
        Derivative::None => step_s * rates[k],
        // Of the parabola through its neighbours.
        _ if k == 0 => -1.5 * seen[0] + 2.0 * seen[1] - 0.5 * seen[2],
        _ if k + 1 == count => 1.5 * seen[k] - 2.0 * seen[k - 1] + 0.5 * seen[k - 2],
        _ => 0.5 * (seen[k + 1] - seen[k - 1]),
    };
    let at = |t: f64| {
        let x = (t - start_s) / step_s;
        if x < 0.0 {
            return f64::NAN;
        }
        let k = (x as usize).min(count - 2);
        let x = x - k as f64;
        let y = 1.0 - x;
        let slopes = x * y * (y * slope(k) - x * slope(k + 1));
        let between = y * y * (1.0 + 2.0 * x) * seen[k] + x * x * (1.0 + 2.0 * y) * seen[k + 1];
        motion.terms.reading(between + slopes, t)
    };
    time_s.iter().map(|&t| at(t)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::{Effect, Terms};

    #[test]
    fn between_the_steps_it_is_the_motion_itself() {
        let effects = [
            (Effect::CoulombFriction, &[0.05][..]),
            (Effect::CubicStiffness, &[30.0]),
            (Effect::SensorNonlinearity, &[0.1]),
        ];
        let mut terms = Terms::new(effects);
        terms.precise = true;
        let motion = Motion {
            natural_frequency_rad_s: 7.0,
            damping_ratio: 0.01,
            yaw_rad: 0.2,
            rate_rad_s: -0.1,
            terms,
        };
        let grid = Grid { start_s: 0.3, step_s: 0.017, count: 800, mean_width_s: 0.0 };
        let even = motion.readings(&grid);
        let times: Vec<f64> = (0..grid.count).map(|k| grid.time_s(k)).collect();
        for (a, b) in readings_at(&motion, grid.start_s, &times).iter().zip(&even) {
            assert!((a - b).abs() < 1e-7 * 0.2, "{a} {b}");
        }
        assert!(readings_at(&motion, 0.3, &[0.2, 0.4])[0].is_nan());
    }
}
