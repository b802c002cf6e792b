//! Releases of the virtual rig, and what may go wrong between model and device.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use yawrig_rig::{End, Motion, Samples, Sensor, Start};
use yawrig_shared::modal::Modal;

pub const OFFSET_DEG: f64 = 2.3;
pub const HOLD_S: f64 = 2.0;
const SENSOR: Sensor = Sensor {
    sees: yawrig_rig::Sees::Angle,
    rate_hz: 1000.0,
    noise_deg: 0.0,
    noise_correlation: 0.0,
    offset_deg: 0.0,
    adc_step_deg: 0.0,
};

/// What the device is given, 1 ms after another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Given {
    /// Degrees before the converter.
    Yaw(f64),
    /// Counts of the converter.
    Counts(u16),
    /// So many samples lost, and reported to the device.
    Lost(u32),
}

/// A release on its way from the model to the device.
#[derive(Clone, Debug)]
pub struct Signal {
    pub truth: Modal,
    pub random: ChaCha8Rng,
    seed: u64,
    /// The model's yaw angle, a value a millisecond; noise comes with [`Signal::read`].
    pub yaw_deg: Vec<f64>,
}

/// Without noise: held at `amplitude_deg` for `hold_s`, then let go.
pub fn motion(truth: &Modal, amplitude_deg: f64, hold_s: f64, end: End) -> Vec<f64> {
    motion_at(truth, amplitude_deg, hold_s, end, 1000.0)
}

fn motion_at(truth: &Modal, amplitude_deg: f64, hold_s: f64, end: End, rate_hz: f64) -> Vec<f64> {
    let start = Start { amplitude_deg, hold_s, end };
    let sensor = Sensor { rate_hz, ..SENSOR };
    Samples::new(Motion::new(truth), &start, &sensor, 0).map(|s| s.yaw_deg).collect()
}

/// Until the oscillation is below the device's range for good.
const DOWN: End = End::Below { amplitude_deg: 0.3, at_most_s: 1800.0 };

impl Signal {
    pub fn new(truth: Modal, seed: u64) -> Self {
        Self::released(truth, 15.0, seed)
    }

    pub fn released(truth: Modal, from_deg: f64, seed: u64) -> Self {
        let yaw_deg = motion(&truth, from_deg, HOLD_S, DOWN);
        Self { truth, random: ChaCha8Rng::seed_from_u64(seed), seed, yaw_deg }
    }

    /// Read at times that are off by up to this share of a millisecond.
    pub fn jittered(truth: Modal, share: f64, seed: u64) -> Self {
        let mut signal = Self::new(truth, seed);
        let fine = motion_at(&truth, 15.0, HOLD_S, DOWN, 10_000.0);
        for (k, yaw) in signal.yaw_deg.iter_mut().enumerate() {
            let late = signal.random.random_range(-share..=share);
            let at = (10.0 * (k as f64 + late)).clamp(0.0, (fine.len() - 2) as f64);
            let (low, fraction) = (at as usize, at.fract());
            *yaw = fine[low] + fraction * (fine[low + 1] - fine[low]);
        }
        signal
    }

    pub fn len(&self) -> usize {
        self.yaw_deg.len()
    }

    /// A moment at this share of the stretch in which the device measures, 10 deg to 1 deg.
    pub fn moment(&self, share: f64) -> usize {
        let rate = self.truth.decay_rate_per_s();
        let at_s = HOLD_S + ((15.0_f64 / 10.0).ln() + share * 10.0_f64.ln()) / rate;
        ((at_s * 1000.0) as usize).min(self.len() - 1)
    }

    /// Any moment of that stretch.
    pub fn any_moment(&mut self) -> usize {
        let share = self.random.random_range(0.02..0.95);
        self.moment(share)
    }

    /// The amplitude at a moment, were nothing wrong.
    pub fn amplitude_deg(&self, at: usize) -> f64 {
        15.0 * (-self.truth.decay_rate_per_s() * (at as f64 * 1e-3 - HOLD_S)).exp()
    }

    /// Adds the answer to a moment whose static deflection is `deflection_deg`, a value a millisecond from
    /// `at`.
    pub fn push(&mut self, at: usize, deflection_deg: impl Fn(usize) -> Option<f64>) {
        // The response to a step is what a release from there leaves to be made up.
        let left = self.len() - at;
        let ring = motion(&self.truth, 1.0, 0.0, End::After(left as f64 * 1e-3));
        let mut before = 0.0;
        for k in 0..left {
            let now = deflection_deg(k);
            let step = now.unwrap_or(0.0) - before;
            before += step;
            if step != 0.0 {
                for (yaw, ring) in self.yaw_deg[at + k..].iter_mut().zip(&ring) {
                    *yaw += step * (1.0 - ring);
                }
            }
            if now.is_none() {
                break;
            }
        }
    }

    /// The potentiometer's noise on top, from the rig's own sensor.
    pub fn read(&self, noise_deg: f64) -> Vec<f64> {
        let sensor = Sensor { noise_deg, ..SENSOR };
        let end = End::After(self.len() as f64 * 1e-3);
        let start = Start { amplitude_deg: 0.0, hold_s: 0.0, end };
        let noise = Samples::new(Motion::new(&self.truth), &start, &sensor, self.seed);
        self.yaw_deg
            .iter()
            .zip(noise)
            .map(|(yaw, noise)| yaw + OFFSET_DEG + noise.yaw_deg)
            .collect()
    }

    /// As it is, with the usual noise.
    pub fn given(&self) -> Vec<Given> {
        self.given_with(0.05)
    }

    pub fn given_with(&self, noise_deg: f64) -> Vec<Given> {
        self.read(noise_deg).into_iter().map(Given::Yaw).collect()
    }
}
