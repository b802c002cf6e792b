//! The chip's number as USB tells it, by which a host finds the same board again at another plug.

/// Hexadecimal digits of CHIPID0 to CHIPID3, the first rows of the one-time programmable memory (RP2350 datasheet, 13.10),
/// the first one last.
pub fn digits(rows: [u16; 4]) -> [u8; 16] {
    core::array::from_fn(|index| {
        let digit = rows[3 - index / 4] >> (12 - 4 * (index % 4)) & 0xf;
        b"0123456789ABCDEF"[usize::from(digit)]
    })
}
