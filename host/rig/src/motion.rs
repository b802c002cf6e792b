//! The equation of motion, integrated.

use super::corners::{self, Trajectory};
use super::effects::Effects;
use super::moments::{Distortion, Moments};
use super::runge_kutta::runge_kutta;
use super::sensor::{Reader, Sees, Sensor};
use crate::error::Result;
use std::f64::consts::{PI, TAU};
use yawrig_shared::modal::Modal;
use yawrig_shared::units::{deg_from_rad, rad_from_deg};

/// Longest step of the integration, s. At the rig's fastest mode, 26.5 rad/s, the frequency is then 2e-11
/// out.
const LONGEST_STEP_S: f64 = 0.25e-3;
/// An oscillation that does not die is watched this long, s.
const ENDLESS_S: f64 = 60.0;
/// A model rests whose rate stays, for a whole cycle, below this share of the rate at the smallest amplitude
/// watched.
const RESTING: f64 = 0.05;

/// b'' as a function of the state: the equation of motion divided by the inertia.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// (Kr - Nbeta) / Izz, rad2/s2.
    stiffness_rad2_s2: f64,
    /// (Cr - Nr) / Izz, rad/s.
    damping_rad_s: f64,
}

impl Motion {
    pub fn new(modal: &Modal) -> Self {
        Self { stiffness_rad2_s2: modal.stiffness_rad2_s2(), damping_rad_s: modal.damping_rad_s() }
    }

    /// Yaw acceleration in rad/s2 at yaw angle b (rad) and yaw rate r (rad/s).
    fn acceleration(&self, b: f64, r: f64) -> f64 {
        -self.damping_rad_s * r - self.stiffness_rad2_s2 * b
    }

    fn step(&self, state: [f64; 2], h: f64) -> [f64; 2] {
        runge_kutta(state, h, |_, [b, r]| [r, self.acceleration(b, r)])
    }

    /// Amplitude of the oscillation through this state, rad: what remains of it at the next turning point.
    fn amplitude(&self, [b, r]: [f64; 2]) -> f64 {
        (b * b + r * r / self.stiffness_rad2_s2).sqrt()
    }
}

/// When a release is over.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum End {
    /// This long after the first sample, s.
    After(f64),
    /// Once the amplitude is smaller than `amplitude_deg`, or `at_most_s` after the first sample.
    Below { amplitude_deg: f64, at_most_s: f64 },
}

/// How the model is let go.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Start {
    /// Where it is held, deg from rest; either sign.
    pub amplitude_deg: f64,
    /// How long before it is let go, s.
    pub hold_s: f64,
    pub end: End,
}

impl Default for Start {
    /// 15 deg, held for 2 s, watched down to 0.8 deg or for half an hour.
    fn default() -> Self {
        let end = End::Below { amplitude_deg: 0.8, at_most_s: 1800.0 };
        Self { amplitude_deg: 15.0, hold_s: 2.0, end }
    }
}

impl Start {
    /// This start with an end for what may never end by itself: without damping, a minute after the release;
    /// driven by forcing or buffeting, when the oscillation would have died down without them.
    #[must_use]
    pub fn limited(self, modal: &Modal, effects: &Effects) -> Self {
        let End::Below { amplitude_deg, at_most_s } = self.end else { return self };
        let decay_rate_per_s = modal.decay_rate_per_s();
        let dies = decay_rate_per_s > 0.0;
        let swings_s = if dies {
            (self.amplitude_deg.abs() / amplitude_deg).ln() / decay_rate_per_s
        } else {
            ENDLESS_S
        };
        let end = if effects.drive_the_model() {
            End::After((self.hold_s + swings_s).min(at_most_s))
        } else if dies {
            self.end
        } else {
            End::Below { amplitude_deg, at_most_s: self.hold_s + ENDLESS_S }
        };
        Self { end, ..self }
    }
}

/// One reading.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// From the first sample, s.
    pub time_s: f64,
    /// Offset, noise and converter included; of a rate or an acceleration deg/s or deg/s2.
    pub yaw_deg: f64,
    /// The converter's counts, 32768 at zero degrees; `None` without a converter.
    pub counts: Option<u16>,
}

