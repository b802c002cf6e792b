//! When something happened, in samples of the session.

use yawrig_base::clock::Instant;
use yawrig_shared::window::SAMPLE_RATE_HZ;

/// From the device's numbers of samples to the session's.
#[derive(Clone, Copy, Debug)]
pub(super) struct Clock {
    /// A sample's number on the device, and in the session.
    device: u32,
    pub(super) session: u64,
    /// When it was known.
    known: Instant,
}

impl Clock {
    /// The device's next sample is `device`, the session's `session`, as is known now.
    pub(super) fn new(device: u32, session: u64) -> Self {
        Self { device, session, known: Instant::now() }
    }

    pub(super) fn of(&self, sample: u32) -> u64 {
        self.session.saturating_add_signed(self.since(sample))
    }

    pub(super) fn since(&self, sample: u32) -> i64 {
        i64::from(sample.wrapping_sub(self.device) as i32)
    }

    /// Samples that went by since then if the device goes on at its rate.
    pub(super) fn due(&self) -> u64 {
        (self.known.elapsed().as_secs_f64() * f64::from(SAMPLE_RATE_HZ)) as u64
    }
}
