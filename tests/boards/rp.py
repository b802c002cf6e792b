"""Raspberry Pi's processors with the unmodified images for their boards: pico.py and pico2.py say where each has what; what they
have alike is here, by the RP2350's datasheet, whose sections stand beside it where they are not said to be another's.

Commands: board.py. An overrun of the converter: the next reading finds its FIFO full and is dropped. Beside them:

    free SECONDS     so long as it goes by itself, the converter at the middle of its range, time passing with each look at
                     the timer: `free samples=SAMPLES reset=no|MS polls=LOOKS AT USB lit=SHARE OF THE LAST SECOND`
    cut N PART       power goes in the flash's operation after N more (pages written, sectors erased), when PART of its bytes
                     are changed; told as `reset power` by the `run` in which that comes: `ok`

What it says nothing of beside that: USB's electrical side and its timing, the boot ROM's own code (what of RAM it uses at a
reset), cells of the flash that are half erased, the cores' differences of speed between flash and RAM.
"""

from collections import defaultdict

from board import CONVERSIONS, Board
from rp_rom import FLASH, KEPT_BYTES, PLACES_BYTES
from rp_time import (AL1_CTRL, CHANNEL_BYTES, CHANNELS, CTRL_TRIG, DMA, READ_ADDR, TRANS_COUNT, WRITE_ADDR, Time)
from rp_usb import INTS, Controller, Host
from unicorn import UC_ARCH_ARM, UC_MODE_MCLASS, UC_MODE_THUMB, Uc, UcError
from unicorn.arm_const import UC_ARM_REG_LR, UC_ARM_REG_PC

# 2.2.4, 2.2.5: each peripheral's block, with aliases that flip, set and clear bits (2.1.3).
APB, AHB, SIO, BLOCK = 0x4000_0000, 0x5000_0000, 0xD000_0000, 0x20_0000
USB_MEMORY, USB = 0x5010_0000, 0x5011_0000
LED = 25