/// The readings of one release, integrated as they are asked for.
#[derive(Clone, Debug)]
pub struct Samples {
    motion: Motion,
    sees: Sees,
    reader: Reader,
    rate_hz: f64,
    step_s: f64,
    steps_per_sample: u32,
    held_samples: u64,
    end: End,
    /// Yaw angle in rad and yaw rate in rad/s.
    state: [f64; 2],
    effects: Option<WithEffects>,
    next: u64,
}

/// What takes the plain motion's place where there are effects.
#[derive(Clone, Debug)]
struct WithEffects {
    trajectory: Trajectory,
    distortion: Distortion,
    /// How long the model has hardly moved, s.
    resting_s: f64,
    /// A cycle of the plain motion, s.
    cycle_s: f64,
}

impl Samples {
    /// A release of `motion`. The same seed gives the same noise.
    pub fn new(motion: Motion, start: &Start, sensor: &Sensor, seed: u64) -> Self {
        let steps_per_sample = (1.0 / (sensor.rate_hz * LONGEST_STEP_S)).ceil().max(1.0);
        Self {
            motion,
            sees: sensor.sees,
            reader: Reader::new(sensor, seed),
            rate_hz: sensor.rate_hz,
            step_s: 1.0 / (sensor.rate_hz * steps_per_sample),
            steps_per_sample: steps_per_sample as u32,
            held_samples: (start.hold_s * sensor.rate_hz).round() as u64,
            end: start.end,
            state: [rad_from_deg(start.amplitude_deg), 0.0],
            effects: None,
            next: 0,
        }
    }

    /// A release of a model of this `modal` with `effects`; without any, the same as [`Self::new`].
    ///
    /// The model is held `start.amplitude_deg` from where it would rest without effects. It ends early where
    /// it turns past 180 deg. One seed gives one noise and one buffeting.
    ///
    /// # Errors
    /// For a frequency that imitates another, a release that friction or play holds, or one that does
    /// not come back.
    pub fn with_effects(
        modal: &Modal,
        effects: &Effects,
        start: &Start,
        sensor: &Sensor,
        seed: u64,
    ) -> Result<Self> {
        let mut samples = Self::new(Motion::new(modal), start, sensor, seed);
        if !effects.is_empty() {
            let released_rad = rad_from_deg(start.amplitude_deg);
            corners::check(modal, effects, released_rad)?;
            samples.effects = Some(WithEffects {
                trajectory: Trajectory::new(Moments::new(modal, effects), released_rad, seed),
                distortion: Distortion::new(effects),
                resting_s: 0.0,
                cycle_s: TAU / modal.natural_frequency_rad_s,
            });
        }
        Ok(samples)
    }

    fn swing_rad(&self) -> f64 {
        match &self.effects {
            None => self.motion.amplitude(self.state),
            Some(with) if with.resting_s > with.cycle_s => 0.0,
            Some(with) => with.trajectory.swing_rad,
        }
    }

    /// Where it is, rad/s2.
    fn acceleration(&self) -> f64 {
        match &self.effects {
            None => self.motion.acceleration(self.state[0], self.state[1]),
            Some(with) => with.trajectory.acceleration(),
        }
    }

    /// From one sample to the next.
    fn advance(&mut self) {
        let Some(with) = &mut self.effects else {
            for _ in 0..self.steps_per_sample {
                self.state = self.motion.step(self.state, self.step_s);
            }
            return;
        };
        for _ in 0..self.steps_per_sample {
            with.trajectory.advance(self.step_s);
        }
        let [b, r, ..] = with.trajectory.state;
        self.state = [b, r];
        if let End::Below { amplitude_deg, .. } = self.end {
            let least_rad_s = RESTING * rad_from_deg(amplitude_deg) * TAU / with.cycle_s;
            let rests = self.state[1].abs() < least_rad_s;
            with.resting_s = if rests { with.resting_s + 1.0 / self.rate_hz } else { 0.0 };
        }
    }

    fn is_over(&self, time_s: f64) -> bool {
        match self.end {
            End::After(seconds) => time_s > seconds,
            End::Below { amplitude_deg, at_most_s } => {
                time_s > at_most_s
                    || (self.next > self.held_samples
                        && deg_from_rad(self.swing_rad()) < amplitude_deg)
            }
        }
    }
}

