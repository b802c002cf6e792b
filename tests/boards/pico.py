"""An RP2040 that executes the unmodified image for Raspberry Pi's Pico: unicorn is its Cortex-M0+ (a Cortex-M0, with the table of
vectors where the image says); rp.py has the rest, by the RP2040's datasheet, whose sections stand beside what is its own.

    pico.py ELF

The second stage of the boot is executed, when power comes and after each work on the flash: the boot ROM checks it and runs it
in RAM, it makes the flash read by four lines, and only then anything can be read from there.
"""

import struct

from rp import Machine
from rp_rom import FLASH, Rom
from unicorn.arm_const import UC_ARM_REG_LR, UC_ARM_REG_R0, UC_ARM_REG_R1, UC_ARM_REG_SP, UC_CPU_ARM_CORTEX_M0

CHIP_ID = 0x4000_0000  # 2.20.2: revision B1, which has RP2040-E1 and -E5
BOOT2_BYTES, BOOT2_RAM = 256, 0x2004_1F00  # 2.8.1.3
TABLE = 0x80
UNIQUE_ID = bytes.fromhex("E6612483CB1F4D27")
# 2.19.6.2: GPIO_QSPI_SS_CTRL, OUTOVER low and high.
SS_CTRL, LOW, HIGH = 0x4001_800C, 2, 3
# 4.10.13: the SSI.
SSI, SSI_BYTES = 0x1800_0000, 0x1000
CTRLR0, SSIENR, SR, DR0, SPI_CTRLR0 = 0, 8, 0x28, 0x60, 0xF4
ROOM = 16
# W25Q16JV data sheet, 8.2.
WRITE_ENABLE, WRITE_STATUS, STATUS, STATUS_2, READ_UNIQUE_ID, READ_QUAD = 0x06, 0x01, 0x05, 0x35, 0x4B, 0xEB
QUAD_ENABLED, CONTINUOUS = 2, 0xA0


class Pico(Machine):
    CPU, VECTORS, RAM_BYTES, FRAME_BYTES = UC_CPU_ARM_CORTEX_M0, FLASH + BOOT2_BYTES, 264 << 10, 8 * 4
    FLASH_BYTES = 2 << 20
    # 2.2.4
    CLOCKS, RESETS, PSM, XOSC = 0x4000_8000, 0x4000_C000, 0x4001_0000, 0x4002_4000
    PLL_SYS, PLL_USB = 0x4002_8000, 0x4002_C000
    ADC, TIMER, WATCHDOG = 0x4004_C000, 0x4005_4000, 0x4005_8000
    CHIP_RESET, HAD_POWER = 0x4006_4008, 1 << 8  # 2.10.6: HAD_POR
    CLK_USB, CLK_ADC, DIVIDER_AT = CLOCKS + 0x54, CLOCKS + 0x60, 8  # 2.15.7
    # 2.5.7: where in a channel's control its fields are; 2.5.3.1: the converter's request.
    INCR_WRITE, RING_SIZE, CHAIN_TO, TREQ, BUSY, DREQ_ADC = 5, 6, 11, 15, 1 << 24, 36
    DMA_ABORT, COUNT = 0x5000_0444, 0xFFFF_FFFF
    OUT_SET, OUT_CLR = 0xD000_0014, 0xD000_0018  # 2.3.1.7
    USB_CONTROL, HAS_E5 = 0, True  # 4.1.4
    WATCHDOG_TICKS = 2  # RP2040-E1: it counts twice a tick

    def make_rom(self, kept):
        return BootRom(self, kept)

    def first(self):
        return {CHIP_ID: 1 << 28 | 0x2927}

    def map_own(self):
        self.uc.mmio_map(SSI, SSI_BYTES, lambda _, at, size, __: self.rom.read(at), None,
                         lambda _, at, size, value, __: self.rom.write(at, value), None)

    def own(self, at):
        return False

    def write_own(self, at, value):
        if at == SS_CTRL:
            self.rom.select(value >> 8 & 3)

    def boot(self):
        """2.8.1.3: the second stage is run if its checksum is right; it goes on at the program's reset vector."""
        code = bytes(self.uc.mem_read(FLASH, BOOT2_BYTES))
        assert crc32(code[:-4]) == struct.unpack("<I", code[-4:])[0], "the second stage's checksum is wrong"
        entry = self.pc
        self.uc.mem_write(BOOT2_RAM, code)
        self.uc.reg_write(UC_ARM_REG_SP, BOOT2_RAM)
        self.uc.reg_write(UC_ARM_REG_LR, 0)
        self.pc = BOOT2_RAM | 1
        self.go(entry & ~1)
        assert self.pc == entry, "it does not come to the program"

    def tick_hz(self, tick):
        """4.7.6: the watchdog's TICK is the timer's, too; cycles of the reference clock, here the crystal (2.15.7)."""
        control = self.registers[self.WATCHDOG + 0x2C]
        assert control & 1 << 9 and self.crystal_is_reference(), "no tick from the crystal"
        return 12e6 / (control & 0x1FF)


