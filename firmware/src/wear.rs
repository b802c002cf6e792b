//! How often a host may have a network's place erased.
//!
//! A flash stands some ten thousand erases of a place. A program that writes networks in a loop would have
//! them in hours: after a hundred at once, as many as a day of trying takes, the device has it wait.

use yawrig_shared::wire::{Refusal, SAMPLES_BETWEEN_ERASES};

/// Erases that may come one after the other.
pub const AT_ONCE: u32 = 100;

/// What is left of them.
#[derive(Clone, Copy, Debug)]
pub struct Wear {
    left: u32,
    /// The sample from which on the next one grows.
    since: u32,
}

impl Default for Wear {
    fn default() -> Self {
        Self::new()
    }
}

impl Wear {
    pub const fn new() -> Self {
        Self { left: AT_ONCE, since: 0 }
    }

    /// Takes one of them, at this sample.
    ///
    /// # Errors
    /// [`Refusal::TooOften`], with the samples until there is another.
    pub fn erase(&mut self, now: u32) -> Result<(), Refusal> {
        let grown = now.wrapping_sub(self.since) / SAMPLES_BETWEEN_ERASES;
        self.left = self.left.saturating_add(grown).min(AT_ONCE);
        self.since = self.since.wrapping_add(grown.wrapping_mul(SAMPLES_BETWEEN_ERASES));
        let grows = now.wrapping_sub(self.since);
        match self.left.checked_sub(1) {
            Some(left) => {
                self.left = left;
                Ok(())
            }
            None => Err(Refusal::TooOften { samples: SAMPLES_BETWEEN_ERASES - grows }),
        }
    }
}
