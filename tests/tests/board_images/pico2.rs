//! Raspberry Pi's Pico 2.

use crate::harness::{Board, Memory};
use crate::rp::{each_rp_board, KEPT_BYTES, PAGE, SECTOR};

pub struct Pico2;

impl Board for Pico2 {
    const NAME: &'static str = "pico2";
    const CLOCK_U_PPM: f32 = 17.0;
    const KEPT_BYTES: usize = KEPT_BYTES;
    type Flash = Memory<PAGE, SECTOR>;
}

each_rp_board!(Pico2, 0x1000_0000..0x103b_0000, "A1C90B7A6F5E4D3C");