impl Iterator for Samples {
    type Item = Sample;

    fn next(&mut self) -> Option<Sample> {
        let time_s = self.next as f64 / self.rate_hz;
        if self.next > self.held_samples {
            self.advance();
        }
        if self.is_over(time_s) || !self.state[0].is_finite() {
            return None;
        }
        let moving = self.next > self.held_samples;
        let seen = match self.sees {
            Sees::Angle => self.state[0],
            Sees::Rate => self.state[1],
            // A hand holds it until it is let go.
            Sees::Acceleration if moving => self.acceleration(),
            Sees::Acceleration => 0.0,
        };
        let seen_rad = match &self.effects {
            None => seen,
            Some(_) if self.state[0].abs() > PI => return None,
            Some(with) => {
                let released_s = self.held_samples as f64 / self.rate_hz;
                with.distortion.reading(time_s - released_s, seen)
            }
        };
        self.next += 1;
        let (yaw_deg, counts) = self.reader.read(deg_from_rad(seen_rad));
        Some(Sample { time_s, yaw_deg, counts })
    }
}

impl std::iter::FusedIterator for Samples {}

#[cfg(test)]
mod tests {
    use super::*;

    fn still(end: End) -> (Start, Sensor) {
        let start = Start { amplitude_deg: 12.0, hold_s: 0.1, end };
        (start, Sensor { noise_deg: 0.0, adc_step_deg: 0.0, ..Sensor::default() })
    }

    /// Against the solution in closed form, with damping of either sign, at the ends of the rig's range.
    #[test]
    fn the_integration_is_the_solution() {
        for (wn, zeta) in [(2.5, 0.1), (7.5, 0.012), (26.5, 0.001), (12.0, 0.0), (5.0, -0.01)] {
            let modal = Modal { natural_frequency_rad_s: wn, damping_ratio: zeta };
            for rate_hz in [20.0, 1000.0, 10_000.0] {
                let (start, sensor) = still(End::After(30.0));
                let sensor = Sensor { rate_hz, ..sensor };
                let wd = modal.damped_frequency_rad_s();
                for sample in Samples::new(Motion::new(&modal), &start, &sensor, 1) {
                    let t = (sample.time_s - 0.1).max(0.0);
                    let (sin, cos) = (wd * t).sin_cos();
                    let decay = (-modal.decay_rate_per_s() * t).exp();
                    let exact = 12.0 * decay * (cos + modal.decay_rate_per_s() / wd * sin);
                    assert!((sample.yaw_deg - exact).abs() < 1e-7, "{wn} {zeta} {rate_hz} {t}");
                }
            }
        }
    }

    #[test]
    fn held_then_released_then_over() {
        let modal = Modal { natural_frequency_rad_s: 10.0, damping_ratio: 0.05 };
        let (start, sensor) = still(End::Below { amplitude_deg: 1.0, at_most_s: 100.0 });
        let yaw: Vec<f64> =
            Samples::new(Motion::new(&modal), &start, &sensor, 1).map(|s| s.yaw_deg).collect();
        assert!(yaw[..=100].iter().all(|yaw| (yaw - 12.0).abs() < 1e-12));
        assert!(yaw[101] < 12.0);
        // exp(-0.5 t) = 1/12 at 4.97 s; the amplitude by energy is within 5 % of it.
        let seconds = (yaw.len() - 101) as f64 * 1e-3;
        assert!((seconds - 12f64.ln() / 0.5).abs() < 0.2, "{seconds}");
        assert!(yaw[yaw.len() - 600..].iter().fold(0.0f64, |a, y| a.max(y.abs())) > 1.0);
    }

    #[test]
    fn an_oscillation_that_never_dies_ends_all_the_same() {
        let modal = Modal { natural_frequency_rad_s: 10.0, damping_ratio: 0.0 };
        let (start, sensor) = still(End::Below { amplitude_deg: 1.0, at_most_s: 5.0 });
        let mut samples = Samples::new(Motion::new(&modal), &start, &sensor, 1);
        assert_eq!(samples.by_ref().count(), 5001);
        assert_eq!(samples.next(), None);
    }
}
