"""An RP2350 that executes the unmodified image for Raspberry Pi's Pico 2 as far as its first seconds: unicorn is its
Cortex-M33, the registers that the image uses are modelled here from the RP2350's datasheet, whose sections stand beside
them.

    machine.py ELF SECONDS

The converter reads the middle of its range. Printed is `KEY=VALUE ...`: `samples` (sixteen conversions that DMA took to
memory each), `serial` (the chip's number, if it stands in RAM as text), `reset` (whether the watchdog did, and at how many ms), `polls` (looks at what USB has), `lit` (share of the last
second that the LED was on).

What it says nothing of: the host at the USB plug, the boot ROM and so the writing of the flash, how long the image takes (time
passes where the program looks for it).
"""

import struct
import sys
from collections import defaultdict

from elftools.elf.elffile import ELFFile
from unicorn import UC_ARCH_ARM, UC_MODE_MCLASS, UC_MODE_THUMB, Uc, UcError
from unicorn.arm_const import UC_ARM_REG_PC, UC_ARM_REG_SP, UC_CPU_ARM_CORTEX_M33

FLASH, FLASH_BYTES, RAM, RAM_BYTES = 0x1000_0000, 4 << 20, 0x2000_0000, 520 * 1024
# 2.2.4, 2.2.5: each peripheral's block, with aliases that flip, set and clear bits (2.1.3).
APB, AHB, SIO, BLOCK = 0x4000_0000, 0x5000_0000, 0xD000_0000, 0x20_0000
CLOCKS, RESETS, XOSC, PLL_SYS, PLL_USB = 0x4001_0000, 0x4002_0000, 0x4004_8000, 0x4005_0000, 0x4005_8000
ADC, TIMER0, WATCHDOG = 0x400A_0000, 0x400B_0000, 0x400D_8000
DMA, USB_DPRAM, USB = 0x5000_0000, 0x5010_0000, 0x5011_0000
ADC_CS, ADC_FCS, ADC_DIV, ADC_FIFO = ADC, ADC + 8, ADC + 0x10, ADC + 0xC
DMA_WRITE, DMA_COUNT, DMA_CTRL, DMA_COUNT_ALIAS, DMA_ABORT = DMA + 4, DMA + 8, DMA + 0xC, DMA + 0x1C, DMA + 0x464
WATCHDOG_CTRL, WATCHDOG_LOAD = WATCHDOG, WATCHDOG + 4
USB_INTS = USB + 0x98
OTP_DATA = 0x4013_0000
# 13.10: CHIPID0 to CHIPID3, two rows a word (13.1.1).
CHIP_ID, NUMBER = {OTP_DATA: 0x6F5E_4D3C, OTP_DATA + 4: 0xA1C9_0B7A}, b"A1C90B7A6F5E4D3C"
ADC_HZ, CONVERSIONS, MIDDLE, LED = 48_000_000, 16, 2048, 25
# Microseconds that go by with a look at the timer or at where DMA is.
LOOK_US = 10


