//! The board's number as USB tells it, by which a host finds the same board again at another plug.

/// Its hexadecimal digits.
pub fn digits(number: u64) -> [u8; 16] {
    core::array::from_fn(|index| b"0123456789ABCDEF"[(number >> (60 - 4 * index)) as usize & 0xf])
}
