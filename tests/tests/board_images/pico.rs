//! Raspberry Pi's Pico.

use crate::harness::{Board, Memory};
use crate::rp::{each_rp_board, KEPT_BYTES, PAGE, SECTOR};

pub struct Pico;

impl Board for Pico {
    const NAME: &'static str = "pico";
    const CLOCK_U_PPM: f32 = 17.0;
    const KEPT_BYTES: usize = KEPT_BYTES;
    type Flash = Memory<PAGE, SECTOR>;
}

each_rp_board!(Pico, 0x1000_0100..0x101b_0000, "E6612483CB1F4D27");