class Machine(Time, Board):
    RAM = 0x2000_0000
    COMMANDS = (*Board.COMMANDS, "free", "cut")

    def __init__(self, elf):
        super().__init__(elf)
        self.rom = None
        self.power_on("power")

    def power_on(self, cause, ram=None):
        """`ram` is what a reset leaves; when power comes there is anything in it."""
        kept = self.rom.kept() if self.rom else b"\xff" * KEPT_BYTES
        self.uc = uc = Uc(UC_ARCH_ARM, UC_MODE_THUMB | UC_MODE_MCLASS)
        uc.ctl_set_cpu_model(self.CPU)
        for at, length in ((0, 32 << 10), (FLASH, self.FLASH_BYTES), (self.RAM, self.RAM_BYTES)):
            uc.mem_map(at, length)
        self.map_system()
        uc.mem_write(FLASH, b"\xff" * self.FLASH_BYTES)
        for at, data in self.image:
            uc.mem_write(at, data)
        self.rounds, self.waiting, self.trapped = 0, 0, None
        self.map_own()
        self.rom = self.make_rom(kept)
        uc.mem_write(self.RAM, ram or b"\xa5" * self.RAM_BYTES)
        for base in (APB, AHB, SIO):
            uc.mmio_map(base, BLOCK, lambda _, at, size, base: self.read(base + at, size), base,
                        lambda _, at, size, value, base: self.write(base + at, size, value), base)
        # What a reset by the watchdog leaves; 12.9.7: REASON, by its timer or forced.
        reason = {"power": 0, "watchdog": 1, "software": 2}[cause]
        self.registers = defaultdict(int, self.first() | {self.CHIP_RESET: self.HAD_POWER, self.WATCHDOG + 8: reason})
        self.begin()
        self.usb = Controller(self.USB_CONTROL, self.HAS_E5)
        self.host = Host(self.usb, self.bytes, self.sent)
        self.now_us, self.fed_us, self.rom_us, self.next_at, self.left = 0.0, 0.0, 0, None, 0
        self.free_us, self.made, self.polls, self.led, self.lit, self.is_overrun = None, 0, 0, 0, [], False
        self.boot()

    # What a chip may have beside.

    def map_own(self):
        pass

    def boot(self):
        pass

    def write_own(self, at, value):
        pass

    # The processor. It is stopped where the boot ROM is called, which is done here, and where SysTick is due at a read of
    # a register or at the LED, which is done again after it.

    def trap(self, name, returns=True):
        self.trapped = name, returns
        self.uc.emu_stop()

    def execute(self):
        self.go(0xFFFF_FFFF)

    def go(self, until):
        while True:
            if self.has_interrupt():
                self.interrupt()
            self.trapped, self.is_due = None, False
            try:
                self.uc.emu_start(self.pc, until)
            except UcError as error:
                raise RuntimeError(f"{error} at {self.uc.reg_read(UC_ARM_REG_PC):#x}") from error
            self.pc = self.uc.reg_read(UC_ARM_REG_PC) | 1
            if self.trapped is not None:
                name, returns = self.trapped
                self.rom.call(name)
                if returns:
                    self.pc = self.uc.reg_read(UC_ARM_REG_LR)
                if self.reset_by:
                    return
            elif not self.is_due or self.reset_by:
                return

    def stops_for_interrupt(self):
        if self.has_interrupt():
            self.is_due = True
            self.uc.emu_stop()
        return self.is_due

    def run(self):
        self.host.sent = sent = bytearray()
        answer = super().run().removeprefix("sent ")
        return f"sent {sent.hex()}{answer}"

    # Registers.

    def word(self, at):
        """The word, and how it is written; memory has no aliases, nor has SIO (2.1.3, 3.1)."""
        if USB_MEMORY <= at < USB_MEMORY + 0x1000 or at >= SIO or self.own(at):
            return at & ~3, 0
        return at & ~0x3003, at >> 12 & 3

    def is_of_channel(self, word):
        return DMA <= word < DMA + CHANNELS * CHANNEL_BYTES

    def read(self, at, size):
        if self.stops_for_interrupt():
            return 0
        word, _ = self.word(at)
        if self.is_of_channel(word) and word % CHANNEL_BYTES == AL1_CTRL:
            word += CTRL_TRIG - AL1_CTRL
        value = self.registers[word]
        if USB_MEMORY <= word < USB_MEMORY + 0x1000:
            value = self.usb.word(word - USB_MEMORY)
        elif USB <= word < USB + 0x200:
            if word == USB + INTS:
                self.polls += 1
                self.host.step()
            value = self.usb.read(word - USB)
        elif self.own(word):
            value = self.read_own(word)
        elif word == self.RESETS + 8:  # 7.5.3: RESET_DONE
            value = ~self.registers[self.RESETS]
        elif word == self.XOSC + 4:  # 8.2.8: STABLE, ENABLED
            value = 1 << 31 | 1 << 12
        elif word in (self.PLL_SYS, self.PLL_USB):  # 8.6.5: LOCK
            value |= 1 << 31
        elif word in (self.CLOCKS + 0x38, self.CLOCKS + 0x44):  # 8.1.6: SELECTED, one bit for each source
            value = 1 << (self.registers[word - 8] & 3)
        elif self.CLOCKS <= word < self.CLOCKS + 0x78 and (word - self.CLOCKS) % 12 == 8:
            value = 1
        elif word in (self.TIMER + 0x24, self.TIMER + 0x28):  # 12.8.5: TIMERAWH, TIMERAWL
            if word == self.TIMER + 0x28 and not self.handling:
                self.look()
            value = int(self.now_us) >> (32 if word == self.TIMER + 0x24 else 0)
        elif word == self.ADC:  # 12.4.6: READY
            value |= 1 << 8
        elif word == self.ADC + 8:  # 12.4.6: EMPTY; DMA has taken all
            value |= 1 << 8
        elif word == DMA + CTRL_TRIG:  # 12.6.10: BUSY
            value = value & ~self.BUSY | self.BUSY * bool(self.left)
        elif SIO + 0x100 <= word < SIO + 0x180:  # 3.1.4: a spinlock that was free
            value = 1
        return value >> 8 * (at & 3) & (1 << 8 * size) - 1

    def write(self, at, size, value):
        word, how = self.word(at)
        starts = True
        if self.is_of_channel(word):
            offset = word % CHANNEL_BYTES
            assert offset in (READ_ADDR, WRITE_ADDR, TRANS_COUNT, CTRL_TRIG, AL1_CTRL), f"DMA's register at {offset:#x}"
            starts = offset == CTRL_TRIG
            word += (CTRL_TRIG - AL1_CTRL) * (offset == AL1_CTRL)
        in_memory = USB_MEMORY <= word < USB_MEMORY + 0x1000
        of_usb = USB <= word < USB + 0x200
        shift = 8 * (at & 3)
        old = self.usb.word(word - USB_MEMORY) if in_memory else self.usb.get(word - USB) if of_usb else self.registers[word]
        mask = (1 << 8 * size) - 1 << shift
        value = value << shift & mask
        value = (old & ~mask | value, old ^ value, old | value, old & ~value)[how]
        if in_memory:
            self.usb.word(word - USB_MEMORY, value)
            return
        if of_usb:
            self.usb.write(word - USB, value)
            return
        self.write_own(word, value)
        if word in (self.OUT_SET, self.OUT_CLR):
            self.stops_for_interrupt()
            if value >> LED & 1:
                self.led = int(word == self.OUT_SET)
            return
        if word == self.ADC + 8:  # 12.4.6: OVER and UNDER are cleared by ones
            value = value & ~0xC00 | old & ~value & 0xC00
        self.registers[word] = value
        if word == self.WATCHDOG + 4:
            self.fed_us = self.now_us
        elif word == self.WATCHDOG and value >> 31:
            self.registers[word] &= ~(1 << 31)
            self.bite("software")
        elif self.is_of_channel(word) and starts:  # 12.6.2: a write to the trigger register begins so many transfers
            self.start_channel((word - DMA) // CHANNEL_BYTES)
        elif word == self.DMA_ABORT:
            enabled = [k for k in range(CHANNELS) if value >> k & 1 and self.channel(k, CTRL_TRIG) & 1]
            assert not enabled, "a channel is aborted that another one may start again (RP2350-E5)"
            self.registers[word] = 0
            if value & 1:
                self.left = 0
        elif word == self.ADC:
            self.start_converter(old, value)

    def bite(self, cause):
        """The watchdog resets what PSM's WDSEL names, which is nothing when power has come (7.4)."""
        if self.registers[self.PSM + 8]:
            self.restart(cause)

    # Commands.

    def stall(self, text):
        self.stalled_us = 0
        return super().stall(text)

    def overrun(self):
        self.is_overrun = True

    def cut(self, after, part):
        self.rom.cut_after, self.rom.cut_part = int(after), float(part)

    def free(self, seconds):
        self.made, self.polls, self.lit, self.free_rest_us = 0, 0, [], 0.0
        self.free_us = self.now_us + float(seconds) * 1e6
        self.execute()
        last = [led for at, led in self.lit if at > self.now_us - 1e6]
        answer = (f"free samples={self.made // CONVERSIONS} reset={self.reset_by or 'no'} polls={self.polls} "
                  f"lit={sum(last) / len(last):.2f}")
        self.free_us = None
        return answer

    def flash(self):
        # As the device sees it: its places first, which are the last.
        log, places = self.rom.kept()[:-PLACES_BYTES], self.rom.kept()[-PLACES_BYTES:]
        return "flash " + (places + log).hex()

    def state(self):
        names = " ".join(f"{name}={self.host.string(k)}" for k, name in enumerate(("maker", "product", "serial")))
        return (f"state rate_hz={1e6 / self.period_us} usb_hz={self.clock_hz(self.CLK_USB)} processor_hz={self.processor_hz()} "
                f"timer_hz={self.tick_hz('timer')} watchdog_hz={self.tick_hz('watchdog')} rounds={self.rounds} "
                f"interrupts={self.interrupts} {names}")