class Machine:
    def __init__(self, elf):
        self.registers = defaultdict(int, CHIP_ID)
        self.now_us, self.converted, self.fed_us, self.dma_left = 0.0, 0.0, 0.0, None
        self.samples, self.reset_ms, self.polls, self.led, self.lit = 0, None, 0, 0, []
        self.uc = uc = Uc(UC_ARCH_ARM, UC_MODE_THUMB | UC_MODE_MCLASS)
        uc.ctl_set_cpu_model(UC_CPU_ARM_CORTEX_M33)
        for at, length in ((0, 32 << 10), (FLASH, FLASH_BYTES), (RAM, RAM_BYTES), (0xE000_0000, 1 << 20)):
            uc.mem_map(at, length)
        uc.mem_write(FLASH, b"\xff" * FLASH_BYTES)
        uc.mem_write(RAM, b"\xa5" * RAM_BYTES)
        with open(elf, "rb") as file:
            for segment in ELFFile(file).iter_segments():
                if segment["p_type"] == "PT_LOAD" and segment["p_filesz"]:
                    uc.mem_write(segment["p_paddr"], segment.data())
        for base in (APB, AHB, SIO):
            uc.mmio_map(base, BLOCK, lambda _, at, size, base: self.read(base + at, size), base,
                        lambda _, at, size, value, base: self.write(base + at, size, value), base)
        stack, self.pc = struct.unpack("<2I", bytes(uc.mem_read(FLASH, 8)))
        uc.reg_write(UC_ARM_REG_SP, stack)

    def read(self, at, size):
        if USB_DPRAM <= at < USB_DPRAM + 0x1000 or at >= SIO:
            word = at & ~3
        else:
            word = at & ~0x3003
        value = self.registers[word]
        if word == RESETS + 8:  # 7.5.3: RESET_DONE
            value = ~self.registers[RESETS]
        elif word == XOSC + 4:  # 8.2.8: STABLE, ENABLED
            value = 1 << 31 | 1 << 12
        elif word in (PLL_SYS, PLL_USB):  # 8.6.5: LOCK
            value |= 1 << 31
        elif word in (CLOCKS + 0x38, CLOCKS + 0x44):  # 8.1.6: SELECTED, one bit for each source
            value = 1 << (self.registers[word - 8] & 3)
        elif CLOCKS <= word < CLOCKS + 0x84 and (word - CLOCKS) % 12 == 8:
            value = 1
        elif word in (TIMER0 + 0x24, TIMER0 + 0x28):  # 12.8.5: TIMERAWH, TIMERAWL
            self.pass_us(LOOK_US if word == TIMER0 + 0x28 else 0)
            value = int(self.now_us) >> (32 if word == TIMER0 + 0x24 else 0)
        elif word == USB_INTS:  # 12.7.5: nothing has come
            self.polls += 1
        elif word == ADC_CS:  # 12.4.6: READY
            value |= 1 << 8
        elif word == ADC_FCS:  # 12.4.6: EMPTY; DMA is never too late here
            value = value & ~0xC00 | 1 << 8
        elif word == DMA_WRITE:
            self.pass_us(LOOK_US)
            value = self.registers[word]
        elif word == DMA_CTRL:  # 12.6.10: BUSY
            value = value & ~(1 << 26) | (self.runs() << 26)
        elif SIO + 0x100 <= word < SIO + 0x180:  # 3.1.4: a spinlock that was free
            value = 1
        return value >> 8 * (at & 3) & (1 << 8 * size) - 1

    def write(self, at, size, value):
        if USB_DPRAM <= at < USB_DPRAM + 0x1000 or at >= SIO:
            word, how = at & ~3, 0
        else:
            word, how = at & ~0x3003, at >> 12 & 3
        shift, old = 8 * (at & 3), self.registers[word]
        mask = (1 << 8 * size) - 1 << shift
        value = value << shift & mask
        value = (old & ~mask | value, old ^ value, old | value, old & ~value)[how]
        if word == SIO + 0x18 or word == SIO + 0x20:  # 3.1.3: GPIO_OUT_SET, GPIO_OUT_CLR
            if value >> LED & 1:
                self.led = int(word == SIO + 0x18)
            return
        self.registers[word] = value
        if word == WATCHDOG_LOAD:
            self.fed_us = self.now_us
        elif word == DMA_CTRL:  # 12.6.2: a write to the trigger register begins a sequence of so many transfers
            self.dma_left = self.registers[DMA_COUNT] & 0x0FFF_FFFF
        elif word == DMA_ABORT:
            self.dma_left = 0
            self.registers[word] = 0

    def runs(self):
        # 12.6.2.2.1: in mode 0xf the count does not go down; with a count of zero a channel halts at once in any mode.
        return int(bool(self.registers[DMA_CTRL] & 1 and self.dma_left))

    def pass_us(self, us):
        self.now_us += us
        control, count = self.registers[ADC_CS], self.registers[DMA_CTRL]
        # 12.4.6: EN, START_MANY; EN and DREQ_EN of its FIFO.
        if control & 9 == 9 and self.registers[ADC_FCS] & 9 == 9:
            self.converted += us * 1e-6 * ADC_HZ / ((self.registers[ADC_DIV] >> 8) + 1)
        else:
            self.converted = 0.0
        while self.converted >= 1.0:
            self.converted -= 1.0
            # 12.6.10, 12.6.4.1: half words from the converter, asked for by it, the address round and round.
            if not (self.runs() and count >> 17 & 0x3F == 48 and count >> 2 & 3 == 1 and self.registers[DMA] == ADC_FIFO):
                continue
            at = self.registers[DMA_WRITE]
            self.uc.mem_write(at, MIDDLE.to_bytes(2, "little"))
            ring = (1 << (count >> 8 & 15)) - 1
            self.registers[DMA_WRITE] = at & ~ring | at + 2 & ring
            if self.registers[DMA_COUNT] >> 28 != 0xF:
                self.dma_left -= 1
            self.samples += 1
        self.lit.append((self.now_us, self.led))
        # 12.9.6: ENABLE; the load in microseconds.
        if self.registers[WATCHDOG_CTRL] >> 30 & 1 and self.now_us - self.fed_us > self.registers[WATCHDOG_LOAD]:
            self.reset_ms = int(self.now_us / 1000)
            self.uc.emu_stop()
        if self.now_us > self.until_us:
            self.uc.emu_stop()

    def run(self, seconds):
        self.until_us = seconds * 1e6
        try:
            self.uc.emu_start(self.pc, 0xFFFF_FFFF)
        except UcError as error:
            raise RuntimeError(f"{error} at {self.uc.reg_read(UC_ARM_REG_PC):#x}") from error
        last = [led for at, led in self.lit if at > self.now_us - 1e6]
        lit = sum(last) / len(last)
        reset = "no" if self.reset_ms is None else self.reset_ms
        serial = NUMBER.decode() if NUMBER in bytes(self.uc.mem_read(RAM, RAM_BYTES)) else "none"
        return f"serial={serial} samples={self.samples // CONVERSIONS} reset={reset} polls={self.polls} lit={lit:.2f}"


if __name__ == "__main__":
    print(Machine(sys.argv[1]).run(float(sys.argv[2])))
