//! The potentiometer's samples as bytes on a serial line, for boards whose angle comes from a host.
//!
//! An emulated UART takes one byte at a time, so a sample is one byte wherever it can be:
//!
//! | bytes | meaning |
//! |---|---|
//! | `d`, -126..=127 as two's complement | the next sample: previous counts + `d` |
//! | `81 d:u16`, little-endian | the next sample: previous counts + `d`, modulo 65536 |
//! | `80 index:u32 before:u16 counts:u16 crc:u16`, little-endian | sample `index` has these counts, the one sent before it had `before` |
//!
//! The last form comes first, after a gap and every [`ABSOLUTE_EVERY`] samples. A byte that was
//! lost, added or changed on the way leaves index or counts off from there on, so that the next
//! absolute sample shows it. `crc` is CRC-16/IBM-SDLC over what stands between `80` and it.

use crc::{Crc, NoTable, CRC_16_IBM_SDLC};

/// At 1 kHz, damage is found at most a quarter of a second late.
pub const ABSOLUTE_EVERY: u32 = 256;

const ABSOLUTE: u8 = 0x80;
const WIDE: u8 = 0x81;
/// Index, counts before, counts and CRC after [`ABSOLUTE`].
const BODY: usize = 10;
const CRC: Crc<u16, NoTable> = Crc::<u16, NoTable>::new(&CRC_16_IBM_SDLC);

/// One sample of the 1 kHz stream.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sample {
    /// Number of the sample since the stream began, in milliseconds therefore; wraps.
    pub index: u32,
    /// The potentiometer's reading in ADC counts.
    pub counts: u16,
    /// Samples missing before this one; at least 1 where some before it were damaged; else 0.
    pub lost: u32,
}

/// Samples to bytes.
#[derive(Clone, Debug, Default)]
pub struct Encoder {
    last: Option<(u32, u16)>,
    /// Differences since the last absolute sample.
    differences: u32,
}

