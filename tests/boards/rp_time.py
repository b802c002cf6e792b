"""How time goes by in Raspberry Pi's processors, and what goes with it: clocks, converter, DMA, SysTick and the watchdog, by the
RP2350's datasheet, whose sections stand beside them.
"""

import struct

from board import CONVERSIONS

DMA = 0x5000_0000
# 12.6: a channel's registers, and its control and its count once more, the one that starts nothing, the other that does.
CHANNEL_BYTES, CHANNELS = 0x40, 12
READ_ADDR, WRITE_ADDR, TRANS_COUNT, CTRL_TRIG, AL1_CTRL, AL1_TRANS_COUNT_TRIG = 0, 4, 8, 0xC, 0x10, 0x1C
RING_SEL_AFTER_SIZE, PERMANENT, WORDS, HALF_WORDS = 4, 0x3F, 2, 1
CRYSTAL_HZ, MIDDLE = 12_000_000, 2048
OVER = 1 << 11  # 12.4.6: ADC_FCS
CONVERSION_US = 2  # 12.4: 96 cycles of 48 MHz
# With a look at the timer: while it goes by itself; while nothing is converted.
LOOK_US, STALLED_US = 40, 100
# Looks after which nothing is left to say.
QUIET_LOOKS = 200


class Time:
    # DMA (12.6): one channel takes readings, another one may start it again.

    def channel(self, number, offset):
        return self.registers[DMA + CHANNEL_BYTES * number + offset]

    def start_channel(self, number):
        control = self.channel(number, CTRL_TRIG)
        if not control & 1:
            return
        if number == 0:
            # With a count of zero a channel halts at once.
            self.left = self.channel(0, TRANS_COUNT) & self.COUNT
            return
        source, to, count = (self.channel(number, k) for k in (READ_ADDR, WRITE_ADDR, TRANS_COUNT))
        right = control >> 2 & 3 == WORDS and control >> self.TREQ & 0x3F == PERMANENT and count == 1
        right = right and not control >> 4 & 1 and not control >> self.INCR_WRITE & 1
        assert right and control >> self.CHAIN_TO & 15 == number, f"DMA's channel {number}: {control:#x}"
        assert self.RAM <= source < self.RAM + self.RAM_BYTES, "DMA reads what may be closed"
        assert to == DMA + AL1_TRANS_COUNT_TRIG, f"DMA writes to {to:#x}"
        self.registers[DMA + TRANS_COUNT], = struct.unpack("<I", bytes(self.uc.mem_read(source, 4)))
        self.start_channel(0)

    # The converter and time. A sample that is given is sixteen conversions. Time stands where the first one of the next sample
    # has been made and its value is not known yet: the program reads it when it has all sixteen.

    def clock_hz(self, clock):
        """8.1.6, 8.6.5: USB's and the converter's clock, from the PLL that is for them."""
        control = self.registers[clock]
        assert control >> 11 & 1 and control >> 5 & 7 == 0, "not enabled, or from another source"
        return self.pll_hz(self.PLL_USB) / max(self.registers[clock + 4] >> self.DIVIDER_AT & 3, 1)

    def pll_hz(self, pll):
        post = self.registers[pll + 0xC]
        made = CRYSTAL_HZ // (self.registers[pll] & 63) * (self.registers[pll + 8] & 0xFFF)
        return made / (post >> 16 & 7) / (post >> 12 & 7)

    def processor_hz(self):
        """8.1.6: CLK_SYS from its auxiliary source, PLL_SYS, undivided."""
        control = self.registers[self.CLOCKS + 0x3C]
        assert control & 1 and control >> 5 & 7 == 0, "the processor's clock is another"
        return self.pll_hz(self.PLL_SYS)

    def crystal_is_reference(self):
        return self.registers[self.CLOCKS + 0x30] & 3 == 2

    def start_converter(self, old, value):
        # 12.4.6: EN, START_MANY.
        if value & 9 == 9 and old & 9 != 9 and not self.stall_ms:
            self.period_us = 1e6 * ((self.registers[self.ADC + 0x10] >> 8) + 1) / self.clock_hz(self.CLK_ADC)
            self.pass_us(CONVERSION_US)
            self.next_at = self.next_place()
        elif value & 9 != 9:
            self.next_at = None

    def next_place(self):
        """Where DMA writes a reading, and goes on."""
        if self.registers[self.ADC + 8] & OVER:
            return None
        control = self.registers[DMA + CTRL_TRIG]
        # 12.6.10, 12.6.4.1: half words from the converter, asked for by it, the address round and round.
        right = (control >> self.TREQ & 0x3F == self.DREQ_ADC and control >> 2 & 3 == HALF_WORDS and not control >> 4 & 1
                 and control >> self.INCR_WRITE & 1 and control >> self.RING_SIZE + RING_SEL_AFTER_SIZE & 1)
        assert self.left and right and self.registers[DMA] == self.ADC + 0xC, "DMA does not take the converter's readings"
        assert self.registers[self.ADC + 8] & 9 == 9 and self.registers[self.ADC] >> 12 & 15 == 0, "no FIFO, or another input"
        at, ring = self.registers[DMA + WRITE_ADDR], (1 << (control >> self.RING_SIZE & 15)) - 1
        self.registers[DMA + WRITE_ADDR] = at & ~ring | at + 2 & ring
        self.left -= 1
        chain = control >> self.CHAIN_TO & 15
        if not self.left and chain:
            self.start_channel(chain)
            self.rounds += 1
        return at

    def convert(self, value):
        if self.next_at is not None:
            self.uc.mem_write(self.next_at, value.to_bytes(2, "little"))
        self.made += 1
        if self.is_overrun:
            self.is_overrun = False
            self.registers[self.ADC + 8] |= OVER
        self.pass_us(self.period_us)
        self.next_at = self.next_place()

    def pass_us(self, us):
        self.now_us += us
        # 12.9.6: ENABLE; the load in ticks, which are microseconds.
        load = self.registers[self.WATCHDOG + 4] / self.WATCHDOG_TICKS
        if self.registers[self.WATCHDOG] >> 30 & 1 and self.now_us - self.fed_us > load:
            self.bite("watchdog")
        self.time_is(self.now_us, 1e6)

    def sample(self):
        """A millisecond goes by, if its readings are given."""
        if not self.wanted:
            return
        assert self.registers[self.ADC] & 9 == 9, "readings are given to a converter that is not on"
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
            if not self.stall_ms and self.registers[self.ADC] & 9 == 9:
                self.next_at = self.next_place()

    def look(self):
        """The main loop looks at the timer: time goes by, but not while the host and the device have something to say."""
        if self.free_us is not None:
            self.go_by_itself()
            return
        if self.waiting:
            # A look takes one of the samples that came while the processor was in the boot ROM.
            self.waiting -= 1
        elif self.host.is_quiet():
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
            self.waiting += bool(self.wanted)
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
