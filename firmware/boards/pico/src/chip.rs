//! What is this board's and chip's own, by the RP2040's datasheet.

pub const FLASH_BYTES: usize = 2 * 1024 * 1024;
/// CHIP_RESET of VREG_AND_CHIP_RESET (2.10.6): power came, or had been too low; the pin RUN was low.
pub const HAD_POWER_ON: u32 = 1 << 8;
pub const HAD_RUN_LOW: u32 = 1 << 16;
