//! The stream of samples, whose encoding is fixed and not postcard's.

use heapless::Vec;

/// Samples in one message of the stream: 50 ms.
pub const STREAM_CHUNK: usize = 50;

/// Samples of the converter, sent unasked while a [`Request::Stream`](super::Request::Stream) lasts: 2.6
/// kB/s at 1 kHz. They are not kept: where one message is lost, the next one's number shows the gap.
///
/// On the line, little-endian: number of the first u32, degrees per count f32, zero counts u16,
/// then the counts, u16 each.
#[derive(Clone, Debug, PartialEq)]
pub struct Samples {
    /// Device time of the first; those after it follow without a gap.
    pub first_sample: u32,
    /// How their counts become degrees.
    pub degrees_per_count: f32,
    pub zero_counts: u16,
    pub counts: Vec<u16, STREAM_CHUNK>,
}

impl Samples {
    pub const MAX_BYTES: usize = 10 + 2 * STREAM_CHUNK;

    pub fn write(&self) -> Vec<u8, { Self::MAX_BYTES }> {
        let mut bytes = Vec::new();
        // There is room for all of it.
        let mut push = |value: &[u8]| drop(bytes.extend_from_slice(value));
        push(&self.first_sample.to_le_bytes());
        push(&self.degrees_per_count.to_le_bytes());
        push(&self.zero_counts.to_le_bytes());
        self.counts.iter().for_each(|counts| push(&counts.to_le_bytes()));
        bytes
    }

    pub fn read(bytes: &[u8]) -> Option<Self> {
        let (&first_sample, bytes) = bytes.split_first_chunk()?;
        let (&degrees_per_count, bytes) = bytes.split_first_chunk()?;
        let (&zero_counts, bytes) = bytes.split_first_chunk()?;
        let even = bytes.len().is_multiple_of(2) && bytes.len() <= 2 * STREAM_CHUNK;
        even.then(|| Self {
            first_sample: u32::from_le_bytes(first_sample),
            degrees_per_count: f32::from_le_bytes(degrees_per_count),
            zero_counts: u16::from_le_bytes(zero_counts),
            counts: bytes
                .chunks_exact(2)
                .map(|pair| u16::from_le_bytes([pair[0], pair[1]]))
                .collect(),
        })
    }
}
