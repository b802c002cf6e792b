//! The one checksum of frames, blobs and slots.

use crate::source::Source;
use core::ops::Range;
use crc::{Crc, CRC_32_ISO_HDLC};

const CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);

/// CRC-32 (ISO-HDLC, the one of zip and Ethernet).
pub fn crc32(bytes: &[u8]) -> u32 {
    CRC.checksum(bytes)
}

/// The same of parts, one behind the other.
pub fn crc32_of(parts: &[&[u8]]) -> u32 {
    let mut digest = CRC.digest();
    parts.iter().for_each(|part| digest.update(part));
    digest.finalize()
}

/// The same of bytes that are read piece by piece; none where they cannot be.
pub fn crc32_of_pieces(places: Range<usize>, source: &mut Source) -> Option<u32> {
    let mut digest = CRC.digest();
    let mut room = [0; 32];
    let mut at = places.start;
    while at < places.end {
        let length = room.len().min(places.end - at);
        let piece = room.get_mut(..length)?;
        if !source(at, piece) {
            return None;
        }
        digest.update(piece);
        at += length;
    }
    Some(digest.finalize())
}
