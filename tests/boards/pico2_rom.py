"""RP2350's boot ROM as far as the image calls it (datasheet 5.4): the table of its functions, those for the flash, and the
function that it leaves in boot RAM, which sets up reading. All are told by a store to TRAP, which stops the processor; what
they do is done here.

Between the first of them and that function nothing may come from the flash's window, neither code nor data: reading or
running there ends the run. The chip is kinder (after `flash_exit_xip` it reads slowly), but not while it is at work.
"""

import struct

from unicorn import UC_PROT_EXEC, UC_PROT_NONE, UC_PROT_READ
from unicorn.arm_const import UC_ARM_REG_R0, UC_ARM_REG_R1, UC_ARM_REG_R2, UC_ARM_REG_R3

FLASH, FLASH_BYTES = 0x1000_0000, 4 << 20
# What the image may change: its last 64 KiB.
KEPT_BYTES = 64 << 10
KEPT = FLASH_BYTES - KEPT_BYTES
BOOT_RAM = 0x400E_0000
# An address of APB at which there is nothing.
TRAP = 0x401F_0000
LOOKUP, FUNCTIONS = 0x100, 0x200
ARM_SECURE = 4  # 5.4.1, flag of a function for Arm's secure state
PAGE, SECTOR, SECTOR_US, PAGE_US = 256, 4096, 45_000, 400
NAMES = {b"IF": "connect", b"EX": "exit_xip", b"RE": "erase", b"RP": "write", b"FC": "flush"}


def stub(index):
    """ldr r12, [pc, #8]; str r12, [r12]; bx lr; nop; .word"""
    return struct.pack("<6HI", 0xF8DF, 0xC008, 0xF8CC, 0xC000, 0x4770, 0xBF00, TRAP + 4 * index)


class Rom:
    def __init__(self, board, kept):
        self.board, self.uc = board, board.uc
        self.is_connected, self.is_serial, self.is_stale, self.asked = False, False, False, (0, 0)
        self.cut_after = None
        self.uc.mem_write(FLASH + KEPT, kept)
        # 5.4.1: magic and version; a pointer of 16 bits to the function that looks others up.
        self.uc.mem_write(0x10, b"Mu\1\2" + struct.pack("<2xH", LOOKUP | 1))
        # ldr r2, [pc, #8]; str r0, [r2]; str r1, [r2, #4]; ldr r0, [r2, #8]; bx lr; nop; .word
        self.uc.mem_write(LOOKUP, struct.pack("<6HI", 0x4A02, 0x6010, 0x6051, 0x6890, 0x4770, 0xBF00, TRAP + 0x100))
        for index in range(len(NAMES)):
            self.uc.mem_write(FUNCTIONS + 16 * index, stub(index))
        self.set_up = stub(len(NAMES)).ljust(256, b"\0")
        self.window(True)

    def window(self, is_open):
        self.is_open = is_open
        self.uc.mem_protect(FLASH, FLASH_BYTES, UC_PROT_READ | UC_PROT_EXEC if is_open else UC_PROT_NONE)

    def kept(self):
        return bytes(self.uc.mem_read(FLASH + KEPT, KEPT_BYTES))

    def read(self, at):
        """Boot RAM; what was looked up."""
        if BOOT_RAM <= at < BOOT_RAM + 256:
            return struct.unpack_from("<I", self.set_up, at - BOOT_RAM)[0]
        assert at == TRAP + 0x108, f"a read at {at:#x}"
        code, flags = self.asked
        name = struct.pack("<H", code)
        assert flags & ARM_SECURE and name in NAMES, f"{name} is looked up"
        return FUNCTIONS + 16 * list(NAMES).index(name) | 1

    def write(self, at, value):
        if at in (TRAP + 0x100, TRAP + 0x104):
            code, flags = self.asked
            self.asked = (value, flags) if at == TRAP + 0x100 else (code, value)
            return
        # Done when the processor has stopped behind the call.
        self.board.trapped = [*NAMES.values(), "set_up"][(at - TRAP) // 4]
        self.uc.emu_stop()

    def call(self, name):
        r0, r1, r2, r3 = (self.uc.reg_read(r) for r in (UC_ARM_REG_R0, UC_ARM_REG_R1, UC_ARM_REG_R2, UC_ARM_REG_R3))
        if name == "connect":
            self.is_connected = True
        elif name == "exit_xip":
            assert self.is_connected, "exit_xip before the flash is connected"
            self.is_serial = True
            self.window(False)
        elif name == "set_up":
            assert not self.is_stale, "reading is set up before the cache is flushed"
            self.is_connected = self.is_serial = False
            self.window(True)
        elif name == "flush":
            self.is_stale = False
        elif name == "erase":
            assert r1 == SECTOR and (r2, r3 & 0xFF) == (1 << 16, 0xD8), f"erase({r0:#x}, {r1}, {r2}, {r3:#x})"
            self.change(r0, b"\xff" * SECTOR, SECTOR, SECTOR_US)
        elif name == "write":
            assert r2 == PAGE, f"write({r0:#x}, {r1:#x}, {r2})"
            page = bytes(self.uc.mem_read(r1, PAGE))
            # Programming only clears bits; the device keeps to flash that takes no page twice.
            assert bytes(self.uc.mem_read(FLASH + r0, PAGE)) == b"\xff" * PAGE, f"{r0:#x} is written twice"
            self.change(r0, page, PAGE, PAGE_US)

    def change(self, offset, now, unit, us):
        assert self.is_serial, "the flash is not in its serial state"
        assert offset % unit == 0 and KEPT <= offset < FLASH_BYTES, f"{offset:#x} is changed, which holds code"
        self.is_stale = True
        if self.cut_after is not None:
            self.cut_after -= 1
            if self.cut_after < 0:
                # Power goes when so much of it is done.
                now = now[:int(self.cut_part * unit)]
        self.uc.mem_write(FLASH + offset, now)
        if self.cut_after is not None and self.cut_after < 0:
            self.board.restart("power")
        else:
            self.board.pass_in_rom(us)
