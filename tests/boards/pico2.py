"""An RP2350 that executes the unmodified image for Raspberry Pi's Pico 2: unicorn is its Cortex-M33, the registers that the
image uses are modelled here from the RP2350's datasheet, whose sections stand beside them.

    pico2.py ELF

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
from pico2_rom import BOOT_RAM, FLASH, FLASH_BYTES, KEPT_BYTES, TRAP, Rom
from pico2_usb import INTS, Controller, Host
from unicorn import UC_ARCH_ARM, UC_MODE_MCLASS, UC_MODE_THUMB, Uc
from unicorn.arm_const import UC_ARM_REG_LR, UC_CPU_ARM_CORTEX_M33

# 2.2.4, 2.2.5: each peripheral's block, with aliases that flip, set and clear bits (2.1.3).
APB, AHB, SIO, BLOCK = 0x4000_0000, 0x5000_0000, 0xD000_0000, 0x20_0000
CLOCKS, RESETS, XOSC, PLL_SYS, PLL_USB = 0x4001_0000, 0x4002_0000, 0x4004_8000, 0x4005_0000, 0x4005_8000
CLK_ADC, CLK_USB = CLOCKS + 0x6C, CLOCKS + 0x60
ADC, TIMER0, WATCHDOG, POWMAN, TICKS = 0x400A_0000, 0x400B_0000, 0x400D_8000, 0x4010_0000, 0x4010_8000
DMA, USB_MEMORY, USB = 0x5000_0000, 0x5010_0000, 0x5011_0000
ADC_CS, ADC_FCS, ADC_DIV, ADC_FIFO = ADC, ADC + 8, ADC + 0x10, ADC + 0xC
DMA_WRITE, DMA_COUNT, DMA_CTRL, DMA_ABORT = DMA + 4, DMA + 8, DMA + 0xC, DMA + 0x464
WATCHDOG_CTRL, WATCHDOG_LOAD, WATCHDOG_REASON = WATCHDOG, WATCHDOG + 4, WATCHDOG + 8
TIMER_TICK, WATCHDOG_TICK = TICKS + 0x18, TICKS + 0x30
CHIP_RESET = POWMAN + 0x2C
OTP_DATA = 0x4013_0000
# 13.10: CHIPID0 to CHIPID3, two rows a word (13.1.1).
CHIP_ID = {OTP_DATA: 0x6F5E_4D3C, OTP_DATA + 4: 0xA1C9_0B7A}
CRYSTAL_HZ, MIDDLE, LED = 12_000_000, 2048, 25
OVER = 1 << 11  # 12.4.6: ADC_FCS
CONVERSION_US = 2  # 12.4: 96 cycles of 48 MHz
# With a look at the timer: while it goes by itself; while nothing is converted.
LOOK_US, STALLED_US = 10, 100
# Looks after which nothing is left to say.
QUIET_LOOKS = 200


class Machine(Board):
    VECTORS, RAM, RAM_BYTES = FLASH, 0x2000_0000, 520 * 1024
    COMMANDS = (*Board.COMMANDS, "free", "cut")

    def __init__(self, elf):
        super().__init__(elf)
        self.rom = None
        self.power_on("power")

    def power_on(self, cause, ram=None):
        """`ram` is what a reset leaves; when power comes there is anything in it."""
        kept = self.rom.kept() if self.rom else b"\xff" * KEPT_BYTES
        self.uc = uc = Uc(UC_ARCH_ARM, UC_MODE_THUMB | UC_MODE_MCLASS)
        uc.ctl_set_cpu_model(UC_CPU_ARM_CORTEX_M33)
        for at, length in ((0, 32 << 10), (FLASH, FLASH_BYTES), (self.RAM, self.RAM_BYTES), (0xE000_0000, 1 << 20)):
            uc.mem_map(at, length)
        uc.mem_write(FLASH, b"\xff" * FLASH_BYTES)
        for at, data in self.image:
            uc.mem_write(at, data)
        self.rom, self.trapped = Rom(self, kept), None
        uc.mem_write(self.RAM, ram or b"\xa5" * self.RAM_BYTES)
        for base in (APB, AHB, SIO):
            uc.mmio_map(base, BLOCK, lambda _, at, size, base: self.read(base + at, size), base,
                        lambda _, at, size, value, base: self.write(base + at, size, value), base)
        # 6.4: HAD_POR, which a reset by the watchdog leaves; 12.9.7: REASON, by its timer or forced.
        reason = {"power": 0, "watchdog": 1, "software": 2}[cause]
        self.registers = defaultdict(int, CHIP_ID | {CHIP_RESET: 1 << 16, WATCHDOG_REASON: reason})
        self.begin()
        self.usb = Controller()
        self.host = Host(self.usb, self.bytes, self.sent)
        self.now_us, self.fed_us, self.rom_us, self.next_at, self.dma_runs = 0.0, 0.0, 0, None, False
        self.free_us, self.made, self.polls, self.led, self.lit, self.is_overrun = None, 0, 0, 0, [], False

    def execute(self):
        while True:
            self.trapped = None
            super().execute()
            if self.trapped is None:
                return
            self.rom.call(self.trapped)
            # Where the stub stopped in its store or behind it: it has returned.
            self.pc = self.uc.reg_read(UC_ARM_REG_LR)
            if self.reset_by:
                return

    def run(self):
        self.host.sent = sent = bytearray()
        answer = super().run().removeprefix("sent ")
        return f"sent {sent.hex()}{answer}"

    # Registers.

    def word(self, at):
        """The word, and how it is written; memory has no aliases, nor has SIO (2.1.3, 3.1)."""
        if USB_MEMORY <= at < USB_MEMORY + 0x1000 or at >= SIO or BOOT_RAM <= at < BOOT_RAM + 0x400:
            return at & ~3, 0
        return at & ~0x3003, at >> 12 & 3

    def read(self, at, size):
        word, _ = self.word(at)
        value = self.registers[word]
        if USB_MEMORY <= word < USB_MEMORY + 0x1000:
            value = self.usb.word(word - USB_MEMORY)
        elif USB <= word < USB + 0x200:
            if word == USB + INTS:
                self.polls += 1
                self.host.step()
            value = self.usb.read(word - USB)
        elif word >= TRAP and word < TRAP + 0x200 or BOOT_RAM <= word < BOOT_RAM + 0x400:
            value = self.rom.read(word)
        elif word == RESETS + 8:  # 7.5.3: RESET_DONE
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
            if word == TIMER0 + 0x28:
                self.look()
            value = int(self.now_us) >> (32 if word == TIMER0 + 0x24 else 0)
        elif word == ADC_CS:  # 12.4.6: READY
            value |= 1 << 8
        elif word == ADC_FCS:  # 12.4.6: EMPTY; DMA has taken all
            value |= 1 << 8
        elif word == DMA_CTRL:  # 12.6.10: BUSY
            value = value & ~(1 << 26) | (self.dma_runs << 26)
        elif SIO + 0x100 <= word < SIO + 0x180:  # 3.1.4: a spinlock that was free
            value = 1
        return value >> 8 * (at & 3) & (1 << 8 * size) - 1

    def write(self, at, size, value):
        word, how = self.word(at)
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
        if TRAP <= word < TRAP + 0x200:
            self.rom.write(word, value)
            return
        if word == SIO + 0x18 or word == SIO + 0x20:  # 3.1.3: GPIO_OUT_SET, GPIO_OUT_CLR
            if value >> LED & 1:
                self.led = int(word == SIO + 0x18)
            return
        if word == ADC_FCS:  # 12.4.6: OVER and UNDER are cleared by ones
            value = value & ~0xC00 | old & ~value & 0xC00
        self.registers[word] = value
        if word == WATCHDOG_LOAD:
            self.fed_us = self.now_us
        elif word == WATCHDOG_CTRL and value >> 31:
            self.registers[word] &= ~(1 << 31)
            self.restart("software")
        elif word == DMA_CTRL:  # 12.6.2: a write to the trigger register begins a sequence of so many transfers
            # 12.6.2.2.1: with a count of zero a channel halts at once in any mode.
            self.dma_runs = bool(value & 1 and self.registers[DMA_COUNT] & 0x0FFF_FFFF)
        elif word == DMA_ABORT:
            self.dma_runs, self.registers[word] = False, 0
        elif word == ADC_CS:
            self.start_converter(old, value)

    # The converter and time. A sample that is given is sixteen conversions. Time stands where the first one of the next sample
    # has been made and its value is not known yet: the program reads it when it has all sixteen.

    def clock_hz(self, clock):
        """8.1.6, 8.6.5: USB's and the converter's clock, from the PLL that is for them."""
        control, pll = self.registers[clock], PLL_USB
        assert control >> 11 & 1 and control >> 5 & 7 == 0, "not enabled, or from another source"
        post = self.registers[pll + 0xC]
        made = CRYSTAL_HZ // (self.registers[pll] & 63) * (self.registers[pll + 8] & 0xFFF)
        return made / (post >> 16 & 7) / (post >> 12 & 7) / max(self.registers[clock + 4] >> 16 & 15, 1)

    def ticks_hz(self, tick):
        """8.5: cycles of the reference clock, here the crystal (8.1.6: CLK_REF from XOSC), to a tick."""
        assert self.registers[tick] & 1 and self.registers[CLOCKS + 0x30] & 3 == 2, "no tick from the crystal"
        return CRYSTAL_HZ / self.registers[tick + 4]

    def start_converter(self, old, value):
        # 12.4.6: EN, START_MANY.
        if value & 9 == 9 and old & 9 != 9 and not self.stall_ms:
            self.period_us = 1e6 * ((self.registers[ADC_DIV] >> 8) + 1) / self.clock_hz(CLK_ADC)
            self.pass_us(CONVERSION_US)
            self.next_at = self.next_place()
        elif value & 9 != 9:
            self.next_at = None

    def next_place(self):
        """Where DMA writes a reading, and goes on."""
        if self.registers[ADC_FCS] & OVER:
            return None
        control = self.registers[DMA_CTRL]
        # 12.6.10, 12.6.4.1: half words from the converter, asked for by it, the address round and round.
        right = control >> 17 & 0x3F == 48 and control >> 2 & 3 == 1 and control >> 6 & 1 and control >> 12 & 1
        assert self.dma_runs and right and self.registers[DMA] == ADC_FIFO, "DMA does not take the converter's readings"
        assert self.registers[ADC_FCS] & 9 == 9 and self.registers[ADC_CS] >> 12 & 15 == 0, "no FIFO, or another input"
        assert self.registers[DMA_COUNT] >> 28 == 0xF, "DMA ends"
        at, ring = self.registers[DMA_WRITE], (1 << (control >> 8 & 15)) - 1
        self.registers[DMA_WRITE] = at & ~ring | at + 2 & ring
        return at

    def convert(self, value):
        if self.next_at is not None:
            self.uc.mem_write(self.next_at, value.to_bytes(2, "little"))
        self.made += 1
        if self.is_overrun:
            self.is_overrun = False
            self.registers[ADC_FCS] |= OVER
        self.pass_us(self.period_us)
        self.next_at = self.next_place()

    def pass_us(self, us):
        self.now_us += us
        # 12.9.6: ENABLE; the load in microseconds.
        if self.registers[WATCHDOG_CTRL] >> 30 & 1 and self.now_us - self.fed_us > self.registers[WATCHDOG_LOAD]:
            self.restart("watchdog")

    def sample(self):
        """A millisecond goes by, if its readings are given."""
        if not self.wanted:
            return
        assert self.registers[ADC_CS] & 9 == 9, "readings are given to a converter that is not on"
        for reading in self.wanted[:CONVERSIONS]:
            self.convert(reading)
        del self.wanted[:CONVERSIONS]
        self.quiet = 0

    def stand_still(self):
        self.next_at = None
        self.pass_us(STALLED_US)
        self.stalled_us += STALLED_US
        if self.stalled_us >= 1000:
            self.stalled_us = 0
            self.stall_ms -= 1
            if not self.stall_ms and self.registers[ADC_CS] & 9 == 9:
                self.next_at = self.next_place()

    def look(self):
        """The main loop looks at the timer: time goes by, but not while the host and the device have something to say."""
        if self.free_us is not None:
            self.go_by_itself()
            return
        if self.host.is_quiet():
            self.quiet += 1
            if self.quiet > 2:
                if self.stall_ms:
                    self.stand_still()
                    self.quiet = 3
                else:
                    self.sample()
        else:
            self.quiet = 0
        if self.quiet > QUIET_LOOKS:
            self.uc.emu_stop()

    def pass_in_rom(self, us):
        """The processor is in the boot ROM; conversions and USB go on."""
        self.rom_us += us
        while self.rom_us >= 1000:
            self.rom_us -= 1000
            self.host.step()
            self.sample()

    def go_by_itself(self):
        if self.next_at is None:
            self.pass_us(LOOK_US)
        else:
            self.free_rest_us += LOOK_US
            while self.free_rest_us >= self.period_us:
                self.free_rest_us -= self.period_us
                self.convert(MIDDLE)
        self.lit.append((self.now_us, self.led))
        if self.now_us >= self.free_us:
            self.uc.emu_stop()

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
        return "flash " + self.rom.kept().hex()

    def state(self):
        names = " ".join(f"{name}={self.host.string(k)}" for k, name in enumerate(("maker", "product", "serial")))
        return (f"state rate_hz={1e6 / self.period_us} usb_hz={self.clock_hz(CLK_USB)} timer_hz={self.ticks_hz(TIMER_TICK)} "
                f"watchdog_hz={self.ticks_hz(WATCHDOG_TICK)} {names}")


if __name__ == "__main__":
    Machine.main()
