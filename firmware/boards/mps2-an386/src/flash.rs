//! What stands in for flash on a board that has none: RAM outside the firmware's own, empty after
//! every start.

use core::mem::{size_of, MaybeUninit};
use core::ptr::addr_of_mut;
use yawrig_firmware::slots::{Flash, FlashFault, MemoryFlash, Sector, ERASED, SLOT_BYTES};

#[link_section = ".flash_stand_in"]
static mut STAND_IN: MaybeUninit<MemoryFlash> = MaybeUninit::uninit();

/// The slots. Without the lock: with it the code would not keep to its 64 KiB.
pub struct StandIn(&'static mut MemoryFlash);

impl Flash for StandIn {
    const LOCKABLE: bool = false;

    fn read(&self, sector: Sector) -> &[u8; SLOT_BYTES] {
        self.0.read(sector)
    }

    fn erase(&mut self, sector: Sector) -> Result<(), FlashFault> {
        self.0.erase(sector)
    }

    fn program(&mut self, sector: Sector, offset: usize, word: [u8; 4]) -> Result<(), FlashFault> {
        self.0.program(sector, offset, word)
    }
}

/// The slots, erased.
///
/// # Safety
/// Called once.
pub unsafe fn erased() -> StandIn {
    let slots = addr_of_mut!(STAND_IN);
    // SAFETY: bytes throughout, of which any value is one; the only reference, since there is only this call. Not
    // by a value of its type, which would lie on the stack.
    unsafe {
        slots.cast::<u8>().write_bytes(ERASED, size_of::<MemoryFlash>());
        StandIn((*slots).assume_init_mut())
    }
}
