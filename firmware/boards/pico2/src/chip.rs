//! What is this board's and chip's own, by the RP2350's datasheet.

pub const FLASH_BYTES: usize = 4 * 1024 * 1024;
/// POWMAN's CHIP_RESET (6.4): power came, or had been too low; the pin RUN was low.
pub const HAD_POWER_ON: u32 = 1 << 16 | 1 << 17;
pub const HAD_RUN_LOW: u32 = 1 << 18;