def crc32(data):
    """Its polynomial forwards, from all ones, neither end inverted."""
    crc = 0xFFFF_FFFF
    for byte in data:
        crc ^= byte << 24
        for _ in range(8):
            crc = crc << 1 & 0xFFFF_FFFF ^ (0x04C1_1DB7 if crc >> 31 else 0)
    return crc


class BootRom(Rom):
    """2.8.3: a table of functions, and one that looks them up in it; the SSI and the flash behind it, command by command."""

    def __init__(self, board, kept):
        super().__init__(board, kept)
        # 2.8.3: magic and version; pointers of 16 bits: the table of functions, that of data, what looks up.
        self.uc.mem_write(0x10, b"Mu\1\3" + struct.pack("<3H", TABLE, 0, self.LOOKUP | 1))
        self.registers = {}
        self.over, self.sending, self.received, self.read_quad = 0, bytearray(), [], False
        self.may_write, self.status_2 = False, 0
        self.is_serial = True
        self.window(False)

    def looked_up(self):
        table, code = self.uc.reg_read(UC_ARM_REG_R0), self.uc.reg_read(UC_ARM_REG_R1)
        assert table == TABLE, f"{code:#x} is looked up at {table:#x}"
        return code

    def leave_quad(self):
        # 2.8.3.1.3: the SSI sends bytes by one line.
        self.registers[CTRLR0], self.registers[SSIENR], self.read_quad = 7 << 16, 1, False

    def flush(self):
        super().flush()
        self.select(0)

    def select(self, over):
        """A command ends where the chip is not selected any more."""
        if self.over == LOW and over != LOW:
            self.end()
        self.over = over

    def end(self):
        command, self.sending = bytes(self.sending), bytearray()
        if command == bytes([WRITE_ENABLE]):
            self.may_write = True
        elif command[:1] == bytes([WRITE_STATUS]) and self.may_write:
            self.status_2, self.may_write = command[2], False

    def answer(self, sent):
        """What comes back with the last byte that was sent."""
        command, after = sent[0], len(sent) - 1
        assert command in (STATUS, STATUS_2, READ_UNIQUE_ID, WRITE_ENABLE, WRITE_STATUS), f"the flash is told {sent.hex()}"
        if command == STATUS and after:
            return 0
        if command == STATUS_2 and after:
            return self.status_2
        if command == READ_UNIQUE_ID and after >= 5:
            return UNIQUE_ID[(after - 5) % 8]
        return 0xFF

    def is_quad(self):
        return self.registers.get(CTRLR0, 0) >> 21 & 3 == 2

    def read(self, at):
        if at == SR:  # TFE, TFNF, RFNE; all is sent at once, and without a pin forced low a command ends by that
            if self.over != LOW and self.sending:
                self.end()
            return 1 << 2 | 1 << 1 | bool(self.received) << 3
        if at == DR0:
            return self.received.pop(0)
        return self.registers.get(at, 0)

    def write(self, at, value):
        self.registers[at] = value
        if at == SSIENR:
            self.received.clear()
            # CTRLR0: by four lines, 32 bits, a command then an answer; SPI_CTRLR0: no command but mode bits, 8 of 4 bits.
            settings = self.registers.get(CTRLR0, 0), self.registers.get(SPI_CTRLR0, 0)
            if value & 1 and self.read_quad and settings == (2 << 21 | 31 << 16 | 3 << 8, CONTINUOUS << 24 | 4 << 11 | 8 << 2 | 2):
                if not self.is_open:
                    self.board.trap("set_up", returns=False)
        elif at == DR0:
            assert self.registers.get(SSIENR, 0) & 1 and self.is_serial and self.over != HIGH, "nothing is sent"
            self.sending.append(value & 0xFF)
            if self.is_quad():
                assert self.status_2 == QUAD_ENABLED, "the flash has not been told of four lines"
                self.read_quad = bytes(self.sending) == bytes([READ_QUAD, CONTINUOUS])
                if self.read_quad:
                    self.sending.clear()
                return
            self.received.append(self.answer(bytes(self.sending)))
            assert len(self.received) <= ROOM, "more is received than there is room for"


if __name__ == "__main__":
    Pico.main()
