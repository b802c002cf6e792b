//! What the turning points alone say of natural frequency and damping: where the refined estimate starts
//! from, whatever the network was trained on and whether or not three cycles came.

use yawrig_shared::network::Estimate;
use yawrig_shared::window::{Swing, SAMPLE_RATE_HZ};

/// The first swing of a release and the last one.
#[derive(Clone, Copy, Debug, Default)]
pub struct Swings {
    count: u32,
    first_deg: f32,
    last_deg: f32,
    first_sample: u32,
    last_sample: u32,
}

impl Swings {
    /// The next one. When the first began is not asked: it may be the end of a hold.
    pub fn add(&mut self, swing: &Swing) {
        self.count += 1;
        self.last_deg = swing.size_deg();
        self.last_sample = swing.to.at;
        if self.count == 1 {
            self.first_deg = self.last_deg;
            self.first_sample = swing.from.at;
        }
    }

    /// One alone, whose ends lie so far from its rest.
    pub fn add_halves(&mut self, swing: &Swing, from_deg: f32, to_deg: f32) {
        self.add(swing);
        (self.first_deg, self.last_deg) = (from_deg.abs(), to_deg.abs());
    }

    /// Samples in one of them.
    pub fn samples(&self) -> f32 {
        self.last_sample.wrapping_sub(self.first_sample) as f32 / self.count.max(1) as f32
    }

    /// Natural frequency and damping ratio by the logarithmic decrement; of one swing alone there is none.
    pub fn start(&self) -> Option<Estimate> {
        let half_s = self.samples() / SAMPLE_RATE_HZ;
        if self.count == 0 || half_s <= 0.0 {
            return None;
        }
        let half_cycles = self.count.saturating_sub(1).max(1) as f32;
        let decrement = libm::logf(self.first_deg / self.last_deg) / half_cycles;
        let phase =
            libm::sqrtf(core::f32::consts::PI * core::f32::consts::PI + decrement * decrement);
        Some(Estimate {
            natural_frequency_rad_s: phase / half_s,
            damping_ratio: decrement / phase,
            ..Estimate::default()
        })
    }
}
