"""An RP2350 that executes the unmodified image for Raspberry Pi's Pico 2: unicorn is its Cortex-M33; rp.py has the rest, by the
RP2350's datasheet, whose sections stand beside what is its own.

    pico2.py ELF
"""

import struct

from rp import Machine
from rp_rom import FLASH, Rom
from unicorn.arm_const import UC_ARM_REG_R0, UC_ARM_REG_R1, UC_CPU_ARM_CORTEX_M33

BOOT_RAM, BOOT_RAM_BYTES = 0x400E_0000, 0x400
# An address of APB at which there is nothing.
TRAP = 0x401F_0000
ARM_SECURE = 4  # 5.4.1, flag of a function for Arm's secure state
# 13.10: CHIPID0 to CHIPID3, two rows a word (13.1.1).
OTP_DATA = 0x4013_0000
CHIP_ID = {OTP_DATA: 0x6F5E_4D3C, OTP_DATA + 4: 0xA1C9_0B7A}


class Pico2(Machine):
    CPU, VECTORS, RAM_BYTES, FRAME_BYTES = UC_CPU_ARM_CORTEX_M33, FLASH, 520 << 10, 26 * 4
    FLASH_BYTES = 4 << 20
    # 2.2.4
    CLOCKS, RESETS, PSM, XOSC = 0x4001_0000, 0x4002_0000, 0x4001_8000, 0x4004_8000
    PLL_SYS, PLL_USB = 0x4005_0000, 0x4005_8000
    ADC, TIMER, WATCHDOG, TICKS = 0x400A_0000, 0x400B_0000, 0x400D_8000, 0x4010_8000
    CHIP_RESET, HAD_POWER = 0x4010_002C, 1 << 16  # 6.4: HAD_POR
    CLK_USB, CLK_ADC, DIVIDER_AT = CLOCKS + 0x60, CLOCKS + 0x6C, 16  # 8.1.6
    # 12.6.10: where in a channel's control its fields are; the converter's request.
    INCR_WRITE, RING_SIZE, CHAIN_TO, TREQ, BUSY, DREQ_ADC = 6, 8, 13, 17, 1 << 26, 48
    DMA_ABORT, COUNT = 0x5000_0464, 0x0FFF_FFFF
    OUT_SET, OUT_CLR = 0xD000_0018, 0xD000_0020  # 3.1.3
    USB_CONTROL, HAS_E5 = 4, False  # 12.7.4: PHY_ISO
    WATCHDOG_TICKS = 1

    def make_rom(self, kept):
        return BootRom(self, kept)

    def first(self):
        return CHIP_ID

    def own(self, at):
        return BOOT_RAM <= at < BOOT_RAM + BOOT_RAM_BYTES

    def read_own(self, at):
        return self.rom.read(at)

    def write_own(self, at, value):
        if at == TRAP:
            self.trap("set_up")

    def tick_hz(self, tick):
        """8.5: cycles of the reference clock, here the crystal (8.1.6: CLK_REF from XOSC), to a tick."""
        at = self.TICKS + {"timer": 0x18, "watchdog": 0x30}[tick]
        assert self.registers[at] & 1 and self.crystal_is_reference(), "no tick from the crystal"
        return 12e6 / self.registers[at + 4]


class BootRom(Rom):
    """5.4: its table of functions is behind one that looks them up; one is left in boot RAM, which sets up reading."""

    def __init__(self, board, kept):
        super().__init__(board, kept)
        # 5.4.1: magic and version; a pointer of 16 bits to the function that looks others up.
        self.uc.mem_write(0x10, b"Mu\1\2" + struct.pack("<2xH", self.LOOKUP | 1))
        # ldr r12, [pc, #8]; str r12, [r12]; bx lr; nop; .word: told by a store, wherever it is run.
        self.set_up_code = struct.pack("<6HI", 0xF8DF, 0xC008, 0xF8CC, 0xC000, 0x4770, 0xBF00, TRAP).ljust(BOOT_RAM_BYTES, b"\0")

    def looked_up(self):
        code, flags = self.uc.reg_read(UC_ARM_REG_R0), self.uc.reg_read(UC_ARM_REG_R1)
        assert flags & ARM_SECURE, f"{code:#x} is looked up"
        return code

    def read(self, at):
        return struct.unpack_from("<I", self.set_up_code, at - BOOT_RAM)[0]


if __name__ == "__main__":
    Pico2.main()
