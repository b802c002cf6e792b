//! How deep the stack has been: what lies below it is painted, and later looked at again.

use core::ptr::{addr_of, read_volatile, write_volatile};
use cortex_m::register::msp;

const PAINT: u32 = 0x5afe_5afe;
/// Left alone below the stack pointer: what `paint` itself needs.
const OWN_BYTES: usize = 256;

extern "C" {
    /// First address above the stack, which grows down; from cortex-m-rt.
    static _stack_start: u32;
    /// First address above the variables.
    static __sheap: u32;
}

fn lowest() -> usize {
    addr_of!(__sheap) as usize
}

/// Paints all the RAM between the variables and the stack.
#[inline(never)]
pub fn paint() {
    let end = msp::read() as usize - OWN_BYTES;
    for address in (lowest()..end).step_by(4) {
        // SAFETY: aligned RAM that no variable has, below all that is on the stack.
        unsafe { write_volatile(address as *mut u32, PAINT) };
    }
}

/// Bytes of the deepest stack since [`paint`]; `None` where no paint is left, so that it may have been
/// deeper.
pub fn deepest() -> Option<usize> {
    let top = addr_of!(_stack_start) as usize;
    // SAFETY: aligned RAM.
    let first = (lowest()..top)
        .step_by(4)
        .find(|at| unsafe { read_volatile(*at as *const u32) } != PAINT)?;
    (first > lowest()).then_some(top - first)
}
