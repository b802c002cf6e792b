//! The potentiometer's samples on their way to a host that wants to see them.

use crate::line::Line;
use yawrig_shared::wire::{Samples, Settings};

/// Samples that wait until they fill a message.
#[derive(Debug)]
pub struct Stream {
    /// Samples still to be sent.
    left: u32,
    chunk: Samples,
}

impl Default for Stream {
    fn default() -> Self {
        Self::new()
    }
}

impl Stream {
    pub const fn new() -> Self {
        let counts = heapless::Vec::new();
        let chunk = Samples { first_sample: 0, degrees_per_count: 0.0, zero_counts: 0, counts };
        Self { left: 0, chunk }
    }

    /// A host wants the next so many samples, beside what others want.
    pub fn extend(&mut self, samples: u32) {
        self.left = self.left.max(samples);
    }

    /// The sample with this number. A message holds samples without a gap, of one scale.
    // One copy: into each caller it would cost the image 1.6 KB.
    #[inline(never)]
    pub fn sample(&mut self, number: u32, counts: u16, settings: &Settings, line: &mut Line) {
        if self.left == 0 {
            return;
        }
        self.left -= 1;
        let Samples { first_sample, degrees_per_count, zero_counts, .. } = self.chunk;
        let expected = first_sample.wrapping_add(self.chunk.counts.len() as u32);
        let scale = (settings.degrees_per_count, settings.zero_counts);
        if number != expected || (degrees_per_count, zero_counts) != scale {
            self.send(line);
        }
        if self.chunk.counts.is_empty() {
            self.chunk.first_sample = number;
            (self.chunk.degrees_per_count, self.chunk.zero_counts) = scale;
        }
        // There is room: a full one has been sent.
        let _ = self.chunk.counts.push(counts);
        if self.chunk.counts.is_full() || self.left == 0 {
            self.send(line);
        }
    }

    fn send(&mut self, line: &mut Line) {
        if !self.chunk.counts.is_empty() {
            line.samples(&self.chunk);
            self.chunk.counts.clear();
        }
    }
}
