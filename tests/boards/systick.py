"""The architecture's SysTick (PM0214, 4.4 and 4.5), which is exception 15, and how its handler is run: the program is stopped
where it is due, at an instruction that is done again after it.
"""

import struct

from unicorn.arm_const import UC_ARM_REG_LR, UC_ARM_REG_PC, UC_ARM_REG_PRIMASK, UC_ARM_REG_SP

SYSTEM, SYSTEM_BYTES, SYSTICK, VTOR = 0xE000_0000, 1 << 20, 0xE000_E010, 0xE000_ED08
# On, with its exception, by the processor's clock.
SYSTICK_ON, SYSTICK_VECTOR = 0b111, 15
# A place to return to that is none of an image's.
RETURN, RETURN_BYTES = 0x1FFF_0000, 0x1000


class SysTick:
    """A board has `FRAME_BYTES`, which an exception stacks, and `processor_hz()`."""

    def map_system(self):
        self.uc.mem_map(RETURN, RETURN_BYTES)
        self.uc.mem_map(SYSTEM, SYSTEM_BYTES)
        self.uc.mem_write(VTOR, struct.pack("<I", self.VECTORS))
        self.pending, self.handling, self.ticked, self.interrupts = False, False, 0, 0

    def vectors(self):
        """Where the table of vectors is."""
        return struct.unpack("<I", bytes(self.uc.mem_read(VTOR, 4)))[0]

    def time_is(self, now, second):
        """`now` is in units of which a second has `second`."""
        control, reload = struct.unpack("<2I", bytes(self.uc.mem_read(SYSTICK, 8)))
        if control & SYSTICK_ON == SYSTICK_ON and now - self.ticked >= second * (reload + 1) / self.processor_hz():
            self.pending, self.ticked = True, now

    def has_interrupt(self):
        return self.pending and not self.handling and not self.uc.reg_read(UC_ARM_REG_PRIMASK) & 1

    def interrupt(self):
        """The handler: what the architecture stacks, and the registers as they were after it."""
        uc = self.uc
        before, program = uc.context_save(), self.pc
        stack = uc.reg_read(UC_ARM_REG_SP) - self.FRAME_BYTES & ~7
        uc.mem_write(stack, bytes(self.FRAME_BYTES))
        uc.reg_write(UC_ARM_REG_SP, stack)
        uc.reg_write(UC_ARM_REG_LR, RETURN | 1)
        self.pc, = struct.unpack("<I", bytes(uc.mem_read(self.vectors() + 4 * SYSTICK_VECTOR, 4)))
        self.pending, self.handling = False, True
        self.go(RETURN)
        assert uc.reg_read(UC_ARM_REG_PC) == RETURN and uc.reg_read(UC_ARM_REG_SP) == stack, "it does not return"
        uc.context_restore(before)
        self.pc, self.handling = program, False
        self.interrupts += 1