impl Encoder {
    /// Appends sample `index` of `counts` to `out`; at most 11 bytes.
    ///
    /// An index that does not follow the last one is a gap, which the device treats as lost samples.
    pub fn encode(&mut self, index: u32, counts: u16, out: &mut impl Extend<u8>) {
        let before = self.last.map_or(counts, |(_, before)| before);
        let follows = self.last.is_some_and(|(last, _)| index == last.wrapping_add(1));
        self.last = Some((index, counts));
        if !follows || self.differences == ABSOLUTE_EVERY - 1 {
            self.differences = 0;
            let (i, b, c) = (index.to_le_bytes(), before.to_le_bytes(), counts.to_le_bytes());
            let said = [i[0], i[1], i[2], i[3], b[0], b[1], c[0], c[1]];
            out.extend([ABSOLUTE]);
            out.extend(said);
            out.extend(CRC.checksum(&said).to_le_bytes());
            return;
        }
        self.differences += 1;
        match i32::from(counts) - i32::from(before) {
            narrow @ -126..=127 => out.extend([narrow as u8]),
            _ => {
                let [low, high] = counts.wrapping_sub(before).to_le_bytes();
                out.extend([WIDE, low, high]);
            }
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    /// Differences count.
    Running,
    /// Everything up to the next absolute sample is dropped.
    Hunting,
    /// After [`WIDE`]; the low byte once it is there.
    Wide(Option<u8>),
    /// After [`ABSOLUTE`]; this many bytes of the body are there.
    Body(usize),
}

/// Bytes to samples.
#[derive(Clone, Debug)]
pub struct Decoder {
    state: State,
    /// Index and counts of the last sample given out.
    last: Option<(u32, u16)>,
    body: [u8; BODY],
}

impl Default for Decoder {
    fn default() -> Self {
        Self { state: State::Hunting, last: None, body: [0; BODY] }
    }
}

impl Decoder {
    /// The UART said that a byte was lost: drops what follows up to the next absolute sample.
    pub fn overrun(&mut self) {
        self.state = State::Hunting;
    }

    /// Takes the next byte; a sample where this byte completes one.
    #[inline]
    pub fn decode(&mut self, byte: u8) -> Option<Sample> {
        match self.state {
            State::Running => match byte {
                ABSOLUTE => self.state = State::Body(0),
                WIDE => self.state = State::Wide(None),
                // Sign-extended: adding modulo 65536 then goes down as well as up.
                narrow => return self.next(i16::from(narrow as i8) as u16),
            },
            State::Wide(None) => self.state = State::Wide(Some(byte)),
            State::Wide(Some(low)) => {
                self.state = State::Running;
                return self.next(u16::from_le_bytes([low, byte]));
            }
            State::Hunting => {
                if byte == ABSOLUTE {
                    self.state = State::Body(0);
                }
            }
            State::Body(have) => {
                self.body[have] = byte;
                if have + 1 == BODY {
                    return self.complete();
                }
                self.state = State::Body(have + 1);
            }
        }
        None
    }

    #[inline]
    fn next(&mut self, difference: u16) -> Option<Sample> {
        let (index, counts) = self.last?;
        let (index, counts) = (index.wrapping_add(1), counts.wrapping_add(difference));
        self.last = Some((index, counts));
        Some(Sample { index, counts, lost: 0 })
    }

    fn complete(&mut self) -> Option<Sample> {
        let [i0, i1, i2, i3, b0, b1, c0, c1, k0, k1] = self.body;
        if CRC.checksum(&self.body[..BODY - 2]) != u16::from_le_bytes([k0, k1]) {
            // What began this body may have been data, and the true beginning lie inside it.
            match self.body.iter().position(|b| *b == ABSOLUTE) {
                Some(at) => {
                    self.body.rotate_left(at + 1);
                    self.state = State::Body(BODY - at - 1);
                }
                None => self.state = State::Hunting,
            }
            return None;
        }
        self.state = State::Running;
        let index = u32::from_le_bytes([i0, i1, i2, i3]);
        let counts = u16::from_le_bytes([c0, c1]);
        let lost = match self.last.replace((index, counts)) {
            None => 0,
            Some((last, given)) => match index.wrapping_sub(last) {
                1 => u32::from(given != u16::from_le_bytes([b0, b1])),
                // The index stands still or runs backwards: there was a byte too many.
                0 | 0x8000_0000.. => 1,
                ahead => ahead - 1,
            },
        };
        Some(Sample { index, counts, lost })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    extern crate std;
    use std::vec::Vec;

    /// A swing of some hundred counts with a ripple, and now and then a step that needs the wide form.
    fn counts(index: u32) -> u16 {
        let step = if index % 50 < 3 { 1000 } else { 0 };
        let phase = (index % 400) as i32;
        let triangle = if phase < 200 { phase } else { 400 - phase };
        (2048 + step + 6 * triangle + ((index * 7919) % 13) as i32) as u16
    }

    fn encode(from: u32, n: u32) -> Vec<u8> {
        let mut encoder = Encoder::default();
        let mut out = Vec::new();
        for index in from..from + n {
            encoder.encode(index, counts(index), &mut out);
        }
        out
    }

    fn decode(decoder: &mut Decoder, bytes: &[u8]) -> Vec<Sample> {
        bytes.iter().filter_map(|b| decoder.decode(*b)).collect()
    }

    fn true_samples(from: u32, n: u32) -> Vec<Sample> {
        (from..from + n).map(|index| Sample { index, counts: counts(index), lost: 0 }).collect()
    }

    #[test]
    fn golden_bytes() {
        let mut encoder = Encoder::default();
        let mut out = Vec::new();
        let stream = [(7, 0x1234), (8, 0x1235), (9, 0x1233), (10, 0x2233), (12, 0x2233)];
        for (index, counts) in stream {
            encoder.encode(index, counts, &mut out);
        }
        assert_eq!(out[..9], [0x80, 7, 0, 0, 0, 0x34, 0x12, 0x34, 0x12]);
        assert_eq!(out[11..16], [0x01, 0xfe, 0x81, 0x00, 0x10]);
        assert_eq!(out[16..25], [0x80, 12, 0, 0, 0, 0x33, 0x22, 0x33, 0x22]);
        // CRC-16/IBM-SDLC (X.25) of the eight bytes before it, by the bitwise definition.
        let mut crc = 0xffff_u16;
        for byte in &out[1..9] {
            crc ^= u16::from(*byte);
            for _ in 0..8 {
                crc = if crc & 1 == 1 { (crc >> 1) ^ 0x8408 } else { crc >> 1 };
            }
        }
        assert_eq!(out[9..11], (!crc).to_le_bytes());
    }

    #[test]
    fn what_is_encoded_is_decoded_at_little_more_than_a_byte_a_sample() {
        let bytes = encode(0, 10_000);
        assert_eq!(decode(&mut Decoder::default(), &bytes), true_samples(0, 10_000));
        assert!(bytes.len() <= 11_300, "{} bytes", bytes.len());
    }

    #[test]
    fn every_step_between_two_samples_survives() {
        let mut encoder = Encoder::default();
        let mut out = Vec::new();
        let mut sent = Vec::new();
        for step in (0..=u16::MAX).step_by(97).chain([125, 126, 127, 128, 129, u16::MAX]) {
            for counts in [0, step, 0, u16::MAX - step, u16::MAX] {
                encoder.encode(sent.len() as u32, counts, &mut out);
                sent.push(counts);
            }
        }
        let got = decode(&mut Decoder::default(), &out);
        assert!(got.iter().all(|s| s.lost == 0));
        assert_eq!(got.iter().map(|s| s.counts).collect::<Vec<_>>(), sent);
    }

    #[test]
    fn the_index_wraps_without_a_loss() {
        let mut encoder = Encoder::default();
        let mut out = Vec::new();
        for k in 0..1000_u32 {
            encoder.encode((u32::MAX - 300).wrapping_add(k), counts(k), &mut out);
        }
        let got = decode(&mut Decoder::default(), &out);
        assert_eq!(got.len(), 1000);
        assert!(got.iter().all(|s| s.lost == 0));
    }

    #[test]
    fn a_gap_says_how_many_are_missing() {
        let mut encoder = Encoder::default();
        let mut out = Vec::new();
        for index in (0..100).chain(142..200) {
            encoder.encode(index, counts(index), &mut out);
        }
        let got = decode(&mut Decoder::default(), &out);
        assert_eq!(got.len(), 158);
        assert_eq!(got[100], Sample { index: 142, counts: counts(142), lost: 42 });
        assert_eq!(got.iter().map(|s| s.lost).sum::<u32>(), 42);
    }

    #[test]
    fn after_an_overrun_nothing_counts_until_the_next_absolute_sample() {
        let bytes = encode(0, 1000);
        for at in 0..bytes.len() {
            let mut decoder = Decoder::default();
            let mut got = decode(&mut decoder, &bytes[..at]);
            decoder.overrun();
            got.extend(decode(&mut decoder, &bytes[at + 1..]));
            // Every sample given out is the true one, and those missing are counted.
            let mut expected = got.first().map_or(0, |s| s.index);
            for sample in &got {
                expected += sample.lost;
                assert_eq!((sample.index, sample.counts), (expected, counts(expected)), "at {at}");
                expected += 1;
            }
        }
    }

    #[test]
    fn one_byte_lost_added_or_changed_is_always_reported() {
        let bytes = encode(0, 2000);
        let first = 11; // Before the first sample is through there is nothing to lose.
        let end = bytes.len() - 2 * ABSOLUTE_EVERY as usize; // Beyond, nothing follows to show it.
        for at in first..end {
            for what in 0..3 {
                let mut damaged = bytes.clone();
                match what {
                    0 => drop(damaged.remove(at)),
                    1 => damaged.insert(at, 0x05),
                    _ => damaged[at] ^= 0x11,
                }
                let got = decode(&mut Decoder::default(), &damaged);
                let reported = got.iter().position(|s| s.lost > 0);
                let wrong = |s: &Sample| s.counts != counts(s.index);
                // The end of the stream is right again, and if a wrong sample got through before,
                // a loss is reported no later than two absolute samples after it.
                let last = got.last().expect("samples");
                assert_eq!((last.index, last.counts), (1999, counts(1999)), "at {at}, {what}");
                if let Some(first_wrong) = got.iter().position(wrong) {
                    let reported = reported.unwrap_or_else(|| panic!("silent at {at}, {what}"));
                    let late = reported.saturating_sub(first_wrong);
                    assert!(late <= 2 * ABSOLUTE_EVERY as usize, "at {at}, {what}: {late} late");
                } else if got.len() < 2000 {
                    assert!(reported.is_some(), "loss not reported at {at}, {what}");
                }
            }
        }
    }

    #[test]
    fn a_stream_joined_in_the_middle_starts_at_the_next_absolute_sample() {
        let bytes = encode(0, 1000);
        let got = decode(&mut Decoder::default(), &bytes[300..]);
        assert_eq!(got[0].index % ABSOLUTE_EVERY, 0);
        assert!(got.iter().all(|s| s.counts == counts(s.index) && s.lost == 0));
        assert!(!got.is_empty());
    }

    #[test]
    fn noise_gives_no_sample() {
        let mut decoder = Decoder::default();
        let mut state = 1_u32;
        let mut samples = 0;
        for _ in 0..20_000 {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            samples += u32::from(decoder.decode((state >> 24) as u8).is_some());
        }
        assert_eq!(samples, 0);
    }
}
