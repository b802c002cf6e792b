//! What stands in for flash on a board that has none: RAM outside the firmware's own, empty after
//! every start.

use core::mem::{size_of, MaybeUninit};
use core::ptr::addr_of_mut;
use yawrig_firmware::slots::{MemoryFlash, ERASED};

/// With room for a log.
pub type Flash = MemoryFlash<8>;

#[link_section = ".flash_stand_in"]
static mut STAND_IN: MaybeUninit<Flash> = MaybeUninit::uninit();

/// The slots, erased.
///
/// # Safety
/// Called once.
pub unsafe fn erased() -> &'static mut Flash {
    // SAFETY: the only reference, since there is only this call.
    unsafe { erase(addr_of_mut!(STAND_IN)) }
}

/// The same of other RAM.
///
/// # Safety
/// There is no other reference to it.
pub unsafe fn erase(slots: *mut MaybeUninit<Flash>) -> &'static mut Flash {
    // SAFETY: bytes throughout, of which any value is one. Not by a value of its type, which would lie on the
    // stack.
    unsafe {
        slots.cast::<u8>().write_bytes(ERASED, size_of::<Flash>());
        (*slots).assume_init_mut()
    }
}
