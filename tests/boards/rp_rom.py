"""The boot ROM of Raspberry Pi's processors as far as the images call it: what looks functions up, and those for the flash. The
processor is stopped where one begins; what they do is done here.

Between the first of them and the end of what sets up reading nothing may come from the flash's window, neither code nor data:
reading or running there ends the run. The chip is kinder (after `flash_exit_xip` it reads slowly), but not while it is at work.
"""

import struct

from unicorn import UC_HOOK_CODE, UC_PROT_EXEC, UC_PROT_NONE, UC_PROT_READ
from unicorn.arm_const import UC_ARM_REG_R0, UC_ARM_REG_R1, UC_ARM_REG_R2, UC_ARM_REG_R3

FLASH = 0x1000_0000
# What the image may change: the flash's last 320 KiB, the log and the networks' places.
PLACES_BYTES = 64 << 10
KEPT_BYTES = PLACES_BYTES + (256 << 10)
# A sector takes as long as one may (W25Q16JV data sheet, 9.6).
PAGE, SECTOR, SECTOR_US, PAGE_US = 256, 4096, 400_000, 400
NAMES = {b"IF": "connect", b"EX": "exit_xip", b"RE": "erase", b"RP": "write", b"FC": "flush"}


class Rom:
    LOOKUP, FUNCTIONS, LENGTH = 0x100, 0x200, 16

    def __init__(self, board, kept):
        self.board, self.uc = board, board.uc
        self.flash_bytes, self.kept_at = board.FLASH_BYTES, board.FLASH_BYTES - KEPT_BYTES
        self.is_connected, self.is_serial, self.is_stale, self.cut_after = False, False, False, None
        self.uc.mem_write(FLASH + self.kept_at, kept)
        # Where each begins, a jump to itself.
        places = {self.LOOKUP: "lookup"}
        places |= {self.FUNCTIONS + self.LENGTH * k: name for k, name in enumerate(NAMES.values())}
        for at in places:
            self.uc.mem_write(at, b"\xfe\xe7")
        end = self.FUNCTIONS + self.LENGTH * len(NAMES)
        self.uc.hook_add(UC_HOOK_CODE, lambda _, at, *__: board.trap(places[at]), begin=self.LOOKUP, end=end)
        self.window(True)

    def window(self, is_open):
        self.is_open = is_open
        self.uc.mem_protect(FLASH, self.flash_bytes, UC_PROT_READ | UC_PROT_EXEC if is_open else UC_PROT_NONE)

    def kept(self):
        return bytes(self.uc.mem_read(FLASH + self.kept_at, KEPT_BYTES))

    def leave_quad(self):
        """What a chip's own does beside."""

    def flush(self):
        self.is_stale = False

    def call(self, name):
        r0, r1, r2, r3 = (self.uc.reg_read(r) for r in (UC_ARM_REG_R0, UC_ARM_REG_R1, UC_ARM_REG_R2, UC_ARM_REG_R3))
        if name == "lookup":
            code = struct.pack("<H", self.looked_up())
            assert code in NAMES, f"{code} is looked up"
            self.uc.reg_write(UC_ARM_REG_R0, self.FUNCTIONS + self.LENGTH * list(NAMES).index(code) | 1)
        elif name == "connect":
            self.is_connected = True
        elif name == "exit_xip":
            assert self.is_connected, "exit_xip before the flash is connected"
            self.is_serial = True
            self.leave_quad()
            self.window(False)
        elif name == "set_up":
            assert not self.is_stale, "reading is set up before the cache is flushed"
            self.is_connected = self.is_serial = False
            self.window(True)
        elif name == "flush":
            self.flush()
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
        assert offset % unit == 0 and self.kept_at <= offset < self.flash_bytes, f"{offset:#x} is changed, which holds code"
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
